//! What a sequence consists of: which picture is of which frame, from where and how it is seen, and whether it is there already.

use super::{
    Args,
    between::{Moment, Times},
    check,
    film::Kind,
    frames::{Frames, FramesError, Pattern},
    kept, ms_since, table,
};
use crate::{
    camera_file::Cameras,
    compositing::{self, Background},
    outputs,
    picture::Picture,
    scene::{Prepare, Scene},
    scene_file::{SceneFile, SceneFileError},
};
use glam::{DVec3, Vec3};
use meniscus::{
    host::DeviceInfo,
    io::{images, particles::ParticleFile},
};
use rayon::prelude::*;
use std::{error::Error, path::PathBuf, time::Instant};

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
    /// The first of them, where it had to be prepared.
    pub first: Option<First>,
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

/// The first frame as it was prepared to find what was left open: whoever draws it takes it from here.
pub struct First {
    /// What may be drawn of it, if it is drawn.
    pub scene: Option<Scene>,
    /// What it was prepared as.
    picture: Picture,
    /// What was read, if that is needed once more.
    pub read: Option<(ParticleFile, usize)>,
    pub read_ms: f64,
    pub prepare_ms: f64,
}

impl First {
    /// Whether it is what would be prepared for this.
    pub fn is(&self, exposure: &Exposure) -> bool {
        let prepared = |p: &Picture| (p.preparation, p.preparer(), p.drop_invalid, p.max_memory);
        let picture = &exposure.picture;
        let own = self.scene.as_ref().map(|scene| scene.particles.radius);
        let radius = own.is_some() && picture.radius.map(|r| r as f32) == own;
        // What classes hold is decided by the frames before.
        let own = radius && picture.keep_class_below.is_none() && prepared(picture) == prepared(&self.picture);
        own && exposure.moment.frame == 0 && exposure.moment.toward == 0.0
    }
}

impl Settled {
    /// Prepares the first frame if anything is left open; its particles are kept as well if `again` they are needed.
    fn of(
        picture: &Picture,
        frames: &Frames,
        device: Option<&DeviceInfo>,
        again: bool,
    ) -> Result<(Settled, Option<First>), Box<dyn Error>> {
        let camera = &picture.camera;
        let given = camera.eye.is_some() && camera.target.is_some() && picture.absorption_given;
        if let Some(radius) = picture.radius.filter(|_| given) {
            let absorption = picture.settings.liquid.absorption;
            return Ok((Settled { radius, eye: camera.eye, target: camera.target, absorption }, None));
        }
        let begin = Instant::now();
        let first = &frames.all()[0];
        let particles = first.read(picture)?;
        let read_ms = ms_since(begin);
        let begin = Instant::now();
        let read = again.then(|| particles.clone());
        let scene = picture.prepared(device, particles, Some(&first.file), picture.preparer())?;
        let prepare_ms = ms_since(begin);
        let settled = picture.clone().settled(&scene)?;
        let found = Settled {
            radius: settled.radius.unwrap_or(f64::from(scene.particles.radius)),
            eye: settled.camera.eye,
            target: settled.camera.target,
            absorption: settled.settings.liquid.absorption,
        };
        Ok((found, Some(First { scene: Some(scene), picture: picture.clone(), read, read_ms, prepare_ms })))
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

/// How the film is seen at its seconds, as it is asked for.
struct Views<'a> {
    args: &'a Args,
    scene_file: Option<SceneFile>,
    cameras: Cameras,
}

impl Views<'_> {
    fn base(&self, time: f64) -> Result<Picture, SceneFileError> {
        self.scene_file.as_ref().map_or_else(|| Ok(Picture::default()), |file| file.at(time))
    }

    fn at(&mut self, time: f64, frame: f64) -> Result<Picture, Box<dyn Error>> {
        let (base, args) = (self.base(time)?, self.args);
        if args.turn.is_some() && base.camera.file.is_some() {
            return Err("--turn goes around a target, and a camera file has none: leave one of them out".into());
        }
        let mut picture = args.options.over_seen(base, None, Some(frame), &mut self.cameras)?;
        args.compositing.apply(&mut picture);
        // A tenth above the threshold is plenty.
        let upper = args.keep_class_below.map_or(1.1 * picture.preparation.splash_threshold, |u| u as f32);
        picture.keep_class_below = args.memory.map(|_| upper);
        picture.prepare.get_or_insert(Prepare::Cpu);
        Ok(picture)
    }
}

/// What is known of a sequence before particles are read.
pub struct Outline<'a> {
    args: &'a Args,
    views: Views<'a>,
    frames: Frames,
    patterns: Vec<Pattern>,
    /// Each picture's number, and the seconds of the film at which it is exposed: of all, and those that are to be made.
    all: usize,
    made: Vec<(u64, Vec<f64>)>,
    /// The first of all, with what is left open.
    picture: Picture,
}

impl<'a> Outline<'a> {
    pub fn new(args: &'a Args) -> Result<Outline<'a>, Box<dyn Error>> {
        if args.options.camera_frame.is_some() {
            return Err("--camera-frame is one frame, and a sequence has many: leave it out".into());
        }
        if args.options.time.is_some() {
            return Err("--time is one moment, and a sequence has many: leave it out".into());
        }
        let scene_file = args.options.scene_file()?;
        let mut views = Views { args, scene_file, cameras: Cameras::default() };
        let particles = views.base(0.0)?.particles;
        let inputs = match &particles {
            Some(particles) if args.inputs.is_empty() => std::slice::from_ref(particles),
            _ => &args.inputs,
        };
        let frames = Frames::find(inputs)?;
        let times = Times::new(args, &frames)?;
        let patterns = patterns(args)?;
        if args.part.is_some() && patterns.is_empty() {
            return Err(NO_PICTURES.into());
        }
        let mut made = times.pictures()?;
        let (all, first, last) = (made.len(), made[0].0, made[made.len() - 1].0);
        made.retain(|(number, _)| args.frames.is_none_or(|s| s.has(*number)));
        if let Some(selection) = args.frames.filter(|_| made.is_empty()) {
            return Err(FramesError::Unselected { selection, first, last }.into());
        }
        let named: Vec<_> = made.iter().flat_map(|(n, _)| patterns.iter().map(|p| p.name(*n))).collect();
        let mut others: Vec<outputs::Named> = Vec::new();
        others.extend(args.options.scene.as_deref().map(|p| ("the scene file (--scene)", p)));
        others.extend(frames.all().iter().flat_map(|f| f.files()).map(|f| ("a particle file", f.as_path())));

        let picture = views.at(0.0, frames.number(0, 0.0))?;
        others.extend(picture.environment.file.as_deref().map(|p| ("the environment map (--env)", p)));
        if args.memory.is_some() && picture.preparer().on_device() {
            return Err("--memory keeps classes that the CPU finds: leave it out, or use --prepare cpu".into());
        }
        compositing::check(&picture, args.output.iter().map(PathBuf::as_path))?;
        if let Some(film) = args.output.iter().find(|p| Kind::of(p).is_some() && picture.background == Background::None)
        {
            let remedy = "write numbered pictures (out/####.png), or leave out --background none";
            return Err(format!("{}: films have no transparency: {remedy}", film.display()).into());
        }
        check(args, &named, &others)?;
        Ok(Outline { args, views, frames, patterns, all, made, picture })
    }

    /// How many pictures are to be made, whoever makes them.
    pub fn count(&self) -> usize {
        self.made.len()
    }

    /// All of it; where anything is left open, after preparing the first frame, for a device if there is one.
    pub fn plan(self, device: Option<&DeviceInfo>) -> Result<Plan, Box<dyn Error>> {
        let Outline { args, mut views, frames, patterns, all, made, picture } = self;
        let memory = args.memory.unwrap_or(0) as usize;
        let counts = args.stats.is_some();
        let between = args.step.is_some();
        let again = frames.all().len() > 1 && (between || counts) || memory > 0;
        let (settled, mut first) = Settled::of(&picture, &frames, device, again)?;
        let times = Times::new(args, &frames)?;
        // All of it over all pictures: a film that begins anew goes on turning.
        let turn = args.turn.unwrap_or(0.0) / all as f64;
        let mut shots = Vec::new();
        for (number, exposed) in &made[args.part.map_or(0..made.len(), |part| part.range(made.len()))] {
            let expose = |time: &f64| -> Result<_, Box<dyn Error>> {
                let moment = times.moment(*time);
                let mut picture = views.at(*time, frames.number(moment.frame, moment.toward))?;
                (picture.particles, picture.particles_time) = (None, None);
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
        if let Some(first) = &mut first
            && !shots.iter().find(|s| !s.kept).is_some_and(|s| first.is(&s.exposures[0]))
        {
            first.scene = None;
        }
        let mut films: Vec<_> = args.output.iter().filter_map(|p| Some((p.clone(), Kind::of(p)?))).collect();
        if args.part.is_some() {
            films.clear();
        }
        Ok(Plan { frames, first, between, shots, memory, counts, films, stats: table::path(args) })
    }
}

impl Plan {
    /// How many frames before a picture's are looked at.
    pub fn looks_back(&self) -> usize {
        if self.frames.all().len() > 1 { self.memory + usize::from(self.counts) } else { self.memory }
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
