//! Particle liquids with complex refractions, recorded into *your* Vulkan command buffer.
//!
//! Positions of simulation particles go in; out comes water through which light bends up to four times, with
//! absorption, reflections and total internal reflection, in screen space (Imai, Kanamori, Mitani, "Real-Time
//! Screen-Space Liquid Rendering with Complex Refractions", 2016; "Imai16" throughout).
//!
//! # The contract
//!
//! * [`Renderer`] borrows the host's instance, device and allocator of device memory ([`Host`], [`allocator`]); it creates no device, submits
//!   nothing, waits for nothing and presents nothing. It needs Vulkan 1.3 with `dynamicRendering` and
//!   `synchronization2` enabled, and one queue family with graphics and compute; see [`device`].
//! * [`Renderer::record`] records one frame, `src/frame.rs` is that frame from top to bottom.
//! * Frames are submitted to one queue in the order they were recorded. Before the host records into a slot again
//!   (`slot < frames_in_flight`), the frame last recorded into it has completed. Replaced resources are kept until
//!   then, and destroyed without waiting.
//! * What a host waits for, by masks: buffers of positions are read at `COMPUTE_SHADER` / `SHADER_STORAGE_READ`; the host's scene and
//!   environment at `FRAGMENT_SHADER` / `SHADER_SAMPLED_READ`; outputs are read and written at `COLOR_ATTACHMENT_OUTPUT` /
//!   `COLOR_ATTACHMENT_READ | WRITE`, and one with depth ([`SurfaceOutputs::depth`]) at `EARLY_FRAGMENT_TESTS | LATE_FRAGMENT_TESTS` /
//!   `DEPTH_STENCIL_ATTACHMENT_READ | WRITE`: before the frame make them visible to that, after it wait for that.
//! * A frame that was recorded and never runs (its command buffer was reset, or is not submitted) is said to be so with
//!   [`Renderer::abandon`] before anything else is recorded. What [`Renderer::set_environment`] recorded has to run.
//! * Several views of one picture's size are as many calls of [`Renderer::record`], each with a slot of its own: make
//!   `frames_in_flight` the views times the frames. A view of another size wants a renderer of its own, because targets are
//!   made anew whenever the size changes.
//! * The output image is in `COLOR_ATTACHMENT_OPTIMAL` before and after, or in [`FrameInput::output_layout`]; it is written as a
//!   colour attachment, and may be larger than the view ([`FrameInput::origin`]).
//!   The host makes it available before (for reading too, where [`Background::Host`] keeps what it holds), and makes it
//!   visible afterwards.
//! * [`Background`] says what is seen without liquid. With [`Background::Environment`], the default, every pixel is
//!   written, alpha is 1, and where the scene's depth is cleared the environment replaces the host's colour. With
//!   [`Background::Host`] only pixels that show liquid are written, with alpha 1: the host's picture stays, its sky is
//!   refracted, and an output cleared to alpha 0 ends up with the liquid's coverage.
//! * A host's opaque scene ([`SceneInput`]) hides liquid, is refracted by it, and ends rays in it, with absorption up to
//!   there. It is the depth buffer's first surface: what that hides from the eye no ray can meet.
//! * The environment is a map given once ([`Renderer::set_environment`]) or an image view of the host's
//!   ([`EnvironmentInput`]), equirectangular or a cube.
//! * Later passes may be told of the first surface that each pixel shows ([`SurfaceOutputs`]): its depth, its normal, its motion, in
//!   images of the host's, over what they hold. What nobody asks for is not done.
//! * Left-handed worlds, viewports of negative height, reversed and infinite depth: see [`Camera`].
//! * Particles are prepared on the host ([`prepare::prepare`], [`Renderer::set_particles`]; for a density field, which is the
//!   default, also [`prepare::points`], [`Renderer::set_points`]) or, frame by frame, on the device
//!   from positions in a buffer of the host's ([`prepare::DevicePositions`]): then no count ever comes back, and what a
//!   scene does not need is an indirect draw or dispatch of nothing. Such a buffer, and those of ids
//!   ([`prepare::DeviceIds`]) and of the number of particles, where only the device knows it ([`prepare::DeviceCount`]), are
//!   the host's: its writes are visible to reads in compute shaders before the frame, which only reads them.
//! * Where the eye is inside the liquid's body, walks through maps of depths have to be told ([`EyeInside`]): by the host, as
//!   [`prepare::DensityField`] has it, or by the device, of positions there. A density field knows by itself.
//! * The same input gives the same bits on the same driver; prepared on the host, in whatever order the particles come.
//!
//! # Spaces and units
//!
//! World units are the scene's own; shaders measure in particle radii, so that any scale gives the same
//! picture. Eye space is right-handed and looks down -z; *linear depth* is `d = -z_eye > 0`. Colours are linear; a UNORM output is encoded as sRGB in the last shader, a float output is not.
#![warn(missing_docs)]
#![deny(unsafe_op_in_unsafe_fn)]
#![warn(clippy::undocumented_unsafe_blocks)]

mod access;
pub mod allocator;
pub mod auto;
#[cfg(feature = "inspect")]
pub mod compiler;
pub mod device;
pub mod environment;
pub mod error;
mod frame;
#[cfg(feature = "harness")]
pub mod harness;
#[cfg(feature = "host")]
pub mod host;
pub mod input;
#[cfg(feature = "inspect")]
pub mod inspect;
#[cfg(feature = "io")]
pub mod io;
pub mod layers;
pub mod method;
pub mod optics;
pub mod parameters;
pub mod particles;
mod passes;
mod pipeline;
mod plan;
pub mod prepare;
pub mod profile;
mod recorder;
pub mod renderer;
mod resources;
mod scale;
mod scene;
pub mod settings;
#[cfg(not(feature = "inspect"))]
mod shader;
#[cfg(feature = "inspect")]
pub mod shader;
mod slot;
pub mod smooth;
#[cfg(not(feature = "inspect"))]
mod space;
#[cfg(feature = "inspect")]
pub mod space;
#[cfg(any(feature = "io", feature = "inspect"))]
mod srgb;
#[cfg(feature = "inspect")]
pub mod statistics;
#[cfg(feature = "study")]
pub mod study;
mod table;
#[cfg(feature = "tracy")]
pub mod tracy;
#[cfg(feature = "inspect")]
pub mod twin;
pub mod work;

// Of the versions whose types stand in the public interface.
#[cfg(feature = "gpu-allocator")]
pub use gpu_allocator;
pub use {ash, glam};

pub use device::Host;
pub use environment::{Equirect, EquirectBuilder};
pub use error::Error;
pub use input::{
    Background, Before, DeviceVectors, EnvironmentInput, EnvironmentShape, EyeInside, FrameInput, Motion,
    MovingParticles, SceneInput, SurfaceOutput, SurfaceOutputs,
};
pub use method::{Method, PRESETS, Preset};
pub use optics::Fresnel;
pub use parameters::{Parameter, Parameters};
pub use particles::{Class, Ellipsoid, Particles, Point};
pub use recorder::PlanEntry;
pub use renderer::Renderer;
pub use settings::{AtOnce, Camera, Drawing, Liquid, Settings};
pub use space::RADII;
pub use table::LedgerEntry;
