//! A buffer that the host fills and shaders read, as an engine's simulation would leave it.

use super::{Gpu, HostError, vulkan};
use ash::vk;
use gpu_allocator::{MemoryLocation, vulkan::Allocation};

/// A storage buffer in memory that the host writes and the device reads.
pub struct Upload<'a> {
    gpu: &'a Gpu<'a>,
    /// Handle, with usage `STORAGE_BUFFER` and `TRANSFER_SRC`.
    pub buffer: vk::Buffer,
    allocation: Option<Allocation>,
}

impl<'a> Upload<'a> {
    /// A buffer with this content, at least four bytes.
    pub fn new(gpu: &'a Gpu<'a>, bytes: &[u8]) -> Result<Upload<'a>, HostError> {
        let size = bytes.len().max(4) as u64;
        let info = vk::BufferCreateInfo::default()
            .size(size)
            .usage(vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC);
        // SAFETY: complete info on a live device.
        let buffer = unsafe { gpu.device.create_buffer(&info, None) }.map_err(vulkan("upload"))?;
        let mut upload = Upload { gpu, buffer, allocation: None };
        // SAFETY: the buffer was just made; its memory is kept until it is destroyed.
        unsafe {
            let requirements = gpu.device.get_buffer_memory_requirements(buffer);
            let mut allocation = gpu.allocate("upload", requirements, MemoryLocation::CpuToGpu, true)?;
            if let Some(mapped) = allocation.mapped_slice_mut() {
                mapped[..bytes.len()].copy_from_slice(bytes);
            }
            let bound = gpu.device.bind_buffer_memory(buffer, allocation.memory(), allocation.offset());
            upload.allocation = Some(allocation);
            bound.map_err(vulkan("upload"))?;
        }
        gpu.set_name(buffer, "upload");
        Ok(upload)
    }
}

impl Drop for Upload<'_> {
    fn drop(&mut self) {
        // SAFETY: `Gpu::run` waits, so nothing is in flight.
        unsafe { self.gpu.device.destroy_buffer(self.buffer, None) };
        if let Some(allocation) = self.allocation.take() {
            self.gpu.free(allocation);
        }
    }
}
