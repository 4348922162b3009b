//! Classes that hold over frames (`--memory`): those that a picture's particles have once so many frames before it have been gone
//! through. They follow from the files alone: a sequence that goes on has those of one in one go.

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
use std::error::Error;

/// What is known of a frame.
struct Known {
    frame: usize,
    radius: f64,
    options: Options,
    /// Of its particles; none where they cannot be read, or cannot be told one by one.
    densities: Option<Vec<f32>>,
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
        let most = plan.memory + usize::from(plan.counts);
        if most == 0 || particles.0.classes.is_some() || picture.preparer().on_device() {
            return Ok(Held::default());
        }
        let own = densities_of(picture, &particles.0)?;
        // Frames before the moment, the newest first, as long as there are the same particles.
        let end = moment.before();
        self.0.retain(|k| k.frame + most >= end && k.frame <= moment.frame && k.fits(picture));
        let mut before = Vec::new();
        for frame in (end.saturating_sub(most)..end).rev().filter(|_| particles.1 == 0) {
            let at = self.known(plan, picture, frame, read);
            match &self.0[at].densities {
                Some(found) if found.len() == own.len() => before.push(at),
                _ => break,
            }
        }
        let frames: Vec<&[f32]> = before.iter().filter_map(|at| self.0[*at].densities.as_deref()).collect();
        // Of this moment after the frames before it, or of the newest of these.
        let options = &picture.preparation;
        let upper = picture.keep_class_below.unwrap_or(options.splash_threshold);
        let classes = |last: &[&[f32]]| {
            let newest = &frames[..frames.len().min(plan.memory + 1 - last.len())];
            let window: Vec<&[f32]> = newest.iter().rev().chain(last).copied().collect();
            classes_over(&window, options, upper)
        };
        let now = classes(&[&own[..]])?;
        let changes = match plan.counts && !frames.is_empty() {
            true => Some(now.iter().zip(classes(&[])?).filter(|(a, b)| **a != *b).count()),
            false => None,
        };
        let of = |c: &Class| u8::from(*c == Class::Body);
        let held = Held { classes: (plan.memory > 0).then(|| now.iter().map(of).collect()), changes };
        if moment.toward == 0.0 && !self.0.iter().any(|k| k.frame == moment.frame) {
            self.0.push(Known::new(moment.frame, picture, (particles.1 == 0).then_some(own)));
        }
        Ok(held)
    }

    /// Where a frame is, which is read if it is not known.
    fn known(&mut self, plan: &Plan, picture: &Picture, frame: usize, read: &mut Read) -> usize {
        if let Some(at) = self.0.iter().position(|k| k.frame == frame) {
            return at;
        }
        // One that cannot be read has nothing to say here; its own picture says why.
        let found = read.alone(plan, picture, frame).ok().filter(|found| found.1 == 0);
        let densities = found.and_then(|found| densities_of(picture, &found.0).ok());
        self.0.push(Known::new(frame, picture, densities));
        self.0.len() - 1
    }
}

impl Known {
    fn new(frame: usize, picture: &Picture, densities: Option<Vec<f32>>) -> Known {
        Known { frame, radius: picture.radius.unwrap_or_default(), options: picture.preparation, densities }
    }

    /// Whether it is what this picture would find.
    fn fits(&self, picture: &Picture) -> bool {
        picture.radius == Some(self.radius) && picture.preparation == self.options
    }
}

fn densities_of(picture: &Picture, file: &ParticleFile) -> Result<Vec<f32>, PrepareError> {
    let options =
        Options { support: picture.preparation.support.or(file.support.map(|s| s as f32)), ..picture.preparation };
    densities(&local(&file.positions).1, picture.radius.unwrap_or_default() as f32, &options)
}
