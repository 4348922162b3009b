//! Cameras of other programs: JSON as the script of docs/blender.md writes it, which also says what is in it, and ParaView's .pvcc.

mod paraview;

use crate::{camera::View, terminal};
use glam::{DMat3, DQuat, DVec2, DVec3};
use meniscus::io::quote::quote;
use serde::Deserialize;
use std::{
    collections::HashMap,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
    rc::Rc,
};

/// Why a camera file is no camera.
#[derive(Debug, thiserror::Error)]
pub enum CameraFileError {
    #[error("{}: cannot be read: {source}. Name a camera file, such as the script of docs/blender.md writes", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("{}: is larger than {} MiB, so it is no camera file; export fewer frames", .0.display(), LONGEST >> 20)]
    TooLarge(PathBuf),
    #[error("{}: {message}; docs/blender.md says what a camera file has", path.display())]
    Syntax { path: PathBuf, message: String },
    #[error("{}: {place}{key}: {remedy}", path.display())]
    Value { path: PathBuf, place: String, key: &'static str, remedy: String },
    #[error(
        "{}: up is {axis} there, and --up is {up}: say --up {axis} if particles have the same axes, or --up {other} if they have {other} up",
        path.display()
    )]
    Up { path: PathBuf, axis: &'static str, other: &'static str, up: DVec3 },
    #[error("--camera-frame is a frame of a camera file: name one with --camera")]
    NoFile,
}

/// A frame of 3D programs takes some 300 bytes.
const LONGEST: u64 = 64 << 20;
/// What the first line of each says.
const FORMAT: &str = "meniscus camera 1";

/// Which dimension of the picture a sensor's width, and a shift of 1, are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Fit {
    /// The longer one.
    #[default]
    Auto,
    Horizontal,
    Vertical,
}

impl Fit {
    fn across(self, [width, height]: [u32; 2]) -> bool {
        match self {
            Fit::Auto => width >= height,
            Fit::Horizontal => true,
            Fit::Vertical => false,
        }
    }
}

/// How much of the world is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Angle {
    Lens {
        length: f64,
        sensor: f64,
    },
    /// Degrees from the lower edge to the upper.
    FovY(f64),
}

/// Where a camera is, and its lens.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pose {
    eye: DVec3,
    /// Eye space (-z ahead, y up) to world.
    turn: DQuat,
    angle: Angle,
    fit: Fit,
    /// Of the dimension that `fit` says, right and up.
    shift: DVec2,
    near: Option<f64>,
}

impl Pose {
    /// On the way from one to another.
    fn toward(&self, next: &Pose, s: f64) -> Pose {
        let mix = |a: f64, b: f64| a + s * (b - a);
        let angle = match (self.angle, next.angle) {
            (Angle::Lens { length: a, sensor: c }, Angle::Lens { length: b, sensor: d }) => {
                Angle::Lens { length: mix(a, b), sensor: mix(c, d) }
            }
            (Angle::FovY(a), Angle::FovY(b)) => Angle::FovY(mix(a, b)),
            (angle, _) => angle,
        };
        Pose {
            eye: self.eye.lerp(next.eye, s),
            turn: self.turn.slerp(next.turn, s),
            angle,
            shift: self.shift.lerp(next.shift, s),
            near: self.near.zip(next.near).map(|(a, b)| mix(a, b)).or(self.near),
            fit: self.fit,
        }
    }
}

/// Which axis of the world that cameras are given in points up.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Up {
    Y,
    Z,
}

/// What was read of one.
#[derive(Clone, Debug)]
pub struct CameraFile {
    path: PathBuf,
    /// If it is not the particles' own, in which the file then is.
    up: Option<Up>,
    size: Option<[u32; 2]>,
    /// Of no frame.
    still: Option<Pose>,
    /// By number.
    frames: Vec<(f64, Pose)>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: String,
    up: Option<Up>,
    size: Option<[u32; 2]>,
    #[serde(default)]
    camera: Said,
    #[serde(default)]
    frames: Vec<Said>,
}

/// What is said of a camera; in a frame the rest is the camera's.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Said {
    frame: Option<f64>,
    /// Rows, for columns; eye space to world.
    matrix: Option<[[f64; 4]; 4]>,
    lens: Option<f64>,
    sensor: Option<f64>,
    fov_y: Option<f64>,
    fit: Option<Fit>,
    shift: Option<[f64; 2]>,
    /// Near and far; nothing is cut off in the distance.
    clip: Option<[f64; 2]>,
}

/// A key, and what it has to be.
type Wrong = (&'static str, String);

fn wrong<T>(key: &'static str, remedy: &str) -> Result<T, Wrong> {
    Err((key, remedy.into()))
}

impl Said {
    fn pose(&self, all: &Said) -> Result<Pose, Wrong> {
        let Some(rows) = self.matrix.or(all.matrix) else { return wrong("matrix", "is missing") };
        let [x, y, z, eye] = [0, 1, 2, 3].map(|c| DVec3::new(rows[0][c], rows[1][c], rows[2][c]));
        // A camera that hangs on something scaled is scaled, too, and sees the same.
        let turn = DMat3::from_cols(x, y, z);
        let lengths = [x, y, z].map(DVec3::length);
        let unscaled = DMat3::from_cols(x / lengths[0], y / lengths[1], z / lengths[2]);
        let skew = unscaled.transpose() * unscaled - DMat3::IDENTITY;
        let rigid = turn.is_finite()
            && eye.is_finite()
            && rows[3] == [0.0, 0.0, 0.0, 1.0]
            && skew.to_cols_array().iter().all(|s| s.abs() < 1e-3)
            && unscaled.determinant() > 0.0;
        if !rigid {
            return wrong(
                "matrix",
                "write the rows of a matrix to the world that turns and moves, and does not mirror or shear",
            );
        }
        let lens = if self.fov_y.is_some() { self.lens } else { self.lens.or(all.lens) };
        let fov_y = if self.lens.is_some() { self.fov_y } else { self.fov_y.or(all.fov_y) };
        let angle = match (lens, fov_y) {
            (Some(length), None) => Angle::Lens { length, sensor: self.sensor.or(all.sensor).unwrap_or(36.0) },
            (None, Some(degrees)) => Angle::FovY(degrees),
            _ => return wrong("lens", "give it, with `sensor`, or give `fov_y`; one of the two"),
        };
        let usable = match angle {
            Angle::Lens { length, sensor } => [length, sensor].iter().all(|l| (1e-6..=1e6).contains(l)),
            Angle::FovY(degrees) => degrees > 0.0 && degrees < 170.0,
        };
        if !usable {
            return wrong("lens", "use lengths above 0, or degrees above 0 and below 170");
        }
        let shift = DVec2::from(self.shift.or(all.shift).unwrap_or_default());
        if !shift.abs().cmple(DVec2::splat(100.0)).all() {
            return wrong("shift", "use -100 to 100");
        }
        let clip = self.clip.or(all.clip);
        if !clip.is_none_or(|[near, far]| near > 0.0 && near < far) {
            return wrong("clip", "use a distance above 0, and a larger one");
        }
        let fit = self.fit.or(all.fit).unwrap_or_default();
        Ok(Pose { eye, turn: DQuat::from_mat3(&unscaled), angle, fit, shift, near: clip.map(|c| c[0]) })
    }
}

impl CameraFile {
    pub fn read(path: &Path) -> Result<CameraFile, CameraFileError> {
        let mut bytes = Vec::new();
        let failed = |source| CameraFileError::Read { path: path.into(), source };
        File::open(path).and_then(|f| f.take(LONGEST + 1).read_to_end(&mut bytes)).map_err(failed)?;
        if bytes.len() as u64 > LONGEST {
            return Err(CameraFileError::TooLarge(path.into()));
        }
        if bytes.trim_ascii_start().starts_with(b"<") {
            return paraview::read(path, &bytes);
        }
        let syntax = |message: String| CameraFileError::Syntax { path: path.into(), message };
        let document: Document = serde_json::from_slice(&bytes).map_err(|e| syntax(quote(&e.to_string())))?;
        if document.format != FORMAT {
            return Err(syntax(format!("`format` is \"{}\" and not \"{FORMAT}\"", quote(&document.format))));
        }
        CameraFile::of(path, &document).map_err(|(place, (key, remedy))| {
            let place = place.map_or(String::new(), |p| format!("frames[{p}]."));
            CameraFileError::Value { path: path.into(), place, key, remedy }
        })
    }

    /// Checks what was read; what is wrong is in a frame of this index, or in none.
    fn of(path: &Path, document: &Document) -> Result<CameraFile, (Option<usize>, Wrong)> {
        let all = &document.camera;
        if document.size.is_some_and(|s| s.contains(&0)) {
            return Err((None, ("size", "use 1 or more pixels each way".into())));
        }
        let mut frames = Vec::new();
        for (i, said) in document.frames.iter().enumerate() {
            let later = |n: &f64| n.is_finite() && frames.last().is_none_or(|(last, _)| last < n);
            let Some(number) = said.frame.filter(later) else {
                return Err((Some(i), ("frame", "number the frames, each higher than the one before".into())));
            };
            frames.push((number, said.pose(all).map_err(|w| (Some(i), w))?));
        }
        // Beside frames the camera need not be anywhere.
        let still = if all.matrix.is_some() || frames.is_empty() { Some(all.pose(all)) } else { None };
        let still = still.transpose().map_err(|w| (None, w))?;
        Ok(CameraFile { path: path.into(), up: document.up, size: document.size, still, frames })
    }

    /// The camera at a frame, between frames on the way, before and after them as in the first and the last; or where it is
    /// without any.
    fn pose(&self, frame: Option<f64>) -> Option<Pose> {
        let first = self.frames.first();
        let Some(frame) = frame.filter(|_| first.is_some()) else { return self.still.or(first.map(|f| f.1)) };
        let next = self.frames.partition_point(|(number, _)| *number <= frame);
        match (next.checked_sub(1).map(|i| &self.frames[i]), self.frames.get(next)) {
            (Some((a, from)), Some((b, to))) if *a < frame => Some(from.toward(to, (frame - a) / (b - a))),
            (Some((_, pose)), _) => Some(*pose),
            (None, _) => first.map(|f| f.1),
        }
    }

    /// From the axes of the file to those of particles with this direction up.
    fn axes(&self, up: DVec3) -> Result<DQuat, CameraFileError> {
        let quarter = std::f64::consts::FRAC_PI_2;
        let (axis, other, turn) = match self.up {
            None => return Ok(DQuat::IDENTITY),
            Some(Up::Z) => (DVec3::Z, DVec3::Y, DQuat::from_rotation_x(-quarter)),
            Some(Up::Y) => (DVec3::Y, DVec3::Z, DQuat::from_rotation_x(quarter)),
        };
        match up.normalize_or_zero() {
            up if up.abs_diff_eq(axis, 1e-9) => Ok(DQuat::IDENTITY),
            up if up.abs_diff_eq(other, 1e-9) => Ok(turn),
            _ => {
                let [axis, other] = if axis == DVec3::Z { ["0,0,1", "0,1,0"] } else { ["0,1,0", "0,0,1"] };
                Err(CameraFileError::Up { path: self.path.clone(), axis, other, up })
            }
        }
    }

    /// Has a view of a picture of this size be the camera's at a frame.
    fn apply(&self, view: &mut View, frame: Option<f64>, size: [u32; 2]) -> Result<(), CameraFileError> {
        let Some(pose) = self.pose(frame) else { return Ok(()) };
        let axes = self.axes(view.up)?;
        let [width, height] = size.map(f64::from);
        let across = pose.fit.across(size);
        let fov_y = match pose.angle {
            Angle::Lens { length, sensor } => {
                let half = 0.5 * sensor / length * if across { height / width } else { 1.0 };
                2.0 * half.atan().to_degrees()
            }
            Angle::FovY(degrees) => degrees,
        };
        if fov_y >= 170.0 {
            let remedy = format!("is {fov_y:.1} degrees high in a picture of {width}x{height}: use below 170");
            return Err(CameraFileError::Value { path: self.path.clone(), place: String::new(), key: "lens", remedy });
        }
        let turn = axes * pose.turn;
        let eye = exact(axes, pose.eye);
        // As far ahead as double precision tells well from the eye.
        let ahead = turn * DVec3::NEG_Z * (1e-3 * eye.length()).max(1.0);
        *view = View {
            eye: Some(eye),
            target: Some(eye + ahead),
            upright: Some(turn * DVec3::Y),
            orbit: 0.0,
            fov_y: fov_y as f32,
            shift: pose.shift * if across { width } else { height } / DVec2::new(width, height),
            near: pose.near,
            file: None,
            up: view.up,
        };
        Ok(())
    }
}

/// A quarter turn about x, or none, of a point: to the last bit.
fn exact(turn: DQuat, p: DVec3) -> DVec3 {
    match turn.x {
        x if x < -0.5 => DVec3::new(p.x, p.z, -p.y),
        x if x > 0.5 => DVec3::new(p.x, -p.z, p.y),
        _ => p,
    }
}

/// Camera files that were read, each once.
#[derive(Default)]
pub struct Cameras(HashMap<PathBuf, Rc<CameraFile>>);

impl Cameras {
    /// Has a view that names a camera file be the camera's at a frame; `size` is the picture's, and is the file's where it is not
    /// given.
    pub fn follow(
        &mut self,
        view: &mut View,
        frame: Option<f64>,
        size: &mut [u32; 2],
        size_given: bool,
    ) -> Result<(), CameraFileError> {
        let Some(path) = view.file.take() else { return Ok(()) };
        let file = match self.0.get(&path) {
            Some(file) => file.clone(),
            None => {
                let file = Rc::new(CameraFile::read(&path)?);
                self.0.insert(path, file.clone());
                file
            }
        };
        if !size_given {
            *size = file.size.unwrap_or(*size);
        }
        file.apply(view, frame, *size)
    }
}

/// A number of `--camera-frame`.
pub fn parse_frame(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|n: &f64| n.is_finite());
    number.ok_or_else(|| format!("\"{}\" is not the number of a frame", terminal::plain(text)))
}

#[cfg(test)]
mod tests;
