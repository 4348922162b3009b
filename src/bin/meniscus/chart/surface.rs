//! The renderer's own front surface at the centres of the picture's pixels.

use glam::{Mat3, Vec3};
use meniscus::{
    Camera,
    host::{HostError, Session},
    inspect::Spec,
    shader::SIDE_FRONT,
    study::measures::surface::Front,
    twin::normal::decode_normal,
};

/// Of the last frame, which was rendered at `times` a picture's `size`. Nothing where no sample of it lies at pixels' centres: at
/// an even multiple of the size, or of methods whose surfaces have half of it.
pub fn fronts(
    session: &mut Session,
    camera: &Camera,
    radius: f32,
    size: [u32; 2],
    times: u32,
) -> Result<Option<Vec<Option<Front>>>, HostError> {
    if times.is_multiple_of(2) {
        return Ok(None);
    }
    let names = session.renderer.surfaces();
    let to_world = Mat3::from_mat4(camera.view).transpose();
    let [width, height] = size.map(|n| n as usize);
    let mut fronts: Vec<Option<Front>> = vec![None; width * height];
    for (depth, normal) in [(names.splash_depth, names.splash_normal), (names.body_depth, names.body_normal)] {
        let Some(depth) = depth else { continue };
        let full = size.map(|n| n * times);
        if !matches!(session.renderer.spec(depth), Some(Spec::Image(spec)) if spec.size == full) {
            return Ok(None);
        }
        let depths = session.words(depth, SIDE_FRONT)?.unwrap_or_default();
        let normals = normal.map_or(Ok(None), |name| session.words(name, SIDE_FRONT))?;
        let times = times as usize;
        for (i, front) in fronts.iter_mut().enumerate() {
            let at = (i / width * times + times / 2) * width * times + i % width * times + times / 2;
            // Where the near plane lies inside the liquid a depth is negative, and has no surface to face anywhere.
            let Some(d) = depths.get(at).map(|w| f32::from_bits(*w)).filter(|d| *d != 0.0) else { continue };
            let facing = normals.as_ref().filter(|_| d > 0.0).and_then(|n| n.get(at));
            let found = Front {
                depth: radius * d.abs(),
                normal: facing.map(|code| (to_world * decode_normal(*code)).normalize_or(Vec3::Y)),
            };
            if front.is_none_or(|nearer| found.depth < nearer.depth) {
                *front = Some(found);
            }
        }
    }
    Ok(Some(fronts))
}
