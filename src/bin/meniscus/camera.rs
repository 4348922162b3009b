//! Where to look from.

use glam::{DQuat, DVec2, DVec3, Vec3};
use meniscus::{Camera, Ellipsoid, Error, Particles};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What is said about the camera; world units, in the file's coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct View {
    /// Chosen to frame the liquid if there is none.
    pub eye: Option<DVec3>,
    /// The middle of the liquid if there is none.
    pub target: Option<DVec3>,
    /// Degrees that the eye is turned around the target, about up: counter-clockwise as seen from above.
    pub orbit: f64,
    /// Up, for the camera and the environment.
    pub up: DVec3,
    /// Vertical field of view in degrees.
    pub fov_y: f32,
    /// What is up in the picture; `up` if there is none.
    pub upright: Option<DVec3>,
    /// Where the middle of the picture is beside the view axis: parts of its width to the right, of its height up.
    pub shift: DVec2,
    /// Distance before which no liquid is drawn; a tenth of a particle's radius if there is none.
    pub near: Option<f64>,
    /// Camera file that decides all of it but `up`: until that is read.
    pub file: Option<PathBuf>,
}

impl Default for View {
    fn default() -> View {
        View {
            eye: None,
            target: None,
            orbit: 0.0,
            up: DVec3::Y,
            fov_y: 40.0,
            upright: None,
            shift: DVec2::ZERO,
            near: None,
            file: None,
        }
    }
}

impl View {
    /// Checks what can be checked without the liquid.
    pub fn validate(&self) -> Result<(), Error> {
        if !(self.fov_y > 0.0 && self.fov_y < 170.0) {
            return Err(wrong("fov-y", self.fov_y.to_string(), "use degrees above 0 and below 170"));
        }
        // Of a vector too long for its length to be a number the direction is nothing.
        if !self.up.normalize().is_normalized() {
            return Err(wrong("up", self.up.to_string(), "use a finite direction that is not zero"));
        }
        if let Some(upright) = self.upright.filter(|u| !u.normalize().is_normalized()) {
            return Err(wrong("upright", upright.to_string(), "use a finite direction that is not zero"));
        }
        if !self.shift.abs().cmple(DVec2::splat(1e4)).all() {
            return Err(wrong("shift", self.shift.to_string(), "use -10000 to 10000"));
        }
        // The renderer has it in single precision.
        if let Some(near) = self.near.filter(|n| !(*n as f32 > 0.0 && (*n as f32).is_finite())) {
            return Err(wrong("near", near.to_string(), "use a finite distance above 0"));
        }
        if !self.orbit.is_finite() {
            return Err(wrong("orbit", self.orbit.to_string(), "use a finite number of degrees"));
        }
        for (name, point) in [("eye", self.eye), ("target", self.target)] {
            if let Some(point) = point.filter(|p| !p.is_finite()) {
                return Err(wrong(name, point.to_string(), "use a finite point"));
            }
        }
        Ok(())
    }
}

/// The camera, and its eye, in coordinates relative to `origin`; and the view with nothing left open. What is not given is
/// chosen so that the liquid fills the view.
pub fn frame(
    view: &View,
    origin: DVec3,
    particles: &Particles,
    aspect: f32,
    near: f32,
) -> Result<(Camera, Vec3, View), Error> {
    view.validate()?;
    let up = view.up.normalize();
    let fov = view.fov_y.to_radians();
    let local = |p: DVec3| p - origin;
    let (fit_eye, fit_target) = match (view.eye, view.target) {
        (Some(eye), Some(target)) => (local(eye), local(target)),
        _ => fit(up, f64::from(fov), f64::from(aspect), particles),
    };
    let whole_target = view.target.unwrap_or(fit_target + origin);
    let target = local(whole_target);
    let whole_eye = view.eye.unwrap_or(fit_eye + (target - fit_target) + origin);
    let turned = DQuat::from_axis_angle(up, view.orbit.rem_euclid(360.0).to_radians()) * (whole_eye - whole_target);
    let seen_from = if view.orbit == 0.0 { whole_eye } else { whole_target + turned };
    // By way of the file's coordinates also where it was chosen here: given as such it is the same eye.
    let eye = local(seen_from);
    let whole = View { eye: Some(whole_eye), target: Some(whole_target), ..view.clone() };
    let apart = (target - eye).normalize_or_zero();
    if !(eye.as_vec3().is_finite() && target.as_vec3().is_finite()) || apart == DVec3::ZERO {
        return Err(wrong("eye and target", format!("{eye} and {target}"), "use two different finite points"));
    }
    // Looking straight up or down, any other direction does for "up" on the screen.
    let upright = view.upright.map_or(up, DVec3::normalize);
    let screen_up = if apart.cross(upright).length() < 1e-3 { apart.any_orthonormal_vector() } else { upright };
    // A point of the line of sight that float32 tells from the eye, however near the target is.
    let ahead = (eye + apart * eye.length().max((target - eye).length())).as_vec3();
    let mut camera = Camera::look_at(eye.as_vec3(), ahead, screen_up.as_vec3(), fov, aspect, near);
    camera.up = up.as_vec3();
    // Clip space is two wide, and has y down.
    camera.projection.z_axis.x = 2.0 * view.shift.x as f32;
    camera.projection.z_axis.y = -2.0 * view.shift.y as f32;
    Ok((camera, eye.as_vec3(), whole))
}

fn wrong(parameter: &'static str, value: String, remedy: &str) -> Error {
    Error::Parameter { parameter, value, remedy: remedy.into() }
}

/// Eye and target from which every particle is in view, as close as can be, along a fixed direction: from a little
/// above, with the longer horizontal side across the picture. In double precision, because squares of lengths occur, and
/// scenes may be as small or large as float32 allows.
fn fit(up: DVec3, fov_y: f64, aspect: f64, particles: &Particles) -> (DVec3, DVec3) {
    let bounds = particles.bounds().map(|(low, high)| (low.as_dvec3(), high.as_dvec3()));
    let (low, high) = bounds.unwrap_or((DVec3::splat(-1.0), DVec3::splat(1.0)));
    let extent = |d: DVec3| (high - low).dot(d.abs());
    let (a, b) = if up.x.abs() < 0.9 {
        (up.cross(DVec3::X).normalize(), DVec3::X)
    } else {
        (DVec3::Z, DVec3::Z.cross(up).normalize())
    };
    let (across, along) = if extent(a) > extent(b) { (a, b) } else { (b, a) };
    let back = (along + 0.35 * across + 0.30 * up).normalize();
    let right = up.cross(back).normalize();
    let screen_up = back.cross(right);
    let tan_y = (0.5 * fov_y).tan();
    // A point at (x, z) in (right, back) is in view of an eye at (c, D) if |x - c| <= (D - z) tan: the largest
    // x + z tan and -x + z tan over all points give the best c and D in closed form. The same holds for y.
    let best = |axis: DVec3, tan: f64| {
        let most = |sign: f64| {
            let of = |e: &Ellipsoid| {
                let center = e.center.as_dvec3();
                sign * center.dot(axis) + center.dot(back) * tan
            };
            let corners = [low, high].map(|c| sign * c.dot(axis) + c.dot(back) * tan);
            let widest = particles.ellipsoids.iter().map(of).reduce(f64::max).unwrap_or(corners[0].max(corners[1]));
            widest + f64::from(particles.radius)
        };
        let (plus, minus) = (most(1.0), most(-1.0));
        (0.5 * (plus - minus), 0.5 * (plus + minus) / tan)
    };
    let ((cx, dx), (cy, dy)) = (best(right, tan_y * aspect), best(screen_up, tan_y));
    let middle = cx * right + cy * screen_up;
    let depth = 0.5 * (low + high).dot(back);
    let distance = (dx.max(dy) - depth).max(1e-3 * f64::from(particles.radius)) * 1.06;
    (middle + (depth + distance) * back, middle + depth * back)
}
