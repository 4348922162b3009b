//! Core and synchronization validation, with every message kept.

use ash::vk;
use std::{
    ffi::{CStr, c_void},
    sync::Mutex,
};

pub const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What the validation layer said (warnings and errors).
#[derive(Default)]
pub struct Messages(Mutex<Vec<String>>);

impl Messages {
    /// All so far, oldest first.
    pub fn all(&self) -> Vec<String> {
        self.0.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }

    /// All so far, which are then forgotten.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(|e| e.into_inner()))
    }
}

const ENABLE: &[vk::ValidationFeatureEnableEXT] = &[vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];

pub fn features() -> vk::ValidationFeaturesEXT<'static> {
    vk::ValidationFeaturesEXT::default().enabled_validation_features(ENABLE)
}

pub fn messenger_info(messages: &Messages) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION | Type::PERFORMANCE)
        .pfn_user_callback(Some(callback))
        .user_data(std::ptr::from_ref(messages).cast_mut().cast())
}

unsafe extern "system" fn callback(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: `user` is the boxed `Messages` that outlives the instance; the layer passes valid callback data.
    let (messages, text) = unsafe {
        let data = &*data;
        let text = if data.p_message.is_null() {
            "(no text)".into()
        } else {
            CStr::from_ptr(data.p_message).to_string_lossy().into_owned()
        };
        (&*user.cast::<Messages>(), text)
    };
    if let Ok(mut all) = messages.0.lock() {
        all.push(format!("{severity:?}: {text}"));
    }
    vk::FALSE
}
