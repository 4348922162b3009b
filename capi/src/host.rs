//! The host's Vulkan, as C has it: handles, and where its functions are found.

use crate::{
    allocator::MeniscusAllocator,
    status::{Failure, MeniscusStatus, guard},
    versioned::{self, Versioned, read_some},
};
use renderer::{
    Host,
    allocator::MemoryAllocator,
    ash::{
        self,
        vk::{
            self, Bool32 as VkBool32, Device as VkDevice, Handle, Instance as VkInstance,
            PhysicalDevice as VkPhysicalDevice, PipelineCache as VkPipelineCache,
        },
    },
    device,
    gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc},
};
use std::{
    ffi::CStr,
    mem::offset_of,
    sync::{Arc, Mutex},
};

/// What the host lends a renderer. It keeps all of it alive until meniscus_renderer_destroy has returned, and destroys it
/// itself.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusHost {
    /// sizeof(MeniscusHost).
    pub struct_size: usize,
    /// vkGetInstanceProcAddr: of the loader, or of whatever the host calls Vulkan through.
    pub get_instance_proc_addr: PFN_vkGetInstanceProcAddr,
    /// Instance, created for Vulkan 1.3 (VkApplicationInfo::apiVersion).
    pub instance: VkInstance,
    /// A physical device of the instance.
    pub physical_device: VkPhysicalDevice,
    /// Its device, created with what meniscus_required_features turns on.
    pub device: VkDevice,
    /// Family of the queue that the command buffers go to: graphics and compute.
    pub queue_family: u32,
    /// How many recorded frames may be waiting to complete: frames in flight, times views a frame; 1 to 256. 0 stands for 1.
    pub frames_in_flight: u32,
    /// A cache for the renderer's pipelines, or VK_NULL_HANDLE.
    pub pipeline_cache: VkPipelineCache,
    /// VK_TRUE if the device was created with the feature largePoints. Without it everything is drawn as quads.
    pub large_points: VkBool32,
    /// VK_TRUE if the instance has VK_EXT_debug_utils enabled: then resources get names and passes labels.
    pub debug_utils: VkBool32,
    /// Where device memory comes from, read before the call returns; or null for an allocator of the renderer's own.
    pub allocator: *const MeniscusAllocator,
}

/// Null stands for none.
#[allow(non_camel_case_types)]
pub type PFN_vkGetInstanceProcAddr = Option<vk::PFN_vkGetInstanceProcAddr>;

// SAFETY: repr(C); its size first; no padding (a test adds it up); numbers, handles and pointers that may be null.
unsafe impl Versioned for MeniscusHost {
    const NAME: &'static str = "MeniscusHost";
    const LEAST: usize = offset_of!(MeniscusHost, pipeline_cache);
}

/// What is called of each level beyond Vulkan 1.0; an instance or device of an older version has none of them.
const INSTANCE_FUNCTIONS: &[&CStr] =
    &[c"vkGetDeviceProcAddr", c"vkEnumeratePhysicalDevices", c"vkGetPhysicalDeviceFeatures2"];
const DEVICE_FUNCTIONS: &[&CStr] = &[
    c"vkCmdBeginRendering",
    c"vkCmdEndRendering",
    c"vkCmdPipelineBarrier2",
    c"vkCmdSetDepthCompareOp",
    c"vkCmdWriteTimestamp2",
    c"vkGetDeviceBufferMemoryRequirements",
    c"vkGetDeviceImageMemoryRequirements",
];
const DEBUG_FUNCTIONS: &[&CStr] =
    &[c"vkSetDebugUtilsObjectNameEXT", c"vkCmdBeginDebugUtilsLabelEXT", c"vkCmdEndDebugUtilsLabelEXT"];

/// An instance, and that the physical device is one of it.
///
/// # Safety
/// The instance is alive or null; the function is its vkGetInstanceProcAddr.
unsafe fn instance(
    get: PFN_vkGetInstanceProcAddr,
    instance: VkInstance,
    physical: VkPhysicalDevice,
) -> Result<ash::Instance, Failure> {
    let Some(get_instance_proc_addr) = get else {
        return Err(Failure::argument("vkGetInstanceProcAddr is null: give the loader's"));
    };
    if instance.is_null() {
        return Err(Failure::parameter("the instance is VK_NULL_HANDLE: give one"));
    }
    for name in INSTANCE_FUNCTIONS {
        // SAFETY: this function's contract; the name ends with a 0.
        if unsafe { get_instance_proc_addr(instance, name.as_ptr()) }.is_none() {
            return Err(lacking("the instance", name, "create it for Vulkan 1.3: VkApplicationInfo::apiVersion"));
        }
    }
    // SAFETY: as above; what is called of it is there.
    unsafe {
        let instance = ash::Instance::load(&ash::StaticFn { get_instance_proc_addr }, instance);
        let all = instance.enumerate_physical_devices().map_err(|result| Failure {
            result,
            ..Failure::new(MeniscusStatus::ErrorVulkan, format!("physical devices: {result}"))
        })?;
        if !all.contains(&physical) {
            return Err(Failure::parameter("the physical device is none of the instance's: give one of them"));
        }
        Ok(instance)
    }
}

fn lacking(what: &str, function: &CStr, remedy: &str) -> Failure {
    let message = format!("{what} has no {}: {remedy}", function.to_string_lossy());
    Failure::new(MeniscusStatus::ErrorUnsupported, message)
}

/// An allocator for a renderer whose host has none.
fn own_allocator(
    instance: &ash::Instance,
    device: &ash::Device,
    physical_device: VkPhysicalDevice,
) -> Result<Allocator, Failure> {
    let description = AllocatorCreateDesc {
        instance: instance.clone(),
        device: device.clone(),
        physical_device,
        debug_settings: Default::default(),
        buffer_device_address: false,
        allocation_sizes: Default::default(),
    };
    Allocator::new(&description)
        .map_err(|e| Failure::new(MeniscusStatus::ErrorMemory, format!("the renderer's allocator: {e}")))
}

impl MeniscusHost {
    /// What the renderer borrows, with its allocator or one made for it.
    ///
    /// # Safety
    /// The handles are alive or null, and of each other; and as [`read_some`] for the allocator.
    pub(crate) unsafe fn borrow(&self) -> Result<Host, Failure> {
        let physical = self.physical_device;
        // SAFETY: this function's contract.
        let instance = unsafe { instance(self.get_instance_proc_addr, self.instance, physical) }?;
        if self.device.is_null() {
            return Err(Failure::parameter("the device is VK_NULL_HANDLE: give one"));
        }
        // Before anything is made for it.
        device::check(&instance, physical, self.queue_family)?;
        let has = |name: &CStr| {
            // SAFETY: as above; the name ends with a 0.
            unsafe { instance.get_device_proc_addr(self.device, name.as_ptr()) }.is_some()
        };
        if let Some(name) = DEVICE_FUNCTIONS.iter().find(|name| !has(name)) {
            return Err(lacking("the device", name, "create it and its instance for Vulkan 1.3"));
        }
        let named = self.debug_utils != 0;
        if let Some(name) = DEBUG_FUNCTIONS.iter().find(|name| named && !has(name)) {
            return Err(lacking(
                "the device",
                name,
                "enable VK_EXT_debug_utils on the instance, or leave debug_utils 0",
            ));
        }
        // SAFETY: as above; what is called of it is there.
        let device = unsafe { ash::Device::load(instance.fp_v1_0(), self.device) };
        // SAFETY: this function's contract.
        let allocator: Arc<dyn MemoryAllocator> = match unsafe { read_some(self.allocator) }? {
            Some(allocator) => Arc::new(allocator.get()?),
            None => Arc::new(Mutex::new(own_allocator(&instance, &device, physical)?)),
        };
        let mut host = Host::new(instance.clone(), device.clone(), physical, self.queue_family, allocator);
        host.frames_in_flight = self.frames_in_flight.max(1);
        host.large_points = self.large_points != 0;
        host.pipeline_cache = self.pipeline_cache;
        host.debug_utils = named.then(|| ash::ext::debug_utils::Device::new(&instance, &device));
        Ok(host)
    }
}

/// Checks that a physical device can render at all; the message says what it lacks. What has to be enabled on the device besides
/// says meniscus_required_features.
///
/// # Safety
/// `instance` is alive, and `get_instance_proc_addr` its vkGetInstanceProcAddr.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_check_device(
    get_instance_proc_addr: PFN_vkGetInstanceProcAddr,
    instance: VkInstance,
    physical_device: VkPhysicalDevice,
    queue_family: u32,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let instance = unsafe { self::instance(get_instance_proc_addr, instance, physical_device) }?;
        Ok(device::check(&instance, physical_device, queue_family)?)
    })
}

/// Turns on the features that a device has to be created with; the rest of the struct stays as it is, sType and pNext too.
///
/// # Safety
/// `features` is null, or a VkPhysicalDeviceVulkan13Features.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_required_features(features: *mut VkPhysicalDeviceVulkan13Features) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let features = unsafe { versioned::borrow_mut(features, "the features") }?;
        let needed = device::required_features();
        features.dynamic_rendering |= needed.dynamic_rendering;
        features.synchronization2 |= needed.synchronization2;
        Ok(())
    })
}

/// Without the lifetime of its pNext.
pub type VkPhysicalDeviceVulkan13Features = vk::PhysicalDeviceVulkan13Features<'static>;
