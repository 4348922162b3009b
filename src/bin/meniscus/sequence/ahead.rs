//! Reading and preparing the next frame while this one is drawn.

use super::{
    ms_since,
    plan::{Exposure, Plan},
};
use crate::scene::Scene;
use std::{
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
}

/// Starts the thread: it gives every exposure of the pictures that are not there, in order; of a picture whose frame cannot be
/// had it gives why, and goes on with the next picture. One waits to be taken, and no more is made until then.
pub fn start<'s>(scope: &'s Scope<'s, '_>, plan: &'s Plan) -> Receiver<Result<Ready, String>> {
    let (give, ready) = sync_channel(0);
    scope.spawn(move || {
        for shot in plan.shots.iter().filter(|s| !s.kept) {
            for exposure in &shot.exposures {
                let next = load(plan, exposure).map_err(|e| e.to_string());
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

fn load(plan: &Plan, exposure: &Exposure) -> Result<Ready, Box<dyn Error>> {
    let (picture, file) = (&exposure.picture, Some(plan.frames.all()[exposure.frame].file.as_path()));
    let begin = Instant::now();
    let read = Scene::read(picture, file)?;
    let read_ms = ms_since(begin);
    let begin = Instant::now();
    let scene = picture.prepared(read, file, picture.preparer())?;
    Ok(Ready { scene, read_ms, prepare_ms: ms_since(begin) })
}
