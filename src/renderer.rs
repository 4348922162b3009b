//! The renderer: made for a host's device, fed with particles, records frames.

mod ahead;
mod uploads;

use crate::{
    Error, access,
    device::{self, Host, Limits, bound},
    frame,
    input::{EyeInside, FrameInput},
    pipeline::Pipelines,
    plan::Home,
    prepare::Kept,
    profile::FrameTimes,
    recorder::{Externals, PlanEntry, Recorder},
    resources::{Buffer, Resource, Retired},
    scale::Scale,
    scene::Scene,
    slot::Slot,
    space::{self, Space},
    table::Table,
    work::WorkEntry,
};
pub use ahead::Amount;
#[cfg(feature = "host")]
pub(crate) use ahead::check_amount;
use ahead::{check_bindings, check_memory};
use ash::vk;
use glam::{Vec2, Vec3};
use uploads::Footprints;

/// Renders particle liquids into a host's command buffers. See the crate's documentation for the contract.
///
/// Call [`Renderer::destroy`] when the device is idle; a renderer that is only dropped leaks its Vulkan objects,
/// because dropping must not wait and cannot know what is still in flight.
#[must_use = "call Renderer::destroy when the device is idle"]
pub struct Renderer {
    pub(crate) host: Host,
    limits: Limits,
    size: [u32; 2],
    output: vk::Format,
    pub(crate) pipelines: Pipelines,
    /// Of the particles, and of the view.
    pub(crate) tables: [Table; 2],
    pub(crate) slots: Vec<Slot>,
    retired: Retired,
    frame: u64,
    /// Centres, and the two halves of the shapes.
    particles: Option<[Buffer; 3]>,
    /// How fast they are.
    speeds: Option<Buffer>,
    /// What a density field is made of.
    points: Option<Buffer>,
    scene: SceneBounds,
    environment: Option<Footprints>,
    pub(crate) barriers: Vec<PlanEntry>,
    work: Vec<WorkEntry>,
    /// What is also written, for dumps and statistics.
    #[cfg(feature = "inspect")]
    pub(crate) inspection: crate::inspect::Inspection,
    /// Where the last frame's surfaces are.
    #[cfg(feature = "inspect")]
    pub(crate) surfaces: crate::plan::SurfaceNames,
    /// Names of the last frame's counters.
    #[cfg(feature = "inspect")]
    pub(crate) counters: [Vec<&'static str>; 2],
    /// What classes the last frame left, if any.
    last_classes: Option<Kept>,
    /// What the last frame's particles were, and all that was done for them alone.
    last_particles: Option<(u64, Given)>,
    /// How often particles, or what goes with them, were given.
    given: u64,
}

/// What the renderer remembers of the particles it was given.
#[derive(Clone, Copy)]
struct SceneBounds {
    space: Space,
    splash: usize,
    body: usize,
    bounds: (Vec3, Vec3),
}

/// Where the particles of a frame come from.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Given {
    /// On the device: buffer, offset and range of their positions, of their number and of their ids.
    positions: (vk::Buffer, u64, u64),
    count: (vk::Buffer, u64, u64),
    ids: (vk::Buffer, u64, u64),
    /// By the host: how often it has given some.
    times: u64,
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
        if crate::scene::takes_linear(output).is_none() {
            let remedy = "use an RGBA float, UNORM or sRGB format";
            return Err(Error::parameter("output format", format!("{output:?}"), remedy));
        }
        host.check_attachment(output, false)?;
        if !(1..=MOST_SLOTS).contains(&host.frames_in_flight) {
            let remedy = format!("use 1 to {MOST_SLOTS}");
            return Err(Error::parameter("frames in flight", host.frames_in_flight, remedy));
        }
        let limits = host.limits();
        let mut renderer = Renderer {
            host,
            output,
            pipelines: Pipelines::default(),
            limits,
            size: [0, 0],
            tables: Default::default(),
            slots: Vec::new(),
            retired: Retired::default(),
            frame: 0,
            particles: None,
            speeds: None,
            points: None,
            scene: SceneBounds {
                space: Space::new(1.0, Vec3::ZERO),
                splash: 0,
                body: 0,
                bounds: (Vec3::ZERO, Vec3::ZERO),
            },
            environment: None,
            barriers: Vec::new(),
            work: Vec::new(),
            #[cfg(feature = "inspect")]
            inspection: Default::default(),
            #[cfg(feature = "inspect")]
            surfaces: Default::default(),
            #[cfg(feature = "inspect")]
            counters: Default::default(),
            last_classes: None,
            last_particles: None,
            given: 0,
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

    /// What a frame draws.
    fn scene_of<'a>(&self, input: &FrameInput<'a>) -> Result<Scene<'a>, Error> {
        let size = self.size.map(|s| s.max(1));
        let mut scene = Scene::new(input.settings, size, [self.scene.splash, self.scene.body], &self.limits);
        (scene.output, scene.background) = (self.output, input.background);
        scene.environment = input.environment.map(|e| e.shape);
        scene.surface = input.surface.formats();
        scene.reactive = input.surface.reactive_value;
        (scene.has_scene, scene.eye) = (input.scene.is_some(), input.camera.view);
        scene.eye_on_device = input.eye_inside == EyeInside::OnDevice;
        scene.space = input.positions.map_or(self.scene.space, |p| Space::new(p.radius, Vec3::ZERO));
        if let Some(p) = &input.positions {
            Amount::OnDevice(p).fill(&mut scene)?;
        }
        if let Some(motion) = &input.surface.motion {
            let radius = scene.space.radius;
            scene.motions = motion.uniforms(radius, input.camera);
            scene.moves = motion.moves(radius, input.camera);
        }
        #[cfg(feature = "inspect")]
        self.inspection.apply(&mut scene);
        Ok(scene)
    }

    /// Refuses a view that cannot lie where it is said to begin.
    fn check_origins(&self, input: &FrameInput, walks: bool) -> Result<(), Error> {
        let origins = [("origin", Some(input.origin)), ("origin of the scene", input.scene.map(|s| s.origin))];
        for (what, origin) in origins {
            let origin = origin.unwrap_or_default();
            let beyond = |k: usize| origin[k].checked_add(self.size[k]).is_none_or(|end| end > self.limits.image_size);
            if (0..2).any(beyond) {
                let remedy =
                    format!("the view has to end at {} pixels, where images of this device do", self.limits.image_size);
                return Err(Error::parameter(what, format!("{origin:?}"), remedy));
            }
        }
        if walks && input.origin != [0, 0] {
            // What is written beside the picture then begins where it does.
            return Err(Error::parameter("origin", format!("{:?}", input.origin), "inspected walks begin at [0, 0]"));
        }
        Ok(())
    }

    /// Keeps something that recorded commands may still use until the next frame has completed: uploads and copies
    /// that were recorded since the last frame run before that one.
    fn retire(&mut self, resource: Resource) {
        self.retired.push(self.frame + 1, resource);
    }

    /// Records one frame into the host's command buffer. After an error the command buffer is not to be submitted; there is nothing to
    /// abandon, and the slot takes another frame.
    ///
    /// # Safety
    /// * `cmd` is recording, outside rendering, and goes to a queue of the family in [`Host`], after all frames
    ///   recorded before it.
    /// * The frame last recorded into `input.slot` has completed on the device.
    /// * The buffer of [`FrameInput::positions`], and those of their number and of their ids if they have any, are alive until the
    ///   frame has completed, hold what is said of them, have usage `STORAGE_BUFFER`, and their earlier writes are visible to
    ///   reads in compute shaders. What is written there later waits for the frame's compute shaders.
    /// * The buffers of [`crate::MovingParticles`], that of their number too if they have one, are alive until the frame has
    ///   completed, have usage `STORAGE_BUFFER`, and their earlier writes are visible to reads in vertex shaders.
    /// * The output, and what there is of the scene, of an environment of the host's and of [`FrameInput::surface`], are alive until
    ///   the frame has completed and in the stated layouts; all but the environment have the view in
    ///   them, whole, where it is said to begin. Their earlier writes are
    ///   visible to sampling in fragment shaders, and those of the output and of the surface's images to the attachment stages.
    pub unsafe fn record(&mut self, cmd: vk::CommandBuffer, input: &FrameInput) -> Result<(), Error> {
        if cmd == vk::CommandBuffer::null() {
            return Err(Error::parameter("command buffer", "null", "give one that is recording"));
        }
        input.settings.validate()?;
        input.camera.validate()?;
        input.surface.check(self.limits.storage_size)?;
        if self.size == [0, 0] {
            return Err(Error::Order("no size yet: call Renderer::resize first"));
        }
        let own = self.environment.as_ref();
        let given = input.environment.map(|e| (e.view, e.layout));
        let uploaded = own.map(|e| (e.image.view, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL));
        let Some(environment) = given.or(uploaded) else {
            return Err(Error::Order(
                "no environment yet: give FrameInput::environment, or call Renderer::set_environment first \
                 (Equirect::procedural_sky needs no file)",
            ));
        };
        let mut bounds = self.scene.bounds;
        let mut space = self.scene.space;
        let [mut positions, mut count, mut ids] = [(vk::Buffer::null(), 0, 0); 3];
        let mut scene = self.scene_of(input)?;
        if let Some(p) = &input.positions {
            // The device finds the box; what is written here never shows.
            (bounds, space) = ((Vec3::ZERO, Vec3::ZERO), Space::new(p.radius, Vec3::ZERO));
            if p.count > 0 {
                positions = bound(p.buffer, p.offset, p.stride, 12, p.count);
                count = p.device_count.map_or(count, |c| c.bound());
                ids = p.ids.map_or(ids, |ids| bound(ids.buffer, ids.offset, ids.stride, 4, p.count));
            }
        }
        self.check_speeds(&scene)?;
        self.check_points(&scene)?;
        let mut block = input.camera.uniforms(input.settings, self.size, &space, bounds);
        if let Some(own) = own {
            own.describe(&mut block);
        }
        if let Some(p) = &input.positions {
            // In the preparation's units; the extent pass moves the origin and goes on to radii.
            let shift = input.camera.view.w_axis.truncate() * space::power_of_two(p.radius);
            block.view.w_axis = shift.extend(1.0);
        }
        // Squares of distances are taken of it.
        if !block.view.w_axis.is_finite() || block.view.w_axis.abs().max_element() > FARTHEST_EYE {
            let remedy = format!("the eye is more than {FARTHEST_EYE:e} particle radii away: go nearer");
            return Err(Error::parameter("camera view", input.camera.view, remedy));
        }
        if input.slot >= self.slots.len() {
            return Err(Error::parameter("slot", input.slot, "use less than Host::frames_in_flight"));
        }
        let kept = scene.prepare.and_then(|p| p.kept);
        if let Some(p) = &mut scene.prepare {
            p.anew = kept != self.last_classes;
        }
        let mut plan = frame::plan(&scene)?;
        check_bindings(&self.limits, &plan, scene.count, input.positions.as_ref())?;
        input.check_handles()?;
        self.check_origins(input, scene.walks)?;
        check_memory(&self.host, &self.limits, &self.tables, &plan)?;
        self.pipelines.make(&self.host, plan.recipes())?;

        let particles = (plan.work_for_particles(), Given { positions, count, ids, times: self.given });
        let keep = input.still && self.last_particles == Some(particles) && self.tables[0].fits(&plan, Home::Particles);
        if keep {
            plan.keep_particles();
        }
        // None, should what follows fail.
        (self.last_classes, self.last_particles) = (None, None);
        let slot = &mut self.slots[input.slot];
        // The slot's last frame has completed, and with it every frame before.
        self.retired.collect(&self.host, slot.frame);
        slot.fit(&self.host, &plan)?;
        #[cfg(feature = "inspect")]
        slot.count(&self.host, &plan, self.inspection.statistics)?;
        self.frame += 1;
        for (table, home) in self.tables.iter_mut().zip(HOMES) {
            table.fit(&self.host, &plan, home, &mut self.retired, self.frame)?;
            if home == Home::View || !keep {
                table.discard_contents();
            }
        }
        (self.last_classes, self.last_particles) = (kept, Some(particles));
        #[cfg(feature = "inspect")]
        {
            self.surfaces = plan.surfaces;
            self.counters = plan.counters.clone();
        }

        block.count = scene.count;
        block.largest_point = self.limits.point_size as u32;
        block.quads_only = u32::from(input.settings.drawing.quads_only || !scene.points);
        block.eye_inside = f32::from(input.eye_inside == EyeInside::Inside);
        if input.scene.is_some() || input.surface.depth.is_some() {
            let p = &input.camera.projection;
            block.scene_z_scale = p.z_axis.z;
            block.scene_z_offset = p.w_axis.z / space.radius as f32;
        }
        block.output_origin = Vec2::from(input.origin.map(|o| o as f32));
        if let Some(scene) = &input.scene {
            block.scene_origin = Vec2::from(scene.origin.map(|o| o as f32));
            block.scene_cleared = scene.cleared_depth;
        }
        let particles = self.particles.as_ref();
        let externals = Externals {
            frame_block: slot.frame_block.handle,
            positions,
            count,
            ids,
            particles: particles.map_or([vk::Buffer::null(); 3], |b| b.each_ref().map(|b| b.handle)),
            speeds: self.speeds.as_ref().map_or(vk::Buffer::null(), |b| b.handle),
            points: self.points.as_ref().map_or(vk::Buffer::null(), |b| b.handle),
            environment,
            scene: input.scene,
            output: (input.output, input.output_layout),
            origin: input.origin,
            surface: input.surface,
            moving: input.surface.motion.map(|m| m.bound()).unwrap_or_default(),
        };
        for scale in Scale::ALL {
            let at = scale.offset() as usize;
            let scaled = scale.block(&block);
            slot.frame_block.mapped()[at..at + size_of_val(&scaled)].copy_from_slice(bytemuck::bytes_of(&scaled));
        }
        if let Some(p) = &mut slot.profiler {
            p.begin_frame(&self.host.device, cmd);
        }
        #[cfg(feature = "inspect")]
        if let Some(s) = &slot.statistics {
            s.begin_frame(&self.host.device, cmd, plan.scopes());
        }
        self.barriers.clear();
        self.work.clear();
        let recorder = Recorder {
            host: &self.host,
            cmd,
            plan: &plan,
            pipelines: &self.pipelines,
            tables: self.tables.each_mut(),
            externals,
            pool: slot.pool,
            profiler: slot.profiler.as_mut(),
            #[cfg(feature = "inspect")]
            statistics: slot.statistics.as_mut(),
            barriers: &mut self.barriers,
            work: &mut self.work,
            frame_block: access::State::default(),
        };
        let recorded = recorder.record();
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
        for table in &mut self.tables {
            table.retire_all(&mut self.retired, self.frame + 1);
        }
        (self.last_classes, self.last_particles) = (None, None);
        if let Some(slot) = self.slots.get_mut(slot) {
            // That this slot is free again says nothing of frames before this one, which may still run.
            slot.frame = 0;
            #[cfg(feature = "inspect")]
            if let Some(s) = &mut slot.statistics {
                s.abandon_frame();
            }
            if let Some(p) = &mut slot.profiler {
                p.abandon_frame();
            }
        }
    }

    /// The barriers of the last recorded frame, in order; printable.
    pub fn plan(&self) -> &[PlanEntry] {
        &self.barriers
    }

    /// What the last recorded frame gives the device to do, in order: its fills, dispatches and draws.
    pub fn work(&self) -> &[WorkEntry] {
        &self.work
    }

    /// GPU times of the frame last recorded into a slot, which has completed; `None` before the first, or without
    /// timestamps. Does not wait.
    pub fn times(&self, slot: usize) -> Option<FrameTimes> {
        self.slots.get(slot)?.profiler.as_ref()?.read(&self.host.device)
    }

    /// Destroys everything the renderer made.
    ///
    /// # Safety
    /// No frame recorded by this renderer is in flight.
    pub unsafe fn destroy(mut self) {
        for table in &mut self.tables {
            table.retire_all(&mut self.retired, 0);
        }
        self.retired.collect(&self.host, u64::MAX);
        let given = self.particles.take().into_iter().flatten().chain(self.speeds.take()).chain(self.points.take());
        given.for_each(|mut b| b.destroy(&self.host));
        if let Some(mut own) = self.environment.take() {
            own.image.destroy(&self.host);
        }
        self.slots.drain(..).for_each(|mut slot| slot.destroy(&self.host));
        self.pipelines.destroy(&self.host);
    }
}

/// In the order of the tables.
const HOMES: [Home; 2] = [Home::Particles, Home::View];

/// Slots are made ahead, each with buffers and pools of its own.
const MOST_SLOTS: u32 = 256;

/// How far the eye may be, in particle radii.
const FARTHEST_EYE: f32 = 1e12;
