//! What a renderer has to tell: times, memory, barriers.

use crate::{
    frame::MeniscusPositions,
    renderer::{MeniscusRenderer, with},
    settings::MeniscusSettings,
    status::{Failure, MeniscusStatus},
    text,
    versioned::{Element, borrow, fill, read_some, tell},
};
use renderer::{LedgerEntry, Renderer, ash::vk::Bool32 as VkBool32, profile::FrameTimes, renderer::Amount};
use std::ffi::c_char;

/// GPU time of one pass.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusPassTime {
    /// The pass's name, also its debug label; ends with a 0.
    pub name: [c_char; 64],
    /// What part of the frame it is: "particles", "visibility", or the family whose member it belongs to; ends with a 0.
    pub part: [c_char; 32],
    /// Milliseconds from the pass's first to its last command.
    pub ms: f64,
    /// VK_TRUE if it works for the particles, whatever the view.
    pub prepares: VkBool32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C); no padding (a test adds it up).
unsafe impl Element for MeniscusPassTime {
    const NAME: &'static str = "MeniscusPassTime";
    const LEAST: usize = 112;
}

/// One resource in device memory.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusMemory {
    /// Resource name; ends with a 0.
    pub name: [c_char; 64],
    /// Device memory in bytes, as the driver requires it.
    pub bytes: u64,
    /// VK_TRUE if it grows with the number of particles.
    pub per_particle: VkBool32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C); no padding (a test adds it up).
unsafe impl Element for MeniscusMemory {
    const NAME: &'static str = "MeniscusMemory";
    const LEAST: usize = 80;
}

fn memory(entry: &LedgerEntry) -> MeniscusMemory {
    let (name, per_particle) = (text::array(entry.name), VkBool32::from(entry.per_particle));
    MeniscusMemory { name, bytes: entry.bytes, per_particle, reserved: 0 }
}

/// Times of the frame last recorded into a slot.
pub(crate) fn times(renderer: &Renderer, slot: u32) -> Result<FrameTimes, Failure> {
    let none = || Failure::new(MeniscusStatus::NotReady, format!("slot {slot} has no times yet"));
    renderer.times(slot as usize).ok_or_else(none)
}

/// Tells the GPU times of the frame last recorded into a slot, which has completed; does not wait. MENISCUS_STATUS_NOT_READY before
/// the first, or where the queue has no timestamps.
///
/// Arrays are filled as this one everywhere: `*count` says how many elements of `element_size` (sizeof(MeniscusPassTime)) there is
/// room for, and is told how many there are, which may be more. With `passes` null only the number is told.
///
/// # Safety
/// `renderer` is null or a renderer; `span_ms` is null or can be written; `passes` is null or has room for `*count` elements; `count`
/// is null or can be read and written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_times(
    renderer: *mut MeniscusRenderer,
    slot: u32,
    span_ms: *mut f64,
    passes: *mut MeniscusPassTime,
    element_size: usize,
    count: *mut usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            let times = times(renderer, slot)?;
            let pass = |p: &renderer::profile::PassTime| MeniscusPassTime {
                name: text::array(&p.name),
                part: text::array(p.part),
                ms: p.ms,
                prepares: VkBool32::from(p.prepares),
                reserved: 0,
            };
            fill(&times.passes.iter().map(pass).collect::<Vec<_>>(), passes, element_size, count)?;
            tell(span_ms, times.span_ms);
            Ok(())
        })
    }
}

/// Tells the device memory that frames of a size take, resource by resource, before anything is allocated: of `splash` and `body`
/// particles prepared on the host, or of positions on the device, if they are not null (their buffers may be). Particles that the
/// host prepared are extra, 36 bytes each, 4 more with their speeds and 16 with their points, and an environment that the renderer
/// was given, 16 bytes a texel. Arrays as in meniscus_renderer_times.
///
/// # Safety
/// `renderer` is null or a renderer; `settings` is null or settings; `positions` is null or positions with their size; `entries` is
/// null or has room for `*count` elements; `count` is null or can be read and written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_memory_requirements(
    renderer: *mut MeniscusRenderer,
    width: u32,
    height: u32,
    settings: *const MeniscusSettings,
    splash: u32,
    body: u32,
    positions: *const MeniscusPositions,
    entries: *mut MeniscusMemory,
    element_size: usize,
    count: *mut usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            let settings = borrow(settings, "the settings")?;
            let positions = read_some(positions)?.map(|p: MeniscusPositions| p.get(&settings.options));
            let amount = match &positions {
                Some(positions) => Amount::OnDevice(positions),
                None if splash.checked_add(body).is_none() => {
                    return Err(Failure::parameter("particles: more than 2^32 - 1; use fewer"));
                }
                None => Amount::Prepared { splash: splash as usize, body: body as usize },
            };
            let ledger = renderer.memory_requirements([width, height], amount, &settings.settings)?;
            fill(&ledger.iter().map(memory).collect::<Vec<_>>(), entries, element_size, count)
        })
    }
}

/// Tells the device memory that is in use now, resource by resource. Arrays as in meniscus_renderer_times.
///
/// # Safety
/// `renderer` is null or a renderer; `entries` is null or has room for `*count` elements; `count` is null or can be read and written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_memory(
    renderer: *mut MeniscusRenderer,
    entries: *mut MeniscusMemory,
    element_size: usize,
    count: *mut usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            fill(&renderer.memory().iter().map(memory).collect::<Vec<_>>(), entries, element_size, count)
        })
    }
}

/// Tells the barriers of the frame last recorded, in order, one a line. Text as in meniscus_last_message; `length` may be null.
///
/// # Safety
/// `renderer` is null or a renderer; there is room for `capacity` bytes; `length` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_plan(
    renderer: *mut MeniscusRenderer,
    text: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            let lines: String = renderer.plan().iter().map(|entry| format!("{entry}\n")).collect();
            text::put(&lines, text, capacity, length)
        })
    }
}
