//! Twin of `glsl/layers/extremes.frag` and `extremes.comp`: the nearest front and the farthest back of all particles.

use crate::{
    shader::{Frame, Particle, SIDE_BACK, SIDE_FRONT},
    twin::splat::{Surface, splat},
};

/// Both sides. Where the near plane lies inside a particle the front is minus its distance: nothing is nearer. Peeling keeps
/// no normals; those here are of the particles.
pub fn nearest_farthest(frame: &Frame, particles: &[Particle]) -> [Vec<Surface>; 2] {
    [SIDE_FRONT, SIDE_BACK].map(|side| splat(frame, particles, &vec![3; particles.len()], side))
}
