//! How a call ended, and what it has to say.

use crate::text;
use renderer::{Error, ash::vk::Result as VkResult, prepare::PrepareError};
use std::{
    any::Any,
    cell::RefCell,
    ffi::{c_char, c_int},
    panic::{AssertUnwindSafe, catch_unwind},
};

/// How a call ended. Numbers never change; there may be more of them in later versions: errors are below 0.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(dead_code)] // one of them is only for errors that come with later versions
pub enum MeniscusStatus {
    /// Done.
    Ok = 0,
    /// Not there yet: ask again later. No error.
    NotReady = 1,
    /// The device lacks something that every frame needs.
    ErrorUnsupported = -1,
    /// A Vulkan call failed: see meniscus_last_vk_result.
    ErrorVulkan = -2,
    /// Device memory could not be had.
    ErrorMemory = -3,
    /// The frame takes more memory than the device has; nothing was allocated.
    ErrorMemoryShort = -4,
    /// A parameter, size, count, handle or name is not what it has to be.
    ErrorParameter = -5,
    /// A pass declares what cannot be: a mistake in meniscus. Please report it.
    ErrorPass = -6,
    /// Calls came in an order that cannot be.
    ErrorOrder = -7,
    /// What was given is no proper argument: a null pointer, a struct's size, text that is not UTF-8.
    ErrorArgument = -8,
    /// meniscus panicked: a mistake in it. Please report it. The object is good for nothing but to be destroyed.
    ErrorPanic = -9,
    /// Another error; its message says which.
    ErrorOther = -10,
}

/// An error on its way to C.
#[derive(Debug)]
pub(crate) struct Failure {
    pub status: MeniscusStatus,
    pub message: String,
    pub result: VkResult,
}

impl Failure {
    pub fn new(status: MeniscusStatus, message: impl Into<String>) -> Failure {
        Failure { status, message: message.into(), result: VkResult::SUCCESS }
    }

    pub fn argument(message: impl Into<String>) -> Failure {
        Failure::new(MeniscusStatus::ErrorArgument, message)
    }

    pub fn parameter(message: impl Into<String>) -> Failure {
        Failure::new(MeniscusStatus::ErrorParameter, message)
    }

    fn panic(payload: &(dyn Any + Send)) -> Failure {
        let text = payload.downcast_ref::<&str>().copied().or(payload.downcast_ref::<String>().map(String::as_str));
        let text = text.unwrap_or("no message");
        Failure::new(
            MeniscusStatus::ErrorPanic,
            format!(
                "meniscus panicked ({text}). This is a mistake in meniscus: please report it, and destroy the object"
            ),
        )
    }
}

impl From<Error> for Failure {
    fn from(e: Error) -> Failure {
        use MeniscusStatus as S;
        let (status, result) = match &e {
            Error::Unsupported { .. } => (S::ErrorUnsupported, VkResult::SUCCESS),
            Error::Vulkan { result, .. } => (S::ErrorVulkan, *result),
            Error::Memory { .. } => (S::ErrorMemory, VkResult::SUCCESS),
            Error::MemoryShort { .. } => (S::ErrorMemoryShort, VkResult::SUCCESS),
            Error::Parameter { .. } => (S::ErrorParameter, VkResult::SUCCESS),
            Error::Pass { .. } => (S::ErrorPass, VkResult::SUCCESS),
            Error::Order(_) => (S::ErrorOrder, VkResult::SUCCESS),
            _ => (S::ErrorOther, VkResult::SUCCESS),
        };
        Failure { status, message: e.to_string(), result }
    }
}

impl From<PrepareError> for Failure {
    fn from(e: PrepareError) -> Failure {
        Failure::parameter(e.to_string())
    }
}

thread_local! {
    static LAST: RefCell<(String, VkResult)> = const { RefCell::new((String::new(), VkResult::SUCCESS)) };
}

/// Runs what a function does. Nothing unwinds out of it.
pub(crate) fn guard(body: impl FnOnce() -> Result<(), Failure>) -> MeniscusStatus {
    let failure = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => return MeniscusStatus::Ok,
        Ok(Err(failure)) => failure,
        Err(payload) => {
            let failure = Failure::panic(&*payload);
            // Dropping what somebody panicked with could panic again.
            std::mem::forget(payload);
            failure
        }
    };
    // A thread that is ending keeps no message.
    let _ = LAST.try_with(|last| *last.borrow_mut() = (failure.message, failure.result));
    failure.status
}

/// Copies the message of the last call on this thread that did not end with MENISCUS_STATUS_OK: what is wrong, and what to do.
/// Calls that succeed leave it. Each thread has its own.
///
/// Writes at most `capacity` bytes, the last of them 0; cut where a character ends. Gives the whole message's length without
/// the 0: with `capacity` 0 nothing is written, and `text` may be null.
///
/// # Safety
/// `text` is null, or there is room for `capacity` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_last_message(text: *mut c_char, capacity: usize) -> usize {
    let mut length = 0;
    let status = guard(|| {
        let message = LAST.try_with(|last| last.borrow().0.clone()).unwrap_or_default();
        // SAFETY: this function's contract.
        unsafe { text::put(&message, text, capacity, &mut length) }
    });
    if status == MeniscusStatus::Ok { length } else { 0 }
}

/// What Vulkan said where the last message on this thread is one of MENISCUS_STATUS_ERROR_VULKAN; VK_SUCCESS with others.
#[unsafe(no_mangle)]
pub extern "C" fn meniscus_last_vk_result() -> VkResult {
    LAST.try_with(|last| last.borrow().1).unwrap_or(VkResult::SUCCESS)
}

/// A status as it is called here, such as "MENISCUS_STATUS_ERROR_ORDER"; of a number that is none of them "unknown". Never null,
/// and never to be freed.
#[unsafe(no_mangle)]
pub extern "C" fn meniscus_status_name(status: c_int) -> *const c_char {
    let name = match status {
        0 => c"MENISCUS_STATUS_OK",
        1 => c"MENISCUS_STATUS_NOT_READY",
        -1 => c"MENISCUS_STATUS_ERROR_UNSUPPORTED",
        -2 => c"MENISCUS_STATUS_ERROR_VULKAN",
        -3 => c"MENISCUS_STATUS_ERROR_MEMORY",
        -4 => c"MENISCUS_STATUS_ERROR_MEMORY_SHORT",
        -5 => c"MENISCUS_STATUS_ERROR_PARAMETER",
        -6 => c"MENISCUS_STATUS_ERROR_PASS",
        -7 => c"MENISCUS_STATUS_ERROR_ORDER",
        -8 => c"MENISCUS_STATUS_ERROR_ARGUMENT",
        -9 => c"MENISCUS_STATUS_ERROR_PANIC",
        -10 => c"MENISCUS_STATUS_ERROR_OTHER",
        _ => c"unknown",
    };
    name.as_ptr()
}

/// The interface's version that this library has: MENISCUS_ABI_VERSION when it was built.
#[unsafe(no_mangle)]
pub extern "C" fn meniscus_abi_version() -> u32 {
    crate::MENISCUS_ABI_VERSION
}

/// The library's own version, such as "0.1.0". Never to be freed.
#[unsafe(no_mangle)]
pub extern "C" fn meniscus_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CStr;

    fn message() -> String {
        let mut text = [0u8; 512];
        // SAFETY: the room there is.
        let length = unsafe { meniscus_last_message(text.as_mut_ptr().cast(), text.len()) };
        String::from_utf8(text[..length].to_vec()).expect("UTF-8")
    }

    /// What C would call: an uncaught panic here would end the process.
    extern "C" fn panics(kind: u32) -> MeniscusStatus {
        guard(|| match kind {
            0 => panic!("number {kind}"),
            1 => std::panic::panic_any(7),
            _ => {
                let too_many = Vec::<u64>::with_capacity(usize::MAX);
                panic!("{}", too_many.capacity())
            }
        })
    }

    #[test]
    fn a_panic_is_a_status() {
        assert_eq!(panics(0), MeniscusStatus::ErrorPanic);
        assert!(message().contains("(number 0)"), "{}", message());
        assert_eq!(panics(1), MeniscusStatus::ErrorPanic);
        assert!(message().contains("no message"), "{}", message());
        assert_eq!(panics(2), MeniscusStatus::ErrorPanic);
        assert!(message().contains("capacity overflow"), "{}", message());
    }

    #[test]
    fn each_kind_of_error_has_its_number() {
        use renderer::ash::vk;
        let text = String::new;
        let source = renderer::gpu_allocator::AllocationError::OutOfMemory;
        let errors = [
            Error::Unsupported { device: text(), missing: text() },
            Error::Vulkan { what: "a buffer".into(), result: vk::Result::ERROR_DEVICE_LOST },
            Error::Memory { resource: text(), bytes: 1, source: source.into() },
            Error::MemoryShort { needed: 2, available: 1, missing: 1 },
            Error::Parameter { parameter: "ior", value: text(), remedy: text() },
            Error::Pass { pass: "cull", problem: text() },
            Error::Order("no size yet"),
        ];
        for (i, error) in errors.into_iter().enumerate() {
            let (said, lost) = (error.to_string(), matches!(error, Error::Vulkan { .. }));
            let status = guard(|| Err(error.into()));
            assert_eq!((status as i32, message()), (-(i as i32) - 1, said));
            let result = if lost { vk::Result::ERROR_DEVICE_LOST } else { vk::Result::SUCCESS };
            assert_eq!(meniscus_last_vk_result(), result);
        }
        // What went well leaves it, and other threads have none.
        assert_eq!(guard(|| Ok(())), MeniscusStatus::Ok);
        assert_eq!(message(), "no size yet");
        assert_eq!(std::thread::spawn(message).join().expect("a message"), "");
    }

    #[test]
    fn each_number_has_its_name() {
        use MeniscusStatus as S;
        let all = [
            S::Ok,
            S::NotReady,
            S::ErrorUnsupported,
            S::ErrorVulkan,
            S::ErrorMemory,
            S::ErrorMemoryShort,
            S::ErrorParameter,
            S::ErrorPass,
            S::ErrorOrder,
            S::ErrorArgument,
            S::ErrorPanic,
            S::ErrorOther,
        ];
        let name = |n: i32| {
            // SAFETY: a constant.
            unsafe { CStr::from_ptr(meniscus_status_name(n)) }.to_str().expect("UTF-8").to_lowercase().replace('_', "")
        };
        for s in all {
            assert_eq!(name(s as i32), format!("meniscusstatus{s:?}").to_lowercase());
        }
        assert_eq!((name(2), name(-11)), ("unknown".into(), "unknown".into()));
    }
}
