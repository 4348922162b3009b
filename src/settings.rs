//! What a frame is asked for: camera, smoothing and optics.

use crate::{Error, shader::Frame, space::Space};
use bytemuck::Zeroable;
use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};

/// Reflectance of the water surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Fresnel {
    /// Schlick's approximation (Imai16).
    #[default]
    Schlick,
    /// Exact, for unpolarised light between dielectrics.
    Exact,
}

/// Weights of plane fitting (Imai16 fig. 5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Weighting {
    /// Difference of depths, eq. (2): keeps depth gaps.
    #[default]
    ViewDependent,
    /// Distance of eye-space points: smooths across gaps; the paper's rejected alternative.
    Euclidean,
}

/// Smoothing and optics of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Surfaces at which light bends: 1 (fronts only; no back maps are made), 2 or 4.
    pub refractions: u32,
    /// Total internal reflections followed in one walk, 0 to 64.
    pub internal_reflections: u32,
    /// Reflectance.
    pub fresnel: Fresnel,
    /// Index of refraction of the liquid against air, above 1 and at most 4.
    pub ior: f32,
    /// Absorption per world unit for red, green and blue, at least 0 (eq. 9: a·c_a).
    pub absorption: Vec3,
    /// Edge of the plane-fitting window in pixels: odd, 3 to [`Settings::MAX_WINDOW`].
    pub window: u32,
    /// Iterations of plane fitting, 0 to 20; 0 leaves the body as ray-cast.
    pub iterations: u32,
    /// σ of eq. (2) in particle radii, above 0 (Imai16: 5.3).
    pub sigma: f32,
    /// Weights of plane fitting.
    pub weighting: Weighting,
    /// Drop particles of the body that others hide. Changes no pixel.
    pub occlusion_culling: bool,
    /// Draw quads even where point sprites would do. Changes no pixel.
    pub quads_only: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            refractions: 4,
            internal_reflections: 4,
            fresnel: Fresnel::Schlick,
            ior: 1.333,
            absorption: Vec3::ZERO,
            window: 9,
            iterations: 2,
            sigma: 5.3,
            weighting: Weighting::ViewDependent,
            occlusion_culling: true,
            quads_only: false,
        }
    }
}

impl Settings {
    /// Largest window: its tile of normals and depths fills the 16 KiB of shared memory that Vulkan guarantees.
    pub const MAX_WINDOW: u32 = 25;

    /// Checks every range.
    pub fn validate(&self) -> Result<(), Error> {
        let check = |ok: bool, name, value: String, remedy: &str| {
            if ok { Ok(()) } else { Err(Error::parameter(name, value, remedy)) }
        };
        check(matches!(self.refractions, 1 | 2 | 4), "refractions", self.refractions.to_string(), "use 1, 2 or 4")?;
        check(
            self.internal_reflections <= 64,
            "internal reflections",
            self.internal_reflections.to_string(),
            "use 0 to 64",
        )?;
        check(
            self.ior > 1.0 && self.ior <= 4.0,
            "index of refraction",
            self.ior.to_string(),
            "use a value above 1, up to 4",
        )?;
        let absorbs = self.absorption.is_finite() && self.absorption.min_element() >= 0.0;
        check(absorbs, "absorption", self.absorption.to_string(), "use three finite values of at least 0")?;
        let odd = self.window % 2 == 1 && (3..=Self::MAX_WINDOW).contains(&self.window);
        check(odd, "window", self.window.to_string(), "use an odd number of pixels from 3 to 25")?;
        check(self.iterations <= 20, "iterations", self.iterations.to_string(), "use 0 to 20")?;
        check(
            self.sigma.is_finite() && self.sigma > 0.0,
            "sigma",
            self.sigma.to_string(),
            "use a finite value above 0, in particle radii",
        )
    }
}

/// A perspective camera, as it is drawn with: the picture's upper left corner is (-1, -1) in Vulkan's clip space.
///
/// * Left-handed worlds: `view` may mirror. An eye space that looks along +z, with w = +z, becomes this one by
///   F = diag(1, 1, -1, 1): `projection: p * F`, `view: F * v`.
/// * Viewports of negative height turn y around after the projection: negate `projection`'s second row.
/// * Of the projection x and y count, and for the depth of a host's scene how z becomes a depth; `near` stands for itself.
#[derive(Clone, Copy, Debug, PartialEq)]
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
}

impl Camera {
    /// A camera at `eye` that looks at `target`, `fov_y` radians high. Its projection is infinite: the depth is 0 at `near`
    /// and 1 infinitely far away, where a depth buffer is cleared to.
    pub fn look_at(eye: Vec3, target: Vec3, up: Vec3, fov_y: f32, aspect: f32, near: f32) -> Camera {
        use glam::camera::rh;
        let projection = rh::proj::vulkan::perspective_infinite(fov_y, aspect, near);
        // In double precision: squares of lengths may not be float32 numbers.
        let ahead = (target.as_dvec3() - eye.as_dvec3()).normalize().as_vec3();
        Camera { view: rh::view::look_to_mat4(eye, ahead, up), projection, near, up }
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
        Ok(())
    }

    /// The uniform block of a frame, as shaders and twins read it: lengths in particle radii, positions in the liquid's
    /// own [`Space`]. `size` in pixels, `bounds` (the box around the liquid) in world units. Host scene and particle counts
    /// are left zero.
    pub fn uniforms(&self, settings: &Settings, size: [u32; 2], space: &Space, bounds: (Vec3, Vec3)) -> Frame {
        let radius = space.radius as f32;
        let view = space.view(self.view);
        let (w, h) = (size[0] as f32, size[1] as f32);
        let p = &self.projection;
        let to_up = Mat3::from_quat(glam::Quat::from_rotation_arc(self.up.as_dvec3().normalize().as_vec3(), Vec3::Y));
        Frame {
            view,
            eye_to_env: Mat4::from_mat3(to_up * Mat3::from_mat4(self.view).transpose()),
            // pixel = (ndc + 1) / 2 * size and ndc = P v - P02 for v = (x/d, y/d, -1)
            pixel_scale: Vec2::new(p.x_axis.x * 0.5 * w, p.y_axis.y * 0.5 * h),
            pixel_origin: Vec2::new((1.0 - p.z_axis.x) * 0.5 * w, (1.0 - p.z_axis.y) * 0.5 * h),
            size: Vec2::new(w, h),
            near: self.near / radius,
            ior: settings.ior,
            absorption: (settings.absorption * radius).min(Vec3::MAX), // infinite times nothing is no number
            sigma: settings.sigma,
            bounds_min: space.local(bounds.0),
            bounds_max: space.local(bounds.1),
            ..Frame::zeroed()
        }
    }
}
