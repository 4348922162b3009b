//! Where to look from.

use glam::{DVec3, Vec3};
use meniscus::{Camera, Error};

/// What the command line says about the camera; world units, in the file's coordinates.
pub struct View {
    pub eye: Option<DVec3>,
    pub target: Option<DVec3>,
    pub up: DVec3,
    pub fov_y_deg: f32,
}

/// The camera, and its eye, in coordinates relative to `origin`. What is not given is chosen so that the box
/// (`low`, `high`) fills the view, seen from a little above along its shorter horizontal side.
pub fn frame(
    view: &View,
    origin: DVec3,
    low: Vec3,
    high: Vec3,
    aspect: f32,
    near: f32,
) -> Result<(Camera, Vec3), Error> {
    if !(view.fov_y_deg > 0.0 && view.fov_y_deg < 170.0) {
        return Err(wrong("fov-y", view.fov_y_deg.to_string(), "use degrees above 0 and below 170"));
    }
    let up = view.up.as_vec3();
    if !(up.is_finite() && up.length() > 0.0) {
        return Err(wrong("up", view.up.to_string(), "use a finite direction that is not zero"));
    }
    let up = up.normalize();
    let fov = view.fov_y_deg.to_radians();
    let target = view.target.map_or(0.5 * (low + high), |t| (t - origin).as_vec3());
    let eye = match view.eye {
        Some(eye) => (eye - origin).as_vec3(),
        None => target + fit(up, fov, aspect, low - target, high - target),
    };
    let apart = (target - eye).normalize_or_zero();
    if !(eye.is_finite() && target.is_finite()) || apart == Vec3::ZERO {
        return Err(wrong("eye and target", format!("{eye} and {target}"), "use two different finite points"));
    }
    // Looking straight up or down, any other direction does for "up" on the screen.
    let screen_up = if apart.cross(up).length() < 1e-3 { apart.any_orthonormal_vector() } else { up };
    let mut camera = Camera::look_at(eye, target, screen_up, fov, aspect, near);
    camera.up = up;
    Ok((camera, eye))
}

fn wrong(parameter: &'static str, value: String, remedy: &str) -> Error {
    Error::Parameter { parameter, value, remedy: remedy.into() }
}

/// Offset of the eye from the target such that the whole box is in view.
fn fit(up: Vec3, fov_y: f32, aspect: f32, low: Vec3, high: Vec3) -> Vec3 {
    let corners: Vec<Vec3> =
        (0..8).map(|i| Vec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low)).collect();
    let (a, b) = if up.x.abs() < 0.9 {
        (up.cross(Vec3::X).normalize(), Vec3::X)
    } else {
        (Vec3::Z, Vec3::Z.cross(up).normalize())
    };
    let extent = |d: Vec3| corners.iter().map(|c| c.dot(d).abs()).fold(0.0, f32::max);
    // The longer horizontal side lies across the picture.
    let (across, along) = if extent(a) > extent(b) { (a, b) } else { (b, a) };
    let back = (along + 0.45 * across + 0.42 * up).normalize();
    let right = up.cross(back).normalize();
    let screen_up = back.cross(right);
    let (tan_y, tan_x) = ((0.5 * fov_y).tan(), (0.5 * fov_y).tan() * aspect);
    // A corner at distance t - c.back is inside if its sideways offsets are within the tangents, with 6 % to spare.
    let reach = |c: &Vec3| {
        let sideways = (c.dot(right).abs() / tan_x).max(c.dot(screen_up).abs() / tan_y);
        c.dot(back) + 1.06 * sideways
    };
    back * corners.iter().map(reach).fold(1e-6, f32::max)
}
