//! One renderer on one device: frames in, targets out.

use super::{Canvas, Gpu, HostError};
use crate::{Equirect, FrameInput, Renderer, inspect::Spec, profile::FrameTimes, shader::Frame};
use ash::vk;

/// Output format: linear float, so that one frame serves pictures, dumps and downsampling.
const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// A renderer, an environment and an output of one size on one device; every call waits.
pub struct Session<'a> {
    /// The device.
    pub gpu: &'a Gpu<'a>,
    /// The renderer, for particles, needs and memory.
    pub renderer: Renderer,
    canvas: Canvas<'a>,
    #[cfg(feature = "tracy")]
    zones: crate::tracy::Zones,
}

impl<'a> Session<'a> {
    /// Makes the renderer and uploads the environment.
    pub fn new(gpu: &'a Gpu<'a>, size: [u32; 2], environment: &Equirect) -> Result<Session<'a>, HostError> {
        // SAFETY: `gpu` outlives the session, was made with the required features, and says whether it has large points.
        let mut renderer = unsafe { Renderer::new(gpu.host(1), FORMAT) }?;
        let ready = renderer.resize(size).map_err(HostError::from).and_then(|()| {
            // SAFETY: `run` records outside rendering, and submits before any frame.
            gpu.run(|cmd| Ok(unsafe { renderer.set_environment(cmd, environment) }?))?;
            Canvas::new(gpu, FORMAT, 16, size)
        });
        match ready {
            Ok(canvas) => Ok(Session {
                gpu,
                renderer,
                canvas,
                #[cfg(feature = "tracy")]
                zones: crate::tracy::Zones::new("meniscus"),
            }),
            Err(e) => {
                // SAFETY: `run` waits, so nothing is in flight.
                unsafe { renderer.destroy() };
                Err(e)
            }
        }
    }

    /// Changes the size of frames to come.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), HostError> {
        self.renderer.resize(size)?;
        self.canvas = Canvas::new(self.gpu, FORMAT, 16, size)?;
        Ok(())
    }

    /// Renders one frame into the session's own output (`input.output` is ignored) and waits for it.
    pub fn frame(&mut self, input: &FrameInput) -> Result<Option<FrameTimes>, HostError> {
        let input = FrameInput { output: self.canvas.view, ..*input };
        let (renderer, canvas) = (&mut self.renderer, &self.canvas);
        self.gpu.run_frame(|cmd| {
            // A frame may keep what is there, which is then to be something.
            let (undefined, clearing) = (vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
            canvas.transition(cmd, undefined, clearing);
            canvas.clear(cmd, clearing, [0.0; 4]);
            canvas.transition(cmd, clearing, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
            // SAFETY: `cmd` is recording outside rendering; `run` waits, so slot 0 is free; the output was just
            // brought into the stated layout.
            Ok(unsafe { renderer.record(cmd, &input) }?)
        })?;
        let times = self.renderer.times(input.slot);
        #[cfg(feature = "tracy")]
        if let Some(times) = &times {
            // What finds no track is not seen in Tracy, and drawn all the same.
            let _ = self.zones.send(times);
        }
        Ok(times)
    }

    /// The picture as last rendered: linear RGB, row by row.
    pub fn picture(&self) -> Result<Vec<[f32; 3]>, HostError> {
        self.canvas.picture()
    }

    /// The same, and its alpha: the liquid's coverage before [`crate::Background::Host`], in which light is premultiplied.
    pub fn layers(&self) -> Result<(Vec<[f32; 3]>, Vec<f32>), HostError> {
        self.canvas.layers()
    }

    /// The words of one layer of a target, or of a buffer; `None` if the last frame did without it.
    pub fn words(&mut self, name: &'static str, layer: u32) -> Result<Option<Vec<u32>>, HostError> {
        let bytes = match self.renderer.spec(name) {
            None => return Ok(None),
            Some(Spec::Image(spec))
                if layer >= spec.layers || !spec.usage.contains(vk::ImageUsageFlags::TRANSFER_SRC) =>
            {
                return Ok(None);
            }
            Some(Spec::Image(spec)) => {
                let texel = match spec.format {
                    FORMAT => 16,
                    vk::Format::R32G32_SFLOAT => 8,
                    _ => 4,
                };
                u64::from(spec.size[0]) * u64::from(spec.size[1]) * texel
            }
            Some(Spec::Buffer { bytes, .. }) => bytes,
        };
        let renderer = &mut self.renderer;
        // SAFETY: recorded outside rendering after the frame; the buffer has room for the whole layer.
        let data =
            self.gpu.read_back(bytes, |cmd, to| Ok(unsafe { renderer.record_copy(cmd, name, layer, to, 0) }?))?;
        Ok(Some(data.chunks_exact(4).map(|w| u32::from_ne_bytes([w[0], w[1], w[2], w[3]])).collect()))
    }

    /// The words of several buffers; `None` if the last frame did without one of them.
    pub fn all_words<const N: usize>(&mut self, names: [&'static str; N]) -> Result<Option<[Vec<u32>; N]>, HostError> {
        let mut all = [const { Vec::new() }; N];
        for (words, name) in all.iter_mut().zip(names) {
            let Some(read) = self.words(name, 0)? else { return Ok(None) };
            *words = read;
        }
        Ok(Some(all))
    }

    /// The block that the last frame's shaders read, completed by them where the device finds the particles' box.
    pub fn block(&mut self) -> Result<Frame, HostError> {
        self.gpu.run(|cmd| {
            let visible = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::HOST)
                .dst_access_mask(vk::AccessFlags2::HOST_READ)];
            // SAFETY: `cmd` is recording.
            unsafe {
                self.gpu.device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&visible));
            }
            Ok(())
        })?;
        self.renderer.block(0).ok_or(crate::Error::Order("no frame in flight has a block").into())
    }

    /// What the last frame counted, by name.
    pub fn counters(&mut self) -> Result<Vec<(&'static str, u32)>, HostError> {
        let mut all = Vec::new();
        for (buffer, names) in self.renderer.counters() {
            let words = self.words(buffer, 0)?.unwrap_or_default();
            all.extend(names.into_iter().zip(words));
        }
        Ok(all)
    }

    /// Destroys the renderer.
    pub fn end(self) {
        let Session { renderer, .. } = self;
        // SAFETY: every `run` has waited.
        unsafe { renderer.destroy() };
    }
}
