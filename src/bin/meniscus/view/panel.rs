//! What is written over the picture: file, times, everything that can be changed, keys; and the bar of a sequence.

use super::{
    adjust::{Entry, Subject},
    keys,
    player::Clock,
    text::{self, BAD, CHOSEN, Color, PLAIN, QUIET, Sheet, TITLE},
};
use ash::vk;
use embedded_graphics::mono_font::MonoFont;
use meniscus::profile::FrameTimes;

/// Characters of a line.
const WIDTH: usize = 46;
/// Pixels around the text.
const EDGE: u32 = 6;

/// What of the panel can be seen, and what is chosen in it.
pub struct Panel {
    pub shown: bool,
    pub help: bool,
    pub times: bool,
    pub chosen: usize,
    /// What is being typed as a new value.
    pub typed: Option<String>,
    /// What was done last, or why not.
    pub said: Option<(String, bool)>,
    /// Where entries are, as last drawn: the first row's upper edge, its entry, how many there are.
    rows: (u32, usize, usize),
    /// As last drawn.
    size: [u32; 2],
    row: u32,
}

/// What it tells of.
pub struct Facts<'a> {
    pub device: &'a str,
    pub file: String,
    pub particles: Option<usize>,
    /// Of the half that is changed.
    pub subject: &'a Subject,
    /// Which half that is, where there are two.
    pub half: Option<&'static str>,
    pub times: Option<&'a FrameTimes>,
    /// Frames of the window a second.
    pub rate: f64,
}

impl Panel {
    pub fn new() -> Panel {
        Panel {
            shown: true,
            help: false,
            times: true,
            chosen: 0,
            typed: None,
            said: None,
            rows: (0, 0, 0),
            size: [0; 2],
            row: 1,
        }
    }

    /// The entry at a place in the window.
    pub fn entry_at(&self, [x, y]: [f64; 2]) -> Option<usize> {
        let (top, first, shown) = self.rows;
        let row = (y - f64::from(top)) / f64::from(self.row);
        (self.covers([x, y]) && row >= 0.0 && (row as usize) < shown).then(|| first + row as usize)
    }

    /// Whether a place in the window is under it.
    pub fn covers(&self, [x, y]: [f64; 2]) -> bool {
        self.shown && x < f64::from(self.size[0]) && y < f64::from(self.size[1])
    }

    /// Goes so many entries on.
    pub fn choose(&mut self, steps: i32, entries: usize) {
        self.chosen = (self.chosen as i32 + steps).rem_euclid(entries.max(1) as i32) as usize;
    }

    /// The panel as it is in a window so high.
    pub fn sheet(&mut self, facts: &Facts, format: vk::Format, height: u32, scale: f64) -> Sheet {
        let font = text::font(scale);
        self.row = font.character_size.height + 2;
        let most = (height.saturating_sub(2 * EDGE) / self.row) as usize;
        let above = self.above(facts);
        let entries = Entry::all(facts.subject);
        self.chosen = self.chosen.min(entries.len() - 1);
        let below = self.below(&entries[self.chosen]);
        let room = most.saturating_sub(above.len() + below.len()).clamp(1, entries.len());
        // The one that is chosen stays in the middle of those that are shown.
        let first = self.chosen.saturating_sub(room / 2).min(entries.len() - room);
        self.rows = (EDGE + above.len() as u32 * self.row, first, room);
        let lines = (above.len() + room + below.len()).min(most.max(1));
        self.size = [WIDTH as u32 * font.character_size.width + 2 * EDGE, lines as u32 * self.row + 2 * EDGE];
        let mut sheet = Sheet::new(self.size, format);
        let mut y = EDGE;
        for (text, color) in &above {
            sheet.line([EDGE, y], text, *color, font);
            y += self.row;
        }
        for (i, e) in entries.iter().enumerate().skip(first).take(room) {
            let mut value = e.value(facts.subject);
            if i == self.chosen {
                sheet.bar([0, y], [self.size[0], self.row], CHOSEN);
                if let Some(typed) = &self.typed {
                    value = format!("{typed}_");
                }
            }
            let color = if matches!(e, Entry::Preset | Entry::Family(_)) { TITLE } else { PLAIN };
            sheet.line([EDGE, y + 1], &aligned(&e.name(), &value), color, font);
            y += self.row;
        }
        for (text, color) in &below {
            sheet.line([EDGE, y], text, *color, font);
            y += self.row;
        }
        sheet
    }

    fn above(&self, facts: &Facts) -> Vec<(String, Color)> {
        if self.help {
            let keys = keys::HELP.iter().map(|(key, does)| (format!("{key:21} {does}"), PLAIN));
            return keys.chain([(String::new(), QUIET)]).collect();
        }
        let mut lines = vec![(cut(facts.device), QUIET)];
        let particles = facts.particles.map_or("reading".to_owned(), |n| format!("{n} particles"));
        lines.push((aligned(&facts.file, &particles), PLAIN));
        if let Some(times) = facts.times {
            let total = format!("{:.1} ms, {:.1}/s", times.span_ms, facts.rate);
            lines.push((aligned("GPU", &total), PLAIN));
            if self.times {
                lines.extend(by_pass(times).into_iter().map(|(name, ms)| (timed(&name, ms, times.span_ms), QUIET)));
            }
        }
        if let Some(half) = facts.half {
            lines.push((format!("the {half} half (Tab: the other)"), TITLE));
        }
        lines
    }

    fn below(&self, entry: &Entry) -> Vec<(String, Color)> {
        let mut lines: Vec<_> = wrapped(&entry.about(), 4).into_iter().map(|line| (line, QUIET)).collect();
        if let Some((text, bad)) = &self.said {
            lines.extend(wrapped(text, 4).into_iter().map(|line| (line, if *bad { BAD } else { TITLE })));
        }
        lines.push(("H: keys".into(), QUIET));
        lines
    }
}

/// Passes in order, those of one name as one.
fn by_pass(times: &FrameTimes) -> Vec<(String, f64)> {
    let mut all: Vec<(String, f64)> = Vec::new();
    for pass in &times.passes {
        match all.iter_mut().find(|(name, _)| *name == pass.name) {
            Some((_, ms)) => *ms += pass.ms,
            None => all.push((pass.name.clone(), pass.ms)),
        }
    }
    all
}

/// A pass, its milliseconds, and its share of the frame as a bar.
fn timed(name: &str, ms: f64, of: f64) -> String {
    let bar = "=".repeat((10.0 * ms / of.max(1e-9)).round().clamp(0.0, 10.0) as usize);
    format!("  {:24} {ms:8.2} {bar}", name.chars().take(24).collect::<String>())
}

fn cut(text: &str) -> String {
    text.chars().take(WIDTH).collect()
}

/// One text at the left and one at the right, of which the left is cut.
fn aligned(left: &str, right: &str) -> String {
    let right: String = right.chars().take(WIDTH - 10).collect();
    let room = WIDTH - right.chars().count() - 1;
    let left: String = left.chars().take(room).collect();
    format!("{left:room$} {right}")
}

/// Lines of whole words, and no more than so many.
fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.last_mut().expect("one at least");
        if last.is_empty() {
            *last = cut(word);
        } else if last.chars().count() + 1 + word.chars().count() <= WIDTH {
            *last = format!("{last} {word}");
        } else {
            lines.push(cut(word));
        }
    }
    lines.truncate(most);
    lines
}

/// Height of the bar of a sequence.
pub fn bar_height(scale: f64) -> u32 {
    text::font(scale).character_size.height + 6
}

/// The bar of a sequence: where it is, how fast it goes.
pub fn bar(clock: &Clock, shown: usize, width: u32, format: vk::Format, scale: f64) -> Sheet {
    let font: &MonoFont = text::font(scale);
    let mut sheet = Sheet::new([width, bar_height(scale)], format);
    let place = |frame: usize| (u64::from(width) * frame as u64 / clock.frames as u64) as u32;
    let mark = (width / clock.frames as u32).max(3);
    sheet.bar([place(clock.frame()), 0], [mark, bar_height(scale)], CHOSEN);
    // The one that is seen lags behind while files are read.
    sheet.bar([place(shown), 0], [mark, 3], TITLE);
    let state = if clock.playing { "playing" } else { "stopped" };
    let text = format!("{} of {}   {state}, {} frames/s", clock.frame() + 1, clock.frames, clock.rate);
    sheet.line([EDGE, 3], &text, PLAIN, font);
    sheet
}

/// The frame at a place along the bar.
pub fn frame_at(x: f64, width: u32, frames: usize) -> i64 {
    (x / f64::from(width.max(1)) * frames as f64).floor() as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use meniscus::prepare;

    fn facts(subject: &Subject) -> Facts<'_> {
        Facts {
            device: "a device",
            file: "a file".into(),
            particles: Some(7),
            subject,
            half: None,
            times: None,
            rate: 1.0,
        }
    }

    #[test]
    fn lines_fit_and_keep_their_ends() {
        assert_eq!(aligned(&"x".repeat(100), "7").chars().count(), WIDTH);
        assert!(aligned("a", "17").ends_with(" 17") && aligned("a", "17").chars().count() == WIDTH);
        let lines = wrapped(&"word ".repeat(100), 3);
        assert!(lines.len() == 3 && lines.iter().all(|l| l.chars().count() <= WIDTH));
    }

    /// A click finds the entry that is drawn there, scrolled or not.
    #[test]
    fn what_is_clicked_is_what_is_drawn() {
        let subject = Subject { settings: Default::default(), preparation: prepare::Options::default() };
        let entries = Entry::all(&subject).len();
        for height in [120, 240, 2000] {
            let mut panel = Panel::new();
            for chosen in 0..entries {
                panel.chosen = chosen;
                let sheet = panel.sheet(&facts(&subject), vk::Format::B8G8R8A8_SRGB, height, 1.0);
                assert!(sheet.size[1] <= height.max(30), "{height}: {:?}", sheet.size);
                // The chosen row has a ground of its own.
                let ground = |y: u32| sheet.bytes[4 * (y * sheet.size[0] + 1) as usize];
                let y = (0..sheet.size[1]).find(|y| ground(*y) == 110).expect("a chosen row");
                assert_eq!(panel.entry_at([50.0, f64::from(y) + 3.0]), Some(chosen), "{height}");
            }
            assert_eq!(panel.entry_at([5000.0, 60.0]), None);
            panel.choose(1, entries);
            assert_eq!(panel.chosen, 0);
        }
    }

    #[test]
    fn the_bar_seeks_where_it_draws() {
        let clock = Clock::new(8, 24.0);
        assert_eq!(bar(&clock, 3, 400, vk::Format::B8G8R8A8_SRGB, 1.0).size, [400, bar_height(1.0)]);
        assert_eq!([0.0, 49.0, 51.0, 399.0].map(|x| frame_at(x, 400, 8)), [0, 0, 1, 7]);
    }
}
