//! A sequence of files: which one it is time for, and a thread that reads it. Nothing waits for that thread; until it is done,
//! the newest file that is ready stays.

use crate::{picture::Picture, scene::Scene};
use meniscus::{Point, prepare::Options};
use std::{
    path::PathBuf,
    sync::{Arc, Condvar, Mutex, MutexGuard},
};

/// A file that was read and prepared.
pub struct Loaded {
    pub index: usize,
    /// How it was prepared, as the picture said then.
    pub preparation: Options,
    pub scene: Scene,
    /// What a density field is made of, where the CPU prepares.
    pub points: Option<Vec<Point>>,
}

/// Which frame of a sequence it is time for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    pub frames: usize,
    /// Whole and part of a frame.
    at: f64,
    pub playing: bool,
    /// Frames a second.
    pub rate: f64,
}

impl Clock {
    pub fn new(frames: usize, rate: f64) -> Clock {
        Clock { frames, at: 0.0, playing: false, rate }
    }

    pub fn frame(&self) -> usize {
        (self.at as usize).min(self.frames - 1)
    }

    /// After so many seconds; from the end it goes on at the start.
    pub fn advance(&mut self, seconds: f64) {
        if self.playing {
            self.at = (self.at + seconds * self.rate).rem_euclid(self.frames as f64);
        }
    }

    /// Goes to a frame, or as near as there is one.
    pub fn seek(&mut self, frame: i64) {
        self.at = frame.clamp(0, self.frames as i64 - 1) as f64;
    }
}

/// How many files are kept that were read: the one before, this one, and the next.
const KEPT: usize = 3;

struct State {
    picture: Picture,
    /// How often the picture has changed what is made of a file.
    version: u64,
    wanted: usize,
    /// The oldest first: version, whether it was wanted when it was begun, what it is or why it is not.
    ready: Vec<Ready>,
    over: bool,
}

struct Ready {
    version: u64,
    index: usize,
    wanted: bool,
    loaded: Result<Arc<Loaded>, String>,
}

impl State {
    /// What to read next: what is wanted, then what follows it.
    fn next(&self, files: usize) -> Option<usize> {
        let missing = |index: &usize| !self.ready.iter().any(|r| r.index == *index && r.version == self.version);
        [self.wanted, (self.wanted + 1) % files].into_iter().find(missing)
    }

    /// What to show: what is wanted, or else the last that was wanted and read.
    fn newest(&self) -> Option<&Ready> {
        let current = || self.ready.iter().rev().filter(|r| r.version == self.version);
        current().find(|r| r.index == self.wanted).or_else(|| current().find(|r| r.wanted))
    }

    fn add(&mut self, ready: Ready) {
        self.ready.push(ready);
        while self.ready.len() > KEPT {
            // The oldest that is not wanted now.
            let spare = self.ready.iter().position(|r| r.index != self.wanted).unwrap_or(0);
            self.ready.remove(spare);
        }
    }
}

/// Reads files on a thread of its own.
pub struct Player {
    files: Arc<Vec<Option<PathBuf>>>,
    shared: Arc<(Mutex<State>, Condvar)>,
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(|e| e.into_inner())
}

impl Player {
    /// `None` is what is embedded; `wake` is called whenever a file is ready.
    pub fn new(files: Vec<Option<PathBuf>>, picture: Picture, wake: impl Fn() + Send + 'static) -> Player {
        let state = State { picture, version: 0, wanted: 0, ready: Vec::new(), over: false };
        let player = Player { files: Arc::new(files), shared: Arc::new((Mutex::new(state), Condvar::new())) };
        let (files, shared) = (player.files.clone(), player.shared.clone());
        std::thread::spawn(move || read(&files, &shared, &wake));
        player
    }

    pub fn file(&self, index: usize) -> Option<&PathBuf> {
        self.files[index].as_ref()
    }

    /// From now on this one is wanted.
    pub fn want(&self, index: usize) {
        let mut state = lock(&self.shared.0);
        if state.wanted != index {
            state.wanted = index;
            self.shared.1.notify_all();
        }
    }

    /// From now on files are read for this picture; what was read for another is forgotten if it would be made otherwise.
    pub fn prepare_for(&self, picture: &Picture) {
        let mut state = lock(&self.shared.0);
        let makes = |p: &Picture| (p.preparation, p.prepare);
        if makes(&state.picture) != makes(picture) {
            state.picture = Picture { radius: state.picture.radius.or(picture.radius), ..picture.clone() };
            state.version += 1;
            state.ready.clear();
            self.shared.1.notify_all();
        }
    }

    /// From now on files that do not say a radius have this one; what was read already has it.
    pub fn keep_radius(&self, radius: f64) {
        lock(&self.shared.0).picture.radius = Some(radius);
    }

    /// The newest that is ready, or why it is not; nothing, while none has been read.
    pub fn newest(&self) -> Option<Result<Arc<Loaded>, String>> {
        lock(&self.shared.0).newest().map(|r| r.loaded.clone())
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        // Not waited for: what it still reads nobody wants.
        lock(&self.shared.0).over = true;
        self.shared.1.notify_all();
    }
}

/// The thread.
fn read(files: &[Option<PathBuf>], (state, changed): &(Mutex<State>, Condvar), wake: &dyn Fn()) {
    loop {
        let mut now = lock(state);
        let index = loop {
            if now.over {
                return;
            }
            if let Some(index) = now.next(files.len()) {
                break index;
            }
            now = changed.wait(now).unwrap_or_else(|e| e.into_inner());
        };
        let (picture, version, wanted) = (now.picture.clone(), now.version, index == now.wanted);
        drop(now);
        let loaded = load(&files[index], &picture, index);
        let mut now = lock(state);
        if version == now.version {
            now.add(Ready { version, index, wanted, loaded });
        }
        drop(now);
        wake();
    }
}

fn load(file: &Option<PathBuf>, picture: &Picture, index: usize) -> Result<Arc<Loaded>, String> {
    let made = picture.load(file.as_deref(), picture.preparer()).and_then(|scene| {
        let points = if picture.preparer().on_device() { None } else { Some(scene.points()?) };
        Ok(Loaded { index, preparation: picture.preparation, scene, points })
    });
    made.map(Arc::new).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{sync::mpsc, time::Duration};

    #[test]
    fn the_clock_goes_round_and_seeks_within() {
        let mut clock = Clock::new(10, 4.0);
        clock.advance(1.0);
        assert_eq!(clock.frame(), 0, "it stands");
        clock.playing = true;
        clock.advance(0.8);
        assert_eq!(clock.frame(), 3);
        clock.advance(2.0);
        assert_eq!(clock.frame(), 1);
        clock.seek(-5);
        assert_eq!(clock.frame(), 0);
        clock.seek(99);
        assert_eq!(clock.frame(), 9);
    }

    fn ready(index: usize, wanted: bool) -> Ready {
        Ready { version: 0, index, wanted, loaded: Err(index.to_string()) }
    }

    fn state(wanted: usize) -> State {
        State { picture: Picture::default(), version: 0, wanted, ready: Vec::new(), over: false }
    }

    /// Playing faster than files are read shows each that was wanted, and none ahead of its time.
    #[test]
    fn the_newest_that_was_wanted_is_shown() {
        let mut s = state(0);
        assert!(s.newest().is_none());
        s.add(ready(0, true));
        s.add(ready(1, false));
        assert_eq!((s.newest().expect("one").index, s.next(9)), (0, None));
        s.wanted = 5;
        assert_eq!((s.newest().expect("one").index, s.next(9)), (0, Some(5)));
        s.wanted = 6;
        s.add(ready(5, true));
        assert_eq!((s.newest().expect("one").index, s.next(9)), (5, Some(6)));
        s.add(ready(6, true));
        s.add(ready(7, false));
        assert_eq!((s.newest().expect("one").index, s.ready.len()), (6, KEPT));
        s.wanted = 8;
        s.add(ready(8, true));
        assert_eq!((s.newest().expect("one").index, s.next(9)), (8, Some(0)));
    }

    #[test]
    fn files_are_read_and_one_that_cannot_be_says_why() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("one.csv");
        std::fs::write(&path, "x,y,z\n0,0,0\n0,0,1\n0,1,0\n").expect("written");
        let picture = Picture { radius: Some(0.5), ..Picture::default() };
        let (tell, told) = mpsc::channel();
        let files = vec![Some(path), Some(folder.path().join("none.csv"))];
        let player = Player::new(files, picture.clone(), move || _ = tell.send(()));
        let wait = || told.recv_timeout(Duration::from_secs(60)).expect("a file");
        wait();
        let first = player.newest().expect("ready").expect("read");
        assert_eq!((first.index, first.scene.particles.ellipsoids.len()), (0, 3));
        assert_eq!(first.points.as_ref().map(Vec::len), Some(3));
        wait();
        player.want(1);
        let why = player.newest().expect("ready").err().expect("it is not there");
        assert!(why.contains("none.csv"), "{why}");
        player.want(0);
        // Prepared otherwise it is read again.
        let mut other = picture;
        other.preparation.support = Some(3.0);
        player.prepare_for(&other);
        assert!(player.newest().is_none());
        wait();
        assert_eq!(player.newest().expect("ready").expect("read").scene.options.support, Some(3.0));
    }
}
