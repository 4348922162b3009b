//! Twin of `glsl/shape.comp`: neighbours by trying every pair. Classes and ellipsoids are [`crate::prepare`]'s.

use glam::Vec3;

/// For each position the indices of all that are strictly nearer than `reach`, itself included, ascending; none of a
/// position that is not finite.
pub fn neighbours(positions: &[Vec3], reach: f32) -> Vec<Vec<u32>> {
    let limit = f64::from(reach) * f64::from(reach);
    let near = |a: Vec3, b: Vec3| a.as_dvec3().distance_squared(b.as_dvec3()) < limit;
    positions.iter().map(|a| (0..).zip(positions).filter(|(_, b)| near(*a, **b)).map(|(j, _)| j).collect()).collect()
}
