//! What can be changed of a picture while it is looked at, by steps or by what is typed.

use crate::choices;
use meniscus::{Error, Method, PRESETS, Parameter, Parameters, Settings, prepare};

/// How a picture is made: settings, and how particles are prepared.
#[derive(Clone, Copy, PartialEq)]
pub struct Subject {
    pub settings: Settings,
    pub preparation: prepare::Options,
}

/// One thing to change.
pub enum Entry {
    /// All families at once, as published.
    Preset,
    /// Which member of a family.
    Family(&'static str),
    /// A parameter of the settings.
    Setting(Parameter),
    /// A parameter of the preparation.
    Preparation(Parameter),
}

/// What a parameter can be set in.
type Set<'a> = dyn FnMut(&str) -> Result<(), Error> + 'a;

/// Values of whole numbers that are tried one after the other: some must be odd.
const TRIED: i64 = 4;
/// A step of other numbers; four of them double it.
const STEP: f64 = 1.189_207_115_002_721;

impl Entry {
    /// Everything there is to change, in order.
    pub fn all(subject: &Subject) -> Vec<Entry> {
        let families = subject.settings.method.members().map(|m| Entry::Family(m.0));
        let settings = subject.settings.parameters().into_iter().map(Entry::Setting);
        let preparation = subject.preparation.parameters().into_iter().map(Entry::Preparation);
        [Entry::Preset].into_iter().chain(families).chain(settings).chain(preparation).collect()
    }

    pub fn name(&self) -> String {
        match self {
            Entry::Preset => "method".into(),
            Entry::Family(name) => (*name).into(),
            Entry::Setting(p) | Entry::Preparation(p) => p.name.replace('_', "-"),
        }
    }

    /// What it is, with unit and range.
    pub fn about(&self) -> String {
        match self {
            Entry::Preset => "a preset of all three families".into(),
            Entry::Family(name) => {
                let part = Settings::parts().into_iter().find(|p| p.name == *name);
                part.map_or(String::new(), |p| p.about.into())
            }
            Entry::Setting(p) | Entry::Preparation(p) => {
                let unit = if p.unit.is_empty() { String::new() } else { format!(", in {}", p.unit) };
                format!("{}{unit}: {}", p.doc, p.range)
            }
        }
    }

    pub fn value(&self, subject: &Subject) -> String {
        match self {
            Entry::Preset => choices::method_name(&subject.settings),
            Entry::Family(name) => {
                let members = subject.settings.method.members();
                members.into_iter().find(|m| m.0 == *name).map_or(String::new(), |m| m.1.into())
            }
            Entry::Setting(p) | Entry::Preparation(p) => p.value.clone(),
        }
    }

    /// The words to choose from; none where any value will do.
    fn words(&self) -> Vec<&'static str> {
        match self {
            Entry::Preset => PRESETS.iter().map(|p| p.name).collect(),
            Entry::Family(name) => {
                let part = Settings::parts().into_iter().find(|p| p.name == *name);
                part.map_or(Vec::new(), |p| p.members.iter().map(|m| m.0).collect())
            }
            Entry::Setting(p) | Entry::Preparation(p) => p.choices.to_vec(),
        }
    }

    /// Sets it from text; what it cannot be is refused, and nothing changes.
    pub fn set(&self, subject: &mut Subject, text: &str) -> Result<(), Error> {
        let mut made = *subject;
        match self {
            Entry::Preset => {
                let names: Vec<_> = PRESETS.iter().map(|p| p.name).collect();
                let unknown = || Error::Parameter {
                    parameter: "method",
                    value: text.into(),
                    remedy: format!("use one of {}", names.join(", ")),
                };
                made.settings.method = Method::preset(text).ok_or_else(unknown)?;
            }
            Entry::Family(name) => {
                made.settings.method.choose(name, text)?;
                if made.settings.method.validate().is_err() {
                    // The others have to go with it.
                    made.settings.method = choices::completed(&made.settings.method, |family| family == *name);
                }
            }
            Entry::Setting(p) => made.settings.set(p.name, text)?,
            Entry::Preparation(p) => made.preparation.set(p.name, text)?,
        }
        made.settings.validate()?;
        made.preparation.validate()?;
        *subject = made;
        Ok(())
    }

    /// So many steps up or down: the next word, the next whole number that is allowed, or a fifth more of any other.
    pub fn step(&self, subject: &mut Subject, steps: i32) -> Result<(), Error> {
        let (words, value) = (self.words(), self.value(subject));
        if !words.is_empty() {
            let at = words.iter().position(|w| *w == value).unwrap_or(0) as i32;
            return self.set(subject, words[(at + steps).rem_euclid(words.len() as i32) as usize]);
        }
        // Only what is no whole number takes a fraction.
        let mut probe = *subject;
        let takes_any = match self {
            Entry::Setting(p) => probe.settings.set(p.name, "0.5").is_ok(),
            Entry::Preparation(p) => probe.preparation.set(p.name, "0.5").is_ok(),
            Entry::Preset | Entry::Family(_) => false,
        };
        let vector = value.contains(',');
        if vector || takes_any {
            let each = value.split(',').map(|part| stepped(part.parse().unwrap_or(0.0), steps));
            return self.set(subject, &each.collect::<Vec<_>>().join(","));
        }
        let now: i64 = value.parse().unwrap_or(0);
        whole(now, steps, &mut |text| self.set(subject, text))
    }
}

/// The first of the next whole numbers that is taken.
fn whole(now: i64, steps: i32, set: &mut Set) -> Result<(), Error> {
    let mut refused = Ok(());
    for i in 0..TRIED {
        refused = set(&(now + i64::from(steps) + i * i64::from(steps.signum())).to_string());
        if refused.is_ok() {
            break;
        }
    }
    refused
}

/// Three digits are enough to step with; from nothing it goes up to something.
fn stepped(value: f64, steps: i32) -> String {
    if value == 0.0 {
        return if steps > 0 { "0.01".into() } else { "0".into() };
    }
    let next = value * STEP.powi(steps);
    let rounded: f64 = format!("{next:.2e}").parse().unwrap_or(next);
    rounded.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(method: &str) -> Subject {
        let method = Method::preset(method).expect("a preset");
        Subject { settings: method.into(), preparation: prepare::Options::default() }
    }

    fn entry(subject: &Subject, name: &str) -> Entry {
        Entry::all(subject).into_iter().find(|e| e.name() == name).unwrap_or_else(|| panic!("no {name}"))
    }

    /// Steps change the entry that is named and leave what is valid.
    #[test]
    fn every_entry_of_every_preset_steps() {
        let mut moved = 0;
        for preset in PRESETS {
            let start = of(preset.name);
            for e in Entry::all(&start) {
                let (mut up, mut down) = (start, start);
                let steps = [e.step(&mut up, 1).is_ok(), e.step(&mut down, -1).is_ok()];
                let changed = up != start || down != start;
                // Maps refuse to follow reflections.
                let refused = e.name() == "trace-reflections" && preset.name != "field";
                assert!(changed != refused, "{} {}: {steps:?}, {}", preset.name, e.name(), e.value(&start));
                for s in [up, down] {
                    assert!(s.settings.validate().is_ok() && s.preparation.validate().is_ok());
                }
                assert!(!e.about().is_empty(), "{}", e.name());
                moved += 1;
            }
        }
        assert!(moved > 60, "only {moved}");
    }

    #[test]
    fn windows_stay_odd_and_words_go_round() {
        let mut s = of("imai16");
        let window = entry(&s, "window");
        let before: u32 = window.value(&s).parse().expect("a number");
        window.step(&mut s, 1).expect("a step");
        assert_eq!(entry(&s, "window").value(&s), (before + 2).to_string());
        let mut s = of("imai16");
        let method = entry(&s, "method");
        (0..PRESETS.len()).for_each(|_| method.step(&mut s, 1).expect("a preset"));
        assert_eq!(method.value(&s), "imai16");
    }

    #[test]
    fn a_member_brings_what_it_needs_and_nonsense_changes_nothing() {
        let mut s = of("field");
        let smooth = entry(&s, "smooth");
        smooth.set(&mut s, "plane-fit").expect("with other layers");
        assert_eq!(s.settings.method.members().map(|m| m.1), ["split", "plane-fit", "four"]);
        let before = s;
        for (name, text) in [("method", "x"), ("smooth", "x"), ("ior", "0.5"), ("ior", "x"), ("smoothing", "-1")] {
            assert!(entry(&s, name).set(&mut s, text).is_err(), "{name} {text}");
        }
        assert!(s == before);
    }
}
