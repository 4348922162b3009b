//! Options that `render` and `bench` share: each stands here once, and its default in [`Picture`] or in the library.

use crate::{
    camera_file::{self, CameraFileError, Cameras},
    choices::{self, Choices},
    picture::{Picture, SUPERSAMPLE},
    scene::Prepare,
    scene_file::{SceneFile, SceneFileError},
    terminal,
};
use glam::DVec3;
use meniscus::{Parameters, Preset, io::Budget};
use std::{error::Error, fmt::Display, path::PathBuf};

/// Options that take the place of what a picture has there: each with its flag, its type and its place.
macro_rules! replacing {
    ($($(#[$meta:meta])* $name:ident: $Type:ty => $($place:ident).+;)*) => {
        #[derive(clap::Args)]
        struct Replacing { $($(#[$meta])* $name: Option<$Type>,)* }

        impl Replacing {
            fn apply(&self, picture: &mut Picture) {
                $(if let Some(given) = &self.$name {
                    picture.$($place).+ = given.clone().into();
                })*
            }
        }
    };
}

replacing! {
    #[arg(long, value_name = "WxH", value_parser = parse_size, help = or("Width and height in pixels", size_text()))]
    size: [u32; 2] => size;
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(SUPERSAMPLE),
        help = or("Render at a multiple of the size and average", Picture::default().supersample))]
    supersample: u32 => supersample;
    /// Eye, in the file's coordinates; chosen to frame the liquid if not given
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    eye: DVec3 => camera.eye;
    /// Camera of another program: .json (docs/blender.md has the script that writes it from Blender) or ParaView's .pvcc. Of its
    /// frames `sequence` takes each picture's
    #[arg(long, value_name = "FILE", conflicts_with_all = ["eye", "target", "orbit", "fov_y"])]
    camera: PathBuf => camera.file;
    /// Point to look at; the middle of the liquid if not given
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    target: DVec3 => camera.target;
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true,
        help = or("Up, for the camera and the environment", up_text()))]
    up: DVec3 => camera.up;
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, help = or(
        "Turns the eye around the target: counter-clockwise as seen from above", Picture::default().camera.orbit
    ))]
    orbit: f64 => camera.orbit;
    #[arg(long, value_name = "DEG", help = or("Vertical field of view in degrees", Picture::default().camera.fov_y))]
    fov_y: f32 => camera.fov_y;
    /// Equirectangular environment map, .hdr, .exr or .png; a procedural sky if not given. One that is finer than the
    /// picture's pixels, or too large for half of --max-memory, is averaged down
    #[arg(long, value_name = "FILE")]
    env: PathBuf => environment.file;
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, help = or(
        "Turns the environment around up: counter-clockwise as seen from above", Picture::default().environment.rotation
    ))]
    env_rotate: f32 => environment.rotation;
    /// Particle radius in world units; from the file, or estimated from spacing, if not given
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    radius: f64 => radius;
    #[arg(long, value_name = "SIZE", help = or(
        "Most memory that reading one file may take, with K, M, G or T. A small file may take less: 32 times its size and \
         a 32nd of this", Picture::default().max_memory
    ))]
    max_memory: Budget => max_memory;
    /// Where classes and ellipsoids are made; if not given, `render` does it on the CPU and `bench` on the device
    #[arg(long, value_enum)]
    prepare: Prepare => prepare;
}

/// What is drawn, from where, how, and on what. What is not given is as the scene file has it, or as by default.
#[derive(clap::Args)]
pub struct Options {
    /// Scene file (TOML, as `render --save-scene` writes it); other options come before what it says
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Of a .pvd: the time step at this time, or the last before it. Of a scene file with keys: the moment, in seconds of the film; 0
    /// if not given
    #[arg(long, value_name = "TIME", allow_negative_numbers = true, value_parser = parse_time)]
    pub time: Option<f64>,
    /// Of a camera file: the frame, also between two; the camera without frames, or the first, if not given
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, value_parser = camera_file::parse_frame)]
    pub camera_frame: Option<f64>,
    #[command(flatten)]
    replacing: Replacing,
    /// Drop particles whose position is not finite instead of failing
    #[arg(long)]
    drop_invalid: bool,
    /// Device whose name or driver contains this; the best one if not given
    #[arg(long, value_name = "NAME")]
    pub device: Option<String>,
    #[command(flatten)]
    choices: Choices,
}

/// Help for an option whose default is not the parser's.
fn or(help: &str, default: impl Display) -> String {
    format!("{help} [default: {default}]")
}

fn size_text() -> String {
    let [w, h] = Picture::default().size;
    format!("{w}x{h}")
}

fn up_text() -> String {
    Picture::default().camera.up.to_array().map(|v| v.to_string()).join(",")
}

fn parse_size(s: &str) -> Result<[u32; 2], String> {
    let wrong = || format!("\"{}\" is not WIDTHxHEIGHT, such as 1024x768", terminal::plain(s));
    let (w, h) = s.split_once('x').ok_or_else(wrong)?;
    Ok([w.parse().map_err(|_| wrong())?, h.parse().map_err(|_| wrong())?])
}

pub fn parse_time(s: &str) -> Result<f64, String> {
    let time = s.parse().ok().filter(|t: &f64| t.is_finite());
    time.ok_or_else(|| format!("\"{}\" is no time: use a finite number", terminal::plain(s)))
}

fn parse_vector(s: &str) -> Result<DVec3, String> {
    let parts: Result<Vec<f64>, _> = s.split(',').map(|t| t.trim().parse()).collect();
    match parts.as_deref() {
        Ok([x, y, z]) if DVec3::new(*x, *y, *z).is_finite() => Ok(DVec3::new(*x, *y, *z)),
        _ => Err(format!("\"{}\" is not three finite numbers, such as 0,1,0", terminal::plain(s))),
    }
}

impl Options {
    /// The scene file's picture, or the default one.
    pub fn base(&self) -> Result<Picture, SceneFileError> {
        self.scene_file()?.map_or_else(|| Ok(Picture::default()), |file| file.at(self.time.unwrap_or(0.0)))
    }

    /// The scene file, if one is named.
    pub fn scene_file(&self) -> Result<Option<SceneFile>, SceneFileError> {
        self.scene.as_deref().map(SceneFile::read).transpose()
    }

    /// The picture once for each method, or once as it is, and what its method is called; prepared where these options or the
    /// scene file say, or else here.
    pub fn each(&self, prepare: Prepare, methods: &[String]) -> Result<Vec<(String, Picture)>, Box<dyn Error>> {
        let mut base = self.base()?;
        base.prepare.get_or_insert(prepare);
        if methods.is_empty() {
            let picture = self.over(base, None)?;
            return Ok(vec![(choices::method_name(&picture.settings), picture)]);
        }
        let each = methods.iter().map(|name| {
            let picture = self.over(base.clone(), choices::preset(name));
            Ok((name.clone(), picture.map_err(|e| format!("--methods {name}: {e}"))?))
        });
        each.collect()
    }

    /// A picture with what these options say of it; a method may take the place of theirs.
    pub fn over(&self, picture: Picture, method: Option<&Preset>) -> Result<Picture, Box<dyn Error>> {
        self.over_seen(picture, method, self.camera_frame, &mut Cameras::default())
    }

    /// [`Options::over`] as a camera file has it at a frame.
    pub fn over_seen(
        &self,
        mut picture: Picture,
        method: Option<&Preset>,
        frame: Option<f64>,
        cameras: &mut Cameras,
    ) -> Result<Picture, Box<dyn Error>> {
        self.replacing.apply(&mut picture);
        (picture.time, picture.time_of_film) = (self.time, self.scene.is_some());
        picture.size_given |= self.replacing.size.is_some();
        if self.camera_frame.is_some() && picture.camera.file.is_none() && picture.camera.upright.is_none() {
            return Err(CameraFileError::NoFile.into());
        }
        let Picture { camera, size, size_given, .. } = &mut picture;
        cameras.follow(camera, frame, size, *size_given)?;
        // A file's camera comes before what these options say of it.
        self.replacing.apply(&mut picture);
        picture.camera.file = None;
        picture.drop_invalid |= self.drop_invalid;
        picture.absorption_given |= self.choices.gives(choices::LEFT_OPEN);
        self.choices.apply(&mut picture.settings, &mut picture.preparation, method)?;
        picture.preparation.validate()?;
        picture.settings.validate()?;
        Ok(picture)
    }
}

/// The command line, for whoever wants to repeat it.
pub fn command() -> Vec<String> {
    std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect()
}
