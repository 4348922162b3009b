//! How far apart two pictures are, pixel by pixel and on the mean.
//!
//! * FLIP (Andersson et al. 2020), of what a screen shows, and HDR-FLIP (2021), at all exposures: by `flip-rs`, at the reference
//!   tool's viewing distance (67 pixels a degree), HDR with its ACES curve and its choice of exposures.
//! * Relative mean squared error: in linear light, the mean over channels of (a - b)² / (b² + [`DARK`]), b the reference.
//! * SSIM (Wang et al. 2004): see [`ssim`].
//!
//! And how far a method's surface is from the truth's: [`surface`].

pub mod ssim;
pub mod surface;

use crate::srgb::encode_srgb;
use flip_rs::{DEFAULT_PPD, FlipError, HdrOptions, MAGMA, RgbImage, hdr_flip, ldr_flip};
use glam::DVec3;

/// Added to squared light before it divides a squared error, so that black does not count without bound.
pub const DARK: f64 = 0.01;

/// Why two pictures cannot be compared.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the fields are what the messages show")]
pub enum MeasureError {
    /// They have no pixels in common.
    #[error("the reference has {}x{} pixels and the picture {}x{}: render both at one size", reference[0], reference[1], picture[0], picture[1])]
    Size { reference: [u32; 2], picture: [u32; 2] },
    /// Nothing to take a mean over.
    #[error("the mask has no pixel: name one that marks the liquid")]
    EmptyMask,
    /// A mask of another size.
    #[error("the mask has {mask} pixels and the pictures {pixels}: make it at their size")]
    Mask { mask: usize, pixels: usize },
    /// FLIP cannot be told.
    #[error("FLIP: {0}; check that both pictures are finite")]
    Flip(#[from] FlipError),
}

/// A picture in linear light.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Row by row.
    pub pixels: Vec<[f32; 3]>,
}

impl Linear {
    /// What a screen shows of it: sRGB, 0 to 1.
    pub fn shown(&self) -> Vec<[f32; 3]> {
        self.pixels.iter().map(|p| p.map(encode_srgb)).collect()
    }

    fn flip(&self, pixels: &[[f32; 3]]) -> Result<RgbImage<f32>, FlipError> {
        RgbImage::new(self.size[0] as usize, self.size[1] as usize, pixels.as_flattened().to_vec())
    }
}

/// Each measure for each pixel, row by row.
#[derive(Clone, Debug)]
pub struct Maps {
    size: [u32; 2],
    /// 0 (no difference seen) to 1.
    pub flip: Vec<f32>,
    /// The same at the exposure where most is seen; none for a reference that is black, which has no exposure.
    pub flip_hdr: Option<Vec<f32>>,
    /// Squared error over squared light, 0 and up.
    pub relative: Vec<f32>,
    /// -1 to 1 (the same).
    pub ssim: Vec<f32>,
}

/// Each measure's mean.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Means {
    /// FLIP.
    pub flip: f64,
    /// HDR-FLIP.
    pub flip_hdr: Option<f64>,
    /// Relative mean squared error.
    pub relative_mse: f64,
    /// SSIM, over pixels whose whole window is in the picture.
    pub ssim: f64,
    /// Pixels it is the mean of.
    pub pixels: usize,
}

/// Compares a picture with a reference of the same size.
pub fn compare(reference: &Linear, picture: &Linear) -> Result<Maps, MeasureError> {
    if reference.size != picture.size {
        return Err(MeasureError::Size { reference: reference.size, picture: picture.size });
    }
    let shown = [reference.shown(), picture.shown()];
    let flip = ldr_flip(&reference.flip(&shown[0])?, &picture.flip(&shown[1])?, DEFAULT_PPD)?.into_pixels();
    let lit = reference.pixels.iter().flatten().any(|v| *v > 0.0);
    let mut options = HdrOptions::default();
    options.return_exposure_map = false;
    let hdr = || hdr_flip(&reference.flip(&reference.pixels)?, &picture.flip(&picture.pixels)?, options);
    let flip_hdr = if lit { Some(hdr()?.error_map.into_pixels()) } else { None };
    let relative = |(b, a): (&[f32; 3], &[f32; 3])| {
        let channel = |(b, a): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).powi(2) / (f64::from(*b).powi(2) + DARK);
        (b.iter().zip(a).map(channel).sum::<f64>() / 3.0) as f32
    };
    Ok(Maps {
        size: reference.size,
        flip,
        flip_hdr,
        relative: reference.pixels.iter().zip(&picture.pixels).map(relative).collect(),
        ssim: ssim::map(reference.size, &shown[0], &shown[1]),
    })
}

impl Maps {
    /// Means over the picture, or over the pixels of a mask.
    pub fn means(&self, mask: Option<&[bool]>) -> Result<Means, MeasureError> {
        let all = self.flip.len();
        if let Some(mask) = mask.filter(|m| m.len() != all) {
            return Err(MeasureError::Mask { mask: mask.len(), pixels: all });
        }
        let within = |i: usize| mask.is_none_or(|m| m[i]);
        let pixels = (0..all).filter(|i| within(*i)).count();
        if pixels == 0 {
            return Err(MeasureError::EmptyMask);
        }
        let mean = |map: &[f32], counts: &dyn Fn(usize) -> bool| {
            let picked = map.iter().enumerate().filter(|(i, _)| counts(*i)).map(|(_, v)| f64::from(*v));
            let (sum, n) = picked.fold((0.0, 0usize), |(sum, n), v| (sum + v, n + 1));
            (n > 0).then(|| sum / n as f64)
        };
        let whole = |i: usize| within(i) && ssim::has_window(self.size, i);
        Ok(Means {
            flip: mean(&self.flip, &within).unwrap_or_default(),
            flip_hdr: self.flip_hdr.as_ref().and_then(|m| mean(m, &within)),
            relative_mse: mean(&self.relative, &within).unwrap_or_default(),
            ssim: mean(&self.ssim, &whole).or_else(|| mean(&self.ssim, &within)).unwrap_or_default(),
            pixels,
        })
    }
}

/// Decades of relative squared error that a map of it shows.
const DECADES: std::ops::RangeInclusive<f32> = -4.0..=1.0;

/// An error map's place on a scale of 0 (dark) to 1 (bright), for people: FLIP as it is, 1 - SSIM, relative squared error by
/// its logarithm from 1e-4 to 10.
pub fn on_scale(maps: &Maps) -> Vec<(&'static str, Vec<f32>)> {
    let decades = |v: &f32| (v.log10() - DECADES.start()) / (DECADES.end() - DECADES.start());
    let mut all = vec![("flip", maps.flip.clone())];
    all.extend(maps.flip_hdr.clone().map(|m| ("flip_hdr", m)));
    all.push(("relative_mse", maps.relative.iter().map(decades).collect()));
    all.push(("ssim", maps.ssim.iter().map(|v| 1.0 - v).collect()));
    all
}

/// A map on a scale of 0 to 1 in FLIP's colours (Magma), as sRGB.
pub fn magma(map: &[f32]) -> Vec<[u8; 3]> {
    let color = |v: &f32| MAGMA[(v.clamp(0.0, 1.0) * 255.0 + 0.5) as usize].map(|c| (c * 255.0 + 0.5) as u8);
    map.iter().map(color).collect()
}

/// Noise as a relative mean squared error: the mean over pixels and channels of the variance over squared light plus [`DARK`].
pub fn relative_noise(picture: &[DVec3], variance: &[DVec3]) -> f64 {
    let of = |(light, variance): (&DVec3, &DVec3)| (*variance / (*light * *light + DARK)).element_sum() / 3.0;
    picture.iter().zip(variance).map(of).sum::<f64>() / picture.len().max(1) as f64
}
