//! `meniscus render`.

use crate::{
    camera::{self, View},
    dump,
    prepared::{self, Prepared},
    scene::{Prepare, Scene, Source, spinner},
    stats,
};
use clap::ValueEnum;
use glam::{DVec3, Vec3};
use meniscus::{
    Camera, Equirect, Error, FrameInput, Fresnel, Particles, Settings, Weighting,
    host::{Gpu, Instance, Session},
    io::{Budget, images},
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
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = parse_size)]
    pub size: [u32; 2],
    /// Eye, in the file's coordinates; chosen to frame the liquid if not given
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    pub eye: Option<DVec3>,
    /// Point to look at; the middle of the liquid if not given
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    pub target: Option<DVec3>,
    /// Up, for the camera and the environment
    #[arg(long, value_name = "X,Y,Z", default_value = "0,1,0", value_parser = parse_vector, allow_hyphen_values = true)]
    pub up: DVec3,
    /// Vertical field of view in degrees
    #[arg(long, value_name = "DEG", default_value_t = 40.0)]
    pub fov_y: f32,
    /// Equirectangular environment map, .hdr, .exr or .png; a procedural sky if not given. One that is finer than the
    /// picture's pixels, or too large for half of --max-memory, is averaged down by a whole factor
    #[arg(long, value_name = "FILE")]
    pub env: Option<PathBuf>,
    /// Surfaces at which light bends: 1, 2 or 4
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub refractions: u32,
    /// Total internal reflections followed
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub internal_reflections: u32,
    /// Reflectance: Schlick's approximation or exact
    #[arg(long, value_enum, default_value = "schlick")]
    pub fresnel: FresnelArg,
    /// Render at a multiple of the size and average
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=3))]
    pub supersample: u32,
    /// Plane-fitting window in pixels of the picture: odd
    #[arg(long, value_name = "N", default_value_t = 9)]
    pub window: u32,
    /// Plane-fitting iterations
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub iterations: u32,
    /// Plane-fitting sigma in particle radii
    #[arg(long, value_name = "R", default_value_t = 5.3)]
    pub sigma: f32,
    /// Plane-fitting weights: difference of depths, or distance of points
    #[arg(long, value_enum, default_value = "view-dependent")]
    pub weighting: WeightingArg,
    /// Particle radius in world units; from the file, or estimated from spacing, if not given
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    pub radius: Option<f64>,
    /// Particles with less than this share of a filled body's density are splash
    #[arg(long, value_name = "T")]
    pub splash_threshold: Option<f32>,
    /// Most memory that reading one file may take, with K, M, G or T. A small file may take less: 32 times its size and a
    /// 32nd of this
    #[arg(long, value_name = "SIZE", default_value_t)]
    pub max_memory: Budget,
    /// Drop particles whose position is not finite instead of failing
    #[arg(long)]
    pub drop_invalid: bool,
    /// Absorption per world unit for red, green and blue; a light blue that suits the liquid's size if not given
    #[arg(long, value_name = "R,G,B", value_parser = parse_vector, allow_hyphen_values = true)]
    pub absorption: Option<DVec3>,
    /// Index of refraction
    #[arg(long, value_name = "N", default_value_t = 1.333)]
    pub ior: f32,
    /// Device whose name or driver contains this; the best one if not given
    #[arg(long, value_name = "NAME")]
    pub device: Option<String>,
    /// Where classes and ellipsoids are made
    #[arg(long, value_enum, default_value = "cpu")]
    pub prepare: Prepare,
    /// Draw every particle, also those that others hide
    #[arg(long)]
    pub no_culling: bool,
    /// Write timings, memory, counts and parameters as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Write every intermediate target as .npy into this folder
    #[arg(long, value_name = "DIR")]
    pub dump: Option<PathBuf>,
    /// With --dump and --prepare gpu: also write every particle's neighbours (four bytes of device memory for each)
    #[arg(long, requires = "dump")]
    pub dump_neighbours: bool,
    /// Run with core and synchronization validation; any message is an error
    #[arg(long)]
    pub validate: bool,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum FresnelArg {
    Schlick,
    Exact,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum WeightingArg {
    ViewDependent,
    Euclidean,
}

pub fn parse_size(s: &str) -> Result<[u32; 2], String> {
    let parse = |t: &str| t.parse().map_err(|_| format!("\"{s}\" is not WIDTHxHEIGHT, such as 1024x768"));
    let (w, h) = s.split_once('x').ok_or_else(|| format!("\"{s}\" is not WIDTHxHEIGHT, such as 1024x768"))?;
    Ok([parse(w)?, parse(h)?])
}

fn parse_vector(s: &str) -> Result<DVec3, String> {
    let parts: Result<Vec<f64>, _> = s.split(',').map(|t| t.trim().parse()).collect();
    match parts.as_deref() {
        Ok([x, y, z]) if DVec3::new(*x, *y, *z).is_finite() => Ok(DVec3::new(*x, *y, *z)),
        _ => Err(format!("\"{s}\" is not three finite numbers, such as 0,1,0")),
    }
}

/// Everything that decides the picture, after defaults.
pub struct Job<'a> {
    pub args: &'a Args,
    pub scene: &'a Scene,
    /// What the device prepared, once it is read back.
    pub prepared: Option<Prepared>,
    pub camera: Camera,
    pub eye: Vec3,
    pub settings: Settings,
    /// Size rendered at: the picture's times the supersampling.
    pub size: [u32; 2],
    pub eye_inside: bool,
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
    images::check_extension(&args.output)?;
    for path in [Some(&args.output), args.stats.as_ref()].into_iter().flatten() {
        images::check_folder(path)?;
    }
    if args.dump_neighbours && !args.prepare.on_device() {
        return Err("--dump-neighbours lists what the device finds: add --prepare gpu".into());
    }
    let environment = match args.env.as_deref() {
        Some(path) => images::read_environment_within(path, Some(texels_around(args)), &args.max_memory)?,
        None => Equirect::procedural_sky(),
    };
    let instance = Instance::new(args.validate)?;
    let device = instance.pick(args.device.as_deref())?;
    let scene = Scene::load(&Source {
        file: args.file.as_deref(),
        radius: args.radius,
        splash_threshold: args.splash_threshold,
        drop_invalid: args.drop_invalid,
        budget: args.max_memory,
        prepare: args.prepare,
    })?;
    announce(&scene, &device.name, &device.driver);
    let mut job = plan(args, &scene)?;
    {
        let gpu = Gpu::new(&instance, device)?;
        let mut session = Session::new(&gpu, job.size, &environment)?;
        let bar = spinner("rendering");
        let done = render(&mut job, &mut session);
        bar.finish_and_clear();
        session.end();
        done?;
    }
    let messages = instance.messages();
    for m in &messages {
        eprintln!("validation: {m}");
    }
    println!("wrote {}", args.output.display());
    Ok(if messages.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(4) })
}

/// Texels around of an environment map that has as many to a degree as the middle of the picture has pixels.
fn texels_around(args: &Args) -> u32 {
    let height = f64::from(args.size[1]) * f64::from(args.supersample);
    let focal_length = 0.5 * height / (0.5 * f64::from(args.fov_y).to_radians()).tan();
    (std::f64::consts::TAU * focal_length).ceil() as u32
}

fn announce(scene: &Scene, device: &str, driver: &str) {
    println!("device: {device} ({driver})");
    if scene.dropped > 0 {
        println!("dropped: {} particles that are not finite", scene.dropped);
    }
    if scene.particles.ellipsoids.is_empty() {
        println!("particles: none; only the background is rendered");
    } else if scene.report == Report::default() {
        let p = &scene.particles;
        println!(
            "particles: {}, prepared on the device; radius {} ({})",
            p.ellipsoids.len(),
            p.radius,
            scene.radius_source
        );
    } else {
        let (r, p) = (&scene.report, &scene.particles);
        println!("particles: {} splash, {} body; radius {} ({})", r.splash, r.body, p.radius, scene.radius_source);
    }
}

fn plan<'a>(args: &'a Args, scene: &'a Scene) -> Result<Job<'a>, Box<dyn std::error::Error>> {
    let radius = scene.particles.radius;
    let (low, high) = scene.particles.bounds().unwrap_or((Vec3::splat(-1.0), Vec3::splat(1.0)));
    let aspect = args.size[0].max(1) as f32 / args.size[1].max(1) as f32;
    let view = View { eye: args.eye, target: args.target, up: args.up, fov_y_deg: args.fov_y };
    let (camera, eye) = camera::frame(&view, scene.origin, &scene.particles, aspect, 0.1 * radius)?;
    let s = args.supersample;
    let times = |edge: u32| edge.checked_mul(s).ok_or("the size times the supersampling is too large");
    let widest = (Settings::MAX_WINDOW - 1) / s + 1;
    if args.window.is_multiple_of(2) || !(3..=widest).contains(&args.window) {
        let remedy = format!("at --supersample {s} use an odd number of pixels from 3 to {}", (widest - 1) / 2 * 2 + 1);
        return Err(Error::Parameter { parameter: "window", value: args.window.to_string(), remedy }.into());
    }
    let settings = Settings {
        refractions: args.refractions,
        internal_reflections: args.internal_reflections,
        fresnel: match args.fresnel {
            FresnelArg::Schlick => Fresnel::Schlick,
            FresnelArg::Exact => Fresnel::Exact,
        },
        ior: args.ior,
        absorption: args.absorption.map_or(Vec3::new(1.0, 0.35, 0.2) * (1.2 / (high - low).length()), |a| a.as_vec3()),
        // The window covers the same part of the picture at any supersampling.
        window: (args.window - 1) * s + 1,
        iterations: args.iterations,
        sigma: args.sigma,
        weighting: match args.weighting {
            WeightingArg::ViewDependent => Weighting::ViewDependent,
            WeightingArg::Euclidean => Weighting::Euclidean,
        },
        occlusion_culling: !args.no_culling,
        ..Settings::default()
    };
    settings.validate()?;
    let size = [times(args.size[0])?, times(args.size[1])?];
    Ok(Job { args, scene, prepared: None, camera, eye, settings, size, eye_inside: scene.inside(eye) })
}

fn render(job: &mut Job, session: &mut Session) -> Result<(), Box<dyn std::error::Error>> {
    let upload = job.scene.give(job.args.prepare, session)?;
    let (camera, settings) = (job.camera, job.settings);
    let mut input = FrameInput {
        slot: 0,
        camera: &camera,
        settings: &settings,
        scene: None,
        eye_inside: job.eye_inside,
        output: ash::vk::ImageView::null(), // the session's canvas
        debug: false,
        positions: upload.as_ref().map(|u| job.scene.on_device(u)),
        neighbours: 0,
    };
    let mut times = session.frame(&input)?;
    if job.args.stats.is_some() {
        // The first frame compiles shaders; the second is timed.
        times = session.frame(&input)?;
    }
    let picture = average(&session.picture()?, job.size, job.args.supersample);
    images::write_picture(&job.args.output, job.args.size, &picture)?;
    if job.args.dump.is_none() && job.args.stats.is_none() {
        return Ok(());
    }
    let memory = session.renderer.memory();
    input.debug = true;
    input.neighbours = if job.args.dump_neighbours { 256 } else { 0 };
    session.frame(&input)?;
    if job.args.dump_neighbours {
        // Counts are right whatever there is room for.
        let most = prepared::most_neighbours(session, job.scene.positions.len())?;
        if most > input.neighbours {
            input.neighbours = most;
            session.frame(&input)?;
        }
    }
    if job.args.prepare.on_device() {
        job.prepared = Some(prepared::read(session, job.scene.particles.radius)?);
    }
    if let Some(folder) = &job.args.dump {
        dump::write(folder, job, session)?;
    }
    if let Some(path) = &job.args.stats {
        stats::write(path, job, session, times.as_ref(), &memory)?;
    }
    Ok(())
}

/// Mean of each n x n block, in linear light.
fn average(pixels: &[[f32; 3]], size: [u32; 2], n: u32) -> Vec<[f32; 3]> {
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
