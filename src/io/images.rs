//! Environment maps in, pictures out.

use crate::{Equirect, Error, twin::optics::decode_srgb};
use image::{DynamicImage, ImageFormat, ImageReader};
use std::path::{Path, PathBuf};

/// Why an image could not be read or encoded.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// Not there, or not readable.
    #[error("{}: {source}", path.display())]
    Io {
        /// File.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
    /// Not an image, or damaged.
    #[error("{}: {source}; environment maps are .hdr, .exr or .png", path.display())]
    Decode {
        /// File.
        path: PathBuf,
        /// Reason.
        source: image::ImageError,
    },
    /// Readable, but no environment map.
    #[error("{}: {source}", path.display())]
    Content {
        /// File.
        path: PathBuf,
        /// Reason.
        source: Error,
    },
    /// Could not be encoded.
    #[error("{}: {source}; a smaller picture may do", path.display())]
    Encode {
        /// File.
        path: PathBuf,
        /// Reason.
        source: image::ImageError,
    },
    /// An extension nothing is written for.
    #[error("{}: the picture can be .png (sRGB, 8 bits) or .exr (linear, float)", .0.display())]
    Extension(PathBuf),
}

/// Reads an equirectangular map: linear light from .hdr and .exr, sRGB from .png.
pub fn read_environment(path: &Path) -> Result<Equirect, ImageError> {
    let io = |source| ImageError::Io { path: path.into(), source };
    let decode = |source| ImageError::Decode { path: path.into(), source };
    let reader = ImageReader::open(path).map_err(io)?.with_guessed_format().map_err(io)?;
    let srgb = reader.format() == Some(ImageFormat::Png);
    let image = reader.decode().map_err(decode)?.into_rgb32f();
    let (width, height) = image.dimensions();
    if width.abs_diff(2 * height) > height / 4 {
        let what = format!("{width}x{height}");
        let source = Error::parameter("environment map", what, "an equirectangular map is twice as wide as it is high");
        return Err(ImageError::Content { path: path.into(), source });
    }
    let curve = |v: f32| if srgb { decode_srgb(v) } else { v };
    let rgb: Vec<[f32; 3]> = image.pixels().map(|p| p.0.map(curve)).collect();
    Equirect::new(width, height, &rgb).map_err(|source| ImageError::Content { path: path.into(), source })
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
    let (image, format) = match extension(path).as_deref() {
        Some("png") => {
            let bytes = rgb.iter().flatten().map(|v| crate::twin::optics::srgb_byte(*v)).collect();
            (image::RgbImage::from_raw(size[0], size[1], bytes).map(DynamicImage::from), ImageFormat::Png)
        }
        Some("exr") => {
            let floats = rgb.iter().flatten().copied().collect();
            (image::Rgb32FImage::from_raw(size[0], size[1], floats).map(DynamicImage::from), ImageFormat::OpenExr)
        }
        _ => return Err(ImageError::Extension(path.into())),
    };
    let image = image.expect("one colour for each pixel");
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).map_err(|source| ImageError::Encode { path: path.into(), source })?;
    Ok(bytes.into_inner())
}
