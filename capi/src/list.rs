//! What there is to choose from.

use crate::{
    status::{Failure, MeniscusStatus, guard},
    text,
};
use renderer::{PRESETS, layers::Layers, optics::Optics, smooth::Smooth};
use std::ffi::c_char;

/// meniscus_list: methods, for meniscus_settings_preset. The first is the default.
pub const MENISCUS_LIST_PRESETS: u32 = 0;
/// meniscus_list: members of the family "layers".
pub const MENISCUS_LIST_LAYERS: u32 = 1;
/// meniscus_list: members of the family "smooth".
pub const MENISCUS_LIST_SMOOTH: u32 = 2;
/// meniscus_list: members of the family "optics".
pub const MENISCUS_LIST_OPTICS: u32 = 3;

/// Tells name number `index` of a list (MENISCUS_LIST_...). MENISCUS_STATUS_NOT_READY behind the last. Text as in
/// meniscus_last_message; `length` may be null.
///
/// # Safety
/// There is room for `capacity` bytes; `length` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_list(
    list: u32,
    index: usize,
    text: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> MeniscusStatus {
    guard(|| {
        let (name, count) = match list {
            MENISCUS_LIST_PRESETS => (PRESETS.get(index).map(|p| p.name), PRESETS.len()),
            MENISCUS_LIST_LAYERS => (Layers::NAMES.get(index).copied(), Layers::NAMES.len()),
            MENISCUS_LIST_SMOOTH => (Smooth::NAMES.get(index).copied(), Smooth::NAMES.len()),
            MENISCUS_LIST_OPTICS => (Optics::NAMES.get(index).copied(), Optics::NAMES.len()),
            other => return Err(Failure::parameter(format!("there is no list {other}: use MENISCUS_LIST_..."))),
        };
        let end =
            || Failure::new(MeniscusStatus::NotReady, format!("the list ends before {index}: it has {count} names"));
        // SAFETY: this function's contract.
        unsafe { text::put(name.ok_or_else(end)?, text, capacity, length) }
    })
}
