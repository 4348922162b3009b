//! The host's device, borrowed, and what it has to be able to do.

use crate::{Error, allocator::MemoryAllocator};
use ash::vk;
use std::sync::Arc;

/// What the host lends. Handles are cloned function tables: the host keeps the device alive until the
/// [`crate::Renderer`] is gone, and destroys it itself.
#[derive(Clone)]
#[non_exhaustive]
pub struct Host {
    /// Instance, Vulkan 1.3.
    pub instance: ash::Instance,
    /// Device, created with `dynamicRendering` and `synchronization2`.
    pub device: ash::Device,
    /// The device's physical device.
    pub physical_device: vk::PhysicalDevice,
    /// Family of the queue that the command buffers go to: graphics and compute.
    pub queue_family: u32,
    /// The host's allocator, shared: a mutex around `gpu-allocator`'s, or whatever gives device memory.
    pub allocator: Arc<dyn MemoryAllocator>,
    /// How many calls of [`crate::Renderer::record`] may be waiting for their frames to complete: frames in flight, times
    /// views a frame; 1 to 256.
    pub frames_in_flight: u32,
    /// Whether the device was created with the `largePoints` feature. Without it everything is drawn as quads.
    pub large_points: bool,
    /// A cache for the renderer's pipelines; null for none. It is the host's to load, to save and to destroy, and has to
    /// outlive the renderer.
    pub pipeline_cache: vk::PipelineCache,
    /// `VK_EXT_debug_utils`, if the instance has it: names resources and labels passes.
    pub debug_utils: Option<ash::ext::debug_utils::Device>,
}

impl Host {
    /// What every host has to lend: see the fields. One frame in flight, no large points, no cache, no names.
    pub fn new(
        instance: ash::Instance,
        device: ash::Device,
        physical_device: vk::PhysicalDevice,
        queue_family: u32,
        allocator: Arc<dyn MemoryAllocator>,
    ) -> Host {
        Host {
            instance,
            device,
            physical_device,
            queue_family,
            allocator,
            frames_in_flight: 1,
            large_points: false,
            pipeline_cache: vk::PipelineCache::null(),
            debug_utils: None,
        }
    }
}

/// Formats of the renderer's own targets, with what each must support.
const FORMATS: &[(vk::Format, vk::FormatFeatureFlags, &str)] = &[
    (vk::Format::R32_SFLOAT, MAP_FEATURES, "R32_SFLOAT as colour attachment, sampled and storage image"),
    (vk::Format::R32_UINT, MAP_FEATURES, "R32_UINT as colour attachment, sampled and storage image"),
    (vk::Format::D32_SFLOAT, vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT, "D32_SFLOAT as depth attachment"),
    (vk::Format::R32G32B32A32_SFLOAT, vk::FormatFeatureFlags::SAMPLED_IMAGE, "R32G32B32A32_SFLOAT as sampled image"),
    (vk::Format::R32G32B32A32_UINT, vk::FormatFeatureFlags::SAMPLED_IMAGE, "R32G32B32A32_UINT as sampled image"),
];
const MAP_FEATURES: vk::FormatFeatureFlags = vk::FormatFeatureFlags::from_raw(
    vk::FormatFeatureFlags::COLOR_ATTACHMENT.as_raw()
        | vk::FormatFeatureFlags::SAMPLED_IMAGE.as_raw()
        | vk::FormatFeatureFlags::STORAGE_IMAGE.as_raw(),
);

/// Limits and options of the device that passes ask about.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Largest point sprite in pixels; 1 where large points are off.
    pub point_size: f32,
    /// Largest image edge.
    pub image_size: u32,
    /// Nanoseconds per timestamp tick; `None` where the queue cannot write timestamps.
    pub timestamp_period: Option<f32>,
    /// Valid bits of a timestamp.
    pub timestamp_mask: u64,
    /// Largest storage buffer in bytes.
    pub storage_size: u64,
    /// Largest texel buffer in bytes, four words a texel.
    pub texels_size: u64,
    /// Largest device-local heap in bytes.
    pub memory: u64,
    /// Whether it is a CPU.
    pub cpu: bool,
}

/// Checks that a physical device can render at all; lists the first thing it lacks. What must also be *enabled* on
/// the device cannot be queried, only asked for: see [`required_features`].
pub fn check(instance: &ash::Instance, physical: vk::PhysicalDevice, family: u32) -> Result<(), Error> {
    // SAFETY: the physical device comes from this instance, which the caller keeps alive.
    let properties = unsafe { instance.get_physical_device_properties(physical) };
    let device = name(&properties);
    let fail = |missing: &str| Err(Error::Unsupported { device: device.clone(), missing: missing.into() });
    if properties.api_version < vk::API_VERSION_1_3 {
        return fail("Vulkan 1.3");
    }
    let mut features13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut features13);
    // SAFETY: as above; the chain lives on this stack frame.
    unsafe { instance.get_physical_device_features2(physical, &mut features) };
    if features13.dynamic_rendering == 0 {
        return fail("the feature dynamicRendering");
    }
    if features13.synchronization2 == 0 {
        return fail("the feature synchronization2");
    }
    // SAFETY: as above.
    let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    if !families.get(family as usize).is_some_and(|f| f.queue_flags.contains(wanted)) {
        return fail("a queue family with graphics and compute");
    }
    for (format, wanted, what) in FORMATS {
        // SAFETY: as above.
        let p = unsafe { instance.get_physical_device_format_properties(physical, *format) };
        if !p.optimal_tiling_features.contains(*wanted) {
            return fail(what);
        }
    }
    Ok(())
}

/// The features to enable when the device is created: chain this into `VkDeviceCreateInfo`.
pub fn required_features() -> vk::PhysicalDeviceVulkan13Features<'static> {
    vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true)
}

/// A device's name.
pub(crate) fn name(properties: &vk::PhysicalDeviceProperties) -> String {
    properties.device_name_as_c_str().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Bytes of the largest device-local heap.
fn largest_heap(memory: &vk::PhysicalDeviceMemoryProperties) -> u64 {
    let local = memory.memory_heaps_as_slice().iter().filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
    local.map(|h| h.size).max().unwrap_or(0)
}

impl Limits {
    /// What a physical device says. It has to be the instance's.
    pub fn of(
        instance: &ash::Instance,
        physical_device: vk::PhysicalDevice,
        family: u32,
        large_points: bool,
    ) -> Limits {
        // SAFETY: the caller keeps the instance alive, and the physical device is its own.
        let (properties, families) = unsafe {
            (
                instance.get_physical_device_properties(physical_device),
                instance.get_physical_device_queue_family_properties(physical_device),
            )
        };
        // SAFETY: as above.
        let memory = unsafe { instance.get_physical_device_memory_properties(physical_device) };
        let bits = families.get(family as usize).map_or(0, |f| f.timestamp_valid_bits);
        Limits {
            point_size: if large_points { properties.limits.point_size_range[1] } else { 1.0 },
            image_size: properties.limits.max_image_dimension2_d.min(properties.limits.max_framebuffer_width),
            timestamp_period: (bits > 0).then_some(properties.limits.timestamp_period),
            timestamp_mask: if bits >= 64 { u64::MAX } else { (1u64 << bits) - 1 },
            storage_size: u64::from(properties.limits.max_storage_buffer_range),
            texels_size: 16 * u64::from(properties.limits.max_texel_buffer_elements),
            memory: largest_heap(&memory),
            cpu: properties.device_type == vk::PhysicalDeviceType::CPU,
        }
    }
}

impl Host {
    pub(crate) fn limits(&self) -> Limits {
        Limits::of(&self.instance, self.physical_device, self.queue_family, self.large_points)
    }

    /// Checks that a format can be a colour attachment, with blending if that is asked for.
    pub(crate) fn check_attachment(&self, format: vk::Format, blends: bool) -> Result<(), Error> {
        match blends {
            true => {
                self.check_format(format, vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND, "blended colour attachment")
            }
            false => self.check_format(format, vk::FormatFeatureFlags::COLOR_ATTACHMENT, "colour attachment"),
        }
    }

    /// Checks that a format can be a depth attachment.
    pub(crate) fn check_depth(&self, format: vk::Format) -> Result<(), Error> {
        self.check_format(format, vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT, "depth attachment")
    }

    fn check_format(&self, format: vk::Format, wanted: vk::FormatFeatureFlags, what: &str) -> Result<(), Error> {
        // SAFETY: `Host` promises a live instance and a physical device of it.
        let p = unsafe { self.instance.get_physical_device_format_properties(self.physical_device, format) };
        if p.optimal_tiling_features.contains(wanted) {
            return Ok(());
        }
        // SAFETY: as above.
        let properties = unsafe { self.instance.get_physical_device_properties(self.physical_device) };
        Err(Error::Unsupported { device: name(&properties), missing: format!("{format:?} as {what}") })
    }

    /// Gives an object a debug name: "meniscus <role>".
    pub(crate) fn set_name<H: vk::Handle>(&self, handle: H, role: &str) {
        set_name(self.debug_utils.as_ref(), handle, role);
    }
}

/// Gives an object that was just made a debug name: "meniscus <role>".
pub(crate) fn set_name<H: vk::Handle>(utils: Option<&ash::ext::debug_utils::Device>, handle: H, role: &str) {
    if let Some(utils) = utils {
        let name = std::ffi::CString::new(format!("meniscus {role}")).unwrap_or_default();
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle was just made from this device. A name that cannot be set is no error.
        let _ = unsafe { utils.set_debug_utils_object_name(&info) };
    }
}

/// No device asks for more alignment of a storage buffer's offset.
pub(crate) const BINDING_ALIGNMENT: u64 = 256;

/// What is bound of a host's buffer that has so many bytes for each of one or more particles: from where on, and how much.
pub(crate) fn bound(buffer: vk::Buffer, offset: u64, stride: u64, bytes: u64, count: u32) -> (vk::Buffer, u64, u64) {
    let begin = offset % BINDING_ALIGNMENT;
    (buffer, offset - begin, begin + stride * u64::from(count - 1) + bytes)
}
