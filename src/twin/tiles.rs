//! Twin of what `glsl/cull.comp` says of tiles of the view: where drawn particles may show.

use super::quadric::{PAD, Quadric, pixels_in};
use crate::shader::{Frame, MOST_TILES, Particle, VIEW_TILE};

/// The tiles, row by row, in which particles of one class with a verdict may show, within a pixel more each way; and whether one
/// of them has too many tiles to be told apart from the whole view.
pub fn tiles(frame: &Frame, particles: &[Particle], verdicts: &[u32]) -> (Vec<bool>, bool) {
    let size = frame.size.as_uvec2();
    let across = size.x.div_ceil(VIEW_TILE);
    let mut marked = vec![false; (across * size.y.div_ceil(VIEW_TILE)) as usize];
    let mut anywhere = false;
    for (particle, _) in particles.iter().zip(verdicts).filter(|(_, verdict)| **verdict != 0) {
        let Some([x, y]) = Quadric::new(frame, particle).rectangle(frame, PAD).and_then(pixels_in) else { continue };
        let range =
            |[low, high]: [u32; 2], size: u32| low.saturating_sub(1) / VIEW_TILE..=(high + 1).min(size - 1) / VIEW_TILE;
        let (columns, rows) = (range(x, size.x), range(y, size.y));
        if columns.clone().count() * rows.clone().count() > MOST_TILES as usize {
            anywhere = true;
            continue;
        }
        for row in rows {
            columns.clone().for_each(|column| marked[(row * across + column) as usize] = true);
        }
    }
    (marked, anywhere)
}
