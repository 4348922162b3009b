//! A device of wgpu's that has what meniscus needs.

use crate::Error;
use meniscus::{ash::vk, device};
use wgpu::hal::{api::Vulkan, vulkan};

/// The family of wgpu's one queue.
const FAMILY: u32 = 0;

/// Checks that meniscus can run on an adapter (wgpu's own: `adapter.as_hal::<wgpu::hal::api::Vulkan>()`); says what it lacks.
pub fn check(adapter: &vulkan::Adapter) -> Result<(), Error> {
    let instance = adapter.shared_instance();
    let version = instance.instance_api_version();
    if version < vk::API_VERSION_1_3 {
        return Err(Error::Loader(vk::api_version_major(version), vk::api_version_minor(version)));
    }
    Ok(device::check(instance.raw_instance(), adapter.raw_physical_device(), FAMILY)?)
}

/// Adds what meniscus needs to a device that is about to be created: for engines that open wgpu's device by themselves, in the
/// callback of `wgpu::hal::vulkan::Adapter::open_with_callback`. [`open`] does it for all others.
///
/// wgpu chains a structure for each feature, beside which Vulkan forbids the one of all of 1.3's
/// ([`meniscus::device::required_features`]). So these are such structures, too. wgpu reads them after the callback has
/// returned: they are kept as long as the program runs, some sixty bytes for each device.
pub fn enable(args: &mut vulkan::CreateDeviceCallbackArgs) {
    let needed = device::required_features();
    let rendering = vk::PhysicalDeviceDynamicRenderingFeatures {
        dynamic_rendering: needed.dynamic_rendering,
        ..Default::default()
    };
    let synchronization =
        vk::PhysicalDeviceSynchronization2Features { synchronization2: needed.synchronization2, ..Default::default() };
    *args.create_info =
        args.create_info.push_next(Box::leak(Box::new(rendering))).push_next(Box::leak(Box::new(synchronization)));
}

/// Opens a device, as `Adapter::request_device` does, with what meniscus needs beside what is asked for.
pub fn open(
    adapter: &wgpu::Adapter,
    descriptor: &wgpu::DeviceDescriptor,
) -> Result<(wgpu::Device, wgpu::Queue), Error> {
    // SAFETY: nothing of the adapter is destroyed; features are added, and only those that it has been checked for.
    unsafe {
        let other = || Error::NotVulkan(adapter.get_info().backend.to_str());
        let raw = adapter.as_hal::<Vulkan>().ok_or_else(other)?;
        check(&raw)?;
        let opened = raw.open_with_callback(
            descriptor.required_features,
            &descriptor.required_limits,
            &descriptor.memory_hints,
            Some(Box::new(|mut args| enable(&mut args))),
        )?;
        Ok(adapter.create_device_from_hal::<Vulkan>(opened, descriptor)?)
    }
}
