//! Which of some methods a frame is drawn with, by how long earlier frames took and what they counted. Nothing is waited for: what is
//! not known yet changes nothing.

use crate::{Error, FrameInput, Method, Renderer, Settings, profile::FrameTimes};
use std::fmt;

/// Picks among methods, the best first, the best one whose frames take no longer than they may.
///
/// ```no_run
/// # use meniscus::{*, auto::Auto, profile::FrameTimes};
/// # fn log(_: &str) {}
/// # fn frame(renderer: &mut Renderer, settings: &mut Settings, slot: usize) -> Result<(), Error> {
/// let choices = ["imai16", "imai14", "green10"].map(|name| (name, Method::preset(name).expect("it is published")));
/// let mut auto = Auto::new(8.0, choices)?;
/// // Each frame: what is known of the one before in this slot, and what this one is drawn with.
/// # let picked_before = auto.pick();
/// if let Some(times) = renderer.times(slot) {
///     if let Some(why) = auto.observe(picked_before, &times, &[]).cloned() {
///         log(&format!("{}: {why}", auto.name(auto.pick())));
///     }
/// }
/// let picked = auto.pick();
/// settings.method = *auto.method(picked);
/// # Ok(()) }
/// ```
///
/// Hysteresis: a slower method is taken back only if it is expected to fit with a fifth to spare, after [`Auto::PATIENCE`] frames with
/// room for it, and after twice as many each time that it did not last.
#[derive(Clone, Debug)]
pub struct Auto {
    budget_ms: f64,
    choices: Vec<Choice>,
    now: usize,
    why: Why,
    /// Frames in a row of the present choice that took too long, or left room.
    slow: u32,
    room: u32,
    /// Frames of the present choice that were observed.
    seen: u32,
    /// Whether the present choice is a slower one that was taken back.
    returned: bool,
    /// What was left, and what a frame took then.
    left: Option<(usize, f64)>,
}

#[derive(Clone, Debug)]
struct Choice {
    name: String,
    method: Method,
    /// Milliseconds, averaged over the last frames.
    ms: Option<f64>,
    /// How many times as long as each other choice it took where one followed the other.
    times: Vec<Option<f64>>,
    /// Frames with room that it takes to come back to it.
    patience: u32,
    /// It has left liquid out.
    refused: bool,
}

/// Which of the choices a frame is drawn with; to be handed back with what that frame took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pick(usize);

/// Why a choice was made.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Why {
    /// It comes first.
    First,
    /// Another one took too long.
    TooSlow {
        /// Which.
        was: String,
        /// What a frame took.
        ms: f64,
        /// What it may take.
        budget_ms: f64,
    },
    /// There is room for it.
    Room {
        /// What was drawn before.
        was: String,
        /// What a frame took.
        ms: f64,
        /// What it is expected to take now.
        expected_ms: f64,
    },
    /// Another one had no room for all of the liquid.
    LeftOut {
        /// Which.
        was: String,
        /// What it counted.
        counter: String,
        /// How many.
        count: u32,
    },
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Why::First => write!(f, "it comes first"),
            Why::TooSlow { was, ms, budget_ms } => {
                write!(f, "{was} took {ms:.2} ms a frame, of {budget_ms:.2}")
            }
            Why::Room { was, ms, expected_ms } => {
                write!(f, "{was} took {ms:.2} ms a frame, and this is expected to take {expected_ms:.2}")
            }
            Why::LeftOut { was, counter, count } => write!(f, "{was} left out liquid ({counter}: {count})"),
        }
    }
}

/// What the newest frame counts in the average.
const NEWEST: f64 = 0.25;
/// Part of the budget within which a slower choice has to be expected.
const WITHIN: f64 = 0.8;
/// How many times as long a better choice is taken to need that was never drawn.
const UNKNOWN: f64 = 2.0;

impl Auto {
    /// Frames in a row that take too long before a faster choice is made.
    pub const SLOW: u32 = 4;
    /// Frames in a row with room for a better choice before it is made.
    pub const PATIENCE: u32 = 60;
    /// The most that become of them where it did not last.
    pub const MOST_PATIENCE: u32 = 16 * Auto::PATIENCE;

    /// Names and methods, the best first; milliseconds that a frame may take on the device.
    pub fn new<N: Into<String>>(budget_ms: f64, choices: impl IntoIterator<Item = (N, Method)>) -> Result<Auto, Error> {
        if !(budget_ms.is_finite() && budget_ms > 0.0) {
            return Err(Error::parameter("budget_ms", budget_ms, "use a finite number of milliseconds above 0"));
        }
        let mut all: Vec<(String, Method)> = Vec::new();
        for (name, method) in choices {
            method.validate()?;
            all.push((name.into(), method));
        }
        if all.is_empty() {
            return Err(Error::parameter("choices", "none", "give one method at least"));
        }
        let times = vec![None; all.len()];
        let patience = Auto::PATIENCE;
        let choice = |(name, method)| Choice { name, method, ms: None, times: times.clone(), patience, refused: false };
        Ok(Auto {
            budget_ms,
            choices: all.into_iter().map(choice).collect(),
            now: 0,
            why: Why::First,
            slow: 0,
            room: 0,
            seen: 0,
            returned: false,
            left: None,
        })
    }

    /// Compiles what frames like this one need with any of the choices; says how many pipelines were made. Then no change of choice
    /// compiles anything.
    pub fn warm_up(&self, renderer: &mut Renderer, input: &FrameInput) -> Result<usize, Error> {
        let mut made = 0;
        for choice in &self.choices {
            let mut settings: Settings = *input.settings;
            settings.method = choice.method;
            made += renderer.warm_up_like(&FrameInput { settings: &settings, ..*input })?;
        }
        Ok(made)
    }

    /// What the next frame is to be drawn with.
    pub fn pick(&self) -> Pick {
        Pick(self.now)
    }

    /// The method that was picked.
    pub fn method(&self, pick: Pick) -> &Method {
        &self.choices[pick.0].method
    }

    /// Its name.
    pub fn name(&self, pick: Pick) -> &str {
        &self.choices[pick.0].name
    }

    /// Why the present choice was made.
    pub fn why(&self) -> &Why {
        &self.why
    }

    /// Takes note of what a frame took that was drawn with some pick, however many frames ago, and of what it counted (names that end
    /// with `_left_out` say that a method had no room for all of the liquid). Says why, if another choice follows from it.
    pub fn observe(&mut self, pick: Pick, times: &FrameTimes, counters: &[(&str, u32)]) -> Option<&Why> {
        let ms = times.span_ms;
        let choice = &mut self.choices[pick.0];
        let average = choice.ms.filter(|_| pick.0 != self.now || self.seen > 0);
        let average = average.map_or(ms, |old| old + NEWEST * (ms - old));
        choice.ms = Some(average);
        if let Some((counter, count)) = counters.iter().find(|(name, count)| name.ends_with("_left_out") && *count > 0)
        {
            choice.refused = true;
            let (was, counter) = (choice.name.clone(), (*counter).to_owned());
            if pick.0 == self.now
                && let Some(next) = self.other_than(self.now)
            {
                return Some(self.take(next, Why::LeftOut { was, counter, count: *count }, average));
            }
            return None;
        }
        // Frames from before the last change tell nothing of the present choice.
        if pick.0 != self.now {
            return None;
        }
        self.seen += 1;
        if let Some((before, then)) = self.left.filter(|_| self.seen == Auto::SLOW) {
            self.choices[before].times[self.now] = Some(then / average);
            self.choices[self.now].times[before] = Some(average / then);
        }
        let was = self.choices[self.now].name.clone();
        self.slow = if average > self.budget_ms { self.slow + 1 } else { 0 };
        if self.slow >= Auto::SLOW
            && let Some(next) = self.faster(average)
        {
            if self.returned {
                let patience = &mut self.choices[self.now].patience;
                *patience = (2 * *patience).min(Auto::MOST_PATIENCE);
            }
            return Some(self.take(next, Why::TooSlow { was, ms: average, budget_ms: self.budget_ms }, average));
        }
        let better = (0..self.now).rev().find(|i| !self.choices[*i].refused)?;
        let expected = average * self.choices[better].times[self.now].unwrap_or(UNKNOWN);
        self.room = if expected <= WITHIN * self.budget_ms { self.room + 1 } else { 0 };
        if self.room < self.choices[better].patience {
            return None;
        }
        let why = Why::Room { was, ms: average, expected_ms: expected };
        let why = self.take(better, why, average).clone();
        self.returned = true;
        self.why = why;
        Some(&self.why)
    }

    /// The next choice that is not expected to take longer than the present one.
    fn faster(&self, ms: f64) -> Option<usize> {
        let fits = |i: &usize| {
            let choice = &self.choices[*i];
            !choice.refused && choice.times[self.now].is_none_or(|times| times * ms < ms)
        };
        (self.now + 1..self.choices.len()).find(fits)
    }

    fn other_than(&self, refused: usize) -> Option<usize> {
        let usable = |i: &usize| !self.choices[*i].refused;
        (refused + 1..self.choices.len()).find(usable).or_else(|| (0..refused).rev().find(usable))
    }

    fn take(&mut self, next: usize, why: Why, ms: f64) -> &Why {
        self.left = Some((self.now, ms));
        (self.now, self.why) = (next, why);
        (self.slow, self.room, self.seen, self.returned) = (0, 0, 0, false);
        &self.why
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn auto(budget_ms: f64) -> Auto {
        Auto::new(budget_ms, ["imai16", "imai14", "green10"].map(|n| (n, Method::preset(n).expect("a preset"))))
            .expect("valid")
    }

    /// Frames whose choices take so many times a scene's load, observed six frames later; the names picked, one for each change.
    fn run(auto: &mut Auto, frames: usize, load: impl Fn(usize) -> f64) -> Vec<String> {
        let mut flying = std::collections::VecDeque::new();
        let mut picked = Vec::new();
        for i in 0..frames {
            let pick = auto.pick();
            flying.push_back((pick, load(i) * [10.0, 6.0, 2.0][pick.0]));
            if flying.len() > 6 {
                let (of, span_ms) = flying.pop_front().expect("frames");
                let before = auto.pick();
                let why = auto.observe(of, &FrameTimes { passes: Vec::new(), span_ms, begin_ns: 0.0 }, &[]).cloned();
                assert_eq!(why.is_some(), auto.pick() != before);
                assert!(why.is_none_or(|why| why == *auto.why()));
                if auto.pick() != before {
                    picked.push(auto.name(auto.pick()).to_owned());
                }
            }
        }
        picked
    }

    #[test]
    fn what_is_too_slow_gives_way_at_once_and_comes_back_when_there_is_room() {
        let mut auto = auto(8.0);
        assert_eq!((auto.name(auto.pick()), auto.why()), ("imai16", &Why::First));
        // Ten of eight; six fit.
        assert_eq!(run(&mut auto, 30, |_| 1.0), ["imai14"]);
        let Why::TooSlow { was, ms, budget_ms } = auto.why().clone() else { panic!("{}", auto.why()) };
        assert!(was == "imai16" && (ms - 10.0).abs() < 1e-9 && budget_ms == 8.0);
        assert_eq!(auto.why().to_string(), "imai16 took 10.00 ms a frame, of 8.00");
        // It stays there as long as ten would not fit with a fifth to spare, however long that is.
        assert_eq!(run(&mut auto, 2000, |_| 0.65), [""; 0]);
        // Then it comes back, and says what it expects: it has seen how the two compare.
        assert_eq!(run(&mut auto, Auto::PATIENCE as usize + 20, |_| 0.5), ["imai16"]);
        let Why::Room { expected_ms, .. } = auto.why() else { panic!("{}", auto.why()) };
        assert!((expected_ms - 5.0).abs() < 0.2, "{expected_ms}");
        // Far too much for all but the last; and for that one too, which then stays.
        assert_eq!(run(&mut auto, 60, |_| 3.0), ["imai14", "green10"]);
        assert_eq!(run(&mut auto, 200, |_| 9.0), [""; 0]);
    }

    #[test]
    fn loads_that_come_and_go_change_less_and_less() {
        let mut auto = auto(8.0);
        // Light for long enough to come back, and then heavy again, over and over.
        let changes = run(&mut auto, 6000, |i| if i / 100 % 2 == 0 { 0.6 } else { 1.0 });
        let ups = changes.iter().filter(|name| *name == "imai16").count();
        assert!((1..=6).contains(&ups), "{changes:?}");
        // Around what fits nothing goes back and forth.
        let mut auto = self::auto(8.0);
        run(&mut auto, 100, |_| 1.0);
        assert_eq!(run(&mut auto, 3000, |i| 0.8 + 0.1 * (i as f64).sin()), [""; 0]);
    }

    #[test]
    fn what_leaves_liquid_out_is_not_drawn_again() {
        let mut auto = auto(8.0);
        let fast = FrameTimes { passes: Vec::new(), span_ms: 0.1, begin_ns: 0.0 };
        let why = auto.observe(auto.pick(), &fast, &[("field_bricks_left_out", 0), ("field_cells_left_out", 7)]);
        let said = why.map(ToString::to_string);
        assert_eq!(said.as_deref(), Some("imai16 left out liquid (field_cells_left_out: 7)"));
        assert_eq!(auto.name(auto.pick()), "imai14");
        for _ in 0..10 * Auto::MOST_PATIENCE {
            auto.observe(auto.pick(), &fast, &[]);
        }
        assert_eq!(auto.name(auto.pick()), "imai14");
        assert!(Auto::new(0.0, [("a", Method::default())]).is_err());
        assert!(Auto::new(1.0, std::iter::empty::<(&str, Method)>()).is_err());
    }
}
