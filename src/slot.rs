//! What belongs to one of the frames in flight.

use crate::{Error, device::Host, profile::Profiler, resources::Buffer, shader, targets::Id};
use ash::vk;
use gpu_allocator::MemoryLocation;

/// What belongs to one of the frames in flight.
pub(crate) struct Slot {
    pub profiler: Option<Profiler>,
    pub pool: vk::DescriptorPool,
    pub frame_block: Buffer,
    /// Number of the frame last recorded into this slot; 0: none yet.
    pub frame: u64,
}

/// Descriptor sets of one frame: 20 iterations of smoothing, 60 steps of the sort and two dozen others.
const SETS: u32 = 128;

impl Slot {
    pub fn new(host: &Host) -> Result<Slot, Error> {
        let size = |ty, count| vk::DescriptorPoolSize { ty, descriptor_count: count * SETS };
        let sizes = [
            size(vk::DescriptorType::UNIFORM_BUFFER, 1),
            size(vk::DescriptorType::STORAGE_BUFFER, 8),
            size(vk::DescriptorType::SAMPLED_IMAGE, 8),
            size(vk::DescriptorType::STORAGE_IMAGE, 1),
            size(vk::DescriptorType::SAMPLER, 1),
        ];
        // The extent pass completes it where positions are prepared on the device.
        let usage = vk::BufferUsageFlags::UNIFORM_BUFFER | vk::BufferUsageFlags::STORAGE_BUFFER;
        let mut frame_block = Buffer::new(
            host,
            Id::FrameBlock.name(),
            size_of::<shader::Frame>() as u64,
            usage,
            MemoryLocation::CpuToGpu,
        )?;
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(SETS).pool_sizes(&sizes);
        // SAFETY: complete info on a live device.
        let pool = match unsafe { host.device.create_descriptor_pool(&info, None) } {
            Ok(pool) => pool,
            Err(e) => {
                frame_block.destroy(host);
                return Err(Error::vulkan("descriptor pool")(e));
            }
        };
        match Profiler::new(host) {
            Ok(profiler) => Ok(Slot { profiler, pool, frame_block, frame: 0 }),
            Err(e) => {
                frame_block.destroy(host);
                // SAFETY: just made, never used.
                unsafe { host.device.destroy_descriptor_pool(pool, None) };
                Err(e)
            }
        }
    }

    /// Destroys it; its last frame has completed.
    pub fn destroy(&mut self, host: &Host) {
        self.frame_block.destroy(host);
        // SAFETY: no set of the pool is in use any more.
        unsafe { host.device.destroy_descriptor_pool(self.pool, None) };
        if let Some(p) = &mut self.profiler {
            p.destroy(&host.device);
        }
    }
}
