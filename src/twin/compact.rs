//! Twin of `glsl/compact.comp`: the lists of particles to draw.

use crate::shader::{VISIBLE_BACK, VISIBLE_BODY, VISIBLE_FRONT};

/// Indices of the particles of a class (0 splash, 1 body) that show on a side (0 front, 1 back), ascending: list
/// `2 * class + side`. `visible` is a word a particle, as the cull pass leaves it.
pub fn compact(visible: &[u32]) -> [Vec<u32>; 4] {
    let list = |body: bool, side: u32| {
        let drawn = |v: &u32| (v & VISIBLE_BODY != 0) == body && v & side != 0;
        (0..).zip(visible).filter(|(_, v)| drawn(v)).map(|(i, _)| i).collect()
    };
    [list(false, VISIBLE_FRONT), list(false, VISIBLE_BACK), list(true, VISIBLE_FRONT), list(true, VISIBLE_BACK)]
}
