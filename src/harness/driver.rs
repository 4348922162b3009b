//! A driver at work: frames of chosen particles, and everything that they leave behind.

use crate::{
    Background, Camera, Class, FrameInput, Particles, Point, SceneInput, Settings,
    host::{Gpu, Instance, Session, Upload},
    inspect::{self, Inspection},
    prepare::{self, DeviceIds, DevicePositions},
    shader::Frame,
    space::Space,
};
use ash::vk::ImageView;
use glam::Vec3;
use std::{cell::RefCell, collections::HashMap};

/// One frame's input.
#[derive(Clone)]
pub struct Case {
    /// As drawn.
    pub particles: Particles,
    /// From where.
    pub camera: Camera,
    /// How.
    pub settings: Settings,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Whether the eye is inside the body.
    pub eye_inside: bool,
}

/// Positions to be prepared on the device.
pub struct Cloud<'a> {
    /// Where they are.
    pub positions: &'a [Vec3],
    /// How they are prepared.
    pub options: prepare::Options,
    /// See [`DevicePositions::keep_class_below`].
    pub keep_class_below: Option<f32>,
    /// One for each position, and how many there may be. They lie beside their positions where the stride leaves room, or
    /// else in a buffer of their own.
    pub ids: Option<(&'a [u32], u32)>,
    /// Byte of the buffer at which the first one begins.
    pub offset: usize,
    /// Bytes from one to the next.
    pub stride: usize,
}

impl<'a> Cloud<'a> {
    /// Packed, with default options.
    pub fn new(positions: &'a [Vec3], search: prepare::Search) -> Cloud<'a> {
        let options = prepare::Options { search, ..Default::default() };
        Cloud { positions, options, keep_class_below: None, ids: None, offset: 0, stride: 12 }
    }
}

/// What a frame left behind.
pub struct Shot {
    /// The block that shaders are to have read.
    pub frame: Frame,
    /// The block that shaders read, as they left it.
    pub block: Frame,
    /// In which its targets and its twins measure: particle radii.
    pub space: Space,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Linear RGB, row by row.
    pub picture: Vec<[f32; 3]>,
    targets: HashMap<(&'static str, u32), Vec<u32>>,
    /// What shaders counted, by name.
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

    /// One of the counters.
    pub fn counter(&self, name: &str) -> u32 {
        self.counters.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("nothing counts {name}")).1
    }
}

/// One driver: an instance of its own, so that its validation messages are its own too.
pub struct Driver<'a> {
    /// With validation; [`Instance::messages`] are its own.
    pub instance: &'a Instance,
    /// One renderer for all frames: sizes, particles and settings change under it as they do in an engine.
    pub session: RefCell<Session<'a>>,
    /// Of device and driver, as [`Instance::pick`] finds it.
    pub name: String,
}

impl<'a> Driver<'a> {
    pub(super) fn new(instance: &'a Instance, session: Session<'a>, name: &str) -> Driver<'a> {
        Driver { instance, session: RefCell::new(session), name: name.into() }
    }

    pub(super) fn end(self) {
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
        let input = FrameInput::new(0, &case.camera, &case.settings, ImageView::null());
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

impl Driver<'_> {
    /// As if no test had come before: no particles, no resources, no classes kept.
    pub(super) fn start_anew(&self) {
        let renderer = &mut self.session.borrow_mut().renderer;
        renderer.set_particles(&Particles { radius: 1.0, ellipsoids: Vec::new(), splash_count: 0 }).expect("none");
        renderer.abandon(0);
    }
}
