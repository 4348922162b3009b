//! Twin of `glsl/extent.comp`: the box of all positions and the cells it occupies.

use glam::Vec3;

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

/// Beyond this many cells from the origin all is one cell.
const FURTHEST_CELL: f64 = (1u32 << 29) as f64;

/// floor(x / edge) of a finite coordinate.
pub fn cell_of(x: f32, edge: f32) -> i32 {
    // The quotient of two float32 lies further from a whole number than float64 rounds, or is one.
    (f64::from(x) / f64::from(edge)).floor().clamp(-FURTHEST_CELL, FURTHEST_CELL) as i32
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
