//! Twin of `glsl/occlude.comp`: how deep the body certainly reaches at each pixel.
//!
//! The plane of depth dc through an ellipsoid's centre cuts it in { p : pᵀ Q p ≤ 1 }, Q the lateral block of S⁻¹.
//! A ray through that cut meets the front at or before dc and the back at or beyond; the twin, as the shader, bounds
//! the pixels of the largest square inside the cut.

use super::quadric::{Quadric, scale_offset, viewport};
use crate::shader::{Frame, Particle};
use glam::{DVec2, DVec3};

/// Front and back bounds, pixel by pixel; infinity and 0 where nothing is certain.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// The front map is at most this deep.
    pub front: Vec<f64>,
    /// The back map is at least this deep.
    pub back: Vec<f64>,
}

/// The bounds from the body's particles, with squares `pad` pixels smaller on each side than they could be (the
/// shader: [`super::quadric::PAD`]).
pub fn occlude(frame: &Frame, body: &[Particle], pad: f64) -> Bounds {
    let (width, height, near) = viewport(frame);
    let pixels = (width * height) as usize;
    let mut bounds = Bounds { front: vec![f64::INFINITY; pixels], back: vec![0.0; pixels] };
    let (scale, offset) = scale_offset(frame);
    for particle in body {
        let q = Quadric::new(frame, particle);
        let depth = -q.center.z;
        if q.reach()[0] <= near {
            continue;
        }
        // Half the square's edge: pᵀ Q p at the corner of a square of half edge 1, the worse of its two diagonals.
        let inverse = q.to_unit.transpose() * q.to_unit;
        let corner = |sign: f64| {
            let p = DVec3::new(depth / scale.x.abs(), sign * depth / scale.y.abs(), 0.0);
            p.dot(inverse * p)
        };
        let half = corner(1.0).max(corner(-1.0)).sqrt().recip() - pad;
        let center = scale * (q.center.truncate() / depth) + offset;
        let size = DVec2::new(f64::from(width), f64::from(height));
        let lo = (center - half - 0.5).ceil().max(DVec2::ZERO);
        let hi = (center + half - 0.5).floor().min(size - 1.0);
        for y in lo.y as i64..=hi.y as i64 {
            for x in lo.x as i64..=hi.x as i64 {
                let pixel = (y * i64::from(width) + x) as usize;
                bounds.front[pixel] = bounds.front[pixel].min(depth);
                bounds.back[pixel] = bounds.back[pixel].max(depth);
            }
        }
    }
    bounds
}
