//! THE FRAME, from top to bottom. Everything a frame does is a line here. A pass has one stem: its shader is in `glsl/`,
//! its CPU twin and its test go by the same name.

use crate::{
    Error, Settings,
    device::Limits,
    input::{Background, EnvironmentShape, Says},
    layers::{Kind, Surfaces},
    method::Offers,
    optics::walk::Walk,
    passes::{Arrays, Points, compact, cull, extent, first_surface, occlude, shape, sort, surface},
    plan::{Home, Plan},
    scale::Scale,
    shader, smooth,
    space::Space,
};
use ash::vk;
use glam::{Mat4, Vec3};

/// The passes of one frame. What a scene does not need is not there: no splash particles, no splash maps; one refraction,
/// no back maps; no particles at all, only the background.
pub(crate) fn plan(scene: &Scene) -> Result<Plan, Error> {
    let mut plan = Plan::new(scene.size);
    let method = &scene.settings.method;
    let mut surfaces = Surfaces::default();
    if scene.count > 0 {
        plan.work_for(Home::Particles, "particles");
        // From positions on the device: their box, their neighbours (Im16 §III).
        let sorted = scene.prepare.as_ref().map(|p| {
            let extent = extent::record(&mut plan, scene, &p.constants);
            (p, extent, sort::record(&mut plan, scene, p, extent))
        });
        match method.layers.member().kind() {
            Kind::Maps(maps) => {
                let particles = match &sorted {
                    // Classes and ellipsoids (YuTurk13).
                    Some((p, extent, sorted)) => shape::record(&mut plan, scene, p, *extent, sorted),
                    None => Arrays::given(&mut plan),
                };

                plan.work_for(Home::View, "visibility");
                // Optics that upsample have the surfaces at half the picture's width and height (Cords08 §5).
                plan.work_at(scene.scale());
                // Which particles can show at all.
                let bounds = scene.occlusion().then(|| occlude::record(&mut plan, scene, &particles));
                let culled = cull::record(&mut plan, scene, &particles, bounds);
                let drawn = compact::record(&mut plan, scene, &particles, &culled);
                // The liquid's surfaces (Imai16 §4.2), the body's smoothed (Imai16 §4.3).
                plan.work_for(Home::View, "layers");
                let layered = maps.record(&mut plan, scene, &drawn);
                plan.work_for(Home::View, "smooth");
                plan.smoothing_steps = scene.smoothing_steps;
                surfaces.body = layered.body.map(|body| smooth::record(&mut plan, &method.smooth, &body));
                (surfaces.splash, surfaces.thickness, surfaces.speed) =
                    (layered.splash, layered.thickness, layered.speed);
                surfaces.tiles = culled.tiles;
                plan.work_at(Scale::Full);
            }
            Kind::Field(field) => {
                let points = match &sorted {
                    // The same without ellipsoids: nobody draws them.
                    Some((p, extent, sorted)) => shape::points(&mut plan, scene, p, *extent, sorted),
                    None => Points::given(&mut plan),
                };
                // A density field around them (Iwasaki06), whose level is the surface.
                plan.work_for(Home::Particles, "field");
                surfaces.field = Some(field.record(&mut plan, scene, &points));
            }
        }
    }
    #[cfg(feature = "inspect")]
    {
        plan.surfaces = crate::inspect::SurfaceNames::new(&plan, &surfaces);
    }
    plan.work_for(Home::View, "optics");
    // Light through them (Imai16 §4.4, §4.5). Without liquid the host's picture stays.
    if scene.count > 0 || scene.walks || scene.background == Background::Environment {
        method.optics.member().record(&mut plan, scene, &surfaces);
    }
    // What later passes of the host's are told of the first surface.
    if scene.count > 0 && (scene.surface_read || scene.surface_formats().next().is_some()) {
        plan.work_for(Home::View, "surface");
        let first = first_surface::record(&mut plan, scene, &surfaces);
        surface::record(&mut plan, scene, first);
    }
    plan.finish()
}

/// What a frame draws: all that decides which passes it has.
pub(crate) struct Scene<'a> {
    pub settings: &'a Settings,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Particles that there may be.
    pub count: u32,
    /// Whether the device knows how many there are.
    pub counted: bool,
    /// Whether any of them may be splash.
    pub splash: bool,
    /// Whether any of them may belong to the body.
    pub body: bool,
    /// Preparation on the device, if the frame starts from positions there.
    pub prepare: Option<Preparation>,
    pub has_scene: bool,
    /// How the host's own environment maps directions; `None` for the renderer's.
    pub environment: Option<EnvironmentShape>,
    pub background: Background,
    pub output: vk::Format,
    /// Formats of the images that say something of the first surface.
    pub surface: [Option<(Says, vk::Format)>; Says::ALL.len()],
    /// How it has moved, in this view.
    pub motions: shader::Motions,
    /// And by itself, if it does.
    pub moves: Option<Moves>,
    /// What the mask of it says.
    pub reactive: f32,
    /// World to eye.
    pub eye: Mat4,
    /// The liquid's own space; where the device prepares particles only its unit counts.
    pub space: Space,
    /// Whether what each walk met is written too.
    pub walks: bool,
    /// Whether the first surface is found, for whoever reads it.
    pub surface_read: bool,
    /// Of smoothing only so many steps, if it has more.
    pub smoothing_steps: Option<u32>,
    /// Whether the device has points larger than a pixel.
    pub points: bool,
    /// Largest edge of an image.
    pub image_size: u32,
    /// Largest storage buffer in bytes, and texel buffer.
    pub storage_size: u64,
    pub texels_size: u64,
}

/// What the preparation on the device is told.
#[derive(Clone, Copy)]
pub(crate) struct Preparation {
    pub constants: shader::Prepare,
    /// Entries of the sort: one a particle, or 27.
    pub entries: u64,
    /// Whether ellipsoids are YuTurk13's.
    pub yu_turk: bool,
    /// By what classes are kept from frame to frame, if they are.
    pub kept: Option<Kept>,
    /// Whether no classes of the last frame's count.
    pub anew: bool,
    /// Neighbours of each particle that are listed.
    pub neighbours: u32,
}

/// Particles that move, as the pass is told of them.
#[derive(Clone, Copy)]
pub(crate) struct Moves {
    /// That there may be.
    pub count: u32,
    /// Whether the device knows how many there are.
    pub counted: bool,
    /// Whether their velocities are known, or where they were.
    pub velocities: bool,
    pub block: shader::Moving,
}

/// Classes that are kept from frame to frame.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Kept {
    /// By ids of the host's, or else by index in its buffer.
    pub by_id: bool,
    /// How many there are.
    pub number: u32,
}

impl<'a> Scene<'a> {
    /// A frame of so many particles, before the environment alone.
    pub fn new(settings: &'a Settings, size: [u32; 2], [splash, body]: [usize; 2], limits: &Limits) -> Scene<'a> {
        Scene {
            settings,
            size,
            count: (splash + body) as u32,
            counted: false,
            splash: splash > 0,
            body: body > 0,
            prepare: None,
            has_scene: false,
            environment: None,
            background: Background::Environment,
            output: vk::Format::R32G32B32A32_SFLOAT,
            surface: Default::default(),
            motions: bytemuck::Zeroable::zeroed(),
            moves: None,
            reactive: 0.0,
            eye: Mat4::IDENTITY,
            space: Space::new(1.0, Vec3::ZERO),
            walks: false,
            surface_read: false,
            smoothing_steps: None,
            points: limits.point_size > 1.0,
            image_size: limits.image_size,
            storage_size: limits.storage_size,
            texels_size: limits.texels_size,
        }
    }

    /// What smoothing and optics ask of the layers.
    pub fn asks(&self) -> Offers {
        self.settings.method.asks()
    }

    /// At what scale of the picture surfaces are drawn and smoothed.
    pub fn scale(&self) -> Scale {
        if self.asks().half { Scale::Half } else { Scale::Full }
    }

    /// Sides of each class that are drawn: front only, or front and back.
    pub fn sides(&self) -> u32 {
        if self.asks().backs { 2 } else { 1 }
    }

    /// Whether the optics draw tiles of the view that have liquid apart from those that have none.
    pub fn tiled(&self) -> bool {
        Walk::of(&self.settings.method.optics).is_some()
    }

    /// Whether hidden particles are dropped before drawing. That only saves time: where its bounds do not fit a storage
    /// buffer, everything is drawn.
    pub fn occlusion(&self) -> bool {
        let pixels: u64 = self.scale().size(self.size).map(u64::from).iter().product();
        let may_cull = match self.settings.method.layers.member().kind() {
            Kind::Maps(maps) => maps.may_cull(self),
            Kind::Field(_) => false,
        };
        let wanted = self.settings.drawing.occlusion_culling && may_cull;
        self.body && wanted && 8 * pixels <= self.storage_size
    }

    /// What is said of the first surface, and in what format.
    pub fn surface_formats(&self) -> impl Iterator<Item = (Says, vk::Format)> {
        self.surface.into_iter().flatten()
    }

    /// Whether the last shader encodes sRGB.
    pub fn encode_srgb(&self) -> bool {
        crate::optics::walk::takes_linear(self.output) == Some(false)
    }
}
