//! The renderer: made for a host's device, fed with particles, records frames.

mod uploads;

use crate::{
    Error, access,
    device::{self, Host, Limits},
    frame,
    input::{Background, EnvironmentInput, EnvironmentShape, FrameInput},
    passes::Passes,
    prepare::DevicePositions,
    profile::FrameTimes,
    recorder::{Externals, PlanEntry, Recorder, Table, used},
    resources::{Buffer, Image, Resource, Retired},
    settings::Settings,
    slot::Slot,
    space::{self, Space},
    targets::{self, Id, LedgerEntry, Needs, Preparation, Spec},
};
use ash::vk;
use glam::Vec3;
use uploads::PARTICLE_ARRAYS;

/// Renders particle liquids into a host's command buffers. See the crate's documentation for the contract.
///
/// Call [`Renderer::destroy`] when the device is idle; a renderer that is only dropped leaks its Vulkan objects,
/// because dropping must not wait and cannot know what is still in flight.
#[must_use = "call Renderer::destroy when the device is idle"]
pub struct Renderer {
    host: Host,
    limits: Limits,
    size: [u32; 2],
    passes: Passes,
    table: Table,
    slots: Vec<Slot>,
    retired: Retired,
    frame: u64,
    /// Centres, and the two halves of the shapes.
    particles: Option<[Buffer; 3]>,
    scene: SceneBounds,
    environment: Option<Image>,
    plan: Vec<PlanEntry>,
    /// The buffer that holds the last frame's classes, if that frame kept them.
    last_classes: Option<vk::Buffer>,
}

/// What the renderer remembers of the particles it was given.
#[derive(Clone, Copy)]
struct SceneBounds {
    space: Space,
    splash: usize,
    body: usize,
    bounds: (Vec3, Vec3),
}

impl Renderer {
    /// Makes a renderer for outputs of one format: UNORM formats receive colour encoded as
    /// sRGB, float and `_SRGB` formats linear colour.
    ///
    /// # Safety
    /// * The handles in `host` are alive and stay so until [`Renderer::destroy`] has returned.
    /// * The device was created with [`device::required_features`], and with `largePoints` if `host` says so.
    pub unsafe fn new(host: Host, output: vk::Format) -> Result<Renderer, Error> {
        device::check(&host.instance, host.physical_device, host.queue_family)?;
        if crate::passes::refract::takes_linear(output).is_none() {
            let remedy = "use an RGBA float, UNORM or sRGB format";
            return Err(Error::parameter("output format", format!("{output:?}"), remedy));
        }
        host.check_attachment(output)?;
        if !(1..=MOST_SLOTS).contains(&host.frames_in_flight) {
            let remedy = format!("use 1 to {MOST_SLOTS}");
            return Err(Error::parameter("frames in flight", host.frames_in_flight, remedy));
        }
        let limits = host.limits();
        let mut renderer = Renderer {
            passes: Passes::new(&limits, output),
            host,
            limits,
            size: [0, 0],
            table: Table::default(),
            slots: Vec::new(),
            retired: Retired::default(),
            frame: 0,
            particles: None,
            scene: SceneBounds {
                space: Space::new(1.0, Vec3::ZERO),
                splash: 0,
                body: 0,
                bounds: (Vec3::ZERO, Vec3::ZERO),
            },
            environment: None,
            plan: Vec::new(),
            last_classes: None,
        };
        for _ in 0..renderer.host.frames_in_flight {
            match Slot::new(&renderer.host) {
                Ok(slot) => renderer.slots.push(slot),
                Err(e) => {
                    // SAFETY: nothing was recorded yet.
                    unsafe { renderer.destroy() };
                    return Err(e);
                }
            }
        }
        Ok(renderer)
    }

    /// Sets the size of outputs to come, in pixels. Allocates nothing: the next frame does.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), Error> {
        self.check_size(size)?;
        self.size = size;
        Ok(())
    }

    fn check_size(&self, size: [u32; 2]) -> Result<(), Error> {
        let most = self.limits.image_size;
        if size.contains(&0) || size.iter().any(|s| *s > most) {
            let what = format!("{}x{}", size[0], size[1]);
            return Err(Error::parameter("size", what, format!("use 1 to {most} pixels each way on this device")));
        }
        Ok(())
    }

    /// Device memory that frames take, resource by resource, before anything is allocated. The particle buffer is
    /// extra: 36 bytes a particle; a static environment map 16 bytes a texel.
    pub fn memory_requirements(&self, needs: &Needs) -> Result<Vec<LedgerEntry>, Error> {
        self.check_size(needs.size)?;
        Ok(targets::ledger(&self.host.device, needs))
    }

    /// Device memory in use now, resource by resource.
    pub fn memory(&self) -> Vec<LedgerEntry> {
        let mut ledger = self.table.ledger();
        let particles = PARTICLE_ARRAYS.into_iter().zip(self.particles.iter().flatten());
        ledger.extend(particles.map(|(id, b)| LedgerEntry { name: id.name(), bytes: b.bytes }));
        ledger.extend(self.environment.iter().map(|i| LedgerEntry { name: Id::Environment.name(), bytes: i.bytes }));
        ledger
    }

    /// What the next frame with these settings needs.
    pub fn needs(&self, settings: &Settings, debug: bool) -> Needs {
        let mut needs = Needs::new(self.size, self.scene.splash, self.scene.body, settings, debug);
        // Culling only saves time: where its bounds do not fit a storage buffer, everything is drawn.
        needs.occlusion &= 8 * u64::from(self.size[0]) * u64::from(self.size[1]) <= self.limits.storage_size;
        needs
    }

    /// What a frame needs that prepares positions on the device: both classes, since only the device will know whether
    /// there are particles of each.
    pub fn needs_on_device(
        &self,
        settings: &Settings,
        positions: &DevicePositions,
        debug: bool,
        neighbours: u32,
    ) -> Result<Needs, Error> {
        let mut needs = self.needs(settings, debug);
        needs.count = positions.count;
        (needs.splash, needs.body) = (positions.count > 0, positions.count > 0);
        needs.prepare = (positions.count > 0).then(|| Preparation {
            entries: positions.entries(),
            keep_classes: positions.keep_class_below.is_some(),
            neighbours,
        });
        let largest = self.limits.storage_size;
        let asked = BINDING_ALIGNMENT + positions.stride * u64::from(positions.count);
        let buffers = Id::OWN.into_iter().filter_map(|id| match needs.spec(id)? {
            Spec::Buffer { bytes, .. } => Some((id.name(), bytes)),
            Spec::Image(_) => None,
        });
        for (name, bytes) in buffers.chain([(Id::Positions.name(), asked)]) {
            if bytes > largest || positions.entries() > u64::from(u32::MAX) {
                let remedy = format!("{name} would take {bytes} bytes; this device binds {largest} at most");
                return Err(Error::parameter("particles", positions.count, remedy));
            }
        }
        Ok(needs)
    }

    /// Keeps something that recorded commands may still use until the next frame has completed: uploads and copies
    /// that were recorded since the last frame run before that one.
    fn retire(&mut self, resource: Resource) {
        self.retired.push(self.frame + 1, resource);
    }

    /// Records one frame into the host's command buffer. After an error the command buffer is not to be submitted.
    ///
    /// # Safety
    /// * `cmd` is recording, outside rendering, and goes to a queue of the family in [`Host`], after all frames
    ///   recorded before it.
    /// * The frame last recorded into `input.slot` has completed on the device.
    /// * The buffer of [`FrameInput::positions`] is alive until the frame has completed, holds what is said of it, has
    ///   usage `STORAGE_BUFFER`, and its earlier writes are visible to reads in compute shaders.
    /// * The output, and what there is of the scene and of an environment of the host's, are alive until the frame has
    ///   completed and in the stated layouts; output and scene are of this size. Their earlier writes are visible to
    ///   sampling in fragment shaders, and those of the output to the colour-attachment stage.
    pub unsafe fn record(&mut self, cmd: vk::CommandBuffer, input: &FrameInput) -> Result<(), Error> {
        input.settings.validate()?;
        input.camera.validate()?;
        if self.size == [0, 0] {
            return Err(Error::Order("no size yet: call Renderer::resize first"));
        }
        let own = self.environment.as_ref().map(|i| EnvironmentInput {
            view: i.view,
            layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            shape: EnvironmentShape::Equirect,
        });
        let Some(environment) = input.environment.or(own) else {
            return Err(Error::Order(
                "no environment yet: give FrameInput::environment, or call Renderer::set_environment first \
                 (Equirect::procedural_sky needs no file)",
            ));
        };
        let mut bounds = self.scene.bounds;
        let mut space = self.scene.space;
        let mut prepare = None;
        let mut positions = (vk::Buffer::null(), 0, 0);
        let needs = if let Some(p) = &input.positions {
            let begin = p.offset % BINDING_ALIGNMENT;
            let constants = p.constants(begin)?;
            // The device finds the box; what is written here never shows.
            (bounds, space) = ((Vec3::ZERO, Vec3::ZERO), Space::new(p.radius, Vec3::ZERO));
            if p.count > 0 {
                positions = (p.buffer, p.offset - begin, begin + p.stride * u64::from(p.count - 1) + 12);
                prepare = Some(constants);
            }
            self.needs_on_device(input.settings, p, input.debug, input.neighbours)?
        } else {
            self.needs(input.settings, input.debug)
        };
        let mut block = input.camera.uniforms(input.settings, self.size, &space, bounds);
        if let Some(p) = &input.positions {
            // In the preparation's units; the extent pass moves the origin and goes on to radii.
            let shift = input.camera.view.w_axis.truncate() * space::power_of_two(p.radius);
            block.view.w_axis = shift.extend(1.0);
        }
        input.check_handles()?;
        // Squares of distances are taken of it.
        if !block.view.w_axis.is_finite() || block.view.w_axis.abs().max_element() > FARTHEST_EYE {
            let remedy = format!("the eye is more than {FARTHEST_EYE:e} particle radii away: go nearer");
            return Err(Error::parameter("camera view", input.camera.view, remedy));
        }
        let Some(slot) = self.slots.get_mut(input.slot) else {
            return Err(Error::parameter("slot", input.slot, "use less than Host::frames_in_flight"));
        };
        check_memory(&self.host, &self.limits, &self.table, &needs)?;
        // The slot's last frame has completed, and with it every frame before.
        self.retired.collect(&self.host, slot.frame);
        self.frame += 1;
        self.table.fit(&self.host, &needs, &mut self.retired, self.frame)?;
        self.table.discard_contents();
        let classes = match self.table.get(Id::LastClasses) {
            Some(Resource::Buffer(b)) => Some(b.handle),
            _ => None,
        };
        if let Some(p) = &mut prepare {
            p.has_last_classes = u32::from(classes.is_some() && classes == self.last_classes);
        }
        self.last_classes = classes;

        block.count = needs.count;
        block.largest_point = self.limits.point_size as u32;
        block.quads_only = u32::from(input.settings.quads_only || self.limits.point_size <= 1.0);
        block.eye_inside = f32::from(input.eye_inside);
        let externals = Externals {
            frame_block: slot.frame_block.handle,
            positions,
            particles: self
                .particles
                .as_ref()
                .map_or([vk::Buffer::null(); 3], |b| [&b[0], &b[1], &b[2]].map(|b| b.handle)),
            environment: (environment.view, environment.layout),
            environment_shape: environment.shape,
            scene: input.scene,
            background: input.background,
            output: input.output,
        };
        if let Some(scene) = &input.scene {
            let p = &input.camera.projection;
            block.scene_z_scale = p.z_axis.z;
            block.scene_z_offset = p.w_axis.z / space.radius as f32;
            block.scene_cleared = scene.cleared_depth;
        }
        slot.frame_block.mapped()[..size_of_val(&block)].copy_from_slice(bytemuck::bytes_of(&block));
        // SAFETY: no set of this slot is in use (contract).
        unsafe { self.host.device.reset_descriptor_pool(slot.pool, vk::DescriptorPoolResetFlags::empty()) }
            .map_err(Error::vulkan("descriptor pool"))?;
        if let Some(p) = &mut slot.profiler {
            p.begin_frame(&self.host.device, cmd);
        }
        self.plan.clear();
        let mut recorder = Recorder {
            host: &self.host,
            cmd,
            table: &mut self.table,
            externals,
            pool: slot.pool,
            profiler: slot.profiler.as_mut(),
            plan: &mut self.plan,
            size: self.size,
            frame_block: access::State::default(),
        };
        let recorded = frame::record(&mut recorder, &mut self.passes, &needs, input.settings, prepare.as_ref());
        match &recorded {
            Ok(()) => slot.frame = self.frame,
            Err(_) => self.abandon(input.slot),
        }
        recorded
    }

    /// Says that the frame last recorded into a slot will never run: its command buffer was reset, or is not submitted.
    /// To be called before the next frame is recorded into any slot, for each such frame, in any order. Waits for nothing.
    pub fn abandon(&mut self, slot: usize) {
        // Its barriers never run either: start again from new resources. Classes of an earlier frame are not kept.
        self.table.retire_all(&mut self.retired, self.frame + 1);
        self.last_classes = None;
        if let Some(slot) = self.slots.get_mut(slot) {
            // That this slot is free again says nothing of frames before this one, which may still run.
            slot.frame = 0;
            if let Some(p) = &mut slot.profiler {
                p.abandon_frame();
            }
        }
    }

    /// The barriers of the last recorded frame, in order; printable.
    pub fn plan(&self) -> &[PlanEntry] {
        &self.plan
    }

    /// GPU times of the frame last recorded into a slot, which has completed; `None` before the first, or without
    /// timestamps. Does not wait.
    pub fn times(&self, slot: usize) -> Option<FrameTimes> {
        self.slots.get(slot)?.profiler.as_ref()?.read(&self.host.device)
    }

    /// How a resource of the last frame was made; `None` if that frame did without it.
    pub fn spec(&self, id: Id) -> Option<Spec> {
        self.table.spec(id)
    }

    /// Records a copy of one layer of a target (tightly packed rows) or of a whole buffer, as the last frame left it.
    ///
    /// # Safety
    /// `cmd` is recording, outside rendering, and runs after the frame; `to` holds the content from `offset` on, was
    /// made with `TRANSFER_DST`, and is made visible to the host by the caller.
    pub unsafe fn record_copy(
        &mut self,
        cmd: vk::CommandBuffer,
        id: Id,
        layer: u32,
        to: vk::Buffer,
        offset: u64,
    ) -> Result<(), Error> {
        if self.table.get(id).is_none() {
            return Err(Error::parameter("target", id.name(), "the last frame did without it"));
        }
        let mut recorder = Recorder {
            host: &self.host,
            cmd,
            table: &mut self.table,
            externals: Externals {
                frame_block: vk::Buffer::null(),
                positions: Default::default(),
                particles: [vk::Buffer::null(); 3],
                environment: Default::default(),
                environment_shape: EnvironmentShape::default(),
                scene: None,
                background: Background::default(),
                output: vk::ImageView::null(),
            },
            pool: vk::DescriptorPool::null(),
            profiler: None,
            plan: &mut self.plan,
            size: self.size,
            frame_block: access::State::default(),
        };
        recorder.barriers("copy", &[used(id, access::Access::TransferRead)]);
        match (self.table.get(id), self.table.spec(id)) {
            (Some(Resource::Image(image)), Some(Spec::Image(spec))) => {
                let layers = vk::ImageSubresourceLayers {
                    aspect_mask: image.aspect,
                    mip_level: 0,
                    base_array_layer: layer,
                    layer_count: 1,
                };
                let extent = vk::Extent3D { width: spec.size[0], height: spec.size[1], depth: 1 };
                let copy =
                    vk::BufferImageCopy::default().buffer_offset(offset).image_subresource(layers).image_extent(extent);
                let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
                // SAFETY: the image was just brought into this layout; the rest is this function's contract.
                unsafe { self.host.device.cmd_copy_image_to_buffer(cmd, image.handle, layout, to, &[copy]) };
            }
            (Some(Resource::Buffer(buffer)), Some(Spec::Buffer { bytes, .. })) => {
                let copy = vk::BufferCopy { src_offset: 0, dst_offset: offset, size: bytes };
                // SAFETY: as above.
                unsafe { self.host.device.cmd_copy_buffer(cmd, buffer.handle, to, &[copy]) };
            }
            _ => {}
        }
        Ok(())
    }

    /// Destroys everything the renderer made.
    ///
    /// # Safety
    /// No frame recorded by this renderer is in flight.
    pub unsafe fn destroy(mut self) {
        self.table.retire_all(&mut self.retired, 0);
        self.retired.collect(&self.host, u64::MAX);
        self.particles.take().into_iter().flatten().for_each(|mut b| b.destroy(&self.host));
        if let Some(mut i) = self.environment.take() {
            i.destroy(&self.host);
        }
        self.slots.drain(..).for_each(|mut slot| slot.destroy(&self.host));
        self.passes.destroy(&self.host);
    }
}

/// Refuses a frame that does not fit the device, before anything is made for it.
fn check_memory(host: &Host, limits: &Limits, table: &Table, needs: &Needs) -> Result<(), Error> {
    if table.fits(needs) {
        return Ok(());
    }
    let needed: u64 = targets::ledger(&host.device, needs).iter().map(|e| e.bytes).sum();
    match needed.checked_sub(limits.memory) {
        None | Some(0) => Ok(()),
        Some(missing) => Err(Error::MemoryShort { needed, available: limits.memory, missing }),
    }
}

/// Slots are made ahead, each with buffers and pools of its own.
const MOST_SLOTS: u32 = 256;

/// How far the eye may be, in particle radii.
const FARTHEST_EYE: f32 = 1e12;

/// No device asks for more alignment of a storage buffer's offset.
const BINDING_ALIGNMENT: u64 = 256;
