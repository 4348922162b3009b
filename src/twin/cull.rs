//! Twin of `glsl/cull.comp`: which particles can show, and how many of each class.

use super::occlude::Bounds;
use super::quadric::{PAD, Quadric, pixel_ray, pixels_in, viewport};
use crate::shader::{DEPTH_ROUNDING, Frame, LARGE, Particle, SILHOUETTE, VISIBLE_BACK, VISIBLE_FRONT};

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

/// Tests one class against the occlusion bounds; `None` where nothing is bounded. `sides` is 1 if only fronts are drawn.
pub fn cull(frame: &Frame, particles: &[Particle], bounds: Option<&Bounds>, sides: u32) -> Culled {
    let (width, _, near) = viewport(frame);
    let wanted = if sides == 2 { VISIBLE_FRONT | VISIBLE_BACK } else { VISIBLE_FRONT };
    let mut culled = Culled { verdicts: Vec::with_capacity(particles.len()), counts: [0, 0], largest_point: 0.0 };
    let rounding = f64::from(DEPTH_ROUNDING);
    for (i, particle) in particles.iter().enumerate() {
        // On one spot one is enough.
        if i > 0 && particles[i - 1] == *particle {
            culled.verdicts.push(0);
            continue;
        }
        let q = Quadric::new(frame, particle);
        let rectangle = q.rectangle(frame, PAD);
        let mut verdict = 0;
        if let Some([columns, rows]) = rectangle.and_then(pixels_in) {
            let small = columns[1] - columns[0] < LARGE && rows[1] - rows[0] < LARGE;
            let [nearest, _] = q.reach();
            match bounds {
                Some(bounds) if small && nearest > near => {
                    for y in rows[0]..=rows[1] {
                        for x in columns[0]..=columns[1] {
                            let pixel = (y * width + x) as usize;
                            // Rays that only just miss count as hits; comparisons with what is no number fail.
                            let [enter, leave] = q.cast_with_slack(pixel_ray(frame, x, y), f64::from(SILHOUETTE));
                            if enter - rounding <= bounds.front[pixel] {
                                verdict |= VISIBLE_FRONT;
                            }
                            if leave + rounding >= bounds.back[pixel] {
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
