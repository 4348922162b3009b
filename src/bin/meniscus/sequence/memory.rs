//! Classes that hold over frames (`--memory`): those that a picture's particles have once so many frames before it have been gone
//! through. They follow from the files alone: a sequence that goes on has those of one in one go. Particles are followed by their
//! ids, or by their order where files have none.

use super::{
    ahead::Read,
    plan::{Exposure, Plan},
};
use crate::{picture::Picture, scene::local};
use meniscus::{
    Class,
    io::particles::ParticleFile,
    prepare::{Options, PrepareError, classes_over, densities},
};
use std::{borrow::Cow, error::Error};

/// What is known of a frame.
struct Known {
    frame: usize,
    radius: f64,
    options: Options,
    /// None where they cannot be read.
    particles: Option<Dense>,
}

/// Densities of a frame's particles, and what tells them one by one.
struct Dense {
    densities: Vec<f32>,
    /// Rising, where they have any.
    ids: Option<Vec<u64>>,
    /// Whether all of the file's are there, so that where there are no ids the order tells them.
    whole: bool,
}

/// Densities of frames that are needed again.
#[derive(Default)]
pub struct Memory(Vec<Known>);

/// What the frames before make of a picture's particles.
#[derive(Default)]
pub struct Held {
    /// For each particle 0 (splash) or 1 (body).
    pub classes: Option<Vec<u8>>,
    /// Of how many the class is another than in the frame before; nothing where none can be compared.
    pub changes: Option<usize>,
}

impl Memory {
    pub fn held(
        &mut self,
        plan: &Plan,
        exposure: &Exposure,
        particles: &(ParticleFile, usize),
        read: &mut Read,
    ) -> Result<Held, Box<dyn Error>> {
        let (picture, moment) = (&exposure.picture, &exposure.moment);
        let most = plan.looks_back();
        if most == 0 || particles.0.classes.is_some() || picture.preparer().on_device() {
            return Ok(Held::default());
        }
        let own = Dense::of(picture, particles)?;
        // Frames before the moment, the newest first, as long as particles can be followed.
        let end = moment.before();
        self.0.retain(|k| k.frame + most >= end && k.frame <= moment.frame && k.fits(picture));
        let mut before = Vec::new();
        for frame in (end.saturating_sub(most)..end).rev() {
            let at = self.known(plan, picture, frame, read);
            match &self.0[at].particles {
                Some(found) if own.follows(found) => before.push(at),
                _ => break,
            }
        }
        let mut known: Vec<Cow<[f32]>> = Vec::new();
        for found in before.iter().filter_map(|at| self.0[*at].particles.as_ref()) {
            // A particle that is not there begins later: with the density that it has then, twice of which is once.
            let later = known.last().map_or(own.densities.as_slice(), |frame| frame);
            known.push(own.seen_in(found, later));
        }
        let frames: Vec<&[f32]> = known.iter().map(|frame| &**frame).collect();
        // Of this moment after the frames before it, or of the newest of these.
        let options = &picture.preparation;
        let upper = picture.keep_class_below.unwrap_or(options.splash_threshold);
        let classes = |last: &[&[f32]]| {
            let newest = &frames[..frames.len().min(plan.memory + 1 - last.len())];
            let window: Vec<&[f32]> = newest.iter().rev().chain(last).copied().collect();
            classes_over(&window, options, upper)
        };
        let now = classes(&[&own.densities[..]])?;
        let changes = match plan.counts && !frames.is_empty() {
            true => Some(now.iter().zip(classes(&[])?).filter(|(a, b)| **a != *b).count()),
            false => None,
        };
        let of = |c: &Class| u8::from(*c == Class::Body);
        let held = Held { classes: (plan.memory > 0).then(|| now.iter().map(of).collect()), changes };
        if moment.toward == 0.0 && !self.0.iter().any(|k| k.frame == moment.frame) {
            self.0.push(Known::new(moment.frame, picture, Some(own)));
        }
        Ok(held)
    }

    /// Where a frame is, which is read if it is not known.
    fn known(&mut self, plan: &Plan, picture: &Picture, frame: usize, read: &mut Read) -> usize {
        if let Some(at) = self.0.iter().position(|k| k.frame == frame) {
            return at;
        }
        // One that cannot be read has nothing to say here; its own picture says why.
        let found = read.alone(plan, picture, frame).ok();
        let particles = found.and_then(|found| Dense::of(picture, &found).ok());
        self.0.push(Known::new(frame, picture, particles));
        self.0.len() - 1
    }
}

impl Known {
    fn new(frame: usize, picture: &Picture, particles: Option<Dense>) -> Known {
        Known { frame, radius: picture.radius.unwrap_or_default(), options: picture.preparation, particles }
    }

    /// Whether it is what this picture would find.
    fn fits(&self, picture: &Picture) -> bool {
        picture.radius == Some(self.radius) && picture.preparation == self.options
    }
}

impl Dense {
    /// Of a file that was read, which puts particles in the order of their ids, and how many were left out of it.
    fn of(picture: &Picture, (file, dropped): &(ParticleFile, usize)) -> Result<Dense, PrepareError> {
        let support = picture.preparation.support.or(file.support.map(|s| s as f32));
        let options = Options { support, ..picture.preparation };
        let densities = densities(&local(&file.positions).1, picture.radius.unwrap_or_default() as f32, &options)?;
        // Of particles with one id none can be followed by it.
        let ids = file.ids.clone().filter(|ids| ids.windows(2).all(|two| two[0] < two[1]));
        Ok(Dense { densities, ids, whole: *dropped == 0 })
    }

    /// Whether its particles can be found in another frame.
    fn follows(&self, other: &Dense) -> bool {
        match (&self.ids, &other.ids) {
            (Some(_), Some(_)) => true,
            (None, None) => self.whole && other.whole && self.densities.len() == other.densities.len(),
            _ => false,
        }
    }

    /// The densities of its particles in a frame in which they can be found; of those that are not there what is given.
    fn seen_in<'a>(&self, other: &'a Dense, otherwise: &[f32]) -> Cow<'a, [f32]> {
        match (&self.ids, &other.ids) {
            (Some(own), Some(ids)) if own != ids => {
                let density = |(id, otherwise): (&u64, &f32)| match ids.binary_search(id) {
                    Ok(at) => other.densities[at],
                    Err(_) => *otherwise,
                };
                own.iter().zip(otherwise).map(density).collect()
            }
            _ => Cow::Borrowed(&other.densities),
        }
    }
}
