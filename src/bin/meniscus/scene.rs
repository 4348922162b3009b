//! From a particle file to particles as drawn.

use crate::{picture::Picture, terminal};
use clap::ValueEnum;
use glam::{DVec3, Mat3, Vec3};
use indicatif::{ProgressBar, ProgressStyle};
use meniscus::{
    Camera, Class, Ellipsoid, EyeInside, FrameInput, Particles, Point, Renderer, Settings,
    ash::vk::ImageView,
    host::{Session, Upload},
    io::particles::{Invalid, ParticleFile, ReadError, TimeStep, check_finite, read_bytes, read_within},
    prepare::{self, DensityField, DevicePositions, Input, Options, PrepareError, Report, Search},
    shader,
};
use serde::{Deserialize, Serialize};
use std::{
    error::Error,
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

/// The dam break that is rendered when no file is named; see assets/README.md.
const EMBEDDED: &[u8] = include_bytes!("../../../assets/dam_break.bgeo");
const EMBEDDED_RADIUS: f64 = 0.025;

/// Particles as drawn, and how they came to be.
pub struct Scene {
    pub particles: Particles,
    pub report: Report,
    /// Everything is drawn relative to this point of the file's coordinates, which keeps single precision precise.
    pub origin: DVec3,
    pub radius_source: &'static str,
    /// When it is, where it is a time step of a collection.
    pub time: Option<f64>,
    pub dropped: usize,
    pub prepare_ms: f64,
    /// Centres, relative to the origin.
    pub positions: Vec<Vec3>,
    /// Of the particles as drawn, where the CPU prepared them and the file has velocities.
    speeds: Option<Vec<f32>>,
    /// The file's own, in its order.
    classes: Option<Vec<Class>>,
    pub options: Options,
    density: Option<DensityField>,
}

/// Where classes and ellipsoids are made.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Prepare {
    /// On the CPU, before the frame.
    Cpu,
    /// On the device, in every frame; neighbours by sorted cells.
    Gpu,
    /// On the device; neighbours by the particle-cell relation table (Im16).
    GpuRelation,
}

impl Prepare {
    pub fn on_device(self) -> bool {
        self != Prepare::Cpu
    }

    /// As the command line calls it.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned())
    }

    pub fn search(self, otherwise: Search) -> Search {
        if self == Prepare::GpuRelation { Search::Relation } else { otherwise }
    }
}

impl Scene {
    /// Reads a particle file, a time step that it has, or what is embedded; also says how many particles were left out of it.
    pub fn read(
        picture: &Picture,
        source: Option<&Path>,
        step: Option<&TimeStep>,
    ) -> Result<(ParticleFile, usize), ReadError> {
        let bar = spinner("reading particles");
        let path = name(source);
        let mut file = match (source, step) {
            (_, Some(step)) => step.read(&picture.max_memory)?,
            (Some(path), None) => read_within(path, &picture.max_memory)?,
            (None, None) => read_bytes(path, EMBEDDED, &picture.max_memory)?,
        };
        let policy = if picture.drop_invalid { Invalid::Drop } else { Invalid::Reject };
        let dropped = check_finite(&mut file, policy, path)?;
        // Simulators may write them in another order each time; those of a sequence are followed.
        file.sort_by_ids();
        bar.finish_and_clear();
        Ok((file, dropped))
    }

    /// Prepares what was read as the picture wants it.
    pub fn of(
        picture: &Picture,
        (file, dropped): (ParticleFile, usize),
        source: Option<&Path>,
        prepare: Prepare,
    ) -> Result<Scene, Box<dyn Error>> {
        let path = name(source);
        let (origin, positions) = local(&file.positions);
        drop(file.positions); // twice as large as what was made of them
        let (radius, radius_source) = match (picture.radius, file.radius, source) {
            (Some(r), _, _) => (r, "given"),
            (None, _, None) => (EMBEDDED_RADIUS, "embedded scene"),
            (None, r, _) => own_radius(r, &positions)
                .ok_or("the particle radius cannot be estimated from fewer than two places: give --radius")?,
        };
        let reach = positions.iter().fold(radius.abs(), |m, p| m.max(f64::from(p.abs().max_element())));
        if reach.is_nan() || reach >= 1e37 {
            return Err(format!("coordinates or radius reach {reach:e}: scale the scene to below 1e37").into());
        }
        let classes: Option<Vec<Class>> = file
            .classes
            .as_ref()
            .map(|c| c.iter().map(|c| if *c == 0 { Class::Splash } else { Class::Body }).collect());
        let axes: Option<Vec<Mat3>> = file.axes.as_ref().map(|a| a.iter().map(|m| m.as_mat3()).collect());
        let options = Options {
            support: picture.preparation.support.or(file.support.map(|s| s as f32)),
            search: prepare.search(picture.preparation.search),
            ..picture.preparation
        };
        if prepare.on_device() && (classes.is_some() || axes.is_some()) {
            return Err(
                "it brings classes or ellipsoids of its own, and --prepare gpu makes them anew: use --prepare cpu"
                    .into(),
            );
        }
        let input = Input::new(&positions, radius as f32)
            .classes(classes.as_deref())
            .ellipsoids(axes.as_deref())
            .keep_class_below(picture.keep_class_below);
        let velocities: Option<Vec<Vec3>> =
            file.velocities.as_ref().map(|all| all.iter().map(|v| v.as_vec3()).collect());
        let (particles, report, speeds, prepare_ms) = make(&input, velocities.as_deref(), &options, prepare)?;
        if report.splash_axes_ignored > 0 {
            terminal::complain(format!(
                "note: {} splash particles have axes of their own in {}: splashes are drawn as balls of {} particle radii",
                report.splash_axes_ignored,
                path.display(),
                shader::SPLASH_RADIUS
            ));
        }
        let density = if report.body > 0 || prepare.on_device() {
            Some(DensityField::new(&positions, radius as f32, &options)?)
        } else {
            None
        };
        Ok(Scene {
            particles,
            report,
            origin,
            radius_source,
            time: None,
            dropped,
            prepare_ms,
            positions,
            speeds,
            classes,
            options,
            density,
        })
    }

    /// Positions that were made, not read.
    pub fn synthetic(positions: Vec<Vec3>, radius: f32, picture: &Picture) -> Result<Scene, Box<dyn Error>> {
        let prepare = picture.preparer();
        let options = Options { search: prepare.search(picture.preparation.search), ..picture.preparation };
        let input = Input::new(&positions, radius);
        let (particles, report, speeds, prepare_ms) = make(&input, None, &options, prepare)?;
        Ok(Scene {
            particles,
            report,
            origin: DVec3::ZERO,
            radius_source: "made",
            time: None,
            dropped: 0,
            prepare_ms,
            positions,
            speeds,
            classes: None,
            options,
            density: None,
        })
    }

    /// Gives its particles to the renderer or, where the device prepares them, its positions in a buffer.
    pub fn give<'a>(
        &self,
        prepare: Prepare,
        settings: &Settings,
        session: &mut Session<'a>,
    ) -> Result<Option<Upload<'a>>, Box<dyn Error>> {
        if prepare.on_device() {
            return Ok(Some(Upload::new(session.gpu, bytemuck::cast_slice(&self.positions))?));
        }
        let points = settings.method.layers.field().map(|_| self.points()).transpose()?;
        self.give_to(&mut session.renderer, points.as_deref())?;
        Ok(None)
    }

    /// Gives its particles, as the CPU prepared them, to a renderer; and the points that a density field is made of.
    pub fn give_to(&self, renderer: &mut Renderer, points: Option<&[Point]>) -> Result<(), meniscus::Error> {
        renderer.set_particles(&self.particles)?;
        if let Some(speeds) = &self.speeds {
            renderer.set_speeds(speeds)?;
        }
        points.map_or(Ok(()), |points| renderer.set_points(points))
    }

    /// What a density field is made of, as the CPU prepares it.
    pub fn points(&self) -> Result<Vec<Point>, PrepareError> {
        let input = Input::new(&self.positions, self.particles.radius).classes(self.classes.as_deref());
        prepare::points(&input, &self.options)
    }

    /// What [`Scene::give`] uploaded.
    pub fn on_device(&self, upload: &Upload) -> DevicePositions {
        let mut all = DevicePositions::packed(upload.buffer, self.positions.len() as u32, self.particles.radius);
        all.options = self.options;
        all
    }

    /// A frame of it, of what [`Scene::give`] uploaded, from an eye relative to the origin; into a session, which has an output of
    /// its own.
    pub fn input<'a>(
        &self,
        camera: &'a Camera,
        settings: &'a Settings,
        eye: Vec3,
        upload: Option<&Upload>,
    ) -> FrameInput<'a> {
        let mut input = FrameInput::new(0, camera, settings, ImageView::null());
        input.eye_inside = self.eye_inside(eye, upload.is_some());
        input.positions = upload.map(|u| self.on_device(u));
        input
    }

    /// What a frame is told of an eye: where its positions are on the device, to look itself.
    pub fn eye_inside(&self, eye: Vec3, on_device: bool) -> EyeInside {
        if on_device { EyeInside::OnDevice } else { self.inside(eye).into() }
    }

    /// Whether a point (relative to the origin) is inside the body: half as dense as a filled body.
    pub fn inside(&self, point: Vec3) -> bool {
        self.density.as_ref().is_some_and(|d| d.relative_density(point) >= shader::EYE_INSIDE)
    }
}

/// What messages call the source of particles.
pub fn name(source: Option<&Path>) -> &Path {
    source.unwrap_or(Path::new("embedded dam_break.bgeo"))
}

/// What [`make`] gives.
type Made = (Particles, Report, Option<Vec<f32>>, f64);

/// Particles as the CPU prepares them, or what is known before the device does; how fast they are; and the
/// milliseconds that it took.
fn make(input: &Input, velocities: Option<&[Vec3]>, options: &Options, how: Prepare) -> Result<Made, Box<dyn Error>> {
    let bar = progress(input.positions.len() as u64, "classes and ellipsoids");
    let start = std::time::Instant::now();
    let progress = |done| bar.set_position(done as u64);
    let (particles, report, speeds) = match velocities {
        _ if how.on_device() => (uniform(input, options), Report::default(), None),
        Some(velocities) => {
            let (particles, report, speeds) = prepare::prepare_with_velocities(input, velocities, options, &progress)?;
            (particles, report, Some(speeds))
        }
        None => {
            let (particles, report) = prepare::prepare_with_progress(input, options, &progress)?;
            (particles, report, None)
        }
    };
    let ms = start.elapsed().as_secs_f64() * 1e3;
    bar.finish_and_clear();
    Ok((particles, report, speeds, ms))
}

/// Spheres as large as any ellipsoid that the device may make: for the camera, and for the box around the liquid.
fn uniform(input: &Input, options: &Options) -> Particles {
    let radius = input.radius;
    let axes = Mat3::from_diagonal(Vec3::splat(radius * options.longest().max(shader::SPLASH_RADIUS)));
    let ellipsoids = input.positions.iter().map(|p| Ellipsoid { center: *p, axes }).collect();
    Particles { radius, ellipsoids, splash_count: 0 }
}

/// Positions relative to an origin that keeps single precision precise, and that.
pub fn local(positions: &[DVec3]) -> (DVec3, Vec<Vec3>) {
    let origin = origin(positions);
    (origin, positions.iter().map(|p| (*p - origin).as_vec3()).collect())
}

/// Zero, or the middle of a cloud that lies so far out that single precision would coarsen it.
fn origin(positions: &[DVec3]) -> DVec3 {
    let Some((low, high)) = positions.iter().map(|p| (*p, *p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else {
        return DVec3::ZERO;
    };
    let middle = 0.5 * (low + high);
    if middle.length() > 16.0 * (high - low).length() { middle.round() } else { DVec3::ZERO }
}

static ONE_BAR: AtomicBool = AtomicBool::new(false);

/// From now on steps of the work show no bars of their own: there is one for all of it.
pub fn one_bar() {
    ONE_BAR.store(true, Ordering::Relaxed);
}

/// The radius where none is given: the file's or, where it has none, what positions tell; and which of them it is.
pub fn own_radius(file: Option<f64>, positions: &[Vec3]) -> Option<(f64, &'static str)> {
    match file {
        None if positions.is_empty() => Some((1.0, "no particles")),
        _ => told_radius(file, || prepare::spacing(positions)),
    }
}

/// The file's radius or, where it has none, what the spacing of particles tells; and which of them it is.
pub fn told_radius(file: Option<f64>, spacing: impl FnOnce() -> Option<f32>) -> Option<(f64, &'static str)> {
    match file {
        Some(r) => Some((r, "file")),
        None => spacing().map(|s| (f64::from(prepare::radius_of_spacing(s)), "estimated from spacing")),
    }
}

/// A bar for work that may take longer than a second; shown on terminals only.
pub fn progress(length: u64, what: &'static str) -> ProgressBar {
    if ONE_BAR.load(Ordering::Relaxed) {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len} {eta}").expect("a constant template");
    let bar = ProgressBar::new(length).with_style(style).with_message(what);
    bar.enable_steady_tick(Duration::from_secs(1));
    bar
}

/// A spinner for work whose length is not known, on a terminal.
pub fn spinner(what: &'static str) -> ProgressBar {
    if ONE_BAR.load(Ordering::Relaxed) {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new_spinner().with_message(what);
    bar.enable_steady_tick(Duration::from_secs(1));
    bar
}
