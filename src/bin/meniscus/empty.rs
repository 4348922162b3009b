//! A picture without liquid, of a scene that has some: what may have gone wrong.

use crate::dump::RAY_CAST;
use glam::Vec3;
use meniscus::{
    Camera, Particles, Settings,
    host::{HostError, Session},
    shader::{SIDE_BACK, SIDE_FRONT},
};

/// Says why no pixel of the last frame shows liquid, if none does and there are particles.
pub fn explain(
    session: &mut Session,
    particles: &Particles,
    camera: &Camera,
    settings: &Settings,
    size: [u32; 2],
) -> Result<Option<String>, HostError> {
    if particles.ellipsoids.is_empty() {
        return Ok(None);
    }
    let no_liquid =
        |why: String| format!("no liquid in the picture, of {} particles: {why}", particles.ellipsoids.len());
    // What rays meet of a field no map says, but in which tiles of the view there is none.
    if let Some(tiles) = session.words("field tiles", 0)? {
        let empty = tiles.chunks_exact(2).all(|bounds| f32::from_bits(bounds[0]).is_infinite());
        let missed = empty || between_pixels(particles, camera, size);
        return Ok(missed.then(|| no_liquid(cause(particles, camera, size))));
    }
    let surfaces = session.renderer.surfaces();
    let mut covers = |name: Option<&'static str>| {
        let mut pixels = 0;
        for (name, side) in name.into_iter().flat_map(|name| [(name, SIDE_FRONT), (name, SIDE_BACK)]) {
            let depths = session.words(name, side)?.unwrap_or_default();
            pixels = pixels.max(depths.iter().filter(|w| f32::from_bits(**w) > 0.0).count());
        }
        Ok::<_, HostError>(pixels)
    };
    if covers(surfaces.body_depth)? + covers(surfaces.splash_depth)? > 0 {
        return Ok(None);
    }
    let why = match covers(Some(RAY_CAST[0]))? {
        0 => cause(particles, camera, size),
        pixels => format!(
            "they cover {pixels} pixels, of which the filter {} (--smooth) leaves none. Change its parameters, or use another \
             filter, such as --smooth none",
            settings.method.smooth.name()
        ),
    };
    Ok(Some(no_liquid(why)))
}

/// Whether all of the liquid lies in front of the eye and between the pixels' centres.
fn between_pixels(particles: &Particles, camera: &Camera, size: [u32; 2]) -> bool {
    let (low, high) = particles.bounds().unwrap_or_default();
    let (mut first, mut last) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
    for i in 0..8 {
        let corner = Vec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), high, low);
        let clip = camera.projection * camera.view.transform_point3(corner).extend(1.0);
        if clip.w <= 0.0 {
            return false;
        }
        for axis in 0..2 {
            let pixel = (0.5 * clip[axis] / clip.w + 0.5) * size[axis] as f32 - 0.5;
            (first[axis], last[axis]) = (first[axis].min(pixel), last[axis].max(pixel));
        }
    }
    (0..2).any(|axis| first[axis].ceil() > last[axis])
}

/// What the camera and the box around the liquid tell.
fn cause(particles: &Particles, camera: &Camera, size: [u32; 2]) -> String {
    let (low, high) = particles.bounds().unwrap_or_default();
    let corner = |i: u32| Vec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), high, low);
    let corners: Vec<Vec3> = (0..8).map(|i| camera.view.transform_point3(corner(i))).collect();
    if corners.iter().all(|c| -c.z <= camera.near) {
        return "it is behind the eye, or nearer than a particle is large. Turn round with --target, or leave out --eye and \
                --target to see all of it"
            .into();
    }
    // Clip space: inside is -w <= x, y <= w.
    let clip: Vec<_> = corners.iter().map(|c| camera.projection * c.extend(1.0)).collect();
    let beside =
        [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y].iter().any(|side| clip.iter().all(|p| p.truncate().dot(*side) > p.w));
    if beside {
        return "it is outside the view. Look at it with --target, or leave out --eye and --target to see all of it"
            .into();
    }
    let depth = -camera.view.transform_point3(0.5 * (low + high)).z;
    let pixels = 0.5 * (camera.projection.y_axis.y * size[1] as f32).abs() * 2.0 * particles.radius / depth;
    if depth > 0.0 && pixels < 1.0 {
        return format!(
            "a particle is {pixels:.1e} of a pixel wide. Go nearer with --eye, or use a larger --size or --radius"
        );
    }
    "nothing of it met a pixel. Check --radius, or leave out --eye and --target to see all of it".into()
}

#[cfg(test)]
mod tests {
    use super::cause;
    use glam::{Mat3, Vec3};
    use meniscus::{Camera, Ellipsoid, Particles};

    #[test]
    fn causes_are_told_apart() {
        let radius = 0.1;
        let axes = Mat3::from_diagonal(Vec3::splat(radius));
        let particles = Particles { radius, ellipsoids: vec![Ellipsoid { center: Vec3::ZERO, axes }], splash_count: 0 };
        let said = |eye: Vec3, target: Vec3| {
            let camera = Camera::look_at(eye, target, Vec3::Y, 1.0, 1.0, 0.01);
            cause(&particles, &camera, [100, 100])
        };
        let eye = Vec3::new(0.0, 0.0, 5.0);
        assert!(said(eye, 2.0 * eye).contains("behind the eye"));
        assert!(said(eye, eye + Vec3::new(1.0, 0.0, -0.2)).contains("outside the view"));
        assert!(said(eye, eye + Vec3::new(0.0, -1.0, -0.2)).contains("outside the view"));
        assert!(said(1000.0 * eye, Vec3::ZERO).contains("of a pixel"));
        assert!(said(eye, Vec3::ZERO).contains("--radius"));
    }
}
