//! Moments between the frames of a simulation, where particles have velocities, and when they are.

use super::{
    Args,
    frames::{Frame, Frames},
};
use crate::keys::hermite;
use glam::DVec3;
use meniscus::io::particles::ParticleFile;
use std::{path::PathBuf, str::FromStr};

/// Why there is nothing between two frames.
#[derive(Debug, thiserror::Error)]
pub enum BetweenError {
    #[error(
        "{} has {count} particles and {} has {next_count}: between them none can be followed. Leave out --step, which takes frames as \
         they are", file.display(), next.display()
    )]
    Count { file: PathBuf, count: usize, next: PathBuf, next_count: usize },
    #[error(
        "{} and {} have as many particles, but others: of id {id} only one has one, so that none can be followed. Leave out --step, which \
         takes frames as they are", file.display(), next.display()
    )]
    Others { file: PathBuf, next: PathBuf, id: u64 },
    #[error("{}: has no velocities, by which particles get from frame to frame. Export them, or leave out --step", .0.display())]
    NoVelocities(PathBuf),
    #[error("{}: particles were left out of it (--drop-invalid), so that none can be followed. Leave out --step", .0.display())]
    Dropped(PathBuf),
}

/// Why it is not known when pictures are to be taken.
#[derive(Debug, thiserror::Error)]
pub enum TimesError {
    #[error(
        "--step own: frames have no times of their own but as time steps of a .pvd; give the seconds from one to the next"
    )]
    None,
    #[error(
        "{count:.0} pictures of {end} simulated seconds are more than {MOST}: give a greater --speed, or --step in seconds if the \
         .pvd counts in another unit"
    )]
    Many { count: f64, end: f64 },
}

/// More pictures than anybody takes: eleven hours at 25 a second.
const MOST: u32 = 1_000_000;

/// What is from one frame to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// So many simulated seconds.
    Seconds(f64),
    /// What a collection's times say.
    Own,
}

impl FromStr for Step {
    type Err = String;

    fn from_str(text: &str) -> Result<Step, String> {
        if text == "own" { Ok(Step::Own) } else { super::above_zero(text).map(Step::Seconds) }
    }
}

/// A moment: a frame, and how far it is on the way to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    pub frame: usize,
    /// 0 to less than 1.
    pub toward: f64,
    /// Simulated seconds from that frame to the next.
    pub interval: f64,
}

impl Moment {
    /// How many frames lie before it.
    pub fn before(&self) -> usize {
        self.frame + usize::from(self.toward > 0.0)
    }
}

/// When pictures are taken.
pub struct Times<'a> {
    frames: &'a Frames,
    /// Simulated seconds of each frame since the first; pictures are of frames alone if there are none.
    seconds: Option<Vec<f64>>,
    /// Simulated seconds of a second of the film.
    speed: f64,
    fps: f64,
    subframes: u32,
    /// Part of a picture's time in which it is exposed.
    shutter: f64,
}

impl<'a> Times<'a> {
    pub fn new(args: &Args, frames: &'a Frames) -> Result<Times<'a>, TimesError> {
        let (speed, shutter) = (args.speed.unwrap_or(1.0), args.shutter.unwrap_or(0.5));
        let seconds = match args.step {
            None => None,
            Some(Step::Seconds(step)) => Some((0..frames.all().len()).map(|i| frames.place(i) * step).collect()),
            Some(Step::Own) => Some(frames.times().ok_or(TimesError::None)?),
        };
        Ok(Times { frames, seconds, speed, fps: args.fps, subframes: args.subframes.unwrap_or(1), shutter })
    }

    /// Each picture's number, and the seconds of the film at which it is exposed.
    pub fn pictures(&self) -> Result<Vec<(u64, Vec<f64>)>, TimesError> {
        let Some(seconds) = &self.seconds else {
            let frames = self.frames.all().iter().enumerate();
            return Ok(frames.map(|(i, f)| (f.number, vec![i as f64 / self.fps])).collect());
        };
        let last = seconds[seconds.len() - 1];
        let end = last / self.speed;
        // A last picture that rounding puts a little behind the end is there.
        let count = (end * self.fps + 1e-6).floor() + 1.0;
        if count > f64::from(MOST) {
            return Err(TimesError::Many { count, end: last });
        }
        let exposed = |k: u64| {
            let open = |j: u32| (f64::from(j) + 0.5) / f64::from(self.subframes) - 0.5;
            (0..self.subframes).map(move |j| ((k as f64 + self.shutter * open(j)) / self.fps).clamp(0.0, end)).collect()
        };
        Ok((0..count as u64).map(|k| (k, exposed(k))).collect())
    }

    /// What the simulation is like at a second of the film.
    pub fn moment(&self, time: f64) -> Moment {
        let Some(seconds) = &self.seconds else {
            return Moment { frame: (time * self.fps).round() as usize, toward: 0.0, interval: 0.0 };
        };
        let (second, last) = (time * self.speed, seconds.len() - 1);
        let frame = seconds.partition_point(|s| *s <= second).saturating_sub(1);
        if frame == last {
            return Moment { frame, toward: 0.0, interval: 0.0 };
        }
        let (from, to) = (seconds[frame], seconds[frame + 1]);
        // Nearer to a frame than rounding may put it is that frame.
        match (second - from) / (to - from) {
            toward if toward <= 1e-6 => Moment { frame, toward: 0.0, interval: 0.0 },
            toward if toward >= 1.0 - 1e-6 => Moment { frame: frame + 1, toward: 0.0, interval: 0.0 },
            toward => Moment { frame, toward, interval: to - from },
        }
    }
}

/// What is to be said of frames' own times where pictures are not taken by them.
pub fn note(step: Option<Step>, frames: &Frames) -> Option<String> {
    let times = frames.times()?;
    let gaps = || times.windows(2).map(|two| two[1] - two[0]);
    let (least, most) = (gaps().fold(f64::MAX, f64::min), gaps().fold(0.0, f64::max));
    let (shown, differ) = match step {
        Some(Step::Own) => return None,
        Some(Step::Seconds(s)) => (format!("--step has them {s} apart"), least.min(s) < 0.99 * most.max(s)),
        None => ("each is shown for as long".into(), least < 0.99 * most),
    };
    let range = if least < most { format!("{least} to {most}") } else { least.to_string() };
    let note =
        || format!("note: by their own times frames are {range} apart, and {shown}: --step own goes by these times");
    differ.then(note)
}

/// Particles on their way from one frame to the next: along cubics that have both frames' positions and velocities.
pub fn between(
    (first, a): (&Frame, &(ParticleFile, usize)),
    (second, b): (&Frame, &(ParticleFile, usize)),
    moment: &Moment,
) -> Result<ParticleFile, BetweenError> {
    for (frame, (_, dropped)) in [(first, a), (second, b)] {
        if *dropped > 0 {
            return Err(BetweenError::Dropped(frame.file.clone()));
        }
    }
    let (a, b) = (&a.0, &b.0);
    let (count, next_count) = (a.positions.len(), b.positions.len());
    if count != next_count {
        let (file, next) = (first.file.clone(), second.file.clone());
        return Err(BetweenError::Count { file, count, next, next_count });
    }
    // In the order of their ids, where these differ.
    let ids = a.ids.as_deref().unwrap_or_default().iter().zip(b.ids.as_deref().unwrap_or_default());
    if let Some((id, other)) = ids.into_iter().find(|(id, other)| id != other) {
        let (file, next) = (first.file.clone(), second.file.clone());
        return Err(BetweenError::Others { file, next, id: *id.min(other) });
    }
    let velocities = |frame: &Frame, file: &'_ ParticleFile| {
        file.velocities.is_some().then_some(()).ok_or_else(|| BetweenError::NoVelocities(frame.file.clone()))
    };
    velocities(first, a)?;
    velocities(second, b)?;
    let none = Vec::new();
    let (va, vb) = (a.velocities.as_ref().unwrap_or(&none), b.velocities.as_ref().unwrap_or(&none));
    let (s, dt) = (moment.toward, moment.interval);
    let [start, end, leaving, arriving] = hermite(s);
    let along = |i: usize| -> DVec3 {
        start * a.positions[i] + end * b.positions[i] + dt * (leaving * va[i] + arriving * vb[i])
    };
    let nearer = if s < 0.5 { a } else { b };
    Ok(ParticleFile {
        positions: (0..count).map(along).collect(),
        velocities: Some((0..count).map(|i| va[i].lerp(vb[i], s)).collect()),
        radius: nearer.radius,
        support: nearer.support,
        classes: nearer.classes.clone(),
        ids: nearer.ids.clone(),
        axes: nearer.axes.clone(),
    })
}
