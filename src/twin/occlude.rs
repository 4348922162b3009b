//! Twin of `glsl/occlude.comp`: how deep the body certainly reaches at each pixel.
//!
//! Every particle is cast at every pixel of its rectangle; the front map is at most the nearest entry, the back map at
//! least the farthest exit.

use super::quadric::{PAD, Quadric, pixel_ray, pixels_in, viewport};
use crate::shader::{Frame, LARGE, Particle};

/// Front and back bounds, pixel by pixel; infinity and 0 where nothing is certain.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// The front map is at most this deep.
    pub front: Vec<f64>,
    /// The back map is at least this deep.
    pub back: Vec<f64>,
}

impl Bounds {
    /// What the GPU's buffer says (`glsl/include/bounds.glsl`).
    pub fn from_words(words: &[u32]) -> Bounds {
        let infinite = f32::INFINITY.to_bits();
        let depth = |bits: u32| f64::from(f32::from_bits(bits));
        let pairs = words.chunks_exact(2);
        Bounds {
            front: pairs.clone().map(|p| depth(p[0])).collect(),
            back: pairs.map(|p| depth(infinite - p[1])).collect(),
        }
    }
}

/// The bounds from the body's particles, where the rays that only graze one are left out: `slack` (the shader:
/// `SILHOUETTE`) is how much of the discriminant does not count.
pub fn occlude(frame: &Frame, body: &[Particle], slack: f64) -> Bounds {
    let (width, height, near) = viewport(frame);
    let pixels = (width * height) as usize;
    let mut bounds = Bounds { front: vec![f64::INFINITY; pixels], back: vec![0.0; pixels] };
    for particle in body {
        let q = Quadric::new(frame, particle);
        if q.reach()[0] <= near {
            continue;
        }
        let Some([columns, rows]) = q.rectangle(frame, PAD).and_then(pixels_in) else { continue };
        if columns[1] - columns[0] >= LARGE || rows[1] - rows[0] >= LARGE {
            continue;
        }
        for y in rows[0]..=rows[1] {
            for x in columns[0]..=columns[1] {
                let [nearer, farther] = q.cast_with_slack(pixel_ray(frame, x, y), -slack);
                // Misses are not numbers, and change nothing.
                let pixel = (y * width + x) as usize;
                bounds.front[pixel] = bounds.front[pixel].min(nearer);
                bounds.back[pixel] = bounds.back[pixel].max(farther);
            }
        }
    }
    bounds
}
