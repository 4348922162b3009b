//! Which of some methods a frame is drawn with, by how long earlier frames took.

use crate::{
    frame::{MeniscusFrame, Read},
    renderer::{MeniscusRenderer, Whole, with},
    report::times,
    settings::MeniscusSettings,
    status::{Failure, MeniscusStatus, guard},
    text,
    versioned::{borrow, borrow_mut, give, slice, take, tell},
};
use renderer::{
    ash::vk::Bool32 as VkBool32,
    auto::{Auto, Pick},
};
use std::ffi::c_char;

/// Picks among methods, the best first, the best one whose frames take no longer than they may. One thread at a time uses it.
pub struct MeniscusAuto {
    whole: Whole<Choices>,
}

struct Choices {
    auto: Auto,
    names: Vec<String>,
    /// What was picked so far, by number.
    picked: Vec<Option<Pick>>,
}

impl Choices {
    /// Number of the present choice.
    fn pick(&mut self) -> usize {
        let pick = self.auto.pick();
        let name = self.auto.name(pick);
        // Names differ.
        let index = self.names.iter().position(|n| n == name).unwrap_or(0);
        self.picked[index] = Some(pick);
        index
    }

    fn picked(&self, index: usize) -> Result<Pick, Failure> {
        let unknown = || Failure::parameter(format!("pick is {index}: give what meniscus_auto_pick told"));
        self.picked.get(index).copied().flatten().ok_or_else(unknown)
    }
}

/// Makes a chooser of `count` methods, those of these settings, the best first, each with a name of its own for messages; and of the
/// milliseconds that a frame may take on the device.
///
/// # Safety
/// `names` and `methods` are null or `count` pointers, each null or to text and settings; `chooser` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_auto_create(
    budget_ms: f64,
    names: *const *const c_char,
    methods: *const *const MeniscusSettings,
    count: usize,
    chooser: *mut *mut MeniscusAuto,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    guard(|| unsafe {
        give(chooser, || {
            let mut choices: Vec<(String, _)> = Vec::new();
            for (name, method) in slice(names, count, "names")?.iter().zip(slice(methods, count, "methods")?) {
                let name = text::get(*name, "a method's name")?;
                if choices.iter().any(|(other, _)| other == name) {
                    let name = name.escape_debug();
                    return Err(Failure::parameter(format!("two methods are called {name}: give each its own name")));
                }
                choices.push((name.to_owned(), borrow(*method, "a method's settings")?.settings.method));
            }
            let names: Vec<_> = choices.iter().map(|(name, _)| name.clone()).collect();
            let picked = vec![None; names.len()];
            Ok(MeniscusAuto { whole: Whole::new(Choices { auto: Auto::new(budget_ms, choices)?, names, picked }) })
        })
    })
}

/// Destroys a chooser; null is none.
///
/// # Safety
/// `chooser` is null, or a chooser that nobody uses any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_auto_destroy(chooser: *mut MeniscusAuto) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        drop(unsafe { take(chooser) });
        Ok(())
    })
}

/// Compiles what frames like this one need with any of the methods: then no change of method compiles anything. `made`, if it is not
/// null, tells how many pipelines were made.
///
/// # Safety
/// `chooser` is null or a chooser, `renderer` null or a renderer; `frame` as in meniscus_renderer_warm_up_like; `made` is null or can
/// be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_auto_warm_up(
    chooser: *mut MeniscusAuto,
    renderer: *mut MeniscusRenderer,
    frame: *const MeniscusFrame,
    made: *mut usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            let frame = Read::new(frame)?;
            borrow_mut(chooser, "the chooser")?.whole.with(|choices| {
                tell(made, choices.auto.warm_up(renderer, &frame.input())?);
                Ok(())
            })
        })
    }
}

/// Tells which method the next frame is to be drawn with: `pick` its number, to be handed back with what that frame took; and puts it
/// into settings, if they are not null. Liquid, drawing and preparation stay.
///
/// # Safety
/// `chooser` is null or a chooser; `pick` is null or can be written; `settings` is null or settings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_auto_pick(
    chooser: *mut MeniscusAuto,
    pick: *mut usize,
    settings: *mut MeniscusSettings,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    guard(|| unsafe {
        borrow_mut(chooser, "the chooser")?.whole.with(|choices| {
            let index = choices.pick();
            if let Some(settings) = settings.as_mut() {
                settings.settings.method = *choices.auto.method(choices.picked(index)?);
            }
            tell(pick, index);
            Ok(())
        })
    })
}

/// Takes note of what the frame last recorded into a slot took, which was drawn with this pick and has completed.
/// MENISCUS_STATUS_NOT_READY where the slot has no times yet. `changed`, if it is not null, tells whether another method follows from
/// it; the text is why the present one was chosen, as in meniscus_last_message, and `length` may be null.
///
/// # Safety
/// `chooser` is null or a chooser, `renderer` null or a renderer; there is room for `capacity` bytes; `changed` and `length` are null
/// or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_auto_observe(
    chooser: *mut MeniscusAuto,
    renderer: *mut MeniscusRenderer,
    slot: u32,
    pick: usize,
    changed: *mut VkBool32,
    text: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            borrow_mut(chooser, "the chooser")?.whole.with(|choices| {
                let pick = choices.picked(pick)?;
                let times = times(renderer, slot)?;
                tell(changed, VkBool32::from(choices.auto.observe(pick, &times, &[]).is_some()));
                text::put(&choices.auto.why().to_string(), text, capacity, length)
            })
        })
    }
}
