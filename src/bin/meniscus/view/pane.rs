//! One picture in the window: a renderer and the image that it draws into, the same that `meniscus render` reads back.

use super::{adjust::Subject, player::Loaded};
use crate::{picture::Picture, render::average};
use ash::vk;
use meniscus::{
    Equirect, FrameInput, Renderer,
    host::{Canvas, Gpu, HostError, Upload},
    profile::FrameTimes,
};
use std::{error::Error, sync::Arc};

/// Linear float, as pictures are written from.
const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

pub struct Pane<'a> {
    gpu: &'a Gpu<'a>,
    /// Taken when it ends.
    renderer: Option<Renderer>,
    canvas: Option<Canvas<'a>>,
    pub subject: Subject,
    /// What its particles are of.
    given: Option<Arc<Loaded>>,
    /// Whether they are those of the frame before.
    still: bool,
    /// Positions, where the device prepares them; and those that frames in flight may still read, with how many frames have
    /// been recorded since.
    positions: Option<Upload<'a>>,
    retired: Vec<(usize, Upload<'a>)>,
    /// How a supersampled image is shown.
    filter: vk::Filter,
    /// Of the frame last looked at.
    pub times: Option<FrameTimes>,
    #[cfg(feature = "tracy")]
    zones: meniscus::tracy::Zones,
}

impl<'a> Pane<'a> {
    /// Frames in flight are those of the window.
    pub fn new(gpu: &'a Gpu<'a>, frames: u32, environment: &Equirect, subject: Subject) -> Result<Pane<'a>, HostError> {
        // SAFETY: the device outlives the pane, was made with the required features, and says whether it has large points.
        let renderer = unsafe { Renderer::new(gpu.host(frames), FORMAT) }?;
        // SAFETY: the device is of this instance.
        let can =
            unsafe { gpu.instance().handles().1.get_physical_device_format_properties(gpu.info.handle(), FORMAT) };
        let smooth = can.optimal_tiling_features.contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR);
        let mut pane = Pane {
            gpu,
            renderer: Some(renderer),
            canvas: None,
            subject,
            given: None,
            still: false,
            positions: None,
            retired: Vec::new(),
            filter: if smooth { vk::Filter::LINEAR } else { vk::Filter::NEAREST },
            times: None,
            #[cfg(feature = "tracy")]
            zones: meniscus::tracy::Zones::new("meniscus view"),
        };
        let renderer = pane.renderer();
        // SAFETY: `run` records outside rendering, and submits before any frame.
        gpu.run(|cmd| Ok(unsafe { renderer.set_environment(cmd, environment) }?))?;
        Ok(pane)
    }

    fn renderer(&mut self) -> &mut Renderer {
        self.renderer.as_mut().expect("there until it ends")
    }

    /// The picture that it shows of one that all panes share, in so many pixels of the window.
    pub fn picture(&self, shared: &Picture, size: [u32; 2]) -> Picture {
        Picture { size, settings: self.subject.settings, preparation: self.subject.preparation, ..shared.clone() }
    }

    /// Records a frame of these particles into its image, and leaves that to be copied from. After an error nothing of it may
    /// be submitted.
    ///
    /// # Safety
    /// `cmd` is recording outside rendering; the frame last recorded into this slot has completed.
    pub unsafe fn record(
        &mut self,
        cmd: vk::CommandBuffer,
        slot: usize,
        picture: &Picture,
        loaded: &Arc<Loaded>,
        frames: usize,
    ) -> Result<(), Box<dyn Error>> {
        let scene = &loaded.scene;
        let size = picture.rendered_size()?;
        if self.canvas.as_ref().is_none_or(|c| c.size() != size) {
            // SAFETY: the device is used by this thread alone.
            unsafe { self.gpu.device.device_wait_idle() }.map_err(|e| HostError::Vulkan("device", e))?;
            self.renderer().resize(size)?;
            self.canvas = None;
            self.canvas = Some(Canvas::new(self.gpu, FORMAT, 16, size)?);
        }
        self.retired.retain_mut(|(age, _)| {
            *age += 1;
            *age <= frames
        });
        if !self.given.as_ref().is_some_and(|given| Arc::ptr_eq(given, loaded)) {
            (self.given, self.still) = (None, false);
            let old = if picture.preparer().on_device() {
                let upload = Upload::new(self.gpu, bytemuck::cast_slice(&scene.positions))?;
                self.positions.replace(upload)
            } else {
                scene.give_to(self.renderer(), loaded.points.as_deref())?;
                self.positions.take()
            };
            self.retired.extend(old.map(|old| (0, old)));
            self.given = Some(loaded.clone());
        }
        let (camera, eye, _) = picture.camera(scene)?;
        let settings = picture.frame_settings(&scene.particles)?;
        let canvas = self.canvas.as_ref().expect("made above");
        let input = FrameInput::new(slot, &camera, &settings, canvas.view)
            .positions(self.positions.as_ref().map(|upload| scene.on_device(upload)))
            .still(self.still)
            .eye_inside(scene.eye_inside(eye, self.positions.is_some()));
        let (undefined, drawn) = (vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
        canvas.transition(cmd, undefined, drawn);
        let renderer = self.renderer.as_mut().expect("there until it ends");
        // SAFETY: this function's contract; the output is in its layout, positions are kept until frames are over.
        unsafe { renderer.record(cmd, &input) }?;
        self.still = true;
        Ok(())
    }

    /// What was recorded into a slot will never run.
    pub fn abandon(&mut self, slot: usize) {
        self.renderer().abandon(slot);
        self.still = false;
        // It says nothing of what frames before it still read.
        self.retired.iter_mut().for_each(|(age, _)| *age = age.saturating_sub(1));
    }

    /// Times of the frame last recorded into a slot, which has completed.
    pub fn look_at_times(&mut self, slot: usize) {
        let times = self.renderer().times(slot);
        #[cfg(feature = "tracy")]
        if let Some(times) = &times {
            let _ = self.zones.send(times);
        }
        self.times = times.or(self.times.take());
    }

    /// Records a copy of its image to a rectangle of the window's, whose image can be copied to.
    ///
    /// # Safety
    /// `cmd` is recording outside rendering, after [`Pane::record`] with the same.
    pub unsafe fn blit(&self, cmd: vk::CommandBuffer, to: vk::Image, at: [u32; 2], size: [u32; 2]) {
        let Some(canvas) = &self.canvas else { return };
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let corner = |[x, y]: [u32; 2], z| vk::Offset3D { x: x as i32, y: y as i32, z };
        let end = [at[0] + size[0], at[1] + size[1]];
        let region = vk::ImageBlit::default()
            .src_subresource(layers)
            .src_offsets([corner([0, 0], 0), corner(canvas.size(), 1)])
            .dst_subresource(layers)
            .dst_offsets([corner(at, 0), corner(end, 1)]);
        let (drawn, source) = (vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        let target = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        canvas.transition(cmd, drawn, source);
        // SAFETY: both images are alive and in these layouts; a supersampled one is larger, which a blit allows.
        unsafe {
            let device = &self.gpu.device;
            device.cmd_blit_image(cmd, canvas.image(), source, to, target, &[region], self.filter);
        }
        canvas.transition(cmd, source, drawn);
    }

    /// Its pixels as a picture is written from them, once frames are over.
    pub fn pixels(&self, supersample: u32) -> Result<Vec<[f32; 3]>, HostError> {
        let Some(canvas) = &self.canvas else { return Ok(Vec::new()) };
        Ok(average(&canvas.picture()?, canvas.size(), supersample))
    }
}

impl Drop for Pane<'_> {
    fn drop(&mut self) {
        // SAFETY: the device is alive, and idle when the renderer goes, whatever it answers.
        unsafe {
            let _ = self.gpu.device.device_wait_idle();
            self.renderer.take().into_iter().for_each(|r| r.destroy());
        }
    }
}
