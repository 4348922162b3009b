//! A small Vulkan host: what the command line and the tests need to call the library as any engine
//! would. An engine has all of this already; only the feature `host` compiles it.

mod canvas;
mod gpu;
mod session;
mod tools;
mod upload;
mod validation;

use crate::{
    Error, Settings,
    device::{self, Limits},
    error::remedy,
    renderer::{Amount, check_amount},
};
use ash::vk;
pub use canvas::Canvas;
pub use gpu::Gpu;
pub use session::Session;
use std::ffi::CStr;
pub use tools::{Calibration, Stages};
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
    /// An extension of the instance is not there.
    #[error(
        "Vulkan here has no {0}, which a window needs: install libvulkan1 and a driver that presents (mesa-vulkan-drivers does)"
    )]
    NoExtension(String),
    /// A device counts nothing.
    #[error("{0} has no pipelineStatisticsQuery: choose another device (lavapipe counts)")]
    NoStatistics(String),
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
    limits: Limits,
}

impl DeviceInfo {
    /// The physical device, of the instance that listed it.
    pub fn handle(&self) -> vk::PhysicalDevice {
        self.handle
    }

    /// Refuses so many particles as no frame of this size and these settings can draw here: before they are prepared, which may take
    /// minutes, where [`crate::Renderer::set_particles`] and [`crate::Renderer::record`] would refuse them after it.
    pub fn check_amount(&self, size: [u32; 2], amount: Amount, settings: &Settings) -> Result<(), Error> {
        check_amount(&self.limits, size, amount, settings)
    }

    /// The queue family that is used: graphics and compute.
    pub fn family(&self) -> u32 {
        self.family
    }

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
    entry: ash::Entry,
    handle: ash::Instance,
    debug: Option<ash::ext::debug_utils::Instance>,
    messenger: vk::DebugUtilsMessengerEXT,
    messages: Option<Box<Messages>>,
}

impl Instance {
    /// `validate`: core and synchronization validation, every message kept in [`Instance::messages`].
    pub fn new(validate: bool) -> Result<Instance, HostError> {
        Instance::with(validate, &[])
    }

    /// The same with these extensions, for a host that presents.
    pub fn with(validate: bool, wanted: &[&CStr]) -> Result<Instance, HostError> {
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
        let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        if let Some(missing) = wanted.iter().find(|name| !has(name)) {
            return Err(HostError::NoExtension(missing.to_string_lossy().into_owned()));
        }
        let mut extension_names: Vec<_> = wanted.iter().map(|name| name.as_ptr()).collect();
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
            Instance { debug: None, messenger: vk::DebugUtilsMessengerEXT::null(), messages, handle, entry };
        if debug {
            let utils = ash::ext::debug_utils::Instance::new(&instance.entry, &instance.handle);
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

    /// The loader, and the instance: for surfaces.
    pub fn handles(&self) -> (&ash::Entry, &ash::Instance) {
        (&self.entry, &self.handle)
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
        let (properties, features, families) = unsafe {
            let properties = self.handle.get_physical_device_properties(handle);
            if properties.api_version >= vk::API_VERSION_1_2 {
                let mut properties2 = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
                self.handle.get_physical_device_properties2(handle, &mut properties2);
            }
            let features = self.handle.get_physical_device_features(handle);
            let families = self.handle.get_physical_device_queue_family_properties(handle);
            (properties, features, families)
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
        let large_points = features.large_points != 0;
        let limits = Limits::of(&self.handle, handle, family, large_points);
        let text = |s: Result<&CStr, _>| s.map(|s: &CStr| s.to_string_lossy().into_owned()).unwrap_or_default();
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
            memory: limits.memory,
            timestamps: limits.timestamp_period.is_some(),
            large_points,
            slowed_by: self.tools(handle, properties.api_version),
            rank,
            handle,
            family,
            limits,
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
