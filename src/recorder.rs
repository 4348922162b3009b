//! Records passes: each says what it reads and writes, and gets its barriers, descriptors, label and timestamps.

use crate::{
    Error,
    access::{Access, Barrier, State},
    device::Host,
    input::{Background, EnvironmentShape, SceneInput},
    pipeline::Pipeline,
    profile::Profiler,
    resources::{Buffer, Image, Resource, Retired},
    shader::Kind,
    targets::{Id, Needs, Spec},
};
use ash::vk;
use gpu_allocator::MemoryLocation;
use std::collections::BTreeMap;

/// One resource a pass touches, and where its shader sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Use {
    pub id: Id,
    pub access: Access,
    pub binding: Option<u32>,
}

/// A resource that the shader sees at a binding of set 0.
pub(crate) const fn bound(binding: u32, id: Id, access: Access) -> Use {
    Use { id, access, binding: Some(binding) }
}

/// A resource used otherwise: attachment, indirect arguments, copy.
pub(crate) const fn used(id: Id, access: Access) -> Use {
    Use { id, access, binding: None }
}

struct Entry {
    resource: Resource,
    spec: Spec,
    state: State,
}

/// The renderer's own resources, with the state each is in.
#[derive(Default)]
pub(crate) struct Table(BTreeMap<Id, Entry>);

impl Table {
    /// Makes what `needs` asks for and is not there, retires what it no longer asks for.
    pub fn fit(&mut self, host: &Host, needs: &Needs, retired: &mut Retired, frame: u64) -> Result<(), Error> {
        for id in Id::OWN {
            let spec = needs.spec(id);
            if self.0.get(&id).map(|e| e.spec) == spec {
                continue;
            }
            if let Some(old) = self.0.remove(&id) {
                retired.push(frame, old.resource);
            }
            let Some(spec) = spec else { continue };
            let resource = match &spec {
                Spec::Image(image) => Resource::Image(Image::new(host, id.name(), image)?),
                Spec::Buffer { bytes, usage } => {
                    Resource::Buffer(Buffer::new(host, id.name(), *bytes, *usage, MemoryLocation::GpuOnly)?)
                }
            };
            self.0.insert(id, Entry { resource, spec, state: State::default() });
        }
        Ok(())
    }

    /// Whether all that is asked for is there.
    pub fn fits(&self, needs: &Needs) -> bool {
        Id::OWN.into_iter().all(|id| self.spec(id) == needs.spec(id))
    }

    /// Forgets contents: every frame makes everything anew.
    pub fn discard_contents(&mut self) {
        self.0.values_mut().for_each(|e| e.state.discard());
    }

    pub fn get(&self, id: Id) -> Option<&Resource> {
        self.0.get(&id).map(|e| &e.resource)
    }

    pub fn spec(&self, id: Id) -> Option<Spec> {
        self.0.get(&id).map(|e| e.spec)
    }

    /// Driver's size of each resource.
    pub fn ledger(&self) -> Vec<crate::targets::LedgerEntry> {
        let bytes = |r: &Resource| match r {
            Resource::Image(i) => i.bytes,
            Resource::Buffer(b) => b.bytes,
        };
        self.0
            .iter()
            .map(|(id, e)| crate::targets::LedgerEntry { name: id.name(), bytes: bytes(&e.resource) })
            .collect()
    }

    pub fn retire_all(&mut self, retired: &mut Retired, frame: u64) {
        for (_, e) in std::mem::take(&mut self.0) {
            retired.push(frame, e.resource);
        }
    }
}

/// What the frame uses and does not own, or owns per slot; none of it needs barriers from us.
#[derive(Clone, Copy)]
pub(crate) struct Externals {
    pub frame_block: vk::Buffer,
    /// Buffer, offset and range of the host's positions.
    pub positions: (vk::Buffer, u64, u64),
    /// Centres and shapes, where the host prepared them.
    pub particles: [vk::Buffer; 3],
    pub environment: (vk::ImageView, vk::ImageLayout),
    pub environment_shape: EnvironmentShape,
    pub scene: Option<SceneInput>,
    pub background: Background,
    pub output: vk::ImageView,
}

/// One barrier of a recorded frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    pub table: &'a mut Table,
    pub externals: Externals,
    pub pool: vk::DescriptorPool,
    pub profiler: Option<&'a mut Profiler>,
    pub plan: &'a mut Vec<PlanEntry>,
    pub size: [u32; 2],
    /// What has happened to the frame block since the host wrote it.
    pub frame_block: State,
}

impl Recorder<'_> {
    /// One pass: label, timestamps, the barriers that its uses need, then `body`.
    pub fn pass(
        &mut self,
        name: &'static str,
        uses: &[Use],
        body: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if let Some(utils) = &self.host.debug_utils {
            let label = std::ffi::CString::new(format!("meniscus {name}")).unwrap_or_default();
            // SAFETY: `cmd` is recording (contract of `Renderer::record`); the label outlives the call.
            unsafe {
                utils.cmd_begin_debug_utils_label(self.cmd, &vk::DebugUtilsLabelEXT::default().label_name(&label))
            };
        }
        if let Some(p) = &mut self.profiler {
            p.begin(&self.host.device, self.cmd, name);
        }
        self.barriers(name, uses);
        if !uses.iter().any(|u| u.id == Id::FrameBlock) {
            self.barriers(name, &[used(Id::FrameBlock, Access::UniformRead)]);
        }
        let result = body(self);
        if let Some(p) = &mut self.profiler {
            p.end(&self.host.device, self.cmd);
        }
        if let Some(utils) = &self.host.debug_utils {
            // SAFETY: closes the label begun above.
            unsafe { utils.cmd_end_debug_utils_label(self.cmd) };
        }
        result
    }

    /// Emits what the declared uses need, as one pipeline barrier.
    pub fn barriers(&mut self, pass: &'static str, uses: &[Use]) {
        let (mut images, mut buffers) = (Vec::new(), Vec::new());
        for u in uses {
            if u.id == Id::FrameBlock {
                if let Some(barrier) = self.frame_block.step(u.access, false) {
                    self.plan.push(PlanEntry { pass, resource: u.id.name(), barrier });
                    buffers.push(barrier.on_buffer(self.externals.frame_block));
                }
                continue;
            }
            let Some(entry) = self.table.0.get_mut(&u.id) else { continue };
            let is_image = matches!(entry.resource, Resource::Image(_));
            let Some(barrier) = entry.state.step(u.access, is_image) else { continue };
            self.plan.push(PlanEntry { pass, resource: u.id.name(), barrier });
            match &entry.resource {
                Resource::Image(image) => images.push(barrier.on_image(image.handle, image.aspect)),
                Resource::Buffer(buffer) => buffers.push(barrier.on_buffer(buffer.handle)),
            }
        }
        if images.is_empty() && buffers.is_empty() {
            return;
        }
        let info = vk::DependencyInfo::default().image_memory_barriers(&images).buffer_memory_barriers(&buffers);
        // SAFETY: `cmd` is recording outside rendering; the handles are alive and the layouts tracked.
        unsafe { self.host.device.cmd_pipeline_barrier2(self.cmd, &info) };
    }

    /// Binds a pipeline and a descriptor set with the uses that have a binding; binding 0 is the frame block.
    pub fn bind(&mut self, pipeline: &Pipeline, uses: &[Use]) -> Result<(), Error> {
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pool).set_layouts(&layouts);
        // SAFETY: the pool belongs to this slot, whose last frame has completed.
        let set =
            unsafe { self.host.device.allocate_descriptor_sets(&info) }.map_err(Error::vulkan("descriptor set"))?[0];
        let frame_block = bound(0, Id::FrameBlock, Access::ComputeRead);
        let mut image_infos = Vec::with_capacity(pipeline.bindings.len());
        let mut buffer_infos = Vec::with_capacity(pipeline.bindings.len());
        // Samplers are part of the layout.
        for b in pipeline.bindings.iter().filter(|b| b.kind != Kind::Sampler) {
            let u = if b.index == 0 { Some(&frame_block) } else { uses.iter().find(|u| u.binding == Some(b.index)) };
            let u = u
                .unwrap_or_else(|| panic!("a pass declares nothing for its shader's binding {} ({})", b.index, b.name));
            match b.kind {
                Kind::SampledImage | Kind::StorageImage => {
                    let (view, layout) = self.view(u);
                    image_infos.push((b, [vk::DescriptorImageInfo::default().image_view(view).image_layout(layout)]));
                }
                Kind::UniformBuffer | Kind::StorageBuffer => {
                    let (buffer, offset, range) = match u.id {
                        Id::Positions => self.externals.positions,
                        id => (self.buffer(id), 0, vk::WHOLE_SIZE),
                    };
                    let info = vk::DescriptorBufferInfo { buffer, offset, range };
                    buffer_infos.push((b, [info]));
                }
                Kind::Sampler => {}
            }
        }
        let mut writes = Vec::with_capacity(pipeline.bindings.len());
        let write = |b: &crate::shader::Binding| {
            vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(b.index)
                .descriptor_type(b.kind.descriptor_type())
        };
        writes.extend(image_infos.iter().map(|(b, info)| write(b).image_info(info)));
        writes.extend(buffer_infos.iter().map(|(b, info)| write(b).buffer_info(info)));
        // SAFETY: the set is new, so not in use; views and buffers are alive; `cmd` is recording.
        unsafe {
            self.host.device.update_descriptor_sets(&writes, &[]);
            self.host.device.cmd_bind_pipeline(self.cmd, pipeline.bind_point, pipeline.handle);
            self.host.device.cmd_bind_descriptor_sets(self.cmd, pipeline.bind_point, pipeline.layout, 0, &[set], &[]);
        }
        Ok(())
    }

    pub fn push<T: bytemuck::Pod>(&mut self, pipeline: &Pipeline, constants: &T) {
        // SAFETY: the pipeline's layout has a push range of T's size, for these stages.
        unsafe {
            self.host.device.cmd_push_constants(
                self.cmd,
                pipeline.layout,
                pipeline.stages,
                0,
                bytemuck::bytes_of(constants),
            )
        };
    }

    pub fn dispatch(&mut self, x: u32, y: u32, z: u32) {
        // SAFETY: a compute pipeline and its set are bound.
        unsafe { self.host.device.cmd_dispatch(self.cmd, x, y, z) };
    }

    /// A dispatch whose group counts were written into a buffer.
    pub fn dispatch_indirect(&mut self, arguments: Id, offset: u64) {
        // SAFETY: a compute pipeline and its set are bound; the arguments were declared `IndirectRead`.
        unsafe { self.host.device.cmd_dispatch_indirect(self.cmd, self.buffer(arguments), offset) };
    }

    /// Rendering into one layer of each colour target, cleared to zero, or into the host's output, which keeps what it
    /// holds where the background is the host's; `depth`: the depth test's clear value.
    pub fn render(
        &mut self,
        colors: &[(Id, usize)],
        depth: Option<f32>,
        body: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let attachment = |view, layout, load, value| {
            vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(layout)
                .load_op(load)
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(value)
        };
        let zero = vk::ClearValue { color: vk::ClearColorValue { uint32: [0; 4] } };
        let color_infos: Vec<_> = colors
            .iter()
            .map(|(id, layer)| {
                let (view, load) = match self.table.get(*id) {
                    Some(Resource::Image(i)) => (i.layers[*layer], vk::AttachmentLoadOp::CLEAR),
                    _ if self.externals.background == Background::Host => {
                        (self.externals.output, vk::AttachmentLoadOp::LOAD)
                    }
                    _ => (self.externals.output, vk::AttachmentLoadOp::CLEAR),
                };
                attachment(view, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL, load, zero)
            })
            .collect();
        let area = vk::Rect2D {
            offset: vk::Offset2D::default(),
            extent: vk::Extent2D { width: self.size[0], height: self.size[1] },
        };
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&color_infos);
        let depth_info;
        if let (Some(value), Some(Resource::Image(i))) = (depth, self.table.get(Id::SplatDepth)) {
            let clear = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: value, stencil: 0 } };
            let layout = vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL;
            depth_info = attachment(i.view, layout, vk::AttachmentLoadOp::CLEAR, clear)
                .store_op(vk::AttachmentStoreOp::DONT_CARE);
            info = info.depth_attachment(&depth_info);
        }
        let viewport = vk::Viewport {
            x: 0.0,
            y: 0.0,
            width: self.size[0] as f32,
            height: self.size[1] as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        // SAFETY: the attachments are alive, in the stated layouts (declared by the pass), and of this size.
        unsafe {
            self.host.device.cmd_begin_rendering(self.cmd, &info);
            self.host.device.cmd_set_viewport(self.cmd, 0, &[viewport]);
            self.host.device.cmd_set_scissor(self.cmd, 0, &[area]);
        }
        let result = body(self);
        // SAFETY: ends the rendering begun above.
        unsafe { self.host.device.cmd_end_rendering(self.cmd) };
        result
    }

    pub fn buffer(&self, id: Id) -> vk::Buffer {
        match (id, self.table.get(id)) {
            (Id::FrameBlock, _) => self.externals.frame_block,
            (_, Some(Resource::Buffer(b))) => b.handle,
            (Id::Centers, _) => self.externals.particles[0],
            (Id::Diagonals, _) => self.externals.particles[1],
            (Id::Mixed, _) => self.externals.particles[2],
            _ => panic!("a pass asks for the buffer {id:?}, which this frame does without"),
        }
    }

    fn view(&self, u: &Use) -> (vk::ImageView, vk::ImageLayout) {
        if let Some(scene) = &self.externals.scene {
            match u.id {
                Id::SceneColor => return (scene.color, scene.color_layout),
                Id::SceneDepth => return (scene.depth, scene.depth_layout),
                _ => {}
            }
        }
        match (u.id, self.table.get(u.id)) {
            (Id::Environment, _) => self.externals.environment,
            (_, Some(Resource::Image(i))) => (i.view, u.access.flags().2),
            _ => panic!("a pass asks for the image {:?}, which this frame does without", u.id),
        }
    }
}
