//! Reading and preparing the next frame while this one is drawn.

use super::{
    between::{Moment, between},
    memory::Memory,
    ms_since,
    plan::{Exposure, First, Plan},
};
use crate::{picture::Picture, scene::Scene};
use meniscus::{
    host::DeviceInfo,
    io::particles::{ParticleFile, ReadError},
};
use std::{
    borrow::Cow,
    error::Error,
    sync::mpsc::{Receiver, sync_channel},
    thread::Scope,
    time::Instant,
};

/// A moment that can be drawn.
pub struct Ready {
    pub scene: Scene,
    pub read_ms: f64,
    /// All that came after reading: classes, ellipsoids, the density at the eye.
    pub prepare_ms: f64,
    /// Particles whose class is another than in the frame before, where that is known.
    pub class_changes: Option<usize>,
}

/// Starts the thread: it gives every exposure of the pictures that are not there, in order; of a picture whose frame cannot be
/// had it gives why, and goes on with the next picture. One waits to be taken, and no more is made until then.
pub fn start<'s>(
    scope: &'s Scope<'s, '_>,
    plan: &'s Plan,
    mut first: Option<First>,
    device: Option<&'s DeviceInfo>,
) -> Receiver<Result<Ready, String>> {
    let (give, ready) = sync_channel(0);
    scope.spawn(move || {
        let known = first.as_mut().and_then(|first| first.read.take());
        let (mut read, mut memory) = (Read(known.map(|known| (0, known)).into_iter().collect()), Memory::default());
        for shot in plan.shots.iter().filter(|s| !s.kept) {
            for exposure in &shot.exposures {
                // The very first or none.
                let first = first.take().filter(|first| first.is(exposure));
                let next = load(plan, exposure, (&mut read, &mut memory), first, device).map_err(|e| e.to_string());
                let failed = next.is_err();
                if give.send(next).is_err() {
                    return; // nobody draws any more
                }
                if failed {
                    break;
                }
            }
        }
    });
    ready
}

/// What was read of frames that are needed again: two at most.
#[derive(Default)]
pub struct Read(Vec<(usize, (ParticleFile, usize))>);

impl Read {
    /// A frame's particles.
    fn frame(&mut self, plan: &Plan, picture: &Picture, frame: usize) -> Result<&(ParticleFile, usize), ReadError> {
        let at = match self.0.iter().position(|(f, _)| *f == frame) {
            Some(at) => at,
            None => {
                self.0.retain(|(f, _)| *f + 1 == frame);
                self.0.push((frame, plan.frames.all()[frame].read(picture)?));
                self.0.len() - 1
            }
        };
        Ok(&self.0[at].1)
    }

    /// A frame's particles, which are not kept for another time.
    pub fn alone(
        &self,
        plan: &Plan,
        picture: &Picture,
        frame: usize,
    ) -> Result<Cow<'_, (ParticleFile, usize)>, ReadError> {
        match self.0.iter().find(|(f, _)| *f == frame) {
            Some((_, found)) => Ok(Cow::Borrowed(found)),
            None => plan.frames.all()[frame].read(picture).map(Cow::Owned),
        }
    }

    /// The particles of a moment.
    fn moment(
        &mut self,
        plan: &Plan,
        picture: &Picture,
        moment: &Moment,
    ) -> Result<(ParticleFile, usize), Box<dyn Error>> {
        let frames = plan.frames.all();
        if !plan.between {
            let own = self.0.iter().position(|(frame, _)| *frame == moment.frame).map(|at| self.0.swap_remove(at).1);
            self.0.retain(|(frame, _)| frame + plan.looks_back() >= moment.frame);
            return own.map_or_else(|| Ok(frames[moment.frame].read(picture)?), Ok);
        }
        if moment.toward == 0.0 {
            return Ok(self.frame(plan, picture, moment.frame)?.clone());
        }
        self.frame(plan, picture, moment.frame)?;
        self.frame(plan, picture, moment.frame + 1)?;
        let [a, b] = [0, 1].map(|i| moment.frame + i).map(|f| self.0.iter().find(|(frame, _)| *frame == f));
        let (Some((i, a)), Some((j, b))) = (a, b) else { return Err("a frame was not kept; report this".into()) };
        Ok((between((&frames[*i], a), (&frames[*j], b), moment)?, 0))
    }
}

fn load(
    plan: &Plan,
    exposure: &Exposure,
    (read, memory): (&mut Read, &mut Memory),
    first: Option<First>,
    device: Option<&DeviceInfo>,
) -> Result<Ready, Box<dyn Error>> {
    let first = match first {
        Some(First { scene: Some(scene), read_ms, prepare_ms, .. }) if plan.looks_back() == 0 => {
            return Ok(Ready { scene, read_ms, prepare_ms, class_changes: None });
        }
        other => other,
    };
    let picture = &exposure.picture;
    let begin = Instant::now();
    let mut particles = read.moment(plan, picture, &exposure.moment)?;
    let read_ms = ms_since(begin) + first.as_ref().map_or(0.0, |first| first.read_ms);
    let begin = Instant::now();
    let file = plan.frames.all()[exposure.moment.frame].file.as_path();
    let held = memory.held(plan, exposure, &particles, read).map_err(|e| format!("{}: {e}", file.display()))?;
    let before = first.as_ref().map_or(0.0, |first| first.prepare_ms);
    let scene = match first.and_then(|first| first.scene) {
        Some(scene) => scene,
        None => {
            particles.0.classes = held.classes.or(particles.0.classes.take());
            picture.prepared(device, particles, Some(file), picture.preparer())?
        }
    };
    Ok(Ready { scene, read_ms, prepare_ms: ms_since(begin) + before, class_changes: held.changes })
}
