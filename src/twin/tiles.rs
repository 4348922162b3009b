//! Twin of `glsl/optics/tiles.comp`: the range of front depths in each tile of the view.

use crate::shader::WALL_TILE;

/// Smallest and largest depth above 0 of `fronts` (one map for each class that has particles, `size` pixels each) in
/// each tile of `WALL_TILE` x `WALL_TILE` pixels, row by row; (1e30, 0) for an empty tile.
pub fn tiles(size: [u32; 2], fronts: &[&[f32]]) -> Vec<(f32, f32)> {
    let across = size[0].div_ceil(WALL_TILE);
    let mut ranges = vec![(1e30f32, 0f32); (across * size[1].div_ceil(WALL_TILE)) as usize];
    for y in 0..size[1] {
        for x in 0..size[0] {
            let range = &mut ranges[(y / WALL_TILE * across + x / WALL_TILE) as usize];
            for front in fronts {
                let depth = front[(y * size[0] + x) as usize];
                if depth > 0.0 {
                    *range = (range.0.min(depth), range.1.max(depth));
                }
            }
        }
    }
    ranges
}
