//! `meniscus bench`: what each pass takes, in figures that can be repeated.

mod compare;
mod statistics;
mod trace;

use crate::{
    choices, empty, on,
    options::Options,
    outputs,
    picture::Picture,
    report,
    scene::{Prepare, Scene, progress},
    terminal::{self, NotWritten},
};
use glam::Vec3;
use meniscus::{
    LedgerEntry, Settings,
    host::{Gpu, Instance, Session, Stages},
    profile::{FrameTimes, PassTime},
};
use std::{path::PathBuf, process::ExitCode};

#[derive(clap::Args)]
pub struct Args {
    /// Particle files; the scene file's if none is named, or the built-in scenes
    pub files: Vec<PathBuf>,
    /// Also the built-in scenes: the embedded dam break, a block of 100,000 particles, 20,000 droplets
    #[arg(long)]
    pub scenes: bool,
    /// Blocks of 1 k, 10 k, 100 k, 1 M, 4 M and 10 M particles, and how time grows with their number
    #[arg(long)]
    pub scaling: bool,
    /// Leave out blocks of more particles
    #[arg(long, value_name = "N", default_value_t = 10_000_000)]
    pub max_particles: u32,
    #[command(flatten)]
    pub options: Options,
    /// Measure each scene with each of these methods, and compare them in a table
    #[arg(long, value_name = "PRESET,...", value_delimiter = ',', conflicts_with = "method", value_parser = choices::presets())]
    pub methods: Vec<String>,
    /// Frames that are measured
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub frames: u32,
    /// Frames before them
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub warmup: u32,
    /// The particles do not move: what follows from them alone is done in the first frames only
    #[arg(long)]
    pub still: bool,
    /// Where to write the figures: .json or .csv; the terminal shows them in any case
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Where to write a trace of the frames that are measured, for ui.perfetto.dev or Chrome's about:tracing
    #[arg(long, value_name = "FILE.json")]
    pub trace: Option<PathBuf>,
    /// Measures no time: draws one frame of each scene with each method, and prints what the device counted of each pass
    #[arg(long, conflicts_with_all = ["output", "trace", "still"])]
    pub statistics: bool,
    /// Measures nothing: says what changed from one file of figures to another, beyond the noise of both
    #[arg(long, num_args = 2, value_names = ["BEFORE.json", "NOW.json"], exclusive = true)]
    pub compare: Vec<PathBuf>,
}

impl Args {
    /// Shows a line of figures. Where a file gets them too, the terminal's may be lost.
    pub fn show(&self, line: &str) -> Result<(), NotWritten> {
        terminal::line(line).or_else(|e| if self.output.is_some() { Ok(()) } else { Err(e) })
    }

    /// Refuses what cannot be written, before anything is measured.
    fn check(&self, picture: &Picture) -> Result<(), Box<dyn std::error::Error>> {
        if let Some(path) = &self.output {
            report::check_extension(path)?;
        }
        if let Some(path) = &self.trace {
            report::check_json(path, "trace")?;
        }
        let files = self.files.iter().chain(&picture.particles);
        let mut inputs: Vec<_> = files.map(|p| ("a particle file", p.as_path())).collect();
        inputs.extend(self.options.scene.as_deref().map(|p| ("the scene file (--scene)", p)));
        inputs.extend(picture.environment.file.as_deref().map(|p| ("the environment map (--env)", p)));
        let written = [("the figures (--output)", &self.output), ("the trace (--trace)", &self.trace)];
        let written: Vec<_> = written.iter().filter_map(|(what, path)| Some((*what, path.as_deref()?))).collect();
        Ok(outputs::check(&written, None, &inputs)?)
    }
}

/// What one scene gave with one method.
pub struct Run {
    pub scene: String,
    pub method: String,
    pub particles: usize,
    pub radius: f32,
    pub prepare_cpu_ms: f64,
    pub settings: Settings,
    /// Each pass's milliseconds, frame by frame, in the order of the frame; passes of one name are summed.
    pub passes: Vec<(String, Vec<f64>)>,
    /// The same of each part of the frame.
    pub parts: Vec<(String, Vec<f64>)>,
    /// First to last timestamp, the sum of the passes, and of those that prepare particles, frame by frame.
    pub span: Vec<f64>,
    pub sum: Vec<f64>,
    pub preparation: Vec<f64>,
    /// And as they were measured.
    pub frames: Vec<FrameTimes>,
    /// The same frames on the host's clock, where the device's is known there.
    pub on_host: Vec<OnHost>,
    pub memory: Vec<LedgerEntry>,
}

/// A frame on the host's clock.
pub struct OnHost {
    pub stages: Stages,
    /// From the begin of its recording to its first timestamp.
    pub device_ms: f64,
}

impl Run {
    /// Bytes that grow with the number of particles, for each of them; the positions' own 12 included.
    pub fn bytes_per_particle(&self, on_device: bool) -> f64 {
        let bytes: u64 = self.memory.iter().filter(|e| e.per_particle).map(|e| e.bytes).sum();
        if self.particles == 0 {
            return 0.0;
        }
        bytes as f64 / self.particles as f64 + if on_device { 12.0 } else { 0.0 }
    }

    pub fn bytes(&self) -> u64 {
        self.memory.iter().map(|e| e.bytes).sum()
    }
}

/// Particles of the blocks of `--scaling`.
const SIZES: [u32; 6] = [1_000, 10_000, 100_000, 1_000_000, 4_000_000, 10_000_000];

/// Seed of the built-in scenes.
pub const SEED: u64 = 1;

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn std::error::Error>> {
    if let [before, now] = args.compare.as_slice() {
        compare::run(before, now)?;
        return Ok(ExitCode::SUCCESS);
    }
    let pictures = args.options.each(Prepare::Gpu, &args.methods)?;
    let picture = &pictures[0].1;
    args.check(picture)?;
    if args.scaling && args.files.is_empty() && !args.scenes && args.max_particles < SIZES[0] {
        return Err(format!("--max-particles {} leaves no block: use {} or more", args.max_particles, SIZES[0]).into());
    }
    let instance = Instance::new(false)?;
    let device = instance.pick(args.options.device.as_deref())?;
    report::refuse_validation(&device)?;
    let size = picture.rendered_size()?;
    let environment = picture.environment()?;
    args.show(&report::measured_on(&device))?;
    let on_device = on(&device);
    let made = if args.statistics { Gpu::counting(&instance, device) } else { Gpu::profiled(&instance, device) };
    let gpu = made.map_err(|e| on_device(e.into()))?;
    let mut session = Session::new(&gpu, size, &environment).map_err(|e| on_device(e.into()))?;
    let runs = all(args, &pictures, &mut session);
    session.end();
    let runs = runs.map_err(on_device)?;
    let growth = args.scaling.then(|| report::growth(&runs));
    if let Some((exponent, from)) = growth.flatten() {
        args.show(&format!(
            "preparation grows with the power {exponent:.3} of the number of particles, from {from} on"
        ))?;
    }
    if let Some(path) = &args.output {
        report::write(path, args, picture, &gpu.info, &runs)?;
        args.show(&format!("wrote {}", path.display()))?;
    }
    if let Some(path) = &args.trace {
        outputs::write(path, &trace::of(&runs, &gpu.info.label())?)?;
        args.show(&format!("wrote {}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn all(
    args: &Args,
    pictures: &[(String, Picture)],
    session: &mut Session,
) -> Result<Vec<Run>, Box<dyn std::error::Error>> {
    // They differ in their settings alone.
    let (picture, preparer) = (&pictures[0].1, pictures[0].1.preparer());
    let mut runs = Vec::new();
    let mut add = |name: String, scene: Scene| -> Result<(), Box<dyn std::error::Error>> {
        let begin = runs.len();
        for (method, picture) in pictures {
            if let Some(run) = measure(args, session, (&name, method), picture, &scene)? {
                report::print(&run, args, picture)?;
                runs.push(run);
            }
        }
        Ok(report::compare(&runs[begin..], args)?)
    };
    let own = picture.particles.iter().filter(|_| args.files.is_empty());
    let files: Vec<_> = args.files.iter().chain(own).collect();
    for file in &files {
        add(file.display().to_string(), picture.load(Some(file), preparer)?)?;
    }
    if args.scenes || (files.is_empty() && !args.scaling) {
        add("embedded dam break".into(), picture.load(None, preparer)?)?;
        add("block of 100,000".into(), Scene::synthetic(block(100_000), RADIUS, picture)?)?;
        add("20,000 droplets".into(), Scene::synthetic(droplets(20_000), RADIUS, picture)?)?;
    }
    if args.scaling {
        for n in SIZES {
            if n <= args.max_particles {
                add(format!("block of {n}"), Scene::synthetic(block(n), RADIUS, picture)?)?;
            }
        }
    }
    Ok(runs)
}

/// Of particles that are made.
pub const RADIUS: f32 = 0.01;

/// SplitMix64 (Steele et al. 2014): the same numbers everywhere.
pub fn unit(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

/// A step of less than so much each way.
pub fn offset(state: &mut u64, reach: f32) -> Vec3 {
    (2.0 * Vec3::new(unit(state), unit(state), unit(state)) - 1.0) * reach
}

/// Where the i-th particle of a block lies that is twice as long as it is wide and deep, at rest spacing.
pub fn place(edge: u32, i: u32) -> Vec3 {
    2.0 * RADIUS * Vec3::new((i % (2 * edge)) as f32, (i / (2 * edge) % edge) as f32, (i / (2 * edge * edge)) as f32)
}

/// A block of liquid, 2 : 1 : 1, at rest spacing, each particle a fifth of a radius off its place, in random order.
fn block(count: u32) -> Vec<Vec3> {
    let mut state = SEED;
    let edge = (f64::from(count) / 2.0).cbrt().ceil() as u32;
    let mut all: Vec<Vec3> = (0..count).map(|i| place(edge, i) + offset(&mut state, 0.2 * RADIUS)).collect();
    // A simulation's order has little to do with space either.
    for i in (1..all.len()).rev() {
        all.swap(i, (unit(&mut state) * (i + 1) as f32) as usize % (i + 1));
    }
    all
}

/// Droplets far apart.
fn droplets(count: u32) -> Vec<Vec3> {
    let mut state = SEED;
    (0..count).map(|_| offset(&mut state, 100.0 * RADIUS)).collect()
}

/// Milliseconds of what has one name, frame by frame.
pub fn sums(frames: &[FrameTimes], name: impl Fn(&PassTime) -> &str) -> Vec<(String, Vec<f64>)> {
    let mut all: Vec<(String, Vec<f64>)> = Vec::new();
    for (i, p) in frames.iter().enumerate().flat_map(|(i, f)| f.passes.iter().map(move |p| (i, p))) {
        let found = all.iter().position(|(n, _)| n == name(p)).unwrap_or_else(|| {
            all.push((name(p).to_owned(), vec![0.0; frames.len()]));
            all.len() - 1
        });
        all[found].1[i] += p.ms;
    }
    all
}

fn measure(
    args: &Args,
    session: &mut Session,
    (name, method): (&str, &str),
    picture: &Picture,
    scene: &Scene,
) -> Result<Option<Run>, Box<dyn std::error::Error>> {
    let particles = &scene.particles;
    let (camera, eye, _) = picture.camera(scene)?;
    let settings = picture.frame_settings(particles)?;
    let upload = scene.give(picture.preparer(), &settings, session)?;
    let input = scene.input(&camera, &settings, eye, upload.as_ref()).still(args.still);
    if args.statistics {
        statistics::print(&format!("{name}, {method}"), session, &input)?;
        return Ok(None);
    }
    let bar = progress(u64::from(args.warmup + args.frames), "frames");
    let (mut frames, mut on_host): (Vec<FrameTimes>, Vec<OnHost>) = Default::default();
    for i in 0..args.warmup + args.frames {
        let times = session.frame(&input)?.ok_or("this device has no timestamps: nothing can be measured")?;
        bar.inc(1);
        if i >= args.warmup {
            // After the frame, where it disturbs nothing that is measured.
            if let (Some(stages), Some(now)) = (session.gpu.stages(), session.gpu.calibrate()?) {
                on_host.push(OnHost { stages, device_ms: now.since(stages.begin, times.begin_ns) });
            }
            frames.push(times);
        }
    }
    bar.finish_and_clear();
    if let Some(why) = empty::explain(session, particles, &camera, &settings, picture.rendered_size()?)? {
        terminal::complain(format!("meniscus: {name}: {why}"));
    }
    let total = |f: &FrameTimes, preparing: bool| {
        f.passes.iter().filter(|p| p.prepares || !preparing).map(|p| p.ms).sum::<f64>()
    };
    Ok(Some(Run {
        scene: name.to_owned(),
        method: method.to_owned(),
        particles: scene.positions.len(),
        radius: scene.particles.radius,
        prepare_cpu_ms: if picture.preparer().on_device() { 0.0 } else { scene.prepare_ms },
        settings,
        passes: sums(&frames, |p| &p.name),
        parts: sums(&frames, |p| p.part),
        span: frames.iter().map(|f| f.span_ms).collect(),
        sum: frames.iter().map(|f| total(f, false)).collect(),
        preparation: frames.iter().map(|f| total(f, true)).collect(),
        memory: session.renderer.memory(),
        frames,
        on_host,
    }))
}
