//! What every GPU test shares: each driver with validation on, a frame of chosen particles, its targets read back.

pub use crate::drivers::each_driver;
use glam::{Mat3, Vec3};
use meniscus::{
    Background, Camera, Class, Ellipsoid, FrameInput, Method, Particles, Point, SceneInput, Settings,
    host::{Gpu, Instance, Session, Upload},
    inspect::{self, Inspection, Walk},
    optics::{Optics, four::Four, one::One, two::Two},
    prepare::{self, DeviceIds, DevicePositions},
    shader::Frame,
    smooth::{Smooth, plane_fit::PlaneFit},
    space::Space,
};
use std::{cell::RefCell, collections::HashMap};

/// One frame's input.
#[derive(Clone)]
pub struct Case {
    pub particles: Particles,
    pub camera: Camera,
    pub settings: Settings,
    pub size: [u32; 2],
    pub eye_inside: bool,
}

/// Positions to be prepared on the device.
pub struct Cloud<'a> {
    pub positions: &'a [Vec3],
    pub options: prepare::Options,
    pub keep_class_below: Option<f32>,
    /// One for each position, and how many there may be. They lie beside their positions where the stride leaves room, or
    /// else in a buffer of their own.
    pub ids: Option<(&'a [u32], u32)>,
    pub offset: usize,
    pub stride: usize,
}

impl<'a> Cloud<'a> {
    pub fn new(positions: &'a [Vec3], search: prepare::Search) -> Cloud<'a> {
        let options = prepare::Options { search, ..Default::default() };
        Cloud { positions, options, keep_class_below: None, ids: None, offset: 0, stride: 12 }
    }
}

/// What a frame left behind.
pub struct Shot {
    pub frame: Frame,
    /// The block that shaders read, as they left it.
    pub block: Frame,
    /// In which its targets and its twins measure: particle radii.
    pub space: Space,
    pub size: [u32; 2],
    pub picture: Vec<[f32; 3]>,
    targets: HashMap<(&'static str, u32), Vec<u32>>,
    pub counters: Vec<(&'static str, u32)>,
}

impl Shot {
    /// Raw words of one layer of a target or of a buffer; `None` if the frame did without it.
    pub fn words(&self, name: &'static str, layer: u32) -> Option<&[u32]> {
        self.targets.get(&(name, layer)).map(Vec::as_slice)
    }

    /// The same as floats.
    pub fn floats(&self, name: &'static str, layer: u32) -> Option<Vec<f32>> {
        self.words(name, layer).map(|w| w.iter().map(|w| f32::from_bits(*w)).collect())
    }

    /// A target of depths, in world units.
    pub fn depths(&self, name: &'static str, layer: u32) -> Option<Vec<f32>> {
        let world = |d: &u32| f32::from_bits(*d) * self.space.radius as f32;
        self.words(name, layer).map(|w| w.iter().map(world).collect())
    }

    pub fn counter(&self, name: &str) -> u32 {
        self.counters.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("nothing counts {name}")).1
    }
}

/// One driver: an instance of its own, so that its validation messages are its own too.
pub struct Driver<'a> {
    pub instance: &'a Instance,
    /// One renderer for all frames: sizes, particles and settings change under it as they do in an engine.
    pub session: RefCell<Session<'a>>,
    /// Of device and driver, as [`Instance::pick`] finds it.
    pub name: String,
}

impl<'a> Driver<'a> {
    pub fn new(instance: &'a Instance, session: Session<'a>, name: &str) -> Driver<'a> {
        Driver { instance, session: RefCell::new(session), name: name.into() }
    }

    pub fn end(self) {
        self.session.into_inner().end();
    }

    /// Gives the case's particles, with what its layers ask for.
    pub fn give(&self, case: &Case) {
        let renderer = &mut self.session.borrow_mut().renderer;
        renderer.set_particles(&case.particles).expect("particles");
        if case.settings.method.layers.field().is_some() {
            let p = &case.particles;
            let positions: Vec<Vec3> = p.ellipsoids.iter().map(|e| e.center).collect();
            let class = |i| if i < p.splash_count { Class::Splash } else { Class::Body };
            let classes: Vec<Class> = (0..positions.len()).map(class).collect();
            let input = prepare::Input::new(&positions, p.radius).classes(Some(&classes));
            renderer.set_points(&prepare::points(&input, &Default::default()).expect("points")).expect("points");
        }
    }

    /// Renders a case of which the points are given, too.
    pub fn shoot_points(&self, case: &Case, points: &[Point]) -> Shot {
        self.session.borrow_mut().renderer.set_particles(&case.particles).expect("particles");
        self.session.borrow_mut().renderer.set_points(points).expect("points");
        self.shoot_input(case, Inspection::default(), &|input| input)
    }

    /// Renders a case (with `debug` targets) and reads everything back.
    pub fn shoot(&self, case: &Case) -> Shot {
        self.give(case);
        self.shoot_input(case, Inspection::default(), &|input| input)
    }

    /// The same of a frame whose smoothing ends after so many steps.
    pub fn shoot_step(&self, case: &Case, steps: u32) -> Shot {
        self.give(case);
        let inspection = Inspection { smoothing_steps: Some(steps), ..Inspection::default() };
        self.shoot_input(case, inspection, &|input| input)
    }

    /// The same of particles whose speeds are known.
    pub fn shoot_moving(&self, case: &Case, speeds: &[f32]) -> Shot {
        self.give(case);
        self.session.borrow_mut().renderer.set_speeds(speeds).expect("speeds");
        self.shoot_input(case, Inspection::default(), &|input| input)
    }

    /// The same for positions prepared on the device, with every neighbour listed; they begin at `offset` bytes of their
    /// buffer and lie `stride` bytes apart. Of the case's particles only the radius counts.
    pub fn shoot_cloud(&self, case: &Case, cloud: &Cloud) -> Shot {
        self.shoot_listed(case, cloud, 1022)
    }

    /// The same without lists of neighbours.
    pub fn shoot_cloud_unlisted(&self, case: &Case, cloud: &Cloud) -> Shot {
        self.shoot_listed(case, cloud, 0)
    }

    fn shoot_listed(&self, case: &Case, cloud: &Cloud, neighbours: u32) -> Shot {
        let mut words = vec![f32::NAN; (cloud.offset + cloud.stride * cloud.positions.len()) / 4 + 3];
        for (i, p) in cloud.positions.iter().enumerate() {
            let at = (cloud.offset + i * cloud.stride) / 4;
            words[at..at + 3].copy_from_slice(&p.to_array());
            if let Some((ids, _)) = cloud.ids.filter(|_| cloud.stride > 12) {
                words[at + 3] = f32::from_bits(ids[i]);
            }
        }
        let gpu = self.session.borrow().gpu;
        let upload = Upload::new(gpu, bytemuck::cast_slice(&words)).expect("upload");
        let own = Upload::new(gpu, bytemuck::cast_slice(cloud.ids.map_or(&[], |(ids, _)| ids))).expect("upload");
        let ids = cloud.ids.map(|(_, number)| match cloud.stride {
            12 => DeviceIds::packed(own.buffer, number),
            _ => DeviceIds::packed(upload.buffer, number).laid_out(cloud.offset as u64 + 12, cloud.stride as u64),
        });
        let count = cloud.positions.len() as u32;
        let positions = DevicePositions::packed(upload.buffer, count, case.particles.radius)
            .laid_out(cloud.offset as u64, cloud.stride as u64)
            .options(cloud.options)
            .keep_class_below(cloud.keep_class_below)
            .ids(ids);
        self.shoot_input(case, Inspection { neighbours, ..Inspection::default() }, &|input| input.positions(positions))
    }

    /// The same before a scene of the host's.
    pub fn shoot_before(&self, case: &Case, scene: SceneInput, background: Background) -> Shot {
        self.give(case);
        let mut shot =
            self.shoot_input(case, Inspection::default(), &|input| input.scene(scene).background(background));
        let p = case.camera.projection;
        shot.frame.scene_z_scale = p.z_axis.z;
        shot.frame.scene_z_offset = p.w_axis.z / shot.space.radius as f32;
        shot.frame.scene_cleared = scene.cleared_depth;
        shot
    }

    /// The same with another input.
    pub fn shoot_with(&self, case: &Case, change: &dyn for<'b> Fn(FrameInput<'b>) -> FrameInput<'b>) -> Shot {
        self.give(case);
        self.shoot_input(case, Inspection::default(), change)
    }

    /// The device that frames are rendered on.
    pub fn gpu(&self) -> &'a Gpu<'a> {
        self.session.borrow().gpu
    }

    fn shoot_input(
        &self,
        case: &Case,
        inspection: Inspection,
        change: &dyn for<'b> Fn(FrameInput<'b>) -> FrameInput<'b>,
    ) -> Shot {
        let session = &mut *self.session.borrow_mut();
        session.renderer.inspect(Inspection { walks: true, ..inspection });
        session.resize(case.size).expect("size");
        let input = FrameInput::new(0, &case.camera, &case.settings, ash::vk::ImageView::null());
        let input = input.eye_inside(case.eye_inside);
        session.frame(&change(input)).expect("frame");
        let mut targets = HashMap::new();
        for name in session.renderer.targets() {
            for layer in 0..2 {
                if let Some(words) = session.words(name, layer).expect("read back") {
                    targets.insert((name, layer), words);
                }
            }
        }
        let picture = session.picture().expect("picture");
        let bounds = case.particles.bounds().unwrap_or_default();
        let space = match targets.get(&("extent", 0)) {
            Some(extent) => Space::prepared(case.particles.radius, extent),
            None => Space::of(&case.particles),
        };
        let mut frame = inspect::uniforms(&case.camera, &case.settings, case.size, &space, bounds);
        frame.eye_inside = f32::from(case.eye_inside);
        let counters = session.counters().expect("counters");
        let block = session.block().expect("block");
        Shot { frame, block, space, size: case.size, picture, targets, counters }
    }
}

/// Of passes that the default does without: Imai16's settings.
pub fn imai16() -> Settings {
    Method::preset("imai16").expect("a preset").into()
}

/// Settings by what tests change of them.
pub trait Choose {
    /// Light that bends at up to 1, 2 or 4 surfaces, and is reflected inside so often.
    fn refractions(&self, count: u32) -> Settings;
    fn reflections(&self, count: u32) -> Settings;
    /// So many reflected rays are followed.
    fn tracing(&self, count: u32) -> Settings;
    fn iterations(&self, count: u32) -> Settings;
    fn absorption(&self, absorption: Vec3) -> Settings;
    fn quads_only(&self, quads: bool) -> Settings;
    fn occlusion_culling(&self, culling: bool) -> Settings;
    /// What the optics are told.
    fn walk(&self) -> Walk;
    /// What the smoothing is told.
    fn fit(&self) -> PlaneFit;
}

/// The same settings with something else in them.
fn with(settings: &Settings, change: impl FnOnce(&mut Settings)) -> Settings {
    let mut settings = *settings;
    change(&mut settings);
    settings
}

impl Choose for Settings {
    fn refractions(&self, count: u32) -> Settings {
        let walk = self.walk();
        let optics = match count {
            4 => Four::default().internal_reflections(walk.internal_reflections).fresnel(walk.fresnel).into(),
            2 => Two::default().internal_reflections(walk.internal_reflections).fresnel(walk.fresnel).into(),
            _ => One::default().fresnel(walk.fresnel).into(),
        };
        with(self, |s| s.method.optics = optics)
    }

    fn reflections(&self, count: u32) -> Settings {
        let change = |optics: &mut Optics| match optics {
            Optics::Four(p) => p.internal_reflections = count,
            Optics::Two(p) => p.internal_reflections = count,
            _ => {}
        };
        with(self, |s| change(&mut s.method.optics))
    }

    fn tracing(&self, count: u32) -> Settings {
        with(self, |s| s.method.set("trace_reflections", &count.to_string()).expect("a parameter"))
    }

    fn iterations(&self, count: u32) -> Settings {
        let smooth = self.fit().iterations(count).into();
        with(self, |s| s.method.smooth = smooth)
    }

    fn absorption(&self, absorption: Vec3) -> Settings {
        with(self, |s| s.liquid.absorption = absorption)
    }

    fn quads_only(&self, quads: bool) -> Settings {
        with(self, |s| s.drawing.quads_only = quads)
    }

    fn occlusion_culling(&self, culling: bool) -> Settings {
        with(self, |s| s.drawing.occlusion_culling = culling)
    }

    fn walk(&self) -> Walk {
        Walk::of(&self.method.optics).expect("optics that walk")
    }

    fn fit(&self) -> PlaneFit {
        match self.method.smooth {
            Smooth::PlaneFit(p) => p,
            _ => PlaneFit::default(),
        }
    }
}

/// A small linear congruential generator: the same numbers everywhere, no dependency.
pub struct Random(pub u64);

impl Random {
    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    pub fn point(&mut self, low: Vec3, high: Vec3) -> Vec3 {
        low + (high - low) * Vec3::new(self.unit(), self.unit(), self.unit())
    }

    pub fn rotation(&mut self) -> Mat3 {
        let axis = (self.point(Vec3::splat(-1.0), Vec3::ONE) + Vec3::new(0.0, 0.0, 1e-3)).normalize();
        Mat3::from_axis_angle(axis, self.between(0.0, std::f32::consts::TAU))
    }
}

/// A sphere as drawn.
pub fn sphere(center: Vec3, radius: f32) -> Ellipsoid {
    Ellipsoid { center, axes: Mat3::from_diagonal(Vec3::splat(radius)) }
}

/// Random particles of radius `radius` in a box: `splash` spheres, then `body` ellipsoids with semi-axes of 0.3 to
/// 1.2 radii in any orientation.
pub fn random_cloud(seed: u64, radius: f32, low: Vec3, high: Vec3, splash: usize, body: usize) -> Particles {
    let mut random = Random(seed);
    let mut ellipsoids: Vec<_> = (0..splash).map(|_| sphere(random.point(low, high), radius)).collect();
    for _ in 0..body {
        let axes = radius * Vec3::new(random.between(0.3, 1.2), random.between(0.3, 1.2), random.between(0.3, 1.2));
        ellipsoids
            .push(Ellipsoid { center: random.point(low, high), axes: random.rotation() * Mat3::from_diagonal(axes) });
    }
    Particles { radius, ellipsoids, splash_count: splash }
}

/// A filled box of body spheres at rest spacing (2 r), `n` particles along each axis, centred at `center`.
pub fn lattice(center: Vec3, radius: f32, n: [usize; 3]) -> Vec<Ellipsoid> {
    let mut all = Vec::new();
    for i in 0..n[0] {
        for j in 0..n[1] {
            for k in 0..n[2] {
                let at = Vec3::new(i as f32, j as f32, k as f32)
                    - 0.5 * (Vec3::new(n[0] as f32, n[1] as f32, n[2] as f32) - 1.0);
                all.push(sphere(center + 2.0 * radius * at, radius));
            }
        }
    }
    all
}

/// A camera at `eye` looking at `target`, 45 degrees high, near plane at 0.01.
pub fn camera(eye: Vec3, target: Vec3, size: [u32; 2]) -> Camera {
    Camera::look_at(eye, target, Vec3::Y, 45f32.to_radians(), size[0] as f32 / size[1] as f32, 0.01)
}
