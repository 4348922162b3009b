//! Settings: a method, the liquid, how it is drawn, and how particles are prepared; all of it by name and as text.

use crate::{
    status::{Failure, MeniscusStatus, guard},
    text,
    versioned::{borrow, borrow_mut, give, take, tell},
};
use renderer::{Method, PRESETS, Parameter, Parameters, Settings, prepare::Options};
use std::ffi::c_char;

/// Method, liquid, drawing, and how particles are prepared. One thread at a time changes it; any number may read it.
#[derive(Clone, Default)]
pub struct MeniscusSettings {
    pub(crate) settings: Settings,
    pub(crate) options: Options,
}

impl MeniscusSettings {
    /// All of it, in order.
    fn parameters(&self) -> Vec<Parameter> {
        let mut all = self.settings.parameters();
        all.extend(self.options.parameters());
        all
    }

    fn set(&mut self, name: &str, text: &str) -> Result<(), Failure> {
        if self.options.parameters().iter().any(|p| p.name == name) {
            return Ok(self.options.set(name, text)?);
        }
        if self.settings.parameters().iter().any(|p| p.name == name) {
            return Ok(self.settings.set(name, text)?);
        }
        Err(self.unknown(name))
    }

    fn unknown(&self, name: &str) -> Failure {
        let names: Vec<_> = self.parameters().iter().map(|p| p.name).collect();
        Failure::parameter(format!("parameter is {}: there are {}", name.escape_debug(), names.join(", ")))
    }
}

/// What meniscus_settings_parameter tells of one: the name.
pub const MENISCUS_PARAMETER_NAME: u32 = 0;
/// What it is.
pub const MENISCUS_PARAMETER_DOC: u32 = 1;
/// Unit of the value that it has; empty where it has none.
pub const MENISCUS_PARAMETER_UNIT: u32 = 2;
/// What it must be, as in "use ...".
pub const MENISCUS_PARAMETER_RANGE: u32 = 3;
/// Words to choose from, with commas between; empty if any value of the range will do.
pub const MENISCUS_PARAMETER_CHOICES: u32 = 4;
/// Value it has when nothing is said.
pub const MENISCUS_PARAMETER_DEFAULT: u32 = 5;
/// Value it has.
pub const MENISCUS_PARAMETER_VALUE: u32 = 6;

/// Makes settings, all of them the defaults.
///
/// # Safety
/// `settings` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_create(settings: *mut *mut MeniscusSettings) -> MeniscusStatus {
    // SAFETY: this function's contract.
    guard(|| unsafe { give(settings, || Ok(MeniscusSettings::default())) })
}

/// Makes settings that are the same as others.
///
/// # Safety
/// `of` is null or settings; `settings` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_copy(
    of: *const MeniscusSettings,
    settings: *mut *mut MeniscusSettings,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    guard(|| unsafe { give(settings, || Ok(borrow(of, "the settings")?.clone())) })
}

/// Destroys settings; null is none.
///
/// # Safety
/// `settings` is null, or settings that nobody uses any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_destroy(settings: *mut MeniscusSettings) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        drop(unsafe { take(settings) });
        Ok(())
    })
}

/// Takes the method of this name (meniscus_list, MENISCUS_LIST_PRESETS): layers, smoothing and optics with their parameters. Liquid,
/// drawing and preparation stay.
///
/// # Safety
/// `settings` is null or settings; `name` is null or text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_preset(
    settings: *mut MeniscusSettings,
    name: *const c_char,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let (settings, name) =
            unsafe { (borrow_mut(settings, "the settings")?, text::get(name, "the preset's name")?) };
        let method = Method::preset(name).ok_or_else(|| {
            let names: Vec<_> = PRESETS.iter().map(|p| p.name).collect();
            Failure::parameter(format!("preset is {}: there are {}", name.escape_debug(), names.join(", ")))
        })?;
        settings.settings.method = method;
        Ok(())
    })
}

/// Takes another member of a family ("layers", "smooth" or "optics"), with its default parameters; the one that is there already
/// stays as it is. Whether the three go together says meniscus_settings_validate.
///
/// # Safety
/// `settings` is null or settings; `family` and `member` are null or text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_choose(
    settings: *mut MeniscusSettings,
    family: *const c_char,
    member: *const c_char,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let (settings, family, member) = unsafe {
            (borrow_mut(settings, "the settings")?, text::get(family, "the family")?, text::get(member, "the member")?)
        };
        Ok(settings.settings.method.choose(family, member)?)
    })
}

/// Tells which member of a family ("layers", "smooth" or "optics") the settings have. Text as in meniscus_last_message; `length` may
/// be null.
///
/// # Safety
/// `settings` is null or settings; `family` is null or text; there is room for `capacity` bytes; `length` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_member(
    settings: *const MeniscusSettings,
    family: *const c_char,
    text: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let (settings, family) = unsafe { (borrow(settings, "the settings")?, text::get(family, "the family")?) };
        let members = settings.settings.method.members();
        let member = members.iter().find(|(name, _)| *name == family).ok_or_else(|| {
            Failure::parameter(format!("family is {}: there are layers, smooth and optics", family.escape_debug()))
        })?;
        // SAFETY: this function's contract.
        unsafe { text::put(member.1, text, capacity, length) }
    })
}

/// Sets a parameter by name, from text: of the chosen members, of the liquid ("ior" "1.4", "absorption" "0.9,0.3,0.1"), of the
/// drawing, or of the preparation ("splash_threshold"). Ranges are checked by meniscus_settings_validate, and with every frame.
///
/// # Safety
/// `settings` is null or settings; `name` and `value` are null or text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_set(
    settings: *mut MeniscusSettings,
    name: *const c_char,
    value: *const c_char,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let (settings, name, value) = unsafe {
            let settings = borrow_mut(settings, "the settings")?;
            (settings, text::get(name, "the parameter's name")?, text::get(value, "the parameter's value")?)
        };
        settings.set(name, value)
    })
}

/// Tells a parameter's value, by name. Text as in meniscus_last_message; `length` may be null.
///
/// # Safety
/// `settings` is null or settings; `name` is null or text; there is room for `capacity` bytes; `length` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_get(
    settings: *const MeniscusSettings,
    name: *const c_char,
    text: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let (settings, name) = unsafe { (borrow(settings, "the settings")?, text::get(name, "the parameter's name")?) };
        let all = settings.parameters();
        let found = all.iter().find(|p| p.name == name).ok_or_else(|| settings.unknown(name))?;
        // SAFETY: this function's contract.
        unsafe { text::put(&found.value, text, capacity, length) }
    })
}

/// How many parameters settings have: those of the chosen members, of liquid, drawing and preparation.
///
/// # Safety
/// `settings` is null or settings; `count` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_parameter_count(
    settings: *const MeniscusSettings,
    count: *mut usize,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        unsafe { tell(count, borrow(settings, "the settings")?.parameters().len()) };
        Ok(())
    })
}

/// Tells one thing (MENISCUS_PARAMETER_...) of the parameter number `index`. Text as in meniscus_last_message; `length` may be null.
///
/// # Safety
/// `settings` is null or settings; there is room for `capacity` bytes; `length` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_parameter(
    settings: *const MeniscusSettings,
    index: usize,
    what: u32,
    text: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let all = unsafe { borrow(settings, "the settings") }?.parameters();
        let Some(p) = all.get(index) else {
            return Err(Failure::parameter(format!("there is no parameter {index}: there are {}", all.len())));
        };
        let choices = p.choices.join(",");
        let told = match what {
            MENISCUS_PARAMETER_NAME => p.name,
            MENISCUS_PARAMETER_DOC => p.doc,
            MENISCUS_PARAMETER_UNIT => p.unit,
            MENISCUS_PARAMETER_RANGE => p.range,
            MENISCUS_PARAMETER_CHOICES => &choices,
            MENISCUS_PARAMETER_DEFAULT => &p.default,
            MENISCUS_PARAMETER_VALUE => &p.value,
            other => {
                return Err(Failure::parameter(format!(
                    "nothing of parameters is {other}: use MENISCUS_PARAMETER_..."
                )));
            }
        };
        // SAFETY: this function's contract.
        unsafe { text::put(told, text, capacity, length) }
    })
}

/// Makes settings those of a picture that is rendered at `times` its size, to be averaged: what is counted in pixels covers the same
/// part of it.
///
/// # Safety
/// `settings` is null or settings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_enlarge(settings: *mut MeniscusSettings, times: u32) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let settings = unsafe { borrow_mut(settings, "the settings") }?;
        if times == 0 {
            return Err(Failure::parameter("a picture at 0 times its size: use 1 or more"));
        }
        settings.settings = settings.settings.enlarged(times);
        Ok(())
    })
}

/// Checks every range, and that layers, smoothing and optics go together.
///
/// # Safety
/// `settings` is null or settings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_settings_validate(settings: *const MeniscusSettings) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let settings = unsafe { borrow(settings, "the settings") }?;
        settings.settings.validate()?;
        Ok(settings.options.validate()?)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A name means one thing, whatever is chosen.
    #[test]
    fn no_name_is_there_twice() {
        let own: Vec<_> = Options::default().parameters().iter().map(|p| p.name).collect();
        assert!(own.contains(&"splash_threshold"), "{own:?}");
        for part in Settings::parts() {
            for (member, parameters) in part.members {
                let both = parameters.parameters().into_iter().find(|p| own.contains(&p.name));
                assert!(both.is_none(), "{} {member}: {both:?}", part.name);
            }
        }
    }
}
