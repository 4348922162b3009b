//! Which surfaces are kept of the particles: maps of linear depth and normals, nearest fronts and farthest backs.

mod splat;
pub mod split;

use crate::{
    frame::Scene,
    method::Offers,
    parameters::family,
    passes::Drawn,
    plan::{Plan, Target},
};

family! {
    /// Which surfaces are kept of the particles.
    pub enum Layers: Layering {
        Split(split) = "split",
    }
}

/// A member of the family.
pub(crate) trait Layering {
    /// What its maps can be asked for.
    fn offers(&self) -> Offers;
    /// Draws them.
    fn record(&self, plan: &mut Plan, scene: &Scene, drawn: &Drawn) -> Surfaces;
}

/// The liquid's surfaces; classes without particles have none.
#[derive(Clone, Copy, Default)]
pub(crate) struct Surfaces {
    /// Particles on their own.
    pub splash: Option<Surface>,
    /// Those that form a body, which is what is smoothed.
    pub body: Option<Surface>,
}

/// Maps of one class. Layer 0 is the nearest front, layer 1, if there is one, the farthest back.
#[derive(Clone, Copy)]
pub(crate) struct Surface {
    /// Linear depth in particle radii; 0: no surface; negative: the near plane lies inside a particle.
    pub depth: Target,
    /// Outward unit normals in eye space (`glsl/include/normal.glsl`).
    pub normal: Target,
    /// Layers: 1 or 2.
    pub sides: u32,
}
