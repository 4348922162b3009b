//! Which key does what; the list that help shows is the one that is looked up.

use glam::DVec3;
use winit::keyboard::{Key, KeyCode, NamedKey};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    Help,
    Panel,
    Times,
    Split,
    Other,
    Method(i32),
    Select(i32),
    Step(i32),
    Type,
    Play,
    Frame(i64),
    First,
    Last,
    Rate(f64),
    Reset,
    Picture,
    Scene,
    Quit,
}

/// A key by what it writes, or by its name; what it does; and with Shift.
struct Binding {
    key: Key<&'static str>,
    does: Command,
    shifted: Command,
}

const fn key(key: Key<&'static str>, does: Command, shifted: Command) -> Binding {
    Binding { key, does, shifted }
}

const fn named(name: NamedKey, does: Command) -> Binding {
    Binding { key: Key::Named(name), does, shifted: does }
}

const BINDINGS: &[Binding] = &[
    key(Key::Character("h"), Command::Help, Command::Help),
    key(Key::Character("p"), Command::Panel, Command::Panel),
    key(Key::Character("t"), Command::Times, Command::Times),
    key(Key::Character("x"), Command::Split, Command::Split),
    key(Key::Character("m"), Command::Method(1), Command::Method(-1)),
    key(Key::Character("r"), Command::Reset, Command::Reset),
    key(Key::Character(","), Command::Frame(-1), Command::Frame(-1)),
    key(Key::Character("."), Command::Frame(1), Command::Frame(1)),
    key(Key::Character("["), Command::Rate(0.5), Command::Rate(0.5)),
    key(Key::Character("]"), Command::Rate(2.0), Command::Rate(2.0)),
    named(NamedKey::Tab, Command::Other),
    named(NamedKey::ArrowUp, Command::Select(-1)),
    named(NamedKey::ArrowDown, Command::Select(1)),
    key(Key::Named(NamedKey::ArrowLeft), Command::Step(-1), Command::Step(-4)),
    key(Key::Named(NamedKey::ArrowRight), Command::Step(1), Command::Step(4)),
    named(NamedKey::Enter, Command::Type),
    named(NamedKey::Space, Command::Play),
    named(NamedKey::PageUp, Command::Frame(-10)),
    named(NamedKey::PageDown, Command::Frame(10)),
    named(NamedKey::Home, Command::First),
    named(NamedKey::End, Command::Last),
    named(NamedKey::F2, Command::Picture),
    named(NamedKey::F3, Command::Scene),
    named(NamedKey::Escape, Command::Quit),
];

/// What help says; every command is in it.
pub const HELP: &[(&str, &str)] = &[
    ("left drag", "orbit"),
    ("right drag", "look around"),
    ("middle or Shift drag", "pan"),
    ("wheel", "nearer, and on through"),
    ("W A S D, Q E", "fly; down and up; Shift: faster"),
    ("R", "the view of the start"),
    ("Up Down, click", "choose a parameter"),
    ("Left Right, wheel", "change it; Shift: four steps"),
    ("Enter", "type its value"),
    ("M, Shift M", "next method, the one before"),
    ("X", "split the window in two methods"),
    ("Tab", "which half the panel changes"),
    ("Space", "play, stop"),
    (", . Page Home End", "frames of the sequence"),
    ("[ ]", "half, twice as fast"),
    ("T", "times of passes"),
    ("P", "panel"),
    ("F2", "write picture and scene file"),
    ("F3", "write the scene file alone"),
    ("H", "these lines"),
    ("Esc", "quit"),
];

/// What a key means, if anything.
pub fn command(pressed: &Key, shift: bool) -> Option<Command> {
    let lower = match pressed {
        Key::Character(text) => Key::Character(text.to_lowercase().into()),
        other => other.clone(),
    };
    let found = BINDINGS.iter().find(|b| lower.as_ref() == b.key)?;
    Some(if shift { found.shifted } else { found.does })
}

/// Where keys that are held down fly to: right, up, forward; by where they are, not by what they write.
pub fn flight(held: &[KeyCode]) -> DVec3 {
    let directions = [
        (KeyCode::KeyW, DVec3::Z),
        (KeyCode::KeyS, -DVec3::Z),
        (KeyCode::KeyD, DVec3::X),
        (KeyCode::KeyA, -DVec3::X),
        (KeyCode::KeyE, DVec3::Y),
        (KeyCode::KeyQ, -DVec3::Y),
    ];
    directions.iter().filter(|(code, _)| held.contains(code)).map(|(_, direction)| *direction).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_with_and_without_shift() {
        let m = |text: &str| Key::Character(text.into());
        assert_eq!(command(&m("m"), false), Some(Command::Method(1)));
        assert_eq!(command(&m("M"), true), Some(Command::Method(-1)));
        assert_eq!(command(&Key::Named(NamedKey::ArrowRight), true), Some(Command::Step(4)));
        assert_eq!(command(&m("w"), false), None);
        assert_eq!(flight(&[KeyCode::KeyW, KeyCode::KeyA, KeyCode::KeyQ]), DVec3::new(-1.0, -1.0, 1.0));
        assert_eq!(flight(&[KeyCode::KeyW, KeyCode::KeyS]), DVec3::ZERO);
    }

    #[test]
    fn no_key_means_two_things() {
        for (i, b) in BINDINGS.iter().enumerate() {
            assert!(BINDINGS[..i].iter().all(|other| other.key != b.key), "{:?}", b.key);
        }
    }
}
