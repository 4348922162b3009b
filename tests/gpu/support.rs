//! What every GPU test shares beside the harness: scenes, and settings by what tests change of them.

use glam::{Mat3, Vec3};
pub use meniscus::harness::{Case, Cloud, Driver, SKY, Shot, each_driver};
use meniscus::{
    Camera, Ellipsoid, Method, Particles, Settings,
    inspect::Walk,
    optics::{Optics, four::Four, many::Many, one::One, two::Two},
    smooth::{Smooth, plane_fit::PlaneFit},
};

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
            1 => One::default().fresnel(walk.fresnel).into(),
            _ => Many::default()
                .volumes(count / 2)
                .internal_reflections(walk.internal_reflections)
                .fresnel(walk.fresnel)
                .into(),
        };
        with(self, |s| s.method.optics = optics)
    }

    fn reflections(&self, count: u32) -> Settings {
        let change = |optics: &mut Optics| match optics {
            Optics::Four(p) => p.internal_reflections = count,
            Optics::Two(p) => p.internal_reflections = count,
            Optics::Many(p) => p.internal_reflections = count,
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
