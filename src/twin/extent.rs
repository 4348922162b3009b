//! Twin of `glsl/extent.comp`: the box of all positions and the cells it occupies.

use crate::{
    shader::{FURTHEST_CELL, SPLASH_RADIUS},
    space::power_of_two,
};
use glam::{DVec3, Vec3};

/// What the extent pass finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Smallest and largest coordinates of the finite positions; zero without any.
    pub bounds: (Vec3, Vec3),
    /// First and last occupied cell along each axis.
    pub cells: ([i32; 3], [i32; 3]),
    /// Bits of each axis that a sort key needs.
    pub bits: [u32; 3],
    /// Positions that are not finite.
    pub lost: u32,
}

/// The box and the origin as the pass keeps them: coordinates times the power of two that brings the radius into 1..2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    /// Smallest coordinates, as integers in the order of the floats; all bits set without any finite position.
    pub least: [u32; 3],
    /// Largest coordinates; 0 without any.
    pub most: [u32; 3],
    /// Where the liquid's own space has its origin: the middle one of the particles, or the middle of the box where that
    /// one is not finite.
    pub origin: [f32; 3],
}

/// An integer for each float, in the floats' own order.
pub fn ordered(x: f32) -> u32 {
    let bits = x.to_bits();
    if x.is_sign_negative() { !bits } else { bits | 1 << 31 }
}

/// What the pass keeps of positions of particles with this radius.
pub fn kept(positions: &[Vec3], radius: f32) -> Kept {
    let scale = power_of_two(radius);
    let scaled = || positions.iter().map(|p| *p * scale);
    let mut kept = Kept { least: [u32::MAX; 3], most: [0; 3], origin: [0.0; 3] };
    for p in scaled().filter(|p| p.is_finite()) {
        for (axis, x) in p.to_array().into_iter().enumerate() {
            kept.least[axis] = kept.least[axis].min(ordered(x));
            kept.most[axis] = kept.most[axis].max(ordered(x));
        }
    }
    let (low, high) = extent(positions, radius, 0).bounds;
    let middle = scaled().nth(positions.len() / 2).filter(|p| p.is_finite());
    kept.origin = middle.unwrap_or(0.5 * (low * scale) + 0.5 * (high * scale)).to_array();
    kept
}

/// The box around everything that may be drawn of finite positions, in the liquid's own space: `longest` is the longest
/// semi-axis there may be, in radii.
pub fn drawn(positions: &[Vec3], radius: f32, longest: f32) -> (DVec3, DVec3) {
    let (low, high) = extent(positions, radius, 0).bounds;
    let origin = Vec3::from(kept(positions, radius).origin).as_dvec3() / f64::from(power_of_two(radius));
    let room = f64::from(longest.max(SPLASH_RADIUS));
    let own = |x: Vec3| (x.as_dvec3() - origin) / f64::from(radius);
    (own(low) - room, own(high) + room)
}

/// floor(x / edge) of a finite coordinate.
pub fn cell_of(x: f32, edge: f32) -> i32 {
    // The quotient of two float32 lies further from a whole number than float64 rounds, or is one.
    let furthest = f64::from(FURTHEST_CELL);
    (f64::from(x) / f64::from(edge)).floor().clamp(-furthest, furthest) as i32
}

/// The box; `more` cells on each side are occupied too (relation table: 1).
pub fn extent(positions: &[Vec3], edge: f32, more: i32) -> Extent {
    let finite = || positions.iter().copied().filter(|p| p.is_finite());
    let bounds = finite().map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default();
    let first = bounds.0.to_array().map(|x| cell_of(x, edge) - more);
    let last = bounds.1.to_array().map(|x| cell_of(x, edge) + more);
    let bits = [0, 1, 2].map(|a| 32 - ((last[a] - first[a]) as u32).leading_zeros());
    let lost = (positions.len() - finite().count()) as u32;
    Extent { bounds, cells: (first, last.map(|c| c - more)), bits, lost }
}
