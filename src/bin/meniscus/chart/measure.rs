//! Times and errors of all ways to draw one scene.

use super::{
    points::{self, Point, Visit, Way},
    store::Store,
    surface,
};
use crate::{
    bench, outputs,
    picture::Picture,
    render,
    scene::{Scene, progress},
    truth::Truth,
};
use meniscus::{
    Camera, FrameInput, Settings,
    host::Session,
    io::images,
    layers::Layers,
    profile::FrameTimes,
    study::measures::{self, Linear},
};
use std::error::Error;

/// Frames that are drawn and not counted whenever another way has its turn.
const WARM_UP: u32 = 1;

/// What is measured, and against what.
pub struct Job<'a> {
    /// Frames that are measured whenever a way has its turn, and turns that each has.
    pub frames: u32,
    pub rounds: u32,
    pub name: &'a str,
    pub picture: &'a Picture,
    pub scene: &'a Scene,
    pub truth: &'a Truth,
    pub device: &'a str,
}

/// Draws all ways in turns, round by round, from where a run before left off; each point is kept as soon as it is measured.
pub fn all(
    job: &Job,
    ways: &[Way],
    store: &Store,
    session: &mut Session,
) -> Result<Vec<(String, Point)>, Box<dyn Error>> {
    // A density field is made of other things than maps are.
    let of_points = |settings: &Settings| matches!(settings.method.layers, Layers::Field(_));
    let mut given = None;
    let mut upload = None;
    let (camera, eye, _) = job.picture.camera(job.scene)?;
    let protocol = format!("{} {} {}", job.frames, job.rounds, job.picture.supersample);
    let parts = [job.name, &job.truth.key, job.device, crate::report::COMMIT, &protocol];
    let keys: Vec<String> = ways.iter().map(|way| points::key(&parts, &way.settings)).collect();
    let mut found: Vec<Option<Point>> = keys.iter().map(|key| store.point(key)).collect();
    let visits = |p: &Option<Point>| p.as_ref().map_or(0, |p| p.visits.len() as u64);
    let bar = progress(u64::from(job.rounds) * ways.len() as u64, "measuring");
    bar.set_position(found.iter().map(visits).sum());
    bar.reset_eta();
    for round in 0..u64::from(job.rounds) {
        for ((way, key), point) in ways.iter().zip(&keys).zip(&mut found) {
            if visits(point) > round {
                continue;
            }
            let picture = Picture { settings: way.settings, ..job.picture.clone() };
            let settings = picture.frame_settings(&job.scene.particles)?;
            if given != Some(of_points(&settings)) {
                upload = job.scene.give(job.picture.preparer(), &settings, session)?;
                given = Some(of_points(&settings));
            }
            let mut input = FrameInput::new(0, &camera, &settings, ash::vk::ImageView::null());
            input.eye_inside = job.scene.inside(eye);
            input.positions = upload.as_ref().map(|u| job.scene.on_device(u));
            let mut frames: Vec<FrameTimes> = Vec::new();
            for i in 0..WARM_UP + job.frames {
                let times = session.frame(&input)?.ok_or("this device has no timestamps: nothing can be measured")?;
                if i >= WARM_UP {
                    frames.push(times);
                }
            }
            let visit = Visit {
                sum: frames.iter().map(|f| f.passes.iter().map(|p| p.ms).sum()).collect(),
                passes: bench::sums(&frames, |p| &p.name),
            };
            let mut now = match point.take() {
                Some(point) => point,
                None => judge(job, way, key, store, &camera, session)?,
            };
            now.visits.push(visit);
            store.keep(key, &now)?;
            *point = Some(now);
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    Ok(keys.into_iter().zip(found.into_iter().flatten()).collect())
}

/// The last frame's error against the truth, without times yet.
fn judge(
    job: &Job,
    way: &Way,
    key: &str,
    store: &Store,
    camera: &Camera,
    session: &mut Session,
) -> Result<Point, Box<dyn Error>> {
    let size = job.picture.rendered_size()?;
    let pixels = render::average(&session.picture()?, size, job.picture.supersample);
    let picture = Linear { size: job.picture.size, pixels };
    let maps = measures::compare(&job.truth.picture, &picture)?;
    let path = store.picture(key);
    outputs::write(&path, &images::encode_picture(&path, picture.size, &picture.pixels)?)?;
    let path = store.error_map(key);
    outputs::write(&path, &images::encode_srgb_png(&path, picture.size, &measures::magma(&maps.flip))?)?;
    let radius = job.scene.particles.radius;
    let fronts = surface::fronts(session, camera, radius, picture.size, job.picture.supersample)?;
    Ok(Point {
        scene: job.name.to_owned(),
        method: way.method.clone(),
        varied: way.varied.clone(),
        settings: crate::choices::record(&way.settings),
        memory: session.renderer.memory().iter().map(|e| e.bytes).sum(),
        picture: maps.means(None)?,
        liquid: maps.means(Some(&job.truth.liquid()))?,
        surface: fronts.and_then(|seen| measures::surface::compare(&job.truth.first, &seen, radius)),
        visits: Vec::new(),
    })
}
