//! meniscus in frames of [wgpu](https://wgpu.rs): liquid recorded into command encoders of wgpu's own device, between passes of
//! wgpu's, on Vulkan. Nothing of wgpu is copied or wrapped: textures, queue and submissions stay the application's.
//!
//! ```text
//! let (device, queue) = meniscus_wgpu::open(&adapter, &descriptor)?;      // instead of Adapter::request_device
//! let mut liquid = Liquid::new(&adapter, &device, output.format(), 3)?;
//! liquid.renderer().set_points(&points)?;                                 // everything of meniscus::Renderer
//! let sky = liquid.set_environment(&Equirect::procedural_sky())?;
//! let [before, water] = liquid.record(&frame, |input| input)?;
//! queue.submit([sky, scene, before, water, overlay]);                     // scene and overlay: wgpu's, as ever
//! ```
//!
//! Positions that a compute pass of wgpu's left in a buffer, and images of one's own for the first surface, go in by `more`, with the handle
//! that wgpu has for them (`buffer.as_hal::<Vulkan>()`, then `raw_handle()`), and once wgpu knows that somebody else reads them: a
//! `transition_resources` of the buffer to `BufferUses::STORAGE_READ_ONLY`, submitted before.
//!
//! ```text
//! liquid.record(&frame, |input| input.positions(DevicePositions::packed(handle, count, radius).laid_out(0, 16)))?
//! ```
//!
//! # What wgpu knows, and what is done to keep it true
//!
//! * **Layouts.** wgpu tracks of every texture the use it was last put to, and from the use follows the layout:
//!   `COLOR_TARGET` is `COLOR_ATTACHMENT_OPTIMAL`, `RESOURCE` is `SHADER_READ_ONLY_OPTIMAL` for colours and
//!   `DEPTH_STENCIL_READ_ONLY_OPTIMAL` for depths. [`Liquid::record`] has wgpu itself bring output and scene there
//!   (`CommandEncoder::transition_resources`), in a command buffer of its own, because an encoder whose handle is taken takes
//!   no other commands of wgpu's. meniscus leaves each image in the layout that it came in, so that what wgpu believes
//!   afterwards is so.
//! * **Order within a layout.** Between two uses of a texture as a colour target wgpu leaves barriers out: one on either side of
//!   the liquid stands in for them. Readers and writers that wgpu does part wait for the stages of the use it knows of
//!   (colour attachment, shader reads), which are those in which meniscus writes and reads.
//! * **First use.** wgpu clears a texture where it knows of nothing that has been written to it, and it knows nothing of the
//!   liquid. So a pass of wgpu's has to come first in an output, if only to clear it, and store what it draws.
//! * **Lifetime.** wgpu does not know that the liquid uses these textures. It keeps what the same submission uses, so submit the
//!   pass that drew them, or the one that reads them, together with the liquid, or hold on to the textures until it is done.
//! * **Queue.** wgpu has one queue of one family (the device's first), on which the liquid is submitted by wgpu like anything
//!   else. Images are exclusive to that family: no ownership moves.
//! * **Memory.** meniscus allocates from the same device through an allocator of its own.

mod device;
mod error;
mod flight;
mod liquid;

pub use device::{check, enable, open};
pub use error::Error;
pub use liquid::{Frame, Liquid, Scene, camera};
pub use {meniscus, wgpu};
