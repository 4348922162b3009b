//! Images and buffers: made, named, retired by frame index and destroyed without waiting.

use crate::{
    Error,
    allocator::{Location, Memory, Request},
    device::Host,
};
use ash::vk;

/// An image with its views: one of the whole, and one a layer for attachments.
pub(crate) struct Image {
    pub handle: vk::Image,
    pub view: vk::ImageView,
    pub layers: Vec<vk::ImageView>,
    pub aspect: vk::ImageAspectFlags,
    pub bytes: u64,
    allocation: Option<Memory>,
}

/// A buffer; mapped where it is the host that writes it.
pub(crate) struct Buffer {
    pub handle: vk::Buffer,
    /// Its view as a texel buffer, four words a texel; null where it is not used as one.
    pub texels: vk::BufferView,
    pub bytes: u64,
    allocation: Option<Memory>,
}

/// How an image is made; also what its memory is computed from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageSpec {
    /// Format.
    pub format: vk::Format,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Array layers; arrays are viewed as such even with one layer.
    pub layers: u32,
    /// Whether shaders see an array.
    pub array: bool,
    /// Usage.
    pub usage: vk::ImageUsageFlags,
}

impl ImageSpec {
    pub(crate) fn info(&self) -> vk::ImageCreateInfo<'static> {
        vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(self.format)
            .extent(vk::Extent3D { width: self.size[0], height: self.size[1], depth: 1 })
            .mip_levels(1)
            .array_layers(self.layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(self.usage)
            .sharing_mode(vk::SharingMode::EXCLUSIVE)
            .initial_layout(vk::ImageLayout::UNDEFINED)
    }
}

fn allocate(
    host: &Host,
    name: &str,
    requirements: vk::MemoryRequirements,
    location: Location,
    linear: bool,
) -> Result<Memory, Error> {
    let request = Request { name, requirements, location, linear };
    let (resource, bytes) = (name.to_owned(), requirements.size);
    let given = host.allocator.allocate(&request).and_then(|memory| match (location, memory.mapped) {
        (Location::Upload, None) => {
            host.allocator.free(memory);
            Err("the allocator gave memory that is not mapped, where the host has to write".into())
        }
        _ => Ok(memory),
    });
    given.map_err(|source| Error::Memory { resource, bytes, source })
}

fn free(host: &Host, allocation: &mut Option<Memory>) {
    if let Some(memory) = allocation.take() {
        host.allocator.free(memory);
    }
}

impl Image {
    pub fn new(host: &Host, name: &str, spec: &ImageSpec) -> Result<Image, Error> {
        // SAFETY: the info is complete and the device alive; this and the calls below destroy nothing in use.
        let handle = unsafe { host.device.create_image(&spec.info(), None) }.map_err(Error::vulkan(name))?;
        // SAFETY: the image was just made from this device.
        let requirements = unsafe { host.device.get_image_memory_requirements(handle) };
        let depth = spec.format == vk::Format::D32_SFLOAT;
        let aspect = if depth { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR };
        let mut image = Image {
            handle,
            view: vk::ImageView::null(),
            layers: Vec::new(),
            aspect,
            bytes: requirements.size,
            allocation: None,
        };
        match image.back(host, name, spec, requirements) {
            Ok(()) => Ok(image),
            Err(e) => {
                image.destroy(host);
                Err(e)
            }
        }
    }

    /// Binds memory and makes the views.
    fn back(
        &mut self,
        host: &Host,
        name: &str,
        spec: &ImageSpec,
        requirements: vk::MemoryRequirements,
    ) -> Result<(), Error> {
        let allocation = allocate(host, name, requirements, Location::Device, false)?;
        // SAFETY: memory of the image's own requirements, bound once, kept until the image is destroyed.
        let bound = unsafe { host.device.bind_image_memory(self.handle, allocation.memory, allocation.offset) };
        self.allocation = Some(allocation);
        bound.map_err(Error::vulkan(name))?;
        host.set_name(self.handle, name);
        let view = |kind, first, count| {
            let range = vk::ImageSubresourceRange {
                base_array_layer: first,
                layer_count: count,
                ..crate::access::whole(self.aspect)
            };
            let info = vk::ImageViewCreateInfo::default()
                .image(self.handle)
                .view_type(kind)
                .format(spec.format)
                .subresource_range(range);
            // SAFETY: the image is bound to memory and the range lies inside it.
            unsafe { host.device.create_image_view(&info, None) }.map_err(Error::vulkan(name))
        };
        let kind = if spec.array { vk::ImageViewType::TYPE_2D_ARRAY } else { vk::ImageViewType::TYPE_2D };
        let whole = view(kind, 0, spec.layers)?;
        let layers: Result<Vec<_>, _> = (0..spec.layers).map(|l| view(vk::ImageViewType::TYPE_2D, l, 1)).collect();
        self.view = whole;
        self.layers = layers?;
        host.set_name(self.view, name);
        for (i, layer) in self.layers.iter().enumerate() {
            host.set_name(*layer, &format!("{name}, layer {i}"));
        }
        Ok(())
    }

    pub fn destroy(&mut self, host: &Host) {
        // SAFETY: callers destroy only what no frame in flight uses; null handles are allowed.
        unsafe {
            for view in self.layers.drain(..) {
                host.device.destroy_image_view(view, None);
            }
            host.device.destroy_image_view(self.view, None);
            host.device.destroy_image(self.handle, None);
        }
        free(host, &mut self.allocation);
    }
}

impl Buffer {
    pub fn new(
        host: &Host,
        name: &str,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: Location,
    ) -> Result<Buffer, Error> {
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage).sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: the info is complete and the device alive.
        let handle = unsafe { host.device.create_buffer(&info, None) }.map_err(Error::vulkan(name))?;
        // SAFETY: the buffer was just made from this device.
        let requirements = unsafe { host.device.get_buffer_memory_requirements(handle) };
        let texels = vk::BufferView::null();
        let mut buffer = Buffer { handle, texels, bytes: requirements.size, allocation: None };
        let bound = allocate(host, name, requirements, location, true).and_then(|allocation| {
            // SAFETY: memory of the buffer's own requirements, bound once, kept until the buffer is destroyed.
            let bound = unsafe { host.device.bind_buffer_memory(handle, allocation.memory, allocation.offset) };
            buffer.allocation = Some(allocation);
            bound.map_err(Error::vulkan(name))?;
            if usage.contains(vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER) {
                let format = vk::Format::R32G32B32A32_UINT;
                let view = vk::BufferViewCreateInfo::default().buffer(handle).format(format).range(vk::WHOLE_SIZE);
                // SAFETY: the buffer is bound to memory; the format is one that every device has for this.
                buffer.texels = unsafe { host.device.create_buffer_view(&view, None) }.map_err(Error::vulkan(name))?;
                host.set_name(buffer.texels, name);
            }
            Ok(())
        });
        if let Err(e) = bound {
            buffer.destroy(host);
            return Err(e);
        }
        host.set_name(handle, name);
        Ok(buffer)
    }

    /// The mapped memory; empty where the buffer is not the host's to write.
    pub fn mapped(&mut self) -> &mut [u8] {
        let Some(first) = self.allocation.as_ref().and_then(|a| a.mapped) else { return &mut [] };
        // SAFETY: so much is mapped (contract of `MemoryAllocator`) while the allocation is this buffer's, which is borrowed.
        unsafe { std::slice::from_raw_parts_mut(first.as_ptr(), self.bytes as usize) }
    }

    pub fn destroy(&mut self, host: &Host) {
        // SAFETY: callers destroy only what no frame in flight uses; null handles are allowed.
        unsafe {
            host.device.destroy_buffer_view(self.texels, None);
            host.device.destroy_buffer(self.handle, None);
        }
        free(host, &mut self.allocation);
    }
}

/// An image or a buffer.
pub(crate) enum Resource {
    Image(Image),
    Buffer(Buffer),
}

impl Resource {
    fn destroy(&mut self, host: &Host) {
        match self {
            Resource::Image(i) => i.destroy(host),
            Resource::Buffer(b) => b.destroy(host),
        }
    }
}

/// An image or a buffer, as it has to be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Spec {
    /// An image.
    Image(ImageSpec),
    /// A buffer of so many bytes in device memory.
    Buffer {
        /// Size.
        bytes: u64,
        /// Usage.
        usage: vk::BufferUsageFlags,
    },
}

/// Replaced resources, each with the number of the last frame that may use it.
#[derive(Default)]
pub(crate) struct Retired(Vec<(u64, Resource)>);

impl Retired {
    pub fn push(&mut self, last_frame: u64, resource: Resource) {
        self.0.push((last_frame, resource));
    }

    /// Destroys what only completed frames used: every frame up to and including `completed`.
    pub fn collect(&mut self, host: &Host, completed: u64) {
        self.0.retain_mut(|(last, resource)| {
            let keep = *last > completed;
            if !keep {
                resource.destroy(host);
            }
            keep
        });
    }
}
