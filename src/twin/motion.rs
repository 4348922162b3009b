//! Twin of `glsl/motion.frag` and of what `glsl/surface.frag` makes of it: how the first surface moves.

use crate::{Motion, shader::MOTION_REACH};
use glam::{DVec2, DVec3, DVec4, Mat4};

/// How the particle nearest to a point has moved, of centres and motions; and how much farther the next one is. All in one space, in
/// particle radii. Nothing where none is near.
pub fn nearest(particles: &[(DVec3, DVec3)], x: DVec3) -> (DVec3, f64) {
    let reach = f64::from(MOTION_REACH);
    let (mut best, mut motion, mut next) = (reach, DVec3::ZERO, f64::INFINITY);
    for (center, moved) in particles {
        let distance = center.distance(x);
        if distance < best {
            (next, best, motion) = (best, distance, *moved);
        } else {
            next = next.min(distance);
        }
    }
    (motion, next - best)
}

/// The motion vector of a point in the world that has come so far: where it was less where it is, in parts of the picture.
pub fn vector(motion: &Motion, view: Mat4, x: DVec3, moved: DVec3) -> DVec2 {
    let place = |projection: Mat4, view: Mat4, x: DVec3| {
        let clip: DVec4 = projection.as_dmat4() * view.as_dmat4() * x.extend(1.0);
        (clip.w > 0.0).then(|| 0.5 * DVec2::new(clip.x, clip.y) / clip.w)
    };
    let now = place(motion.projection, view, x);
    let then = place(motion.previous_projection, motion.previous_view, x - moved);
    then.zip(now).map_or(DVec2::ZERO, |(then, now)| then - now)
}
