//! `meniscus chart`: speed against accuracy.

mod html;
mod lettered;
pub mod measure;
mod plot;
pub mod points;
pub mod store;
mod surface;

use crate::{
    choices, on,
    options::Options,
    outputs,
    picture::Picture,
    report::{self, quantile},
    scene::Prepare,
    scene_file, terminal,
    truth::{self, Truth, cache::Cache},
    units,
};
use meniscus::{
    Settings,
    host::{Gpu, Instance, Session},
    io::images,
    study::{
        front::front,
        measures,
        reconstruct::{Reconstruction, SMOOTHING_PASSES},
    },
};
use points::{Point, Vary, Way};
use std::{
    error::Error,
    fmt::Write as _,
    path::{Path, PathBuf},
    process::ExitCode,
};
use store::Store;

#[derive(clap::Args)]
pub struct Args {
    /// Scene files (.toml, as `render --save-scene` writes them) or particle files; the embedded dam break if none is named
    pub scenes: Vec<PathBuf>,
    /// Folder for chart.csv, a chart of each scene (.svg, .png), report.html, and what a broken-off run goes on from
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub options: Options,
    /// Methods that are drawn; the scene's own if none is named
    #[arg(long, value_name = "PRESET,...", value_delimiter = ',', conflicts_with = "method", value_parser = choices::presets())]
    pub methods: Vec<String>,
    /// Each method that has it also with other values of a parameter or a family, in all combinations with each other and with the
    /// method's own: window=5,9,13 iterations=0..5 optics=one,two (a range has both its ends)
    #[arg(long, value_name = "NAME=VALUES", num_args = 1..)]
    pub vary: Vec<Vary>,
    /// Only one thing at a time has another value
    #[arg(long, requires = "vary")]
    pub one_at_a_time: bool,
    /// Samples a pixel of the truth, a multiple of 16 and at least 32
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = truth::samples)]
    pub samples: u32,
    /// Other surfaces of the same particles, by their smoothing passes, or the isosurface of our own density field: how far their
    /// pictures are from the truth is its width
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "0,5,15,isosurface")]
    pub truth_width: Vec<Reconstruction>,
    /// Frames that are measured whenever a method has its turn, after one that is not
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub frames: u32,
    /// Turns that each method has
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    /// Folder for meshes and films of truths; `cache` in the output's if not given
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    #[command(flatten)]
    pub units: units::Units,
}

/// A scene with all that was measured of it.
pub struct Charted {
    pub name: String,
    pub particles: usize,
    pub size: [u32; 2],
    pub truth_samples: u32,
    pub noise: f64,
    pub mesh: String,
    /// The truth's picture in the store.
    pub truth_key: String,
    /// Other surfaces of the same particles, and their pictures' FLIP over the liquid.
    pub width: Vec<(Reconstruction, f64)>,
    pub points: Vec<(String, Point)>,
    /// Of the points, by rising time.
    pub front: Vec<usize>,
}

impl Charted {
    /// The largest error of another surface of the same particles.
    pub fn widest(&self) -> Option<f64> {
        self.width.iter().map(|w| w.1).reduce(f64::max)
    }
}

/// Milliseconds at the median and at the 5th and 95th percentile.
pub fn times(point: &Point) -> [f64; 3] {
    let times = point.times();
    [0.5, 0.05, 0.95].map(|fraction| quantile(&times, fraction))
}

/// The points that nothing beats in both time and error, by rising time.
pub fn unbeaten(points: &[(String, Point)]) -> Vec<usize> {
    front(&points.iter().map(|(_, p)| (times(p)[0], p.liquid.flip)).collect::<Vec<_>>())
}

/// Into how many units it falls.
pub fn count(args: &Args) -> Result<usize, Box<dyn Error>> {
    Ok(args.pictures()?.len())
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let scenes = args.pictures()?;
    // A unit is a scene: its ways are measured in turns.
    let names: Vec<_> = scenes.iter().map(|(name, _)| name.clone()).collect();
    if args.units.listed(&names)? {
        return Ok(ExitCode::SUCCESS);
    }
    let some = args.units.some(&names)?;
    let plans: Vec<_> = scenes.iter().map(|(_, picture)| args.ways(picture)).collect::<Result<_, _>>()?;
    let instance = Instance::new(false)?;
    let device = instance.pick(args.options.device.as_deref())?;
    report::refuse_validation(&device)?;
    outputs::folder(&args.output)?;
    let store = Store::open(&args.output)?;
    let cache = Cache::open(&args.cache.clone().unwrap_or_else(|| args.output.join("cache")))?;
    terminal::progress(format!("device: {}", device.label()));
    let label = device.label();
    let on_device = on(&device);
    let gpu = Gpu::new(&instance, device).map_err(|e| on_device(e.into()))?;
    let mut charted = Vec::new();
    let wanted = |i: usize| some.as_ref().is_none_or(|s| s.contains(&i));
    for (_, ((name, picture), ways)) in scenes.iter().zip(&plans).enumerate().filter(|(i, _)| wanted(*i)) {
        let one = args.chart((name, picture, ways), &gpu, &store, &cache, &label);
        charted.push(one.map_err(&on_device).map_err(|e| format!("{name}: {e}"))?);
    }
    if some.is_some() {
        terminal::progress(format!("{} of {} units are in {}", charted.len(), names.len(), args.output.display()));
        return Ok(ExitCode::SUCCESS);
    }
    outputs::write(&args.output.join("chart.csv"), csv(&charted).as_bytes())?;
    let mut drawn = Vec::new();
    for one in &charted {
        let svg = plot::svg(one)?;
        outputs::write(&args.output.join(format!("{}.svg", one.name)), svg.as_bytes())?;
        let (size, pixels) = plot::pixels(one)?;
        let path = args.output.join(format!("{}.png", one.name));
        outputs::write(&path, &images::encode_srgb_png(&path, size, &pixels)?)?;
        drawn.push(svg);
    }
    let page = html::page(&charted, &drawn, &store, &label, args)?;
    outputs::write(&args.output.join("report.html"), page.as_bytes())?;
    terminal::progress(format!("wrote {}", args.output.display()));
    Ok(ExitCode::SUCCESS)
}

impl Args {
    /// Each scene's name and picture.
    fn pictures(&self) -> Result<Vec<(String, Picture)>, Box<dyn Error>> {
        let is_scene = |path: &Path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        let mut all: Vec<(String, Picture)> = Vec::new();
        let mut add = |path: Option<&Path>| -> Result<(), Box<dyn Error>> {
            let base = match path {
                Some(path) if is_scene(path) => scene_file::read(path)?,
                _ => self.options.base()?,
            };
            let mut picture = self.options.over(base, None)?;
            picture.draw(path.filter(|p| !is_scene(p)));
            picture.prepare.get_or_insert(Prepare::Cpu);
            picture.validate()?;
            let stem = path.or(self.options.scene.as_deref()).and_then(Path::file_stem);
            let mut name = stem.map_or("dam break".into(), |s| s.to_string_lossy().into_owned());
            if all.iter().any(|(other, _)| *other == name) {
                name = format!("{name} {}", all.len() + 1);
            }
            all.push((name, picture));
            Ok(())
        };
        if self.scenes.is_empty() {
            add(None)?;
        }
        self.scenes.iter().try_for_each(|path| add(Some(path)))?;
        Ok(all)
    }

    /// All ways to draw a scene.
    fn ways(&self, picture: &Picture) -> Result<Vec<Way>, Box<dyn Error>> {
        Ok(points::ways(&self.methods(picture)?, &self.vary, !self.one_at_a_time)?)
    }

    /// The methods' settings in a scene.
    fn methods(&self, picture: &Picture) -> Result<Vec<(String, Settings)>, Box<dyn Error>> {
        if self.methods.is_empty() {
            return Ok(vec![(choices::method_name(&picture.settings), picture.settings)]);
        }
        let each = self.methods.iter().map(|name| {
            let over = self.options.over(picture.clone(), choices::preset(name));
            Ok((name.clone(), over.map_err(|e| format!("--methods {name}: {e}"))?.settings))
        });
        each.collect()
    }

    fn chart(
        &self,
        (name, picture, ways): (&str, &Picture, &[Way]),
        gpu: &Gpu,
        store: &Store,
        cache: &Cache,
        device: &str,
    ) -> Result<Charted, Box<dyn Error>> {
        let scene = picture.load(picture.particles.as_deref(), picture.preparer())?;
        terminal::progress(format!("{name}: {} particles, {} ways to draw them", scene.positions.len(), ways.len()));
        let traced = |how| truth::of_scene(picture, &scene, how, self.samples, cache);
        let own = Reconstruction::Smoothed(SMOOTHING_PASSES);
        let truth = traced(own)?;
        let path = store.picture(&truth.key);
        outputs::write(&path, &images::encode_picture(&path, truth.picture.size, &truth.picture.pixels)?)?;
        let apart = |other: Truth| measures::compare(&truth.picture, &other.picture)?.means(Some(&truth.liquid()));
        let mut width = Vec::new();
        for other in self.truth_width.iter().filter(|other| **other != own) {
            width.push((*other, apart(traced(*other)?)?.flip));
        }
        let mut session = Session::new(gpu, picture.rendered_size()?, &picture.environment()?)?;
        let (frames, rounds) = (self.frames, self.rounds);
        let job = measure::Job { frames, rounds, name, picture, scene: &scene, truth: &truth, explained: true, device };
        let points = measure::all(&job, ways, store, &mut session);
        session.end();
        let points = points?;
        let front = unbeaten(&points);
        Ok(Charted {
            name: name.to_owned(),
            particles: scene.positions.len(),
            size: picture.size,
            truth_samples: self.samples,
            noise: truth.noise,
            mesh: truth.mesh,
            truth_key: truth.key,
            width,
            points,
            front,
        })
    }
}

/// One line a point.
fn csv(all: &[Charted]) -> String {
    let mut text = "scene,method,varied,value,ms_median,ms_p5,ms_p95,frames,memory_bytes,flip_liquid,flip_hdr_liquid,\
                    relative_mse_liquid,ssim_liquid,flip_picture,on_front,within_truth_width,truth_width_flip,surface_iou,surface_depth_r,\
                    surface_depth_abs_r,surface_normal_degrees,light_model_flip_liquid,light_model_relative_mse_liquid,\
                    search_missed_percent,search_angle_degrees\n"
        .to_owned();
    let quoted =
        |s: &str| if s.contains([',', '"', '\n']) { format!("\"{}\"", s.replace('"', "\"\"")) } else { s.to_owned() };
    for one in all {
        for (i, (_, p)) in one.points.iter().enumerate() {
            let (name, value): (Vec<_>, Vec<_>) = p.varied.iter().cloned().unzip();
            let [median, low, high] = times(p);
            let hdr = p.liquid.flip_hdr.map_or(String::new(), |v| format!("{v:.6}"));
            let widest = one.widest().map_or(String::new(), |v| format!("{v:.6}"));
            let within = one.widest().map_or(String::new(), |v| (p.liquid.flip <= v).to_string());
            let figures = p.surface_figures().into_iter().chain(p.light_figures()).chain(p.search_figures());
            let figures: Vec<_> = figures.map(|v| v.map_or(String::new(), |v| format!("{v:.5}"))).collect();
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{},{},{},{},{median:.4},{low:.4},{high:.4},{},{},{:.6},{hdr},{:.6e},{:.6},{:.6},{},{within},{widest},{}",
                quoted(&one.name),
                quoted(&p.method),
                quoted(&name.join(" ")),
                quoted(&value.join(" ")),
                p.times().len(),
                p.memory,
                p.liquid.flip,
                p.liquid.relative_mse,
                p.liquid.ssim,
                p.picture.flip,
                one.front.contains(&i),
                figures.join(","),
            );
        }
    }
    text
}
