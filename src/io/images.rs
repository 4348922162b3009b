//! Environment maps in, pictures out.

mod exr;
mod hdr;
mod map;
mod png;

pub use map::reduction;

use super::budget::{Budget, OverBudget};
use super::{guard, quote};
use crate::{Equirect, Error};
use image::ImageFormat;
use map::{Fault, Frame};
use std::{
    fs::File,
    io::{BufRead, BufReader, Cursor, ErrorKind, Read, Seek},
    path::{Path, PathBuf},
};

/// Why an image could not be read or encoded.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the fields are what the messages show")]
pub enum ImageError {
    /// Not there, or not readable.
    #[error("{}: cannot be read ({source}); {}", quote::path(path), reading_remedy(source.kind()))]
    Io { path: PathBuf, source: std::io::Error },
    /// Not an image, or damaged.
    #[error(
        "{}: {}; pictures and environment maps are whole .hdr, .exr or .png files",
        quote::path(path),
        quote::cut(detail, 160)
    )]
    Decode { path: PathBuf, detail: String },
    /// Readable, but no environment map.
    #[error("{}: {source}", quote::path(path))]
    Content { path: PathBuf, source: Error },
    /// Reading it takes more memory than its [`Budget`].
    #[error("{}: {source}", quote::path(path))]
    TooLarge { path: PathBuf, source: OverBudget },
    /// A decoder panicked (in programs that unwind).
    #[error(
        "{}: reading it failed in a way that nobody foresaw; save it again, and report it if other programs read it",
        quote::path(path)
    )]
    Panicked { path: PathBuf, panic: String },
    /// Could not be encoded.
    #[error("{}: the picture cannot be encoded ({}); choose another size or format", quote::path(path), quote::quote(&source.to_string()))]
    Encode { path: PathBuf, source: image::ImageError },
    /// An extension nothing is written for.
    #[error("{}: the picture can be .png (sRGB, 8 bits) or .exr (linear, float); choose one of them", quote::path(.0))]
    Extension(PathBuf),
}

fn reading_remedy(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::NotFound => "check the path",
        ErrorKind::IsADirectory => "name one image in it",
        ErrorKind::PermissionDenied => "check its permissions",
        _ => "check the disk it is on, and its permissions",
    }
}

/// Reads an equirectangular map: linear light from .hdr and .exr, sRGB from .png; within the default [`Budget`].
///
/// # Errors
/// [`ImageError`] with the file's name: it is no map, is damaged, or has light that is negative or not finite.
pub fn read_environment(path: &Path) -> Result<Equirect, ImageError> {
    read_environment_within(path, None, &Budget::default())
}

/// [`read_environment`] with a budget of your own. Texels come block by block and are averaged down, in linear light, by
/// [`reduction`]: where `needed` texels around suffice, and where more would not fit. For texels as fine as a picture's
/// pixels that is 2π times the focal length in pixels.
///
/// # Errors
/// As [`read_environment`].
pub fn read_environment_within(path: &Path, needed: Option<u32>, budget: &Budget) -> Result<Equirect, ImageError> {
    let io = |source| ImageError::Io { path: path.into(), source };
    let file = File::open(path).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if metadata.is_dir() {
        return Err(io(ErrorKind::IsADirectory.into()));
    }
    if !metadata.is_file() {
        // How much a pipe or device gives is not known before, and limits follow from it.
        let most = budget.bytes() / 4;
        let mut bytes = Vec::new();
        file.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
        let file = bytes.len() as u64;
        if file > most {
            let what = "what this pipe or device gives".into();
            let source = OverBudget { what, needed: file, allowed: most, file, budget: *budget };
            return Err(ImageError::TooLarge { path: path.into(), source });
        }
        return environment_from_bytes(path, &bytes, needed, budget);
    }
    let frame = Frame { budget, file: metadata.len(), needed };
    decode(path, BufReader::with_capacity(1 << 16, file), &frame)
}

/// [`read_environment_within`] for a file's content; `name` stands in messages.
///
/// # Errors
/// As [`read_environment`], but for those of the file system.
pub fn environment_from_bytes(
    name: &Path,
    bytes: &[u8],
    needed: Option<u32>,
    budget: &Budget,
) -> Result<Equirect, ImageError> {
    decode(name, Cursor::new(bytes), &Frame { budget, file: bytes.len() as u64, needed })
}

/// The format is what the first bytes say.
fn decode(name: &Path, mut input: impl BufRead + Seek, frame: &Frame<'_>) -> Result<Equirect, ImageError> {
    let read = || {
        let start = input.fill_buf()?;
        let map = if start.starts_with(b"\x89PNG\r\n\x1a\n") {
            png::read(input, frame)?
        } else if start.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            exr::read(input, frame)?
        } else if [&b"#?RADIANCE"[..], b"#?RGBE"].iter().any(|mark| start.starts_with(mark)) {
            hdr::read(input, frame)?
        } else {
            return Err(Fault::Corrupt("its first bytes are of no format that is known here".into()));
        };
        Ok(map.finish())
    };
    let path = name.to_path_buf();
    match guard::quietly(read) {
        Ok(Ok(map)) => Ok(map),
        Ok(Err(Fault::Io(source))) => Err(ImageError::Io { path, source }),
        Ok(Err(Fault::Corrupt(detail))) => Err(ImageError::Decode { path, detail }),
        Ok(Err(Fault::Content(source))) => Err(ImageError::Content { path, source }),
        Ok(Err(Fault::TooLarge(source))) => Err(ImageError::TooLarge { path, source }),
        Err(panic) => Err(ImageError::Panicked { path, panic }),
    }
}

/// Reads a picture of linear light (.exr, .hdr) or sRGB (.png, made linear): its width and height, and RGB row by row. What is
/// transparent lies on black.
///
/// # Errors
/// [`ImageError`] with the file's name: it is no picture, is damaged, or has light that is not finite.
pub fn read_picture(path: &Path, budget: &Budget) -> Result<([u32; 2], Vec<[f32; 3]>), ImageError> {
    let io = |source| ImageError::Io { path: path.into(), source };
    picture_in(path, BufReader::new(File::open(path).map_err(io)?), budget)
}

/// [`read_picture`] of a file's bytes; `name` stands in messages.
///
/// # Errors
/// As [`read_picture`], but for those of the file system.
pub fn picture_from_bytes(name: &Path, bytes: &[u8], budget: &Budget) -> Result<([u32; 2], Vec<[f32; 3]>), ImageError> {
    picture_in(name, Cursor::new(bytes), budget)
}

fn picture_in(
    path: &Path,
    file: impl BufRead + Seek,
    budget: &Budget,
) -> Result<([u32; 2], Vec<[f32; 3]>), ImageError> {
    let io = |source| ImageError::Io { path: path.into(), source };
    let decoding = |detail: String| ImageError::Decode { path: path.into(), detail };
    let mut reader = image::ImageReader::new(file).with_guessed_format().map_err(io)?;
    let mut limits = image::Limits::default();
    // What is decoded is at hand twice for a moment.
    limits.max_alloc = Some(budget.bytes() / 2);
    reader.limits(limits);
    let srgb = reader.format() == Some(ImageFormat::Png);
    let decoded =
        guard::quietly(|| reader.decode()).map_err(|panic| ImageError::Panicked { path: path.into(), panic })?;
    let decoded = decoded.map_err(|e| decoding(e.to_string()))?;
    let size = [decoded.width(), decoded.height()];
    // OpenEXR has light premultiplied, sRGB has not.
    let alpha: Vec<f32> = match srgb && decoded.color().has_alpha() {
        true => decoded.to_rgba32f().into_raw().as_chunks::<4>().0.iter().map(|p| p[3]).collect(),
        false => Vec::new(),
    };
    let mut rgb = decoded.into_rgb32f().into_raw().as_chunks::<3>().0.to_vec();
    if let Some(bad) = rgb.as_flattened().iter().position(|v| !v.is_finite()) {
        let (x, y) = (bad / 3 % size[0].max(1) as usize, bad / 3 / size[0].max(1) as usize);
        return Err(decoding(format!("pixel {x}, {y} is not finite")));
    }
    if srgb {
        rgb.as_flattened_mut().iter_mut().for_each(|v| *v = crate::srgb::decode_srgb(*v));
    }
    rgb.iter_mut().zip(&alpha).for_each(|(c, a)| *c = c.map(|v| v * a));
    Ok((size, rgb))
}

/// Checks early, before anything is rendered, that a picture of this name can be written.
pub fn check_extension(path: &Path) -> Result<(), ImageError> {
    match extension(path).as_deref() {
        Some("png" | "exr") => Ok(()),
        _ => Err(ImageError::Extension(path.into())),
    }
}

fn extension(path: &Path) -> Option<String> {
    path.extension().map(|e| e.to_string_lossy().to_lowercase())
}

/// The bytes of a picture from linear RGB, as the extension of its name says: .png (sRGB, 8 bits) or .exr (linear, float).
pub fn encode_picture(path: &Path, size: [u32; 2], rgb: &[[f32; 3]]) -> Result<Vec<u8>, ImageError> {
    encode_labelled(path, size, rgb, None)
}

/// [`encode_picture`] with a line of Latin letters in the file that says what it is of, for [`label`].
pub fn encode_labelled(
    path: &Path,
    size: [u32; 2],
    rgb: &[[f32; 3]],
    label: Option<&str>,
) -> Result<Vec<u8>, ImageError> {
    encode_layers(path, size, &Layers { rgb, ..Layers::default() }, label)
}

/// What a picture holds, row by row.
#[derive(Clone, Copy, Debug, Default)]
pub struct Layers<'a> {
    /// Linear light; premultiplied, where there is alpha.
    pub rgb: &'a [[f32; 3]],
    /// Coverage.
    pub alpha: Option<&'a [f32]>,
    /// Depth along the view axis.
    pub depth: Option<&'a [f32]>,
    /// Normals.
    pub normal: Option<&'a [[f32; 3]]>,
}

/// [`encode_labelled`] of more than colour: .png has alpha (straight), .exr all of it, in the channels R, G, B, A, Z, normal.X,
/// normal.Y and normal.Z.
///
/// # Errors
/// As [`encode_picture`].
pub fn encode_layers(
    path: &Path,
    size: [u32; 2],
    layers: &Layers<'_>,
    label: Option<&str>,
) -> Result<Vec<u8>, ImageError> {
    match extension(path).as_deref() {
        Some("png") => match layers.alpha {
            Some(alpha) => png::write_alpha(size, &straight_bytes(layers.rgb, alpha), label),
            None => png::write(size, &srgb_bytes(layers.rgb), label),
        }
        .map_err(failed(path)),
        Some("exr") => exr::write(size, layers, label).map_err(failed(path)),
        _ => Err(ImageError::Extension(path.into())),
    }
}

/// Premultiplied light as straight sRGB and alpha.
fn straight_bytes(rgb: &[[f32; 3]], alpha: &[f32]) -> Vec<[u8; 4]> {
    let pixel = |(c, a): (&[f32; 3], &f32)| {
        let [r, g, b] = if *a > 0.0 { c.map(|v| crate::srgb::srgb_byte(v / a)) } else { [0; 3] };
        [r, g, b, (255.0 * a.clamp(0.0, 1.0)).round() as u8]
    };
    rgb.iter().zip(alpha).map(pixel).collect()
}

/// What an encoder says, with the picture's name.
fn failed<E: std::error::Error + Send + Sync + 'static>(path: &Path) -> impl Fn(E) -> ImageError {
    |e| ImageError::Encode { path: path.into(), source: image::ImageError::IoError(std::io::Error::other(e)) }
}

/// Under what name a picture's file has its label.
const LABEL: &str = "meniscus";

/// What a picture's file says that it is of; nothing where it says nothing, is damaged, or is not there.
pub fn label(path: &Path) -> Option<String> {
    let read = || match extension(path).as_deref() {
        Some("png") => png::label(path),
        Some("exr") => exr::label(path),
        _ => None,
    };
    guard::quietly(read).ok().flatten()
}

/// Linear RGB as sRGB with 8 bits, as .png files have it.
pub fn srgb_bytes(rgb: &[[f32; 3]]) -> Vec<[u8; 3]> {
    rgb.iter().map(|c| c.map(crate::srgb::srgb_byte)).collect()
}

/// A picture of sRGB bytes, row by row, as .png; `path` stands in messages.
///
/// # Errors
/// [`ImageError::Encode`].
pub fn encode_srgb_png(path: &Path, size: [u32; 2], rgb: &[[u8; 3]]) -> Result<Vec<u8>, ImageError> {
    png::write(size, rgb, None).map_err(failed(path))
}
