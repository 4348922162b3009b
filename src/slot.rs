//! What belongs to one of the frames in flight.

use crate::{Error, allocator::Location, device::Host, plan::Plan, profile::Profiler, resources::Buffer, scale};
use ash::vk;

/// What belongs to one of the frames in flight.
pub(crate) struct Slot {
    pub profiler: Option<Profiler>,
    /// Of a frame that was asked for them.
    #[cfg(feature = "inspect")]
    pub statistics: Option<crate::statistics::Statistics>,
    pub pool: vk::DescriptorPool,
    /// Sets, and descriptors of each type, that the pool holds.
    room: (u32, Vec<(vk::DescriptorType, u32)>),
    /// The frame's block for each scale.
    pub frame_block: Buffer,
    /// Number of the frame last recorded into this slot; 0: none yet.
    pub frame: u64,
}

impl Slot {
    pub fn new(host: &Host) -> Result<Slot, Error> {
        // The extent pass completes it where positions are prepared on the device.
        let usage = vk::BufferUsageFlags::UNIFORM_BUFFER | vk::BufferUsageFlags::STORAGE_BUFFER;
        let frame_block = Buffer::new(host, "frame block", scale::BLOCKS, usage, Location::Upload)?;
        let pool = vk::DescriptorPool::null();
        Ok(Slot {
            profiler: Profiler::new(host),
            #[cfg(feature = "inspect")]
            statistics: None,
            pool,
            room: (0, Vec::new()),
            frame_block,
            frame: 0,
        })
    }

    /// Counts what the plan's passes do, if `counting`; the slot's last frame has completed.
    #[cfg(feature = "inspect")]
    pub fn count(&mut self, host: &Host, plan: &Plan, counting: bool) -> Result<(), Error> {
        if let Some(mut last) = self.statistics.take() {
            last.destroy(&host.device);
        }
        if counting && plan.scopes() > 0 {
            self.statistics = Some(crate::statistics::Statistics::new(host, plan.scopes())?);
        }
        Ok(())
    }

    /// Makes room for a plan's descriptor sets and timestamps; the slot's last frame has completed.
    pub fn fit(&mut self, host: &Host, plan: &Plan) -> Result<(), Error> {
        if let Some(p) = &mut self.profiler {
            p.fit(host, plan.scopes())?;
        }
        let (sets, mut counts) = plan.descriptors();
        if sets == 0 {
            return Ok(());
        }
        let had = |ty| self.room.1.iter().find(|(t, _)| *t == ty).map_or(0, |(_, n)| *n);
        if sets <= self.room.0 && counts.iter().all(|(ty, count)| *count <= had(*ty)) {
            // SAFETY: no set of this slot is in use any more.
            return unsafe { host.device.reset_descriptor_pool(self.pool, vk::DescriptorPoolResetFlags::empty()) }
                .map_err(Error::vulkan("descriptor pool"));
        }
        // As much as before at least: plans that take turns find room.
        let sets = sets.max(self.room.0);
        for (ty, had) in &self.room.1 {
            match counts.iter_mut().find(|(t, _)| t == ty) {
                Some((_, count)) => *count = (*count).max(*had),
                None => counts.push((*ty, *had)),
            }
        }
        let sizes: Vec<_> =
            counts.iter().map(|(ty, count)| vk::DescriptorPoolSize { ty: *ty, descriptor_count: *count }).collect();
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(sets).pool_sizes(&sizes);
        // SAFETY: complete info on a live device; no set of the old pool is in use any more.
        unsafe {
            let pool = host.device.create_descriptor_pool(&info, None).map_err(Error::vulkan("descriptor pool"))?;
            host.device.destroy_descriptor_pool(self.pool, None);
            self.pool = pool;
        }
        host.set_name(self.pool, "descriptor sets");
        self.room = (sets, counts);
        Ok(())
    }

    /// Destroys it; its last frame has completed.
    pub fn destroy(&mut self, host: &Host) {
        self.frame_block.destroy(host);
        // SAFETY: no set of the pool is in use any more.
        unsafe { host.device.destroy_descriptor_pool(self.pool, None) };
        if let Some(p) = &mut self.profiler {
            p.destroy(&host.device);
        }
        #[cfg(feature = "inspect")]
        if let Some(s) = &mut self.statistics {
            s.destroy(&host.device);
        }
    }
}
