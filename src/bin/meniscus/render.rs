//! `meniscus render`.

use crate::{
    compositing::{self, Pixels},
    dump, empty, on,
    options::Options,
    outputs,
    picture::Picture,
    prepared::{self, Prepared},
    scene::{Prepare, Scene, spinner},
    scene_file, stats, terminal, validated,
};
use glam::Vec3;
use meniscus::{
    Camera, Particles, Settings,
    host::{Gpu, Instance, Session},
    inspect::Inspection,
    io::images,
    prepare::Report,
};
use std::{path::PathBuf, process::ExitCode};

#[derive(clap::Args)]
pub struct Args {
    /// Particle file (`meniscus info` lists formats); without one, an embedded dam break is rendered
    pub file: Option<PathBuf>,
    /// Picture: .png (sRGB, 8 bits) or .exr (linear, float)
    #[arg(short, long)]
    pub output: PathBuf,
    #[command(flatten)]
    pub options: Options,
    #[command(flatten)]
    pub compositing: compositing::Compositing,
    /// Write all that decides the picture as a scene file (TOML): `render --scene FILE` makes it again
    #[arg(long, value_name = "FILE")]
    pub save_scene: Option<PathBuf>,
    /// Write timings, memory, counts and parameters as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Write the frame's maps as .npy, its particles and all that recomputing them takes into this folder; an older dump in it is replaced
    #[arg(long, value_name = "DIR")]
    pub dump: Option<PathBuf>,
    /// With --dump and --prepare gpu: also write every particle's neighbours (four bytes of device memory for each)
    #[arg(long, requires = "dump")]
    pub dump_neighbours: bool,
    /// Run with core and synchronization validation; any message is an error
    #[arg(long)]
    pub validate: bool,
}

impl Args {
    /// The picture that is asked for: by default, by the scene file, by these arguments.
    fn picture(&self) -> Result<Picture, Box<dyn std::error::Error>> {
        let mut picture = self.options.over(self.options.base()?, None)?;
        self.compositing.apply(&mut picture);
        picture.draw(self.file.as_deref());
        picture.prepare.get_or_insert(Prepare::Cpu);
        Ok(picture)
    }

    /// Refuses what cannot be written, before anything is rendered.
    fn check(&self, picture: &Picture) -> Result<(), Box<dyn std::error::Error>> {
        images::check_extension(&self.output)?;
        compositing::check(picture, [self.output.as_path()])?;
        let mut outputs = vec![("the picture (--output)", self.output.as_path())];
        outputs.extend(self.stats.as_deref().map(|p| ("the statistics (--stats)", p)));
        outputs.extend(self.save_scene.as_deref().map(|p| ("the scene file (--save-scene)", p)));
        let mut inputs = Vec::new();
        inputs.extend(self.options.scene.as_deref().map(|p| ("the scene file (--scene)", p)));
        inputs.extend(picture.particles.as_deref().map(|p| ("the particle file", p)));
        inputs.extend(picture.environment.file.as_deref().map(|p| ("the environment map (--env)", p)));
        outputs::check(&outputs, self.dump.as_deref(), &inputs)?;
        if self.dump_neighbours && !picture.preparer().on_device() {
            return Err("--dump-neighbours lists what the device finds: add --prepare gpu".into());
        }
        Ok(())
    }
}

/// Everything that decides the picture, after defaults.
pub struct Job<'a> {
    pub args: &'a Args,
    /// With nothing left open.
    pub picture: Picture,
    pub scene: &'a Scene,
    /// What the device prepared, once it is read back.
    pub prepared: Option<Prepared>,
    pub camera: Camera,
    pub eye: Vec3,
    pub settings: Settings,
    /// Size rendered at.
    pub size: [u32; 2],
}

impl Job<'_> {
    /// As drawn.
    pub fn particles(&self) -> &Particles {
        self.prepared.as_ref().map_or(&self.scene.particles, |p| &p.particles)
    }

    pub fn report(&self) -> &Report {
        self.prepared.as_ref().map_or(&self.scene.report, |p| &p.report)
    }
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn std::error::Error>> {
    let picture = args.picture()?;
    args.check(&picture)?;
    let environment = picture.environment()?;
    let instance = Instance::new(args.validate)?;
    let device = instance.pick(args.options.device.as_deref())?;
    let scene = picture.load_for(Some(&device), picture.particles.as_deref(), picture.preparer())?;
    announce(&scene, &device.name, &device.driver);
    if let Some(time) = scene.time {
        let asked = picture.time.or(picture.particles_time).filter(|asked| *asked != time);
        let of = asked.map_or(String::new(), |asked| format!(", the one for {asked}"));
        terminal::progress(format!("time step: {time}{of}"));
    }
    let mut job = plan(args, picture, &scene)?;
    let on_device = on(&device);
    let drawn = (|| {
        let gpu = Gpu::new(&instance, device)?;
        let mut session = Session::new(&gpu, job.size, &environment)?;
        let bar = spinner("rendering");
        let done = render(&mut job, &mut session);
        bar.finish_and_clear();
        session.end();
        done
    })();
    if let Some(why) = drawn.map_err(on_device)? {
        terminal::complain(format!("meniscus: {why}"));
    }
    let code = validated(&instance);
    terminal::progress(format!("wrote {}", args.output.display()));
    Ok(code)
}

fn announce(scene: &Scene, device: &str, driver: &str) {
    terminal::progress(format!("device: {device} ({driver})"));
    if scene.dropped > 0 {
        terminal::progress(format!("dropped: {} particles that are not finite", scene.dropped));
    }
    let (r, p) = (&scene.report, &scene.particles);
    let what = if p.ellipsoids.is_empty() {
        "none; only the background is rendered".to_owned()
    } else if *r == Report::default() {
        format!("{}, prepared on the device; radius {} ({})", p.ellipsoids.len(), p.radius, scene.radius_source)
    } else {
        format!("{} splash, {} body; radius {} ({})", r.splash, r.body, p.radius, scene.radius_source)
    };
    terminal::progress(format!("particles: {what}"));
}

fn plan<'a>(args: &'a Args, picture: Picture, scene: &'a Scene) -> Result<Job<'a>, Box<dyn std::error::Error>> {
    let (camera, eye, _) = picture.camera(scene)?;
    let settings = picture.frame_settings(&scene.particles)?;
    let size = picture.rendered_size()?;
    let picture = picture.settled(scene)?;
    Ok(Job { args, picture, scene, prepared: None, camera, eye, settings, size })
}

/// Renders and writes everything; says so if the picture shows none of the liquid.
fn render(job: &mut Job, session: &mut Session) -> Result<Option<String>, Box<dyn std::error::Error>> {
    let upload = job.scene.give(job.picture.preparer(), &job.settings, session)?;
    let (camera, settings) = (job.camera, job.settings);
    let input = job.scene.input(&camera, &settings, job.eye, upload.as_ref()).background(job.picture.background.into());
    session.renderer.inspect(compositing::inspection(&job.picture));
    let mut times = session.frame(&input)?;
    if job.args.stats.is_some() {
        // The first frame compiles shaders; the second is timed.
        times = session.frame(&input)?;
    }
    let pixels = Pixels::read(session, &job.picture, job.scene.particles.radius)?;
    let output = &job.args.output;
    let pixels = pixels.average(job.size, job.picture.supersample);
    outputs::write(output, &pixels.encode(output, &job.picture, None)?)?;
    if let Some(path) = &job.args.save_scene {
        outputs::write(path, scene_file::text(&job.picture, path)?.as_bytes())?;
    }
    let no_liquid = empty::explain(session, &job.scene.particles, &camera, &settings, job.size)?;
    if job.args.dump.is_none() && job.args.stats.is_none() {
        return Ok(no_liquid);
    }
    let memory = session.renderer.memory();
    let mut inspection =
        Inspection { walks: true, neighbours: if job.args.dump_neighbours { 256 } else { 0 }, ..Default::default() };
    session.renderer.inspect(inspection);
    session.frame(&input)?;
    if job.args.dump_neighbours {
        // Counts are right whatever there is room for.
        let most = prepared::most_neighbours(session, job.scene.positions.len())?;
        if most > inspection.neighbours {
            inspection.neighbours = most;
            session.renderer.inspect(inspection);
            session.frame(&input)?;
        }
    }
    if job.picture.preparer().on_device() {
        job.prepared =
            Some(prepared::read(session, job.scene.particles.radius, job.picture.preparation.splash_threshold)?);
    }
    if let Some(folder) = &job.args.dump {
        dump::write(folder, job, session)?;
    }
    if let Some(path) = &job.args.stats {
        stats::write(path, job, session, times.as_ref(), &memory)?;
    }
    Ok(no_liquid)
}

/// Mean of each n x n block, in linear light.
pub fn average(pixels: &[[f32; 3]], size: [u32; 2], n: u32) -> Vec<[f32; 3]> {
    let (width, n) = (size[0] as usize, n as usize);
    let (w, h) = (width / n, size[1] as usize / n);
    let block = |x: usize, y: usize| {
        let mut sum = Vec3::ZERO;
        for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
            sum += Vec3::from_array(pixels[(y * n + j) * width + x * n + i]);
        }
        (sum / (n * n) as f32).to_array()
    };
    (0..w * h).map(|k| block(k % w, k / w)).collect()
}
