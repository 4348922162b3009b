//! Frames: recorded, or said never to run.

use crate::{
    frame::{MeniscusFrame, Read},
    renderer::{MeniscusRenderer, check, with},
    status::MeniscusStatus,
    versioned::tell,
};
use renderer::ash::vk::CommandBuffer as VkCommandBuffer;

/// Records one frame into the host's command buffer. After an error the command buffer is not to be submitted.
///
/// # Safety
/// * `renderer` is null or a renderer; `frame` is null or a frame with its size, and so is what it points to.
/// * `cmd` is recording, outside rendering, and goes to a queue of the host's family, after all frames recorded before it.
/// * The frame last recorded into its slot has completed on the device.
/// * The buffers of its positions are alive until the frame has completed, hold what is said of them, and their earlier writes are
///   visible to reads in compute shaders. What is written there later waits for the frame's compute shaders.
/// * The buffers of moving particles are alive until the frame has completed, and their earlier writes are visible to reads in vertex
///   shaders.
/// * The output, and what there is of the scene, of an environment of the host's and of MeniscusFrame::surface, are alive until the
///   frame has completed and in the stated layouts; all but the environment have the view in them, whole, where it is said to begin.
///   Their earlier writes are visible to sampling in fragment shaders, and those of the output and of the surface's images to the
///   attachment stages.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_record(
    renderer: *mut MeniscusRenderer,
    cmd: VkCommandBuffer,
    frame: *const MeniscusFrame,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            let frame = Read::new(frame)?;
            Ok(renderer.record(check(cmd)?, &frame.input())?)
        })
    }
}

/// Says that the frame last recorded into a slot will never run: its command buffer was reset, or is not submitted. To be called
/// before the next frame is recorded into any slot, for each such frame, in any order. Waits for nothing.
///
/// # Safety
/// `renderer` is null or a renderer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_abandon(renderer: *mut MeniscusRenderer, slot: u32) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            renderer.abandon(slot as usize);
            Ok(())
        })
    }
}

/// Compiles what a frame like this one needs and is not there yet, of the particles last given or of its positions. Of what it names
/// (outputs, buffers, images) nothing is touched: null handles will do. `made`, if it is not null, tells how many pipelines were made.
///
/// # Safety
/// `renderer` is null or a renderer; `frame` is null or a frame with its size, and so is what it points to; `made` is null or can be
/// written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_warm_up_like(
    renderer: *mut MeniscusRenderer,
    frame: *const MeniscusFrame,
    made: *mut usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            tell(made, renderer.warm_up_like(&Read::new(frame)?.input())?);
            Ok(())
        })
    }
}
