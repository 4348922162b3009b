//! CPU twins: the same passes as plain functions on slices, written from the formulas, with no Vulkan in them.
//! Tests feed them the GPU's own inputs and compare.

pub mod background;
pub mod compact;
pub mod cull;
pub mod extent;
pub mod eye;
pub mod field_walk;
pub mod first_surface;
pub mod motion;
pub mod normal;
pub mod occlude;
pub mod optics;
pub mod quadric;
pub mod shape;
pub mod sort;
pub mod splat;
pub mod surface;
pub mod texels;
pub mod tiles;
pub mod upsample;
pub mod walk;
pub mod walls;
mod watch;
