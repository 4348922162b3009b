//! Twin of `glsl/surface.frag`: what the host is told of the first surface.

use crate::Camera;
use glam::{DVec3, DVec4};

/// What the camera's own depth buffer holds of a linear depth in world units.
pub fn host_depth(camera: &Camera, depth: f64) -> f64 {
    let clip = camera.projection.as_dmat4() * DVec4::new(0.0, 0.0, -depth, 1.0);
    (clip.z / clip.w).clamp(0.0, 1.0)
}

/// A unit vector as formats without signs hold it, between 0 and 1.
pub fn halved(normal: DVec3) -> DVec3 {
    0.5 * normal + 0.5
}
