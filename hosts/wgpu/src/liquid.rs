//! A renderer on wgpu's device, and its frames as wgpu's command buffers.

use crate::{
    Error,
    flight::{Place, State},
};
use meniscus::{
    Background, Camera, Equirect, FrameInput, Host, Renderer, SceneInput, Settings,
    ash::{self, vk},
    glam::Mat4,
    gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc},
};
use std::{
    iter,
    sync::{Arc, Mutex},
};
use wgpu::{PollType, TextureUses, hal::api::Vulkan};

/// The opaque scene that wgpu has drawn: see [`SceneInput`].
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Linear colour, of one sample; with `TEXTURE_BINDING`.
    pub color: &'a wgpu::TextureView,
    /// Its depth (the depth aspect), of one sample; with `TEXTURE_BINDING`.
    pub depth: &'a wgpu::TextureView,
    /// What the depth was cleared to.
    pub cleared_depth: f32,
}

/// One frame: see [`FrameInput`].
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// See [`camera`] for matrices of wgpu's.
    pub camera: &'a Camera,
    /// Method, liquid and drawing.
    pub settings: &'a Settings,
    /// What is drawn into, of one sample and of the format given to [`Liquid::new`]; with `RENDER_ATTACHMENT`. wgpu has drawn
    /// into it before, if only to clear it.
    pub output: &'a wgpu::TextureView,
    /// wgpu's own scene. None of its textures is the output.
    pub scene: Option<Scene<'a>>,
    /// What is seen where no liquid is.
    pub background: Background,
}

/// The camera of a right-handed view and a projection of wgpu's, by columns: there y of the picture goes up, in Vulkan down.
/// `near` as in [`Camera::near`].
pub fn camera(view: [[f32; 4]; 4], projection: [[f32; 4]; 4], near: f32) -> Camera {
    let flip = Mat4::from_diagonal([1.0, -1.0, 1.0, 1.0].into());
    Camera::new(Mat4::from_cols_array_2d(&view), flip * Mat4::from_cols_array_2d(&projection), near)
}

/// A renderer that borrows wgpu's device. Frames are submitted in the order in which they were recorded.
pub struct Liquid {
    // Until it is dropped.
    renderer: Option<Renderer>,
    places: Vec<Place>,
    next: usize,
    output: wgpu::TextureFormat,
    raw: ash::Device,
    // Last: everything above is of this device.
    device: wgpu::Device,
}

impl Liquid {
    /// Makes a renderer on a device of [`crate::open`]'s, or of an engine's that called [`crate::enable`], for outputs of one
    /// format. With `frames_in_flight` one more than the application has, no frame waits for another.
    ///
    /// # Safety
    /// The device is of this adapter, and was opened so.
    pub unsafe fn new(
        adapter: &wgpu::Adapter,
        device: &wgpu::Device,
        output: wgpu::TextureFormat,
        frames_in_flight: u32,
    ) -> Result<Liquid, Error> {
        let other = || Error::NotVulkan(adapter.get_info().backend.to_str());
        // SAFETY: nothing of adapter and device is destroyed, and the clone of the device, which is dropped last, keeps them
        // alive.
        let (host, raw, format) = unsafe {
            let format = adapter.as_hal::<Vulkan>().ok_or_else(other)?.texture_format_as_raw(output);
            let raw = device.as_hal::<Vulkan>().ok_or_else(other)?;
            let (instance, physical) = (raw.shared_instance().raw_instance().clone(), raw.raw_physical_device());
            let device = raw.raw_device().clone();
            let allocator = Allocator::new(&AllocatorCreateDesc {
                instance: instance.clone(),
                device: device.clone(),
                physical_device: physical,
                debug_settings: Default::default(),
                buffer_device_address: false,
                allocation_sizes: Default::default(),
            })?;
            let allocator = Arc::new(Mutex::new(allocator));
            let mut host = Host::new(instance, device.clone(), physical, raw.queue_family_index(), allocator);
            host.frames_in_flight = frames_in_flight;
            (host, device, format)
        };
        // SAFETY: the handles live as said above; the features are enabled, by this function's contract.
        let renderer = unsafe { Renderer::new(host, format) }?;
        let places = (0..frames_in_flight).map(|_| Place::default()).collect();
        Ok(Liquid { renderer: Some(renderer), places, next: 0, output, raw, device: device.clone() })
    }

    /// The renderer: particles, points, times, and so on.
    pub fn renderer(&mut self) -> &mut Renderer {
        self.renderer.as_mut().expect("there until it is dropped")
    }

    /// Sets the environment.
    ///
    /// # Safety
    /// The command buffer is submitted, before those of frames that are recorded from here on.
    pub unsafe fn set_environment(&mut self, map: &Equirect) -> Result<wgpu::CommandBuffer, Error> {
        let mut encoder = self.encoder("meniscus environment");
        let cmd = handle(&mut encoder)?;
        // SAFETY: the command buffer is recording, outside of passes.
        unsafe { self.renderer().set_environment(cmd, map) }?;
        Ok(encoder.finish())
    }

    /// Records a frame of the output's size, with `more` of what meniscus can be given. The two command buffers are submitted one
    /// after the other, between those that draw the scene and those that use the picture: the first brings textures into the uses
    /// that the second, the liquid itself, has for them, and leaves them in.
    ///
    /// # Safety
    /// * The textures live until the frame is done: see the crate's documentation.
    /// * So do the handles that `more` adds, which are in the layouts stated beside them.
    /// * Frames are submitted in the order in which they were recorded, each after the environment.
    pub unsafe fn record<'a>(
        &mut self,
        frame: &Frame<'a>,
        more: impl FnOnce(FrameInput<'a>) -> FrameInput<'a>,
    ) -> Result<[wgpu::CommandBuffer; 2], Error> {
        // Of the view itself wgpu tells no format; that differs from its texture's in this at most.
        let (given, wanted) = (frame.output.texture().format(), self.output);
        if given.remove_srgb_suffix() != wanted.remove_srgb_suffix() {
            return Err(Error::Format { given, wanted });
        }
        if frame.scene.iter().flat_map(|s| [s.color, s.depth]).any(|view| view.texture() == frame.output.texture()) {
            return Err(Error::SceneIsOutput);
        }
        let slot = self.slot()?;
        let used = |view: &'a wgpu::TextureView, state| wgpu::TextureTransition {
            texture: view.texture(),
            selector: None,
            state,
        };
        let mut input = FrameInput::new(slot, frame.camera, frame.settings, raw(frame.output)?);
        let mut uses = vec![used(frame.output, TextureUses::COLOR_TARGET)];
        if let Some(scene) = &frame.scene {
            uses.push(used(scene.color, TextureUses::RESOURCE));
            uses.push(used(scene.depth, TextureUses::RESOURCE));
            let color = (raw(scene.color)?, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
            let depth = (raw(scene.depth)?, vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL);
            input = input.scene(SceneInput::new(color, depth, scene.cleared_depth));
        }
        let input = more(input.background(frame.background));
        let mut before = self.encoder("meniscus before");
        before.transition_resources(iter::empty(), uses.into_iter());

        let size = frame.output.texture().size();
        self.renderer().resize([size.width, size.height])?;
        let mut encoder = self.encoder("meniscus");
        let cmd = handle(&mut encoder)?;
        // SAFETY: the command buffer is recording, outside of passes. The views are of this device, and in the layouts of the
        // uses that the first command buffer brings them into; what the caller adds is the caller's.
        unsafe {
            in_turn(&self.raw, cmd);
            self.renderer().record(cmd, &input)?;
            in_turn(&self.raw, cmd);
        }
        // Said of the command buffer that holds the frame: submitted alone, the first one is no frame.
        let ticket = self.places[slot].take();
        encoder.on_submitted_work_done(move || ticket.done());
        self.next = (slot + 1) % self.places.len();
        Ok([before.finish(), encoder.finish()])
    }

    /// A slot whose frame is done. With enough of them it was done long ago.
    fn slot(&mut self) -> Result<usize, Error> {
        self.device.poll(PollType::Poll)?;
        for (slot, place) in self.places.iter().enumerate() {
            if place.state() == State::Dropped {
                self.renderer.as_mut().expect("there until it is dropped").abandon(slot);
                place.free();
            }
        }
        let place = &self.places[self.next];
        if place.state() == State::Recorded {
            // Of the submission wgpu tells the application alone: so this is for the newest.
            self.device.poll(PollType::wait_indefinitely())?;
        }
        match place.state() {
            State::Free => Ok(self.next),
            _ => Err(Error::Unsubmitted(self.places.len())),
        }
    }

    fn encoder(&self, label: &str) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
    }
}

impl Drop for Liquid {
    fn drop(&mut self) {
        // A device that is lost runs nothing.
        let _ = self.device.poll(PollType::wait_indefinitely());
        if let Some(renderer) = self.renderer.take() {
            // SAFETY: all that was submitted is done.
            unsafe { renderer.destroy() };
        }
    }
}

/// wgpu's view, as Vulkan knows it.
fn raw(view: &wgpu::TextureView) -> Result<vk::ImageView, Error> {
    // SAFETY: nothing of the view is destroyed.
    unsafe { Ok(view.as_hal::<Vulkan>().ok_or(Error::NoEncoder)?.raw_handle()) }
}

/// The command buffer behind an encoder that nothing of wgpu's is recorded into.
fn handle(encoder: &mut wgpu::CommandEncoder) -> Result<vk::CommandBuffer, Error> {
    // SAFETY: it is neither ended nor destroyed; wgpu does both.
    let cmd = unsafe { encoder.as_hal_mut::<Vulkan, _, _>(|raw| raw.map(|raw| raw.raw_handle())) };
    cmd.ok_or(Error::NoEncoder)
}

/// What is drawn into a colour target before comes before what is drawn into it, or blended over it, after. wgpu leaves this out
/// between its own passes: their order within a queue is enough for it, though not for Vulkan.
///
/// # Safety
/// The command buffer is this device's, and recording outside of passes.
unsafe fn in_turn(device: &ash::Device, cmd: vk::CommandBuffer) {
    use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(Stage::COLOR_ATTACHMENT_OUTPUT)
        .src_access_mask(Access::COLOR_ATTACHMENT_WRITE)
        .dst_stage_mask(Stage::COLOR_ATTACHMENT_OUTPUT)
        .dst_access_mask(Access::COLOR_ATTACHMENT_READ | Access::COLOR_ATTACHMENT_WRITE)];
    // SAFETY: this function's contract.
    unsafe { device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&barrier)) };
}

#[cfg(test)]
mod tests {
    use super::*;
    use meniscus::glam::{Vec3, camera::rh};

    #[test]
    fn the_pictures_y_is_turned_down() {
        let (eye, fov, aspect, near) = (Vec3::new(1.0, 2.0, 3.0), 0.7, 1.5, 0.1);
        let wanted = Camera::look_at(eye, Vec3::ZERO, Vec3::Y, fov, aspect, near);
        // Direct3D's and WebGPU's clip spaces are one.
        let projection = rh::proj::directx::perspective_infinite(fov, aspect, near);
        assert_eq!(camera(wanted.view.to_cols_array_2d(), projection.to_cols_array_2d(), near), wanted);
    }
}
