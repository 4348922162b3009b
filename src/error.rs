//! What can go wrong, and what to do about it.

use ash::vk;

/// Errors of the renderer. Each names the pass, resource or parameter, and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The device lacks something every frame needs.
    #[error(
        "device {device}: {missing} is missing; meniscus needs it. Pick another device, or enable it when the device is created"
    )]
    Unsupported {
        /// Device name.
        device: String,
        /// Feature, format, limit or queue capability.
        missing: String,
    },
    /// A Vulkan call failed.
    #[error("{what}: {result}{remedy}", remedy = remedy(*result))]
    Vulkan {
        /// What was being made or recorded.
        what: String,
        /// Result code.
        result: vk::Result,
    },
    /// Memory could not be had.
    #[error("{resource} needs {bytes} bytes of device memory: {source}. Use a smaller size or fewer particles")]
    Memory {
        /// Resource name.
        resource: String,
        /// Size asked for.
        bytes: u64,
        /// The allocator's reason.
        source: crate::allocator::Refusal,
    },
    /// More memory than the device has; nothing was allocated.
    #[error(
        "a frame of this size with so many particles needs {needed} bytes of device memory; the device has {available}, \
         so {missing} are missing. Use fewer particles or a smaller size"
    )]
    MemoryShort {
        /// Bytes that everything together would take.
        needed: u64,
        /// Bytes of the largest device-local heap.
        available: u64,
        /// The difference.
        missing: u64,
    },
    /// A parameter is outside its range.
    #[error("{parameter} is {value}: {remedy}")]
    Parameter {
        /// Parameter name.
        parameter: &'static str,
        /// Offending value.
        value: String,
        /// Allowed range, or what to do.
        remedy: String,
    },
    /// A pass declares what cannot be: a mistake in this library, and none in the call.
    #[error("pass {pass}: {problem}. This is a mistake in meniscus: please report it")]
    Pass {
        /// Name of the pass.
        pass: &'static str,
        /// What does not fit.
        problem: String,
    },
    /// The caller broke the order of calls.
    #[error("{0}")]
    Order(&'static str),
}

/// What to do about a Vulkan call that failed.
pub(crate) fn remedy(result: vk::Result) -> &'static str {
    match result {
        vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
            ". Use a smaller size or fewer particles"
        }
        vk::Result::ERROR_DEVICE_LOST => {
            ". The driver gave up, or the frame took longer than the system allows: use a smaller size, fewer particles \
             or another device"
        }
        vk::Result::ERROR_LAYER_NOT_PRESENT | vk::Result::ERROR_EXTENSION_NOT_PRESENT => {
            ". Unset VK_INSTANCE_LAYERS and VK_LOADER_LAYERS_ENABLE, or install what they name"
        }
        _ => ". Try another device or a newer driver",
    }
}

impl Error {
    pub(crate) fn vulkan(what: impl Into<String>) -> impl FnOnce(vk::Result) -> Error {
        let what = what.into();
        move |result| Error::Vulkan { what, result }
    }

    pub(crate) fn parameter(parameter: &'static str, value: impl ToString, remedy: impl Into<String>) -> Error {
        Error::Parameter { parameter, value: value.to_string(), remedy: remedy.into() }
    }
}
