//! Twin of `glsl/optics/walls.comp`: what rays meet at each pixel and in each tile of the view.

use crate::shader::{FARTHEST, Frame, WALL_TILE};

/// Depths of front and back of one class, row by row; both empty where the frame has none.
pub type Depths<'a> = [&'a [f32]; 2];

/// Nothing: no depth is in it.
const EMPTY: [f32; 2] = [FARTHEST, -FARTHEST];

/// From the nearer to the farther of a front and a back at a pixel; a front around the near plane begins there, and any if the eye
/// is inside.
fn interval(near: f32, eye_inside: bool, depths: Depths, index: usize) -> [f32; 2] {
    let [Some(front), Some(back)] = depths.map(|d| d.get(index).copied()) else { return EMPTY };
    let front = if front < 0.0 || (eye_inside && front > 0.0) { near } else { front };
    if front > 0.0 && back > 0.0 { [front.min(back), front.max(back)] } else { EMPTY }
}

/// The intervals of the body and of the splash in front at each pixel, row by row.
pub fn pixels(frame: &Frame, body: Depths, splash: Depths) -> Vec<[f32; 4]> {
    let (near, inside, size) = (frame.near, frame.eye_inside != 0.0, frame.size.as_uvec2());
    let texel = |index: usize| {
        let ([b, e], [s, l]) = (interval(near, inside, body, index), interval(near, false, splash, index));
        [b, e, s, l]
    };
    (0..(size.x * size.y) as usize).map(texel).collect()
}

/// The same of each tile of `WALL_TILE` x `WALL_TILE` pixels: the largest front and the smallest back of the body, the smallest
/// front and the largest back of all.
pub fn tiles(size: [u32; 2], pixels: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let across = size[0].div_ceil(WALL_TILE);
    let mut tiles = vec![[0.0, FARTHEST, FARTHEST, 0.0]; (across * size[1].div_ceil(WALL_TILE)) as usize];
    for (index, [front, back, splash, splash_back]) in pixels.iter().enumerate() {
        let (x, y) = (index as u32 % size[0], index as u32 / size[0]);
        let [deepest, shallowest, first, last] = &mut tiles[(y / WALL_TILE * across + x / WALL_TILE) as usize];
        *deepest = deepest.max(*front);
        *shallowest = shallowest.min(back.max(0.0));
        *first = first.min(front.min(*splash));
        *last = last.max(back.max(*splash_back));
    }
    tiles
}
