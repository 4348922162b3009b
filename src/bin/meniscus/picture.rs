//! Everything that decides a picture: what a scene file holds, and the command line changes.

use crate::{
    camera::{self, View},
    choices,
    compositing::{Background, Channels},
    scene::{self, Prepare, Scene},
};
use glam::{DVec3, Vec3};
use meniscus::{
    Camera, Equirect, Error, Parameters, Particles, Settings,
    host::DeviceInfo,
    io::{
        Budget,
        images::{self, ImageError},
        particles::{ParticleFile, ReadError, TimeStep, has_steps, time_step},
    },
    prepare::{self, DevicePositions},
    renderer::Amount,
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::{
    ops::RangeInclusive,
    path::{Path, PathBuf},
};

/// What is drawn, from where, how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Picture {
    /// Particle file; the embedded dam break if there is none.
    pub particles: Option<PathBuf>,
    /// Of particles with time steps (.pvd) the one at this time, or the last before it.
    pub particles_time: Option<f64>,
    /// In world units; the file's, or estimated, if there is none.
    pub radius: Option<f64>,
    pub drop_invalid: bool,
    /// Each command has a default of its own.
    pub prepare: Option<Prepare>,
    /// The multiple of the size that is rendered at.
    pub supersample: u32,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Decides how far an environment map is averaged down.
    #[serde(with = "amount")]
    pub max_memory: Budget,
    /// Of pictures that are written, what is seen where there is no liquid.
    pub background: Background,
    /// Of pictures that are written, what they have beside colour.
    pub channels: Channels,
    pub camera: View,
    pub environment: Environment,
    /// How classes and ellipsoids are made; a support that is not given is the file's.
    pub preparation: prepare::Options,
    pub settings: Settings,
    /// Whether the absorption of the settings is meant, or is to suit the liquid's size.
    #[serde(skip)]
    pub absorption_given: bool,
    /// Below what share of a filled body's density classes were kept from frame to frame, if they were.
    #[serde(skip)]
    pub keep_class_below: Option<f32>,
    /// Whether the size is meant, or is to be a camera file's, if there is one.
    #[serde(skip)]
    pub size_given: bool,
    /// The time that is asked for, of whatever file.
    #[serde(skip)]
    pub time: Option<f64>,
    /// Whether that is a second of a film in the first place, so that files without time steps are right, too.
    #[serde(skip)]
    pub time_of_film: bool,
}

/// What is infinitely far away.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Environment {
    /// Equirectangular map; a procedural sky if there is none.
    pub file: Option<PathBuf>,
    /// Degrees around up, counter-clockwise as seen from above.
    pub rotation: f32,
}

/// Multiples of the size that can be rendered at.
pub const SUPERSAMPLE: RangeInclusive<i64> = 1..=3;

impl Default for Picture {
    fn default() -> Picture {
        Picture {
            particles: None,
            particles_time: None,
            radius: None,
            drop_invalid: false,
            prepare: None,
            supersample: 1,
            size: [1024, 768],
            max_memory: Budget::default(),
            background: Background::default(),
            channels: Channels::default(),
            camera: View::default(),
            environment: Environment::default(),
            preparation: prepare::Options::default(),
            settings: Settings::default(),
            absorption_given: false,
            keep_class_below: None,
            size_given: false,
            time: None,
            time_of_film: false,
        }
    }
}

/// An amount of memory, as the command line has it.
mod amount {
    use meniscus::io::Budget;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(budget: &Budget, to: S) -> Result<S::Ok, S::Error> {
        let short = budget.to_string();
        let exact = short.parse() == Ok(*budget);
        to.serialize_str(&if exact { short } else { budget.bytes().to_string() })
    }

    pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<Budget, D::Error> {
        String::deserialize(from)?.parse().map_err(D::Error::custom)
    }
}

fn wrong(parameter: &'static str, value: impl ToString, remedy: impl Into<String>) -> Error {
    Error::Parameter { parameter, value: value.to_string(), remedy: remedy.into() }
}

impl Picture {
    /// Checks what can be checked without the particles.
    pub fn validate(&self) -> Result<(), Error> {
        if let Some(radius) = self.radius.filter(|r| !meniscus::space::RADII.contains(&(*r as f32))) {
            let (least, most) = (meniscus::space::RADII.start(), meniscus::space::RADII.end());
            return Err(wrong(
                "radius",
                format!("{radius:e}"),
                format!("use {least:e} to {most:e}; scale the scene if need be"),
            ));
        }
        if !SUPERSAMPLE.contains(&i64::from(self.supersample)) {
            let (least, most) = (SUPERSAMPLE.start(), SUPERSAMPLE.end());
            return Err(wrong("supersample", self.supersample, format!("use {least} to {most}")));
        }
        if let Some(time) = self.particles_time.filter(|time| !time.is_finite()) {
            return Err(wrong("particles_time", time, "use a finite number"));
        }
        if self.size.contains(&0) {
            return Err(wrong("size", format!("{}x{}", self.size[0], self.size[1]), "use 1 or more pixels each way"));
        }
        if !self.environment.rotation.is_finite() {
            return Err(wrong("environment.rotation", self.environment.rotation, "use a finite number of degrees"));
        }
        self.camera.validate()?;
        self.preparation.validate()?;
        self.settings.validate()
    }

    /// Where particles are prepared.
    pub fn preparer(&self) -> Prepare {
        self.prepare.unwrap_or(Prepare::Cpu)
    }

    /// The environment, as fine as the pixels in the middle of the picture.
    pub fn environment(&self) -> Result<Equirect, ImageError> {
        let Some(path) = &self.environment.file else { return Ok(Equirect::procedural_sky()) };
        let focal_length = 0.5 * f64::from(self.size[1]) * f64::from(self.supersample)
            / (0.5 * f64::from(self.camera.fov_y)).to_radians().tan();
        let texels_around = (std::f64::consts::TAU * focal_length).ceil().max(1.0) as u32;
        images::read_environment_within(path, Some(texels_around), &self.max_memory)
    }

    /// Reads a particle file, or what is embedded, and prepares it.
    pub fn load(&self, file: Option<&Path>, prepare: Prepare) -> Result<Scene, Box<dyn std::error::Error>> {
        self.load_for(None, file, prepare)
    }

    /// [`Picture::load`] for a device: what it cannot draw is refused before it is prepared.
    pub fn load_for(
        &self,
        device: Option<&DeviceInfo>,
        file: Option<&Path>,
        prepare: Prepare,
    ) -> Result<Scene, Box<dyn std::error::Error>> {
        let step = self.step(file)?;
        let mut scene = self.prepared(device, Scene::read(self, file, step.as_ref())?, file, prepare)?;
        scene.time = step.map(|step| step.time);
        Ok(scene)
    }

    /// The time step of a file that is asked for.
    fn step(&self, file: Option<&Path>) -> Result<Option<TimeStep>, ReadError> {
        let steps = file.is_some_and(has_steps);
        let own = self.particles_time.filter(|_| file == self.particles.as_deref());
        let time = self.time.filter(|_| steps || !self.time_of_film).or(own);
        time.map(|time| time_step(scene::name(file), time, &self.max_memory)).transpose()
    }

    /// Another file in the place of its own, if there is one.
    pub fn draw(&mut self, file: Option<&Path>) {
        if let Some(file) = file {
            (self.particles, self.particles_time) = (Some(file.into()), None);
        }
    }

    /// Prepares what [`Scene::read`] read of a file, unless the device cannot draw it.
    pub fn prepared(
        &self,
        device: Option<&DeviceInfo>,
        read: (ParticleFile, usize),
        file: Option<&Path>,
        prepare: Prepare,
    ) -> Result<Scene, Box<dyn std::error::Error>> {
        let fits = device.map_or(Ok(()), |device| self.check_amount(device, read.0.positions.len(), prepare));
        // Readers name their file; what comes after them does not know it.
        fits.and_then(|()| Scene::of(self, read, file, prepare)).map_err(|e| match file {
            Some(file) => format!("{}: {e}", file.display()).into(),
            None => e,
        })
    }

    /// Refuses more particles than a device can draw, of whatever classes they will be.
    fn check_amount(
        &self,
        device: &DeviceInfo,
        count: usize,
        prepare: Prepare,
    ) -> Result<(), Box<dyn std::error::Error>> {
        let (size, settings) = (self.rendered_size()?, choices::enlarge(&self.settings, self.supersample)?);
        if prepare.on_device() {
            let options = prepare::Options { search: prepare.search(self.preparation.search), ..Default::default() };
            let count = u32::try_from(count).unwrap_or(u32::MAX);
            let positions = DevicePositions::packed(Default::default(), count, 1.0).options(options);
            return Ok(device.check_amount(size, Amount::OnDevice(&positions), &settings)?);
        }
        // What is of one class alone takes least.
        let of = |splash, body| device.check_amount(size, Amount::Prepared { splash, body }, &settings);
        Ok(of(0, count).or_else(|e| of(count, 0).map_err(|_| e))?)
    }

    /// The camera, its eye relative to the scene's origin, and the view that it is.
    pub fn camera(&self, scene: &Scene) -> Result<(Camera, Vec3, View), Error> {
        self.camera_of(scene.origin, &scene.particles)
    }

    /// [`Picture::camera`] of particles relative to an origin.
    pub fn camera_of(&self, origin: DVec3, particles: &Particles) -> Result<(Camera, Vec3, View), Error> {
        let aspect = self.size[0].max(1) as f32 / self.size[1].max(1) as f32;
        let near = self.camera.near.map_or(0.1 * particles.radius, |n| n as f32);
        let (mut camera, eye, view) = camera::frame(&self.camera, origin, particles, aspect, near)?;
        camera.environment_rotation = self.environment.rotation.to_radians();
        Ok((camera, eye, view))
    }

    /// Settings for these particles, as they are said: not widened for a multiple of the size.
    pub fn settings(&self, particles: &Particles) -> Settings {
        let mut settings = self.settings;
        if !self.absorption_given {
            let (low, high) = particles.bounds().unwrap_or((Vec3::splat(-1.0), Vec3::splat(1.0)));
            // In double precision, which the square of no length overflows.
            let per_length = (1.2 / (high - low).as_dvec3().length()) as f32;
            settings.liquid.absorption = Vec3::new(1.0, 0.35, 0.2) * per_length;
        }
        settings
    }

    /// With what was left to the scene as it decides: radius, camera, absorption.
    pub fn settled(self, scene: &Scene) -> Result<Picture, Error> {
        let (_, _, camera) = self.camera(scene)?;
        let (radius, settings) = (shortest(scene.particles.radius), self.settings(&scene.particles));
        let particles_time = scene.time;
        Ok(Picture { radius: Some(radius), particles_time, camera, settings, absorption_given: true, ..self })
    }

    /// Settings of the frame that is rendered.
    pub fn frame_settings(&self, particles: &Particles) -> Result<Settings, Error> {
        choices::enlarge(&self.settings(particles), self.supersample)
    }

    /// Size rendered at: the picture's times the supersampling.
    pub fn rendered_size(&self) -> Result<[u32; 2], &'static str> {
        let [width, height] = self.size.map(|edge| edge.checked_mul(self.supersample));
        let both = width.zip(height).ok_or("--size times --supersample is too large: use a smaller one of them")?;
        Ok(both.into())
    }

    /// By name, for whoever wants to repeat it.
    pub fn record(&self) -> Value {
        let mut shown = self.clone();
        for path in [&mut shown.particles, &mut shown.environment.file].into_iter().flatten() {
            *path = path.to_string_lossy().into_owned().into();
        }
        serde_json::to_value(&shown).unwrap_or(Value::Null)
    }

    /// Beside particles and settings: what was asked of radius, camera, environment and the like.
    pub fn record_rest(&self) -> Map<String, Value> {
        let Value::Object(mut all) = self.record() else { return Map::new() };
        all.retain(|key, _| !["particles", "settings"].contains(&key.as_str()));
        all
    }
}

/// A number as few digits say it, which is the same in single precision.
fn shortest(value: f32) -> f64 {
    let short = value.to_string().parse().ok().filter(|short| *short as f32 == value);
    short.unwrap_or(value.into())
}
