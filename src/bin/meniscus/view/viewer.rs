//! Everything that is looked at, and what commands do to it.

use super::{
    adjust::{Entry, Subject},
    error::ViewError,
    frames::{Drawn, Frames, IN_FLIGHT, Over, Placed},
    keys::Command,
    navigate::Navigator,
    pane::Pane,
    panel::{self, Facts, Panel},
    player::{Clock, Loaded, Player},
    written,
};
use crate::{camera::View, choices, picture::Picture, terminal};
use meniscus::{Equirect, Method, PRESETS, host::Gpu, io::quote};
use std::{
    path::PathBuf,
    sync::Arc,
    time::{Duration, Instant},
};

/// What it starts with.
pub struct Start {
    pub picture: Picture,
    /// The method of a second half.
    pub beside: Option<Method>,
    pub clock: Clock,
    pub folder: PathBuf,
}

pub struct Viewer<'a> {
    gpu: &'a Gpu<'a>,
    pub frames: Frames<'a>,
    panes: Vec<Pane<'a>>,
    /// Which half the panel changes.
    half: usize,
    /// What both halves share.
    picture: Picture,
    environment: Equirect,
    player: Player,
    pub clock: Clock,
    pub panel: Panel,
    /// From the first file that is read on.
    pub navigator: Option<Navigator>,
    start: View,
    loaded: Option<Arc<Loaded>>,
    /// What a renderer refused with everything as it is.
    refused: Option<Arc<Loaded>>,
    folder: PathBuf,
    /// A picture of the next frame is to be written.
    writes: bool,
    /// Whether what is shown is not what is to be.
    pub dirty: bool,
    /// The same of what is written over it alone.
    pub rewritten: bool,
    pub over: bool,
    /// Pixels a point.
    pub scale: f64,
    /// Seconds between frames, averaged, and when the last was shown.
    pace: f64,
    last: Option<Instant>,
    /// Halves as they were last drawn without a refusal.
    sound: Vec<Subject>,
}

/// After this long without a frame its pace says nothing.
const PAUSE: Duration = Duration::from_millis(500);

impl<'a> Viewer<'a> {
    pub fn new(
        gpu: &'a Gpu<'a>,
        frames: Frames<'a>,
        start: Start,
        environment: Equirect,
        player: Player,
    ) -> Result<Viewer<'a>, ViewError> {
        let Start { picture, beside, clock, folder } = start;
        let subject = Subject { settings: picture.settings, preparation: picture.preparation };
        let mut panes = vec![Pane::new(gpu, IN_FLIGHT as u32, &environment, subject)?];
        if let Some(method) = beside {
            let mut other = subject;
            other.settings.method = method;
            panes.push(Pane::new(gpu, IN_FLIGHT as u32, &environment, other)?);
        }
        Ok(Viewer {
            gpu,
            frames,
            sound: panes.iter().map(|p| p.subject).collect(),
            panes,
            half: 0,
            start: picture.camera.clone(),
            picture,
            environment,
            player,
            clock,
            panel: Panel::new(),
            navigator: None,
            loaded: None,
            refused: None,
            folder,
            writes: false,
            dirty: true,
            rewritten: false,
            over: false,
            scale: 1.0,
            pace: 0.0,
            last: None,
        })
    }

    /// Says something beside what is shown.
    fn say(&mut self, text: impl Into<String>, bad: bool) {
        self.panel.said = Some((text.into(), bad));
        self.rewritten = true;
    }

    /// Takes the newest file that is ready.
    pub fn update(&mut self) {
        self.player.want(self.clock.frame());
        let known = |new| [&self.loaded, &self.refused].into_iter().flatten().any(|l| Arc::ptr_eq(l, new));
        match self.player.newest() {
            Some(Ok(loaded)) if known(&loaded) => {}
            Some(Ok(loaded)) => {
                if let Err(e) = self.take(loaded) {
                    self.say(e.to_string(), true);
                }
            }
            Some(Err(why)) if self.panel.said.as_ref().is_none_or(|(said, _)| *said != why) => {
                terminal::complain(format!("meniscus: {why}"));
                self.say(why, true);
            }
            _ => {}
        }
    }

    fn take(&mut self, loaded: Arc<Loaded>) -> Result<(), meniscus::Error> {
        let scene = &loaded.scene;
        if self.navigator.is_none() {
            // What the first one decides the others keep: the view, the absorption, and a radius that no file says.
            let size = self.frames.swapchain.size.map(|s| s.max(1));
            let (_, _, view) = Picture { size, ..self.picture.clone() }.camera(scene)?;
            let radius = f64::from(scene.particles.radius);
            self.navigator = Some(Navigator::new(&view, radius));
            (self.start, self.picture.camera) = (view.clone(), view);
            if !self.picture.absorption_given {
                let liquid = self.picture.settings(&scene.particles).liquid;
                self.picture.absorption_given = true;
                self.panes.iter_mut().for_each(|p| p.subject.settings.liquid.absorption = liquid.absorption);
            }
            if scene.radius_source.starts_with("estimated") {
                self.player.keep_radius(radius);
            }
            terminal::progress(format!("showing {}; H lists keys", self.name(loaded.index)));
        }
        self.loaded = Some(loaded);
        self.dirty = true;
        Ok(())
    }

    fn name(&self, index: usize) -> String {
        self.player.file(index).map_or("the embedded dam break".into(), |path| {
            path.file_name().map_or(String::new(), |name| quote::quote(&name.to_string_lossy()))
        })
    }

    /// Where the panes are in the window.
    fn rectangles(&self) -> Vec<([u32; 2], [u32; 2])> {
        let [width, height] = self.frames.swapchain.size;
        let bar = if self.clock.frames > 1 { panel::bar_height(self.scale) } else { 0 };
        let (height, number) = (height.saturating_sub(bar).max(1), self.panes.len() as u32);
        let edge = |i: u32| width * i / number;
        (0..number).map(|i| ([edge(i), 0], [(edge(i + 1) - edge(i)).max(1), height])).collect()
    }

    /// The panes' pictures, from where the eye is now.
    fn placed(&mut self) -> Vec<Placed> {
        if let Some(n) = &self.navigator {
            n.apply(&mut self.picture.camera);
        }
        let each = self.rectangles().into_iter().zip(&self.panes);
        each.map(|((at, size), pane)| Placed { picture: pane.picture(&self.picture, size), at }).collect()
    }

    /// Height of a pane, in which drags are measured.
    pub fn height(&self) -> f64 {
        f64::from(self.rectangles()[0].1[1])
    }

    /// The frame of the sequence whose place on the bar this is.
    pub fn bar_at(&self, [x, y]: [f64; 2]) -> Option<i64> {
        let [width, height] = self.frames.swapchain.size;
        let top = f64::from(height.saturating_sub(panel::bar_height(self.scale)));
        (self.clock.frames > 1 && y >= top).then(|| panel::frame_at(x, width, self.clock.frames))
    }

    /// Draws what there is, if the window has room for it; `false` if it has to be tried again.
    pub fn draw(&mut self, window: [u32; 2]) -> Result<bool, ViewError> {
        // Whatever is drawn at another size is drawn anew.
        if self.frames.stale || (self.frames.swapchain.size != window && !window.contains(&0)) {
            (self.frames.stale, self.dirty, self.refused) = (false, true, None);
            self.frames.swapchain.fit(window)?;
        }
        let [width, height] = self.frames.swapchain.size;
        if width == 0 || window.contains(&0) {
            // Nobody sees it; a resize makes it dirty again.
            (self.dirty, self.rewritten, self.frames.stale) = (false, false, true);
            return Ok(true);
        }
        let placed = self.placed();
        let sheets = self.sheets([width, height]);
        let anew = self.dirty || self.writes;
        let drawn = self.frames.draw(&mut self.panes, &placed, self.loaded.as_ref(), anew, &sheets)?;
        match drawn {
            Ok(Drawn::Shown) => {
                (self.dirty, self.rewritten) = (false, false);
                if anew {
                    self.sound = self.panes.iter().map(|p| p.subject).collect();
                    self.keep_pace();
                }
                if std::mem::take(&mut self.writes) {
                    self.write(&placed, true);
                }
                Ok(true)
            }
            Ok(Drawn::NotNow) => Ok(false),
            Err(e) => self.refused(&e.to_string()).map(|()| true),
        }
    }

    /// A renderer refused: what was changed since the last frame is taken back.
    fn refused(&mut self, why: &str) -> Result<(), ViewError> {
        let before: Vec<_> = self.panes.iter().map(|p| p.subject).collect();
        self.say(why, true);
        self.writes = false;
        if before == self.sound {
            // Nothing is to be taken back, but the particles: another file may do, or other settings.
            self.refused = self.loaded.take();
            return Ok(());
        }
        for (pane, sound) in self.panes.iter_mut().zip(&self.sound) {
            pane.subject = *sound;
        }
        self.dirty = true;
        Ok(())
    }

    /// Takes times of frames that have been completed; whether some are still to come.
    pub fn awaits_times(&mut self) -> bool {
        self.rewritten |= self.frames.look_at_times(&mut self.panes);
        self.frames.awaits_times()
    }

    fn keep_pace(&mut self) {
        let now = Instant::now();
        if let Some(last) = self.last.replace(now) {
            let seconds = now.duration_since(last);
            let share = if self.pace == 0.0 || seconds > PAUSE { 1.0 } else { 0.2 };
            self.pace += share * (seconds.as_secs_f64() - self.pace);
        }
    }

    fn sheets(&mut self, [width, height]: [u32; 2]) -> Vec<Over> {
        let (format, scale) = (self.frames.swapchain.format, self.scale);
        let mut sheets = Vec::new();
        let mut room = height;
        if self.clock.frames > 1 {
            let shown = self.loaded.as_ref().map_or(0, |l| l.index);
            room = height.saturating_sub(panel::bar_height(scale));
            sheets.push((panel::bar(&self.clock, shown, width, format, scale), [0, room]));
        }
        if self.panel.shown {
            let index = self.loaded.as_ref().map_or(self.clock.frame(), |l| l.index);
            let pane = &self.panes[self.half];
            let facts = Facts {
                device: &self.gpu.info.label(),
                file: self.name(index),
                particles: self.loaded.as_ref().map(|l| l.scene.particles.ellipsoids.len()),
                subject: &pane.subject,
                half: (self.panes.len() > 1).then_some(if self.half == 0 { "left" } else { "right" }),
                times: pane.times.as_ref(),
                rate: if self.pace > 0.0 { 1.0 / self.pace } else { 0.0 },
            };
            sheets.push((self.panel.sheet(&facts, format, room, scale), [0, 0]));
        }
        sheets
    }

    /// Writes the scene file of each half, and the picture that it makes.
    fn write(&mut self, placed: &[Placed], pictures: bool) {
        let Some(loaded) = &self.loaded else { return self.say("no file has been read yet", true) };
        let halves: &[&str] = if self.panes.len() > 1 { &["-left", "-right"] } else { &[""] };
        let file = self.player.file(loaded.index);
        let done = written::next(&self.folder).and_then(|number| {
            let mut names = Vec::new();
            for ((pane, placed), half) in self.panes.iter().zip(placed).zip(halves) {
                let (particles, preparation) = (file.cloned(), loaded.preparation);
                let picture = Picture { particles, preparation, ..placed.picture.clone() };
                let pixels = if pictures { Some(pane.pixels(picture.supersample)?) } else { None };
                let stem = self.folder.join(format!("view-{number:04}{half}"));
                names.extend(written::write(&stem, picture.settled(&loaded.scene)?, pixels.as_deref())?);
            }
            Ok(names)
        });
        match done {
            Ok(names) => {
                let names = names.iter().map(|n| n.display().to_string()).collect::<Vec<_>>().join(", ");
                terminal::progress(format!("wrote {names}"));
                self.say(format!("wrote {names}"), false);
            }
            Err(e) => {
                terminal::complain(format!("meniscus: {e}"));
                self.say(e.to_string(), true);
            }
        }
    }

    /// Changes what the chosen entry is of.
    pub fn change(&mut self, by: impl FnOnce(&Entry, &mut Subject) -> Result<(), meniscus::Error>) {
        let subject = &mut self.panes[self.half].subject;
        let mut entries = Entry::all(subject);
        let entry = entries.swap_remove(self.panel.chosen.min(entries.len() - 1));
        match by(&entry, subject) {
            Ok(()) => {
                // Particles are prepared once for both.
                let preparation = subject.preparation;
                self.panes.iter_mut().for_each(|p| p.subject.preparation = preparation);
                self.picture.preparation = preparation;
                self.player.prepare_for(&self.picture);
                (self.panel.said, self.refused) = (None, None);
                self.dirty = true;
            }
            Err(e) => self.say(e.to_string(), true),
        }
    }

    /// Opens a second half with the next method, or closes it.
    fn split(&mut self) -> Result<(), ViewError> {
        if self.panes.len() > 1 {
            self.panes.remove(1 - self.half);
            self.half = 0;
        } else {
            let mut subject = self.panes[0].subject;
            let now = choices::method_name(&subject.settings);
            let next = PRESETS.iter().find(|p| p.name != now);
            subject.settings.method = next.map_or_else(Method::default, |p| p.method());
            self.panes.push(Pane::new(self.gpu, IN_FLIGHT as u32, &self.environment, subject)?);
            self.half = 1;
        }
        self.sound = self.panes.iter().map(|p| p.subject).collect();
        Ok(())
    }

    pub fn obey(&mut self, command: Command) -> Result<(), ViewError> {
        self.rewritten = true;
        match command {
            Command::Help => self.panel.help ^= true,
            Command::Panel => self.panel.shown ^= true,
            Command::Times => self.panel.times ^= true,
            Command::Split => {
                self.split()?;
                self.dirty = true;
            }
            Command::Other => self.half = (self.half + 1) % self.panes.len(),
            Command::Method(steps) => {
                self.panel.chosen = 0;
                self.change(|entry, subject| entry.step(subject, steps));
            }
            Command::Select(steps) => {
                let entries = Entry::all(&self.panes[self.half].subject).len();
                self.panel.choose(steps, entries);
            }
            Command::Step(steps) => self.change(|entry, subject| entry.step(subject, steps)),
            Command::Type => self.panel.typed = Some(String::new()),
            Command::Play => self.clock.playing = self.clock.frames > 1 && !self.clock.playing,
            Command::Frame(steps) => self.seek(self.clock.frame() as i64 + steps),
            Command::First => self.seek(0),
            Command::Last => self.seek(self.clock.frames as i64),
            Command::Rate(times) => self.clock.rate = (self.clock.rate * times).clamp(0.5, 240.0),
            Command::Reset => {
                let radius = self.loaded.as_ref().map_or(0.0, |l| f64::from(l.scene.particles.radius));
                self.navigator = self.navigator.map(|_| Navigator::new(&self.start, radius));
                self.dirty = true;
            }
            Command::Picture => self.writes = true,
            Command::Scene => {
                let placed = self.placed();
                self.write(&placed, false);
            }
            Command::Quit => self.over = true,
        }
        Ok(())
    }

    /// Goes to a frame of the sequence, and stops there.
    pub fn seek(&mut self, frame: i64) {
        self.clock.playing = false;
        self.clock.seek(frame);
        self.rewritten = true;
    }

    /// What is typed has been: it is the new value.
    pub fn typed(&mut self, text: &str) {
        self.change(|entry, subject| entry.set(subject, text.trim()));
    }
}
