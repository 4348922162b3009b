//! Twin of `glsl/cull.comp`: which particles can show, and how many of each class.

use super::quadric::{PAD, Quadric, pixels_in, viewport};
use crate::shader::{Frame, Particle, VISIBLE_BACK, VISIBLE_FRONT};

/// What the cull pass found for one class.
#[derive(Clone, Debug, PartialEq)]
pub struct Culled {
    /// A word a particle: `VISIBLE_FRONT`, `VISIBLE_BACK`.
    pub verdicts: Vec<u32>,
    /// Particles with each of these bits.
    pub counts: [u32; 2],
    /// The largest point, in pixels, that draws any of them; 0 if none shows.
    pub largest_point: f64,
}

/// Rectangles with an edge of more pixels than this are not walked: such a particle shows.
const WALKED: u32 = 64;

/// Tests one class against the occlusion bounds, front then back in one slice (floats' bits, as in the GPU's buffer);
/// `None` where nothing is bounded. `sides` is 1 if only fronts are drawn.
pub fn cull(frame: &Frame, particles: &[Particle], bounds: Option<&[u32]>, sides: u32) -> Culled {
    let (width, height, near) = viewport(frame);
    let pixels = (width * height) as usize;
    let wanted = if sides == 2 { VISIBLE_FRONT | VISIBLE_BACK } else { VISIBLE_FRONT };
    let mut culled = Culled { verdicts: Vec::with_capacity(particles.len()), counts: [0, 0], largest_point: 0.0 };
    for particle in particles {
        let q = Quadric::new(frame, particle);
        let rectangle = q.rectangle(frame, PAD);
        let mut verdict = 0;
        if let Some([columns, rows]) = rectangle.and_then(pixels_in) {
            let small = columns[1] - columns[0] < WALKED && rows[1] - rows[0] < WALKED;
            let [nearest, farthest] = q.reach();
            match bounds {
                Some(bounds) if small && nearest > near => {
                    let bound = |i: usize| f64::from(f32::from_bits(bounds[i]));
                    for y in rows[0]..=rows[1] {
                        for x in columns[0]..=columns[1] {
                            let pixel = (y * width + x) as usize;
                            if nearest <= bound(pixel) {
                                verdict |= VISIBLE_FRONT;
                            }
                            if farthest >= bound(pixels + pixel) {
                                verdict |= VISIBLE_BACK;
                            }
                        }
                    }
                    verdict &= wanted;
                }
                _ => verdict = wanted,
            }
        }
        if let (true, Some([lo, hi])) = (verdict != 0, rectangle) {
            culled.largest_point = culled.largest_point.max((hi - lo).max_element() + 1.0);
        }
        culled.counts[0] += u32::from(verdict & VISIBLE_FRONT != 0);
        culled.counts[1] += u32::from(verdict & VISIBLE_BACK != 0);
        culled.verdicts.push(verdict);
    }
    culled
}
