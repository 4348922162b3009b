//! An image of the host's: colours or depths.

use super::{Gpu, HostError, vulkan};
use crate::{Error, access::Barrier};
use ash::vk;
use gpu_allocator::{MemoryLocation, vulkan::Allocation};

/// An image to render into and read back.
pub struct Canvas<'a> {
    gpu: &'a Gpu<'a>,
    image: vk::Image,
    /// View for [`crate::FrameInput::output`].
    pub view: vk::ImageView,
    size: [u32; 2],
    faces: u32,
    texel: u64,
    /// What is viewed and copied.
    aspect: vk::ImageAspectFlags,
    /// Of all that there is.
    aspects: vk::ImageAspectFlags,
    allocation: Option<Allocation>,
}

impl<'a> Canvas<'a> {
    /// An image with `texel` bytes a pixel; of a format with stencil, of its depth alone.
    pub fn new(gpu: &'a Gpu<'a>, format: vk::Format, texel: u64, size: [u32; 2]) -> Result<Canvas<'a>, HostError> {
        Self::with_faces(gpu, format, texel, size, 1)
    }

    /// A cube map with faces of so many pixels, in Vulkan's order of faces.
    pub fn cube(gpu: &'a Gpu<'a>, format: vk::Format, texel: u64, edge: u32) -> Result<Canvas<'a>, HostError> {
        Self::with_faces(gpu, format, texel, [edge, edge], 6)
    }

    fn with_faces(
        gpu: &'a Gpu<'a>,
        format: vk::Format,
        texel: u64,
        size: [u32; 2],
        faces: u32,
    ) -> Result<Canvas<'a>, HostError> {
        let depth = crate::input::has_depth(format);
        let (attachment, aspect) = match depth {
            true => (vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT, vk::ImageAspectFlags::DEPTH),
            false => (vk::ImageUsageFlags::COLOR_ATTACHMENT, vk::ImageAspectFlags::COLOR),
        };
        let stencil = crate::input::has_depth_and_stencil(format);
        let aspects = if stencil { aspect | vk::ImageAspectFlags::STENCIL } else { aspect };
        let spec = crate::resources::ImageSpec {
            format,
            size,
            layers: faces,
            array: false,
            usage: attachment
                | vk::ImageUsageFlags::TRANSFER_SRC
                | vk::ImageUsageFlags::SAMPLED
                | vk::ImageUsageFlags::TRANSFER_DST,
        };
        let (flags, view_type) = match faces {
            6 => (vk::ImageCreateFlags::CUBE_COMPATIBLE, vk::ImageViewType::CUBE),
            _ => (vk::ImageCreateFlags::empty(), vk::ImageViewType::TYPE_2D),
        };
        // SAFETY: complete info on a live device.
        let image = unsafe { gpu.device.create_image(&spec.info().flags(flags), None) }.map_err(vulkan("canvas"))?;
        let view = vk::ImageView::null();
        let mut canvas = Canvas { gpu, image, view, size, faces, texel, aspect, aspects, allocation: None };
        // SAFETY: the image was just made; its memory is kept until it is destroyed.
        unsafe {
            let requirements = gpu.device.get_image_memory_requirements(image);
            let allocation = gpu.allocate("canvas", requirements, MemoryLocation::GpuOnly, false)?;
            let bound = gpu.device.bind_image_memory(image, allocation.memory(), allocation.offset());
            canvas.allocation = Some(allocation);
            bound.map_err(vulkan("canvas"))?;
            let info = vk::ImageViewCreateInfo::default()
                .image(image)
                .view_type(view_type)
                .format(format)
                .subresource_range(crate::access::whole(aspect));
            canvas.view = gpu.device.create_image_view(&info, None).map_err(vulkan("canvas"))?;
        }
        gpu.set_name(canvas.image, "canvas");
        gpu.set_name(canvas.view, "canvas");
        Ok(canvas)
    }

    /// The image, for copies of the host's own.
    pub fn image(&self) -> vk::Image {
        self.image
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Records a barrier between two accesses; `from` may be `UNDEFINED` with everything before.
    pub fn transition(&self, cmd: vk::CommandBuffer, from: vk::ImageLayout, to: vk::ImageLayout) {
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let memory = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
        let barrier = Barrier { src: (all, memory, from), dst: (all, memory, to) };
        let barrier = [barrier.on_image(self.image, self.aspects)];
        // SAFETY: `cmd` is recording outside rendering; the image is alive and in the layout `from`.
        unsafe {
            self.gpu.device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().image_memory_barriers(&barrier))
        };
    }

    /// Records a clear of the whole image, of colours, which is in `layout`.
    pub fn clear(&self, cmd: vk::CommandBuffer, layout: vk::ImageLayout, value: [f32; 4]) {
        let range = [crate::access::whole(vk::ImageAspectFlags::COLOR)];
        let value = vk::ClearColorValue { float32: value };
        // SAFETY: `cmd` is recording outside rendering; the image is alive, in this layout, with TRANSFER_DST.
        unsafe { self.gpu.device.cmd_clear_color_image(cmd, self.image, layout, &value, &range) };
    }

    /// Fills it with pixels, row by row, and leaves it in a layout.
    pub fn write(&self, bytes: &[u8], layout: vk::ImageLayout) -> Result<(), HostError> {
        if bytes.len() as u64 != self.bytes() {
            let remedy = format!("give all {} bytes of the image", self.bytes());
            return Err(Error::parameter("pixels", format!("{} bytes", bytes.len()), remedy).into());
        }
        let upload = super::Upload::new(self.gpu, bytes)?;
        self.gpu.run(|cmd| {
            let to = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
            self.transition(cmd, vk::ImageLayout::UNDEFINED, to);
            // SAFETY: `cmd` is recording; the buffer holds the whole image.
            unsafe { self.gpu.device.cmd_copy_buffer_to_image(cmd, upload.buffer, self.image, to, &[self.whole()]) };
            self.transition(cmd, to, layout);
            Ok(())
        })
    }

    /// Bytes of all pixels, of every face.
    fn bytes(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1]) * u64::from(self.faces) * self.texel
    }

    fn whole(&self) -> vk::BufferImageCopy {
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(self.aspect).layer_count(self.faces);
        let extent = vk::Extent3D { width: self.size[0], height: self.size[1], depth: 1 };
        vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent)
    }

    /// The pixels, row by row, after a frame that left them in `COLOR_ATTACHMENT_OPTIMAL`; there they stay.
    pub fn read(&self) -> Result<Vec<u8>, HostError> {
        self.read_in(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
    }

    /// The same after a frame that left them in another layout.
    pub fn read_in(&self, drawn: vk::ImageLayout) -> Result<Vec<u8>, HostError> {
        let source = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        self.gpu.read_back(self.bytes(), |cmd, buffer| {
            self.transition(cmd, drawn, source);
            // SAFETY: `cmd` is recording; the buffer holds the whole image.
            unsafe { self.gpu.device.cmd_copy_image_to_buffer(cmd, self.image, source, buffer, &[self.whole()]) };
            self.transition(cmd, source, drawn);
            Ok(())
        })
    }

    /// The same as RGB, of four floats a pixel.
    pub fn picture(&self) -> Result<Vec<[f32; 3]>, HostError> {
        Ok(self.read()?.chunks_exact(16).map(|p| pixel(p).0).collect())
    }

    /// The same as RGB, and alpha apart from it.
    pub fn layers(&self) -> Result<(Vec<[f32; 3]>, Vec<f32>), HostError> {
        Ok(self.read()?.chunks_exact(16).map(pixel).unzip())
    }
}

impl Drop for Canvas<'_> {
    fn drop(&mut self) {
        // SAFETY: `Gpu::run` waits, so nothing is in flight.
        unsafe {
            self.gpu.device.destroy_image_view(self.view, None);
            self.gpu.device.destroy_image(self.image, None);
        }
        if let Some(allocation) = self.allocation.take() {
            self.gpu.free(allocation);
        }
    }
}

/// Light and alpha of four floats.
fn pixel(bytes: &[u8]) -> ([f32; 3], f32) {
    let float = |i: usize| f32::from_ne_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]);
    ([float(0), float(4), float(8)], float(12))
}
