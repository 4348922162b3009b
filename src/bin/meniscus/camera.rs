//! Where to look from.

use glam::{DVec3, Vec3};
use meniscus::{Camera, Ellipsoid, Error, Particles};

/// What the command line says about the camera; world units, in the file's coordinates.
pub struct View {
    pub eye: Option<DVec3>,
    pub target: Option<DVec3>,
    pub up: DVec3,
    pub fov_y_deg: f32,
}

/// The camera, and its eye, in coordinates relative to `origin`. What is not given is chosen so that the
/// liquid fills the view.
pub fn frame(
    view: &View,
    origin: DVec3,
    particles: &Particles,
    aspect: f32,
    near: f32,
) -> Result<(Camera, Vec3), Error> {
    if !(view.fov_y_deg > 0.0 && view.fov_y_deg < 170.0) {
        return Err(wrong("fov-y", view.fov_y_deg.to_string(), "use degrees above 0 and below 170"));
    }
    let up = view.up.normalize().as_vec3();
    if !up.is_finite() {
        return Err(wrong("up", view.up.to_string(), "use a finite direction that is not zero"));
    }
    let fov = view.fov_y_deg.to_radians();
    let local = |p: DVec3| (p - origin).as_vec3();
    let (fit_eye, fit_target) = fit(up, fov, aspect, particles);
    let target = view.target.map_or(fit_target, local);
    let eye = view.eye.map_or(fit_eye + (target - fit_target), local);
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

/// Eye and target from which every particle is in view, as close as can be, along a fixed direction: from a little
/// above, with the longer horizontal side across the picture.
fn fit(up: Vec3, fov_y: f32, aspect: f32, particles: &Particles) -> (Vec3, Vec3) {
    let (low, high) = particles.bounds().unwrap_or((Vec3::splat(-1.0), Vec3::splat(1.0)));
    let extent = |d: Vec3| (high - low).dot(d.abs());
    let (a, b) = if up.x.abs() < 0.9 {
        (up.cross(Vec3::X).normalize(), Vec3::X)
    } else {
        (Vec3::Z, Vec3::Z.cross(up).normalize())
    };
    let (across, along) = if extent(a) > extent(b) { (a, b) } else { (b, a) };
    let back = (along + 0.35 * across + 0.30 * up).normalize();
    let right = up.cross(back).normalize();
    let screen_up = back.cross(right);
    let tan_y = (0.5 * fov_y).tan();
    // A point at (x, z) in (right, back) is in view of an eye at (c, D) if |x - c| <= (D - z) tan: the largest
    // x + z tan and -x + z tan over all points give the best c and D in closed form. The same holds for y.
    let best = |axis: Vec3, tan: f32| {
        let most = |sign: f32| {
            let of = |e: &Ellipsoid| sign * e.center.dot(axis) + e.center.dot(back) * tan;
            let corners = [low, high].map(|c| sign * c.dot(axis) + c.dot(back) * tan);
            let widest = particles.ellipsoids.iter().map(of).reduce(f32::max).unwrap_or(corners[0].max(corners[1]));
            widest + particles.radius
        };
        let (plus, minus) = (most(1.0), most(-1.0));
        (0.5 * (plus - minus), 0.5 * (plus + minus) / tan)
    };
    let ((cx, dx), (cy, dy)) = (best(right, tan_y * aspect), best(screen_up, tan_y));
    let middle = cx * right + cy * screen_up;
    let depth = 0.5 * (low + high).dot(back);
    let distance = (dx.max(dy) - depth).max(1e-6) * 1.06;
    (middle + (depth + distance) * back, middle + depth * back)
}
