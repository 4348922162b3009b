//! Options that `render` and `bench` share: each stands here once, and its default in the library.

use crate::{
    camera::{self, View},
    scene::{Prepare, Scene, Source},
    terminal,
};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use glam::{DVec3, Vec3};
use meniscus::{
    Camera, Equirect, Error, Fresnel, Particles, Settings, Weighting,
    io::{
        Budget,
        images::{self, ImageError},
        particles::ReadError,
    },
    prepare,
};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What is drawn, from where, how, and on what.
#[derive(clap::Args)]
pub struct Options {
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
    #[arg(long, value_name = "N", default_value_t = Settings::default().refractions)]
    pub refractions: u32,
    /// Total internal reflections followed
    #[arg(long, value_name = "N", default_value_t = Settings::default().internal_reflections)]
    pub internal_reflections: u32,
    /// Reflectance: Schlick's approximation or exact
    #[arg(long, value_parser = choice(&FRESNEL), default_value = name(&FRESNEL, Settings::default().fresnel))]
    pub fresnel: Fresnel,
    /// Plane-fitting window in pixels of the picture: odd
    #[arg(long, value_name = "N", default_value_t = Settings::default().window)]
    pub window: u32,
    /// Plane-fitting iterations
    #[arg(long, value_name = "N", default_value_t = Settings::default().iterations)]
    pub iterations: u32,
    /// Plane-fitting sigma in particle radii
    #[arg(long, value_name = "R", default_value_t = Settings::default().sigma)]
    pub sigma: f32,
    /// Plane-fitting weights: difference of depths, or distance of points
    #[arg(long, value_parser = choice(&WEIGHTING), default_value = name(&WEIGHTING, Settings::default().weighting))]
    pub weighting: Weighting,
    /// Particle radius in world units; from the file, or estimated from spacing, if not given
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    pub radius: Option<f64>,
    /// Particles with less than this share of a filled body's density are splash
    #[arg(long, value_name = "T", default_value_t = prepare::Options::default().splash_threshold)]
    pub splash_threshold: f32,
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
    #[arg(long, value_name = "N", default_value_t = Settings::default().ior)]
    pub ior: f32,
    /// Where classes and ellipsoids are made; if not given, `render` does it on the CPU and `bench` on the device
    #[arg(long, value_enum)]
    pub prepare: Option<Prepare>,
    /// Draw every particle, also those that others hide
    #[arg(long)]
    pub no_culling: bool,
    /// Device whose name or driver contains this; the best one if not given
    #[arg(long, value_name = "NAME")]
    pub device: Option<String>,
}

/// The words for a setting's choices.
type Choices<T> = [(&'static str, T)];
pub const FRESNEL: [(&str, Fresnel); 2] = [("schlick", Fresnel::Schlick), ("exact", Fresnel::Exact)];
pub const WEIGHTING: [(&str, Weighting); 2] =
    [("view-dependent", Weighting::ViewDependent), ("euclidean", Weighting::Euclidean)];

/// The word for a choice.
pub fn name<T: PartialEq>(choices: &Choices<T>, value: T) -> &'static str {
    choices.iter().find(|c| c.1 == value).map_or("unknown", |c| c.0)
}

fn choice<T: Copy + Send + Sync>(choices: &'static Choices<T>) -> impl TypedValueParser<Value = T> {
    let value = |word: String| choices.iter().find(|c| c.0 == word).map(|c| c.1).ok_or("unknown");
    PossibleValuesParser::new(choices.iter().map(|c| c.0)).try_map(value)
}

fn parse_size(s: &str) -> Result<[u32; 2], String> {
    let wrong = || format!("\"{}\" is not WIDTHxHEIGHT, such as 1024x768", terminal::plain(s));
    let (w, h) = s.split_once('x').ok_or_else(wrong)?;
    Ok([w.parse().map_err(|_| wrong())?, h.parse().map_err(|_| wrong())?])
}

fn parse_vector(s: &str) -> Result<DVec3, String> {
    let parts: Result<Vec<f64>, _> = s.split(',').map(|t| t.trim().parse()).collect();
    match parts.as_deref() {
        Ok([x, y, z]) if DVec3::new(*x, *y, *z).is_finite() => Ok(DVec3::new(*x, *y, *z)),
        _ => Err(format!("\"{}\" is not three finite numbers, such as 0,1,0", terminal::plain(s))),
    }
}

impl Options {
    /// The environment, as fine as the pixels in the middle of a picture that is rendered at a multiple of its size.
    pub fn environment(&self, times: u32) -> Result<Equirect, ImageError> {
        let Some(path) = &self.env else { return Ok(Equirect::procedural_sky()) };
        let focal_length =
            0.5 * f64::from(self.size[1]) * f64::from(times) / (0.5 * f64::from(self.fov_y).to_radians()).tan();
        let texels_around = (std::f64::consts::TAU * focal_length).ceil().max(1.0) as u32;
        images::read_environment_within(path, Some(texels_around), &self.max_memory)
    }

    /// Reads a particle file, or what is embedded, and prepares it as these options say.
    pub fn load(&self, file: Option<&Path>, prepare: Prepare) -> Result<Scene, Box<dyn std::error::Error>> {
        let source = Source {
            file,
            radius: self.radius,
            splash_threshold: self.splash_threshold,
            drop_invalid: self.drop_invalid,
            budget: self.max_memory,
            prepare,
        };
        Scene::load(&source).map_err(|e| match file {
            // Readers name their file; what comes after them does not know it.
            Some(file) if !e.is::<ReadError>() => format!("{}: {e}", file.display()).into(),
            _ => e,
        })
    }

    /// The camera and its eye, relative to the scene's origin.
    pub fn camera(&self, scene: &Scene) -> Result<(Camera, Vec3), Error> {
        let view = View { eye: self.eye, target: self.target, up: self.up, fov_y_deg: self.fov_y };
        let aspect = self.size[0].max(1) as f32 / self.size[1].max(1) as f32;
        let near = 0.1 * scene.particles.radius;
        camera::frame(&view, scene.origin, &scene.particles, aspect, near)
    }

    /// Settings of a frame of these particles, rendered at a multiple of the size.
    pub fn settings(&self, particles: &Particles, times: u32) -> Result<Settings, Error> {
        let (low, high) = particles.bounds().unwrap_or((Vec3::splat(-1.0), Vec3::splat(1.0)));
        // In double precision, which the square of no length overflows.
        let blue = || Vec3::new(1.0, 0.35, 0.2) * (1.2 / (high - low).as_dvec3().length()) as f32;
        let widest = (Settings::MAX_WINDOW - 1) / times + 1;
        if self.window.is_multiple_of(2) || !(3..=widest).contains(&self.window) {
            let scale = if times > 1 { format!("at --supersample {times} ") } else { String::new() };
            let remedy = format!("{scale}use an odd number of pixels from 3 to {}", (widest - 1) / 2 * 2 + 1);
            return Err(Error::Parameter { parameter: "window", value: self.window.to_string(), remedy });
        }
        let settings = Settings {
            refractions: self.refractions,
            internal_reflections: self.internal_reflections,
            fresnel: self.fresnel,
            ior: self.ior,
            absorption: self.absorption.map_or_else(blue, |a| a.as_vec3()),
            // The window covers the same part of the picture at any multiple.
            window: (self.window - 1) * times + 1,
            iterations: self.iterations,
            sigma: self.sigma,
            weighting: self.weighting,
            occlusion_culling: !self.no_culling,
            ..Settings::default()
        };
        settings.validate()?;
        Ok(settings)
    }
}

/// Every setting by name.
pub fn record(settings: &Settings) -> Vec<(&'static str, Value)> {
    // Without `..`, so that what comes new is recorded too.
    let Settings {
        refractions,
        internal_reflections,
        fresnel,
        ior,
        absorption,
        window,
        iterations,
        sigma,
        weighting,
        occlusion_culling,
        quads_only,
    } = *settings;
    vec![
        ("refractions", json!(refractions)),
        ("internal_reflections", json!(internal_reflections)),
        ("fresnel", json!(name(&FRESNEL, fresnel))),
        ("ior", json!(ior)),
        ("absorption", json!(absorption.to_array())),
        ("window", json!(window)),
        ("iterations", json!(iterations)),
        ("sigma_radii", json!(sigma)),
        ("weighting", json!(name(&WEIGHTING, weighting))),
        ("occlusion_culling", json!(occlusion_culling)),
        ("quads_only", json!(quads_only)),
    ]
}

/// The command line, for whoever wants to repeat it.
pub fn command() -> Vec<String> {
    std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect()
}
