//! Twin of `glsl/include/upsample.glsl`: the front surface at a pixel of the picture, from maps of half its resolution.

use super::normal::decode_normal;
use crate::shader::{Frame, JUMP, STEEP};
use glam::{DVec2, DVec3};

/// The front surface at a position of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Upsampled {
    /// Linear depth; 0: no surface, negative: the eye is inside.
    pub depth: f64,
    /// Outward unit normal in eye space.
    pub normal: DVec3,
    /// Share of the four pixels around that have a surface, by their bilinear weights.
    pub coverage: f64,
    /// Of the same pixels as the depth; 0 without a velocity map.
    pub speed: f64,
}

/// `half` is the block of the maps' own view, `depth` and `normal` are its maps, row by row; `position` is one of the picture's,
/// twice as large. `speed` is the velocity map, or empty.
pub fn upsample(half: &Frame, depth: &[f32], normal: &[u32], speed: &[f32], position: DVec2) -> Upsampled {
    let (width, height) = (half.size.x as i32, half.size.y as i32);
    let q = 0.5 * position - 0.5;
    let (column, row) = (q.x.floor(), q.y.floor());
    let mut found = Vec::new();
    for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let (x, y) = (((column + dx) as i32).clamp(0, width - 1), ((row + dy) as i32).clamp(0, height - 1));
        let at = (y * width + x) as usize;
        let weight = (1.0 - (q.x - column - dx).abs()) * (1.0 - (q.y - row - dy).abs());
        if depth[at] != 0.0 {
            let speed = speed.get(at).map_or(0.0, |s| f64::from(*s));
            found.push((weight, f64::from(depth[at]), decode_normal(normal[at]).as_dvec3(), speed));
        }
    }
    let coverage = found.iter().map(|f| f.0).sum();
    // The first of equals.
    let Some(own) = found.iter().copied().reduce(|a, b| if b.0 > a.0 { b } else { a }) else {
        return Upsampled { depth: 0.0, normal: DVec3::ZERO, coverage: 0.0, speed: 0.0 };
    };
    if own.1 < 0.0 {
        return Upsampled { depth: own.1, normal: own.2, coverage, speed: 0.0 };
    }
    let pixel = own.1 / f64::from(half.pixel_scale.abs().max_element());
    let jump = f64::from(JUMP).max(f64::from(STEEP) * pixel);
    found.retain(|f| f.1 > 0.0 && (f.1 - own.1).abs() <= jump);
    let total: f64 = found.iter().map(|f| f.0).sum();
    let depth = found.iter().map(|f| f.0 * f.1).sum::<f64>() / total;
    let speed = found.iter().map(|f| f.0 * f.3).sum::<f64>() / total;
    let sum: DVec3 = found.iter().map(|f| f.0 * f.2).sum();
    Upsampled { depth, normal: sum.try_normalize().unwrap_or(own.2), coverage, speed }
}
