//! `meniscus tune`: of all settings the cheapest within an error, or the best within a time.

use crate::{
    chart::{
        measure::{self, Job},
        points::{self, Point, Vary, Way},
        store::Store,
        times, unbeaten,
    },
    choices, on,
    options::Options,
    outputs,
    picture::Picture,
    report,
    scene::Prepare,
    scene_file, terminal,
    truth::{self, cache::Cache},
};
use meniscus::{
    PRESETS, Settings,
    host::{Gpu, Instance, Session},
    study::reconstruct::{Reconstruction, SMOOTHING_PASSES},
};
use std::{error::Error, path::PathBuf, process::ExitCode};

/// What is varied of the methods on the front, one thing at a time; then of what that has found.
const VARIED: [&str; 7] = [
    "iterations=0..4",
    "window=5,7,9,13",
    "projected=false,true",
    "optics=one,two,four",
    "internal_reflections=0,1,2,4,8",
    "fresnel=schlick,exact",
    "smooth=plane-fit,narrow-range,bilateral-separable,none",
];

#[derive(clap::Args)]
pub struct Args {
    /// Particle file; the scene file's if none is named, or the embedded dam break
    pub file: Option<PathBuf>,
    /// Scene file (.toml) for what is found, which `render --scene` draws
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// The cheapest settings whose FLIP over the liquid, against the scene's truth, is at most this
    #[arg(long, value_name = "E", required_unless_present = "budget_ms", conflicts_with = "budget_ms", value_parser = above_zero)]
    pub max_error: Option<f64>,
    /// The best settings with which a frame takes at most this, in milliseconds, at the 95th percentile
    #[arg(long, value_name = "B", value_parser = above_zero)]
    pub budget_ms: Option<f64>,
    #[command(flatten)]
    pub options: Options,
    /// Ways to draw the scene that are measured, at most
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub most: u32,
    /// Samples a pixel of the truth, a multiple of 16 and at least 32
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = truth::samples)]
    pub samples: u32,
    /// Frames that are measured whenever a way has its turn, after one that is not
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub frames: u32,
    /// Turns that each way has
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    /// Folder for the truth and for what was measured, so that a broken-off run goes on; `tune-cache` beside the scene file if not
    /// given
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

fn above_zero(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite() && *v > 0.0).ok_or_else(|| "use a finite number above 0".into())
}

/// All ways, and what was found of each, by its name in files.
type Measured = (Vec<Way>, Vec<(String, Point)>);

/// What is asked for.
#[derive(Clone, Copy)]
enum Goal {
    Error(f64),
    Milliseconds(f64),
}

impl Goal {
    fn is_kept(self, point: &Point) -> bool {
        match self {
            Goal::Error(most) => point.liquid.flip <= most,
            Goal::Milliseconds(most) => times(point)[2] <= most,
        }
    }

    /// Of what keeps the goal the cheapest or the best; of nothing what comes closest.
    fn choose(self, found: &[(String, Point)]) -> Option<usize> {
        let cost = |p: &Point| match self {
            Goal::Error(_) => times(p)[0],
            Goal::Milliseconds(_) => p.liquid.flip,
        };
        let short = |p: &Point| match self {
            Goal::Error(_) => p.liquid.flip,
            Goal::Milliseconds(_) => times(p)[2],
        };
        let order = |p: &Point| if self.is_kept(p) { (0, cost(p)) } else { (1, short(p)) };
        (0..found.len()).min_by(|a, b| {
            let (a, b) = (order(&found[*a].1), order(&found[*b].1));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        })
    }
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let picture = args.picture()?;
    let goal = match (args.max_error, args.budget_ms) {
        (Some(most), _) => Goal::Error(most),
        (None, most) => Goal::Milliseconds(most.ok_or("give --max-error or --budget-ms")?),
    };
    args.check(&picture)?;
    let instance = Instance::new(false)?;
    let device = instance.pick(args.options.device.as_deref())?;
    report::refuse_validation(&device)?;
    let place = args.cache.clone().unwrap_or_else(|| args.output.with_file_name("tune-cache"));
    outputs::folder(&place)?;
    let (store, cache) = (Store::open(&place)?, Cache::open(&place)?);
    let label = device.label();
    terminal::progress(format!("device: {label}"));
    let on_device = on(&device);
    let gpu = Gpu::new(&instance, device).map_err(|e| on_device(e.into()))?;
    let scene = picture.load(picture.particles.as_deref(), picture.preparer())?;
    let truth = truth::of_scene(&picture, &scene, Reconstruction::Smoothed(SMOOTHING_PASSES), args.samples, &cache)?;
    let size = picture.rendered_size()?;
    let mut session = Session::new(&gpu, size, &picture.environment()?).map_err(|e| on_device(e.into()))?;
    let name =
        args.file.as_deref().or(picture.particles.as_deref()).map_or("dam break".into(), |f| f.display().to_string());
    let (frames, rounds) = (args.frames, args.rounds);
    let job = Job {
        frames,
        rounds,
        name: &name,
        picture: &picture,
        scene: &scene,
        truth: &truth,
        explained: false,
        device: &label,
    };
    let found = args.search(goal, &job, &store, &mut session);
    session.end();
    let (ways, found) = found.map_err(on_device)?;
    let chosen = goal.choose(&found).ok_or("nothing was measured")?;
    show(&found, chosen)?;
    let (point, [median, _, high]) = (&found[chosen].1, times(&found[chosen].1));
    let figures = format!("FLIP {:.4}, {median:.1} ms (95 % within {high:.1})", point.liquid.flip);
    if !goal.is_kept(point) {
        let asked = match goal {
            Goal::Error(most) => format!("an error of {most}"),
            Goal::Milliseconds(most) => format!("{most} ms"),
        };
        return Err(format!(
            "nothing that was measured is within {asked}; {} comes closest: {figures}. Ask for less, or let more be measured (--most)",
            ways[chosen].name()
        )
        .into());
    }
    let tuned = Picture { settings: ways[chosen].settings, ..picture.clone() }.settled(&scene)?;
    outputs::write(&args.output, scene_file::text(&tuned, &args.output)?.as_bytes())?;
    terminal::line(format!("{}: {figures}; wrote {}", ways[chosen].name(), args.output.display()))?;
    Ok(ExitCode::SUCCESS)
}

impl Args {
    fn picture(&self) -> Result<Picture, Box<dyn Error>> {
        let mut picture = self.options.over(self.options.base()?, None)?;
        picture.draw(self.file.as_deref());
        picture.prepare.get_or_insert(Prepare::Cpu);
        picture.validate()?;
        Ok(picture)
    }

    fn check(&self, picture: &Picture) -> Result<(), outputs::OutputError> {
        let mut inputs = Vec::new();
        inputs.extend(self.options.scene.as_deref().map(|p| ("the scene file (--scene)", p)));
        inputs.extend(picture.particles.as_deref().map(|p| ("the particle file", p)));
        inputs.extend(picture.environment.file.as_deref().map(|p| ("the environment map (--env)", p)));
        outputs::check(&[("the scene file (--output)", self.output.as_path())], None, &inputs)
    }

    /// The scene's own settings and all published methods; then, as long as that changes what is chosen, the neighbours of the choice
    /// and of those beside it on the front.
    fn search(&self, goal: Goal, job: &Job, store: &Store, session: &mut Session) -> Result<Measured, Box<dyn Error>> {
        let own = job.picture.settings;
        let mut start = vec![(choices::method_name(&own), own)];
        for preset in PRESETS {
            // A parameter that is given may be one that this method has not.
            let Ok(Picture { settings, .. }) = self.options.over(job.picture.clone(), Some(preset)) else { continue };
            if !start.iter().any(|(_, known)| *known == settings) {
                start.push((preset.name.to_owned(), settings));
            }
        }
        let mut ways = points::ways(&start, &[], false)?;
        let mut expanded: Vec<Settings> = Vec::new();
        loop {
            ways.truncate(self.most as usize);
            let found = measure::all(job, &ways, store, session)?;
            let best = unbeaten(&found);
            let chosen = goal.choose(&found).ok_or("nothing was measured")?;
            let at = best.iter().position(|i| *i == chosen).unwrap_or(0);
            let beside = best[at.saturating_sub(1)..].iter().take(3).copied();
            let next: Vec<usize> =
                [chosen].into_iter().chain(beside).filter(|i| !expanded.contains(&ways[*i].settings)).collect();
            if next.is_empty() || ways.len() >= self.most as usize {
                return Ok((ways, found));
            }
            for i in next {
                expanded.push(ways[i].settings);
                let mut more = neighbours(&ways[i])?;
                more.retain(|new| !ways.iter().any(|w| w.settings == new.settings));
                ways.extend(more);
            }
        }
    }
}

/// Ways that differ from one in one thing.
fn neighbours(way: &Way) -> Result<Vec<Way>, Box<dyn Error>> {
    let base = [(way.name(), way.settings)];
    let mut all = Vec::new();
    for text in VARIED {
        let vary: Vary = text.parse()?;
        let family = way.settings.method.members().iter().any(|(f, _)| *f == vary.name);
        if family || way.settings.parameters().iter().any(|p| p.name == vary.name) {
            all.extend(points::ways(&base, &[vary], false)?.into_iter().skip(1));
        }
    }
    Ok(all)
}

/// The front and the choice.
fn show(found: &[(String, Point)], chosen: usize) -> Result<(), terminal::NotWritten> {
    let mut rows = unbeaten(found);
    if !rows.contains(&chosen) {
        rows.push(chosen);
    }
    terminal::line(format!("{} ways measured; what no other beats, and the choice (*):", found.len()))?;
    terminal::line(format!("  {:>9} {:>9} {:>8}  way", "ms", "95 %", "FLIP"))?;
    for i in rows {
        let (point, [median, _, high]) = (&found[i].1, times(&found[i].1));
        let mark = if i == chosen { '*' } else { ' ' };
        terminal::line(format!("{mark} {median:>9.2} {high:>9.2} {:>8.4}  {}", point.liquid.flip, point.name()))?;
    }
    Ok(())
}
