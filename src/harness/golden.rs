//! Pictures to compare with: kept in files, made anew where it is asked for, and bounded in the mean and at the worst pixel.

use super::labels;
use crate::io::images::ImageError;
use image::{ImageBuffer, Rgb};
use std::{
    fmt::{self, Display, Formatter},
    fs,
    path::{Path, PathBuf},
};

/// How far two pictures may be apart, in units of white (1 is infinitely bright). Drivers round otherwise, and a rounding
/// error that decides which way a ray goes changes its pixel altogether: so a share of the pixels may differ by more than
/// `near`, and none by more than `far`; the mean includes them all.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Mean over all pixels of their greatest difference in a channel.
    pub mean: f32,
    /// What is hardly a difference.
    pub near: f32,
    /// Share of the pixels that may differ by more than that, 0 to 1.
    pub share: f32,
    /// What no pixel may differ by more than.
    pub far: f32,
}

/// How far two pictures are apart, in the units of [`Tolerance`].
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// Mean over all pixels.
    pub mean: f32,
    /// At the worst of them.
    pub most: f32,
    /// Which that is: column and row.
    pub worst: [u32; 2],
    /// Share of pixels that differ by more than `near`.
    pub share: f32,
    /// The tolerance's.
    pub near: f32,
}

impl Display for Difference {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let ([x, y], percent) = (self.worst, 100.0 * self.share);
        write!(f, "off by {:.5} in the mean, {:.3} at most, at pixel {x}, {y}; ", self.mean, self.most)?;
        write!(f, "{percent:.2} % by more than {}", self.near)
    }
}

/// Why a picture is not the one that it is compared with.
#[derive(Debug, thiserror::Error)]
pub enum Mismatch {
    /// They are of different sizes.
    #[error("{} x {} pixels are wanted, and there are {pixels}", wanted[0], wanted[1])]
    Size {
        /// Width and height of the one.
        wanted: [u32; 2],
        /// Pixels of the other.
        pixels: usize,
    },
    /// What no light is.
    #[error("pixel {pixel} is {value:?}, which is no light")]
    NoLight {
        /// Its index, row by row.
        pixel: usize,
        /// What it is.
        value: [f32; 3],
    },
    /// More than the tolerance.
    #[error("{0}")]
    TooFar(Difference),
}

/// A picture of 16 bits a channel: c = sqrt(v / (1 + v)) of linear light v, which any viewer shows well enough, and in which
/// the sun weighs no more than what is seen by its light. Linear light is c^2 / (1 - c^2), to about a ten-thousandth; floats
/// would say the same at several times the size, and the tolerances, which have to bound both the sun and what is dark, would
/// be in this code all the same.
pub struct Reference(ImageBuffer<Rgb<u16>, Vec<u16>>);

fn encode(v: f32) -> f32 {
    (v / (1.0 + v)).sqrt()
}

fn decode(code: u16) -> f32 {
    let squared = (f32::from(code) / 65535.0).powi(2);
    // The last code is of all that is too bright for the others, too.
    squared / (1.0 - squared.min(1.0 - 1e-5))
}

impl Reference {
    /// Of linear RGB, row by row.
    pub fn new(size: [u32; 2], picture: &[[f32; 3]]) -> Result<Reference, Mismatch> {
        check(size, picture)?;
        let codes = picture.iter().flatten().map(|v| (65535.0 * encode(*v)).round() as u16).collect();
        let image = ImageBuffer::from_raw(size[0], size[1], codes);
        Ok(Reference(image.ok_or(Mismatch::Size { wanted: size, pixels: picture.len() })?))
    }

    /// As it was kept.
    pub fn open(path: &Path) -> Result<Reference, ImageError> {
        let image = image::open(path).map_err(|e| ImageError::Decode { path: path.into(), detail: e.to_string() })?;
        Ok(Reference(image.into_rgb16()))
    }

    /// Linear RGB, row by row.
    pub fn picture(&self) -> Vec<[f32; 3]> {
        self.0.pixels().map(|p| p.0.map(decode)).collect()
    }

    /// How far a picture (linear RGB, row by row) is from this one, if it is within the tolerance.
    pub fn compare(&self, picture: &[[f32; 3]], tolerance: Tolerance) -> Result<Difference, Mismatch> {
        let (width, height) = self.0.dimensions();
        check([width, height], picture)?;
        let off = |(want, got): (&Rgb<u16>, &[f32; 3])| {
            (0..3).map(|k| (f32::from(want[k]) / 65535.0 - encode(got[k])).abs()).fold(0.0, f32::max)
        };
        let off: Vec<f32> = self.0.pixels().zip(picture).map(off).collect();
        let count = off.len() as f32;
        let worst = (0..off.len()).max_by(|a, b| off[*a].total_cmp(&off[*b])).unwrap_or(0);
        let found = Difference {
            mean: off.iter().sum::<f32>() / count,
            most: off[worst],
            worst: [worst as u32 % width, worst as u32 / width],
            share: off.iter().filter(|d| **d > tolerance.near).count() as f32 / count,
            near: tolerance.near,
        };
        let fine = found.mean <= tolerance.mean && found.share <= tolerance.share && found.most <= tolerance.far;
        if fine { Ok(found) } else { Err(Mismatch::TooFar(found)) }
    }
}

fn check(size: [u32; 2], picture: &[[f32; 3]]) -> Result<(), Mismatch> {
    if picture.len() != size.iter().map(|s| *s as usize).product::<usize>() || picture.is_empty() {
        return Err(Mismatch::Size { wanted: size, pixels: picture.len() });
    }
    // Comparisons with what is no number are false, and means of it are none.
    match picture.iter().position(|c| !c.iter().all(|v| v.is_finite() && *v >= 0.0)) {
        Some(pixel) => Err(Mismatch::NoLight { pixel, value: picture[pixel] }),
        None => Ok(()),
    }
}

/// A folder of references, each a `.png` with a `.txt` beside it that names the driver which made it.
pub struct Goldens(PathBuf);

impl Goldens {
    /// In this folder, which is there.
    pub fn new(folder: impl Into<PathBuf>) -> Goldens {
        Goldens(folder.into())
    }

    /// Where the reference of this name is.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(format!("{name}.png"))
    }

    /// Compares a picture that a driver drew with the reference of this name, and fails the test where it is too far off, or
    /// where there is none. With `MENISCUS_BLESS=1`, and one driver alone to run on (`MENISCUS_DRIVERS`), it is made first.
    pub fn check(&self, driver: &str, name: &str, size: [u32; 2], picture: &[[f32; 3]], tolerance: Tolerance) {
        let path = self.path(name);
        if std::env::var_os("MENISCUS_BLESS").is_some_and(|v| v == "1") {
            assert_eq!(labels().len(), 1, "one driver makes the pictures: say which with MENISCUS_DRIVERS");
            let made = Reference::new(size, picture).unwrap_or_else(|e| panic!("{name}: {e}"));
            made.0.save(&path).expect("written");
            fs::write(path.with_extension("txt"), format!("{driver}\n")).expect("written");
        }
        let golden = Reference::open(&path).unwrap_or_else(|e| {
            panic!(
                "{name}: {e}: MENISCUS_BLESS=1 with one of MENISCUS_DRIVERS makes it; look at it before you commit it"
            )
        });
        let maker = fs::read_to_string(path.with_extension("txt")).expect("the driver that made it");
        match golden.compare(picture, tolerance) {
            Ok(found) => println!("{driver}: {name}: {found}"),
            Err(e) => panic!("{driver}: {name} (made by {}): {e}", maker.trim()),
        }
    }
}
