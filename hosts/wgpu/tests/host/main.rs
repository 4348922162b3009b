//! The example engine on wgpu draws what the one on Vulkan draws, on every driver, and validation has nothing to say.

extern crate meniscus as renderer;

// As the engine in C is tested.
#[path = "../../../../capi/tests/capi/drivers.rs"]
mod drivers;
mod engine;
mod misuse;
