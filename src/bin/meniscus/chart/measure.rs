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
    Equirect, FrameInput, Liquid, Settings,
    host::Session,
    inspect::Inspection,
    io::images,
    optics::Optics,
    profile::FrameTimes,
    study::{
        first, light_model,
        measures::{self, Linear, Means},
        search::Walked,
    },
};
use std::error::Error;

/// Frames that are drawn and not counted whenever another way has its turn.
const WARM_UP: u32 = 1;
/// Pixels at which walks are searched again, exactly; about as many in a field, where that takes longer.
const SEARCHED: usize = 1500;
const SEARCHED_IN_FIELD: usize = 250;

/// What is measured, and against what.
pub struct Job<'a> {
    /// Frames that are measured whenever a way has its turn, and turns that each has.
    pub frames: u32,
    pub rounds: u32,
    pub name: &'a str,
    pub picture: &'a Picture,
    pub scene: &'a Scene,
    pub truth: &'a Truth,
    /// Whether it is said where errors come from, which takes longer than to say how large they are.
    pub explained: bool,
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
    let of_points = |settings: &Settings| settings.method.layers.field().is_some();
    let mut given = None;
    let mut upload = None;
    let (camera, eye, _) = job.picture.camera(job.scene)?;
    let protocol = format!("{} {} {} {}", job.frames, job.rounds, job.picture.supersample, job.explained);
    let parts = [job.name, &job.truth.key, job.device, crate::report::COMMIT, &protocol];
    let keys: Vec<String> = ways.iter().map(|way| points::key(&parts, &way.settings)).collect();
    let mut found: Vec<Option<Point>> = keys.iter().map(|key| store.point(key)).collect();
    let visits = |p: &Option<Point>| p.as_ref().map_or(0, |p| p.visits.len() as u64);
    let bar = progress(u64::from(job.rounds) * ways.len() as u64, "measuring");
    bar.set_position(found.iter().map(visits).sum());
    bar.reset_eta();
    let mut judge = Judge { job, store, sky: Equirect::procedural_sky(), light: Vec::new() };
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
            let input = job.scene.input(&camera, &settings, eye, upload.as_ref());
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
                None => judge.point(way, key, &input, session)?,
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

/// Tells how far pictures are from a scene's truth, and why.
struct Judge<'a> {
    job: &'a Job<'a>,
    store: &'a Store,
    sky: Equirect,
    /// What each optics make of the truth's surface.
    light: Vec<(Optics, Liquid, Option<Means>)>,
}

impl Judge<'_> {
    /// The last frame's errors, without times yet; may draw one more that says what walks met.
    fn point(
        &mut self,
        way: &Way,
        key: &str,
        input: &FrameInput,
        session: &mut Session,
    ) -> Result<Point, Box<dyn Error>> {
        let (job, store, times) = (self.job, self.store, self.job.picture.supersample);
        let rendered = job.picture.rendered_size()?;
        let pixels = render::average(&session.picture()?, rendered, times);
        let picture = Linear { size: job.picture.size, pixels };
        let maps = measures::compare(&job.truth.picture, &picture)?;
        let path = store.picture(key);
        outputs::write(&path, &images::encode_picture(&path, picture.size, &picture.pixels)?)?;
        let path = store.error_map(key);
        outputs::write(&path, &images::encode_srgb_png(&path, picture.size, &measures::magma(&maps.flip))?)?;
        let mut point = Point {
            scene: job.name.to_owned(),
            method: way.method.clone(),
            varied: way.varied.clone(),
            settings: crate::choices::record(&way.settings),
            memory: session.renderer.memory().iter().map(|e| e.bytes).sum(),
            picture: maps.means(None)?,
            liquid: maps.means(Some(&job.truth.liquid()))?,
            surface: None,
            light_model: None,
            search: None,
            visits: Vec::new(),
        };
        if job.explained {
            self.explain(&mut point, input, session)?;
        }
        Ok(point)
    }

    /// Where the error comes from.
    fn explain(&mut self, point: &mut Point, input: &FrameInput, session: &mut Session) -> Result<(), Box<dyn Error>> {
        let (job, times) = (self.job, self.job.picture.supersample);
        session.renderer.inspect(Inspection { walks: true, ..Inspection::default() });
        session.frame(input)?;
        let frame = session.block()?;
        let walked = Walked::read(session, frame, input.settings, &job.scene.particles)?;
        session.renderer.inspect(Inspection::default());
        let radius = job.scene.particles.radius;
        point.surface = surface::fronts(&walked, input.camera, radius, job.picture.size, times).and_then(|seen| {
            let truth = job.truth.trace(|tracer, _| first::maps_at(tracer, surface::within(times)));
            measures::surface::compare(&truth, &seen, radius)
        });
        let most = if walked.field.is_some() { SEARCHED_IN_FIELD } else { SEARCHED };
        point.search = walked.error(input.settings, &self.sky, most);
        point.light_model = self.light_model(input.settings)?;
        Ok(())
    }

    /// Over the liquid; traced once for all methods with these optics.
    fn light_model(&mut self, settings: &Settings) -> Result<Option<Means>, Box<dyn Error>> {
        let (optics, liquid, truth) = (settings.method.optics, settings.liquid, self.job.truth);
        if let Some(known) = self.light.iter().find(|l| (l.0, l.1) == (optics, liquid)) {
            return Ok(known.2);
        }
        let radius = self.job.scene.particles.radius;
        let seen =
            truth.trace(|tracer, camera| light_model::picture(tracer, camera, settings, radius, light_model::EACH_WAY));
        let means = seen.map(|pixels| -> Result<Means, Box<dyn Error>> {
            let pixels = pixels.iter().map(|p| p.to_array()).collect();
            let maps = measures::compare(&truth.picture, &Linear { size: truth.picture.size, pixels })?;
            Ok(maps.means(Some(&truth.liquid()))?)
        });
        let means = means.transpose()?;
        self.light.push((optics, liquid, means));
        Ok(means)
    }
}
