//! CPU twins: the same passes as plain functions on slices, written from the formulas, with no Vulkan in them.
//! Tests feed them the GPU's own inputs and compare.

pub mod normal;
pub mod optics;
pub mod tiles;
