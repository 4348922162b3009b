//! A device with one queue.

use super::{
    DeviceInfo, HostError, Instance,
    tools::{Stages, Tools},
    vulkan,
};
use crate::{compiler, device};
use ash::vk;
use gpu_allocator::{
    MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc},
};
use std::{
    ffi::{CStr, c_char},
    sync::{Arc, Mutex},
    time::Instant,
};

/// A device with one queue, on which commands run and are waited for.
pub struct Gpu<'a> {
    instance: &'a Instance,
    /// The device that was chosen.
    pub info: DeviceInfo,
    /// Device handle.
    pub device: ash::Device,
    queue: vk::Queue,
    pool: vk::CommandPool,
    allocator: Option<Arc<Mutex<Allocator>>>,
    debug: Option<ash::ext::debug_utils::Device>,
    pub(super) tools: Tools,
}

/// Tells whether a device has an extension.
pub(super) fn extensions(instance: &Instance, info: &DeviceInfo) -> Result<impl Fn(&CStr) -> bool + use<>, HostError> {
    // SAFETY: the physical device is this instance's.
    let known = unsafe { instance.handle.enumerate_device_extension_properties(info.handle) };
    let known = known.map_err(vulkan("device extensions"))?;
    Ok(move |name: &CStr| known.iter().any(|e| e.extension_name_as_c_str() == Ok(name)))
}

impl<'a> Gpu<'a> {
    /// Makes a device with exactly what meniscus needs.
    pub fn new(instance: &'a Instance, info: DeviceInfo) -> Result<Gpu<'a>, HostError> {
        Gpu::with(instance, info, &[], vk::DeviceCreateInfo::default(), false)
    }

    /// A device that also tells what its compiler makes of pipelines: see [`crate::compiler`].
    pub fn telling(instance: &'a Instance, info: DeviceInfo) -> Result<Gpu<'a>, HostError> {
        let name = compiler::EXTENSION;
        if !extensions(instance, &info)?(name) {
            return Err(compiler::not_told(info.name).into());
        }
        let mut tells =
            vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
        Gpu::with(instance, info, &[name.as_ptr()], vk::DeviceCreateInfo::default().push_next(&mut tells), false)
    }

    /// A device that counts what pipelines do: see [`crate::inspect::Inspection::statistics`].
    pub fn counting(instance: &'a Instance, info: DeviceInfo) -> Result<Gpu<'a>, HostError> {
        // SAFETY: the physical device is this instance's.
        let features = unsafe { instance.handle.get_physical_device_features(info.handle) };
        if features.pipeline_statistics_query == vk::FALSE {
            return Err(HostError::NoStatistics(info.label()));
        }
        Gpu::with(instance, info, &[], vk::DeviceCreateInfo::default(), true)
    }

    /// A device that also presents to surfaces.
    pub fn presenting(instance: &'a Instance, info: DeviceInfo) -> Result<Gpu<'a>, HostError> {
        Gpu::with(instance, info, &[ash::khr::swapchain::NAME.as_ptr()], vk::DeviceCreateInfo::default(), false)
    }

    /// A device that also shares memory with others by file descriptors; none where the driver has no `VK_KHR_external_memory_fd`.
    pub fn importing(instance: &'a Instance, info: DeviceInfo) -> Result<Option<Gpu<'a>>, HostError> {
        let name = ash::khr::external_memory_fd::NAME;
        if !extensions(instance, &info)?(name) {
            return Ok(None);
        }
        Gpu::with(instance, info, &[name.as_ptr()], vk::DeviceCreateInfo::default(), false).map(Some)
    }

    pub(super) fn with(
        instance: &'a Instance,
        info: DeviceInfo,
        extensions: &[*const c_char],
        create: vk::DeviceCreateInfo,
        statistics: bool,
    ) -> Result<Gpu<'a>, HostError> {
        let mut features13 = device::required_features();
        let features =
            vk::PhysicalDeviceFeatures::default().large_points(info.large_points).pipeline_statistics_query(statistics);
        let queue_info =
            [vk::DeviceQueueCreateInfo::default().queue_family_index(info.family).queue_priorities(&[1.0])];
        let create = create
            .queue_create_infos(&queue_info)
            .enabled_extension_names(extensions)
            .enabled_features(&features)
            .push_next(&mut features13);
        // SAFETY: the physical device is this instance's; the info outlives the call.
        let device = unsafe { instance.handle.create_device(info.handle, &create, None) }.map_err(vulkan("device"))?;
        let mut gpu = Gpu {
            queue: vk::Queue::null(),
            pool: vk::CommandPool::null(),
            allocator: None,
            debug: instance.debug.as_ref().map(|_| ash::ext::debug_utils::Device::new(&instance.handle, &device)),
            tools: Tools::default(),
            device,
            info,
            instance,
        };
        // SAFETY: the device is new; family and index 0 are those it was created with.
        unsafe {
            gpu.queue = gpu.device.get_device_queue(gpu.info.family, 0);
            let pool = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.info.family);
            gpu.pool = gpu.device.create_command_pool(&pool, None).map_err(vulkan("command pool"))?;
        }
        gpu.set_name(gpu.pool, "commands");
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.handle.clone(),
            device: gpu.device.clone(),
            physical_device: gpu.info.handle,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })?;
        gpu.allocator = Some(Arc::new(Mutex::new(allocator)));
        Ok(gpu)
    }

    /// Its queue, for a host that submits by itself; not to be used from two threads at once.
    pub fn queue(&self) -> vk::Queue {
        self.queue
    }

    /// The instance that it is of.
    pub fn instance(&self) -> &'a Instance {
        self.instance
    }

    /// What is lent to a [`crate::Renderer`].
    pub fn host(&self, frames_in_flight: u32) -> crate::Host {
        crate::Host {
            instance: self.instance.handle.clone(),
            device: self.device.clone(),
            physical_device: self.info.handle,
            queue_family: self.info.family,
            allocator: self.allocator.clone().expect("made in new"),
            pipeline_cache: vk::PipelineCache::null(),
            frames_in_flight,
            large_points: self.info.large_points,
            debug_utils: self.debug.clone(),
        }
    }

    /// Gives an object a debug name, as the renderer gives its own.
    pub(super) fn set_name<H: vk::Handle>(&self, handle: H, role: &str) {
        device::set_name(self.debug.as_ref(), handle, role);
    }

    /// Records with `record`, submits and waits.
    pub fn run<T>(&self, record: impl FnOnce(vk::CommandBuffer) -> Result<T, HostError>) -> Result<T, HostError> {
        Ok(self.submit(None, record)?.0)
    }

    /// The same of all that a frame submits, or the last of it: its end is marked where the device offers that, and
    /// [`Gpu::stages`] says when what was done.
    pub fn run_frame<T>(&self, record: impl FnOnce(vk::CommandBuffer) -> Result<T, HostError>) -> Result<T, HostError> {
        let (value, stages) = self.submit(self.tools.end_of_frame(), record)?;
        self.tools.note(stages);
        Ok(value)
    }

    fn submit<T>(
        &self,
        boundary: Option<vk::FrameBoundaryEXT<'static>>,
        record: impl FnOnce(vk::CommandBuffer) -> Result<T, HostError>,
    ) -> Result<(T, Stages), HostError> {
        let began = Instant::now();
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the pool is this device's and this object is not shared between threads (it is not Sync).
        let cmd = unsafe { self.device.allocate_command_buffers(&info) }.map_err(vulkan("command buffer"))?[0];
        let result = (|| {
            // SAFETY: the buffer is new.
            unsafe { self.device.begin_command_buffer(cmd, &begin) }.map_err(vulkan("command buffer"))?;
            let value = record(cmd)?;
            let recorded = Instant::now();
            let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(cmd)];
            let mut submit = vk::SubmitInfo2::default().command_buffer_infos(&buffers);
            let mut boundary = boundary;
            if let Some(boundary) = &mut boundary {
                submit = submit.push_next(boundary);
            }
            let submitted;
            // SAFETY: recording has ended before submission; the fence is new, and waited for before it is destroyed.
            unsafe {
                self.device.end_command_buffer(cmd).map_err(vulkan("command buffer"))?;
                // Not kept: a device that runs nothing may have none.
                let fence = self.device.create_fence(&Default::default(), None).map_err(vulkan("fence"))?;
                let given = self.device.queue_submit2(self.queue, &[submit], fence).map_err(vulkan("submission"));
                submitted = Instant::now();
                let done =
                    given.and_then(|()| self.device.wait_for_fences(&[fence], true, u64::MAX).map_err(vulkan("frame")));
                self.device.destroy_fence(fence, None);
                done?;
            }
            Ok((value, Stages { begin: began, recorded, submitted, done: Instant::now() }))
        })();
        // SAFETY: it has completed, or was never submitted.
        unsafe { self.device.free_command_buffers(self.pool, &[cmd]) };
        result
    }

    /// Makes a readable buffer, lets `record` fill it, and returns its bytes.
    pub fn read_back(
        &self,
        bytes: u64,
        record: impl FnOnce(vk::CommandBuffer, vk::Buffer) -> Result<(), HostError>,
    ) -> Result<Vec<u8>, HostError> {
        let info = vk::BufferCreateInfo::default().size(bytes).usage(vk::BufferUsageFlags::TRANSFER_DST);
        // SAFETY: complete info on a live device.
        let buffer = unsafe { self.device.create_buffer(&info, None) }.map_err(vulkan("readback buffer"))?;
        // SAFETY: the buffer was just made.
        let requirements = unsafe { self.device.get_buffer_memory_requirements(buffer) };
        let result = self.allocate("readback", requirements, MemoryLocation::GpuToCpu, true).and_then(|allocation| {
            // SAFETY: memory of the buffer's own requirements.
            let bound = unsafe { self.device.bind_buffer_memory(buffer, allocation.memory(), allocation.offset()) };
            self.set_name(buffer, "readback");
            let run = bound.map_err(vulkan("readback buffer")).and_then(|()| {
                self.run(|cmd| {
                    record(cmd, buffer)?;
                    let visible = [vk::MemoryBarrier2::default()
                        .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                        .dst_stage_mask(vk::PipelineStageFlags2::HOST)
                        .dst_access_mask(vk::AccessFlags2::HOST_READ)];
                    // SAFETY: `cmd` is recording.
                    unsafe {
                        self.device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&visible))
                    };
                    Ok(())
                })
            });
            let data = run.map(|()| allocation.mapped_slice().unwrap_or_default()[..bytes as usize].to_vec());
            self.free(allocation);
            data
        });
        // SAFETY: nothing is in flight: `run` waited.
        unsafe { self.device.destroy_buffer(buffer, None) };
        result
    }

    pub(super) fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, HostError> {
        let desc = AllocationCreateDesc {
            name,
            requirements,
            location,
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let allocator = self.allocator.as_ref().expect("made in new");
        Ok(allocator.lock().unwrap_or_else(|e| e.into_inner()).allocate(&desc)?)
    }

    pub(super) fn free(&self, allocation: Allocation) {
        let allocator = self.allocator.as_ref().expect("made in new");
        // It came from this allocator; nothing could be done about a refusal.
        let _ = allocator.lock().unwrap_or_else(|e| e.into_inner()).free(allocation);
    }
}

impl Drop for Gpu<'_> {
    fn drop(&mut self) {
        self.allocator = None;
        // SAFETY: `run` waits, so nothing is in flight; images and renderers made here borrow this and are gone.
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
        }
    }
}
