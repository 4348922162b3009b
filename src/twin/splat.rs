//! Twin of `glsl/layers/splat.vert` and `glsl/layers/splat.frag`: nearest front or farthest back of a class of particles, one ray
//! cast for each particle and pixel (Imai16 §4.2, Sigg06).

use super::quadric::{Quadric, pixel_ray, pixels_in, scale_offset, viewport};
use crate::shader::{Frame, Particle, SIDE_FRONT};
use glam::{DVec2, DVec3};

/// What one pixel of a layer shows, and how certain that is.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Linear depth; 0 where there is nothing, minus the near plane's distance where that lies inside a particle.
    pub depth: f64,
    /// Outward unit normal in eye space.
    pub normal: DVec3,
    /// Depth at which the ray leaves the same particle.
    pub far: f64,
    /// Outward unit normal there.
    pub far_normal: DVec3,
    /// Index of the particle it belongs to.
    pub particle: usize,
    /// How far the next surface of the same layer lies behind (in front of, for backs) this one.
    pub margin: f64,
    /// Distance in pixels, at least, from this pixel's centre to the nearest silhouette of any particle.
    pub silhouette: f64,
}

/// The layer of one side. `visible` are the cull pass's verdicts: a particle with bit `1 << side` is drawn.
pub fn splat(frame: &Frame, particles: &[Particle], visible: &[u32], side: u32) -> Vec<Surface> {
    let (width, height, near) = viewport(frame);
    let nothing = Surface {
        depth: 0.0,
        normal: DVec3::ZERO,
        far: 0.0,
        far_normal: DVec3::ZERO,
        particle: usize::MAX,
        margin: f64::INFINITY,
        silhouette: f64::INFINITY,
    };
    let mut layer = vec![nothing; (width * height) as usize];
    for (index, particle) in particles.iter().enumerate().filter(|(i, _)| visible[*i] & (1 << side) != 0) {
        let q = Quadric::new(frame, particle);
        let Some([columns, rows]) = candidates(frame, &q) else { continue };
        // The ellipsoid's thinnest semi-axis is at least this long; seen at its farthest depth it covers so much.
        let thin = (0..3).map(|i| q.to_unit.col(i).length_squared()).sum::<f64>().sqrt().recip();
        let thin_pixels = thin * scale_offset(frame).0.abs().min_element() / q.reach()[1];
        for y in rows[0]..=rows[1] {
            for x in columns[0]..=columns[1] {
                let v = pixel_ray(frame, x, y);
                let cast = q.cast(v);
                let at = &mut layer[(y * width + x) as usize];
                at.silhouette = at.silhouette.min((cast.approach - 1.0).abs() * thin_pixels);
                let [enter, leave] = cast.depths;
                // Misses are not numbers.
                if leave.is_nan() || leave < near {
                    continue;
                }
                let depth = if side == SIDE_FRONT { enter } else { leave };
                // Nothing is in front of a near plane that lies inside a particle.
                let seen = depth.max(near);
                let gain = match (at.depth == 0.0, side == SIDE_FRONT) {
                    (true, _) => f64::INFINITY,
                    (false, true) => at.depth.abs() - seen,
                    (false, false) => seen - at.depth,
                };
                if gain > 0.0 {
                    let (normal, far_normal, silhouette) = (q.normal(v * depth), q.normal(v * leave), at.silhouette);
                    let depth = if depth < near { -near } else { depth };
                    *at = Surface { depth, normal, far: leave, far_normal, particle: index, margin: gain, silhouette };
                } else {
                    at.margin = at.margin.min(-gain);
                }
            }
        }
    }
    layer
}

/// Pixels to try: a pixel more than the tangent planes say, for silhouettes just missed; all of them for a particle
/// that crosses the near plane, where no such planes exist.
pub(crate) fn candidates(frame: &Frame, q: &Quadric) -> Option<[[u32; 2]; 2]> {
    let (width, height, near) = viewport(frame);
    let [nearest, farthest] = q.reach();
    if farthest < near {
        return None;
    }
    if nearest <= near {
        return pixels_in([DVec2::ZERO, DVec2::new(f64::from(width), f64::from(height))]);
    }
    pixels_in(q.rectangle(frame, 1.0)?)
}
