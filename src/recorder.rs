//! Records a plan: each step gets its barriers, each pass its label and timestamps, each call its pipeline and set.

use crate::{
    Error,
    access::{Access, Barrier, State},
    device::Host,
    input::{SceneInput, SurfaceOutputs},
    pipeline::{Pipeline, Pipelines},
    plan::{Call, External, Groups, Home, Made, Plan, Rendering, Step, Target, Vertices, Work},
    profile::Profiler,
    resources::Resource,
    shader::{self, Binding, Kind},
    table::Table,
    work::{Command, WorkEntry},
};
use ash::vk;

/// What a frame uses and does not own, or owns per slot.
#[derive(Clone, Copy, Default)]
pub(crate) struct Externals {
    pub frame_block: vk::Buffer,
    /// Buffer, offset and range of the host's positions.
    pub positions: (vk::Buffer, u64, u64),
    /// The same of how many they are.
    pub count: (vk::Buffer, u64, u64),
    /// The same of their ids.
    pub ids: (vk::Buffer, u64, u64),
    /// Centres and shapes, where the host prepared them.
    pub particles: [vk::Buffer; 3],
    /// How fast they are, where the host said so.
    pub speeds: vk::Buffer,
    /// What a density field is made of, where the host said so.
    pub points: vk::Buffer,
    /// The host's, or the renderer's own.
    pub environment: (vk::ImageView, vk::ImageLayout),
    pub scene: Option<SceneInput>,
    /// With the layout it is in.
    pub output: (vk::ImageView, vk::ImageLayout),
    /// Where the view begins in what the host gives to be drawn into.
    pub origin: [u32; 2],
    pub surface: SurfaceOutputs,
    /// Particles that move, how, and how many they are: as positions.
    pub moving: [(vk::Buffer, u64, u64); 3],
}

/// One barrier of a recorded frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PlanEntry {
    /// The pass it stands before.
    pub pass: &'static str,
    /// The resource.
    pub resource: &'static str,
    /// Stages, accesses and layouts.
    pub barrier: Barrier,
}

impl std::fmt::Display for PlanEntry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let side = |(stage, access, layout): (_, _, _)| format!("{stage:?} / {access:?} / {layout:?}");
        write!(f, "{:<10} {:<28} {}  ->  {}", self.pass, self.resource, side(self.barrier.src), side(self.barrier.dst))
    }
}

pub(crate) struct Recorder<'a> {
    pub host: &'a Host,
    pub cmd: vk::CommandBuffer,
    pub plan: &'a Plan,
    pub pipelines: &'a Pipelines,
    /// Of the particles, and of the view.
    pub tables: [&'a mut Table; 2],
    pub externals: Externals,
    pub pool: vk::DescriptorPool,
    pub profiler: Option<&'a mut Profiler>,
    #[cfg(feature = "inspect")]
    pub statistics: Option<&'a mut crate::statistics::Statistics>,
    pub barriers: &'a mut Vec<PlanEntry>,
    /// What the device is given to do.
    pub work: &'a mut Vec<WorkEntry>,
    /// What has happened to the frame block since the host wrote it.
    pub frame_block: State,
}

impl Recorder<'_> {
    /// Records every step.
    pub fn record(mut self) -> Result<(), Error> {
        let plan = self.plan;
        for pass in plan.steps.chunk_by(|a, b| a.pass == b.pass) {
            let name = pass[0].pass;
            if let Some(utils) = &self.host.debug_utils {
                let label = std::ffi::CString::new(format!("meniscus {name}")).unwrap_or_default();
                // SAFETY: `cmd` is recording (contract of `Renderer::record`); the label outlives the call.
                unsafe {
                    utils.cmd_begin_debug_utils_label(self.cmd, &vk::DebugUtilsLabelEXT::default().label_name(&label))
                };
            }
            if let Some(p) = &mut self.profiler {
                p.begin(&self.host.device, self.cmd, &pass[0]);
            }
            #[cfg(feature = "inspect")]
            if let Some(s) = &mut self.statistics {
                s.begin(&self.host.device, self.cmd, name);
            }
            let recorded = pass.iter().try_for_each(|step| self.step(step));
            #[cfg(feature = "inspect")]
            if let Some(s) = &self.statistics {
                s.end(&self.host.device, self.cmd);
            }
            if let Some(p) = &mut self.profiler {
                p.end(&self.host.device, self.cmd);
            }
            if let Some(utils) = &self.host.debug_utils {
                // SAFETY: closes the label begun above.
                unsafe { utils.cmd_end_debug_utils_label(self.cmd) };
            }
            recorded?;
        }
        Ok(())
    }

    fn step(&mut self, step: &Step) -> Result<(), Error> {
        self.barriers(step.pass, &step.uses)?;
        let (device, cmd) = (&self.host.device, self.cmd);
        match &step.work {
            Work::Fill { buffer, offset, bytes, word } => {
                let handle = self.buffer(*buffer)?.0;
                // SAFETY: `cmd` is recording outside rendering; the range lies inside the buffer, whose use as the
                // destination of a transfer was declared with this step.
                unsafe { device.cmd_fill_buffer(cmd, handle, *offset, *bytes, *word) };
                let whole = self.plan.bytes(*buffer).filter(|_| *bytes == vk::WHOLE_SIZE);
                let command = Command::Fill { bytes: whole.map_or(*bytes, |all| all - offset) };
                self.work.push(WorkEntry { pass: step.pass, shader: "", command });
            }
            Work::Dispatch { call, groups } => {
                self.bind(step.pass, call)?;
                let command = match *groups {
                    Groups::Direct([x, y, z]) => {
                        // SAFETY: a compute pipeline, its set and its constants are bound.
                        unsafe { device.cmd_dispatch(cmd, x, y, z) };
                        Command::Dispatch { groups: [x, y, z] }
                    }
                    Groups::Indirect(arguments, offset) => {
                        let handle = self.buffer(arguments)?.0;
                        // SAFETY: as above; the arguments were declared as such with this step.
                        unsafe { device.cmd_dispatch_indirect(cmd, handle, offset) };
                        Command::DispatchIndirect { buffer: self.plan.resource(arguments).name, offset }
                    }
                };
                self.work.push(WorkEntry { pass: step.pass, shader: call.recipe.name(), command });
            }
            Work::Render { rendering, draws } => {
                self.begin_rendering(rendering)?;
                let drawn =
                    draws.iter().try_for_each(|(call, vertices)| self.draw(step.pass, rendering, call, vertices));
                // SAFETY: ends the rendering begun above.
                unsafe { device.cmd_end_rendering(cmd) };
                drawn?;
            }
        }
        Ok(())
    }

    fn draw(
        &mut self,
        pass: &'static str,
        rendering: &Rendering,
        call: &Call,
        vertices: &Vertices,
    ) -> Result<(), Error> {
        let (device, cmd) = (&self.host.device, self.cmd);
        self.bind(pass, call)?;
        if let Some(depth) = &rendering.depth {
            // SAFETY: `cmd` is recording, and the pipeline has this state as a dynamic one.
            unsafe { device.cmd_set_depth_compare_op(cmd, depth.compare) };
        }
        let command = match *vertices {
            Vertices::Direct(count) => {
                // SAFETY: inside rendering, with a graphics pipeline, its set and its constants bound.
                unsafe { device.cmd_draw(cmd, count, 1, 0, 0) };
                Command::Draw { vertices: count }
            }
            Vertices::Indirect(arguments, offset) => {
                let handle = self.buffer(arguments)?.0;
                // SAFETY: as above; the arguments were declared as such with this step.
                unsafe { device.cmd_draw_indirect(cmd, handle, offset, 1, 0) };
                Command::DrawIndirect { buffer: self.plan.resource(arguments).name, offset }
            }
        };
        self.work.push(WorkEntry { pass, shader: call.recipe.name(), command });
        Ok(())
    }

    /// Emits what the declared uses need, as one pipeline barrier.
    pub fn barriers(&mut self, pass: &'static str, uses: &[(Target, Access)]) -> Result<(), Error> {
        let (mut images, mut buffers) = (Vec::new(), Vec::new());
        for (target, access) in uses {
            let declared = self.plan.resource(*target);
            let name = declared.name;
            let mut note = |barrier| self.barriers.push(PlanEntry { pass, resource: name, barrier });
            match declared.made {
                // One state for the blocks of all scales: they lie in one buffer.
                Made::Given(External::FrameBlock(_)) => {
                    if let Some(barrier) = self.frame_block.step(*access, false) {
                        note(barrier);
                        buffers.push(barrier.on_buffer(self.externals.frame_block));
                    }
                }
                // The host's own, and what only the host has written.
                Made::Given(_) => {}
                Made::Own(_) => {
                    let table = &mut self.tables[usize::from(declared.home == Home::View)];
                    let entry = table.get_mut(name).ok_or_else(|| absent(pass, name))?;
                    let is_image = matches!(entry.resource, Resource::Image(_));
                    let Some(barrier) = entry.state.step(*access, is_image) else { continue };
                    note(barrier);
                    match &entry.resource {
                        Resource::Image(image) => images.push(barrier.on_image(image.handle, image.aspect)),
                        Resource::Buffer(buffer) => buffers.push(barrier.on_buffer(buffer.handle)),
                    }
                }
            }
        }
        if images.is_empty() && buffers.is_empty() {
            return Ok(());
        }
        let info = vk::DependencyInfo::default().image_memory_barriers(&images).buffer_memory_barriers(&buffers);
        // SAFETY: `cmd` is recording outside rendering; the handles are alive and the layouts tracked.
        unsafe { self.host.device.cmd_pipeline_barrier2(self.cmd, &info) };
        Ok(())
    }

    /// Binds a call's pipeline, a descriptor set of what it names, and its push constants.
    fn bind(&self, pass: &'static str, call: &Call) -> Result<(), Error> {
        let (device, cmd) = (&self.host.device, self.cmd);
        let missing = || Error::Pass { pass, problem: format!("no pipeline of {}", call.recipe.name()) };
        let pipeline = self.pipelines.get(&call.recipe).ok_or_else(missing)?;
        let set = self.descriptor_set(pipeline, call)?;
        // SAFETY: `cmd` is recording; pipeline and set are alive and belong together; the block is as long as the
        // layout's range.
        unsafe {
            device.cmd_bind_pipeline(cmd, pipeline.bind_point, pipeline.handle);
            device.cmd_bind_descriptor_sets(cmd, pipeline.bind_point, pipeline.layout, 0, &[set], &[]);
            if !call.push.is_empty() {
                device.cmd_push_constants(cmd, pipeline.layout, pipeline.stages, 0, &call.push);
            }
        }
        Ok(())
    }

    fn descriptor_set(&self, pipeline: &Pipeline, call: &Call) -> Result<vk::DescriptorSet, Error> {
        let device = &self.host.device;
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pool).set_layouts(&layouts);
        // SAFETY: the pool belongs to this slot, whose last frame has completed, and was made for this plan.
        let set = unsafe { device.allocate_descriptor_sets(&info) }.map_err(Error::vulkan("descriptor set"))?[0];
        let (mut image_infos, mut buffer_infos, mut views) = (Vec::new(), Vec::new(), Vec::new());
        for (b, target, access) in &call.bound {
            match b.kind {
                Kind::SampledImage(_) | Kind::StorageImage(..) => {
                    let (view, layout) = self.view(*target, *access)?;
                    image_infos.push((b, [vk::DescriptorImageInfo::default().image_view(view).image_layout(layout)]));
                }
                Kind::TexelBuffer => views.push((b, [self.texels(*target)?])),
                _ => {
                    let (buffer, offset, range) = self.buffer(*target)?;
                    buffer_infos.push((b, [vk::DescriptorBufferInfo { buffer, offset, range }]));
                }
            }
        }
        let write = |b: &Binding| {
            vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(b.index)
                .descriptor_type(b.kind.descriptor_type())
        };
        let images = image_infos.iter().map(|(b, info)| write(b).image_info(info));
        let buffers = buffer_infos.iter().map(|(b, info)| write(b).buffer_info(info));
        let views = views.iter().map(|(b, view)| write(b).texel_buffer_view(view));
        let writes: Vec<_> = images.chain(buffers).chain(views).collect();
        // SAFETY: the set is new, so not in use; views and buffers are alive.
        unsafe { device.update_descriptor_sets(&writes, &[]) };
        Ok(set)
    }

    fn begin_rendering(&self, rendering: &Rendering) -> Result<(), Error> {
        let attachment = |view, layout, load, value| {
            vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(layout)
                .load_op(load)
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(value)
        };
        let mut colors = Vec::with_capacity(rendering.colors.len());
        for color in &rendering.colors {
            let load = if color.clear.is_some() { vk::AttachmentLoadOp::CLEAR } else { vk::AttachmentLoadOp::LOAD };
            let (view, layout) = self.layer(color.target, color.layer, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)?;
            // Zero is zero in integer formats too; only floats start as anything else.
            let float32 = color.clear.unwrap_or_default();
            let clear = vk::ClearValue { color: vk::ClearColorValue { float32 } };
            colors.push(attachment(view, layout, load, clear));
        }
        let [width, height] =
            rendering.colors.first().map_or(self.plan.picture, |c| self.plan.attachment_size(c.target));
        // Nothing of the frame's own is attached beside the host's, unless both begin at once.
        let mut attached = rendering.colors.iter().map(|c| c.target).chain(rendering.depth.iter().map(|d| d.target));
        let given = attached.any(|target| matches!(self.plan.resource(target).made, Made::Given(_)));
        let [x, y] = if given { self.externals.origin } else { [0, 0] };
        let offset = vk::Offset2D { x: x as i32, y: y as i32 };
        let area = vk::Rect2D { offset, extent: vk::Extent2D { width, height } };
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colors);
        let depth_info;
        if let Some(depth) = &rendering.depth {
            let value = vk::ClearDepthStencilValue { depth: depth.clear.unwrap_or_default(), stencil: 0 };
            let (load, store) = match depth.clear {
                Some(_) => (vk::AttachmentLoadOp::CLEAR, vk::AttachmentStoreOp::DONT_CARE),
                None => (vk::AttachmentLoadOp::LOAD, vk::AttachmentStoreOp::STORE),
            };
            let (view, layout) = self.layer(depth.target, 0, vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL)?;
            depth_info = attachment(view, layout, load, vk::ClearValue { depth_stencil: value }).store_op(store);
            info = info.depth_attachment(&depth_info);
        }
        let viewport = vk::Viewport {
            x: x as f32,
            y: y as f32,
            width: width as f32,
            height: height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        // SAFETY: the attachments are alive, in the stated layouts (declared by the pass), and of this size.
        unsafe {
            self.host.device.cmd_begin_rendering(self.cmd, &info);
            self.host.device.cmd_set_viewport(self.cmd, 0, &[viewport]);
            self.host.device.cmd_set_scissor(self.cmd, 0, &[area]);
        }
        Ok(())
    }

    fn own(&self, target: Target) -> Result<&Resource, Error> {
        let declared = self.plan.resource(target);
        let table = &self.tables[usize::from(declared.home == Home::View)];
        table.get(declared.name).map(|e| &e.resource).ok_or_else(|| absent("recording", declared.name))
    }

    /// A buffer, and what of it is bound.
    fn buffer(&self, target: Target) -> Result<(vk::Buffer, u64, u64), Error> {
        let [centers, diagonals, mixed] = self.externals.particles;
        let all = |buffer| Ok((buffer, 0, vk::WHOLE_SIZE));
        match self.plan.resource(target).made {
            Made::Given(External::FrameBlock(scale)) => {
                Ok((self.externals.frame_block, scale.offset(), size_of::<shader::Frame>() as u64))
            }
            Made::Given(External::Positions) => Ok(self.externals.positions),
            Made::Given(External::Count) => Ok(self.externals.count),
            Made::Given(External::Ids) => Ok(self.externals.ids),
            Made::Given(External::MovingPositions) => Ok(self.externals.moving[0]),
            Made::Given(External::Motions) => Ok(self.externals.moving[1]),
            Made::Given(External::MovingCount) => Ok(self.externals.moving[2]),
            Made::Given(External::Centers) => all(centers),
            Made::Given(External::Diagonals) => all(diagonals),
            Made::Given(External::Mixed) => all(mixed),
            Made::Given(External::Speeds) => all(self.externals.speeds),
            Made::Given(External::Points) => all(self.externals.points),
            _ => match self.own(target)? {
                Resource::Buffer(b) => all(b.handle),
                Resource::Image(_) => Err(absent("recording", self.plan.resource(target).name)),
            },
        }
    }

    /// A buffer as texels.
    fn texels(&self, target: Target) -> Result<vk::BufferView, Error> {
        match self.own(target)? {
            Resource::Buffer(b) => Ok(b.texels),
            Resource::Image(_) => Err(absent("recording", self.plan.resource(target).name)),
        }
    }

    /// An image as shaders see it, and the layout it is in then.
    fn view(&self, target: Target, access: Access) -> Result<(vk::ImageView, vk::ImageLayout), Error> {
        let absent = || absent("recording", self.plan.resource(target).name);
        match self.plan.resource(target).made {
            Made::Given(External::Environment | External::Footprints) => Ok(self.externals.environment),
            Made::Given(External::SceneColor) => {
                self.externals.scene.map(|s| (s.color, s.color_layout)).ok_or_else(absent)
            }
            Made::Given(External::SceneDepth) => {
                self.externals.scene.map(|s| (s.depth, s.depth_layout)).ok_or_else(absent)
            }
            _ => match self.own(target)? {
                Resource::Image(i) => Ok((i.view, access.flags().2)),
                Resource::Buffer(_) => Err(absent()),
            },
        }
    }

    /// One layer of an image, to be drawn into, and the layout it is in then: if it is the frame's own, this one.
    fn layer(
        &self,
        target: Target,
        layer: u32,
        own: vk::ImageLayout,
    ) -> Result<(vk::ImageView, vk::ImageLayout), Error> {
        let absent = || absent("recording", self.plan.resource(target).name);
        match self.plan.resource(target).made {
            Made::Given(External::Output(_)) => Ok(self.externals.output),
            Made::Given(External::Surface(says, _)) => {
                self.externals.surface.of(says).map(|o| (o.view, o.layout)).ok_or_else(absent)
            }
            _ => match self.own(target)? {
                Resource::Image(i) => i.layers.get(layer as usize).map(|view| (*view, own)).ok_or_else(absent),
                Resource::Buffer(_) => Err(absent()),
            },
        }
    }
}

fn absent(pass: &'static str, name: &str) -> Error {
    Error::Pass { pass, problem: format!("{name} is declared, and not there") }
}
