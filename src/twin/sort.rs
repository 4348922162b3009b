//! Twin of `glsl/sort.comp`: entries by cell, those of a cell in the order of the input.

use super::extent::cell_of;
use glam::Vec3;

/// Indices of finite positions, sorted by whole cell: x, then y, then z.
pub fn sort(positions: &[Vec3], edge: f32) -> Vec<u32> {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_by_key(|i| positions[*i as usize].to_array().map(|x| cell_of(x, edge)));
    order
}

/// Entries 27 i + k of the relation table (Im16 §III): particle i in the k-th of the cells around its own, sorted.
pub fn relation(positions: &[Vec3], edge: f32) -> Vec<u32> {
    let cell = |e: u32| {
        let own = positions[e as usize / 27].to_array().map(|x| cell_of(x, edge));
        let k = (e % 27) as i32;
        [own[0] + k / 9 - 1, own[1] + k / 3 % 3 - 1, own[2] + k % 3 - 1]
    };
    let mut entries: Vec<u32> = (0..27 * positions.len() as u32).collect();
    entries.sort_by_key(|e| cell(*e));
    entries
}
