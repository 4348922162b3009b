//! `meniscus truth`: a scene, path-traced off-line.

pub mod cache;
mod write;

use crate::{
    options::{self, Options},
    outputs,
    picture::Picture,
    report,
    scene::{Prepare, Scene, progress, spinner},
    terminal,
};
use cache::Cache;
use clap::builder::PossibleValuesParser;
use glam::{DVec3, Mat3};
use meniscus::{
    Camera, Ellipsoid, Equirect, Liquid, Particles,
    io::images,
    study::{
        analytic,
        film::{Film, PASS},
        first::{self, First},
        measures::{self, Linear},
        mesh::Mesh,
        mesh_file,
        reconstruct::{self, Reconstruction},
        surface::{MeshSurface, Surface},
        tracer::Tracer,
        view::View,
    },
};
use serde_json::{Value, json};
use std::{
    error::Error,
    path::{Path, PathBuf},
    process::ExitCode,
    time::{Duration, Instant},
};

#[derive(clap::Args)]
pub struct Args {
    /// Particle file, as `render` takes it; without one, the embedded dam break
    pub file: Option<PathBuf>,
    /// Folder for the picture, its noise, the maps of what pixel centres meet, and truth.json
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub options: Options,
    /// Trace this mesh (.ply, .obj, .npz) instead of one that is made of the particles
    #[arg(long, value_name = "FILE", conflicts_with = "analytic")]
    pub mesh: Option<PathBuf>,
    /// Trace shapes with exact intersections instead of particles
    #[arg(long, value_name = "NAME", conflicts_with = "file", long_help = analytic_help(),
        value_parser = PossibleValuesParser::new(analytic::SCENES.map(|s| s.0)))]
    pub analytic: Option<String>,
    /// Passes that smooth the mesh which splashsurf makes of the particles
    #[arg(long, value_name = "N", default_value_t = reconstruct::SMOOTHING_PASSES, value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub smoothing_passes: u32,
    /// Make another mesh of the particles: marching cubes of the density field that `--layers field` has
    #[arg(long, conflicts_with_all = ["mesh", "analytic", "smoothing_passes"])]
    pub isosurface: bool,
    /// Samples a pixel, a multiple of 16 and at least 32
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = samples)]
    pub samples: u32,
    /// Folder for meshes and for films that can be gone on with; `cache` in the output's if not given
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

fn analytic_help() -> String {
    let each = analytic::SCENES.map(|(name, what)| format!("{name}: {what}"));
    format!("Trace shapes with exact intersections instead of particles:\n{}", each.join("\n"))
}

pub fn samples(text: &str) -> Result<u32, String> {
    // Noise is told by how passes differ: there have to be two.
    let most = 1 << 20;
    let fits = |n: &u32| n.is_multiple_of(PASS) && (2 * PASS..=most).contains(n);
    text.parse().ok().filter(fits).ok_or_else(|| format!("use a multiple of {PASS}, from {} to {most}", 2 * PASS))
}

/// What is traced.
struct Subject {
    surface: Box<dyn Surface>,
    /// Names it: the same name, the same surface.
    name: String,
    record: Value,
    camera: Camera,
    liquid: Liquid,
    picture: Picture,
    /// Of the file's coordinates; the camera's view is relative to it.
    origin: DVec3,
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let picture = args.picture()?;
    let environment = environment(&picture)?;
    let subject = args.subject(picture)?;
    let cache = args.folders()?;
    let view = View::new(&subject.camera, subject.picture.size, &environment);
    let tracer = Tracer::new(&*subject.surface, &view, &subject.liquid);
    let key = cache::film_key(&subject, &environment, args.samples);
    let start = Instant::now();
    let film = expose(&tracer, &cache, &key, subject.picture.size, args.samples / PASS)?;
    let bar = spinner("maps of first interfaces");
    let maps = first::maps(&tracer);
    bar.finish_and_clear();
    let noise =
        write::all(&args.output, &subject, &film, &maps, |noise| args.record(&subject, noise, start.elapsed()))?;
    terminal::progress(format!("noise: relative MSE {noise:.2e} from {} samples a pixel", args.samples));
    terminal::progress(format!("wrote {}", args.output.display()));
    Ok(ExitCode::SUCCESS)
}

/// The environment, as fine as it is: samples average it.
fn environment(picture: &Picture) -> Result<Equirect, images::ImageError> {
    match &picture.environment.file {
        Some(file) => images::read_environment_within(file, None, &picture.max_memory),
        None => Ok(Equirect::procedural_sky()),
    }
}

/// A scene's truth, as `chart` compares pictures with it.
pub struct Truth {
    pub picture: Linear,
    /// What pixel centres meet.
    pub first: Vec<First>,
    /// As a relative mean squared error.
    pub noise: f64,
    /// Hash of the mesh.
    pub mesh: String,
    /// Names the truth by all that decides it.
    pub key: String,
    subject: Subject,
    environment: Equirect,
}

impl Truth {
    /// What `ask` finds out by rays in the scene.
    pub fn trace<T>(&self, ask: impl FnOnce(&Tracer, &Camera) -> T) -> T {
        let subject = &self.subject;
        let view = View::new(&subject.camera, subject.picture.size, &self.environment);
        ask(&Tracer::new(&*subject.surface, &view, &subject.liquid), &subject.camera)
    }

    /// Where pixel centres meet liquid.
    pub fn liquid(&self) -> Vec<bool> {
        self.first.iter().map(|f| f.hits > 0).collect()
    }
}

/// The truth of particles whose mesh is made in some way, traced or from the cache.
pub fn of_scene(
    picture: &Picture,
    scene: &Scene,
    how: Reconstruction,
    samples: u32,
    cache: &Cache,
) -> Result<Truth, Box<dyn Error>> {
    let environment = environment(picture)?;
    let mesh = cache.mesh_of(scene, how)?;
    mesh.check()?;
    let subject = Subject::of_mesh(picture.clone(), &scene.particles, scene.origin, mesh, Value::Null)?;
    let size = subject.picture.size;
    let view = View::new(&subject.camera, size, &environment);
    let tracer = Tracer::new(&*subject.surface, &view, &subject.liquid);
    let key = cache::film_key(&subject, &environment, samples);
    let film = expose(&tracer, cache, &key, size, samples / PASS)?;
    let light = film.picture();
    let first = first::maps(&tracer);
    Ok(Truth {
        noise: measures::relative_noise(&light, &film.variance()),
        picture: Linear { size, pixels: light.iter().map(|p| p.as_vec3().to_array()).collect() },
        first,
        mesh: subject.name.clone(),
        key,
        subject,
        environment,
    })
}

/// All passes of a picture, from those on that the cache has.
fn expose(tracer: &Tracer, cache: &Cache, key: &str, size: [u32; 2], passes: u32) -> Result<Film, Box<dyn Error>> {
    let mut film = cache.film(key, size).unwrap_or_else(|| Film::new(size));
    if film.passes() > 0 && film.passes() < passes {
        terminal::progress(format!("going on from {} of {passes} passes", film.passes()));
    }
    let bar = progress(u64::from(passes) * u64::from(size[1]), "tracing rows");
    bar.set_position(u64::from(film.passes()) * u64::from(size[1]));
    // The time left follows from what is traced now, not from what was found.
    bar.reset_eta();
    let (mut saved, mut cost) = (Instant::now(), Duration::ZERO);
    while film.passes() < passes {
        film.expose(tracer, &|| bar.inc(1));
        // Saving may take a twentieth of the time.
        if film.passes() == passes || saved.elapsed() > 20 * cost {
            let begin = Instant::now();
            cache.keep_film(key, &film)?;
            (saved, cost) = (Instant::now(), begin.elapsed());
        }
    }
    bar.finish_and_clear();
    Ok(film)
}

impl Args {
    fn picture(&self) -> Result<Picture, Box<dyn Error>> {
        if self.options.device.is_some() {
            return Err("the truth is traced on the CPU: leave out --device".into());
        }
        let mut picture = self.options.over(self.options.base()?, None)?;
        picture.draw(self.file.as_deref());
        picture.prepare = Some(Prepare::Cpu);
        picture.validate()?;
        Ok(picture)
    }

    /// Makes the folders that are written to: not before input is known to be good.
    fn folders(&self) -> Result<Cache, outputs::OutputError> {
        outputs::folder(&self.output)?;
        let place = self.cache.clone().unwrap_or_else(|| self.output.join("cache"));
        Cache::open(&place)
    }

    fn subject(&self, picture: Picture) -> Result<Subject, Box<dyn Error>> {
        if let Some(name) = &self.analytic {
            let shapes = analytic::scene(name).ok_or("no such analytic scene")?;
            let corner = DVec3::splat(1.2);
            let record = json!({"analytic": name});
            return Subject::new(
                picture,
                &stand_in(-corner, corner, None),
                DVec3::ZERO,
                Box::new(shapes),
                name,
                record,
            );
        }
        let named = |e: &dyn std::fmt::Display, path: &Path| format!("{}: {e}", path.display());
        if let Some(path) = &self.mesh {
            let mesh = mesh_file::read(path, &picture.max_memory)?;
            mesh.check().map_err(|e| named(&e, path))?;
            let record = mesh_record(&mesh, Some(path));
            if picture.particles.is_none() {
                let (low, high) = mesh.bounds();
                let origin = if low.length().max(high.length()) > 16.0 * (high - low).length() {
                    0.5 * (low + high)
                } else {
                    DVec3::ZERO
                };
                let particles = stand_in(low - origin, high - origin, picture.radius);
                return Subject::of_mesh(picture, &particles, origin, mesh, record);
            }
            let scene = load(&picture)?;
            return Subject::of_mesh(picture, &scene.particles, scene.origin, mesh, record);
        }
        let scene = load(&picture)?;
        let how = match self.isosurface {
            true => Reconstruction::Isosurface,
            false => Reconstruction::Smoothed(self.smoothing_passes),
        };
        let mesh = self.folders()?.mesh_of(&scene, how)?;
        let source = picture.particles.as_deref().unwrap_or(Path::new("embedded dam break"));
        mesh.check().map_err(|e| named(&e, source))?;
        let mut record = mesh_record(&mesh, None);
        record["reconstruction"] = json!(how.to_string());
        record["smoothing_passes"] = json!((!self.isosurface).then_some(self.smoothing_passes));
        Subject::of_mesh(picture, &scene.particles, scene.origin, mesh, record)
    }

    fn record(&self, subject: &Subject, noise: f64, time: Duration) -> Value {
        json!({
            "meniscus": env!("CARGO_PKG_VERSION"),
            "commit": report::COMMIT,
            "command": options::command(),
            "surface": subject.record,
            "asked": subject.picture.record(),
            "origin": subject.origin.to_array(),
            "view": subject.camera.view.transpose().to_cols_array_2d(),
            "projection": subject.camera.projection.transpose().to_cols_array_2d(),
            "ior": subject.liquid.ior,
            "absorption": subject.liquid.absorption.to_array(),
            "samples": self.samples,
            "interfaces_before_roulette": meniscus::study::tracer::ROULETTE,
            "noise": {
                "relative_mse": noise,
                "meaning": "mean over pixels and channels of variance / (light^2 + 0.01); variance.npy is of each pixel's mean",
            },
            "maps": {
                "depth": "along the view axis, world units, at pixel centres; NaN where there is no liquid",
                "normal": "world space, out of the liquid, as light is bent by it",
                "final_direction": "world space: refracted wherever it can be, reflected only beyond the critical angle",
                "path_length": "length of that path inside the liquid, world units",
                "hits": "interfaces of that path",
            },
            "seconds": time.as_secs_f64(),
        })
    }
}

fn load(picture: &Picture) -> Result<Scene, Box<dyn Error>> {
    let scene = picture.load(picture.particles.as_deref(), Prepare::Cpu)?;
    if scene.positions.is_empty() {
        return Err(reconstruct::ReconstructError::NoParticles.into());
    }
    Ok(scene)
}

/// What a mesh is, for the record; `file` where it was read from one.
fn mesh_record(mesh: &Mesh, file: Option<&Path>) -> Value {
    json!({
        "mesh": mesh.hash(),
        "file": file.map(|f| f.to_string_lossy()),
        "vertices": mesh.vertices.len(),
        "triangles": mesh.triangles.len(),
        "normals": mesh.normals.is_some(),
        "volume": mesh.volume(),
    })
}

/// For the camera and the absorption, what fills a box where there are no particles.
fn stand_in(low: DVec3, high: DVec3, radius: Option<f64>) -> Particles {
    let radius = radius.unwrap_or(0.01 * (high - low).length()) as f32;
    let ball = |center: DVec3| Ellipsoid { center: center.as_vec3(), axes: Mat3::ZERO };
    let corner = |i: u32| DVec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), high, low);
    Particles { radius, ellipsoids: (0..8).map(|i| ball(corner(i))).collect(), splash_count: 0 }
}

impl Subject {
    fn new(
        picture: Picture,
        particles: &Particles,
        origin: DVec3,
        surface: Box<dyn Surface>,
        name: &str,
        record: Value,
    ) -> Result<Subject, Box<dyn Error>> {
        let (camera, _, view) = picture.camera_of(origin, particles)?;
        camera.validate()?;
        let liquid = picture.settings(particles).liquid;
        let picture = Picture { camera: view, ..picture };
        Ok(Subject { surface, name: name.to_owned(), record, camera, liquid, picture, origin })
    }

    fn of_mesh(
        picture: Picture,
        particles: &Particles,
        origin: DVec3,
        mesh: Mesh,
        record: Value,
    ) -> Result<Subject, Box<dyn Error>> {
        let bar = spinner("hierarchy of boxes");
        let name = mesh.hash();
        let surface = MeshSurface::new(&mesh.moved(-origin));
        bar.finish_and_clear();
        Subject::new(picture, particles, origin, Box::new(surface), &name, record)
    }
}
