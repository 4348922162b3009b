//! What the validation layer says of all that wgpu and meniscus do, word for word: wgpu's own listener leaves some of it out.

use meniscus_wgpu::meniscus::ash::{self, vk};
use std::{
    ffi::{CStr, c_void},
    sync::Mutex,
};
use wgpu::hal::{api::Vulkan, vulkan};

pub struct Validation {
    utils: ash::ext::debug_utils::Instance,
    messenger: vk::DebugUtilsMessengerEXT,
    messages: Box<Mutex<Vec<String>>>,
    // Last: the messenger is of it.
    _instance: wgpu::Instance,
}

impl Validation {
    /// An instance under core and synchronization validation, and a listener to it. wgpu's flag `DEBUG` would have it listen
    /// by itself, but also say in shaders that they were WGSL, which layers of 2023 do not know yet.
    pub fn instance() -> Result<(wgpu::Instance, Validation), Box<dyn std::error::Error>> {
        use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
        let descriptor = wgpu::hal::InstanceDescriptor {
            name: "engine",
            flags: wgpu::InstanceFlags::VALIDATION,
            memory_budget_thresholds: Default::default(),
            backend_options: Default::default(),
            telemetry: None,
            display: None,
        };
        // SAFETY: an extension is added, that the validation layer has; the instance is kept alive beside what is made of it; the
        // messages are boxed, and outlive the messenger.
        unsafe {
            let listen = |args: vulkan::CreateInstanceCallbackArgs| args.extensions.push(ash::ext::debug_utils::NAME);
            let raw = vulkan::Instance::init_with_callback(&descriptor, Some(Box::new(listen)))?;
            let instance = wgpu::Instance::from_hal::<Vulkan>(raw);
            let raw = instance.as_hal::<Vulkan>().ok_or("no Vulkan loader: install libvulkan1")?.shared_instance();
            // Where there is none, wgpu goes on without.
            let layers = raw.entry().enumerate_instance_layer_properties()?;
            if !layers.iter().any(|l| l.layer_name_as_c_str() == Ok(c"VK_LAYER_KHRONOS_validation")) {
                return Err("no validation layer: install vulkan-validationlayers, or set VK_LAYER_PATH".into());
            }
            let messages = Box::<Mutex<Vec<String>>>::default();
            let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
                .message_severity(Severity::WARNING | Severity::ERROR)
                .message_type(Type::VALIDATION)
                .pfn_user_callback(Some(said))
                .user_data(std::ptr::from_ref(&*messages).cast_mut().cast());
            let utils = ash::ext::debug_utils::Instance::new(raw.entry(), raw.raw_instance());
            let messenger = utils.create_debug_utils_messenger(&info, None)?;
            let validation = Validation { utils, messenger, messages, _instance: instance.clone() };
            Ok((instance, validation))
        }
    }

    /// All that was said.
    pub fn end(self) -> Vec<String> {
        // SAFETY: made in `new`, destroyed once.
        unsafe { self.utils.destroy_debug_utils_messenger(self.messenger, None) };
        std::mem::take(&mut *self.messages.lock().unwrap_or_else(|e| e.into_inner()))
    }
}

unsafe extern "system" fn said(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: `user` is the boxed messages, which outlive the messenger; the layer passes valid data.
    let (messages, text) = unsafe {
        let text = (*data).p_message;
        let text = if text.is_null() { "(no text)".into() } else { CStr::from_ptr(text).to_string_lossy() };
        (&*user.cast::<Mutex<Vec<String>>>(), text.into_owned())
    };
    messages.lock().unwrap_or_else(|e| e.into_inner()).push(text);
    vk::FALSE
}
