//! Frames in flight: recorded, submitted, presented. The window's pictures are copies of the panes', with sheets of text over
//! them, so that no pipeline of its own is needed.

use super::{
    error::{ViewError, failed},
    pane::Pane,
    player::Loaded,
    swapchain::{Surface, Swapchain, Turn},
    text::Sheet,
};
use crate::picture::Picture;
use ash::vk;
use meniscus::host::{Gpu, Upload};
use std::{error::Error, sync::Arc};

/// How many frames may be recorded before the first of them is done.
pub const IN_FLIGHT: usize = 2;

/// What one frame in flight needs for itself.
struct Slot<'a> {
    cmd: vk::CommandBuffer,
    done: vk::Fence,
    /// Signalled when the window's image can be written to.
    free: vk::Semaphore,
    /// What is copied over the picture.
    sheets: Vec<Upload<'a>>,
    submitted: bool,
    /// Whether it renders, and its times have not been looked at.
    timed: bool,
}

/// A pane's picture, and the upper left corner of where it is.
pub struct Placed {
    pub picture: Picture,
    pub at: [u32; 2],
}

/// A sheet, and its upper left corner.
pub type Over = (Sheet, [u32; 2]);

pub struct Frames<'a> {
    gpu: &'a Gpu<'a>,
    pub swapchain: Swapchain<'a>,
    pool: vk::CommandPool,
    slots: Vec<Slot<'a>>,
    next: usize,
    /// Whether the window's images have to be made anew.
    pub stale: bool,
}

/// What became of a frame.
#[derive(PartialEq)]
pub enum Drawn {
    Shown,
    /// Nothing was: the window is of another size, has none, or takes no image now.
    NotNow,
}

impl<'a> Frames<'a> {
    pub fn new(gpu: &'a Gpu<'a>, surface: &'a Surface<'a>) -> Result<Frames<'a>, ViewError> {
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(gpu.info.family())
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        // SAFETY: complete info on a live device.
        let pool = unsafe { gpu.device.create_command_pool(&info, None) }.map_err(failed("command pool"))?;
        let swapchain = Swapchain::new(gpu, surface);
        let mut frames = Frames { gpu, swapchain, pool, slots: Vec::new(), next: 0, stale: true };
        for _ in 0..IN_FLIGHT {
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            // SAFETY: complete infos on a live device.
            unsafe {
                let d = &gpu.device;
                frames.slots.push(Slot {
                    cmd: d.allocate_command_buffers(&info).map_err(failed("command buffer"))?[0],
                    done: d.create_fence(&Default::default(), None).map_err(failed("fence"))?,
                    free: d.create_semaphore(&Default::default(), None).map_err(failed("semaphore"))?,
                    sheets: Vec::new(),
                    submitted: false,
                    timed: false,
                });
            }
        }
        Ok(frames)
    }

    /// Waits for the frame that was last recorded into the next slot.
    fn wait(&mut self, panes: &mut [Pane]) -> Result<(), ViewError> {
        let slot = &mut self.slots[self.next];
        if slot.submitted {
            // SAFETY: the fence is this device's, and was given with a submission.
            unsafe {
                self.gpu.device.wait_for_fences(&[slot.done], true, u64::MAX).map_err(failed("frame"))?;
                self.gpu.device.reset_fences(&[slot.done]).map_err(failed("fence"))?;
            }
            slot.submitted = false;
            if std::mem::take(&mut slot.timed) {
                panes.iter_mut().for_each(|p| p.look_at_times(self.next));
            }
        }
        slot.sheets.clear();
        Ok(())
    }

    /// Whether there are times of a frame that has been completed since: they are taken. Waits for nothing.
    pub fn look_at_times(&mut self, panes: &mut [Pane]) -> bool {
        let mut found = false;
        for (index, slot) in self.slots.iter_mut().enumerate() {
            // SAFETY: the fence is this device's.
            if slot.timed && unsafe { self.gpu.device.get_fence_status(slot.done) } == Ok(true) {
                slot.timed = false;
                panes.iter_mut().for_each(|p| p.look_at_times(index));
                found = true;
            }
        }
        found
    }

    /// Whether times of a frame are still to come.
    pub fn awaits_times(&self) -> bool {
        self.slots.iter().any(|slot| slot.timed)
    }

    /// Draws the panes, each with its picture, if a file has been read; without `anew` they stay what they are. Sheets come over
    /// them. What a renderer refuses is the inner error, and leaves the window as it was.
    pub fn draw(
        &mut self,
        panes: &mut [Pane<'a>],
        placed: &[Placed],
        loaded: Option<&Arc<Loaded>>,
        anew: bool,
        sheets: &[Over],
    ) -> Result<Result<Drawn, Box<dyn Error>>, ViewError> {
        self.wait(panes)?;
        let (device, index) = (&self.gpu.device, self.next);
        let cmd = self.slots[index].cmd;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's last frame has completed.
        unsafe { device.begin_command_buffer(cmd, &begin) }.map_err(failed("command buffer"))?;
        // Before an image is asked for: whoever has one has to present it.
        let mut recorded = Ok(());
        for (pane, placed) in panes.iter_mut().zip(placed) {
            if let Some(loaded) = loaded.filter(|_| anew) {
                // SAFETY: recording has begun; the slot's last frame has completed.
                recorded = unsafe { pane.record(cmd, index, &placed.picture, loaded, IN_FLIGHT) };
            }
            if recorded.is_err() {
                break;
            }
        }
        let turn = match &recorded {
            Ok(()) => self.swapchain.acquire(self.slots[index].free)?,
            Err(_) => Turn::Again,
        };
        let Turn::Done(image) = turn else {
            self.stale |= matches!(turn, Turn::Stale);
            if anew {
                panes.iter_mut().for_each(|p| p.abandon(index));
            }
            // SAFETY: it was never submitted.
            unsafe { device.reset_command_buffer(cmd, Default::default()) }.map_err(failed("command buffer"))?;
            return Ok(recorded.map(|()| Drawn::NotNow));
        };
        let target = self.swapchain.images[image as usize];
        let (transfer, write) = (vk::PipelineStageFlags2::ALL_TRANSFER, vk::AccessFlags2::TRANSFER_WRITE);
        let none = vk::AccessFlags2::NONE;
        use vk::ImageLayout as L;
        // After what the semaphore is waited for at.
        self.barrier(cmd, target, (transfer, none, L::UNDEFINED), (transfer, write, L::TRANSFER_DST_OPTIMAL));
        let ground = vk::ClearColorValue { float32: [0.01, 0.012, 0.015, 1.0] };
        // SAFETY: the image is in this layout, and its own.
        unsafe { device.cmd_clear_color_image(cmd, target, L::TRANSFER_DST_OPTIMAL, &ground, &[whole()]) };
        let after = (transfer, write, L::TRANSFER_DST_OPTIMAL);
        self.barrier(cmd, target, after, after);
        if loaded.is_some() {
            for (pane, placed) in panes.iter().zip(placed) {
                // SAFETY: recorded above.
                unsafe { pane.blit(cmd, target, placed.at, placed.picture.size) };
            }
            self.barrier(cmd, target, after, after);
        }
        self.cover(cmd, target, sheets)?;
        let shown = (vk::PipelineStageFlags2::ALL_COMMANDS, none, L::PRESENT_SRC_KHR);
        self.barrier(cmd, target, after, shown);
        self.submit(image)?;
        self.slots[index].timed = anew && loaded.is_some();
        self.next = (self.next + 1) % IN_FLIGHT;
        self.stale |= matches!(self.swapchain.present(image)?, Turn::Stale);
        Ok(Ok(Drawn::Shown))
    }

    /// Copies sheets over the picture, one after the other, each as far as it is inside.
    fn cover(&mut self, cmd: vk::CommandBuffer, target: vk::Image, sheets: &[Over]) -> Result<(), ViewError> {
        let [width, height] = self.swapchain.size;
        for (sheet, at) in sheets {
            let [w, h] =
                [sheet.size[0].min(width.saturating_sub(at[0])), sheet.size[1].min(height.saturating_sub(at[1]))];
            if w == 0 || h == 0 {
                continue;
            }
            let upload = Upload::new(self.gpu, &sheet.bytes)?;
            let region = vk::BufferImageCopy::default()
                .buffer_row_length(sheet.size[0])
                .image_subresource(
                    vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1),
                )
                .image_offset(vk::Offset3D { x: at[0] as i32, y: at[1] as i32, z: 0 })
                .image_extent(vk::Extent3D { width: w, height: h, depth: 1 });
            let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
            // SAFETY: the buffer holds the sheet and is kept until the frame is over; the rectangle is inside the image.
            unsafe {
                self.gpu.device.cmd_copy_buffer_to_image(cmd, upload.buffer, target, layout, &[region]);
            }
            let after = (vk::PipelineStageFlags2::ALL_TRANSFER, vk::AccessFlags2::TRANSFER_WRITE, layout);
            self.barrier(cmd, target, after, after);
            self.slots[self.next].sheets.push(upload);
        }
        Ok(())
    }

    fn submit(&mut self, image: u32) -> Result<(), ViewError> {
        let slot = &mut self.slots[self.next];
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(slot.cmd)];
        let waits =
            [vk::SemaphoreSubmitInfo::default().semaphore(slot.free).stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)];
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.swapchain.drawn(image))
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit = vk::SubmitInfo2::default()
            .command_buffer_infos(&buffers)
            .wait_semaphore_infos(&waits)
            .signal_semaphore_infos(&signals);
        // SAFETY: recording ends before submission; the fence is reset, and waited for before the slot's next frame.
        unsafe {
            self.gpu.device.end_command_buffer(slot.cmd).map_err(failed("command buffer"))?;
            self.gpu.device.queue_submit2(self.gpu.queue(), &[submit], slot.done).map_err(failed("submission"))?;
        }
        slot.submitted = true;
        Ok(())
    }

    fn barrier(&self, cmd: vk::CommandBuffer, image: vk::Image, src: Use, dst: Use) {
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(src.0)
            .src_access_mask(src.1)
            .old_layout(src.2)
            .dst_stage_mask(dst.0)
            .dst_access_mask(dst.1)
            .new_layout(dst.2)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image)
            .subresource_range(whole())];
        // SAFETY: `cmd` is recording outside rendering; the image is alive and in the layout of `src`.
        unsafe {
            self.gpu.device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().image_memory_barriers(&barrier));
        }
    }
}

/// Stage, access, layout.
type Use = (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout);

fn whole() -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1)
}

impl Drop for Frames<'_> {
    fn drop(&mut self) {
        // SAFETY: the device is idle when they go, whatever it answers.
        unsafe {
            let device = &self.gpu.device;
            let _ = device.device_wait_idle();
            for slot in &self.slots {
                device.destroy_fence(slot.done, None);
                device.destroy_semaphore(slot.free, None);
            }
            device.destroy_command_pool(self.pool, None);
        }
    }
}
