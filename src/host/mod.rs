//! A small Vulkan host: what the command line and the tests need to call the library as any engine
//! would. An engine has all of this already; only the feature `host` compiles it.

mod canvas;
mod session;
mod upload;
mod validation;

use crate::{Error, device, error::remedy};
use ash::vk;
pub use canvas::Canvas;
use gpu_allocator::{
    MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc},
};
pub use session::Session;
use std::sync::{Arc, Mutex};
pub use upload::Upload;
pub use validation::Messages;

/// Why there is no host.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// No loader.
    #[error("no Vulkan loader: {0}. Install libvulkan1 and a driver (mesa-vulkan-drivers renders on the CPU)")]
    Loader(ash::LoadingError),
    /// The loader is there, but no driver that it could load.
    #[error(
        "no Vulkan driver could be loaded ({result}){told}. Check that driver manifests are JSON and name libraries that \
         are there, unset what points elsewhere, or install mesa-vulkan-drivers, which renders on the CPU"
    )]
    NoDriver {
        /// What the loader answered.
        result: vk::Result,
        /// The variables that tell the loader where drivers are, as far as they are set.
        told: String,
    },
    /// No device, or none that is wanted.
    #[error(
        "no usable Vulkan device{wanted}: {found}. `meniscus info` lists devices; mesa-vulkan-drivers renders on the CPU"
    )]
    NoDevice {
        /// " named …", if one was asked for.
        wanted: String,
        /// What there is.
        found: String,
    },
    /// Validation was asked for and is not installed.
    #[error(
        "the validation layer VK_LAYER_KHRONOS_validation is not installed: install vulkan-validationlayers, or set VK_LAYER_PATH"
    )]
    NoValidation,
    /// A Vulkan call failed.
    #[error("{0}: {1}{remedy}", remedy = remedy(*.1))]
    Vulkan(&'static str, vk::Result),
    /// The renderer refused.
    #[error(transparent)]
    Renderer(#[from] Error),
    /// The allocator refused.
    #[error("device memory: {0}. Use a smaller size or fewer particles")]
    Memory(#[from] gpu_allocator::AllocationError),
}

/// Where the loader looks for drivers if these are set.
const DRIVER_VARIABLES: [&str; 3] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_ADD_DRIVER_FILES"];

/// A failure of the loader before there is an instance. Whatever it calls it (a manifest that is not JSON is "out of host
/// memory" to some loaders), nothing but drivers has been looked at by then.
fn no_driver(result: vk::Result) -> HostError {
    let set = DRIVER_VARIABLES.iter().filter_map(|name| {
        let value = std::env::var_os(name)?;
        Some(format!("{name} is \"{}\"", value.to_string_lossy()))
    });
    let told = set.collect::<Vec<_>>().join(", ");
    HostError::NoDriver { result, told: if told.is_empty() { told } else { format!("; {told}") } }
}

fn vulkan(what: &'static str) -> impl FnOnce(vk::Result) -> HostError {
    move |e| HostError::Vulkan(what, e)
}

/// What is known of a device before it is used.
#[derive(Clone, Debug)]
pub struct DeviceInfo {
    /// Device name.
    pub name: String,
    /// Driver name and version, as the driver words them.
    pub driver: String,
    /// "discrete GPU", "CPU", ….
    pub kind: &'static str,
    /// Vulkan version.
    pub api: String,
    /// Why meniscus cannot use it, if so.
    pub refusal: Option<String>,
    /// Largest point sprite.
    pub point_size: f32,
    /// Largest image edge.
    pub image_size: u32,
    /// Bytes of the largest heap of device memory.
    pub memory: u64,
    /// Whether passes can be timed.
    pub timestamps: bool,
    /// Whether large points are there.
    pub large_points: bool,
    /// Validation layers and other tools that are active and would spoil times.
    pub slowed_by: Vec<String>,
    rank: u32,
    handle: vk::PhysicalDevice,
    family: u32,
}

impl DeviceInfo {
    /// Name and driver. Two versions of one driver may name a device alike: this tells them apart.
    pub fn label(&self) -> String {
        format!("{}, {}", self.name, self.driver)
    }

    /// Whether [`DeviceInfo::label`] contains `wanted` (case does not matter).
    pub fn is_called(&self, wanted: &str) -> bool {
        self.label().to_lowercase().contains(&wanted.to_lowercase())
    }
}

/// An instance, with or without validation.
pub struct Instance {
    _entry: ash::Entry,
    handle: ash::Instance,
    debug: Option<ash::ext::debug_utils::Instance>,
    messenger: vk::DebugUtilsMessengerEXT,
    messages: Option<Box<Messages>>,
}

impl Instance {
    /// `validate`: core and synchronization validation, every message kept in [`Instance::messages`].
    pub fn new(validate: bool) -> Result<Instance, HostError> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers; that is what a Vulkan program does.
        let entry = unsafe { ash::Entry::load() }.map_err(HostError::Loader)?;
        // SAFETY: as above; no handles are involved yet.
        let (layers, extensions) = unsafe {
            (
                entry.enumerate_instance_layer_properties().map_err(no_driver)?,
                entry.enumerate_instance_extension_properties(None).map_err(no_driver)?,
            )
        };
        if validate && !layers.iter().any(|l| l.layer_name_as_c_str() == Ok(validation::LAYER)) {
            return Err(HostError::NoValidation);
        }
        let debug_extension = ash::ext::debug_utils::NAME;
        let debug = validate || extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(debug_extension));
        let mut extension_names = Vec::new();
        if debug {
            extension_names.push(debug_extension.as_ptr());
        }
        let mut layer_names = Vec::new();
        if validate {
            layer_names.push(validation::LAYER.as_ptr());
            extension_names.push(ash::ext::validation_features::NAME.as_ptr());
        }
        let app = vk::ApplicationInfo::default().application_name(c"meniscus").api_version(vk::API_VERSION_1_3);
        let messages = validate.then(Box::<Messages>::default);
        let mut features = validation::features();
        let mut messenger_info = messages.as_deref().map(validation::messenger_info);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&app)
            .enabled_extension_names(&extension_names)
            .enabled_layer_names(&layer_names);
        if let Some(m) = &mut messenger_info {
            info = info.push_next(&mut features).push_next(m);
        }
        // SAFETY: the info and all it points to outlive the call; the messages are boxed and outlive the instance.
        let handle = unsafe { entry.create_instance(&info, None) }.map_err(|e| match e {
            vk::Result::ERROR_LAYER_NOT_PRESENT | vk::Result::ERROR_EXTENSION_NOT_PRESENT => {
                HostError::Vulkan("instance", e)
            }
            e => no_driver(e),
        })?;
        let mut instance =
            Instance { debug: None, messenger: vk::DebugUtilsMessengerEXT::null(), messages, handle, _entry: entry };
        if debug {
            let utils = ash::ext::debug_utils::Instance::new(&instance._entry, &instance.handle);
            if let Some(m) = instance.messages.as_deref() {
                // SAFETY: as above.
                instance.messenger =
                    unsafe { utils.create_debug_utils_messenger(&validation::messenger_info(m), None) }
                        .map_err(vulkan("debug messenger"))?;
            }
            instance.debug = Some(utils);
        }
        Ok(instance)
    }

    /// Validation messages so far, oldest first; empty without validation.
    pub fn messages(&self) -> Vec<String> {
        self.messages.as_deref().map(Messages::all).unwrap_or_default()
    }

    /// The same, and forgets them.
    pub fn take_messages(&self) -> Vec<String> {
        self.messages.as_deref().map(Messages::take).unwrap_or_default()
    }

    /// Every device, best first.
    pub fn devices(&self) -> Result<Vec<DeviceInfo>, HostError> {
        // SAFETY: the instance is alive.
        let handles = unsafe { self.handle.enumerate_physical_devices() }.map_err(no_driver)?;
        let mut devices: Vec<_> = handles.into_iter().map(|h| self.describe(h)).collect();
        devices.sort_by_key(|d| d.rank);
        Ok(devices)
    }

    fn describe(&self, handle: vk::PhysicalDevice) -> DeviceInfo {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        // SAFETY: the physical device is this instance's; the chain lives on this stack frame.
        let (properties, features, families, memory) = unsafe {
            let properties = self.handle.get_physical_device_properties(handle);
            if properties.api_version >= vk::API_VERSION_1_2 {
                let mut properties2 = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
                self.handle.get_physical_device_properties2(handle, &mut properties2);
            }
            let features = self.handle.get_physical_device_features(handle);
            let families = self.handle.get_physical_device_queue_family_properties(handle);
            (properties, features, families, self.handle.get_physical_device_memory_properties(handle))
        };
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let family = families.iter().position(|f| f.queue_flags.contains(wanted)).unwrap_or(0) as u32;
        let (rank, kind) = match properties.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => (0, "discrete GPU"),
            vk::PhysicalDeviceType::INTEGRATED_GPU => (1, "integrated GPU"),
            vk::PhysicalDeviceType::VIRTUAL_GPU => (2, "virtual GPU"),
            vk::PhysicalDeviceType::CPU if driver.driver_id == vk::DriverId::MESA_LLVMPIPE => (3, "CPU"),
            vk::PhysicalDeviceType::CPU => (4, "CPU"),
            _ => (5, "other"),
        };
        let text = |s: Result<&std::ffi::CStr, _>| {
            s.map(|s: &std::ffi::CStr| s.to_string_lossy().into_owned()).unwrap_or_default()
        };
        let v = properties.api_version;
        DeviceInfo {
            name: device::name(&properties),
            driver: format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str()))
                .trim()
                .to_owned(),
            kind,
            api: format!("{}.{}.{}", vk::api_version_major(v), vk::api_version_minor(v), vk::api_version_patch(v)),
            refusal: device::check(&self.handle, handle, family).err().map(|e| e.to_string()),
            point_size: properties.limits.point_size_range[1],
            image_size: properties.limits.max_image_dimension2_d,
            memory: device::largest_heap(&memory),
            timestamps: families.get(family as usize).is_some_and(|f| f.timestamp_valid_bits > 0),
            large_points: features.large_points != 0,
            slowed_by: self.tools(handle, properties.api_version),
            rank,
            handle,
            family,
        }
    }

    /// Active tools that validate, trace or modify what is called.
    fn tools(&self, handle: vk::PhysicalDevice, api: u32) -> Vec<String> {
        if api < vk::API_VERSION_1_3 {
            return Vec::new();
        }
        // SAFETY: core in 1.3; the physical device is this instance's, and the slice is as long as was said.
        let tools = unsafe {
            let count = self.handle.get_physical_device_tool_properties_len(handle).unwrap_or(0);
            let mut tools = vec![vk::PhysicalDeviceToolProperties::default(); count];
            match self.handle.get_physical_device_tool_properties(handle, &mut tools) {
                Ok(()) => tools,
                Err(_) => Vec::new(),
            }
        };
        let spoils =
            vk::ToolPurposeFlags::VALIDATION | vk::ToolPurposeFlags::TRACING | vk::ToolPurposeFlags::MODIFYING_FEATURES;
        let named = |t: &vk::PhysicalDeviceToolProperties| {
            t.name_as_c_str().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
        };
        tools.iter().filter(|t| t.purposes.intersects(spoils)).map(named).collect()
    }

    /// The best device, or the first that [is called](DeviceInfo::is_called) `wanted`.
    pub fn pick(&self, wanted: Option<&str>) -> Result<DeviceInfo, HostError> {
        let devices = self.devices()?;
        let fits = |d: &&DeviceInfo| d.refusal.is_none() && wanted.is_none_or(|w| d.is_called(w));
        let found = || match devices
            .iter()
            .map(|d| d.refusal.clone().unwrap_or_else(|| d.label()))
            .collect::<Vec<_>>()
            .join("; ")
        {
            none if none.is_empty() => "there is none at all".to_owned(),
            some => format!("there is {some}"),
        };
        devices.iter().find(fits).cloned().ok_or_else(|| HostError::NoDevice {
            wanted: wanted.map(|w| format!(" named \"{w}\"")).unwrap_or_default(),
            found: found(),
        })
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: devices made from this instance borrow it and are gone by now.
        unsafe {
            if let Some(utils) = &self.debug {
                utils.destroy_debug_utils_messenger(self.messenger, None);
            }
            self.handle.destroy_instance(None);
        }
    }
}

/// A device with one queue, on which commands run and are waited for.
pub struct Gpu<'a> {
    instance: &'a Instance,
    /// The device that was chosen.
    pub info: DeviceInfo,
    /// Device handle.
    pub device: ash::Device,
    queue: vk::Queue,
    pool: vk::CommandPool,
    fence: vk::Fence,
    allocator: Option<Arc<Mutex<Allocator>>>,
    debug: Option<ash::ext::debug_utils::Device>,
}

impl<'a> Gpu<'a> {
    /// Makes a device with exactly what meniscus needs.
    pub fn new(instance: &'a Instance, info: DeviceInfo) -> Result<Gpu<'a>, HostError> {
        let mut features13 = device::required_features();
        let features = vk::PhysicalDeviceFeatures::default().large_points(info.large_points);
        let queue_info =
            [vk::DeviceQueueCreateInfo::default().queue_family_index(info.family).queue_priorities(&[1.0])];
        let create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queue_info)
            .enabled_features(&features)
            .push_next(&mut features13);
        // SAFETY: the physical device is this instance's; the info outlives the call.
        let device = unsafe { instance.handle.create_device(info.handle, &create, None) }.map_err(vulkan("device"))?;
        let mut gpu = Gpu {
            queue: vk::Queue::null(),
            pool: vk::CommandPool::null(),
            fence: vk::Fence::null(),
            allocator: None,
            debug: instance.debug.as_ref().map(|_| ash::ext::debug_utils::Device::new(&instance.handle, &device)),
            device,
            info,
            instance,
        };
        // SAFETY: the device is new; family and index 0 are those it was created with.
        unsafe {
            gpu.queue = gpu.device.get_device_queue(gpu.info.family, 0);
            let pool = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.info.family);
            gpu.pool = gpu.device.create_command_pool(&pool, None).map_err(vulkan("command pool"))?;
            gpu.fence = gpu.device.create_fence(&vk::FenceCreateInfo::default(), None).map_err(vulkan("fence"))?;
        }
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

    /// Records with `record`, submits and waits.
    pub fn run<T>(&self, record: impl FnOnce(vk::CommandBuffer) -> Result<T, HostError>) -> Result<T, HostError> {
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the pool is this device's and this object is not shared between threads (it is not Sync).
        let cmd = unsafe { self.device.allocate_command_buffers(&info) }.map_err(vulkan("command buffer"))?[0];
        let result = (|| {
            // SAFETY: the buffer is new.
            unsafe { self.device.begin_command_buffer(cmd, &begin) }.map_err(vulkan("command buffer"))?;
            let value = record(cmd)?;
            let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(cmd)];
            let submit = vk::SubmitInfo2::default().command_buffer_infos(&buffers);
            // SAFETY: recording has ended before submission; the fence is unsignalled and waited for here.
            unsafe {
                self.device.end_command_buffer(cmd).map_err(vulkan("command buffer"))?;
                self.device.queue_submit2(self.queue, &[submit], self.fence).map_err(vulkan("submission"))?;
                self.device.wait_for_fences(&[self.fence], true, u64::MAX).map_err(vulkan("frame"))?;
                self.device.reset_fences(&[self.fence]).map_err(vulkan("fence"))?;
            }
            Ok(value)
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

    fn allocate(
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

    fn free(&self, allocation: Allocation) {
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
            self.device.destroy_fence(self.fence, None);
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
        }
    }
}
