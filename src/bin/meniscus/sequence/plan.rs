//! What a sequence consists of: which picture is of which frame, from where and how it is seen, and whether it is there already.

use super::{
    Args,
    between::{Moment, Times},
    check,
    film::Kind,
    frames::{Frames, FramesError, Pattern},
    kept, table,
};
use crate::{
    camera_file::Cameras,
    compositing::{self, Background},
    outputs,
    picture::Picture,
    scene::Prepare,
};
use glam::{DVec3, Vec3};
use meniscus::io::images;
use rayon::prelude::*;
use std::{error::Error, path::PathBuf};

pub const NO_PICTURES: &str = "parts of a film are numbered pictures: name them too, such as --output 'out/####.png'";

/// One picture of the sequence.
pub struct Shot {
    pub number: u64,
    /// What is drawn for it.
    pub exposures: Vec<Exposure>,
    /// Where it goes.
    pub files: Vec<PathBuf>,
    /// By what it is known when the sequence goes on.
    pub label: String,
    /// Whether it is there already.
    pub kept: bool,
}

/// One moment of the simulation, and how it is seen.
pub struct Exposure {
    /// With nothing left open.
    pub picture: Picture,
    pub moment: Moment,
}

pub struct Plan {
    pub frames: Frames,
    /// Whether pictures are taken between frames.
    pub between: bool,
    pub shots: Vec<Shot>,
    /// How many frames before a picture's decide its classes.
    pub memory: usize,
    /// Whether changes of classes are counted.
    pub counts: bool,
    /// Made anew, of all pictures.
    pub films: Vec<(PathBuf, Kind)>,
    /// Where rows go.
    pub stats: Option<PathBuf>,
}

/// What was left to the scene, as the first frame decides it, so that it is the same in all: nothing jumps, and a sequence
/// that is made in parts is what it is in one go.
struct Settled {
    radius: f64,
    eye: Option<DVec3>,
    target: Option<DVec3>,
    absorption: Vec3,
}

impl Settled {
    fn of(picture: &Picture, frames: &Frames) -> Result<Settled, Box<dyn Error>> {
        let camera = &picture.camera;
        let given = camera.eye.is_some() && camera.target.is_some() && picture.absorption_given;
        if let Some(radius) = picture.radius.filter(|_| given) {
            let absorption = picture.settings.liquid.absorption;
            return Ok(Settled { radius, eye: camera.eye, target: camera.target, absorption });
        }
        let scene = picture.load(Some(&frames.all()[0].file), picture.preparer())?;
        let settled = picture.clone().settled(&scene)?;
        Ok(Settled {
            radius: settled.radius.unwrap_or(f64::from(scene.particles.radius)),
            eye: settled.camera.eye,
            target: settled.camera.target,
            absorption: settled.settings.liquid.absorption,
        })
    }

    fn complete(&self, picture: &mut Picture) {
        picture.radius.get_or_insert(self.radius);
        picture.camera.eye = picture.camera.eye.or(self.eye);
        picture.camera.target = picture.camera.target.or(self.target);
        if !picture.absorption_given {
            picture.settings.liquid.absorption = self.absorption;
            picture.absorption_given = true;
        }
    }
}

impl Plan {
    pub fn new(args: &Args) -> Result<Plan, Box<dyn Error>> {
        if args.options.camera_frame.is_some() {
            return Err("--camera-frame is one frame, and a sequence has many: leave it out".into());
        }
        if args.options.time.is_some() {
            return Err("--time is one moment, and a sequence has many: leave it out".into());
        }
        let memory = args.memory.unwrap_or(0) as usize;
        let scene_file = args.options.scene_file()?;
        let base = |time| scene_file.as_ref().map_or_else(|| Ok(Picture::default()), |file| file.at(time));
        let mut cameras = Cameras::default();
        let mut at = |time, frame| -> Result<Picture, Box<dyn Error>> {
            let base = base(time)?;
            if args.turn.is_some() && base.camera.file.is_some() {
                return Err("--turn goes around a target, and a camera file has none: leave one of them out".into());
            }
            let mut picture = args.options.over_seen(base, None, Some(frame), &mut cameras)?;
            args.compositing.apply(&mut picture);
            // A tenth above the threshold is plenty.
            let upper = args.keep_class_below.map_or(1.1 * picture.preparation.splash_threshold, |u| u as f32);
            picture.keep_class_below = (memory > 0).then_some(upper);
            picture.prepare.get_or_insert(Prepare::Cpu);
            Ok(picture)
        };
        let particles = base(0.0)?.particles;
        let inputs = match &particles {
            Some(particles) if args.inputs.is_empty() => std::slice::from_ref(particles),
            _ => &args.inputs,
        };
        let frames = Frames::find(inputs)?;
        let patterns = patterns(args)?;
        if args.part.is_some() && patterns.is_empty() {
            return Err(NO_PICTURES.into());
        }
        let times = Times::new(args, &frames);
        let pictures = times.pictures();
        let numbers: Vec<_> = pictures.iter().map(|p| p.0).collect();
        let wanted = |n: &u64| args.frames.is_none_or(|s| s.has(*n));
        let (first, last) = (numbers[0], numbers[numbers.len() - 1]);
        let named: Vec<_> =
            numbers.iter().filter(|n| wanted(n)).flat_map(|n| patterns.iter().map(|p| p.name(*n))).collect();
        if let Some(selection) = args.frames.filter(|_| !numbers.iter().any(wanted)) {
            return Err(FramesError::Unselected { selection, first, last }.into());
        }
        let mut others: Vec<outputs::Named> = Vec::new();
        others.extend(args.options.scene.as_deref().map(|p| ("the scene file (--scene)", p)));
        others.extend(frames.all().iter().map(|f| ("a particle file", f.file.as_path())));

        let picture = at(0.0, frames.number(0, 0.0))?;
        others.extend(picture.environment.file.as_deref().map(|p| ("the environment map (--env)", p)));
        if memory > 0 && picture.preparer().on_device() {
            return Err("--memory keeps classes that the CPU finds: leave it out, or use --prepare cpu".into());
        }
        compositing::check(&picture, args.output.iter().map(PathBuf::as_path))?;
        if let Some(film) = args.output.iter().find(|p| Kind::of(p).is_some() && picture.background == Background::None)
        {
            let remedy = "write numbered pictures (out/####.png), or leave out --background none";
            return Err(format!("{}: films have no transparency: {remedy}", film.display()).into());
        }
        check(args, &named, &others)?;
        let settled = Settled::of(&picture, &frames)?;
        // All of it over all pictures: a film that begins anew goes on turning.
        let turn = args.turn.unwrap_or(0.0) / pictures.len() as f64;
        let mut shots = Vec::new();
        let made: Vec<_> = pictures.iter().filter(|p| wanted(&p.0)).collect();
        for (number, exposed) in &made[args.part.map_or(0..made.len(), |part| part.range(made.len()))] {
            let expose = |time: &f64| -> Result<_, Box<dyn Error>> {
                let moment = times.moment(*time);
                let mut picture = at(*time, frames.number(moment.frame, moment.toward))?;
                picture.particles = None;
                settled.complete(&mut picture);
                picture.camera.orbit += turn * (time * args.fps);
                Ok(Exposure { picture, moment })
            };
            let exposures = exposed.iter().map(expose).collect::<Result<Vec<_>, _>>()?;
            let number = *number;
            let label = kept::label(&exposures, &frames, memory);
            let files = patterns.iter().map(|p| p.name(number)).collect();
            shots.push(Shot { number, exposures, files, label, kept: false });
        }
        let size = picture.size;
        let finished = |s: &Shot| !s.files.is_empty() && s.files.iter().all(|f| kept::finished(f, &s.label, size));
        shots.par_iter_mut().for_each(|s| s.kept = finished(s));
        let mut films: Vec<_> = args.output.iter().filter_map(|p| Some((p.clone(), Kind::of(p)?))).collect();
        if args.part.is_some() {
            films.clear();
        }
        let (between, stats) = (args.step.is_some(), table::path(args));
        Ok(Plan { frames, between, shots, memory, counts: args.stats.is_some(), films, stats })
    }

    /// The first picture's name, and the last one's; and films.
    pub fn names(&self) -> String {
        let name = |shot: Option<&Shot>| shot.and_then(|s| s.files.first()).map(|f| f.display().to_string());
        let mut names = Vec::new();
        if let (Some(first), Some(last)) = (name(self.shots.first()), name(self.shots.last())) {
            names.push(if first == last { first } else { format!("{first} to {last}") });
        }
        names.extend(self.films.iter().map(|f| f.0.display().to_string()));
        names.join(", ")
    }
}

/// What pictures are called; their folders are there.
fn patterns(args: &Args) -> Result<Vec<Pattern>, Box<dyn Error>> {
    let mut patterns = Vec::new();
    for path in args.output.iter().filter(|p| Kind::of(p).is_none()) {
        images::check_extension(path).map_err(|e| format!("{e}; or a film: .mp4, .mkv, .webm, .gif"))?;
        let pattern = Pattern::new(path)?;
        if patterns.contains(&pattern) {
            let [option, other] = ["one output (--output)", "another"];
            return Err(outputs::OutputError::Clash { path: path.clone(), option, other }.into());
        }
        outputs::folder(pattern.folder())?;
        patterns.push(pattern);
    }
    Ok(patterns)
}
