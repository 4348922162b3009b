//! What a frame is asked for: method, liquid, drawing; and the camera.

use crate::{
    Error, Method,
    parameters::{Parameter, Parameters, Part, choices, parameters},
    shader::Frame,
    space::Space,
};
use bytemuck::Zeroable;
use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};

parameters! {
    /// The liquid itself.
    pub struct Liquid {
        /// Index of refraction against air
        ior: f32 = 1.333, "", "a value above 1, up to 4" => |n| *n > 1.0 && *n <= 4.0;
        /// Absorption of red, green and blue light (Imai16 eq. 9: a·c_a)
        absorption: Vec3 = Vec3::ZERO, "1 / world unit", "three finite values of at least 0"
            => |a| a.is_finite() && a.min_element() >= 0.0;
    }
}

choices! {
    /// How many particles an invocation takes that sums over their neighbours on the device.
    pub enum AtOnce {
        /// What suits the device: four on CPUs, one on GPUs.
        #[default]
        ByDevice = "by-device",
        /// Four, which share what is read of candidates.
        Four = "four",
        /// One, with a fourth of the registers.
        One = "one",
    }
}

impl AtOnce {
    pub(crate) fn is_four(self, on_cpu: bool) -> bool {
        self == AtOnce::Four || (self == AtOnce::ByDevice && on_cpu)
    }
}

parameters! {
    /// How particles are drawn. Changes no pixel.
    pub struct Drawing {
        /// Drop particles of the body that others hide
        occlusion_culling: bool = true, "", "true or false" => |_| true;
        /// Draw quads even where point sprites would do
        quads_only: bool = false, "", "true or false" => |_| true;
        /// Where the device prepares particles: how many of them an invocation takes
        at_once: AtOnce = AtOnce::ByDevice, "", "by-device (four on CPUs, one on GPUs), four or one" => |_| true;
    }
}

/// What a frame is asked for, beside its camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct Settings {
    /// Layers, smoothing, optics.
    pub method: Method,
    /// The liquid itself.
    pub liquid: Liquid,
    /// How particles are drawn.
    pub drawing: Drawing,
}

impl From<Method> for Settings {
    /// With the liquid and the drawing of the defaults.
    fn from(method: Method) -> Settings {
        Settings { method, ..Settings::default() }
    }
}

impl Settings {
    fn groups(&self) -> [&dyn Parameters; 5] {
        let m = &self.method;
        [m.layers.parameters(), m.smooth.parameters(), m.optics.parameters(), &self.liquid, &self.drawing]
    }

    /// What settings consist of: all there is to choose and to set.
    pub fn parts() -> Vec<Part> {
        let mut parts = Method::families();
        parts.push(Part::group("liquid", Box::<Liquid>::default()));
        parts.push(Part::group("drawing", Box::<Drawing>::default()));
        parts
    }

    /// Every parameter that these settings have.
    pub fn parameters(&self) -> Vec<Parameter> {
        self.groups().iter().flat_map(|g| g.parameters()).collect()
    }

    /// Sets a parameter of whichever part has it, from text; [`Settings::validate`] checks ranges.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), Error> {
        for group in [&mut self.liquid as &mut dyn Parameters, &mut self.drawing] {
            if group.parameters().iter().any(|p| p.name == name) {
                return group.set(name, text);
            }
        }
        let known: Vec<_> = self.groups().into_iter().flat_map(Parameters::parameters).collect();
        if !known.iter().any(|p| p.name == name) {
            return Err(crate::parameters::unknown(name, &known));
        }
        self.method.set(name, text)
    }

    /// The same for a picture that is rendered at `times` its size, to be averaged: what is counted in pixels covers the same
    /// part of it. Parameters may leave their ranges.
    #[must_use]
    pub fn enlarged(mut self, times: u32) -> Settings {
        let m = &mut self.method;
        let groups = [m.layers.parameters_mut(), m.smooth.parameters_mut(), m.optics.parameters_mut()];
        groups.into_iter().for_each(|g| g.enlarge(times));
        self
    }

    /// Checks every range, and that the members of the method go together.
    pub fn validate(&self) -> Result<(), Error> {
        self.method.validate()?;
        self.liquid.validate()?;
        self.drawing.validate()
    }
}

/// A perspective camera, as it is drawn with: the picture's upper left corner is (-1, -1) in Vulkan's clip space.
///
/// * Left-handed worlds: `view` may mirror. An eye space that looks along +z, with w = +z, becomes this one by
///   F = diag(1, 1, -1, 1): `projection: p * F`, `view: F * v`.
/// * Viewports of negative height turn y around after the projection: negate `projection`'s second row.
/// * Of the projection x and y count, and for the depth of a host's scene how z becomes a depth; `near` stands for itself.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Camera {
    /// World to eye: a rotation, with or without a reflection, and a translation.
    pub view: Mat4,
    /// Eye to Vulkan clip space (y down), perspective: w = -z. May be off-centre, jittered, reversed or infinite.
    pub projection: Mat4,
    /// Distance from the eye along the view axis, above 0, before which no liquid is drawn. It need not be the projection's
    /// near plane: farther than that it cuts liquid off, nearer it draws liquid before what the host's own scene can hold. An
    /// eye in the liquid sees from there on.
    pub near: f32,
    /// World direction in which the environment's +y points, after the shortest turn that brings one to the other.
    pub up: Vec3,
    /// Angle by which the environment is turned around `up`, in radians: counter-clockwise as seen from above, so that what
    /// was in the middle of an equirectangular map (+x) turns towards -z.
    pub environment_rotation: f32,
}

impl Camera {
    /// A camera of the host's own matrices (see the fields); up is +y, and the environment is not turned.
    pub fn new(view: Mat4, projection: Mat4, near: f32) -> Camera {
        Camera { view, projection, near, up: Vec3::Y, environment_rotation: 0.0 }
    }

    /// A camera at `eye` that looks at `target`, `fov_y` radians high. Its projection is infinite: the depth is 0 at `near`
    /// and 1 infinitely far away, where a depth buffer is cleared to.
    pub fn look_at(eye: Vec3, target: Vec3, up: Vec3, fov_y: f32, aspect: f32, near: f32) -> Camera {
        use glam::camera::rh;
        let projection = rh::proj::vulkan::perspective_infinite(fov_y, aspect, near);
        // In double precision: squares of lengths may not be float32 numbers.
        let ahead = (target.as_dvec3() - eye.as_dvec3()).normalize().as_vec3();
        Camera { view: rh::view::look_to_mat4(eye, ahead, up), projection, near, up, environment_rotation: 0.0 }
    }

    /// Checks that this is a rigid view and a perspective projection.
    pub fn validate(&self) -> Result<(), Error> {
        let r = Mat3::from_mat4(self.view);
        let rigid = (r * r.transpose()).abs_diff_eq(Mat3::IDENTITY, 1e-3)
            && self.view.is_finite()
            && self.view.row(3).abs_diff_eq(Vec4::W, 1e-6);
        if !rigid {
            let remedy = "use a rotation (it may mirror) and a translation; scale the scene instead, and keep eye, target and \
                          up apart";
            return Err(Error::parameter("camera view", self.view, remedy));
        }
        let p = &self.projection;
        let perspective = p.is_finite()
            && p.row(3).abs_diff_eq(Vec4::new(0.0, 0.0, -1.0, 0.0), 1e-6)
            && [p.x_axis.x, p.y_axis.y].iter().all(|scale| (1e-4..=1e6).contains(&scale.abs()))
            && [p.z_axis.x, p.z_axis.y].iter().all(|shift| shift.abs() <= 1e6)
            && p.y_axis.x == 0.0
            && p.x_axis.y == 0.0;
        if !perspective {
            return Err(Error::parameter(
                "camera projection",
                p,
                "use a perspective projection with w = -z; its scales in x and y from 1e-4 to 1e6",
            ));
        }
        if !(self.near > 0.0 && self.near.is_finite()) {
            return Err(Error::parameter("near plane", self.near, "use a finite distance above 0"));
        }
        if !(self.up.is_finite() && self.up != Vec3::ZERO) {
            return Err(Error::parameter("up", self.up, "use a finite direction that is not zero"));
        }
        if !self.environment_rotation.is_finite() {
            return Err(Error::parameter("environment rotation", self.environment_rotation, "use a finite angle"));
        }
        Ok(())
    }

    /// The uniform block of a frame, as shaders and twins read it: lengths in particle radii, positions in the liquid's
    /// own [`Space`]. `size` in pixels, `bounds` (the box around the liquid) in world units. Host scene, environment map and
    /// particle counts are left zero.
    pub(crate) fn uniforms(&self, settings: &Settings, size: [u32; 2], space: &Space, bounds: (Vec3, Vec3)) -> Frame {
        let radius = space.radius as f32;
        let view = space.view(self.view);
        let (w, h) = (size[0] as f32, size[1] as f32);
        let p = &self.projection;
        let to_up = Mat3::from_quat(glam::Quat::from_rotation_arc(self.up.as_dvec3().normalize().as_vec3(), Vec3::Y));
        // Where the map is turned one way, directions are looked up turned the other. Whole turns in double precision.
        let turn = f64::from(self.environment_rotation) % std::f64::consts::TAU;
        let to_env = Mat3::from_rotation_y(-turn as f32) * to_up;
        Frame {
            view,
            eye_to_env: Mat4::from_mat3(to_env * Mat3::from_mat4(self.view).transpose()),
            // pixel = (ndc + 1) / 2 * size and ndc = P v - P02 for v = (x/d, y/d, -1)
            pixel_scale: Vec2::new(p.x_axis.x * 0.5 * w, p.y_axis.y * 0.5 * h),
            pixel_origin: Vec2::new((1.0 - p.z_axis.x) * 0.5 * w, (1.0 - p.z_axis.y) * 0.5 * h),
            size: Vec2::new(w, h),
            near: self.near / radius,
            ior: settings.liquid.ior,
            absorption: (settings.liquid.absorption * radius).min(Vec3::MAX), // infinite times nothing is no number
            bounds_min: space.local(bounds.0),
            bounds_max: space.local(bounds.1),
            ..Frame::zeroed()
        }
    }
}
