//! What pictures have for compositing over others: a transparent background, depth and normals.

use crate::picture::Picture;
use clap::ValueEnum;
use meniscus::{
    host::{HostError, Session},
    inspect::Inspection,
    io::images::{self, ImageError, Layers},
};
use serde::{Deserialize, Serialize};
use std::{path::Path, str::FromStr};

/// What is seen where there is no liquid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Background {
    /// The environment.
    #[default]
    Environment,
    /// Nothing: the picture is transparent there. The liquid refracts and reflects the environment all the same
    None,
}

/// What a picture may have beside colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Channel {
    /// Z
    Depth,
    /// normal.X, normal.Y, normal.Z
    Normal,
}

/// Some of them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Channels(pub Vec<Channel>);

impl FromStr for Channels {
    type Err = String;

    fn from_str(text: &str) -> Result<Channels, String> {
        let one =
            |name: &str| Channel::from_str(name.trim(), false).map_err(|_| "use depth, normal or depth,normal".into());
        text.split(',').map(one).collect::<Result<_, _>>().map(Channels)
    }
}

#[derive(clap::Args)]
pub struct Compositing {
    /// What is seen where there is no liquid; with `none` pictures have alpha (.png straight, .exr premultiplied) [default:
    /// environment]
    #[arg(long, value_enum)]
    background: Option<Background>,
    /// Of .exr: also the depth of the first surface along the view axis (`depth`: Z, 1e10 without liquid) and its normal in world
    /// space (`normal`: normal.X, normal.Y, normal.Z). Neither is averaged: of a pixel's samples the nearest counts
    #[arg(long, value_name = "NAME,NAME")]
    channels: Option<Channels>,
}

impl Compositing {
    pub fn apply(&self, picture: &mut Picture) {
        picture.background = self.background.unwrap_or(picture.background);
        if let Some(channels) = &self.channels {
            picture.channels = channels.clone();
        }
    }
}

/// Refuses channels that none of these files holds.
pub fn check<'a>(picture: &Picture, files: impl IntoIterator<Item = &'a Path>) -> Result<(), &'static str> {
    let is_exr = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    if !picture.channels.0.is_empty() && !files.into_iter().any(is_exr) {
        return Err("--channels are an .exr's: name one with --output, or leave them out");
    }
    Ok(())
}

/// What the renderer has to write beside the picture.
pub fn inspection(picture: &Picture) -> Inspection {
    Inspection { surface: !picture.channels.0.is_empty(), ..Inspection::default() }
}

impl From<Background> for meniscus::Background {
    fn from(background: Background) -> meniscus::Background {
        match background {
            Background::Environment => meniscus::Background::Environment,
            // The session's picture, which is empty.
            Background::None => meniscus::Background::Host,
        }
    }
}

/// Depths where there is no liquid, as Blender has them.
const FAR: f32 = 1e10;

/// The first surface of each pixel.
#[derive(Clone, Debug, PartialEq)]
struct Surface {
    /// World units.
    depth: Vec<f32>,
    /// World space.
    normal: Vec<[f32; 3]>,
}

/// A picture as it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    pub rgb: Vec<[f32; 3]>,
    alpha: Option<Vec<f32>>,
    surface: Option<Surface>,
}

impl Pixels {
    /// What the last frame drew.
    pub fn read(session: &mut Session, picture: &Picture, radius: f32) -> Result<Pixels, HostError> {
        let (rgb, alpha) = match picture.background {
            Background::Environment => (session.picture()?, None),
            Background::None => session.layers().map(|(rgb, alpha)| (rgb, Some(alpha)))?,
        };
        let surface = match picture.channels.0.is_empty() {
            true => None,
            false => Some(Surface::read(session, radius, rgb.len())?),
        };
        Ok(Pixels { rgb, alpha, surface })
    }

    pub fn has_alpha(&self) -> bool {
        self.alpha.is_some()
    }

    /// Of each n x n block one pixel: mean of light and coverage, the nearest surface.
    pub fn average(&self, size: [u32; 2], n: u32) -> Pixels {
        let alpha = self.alpha.as_ref().map(|alpha| {
            let wide: Vec<[f32; 3]> = alpha.iter().map(|a| [*a; 3]).collect();
            crate::render::average(&wide, size, n).into_iter().map(|a| a[0]).collect()
        });
        Pixels {
            rgb: crate::render::average(&self.rgb, size, n),
            alpha,
            surface: self.surface.as_ref().map(|s| s.nearest(size, n)),
        }
    }

    /// Adds another exposure.
    pub fn add(&mut self, other: &Pixels) {
        let sum = |sum: &mut [f32], values: &[f32]| sum.iter_mut().zip(values).for_each(|(sum, v)| *sum += v);
        sum(self.rgb.as_flattened_mut(), other.rgb.as_flattened());
        if let Some((own, other)) = self.alpha.as_mut().zip(other.alpha.as_ref()) {
            sum(own, other);
        }
        if let Some((own, other)) = self.surface.as_mut().zip(other.surface.as_ref()) {
            for i in 0..own.depth.len() {
                if other.depth[i] < own.depth[i] {
                    (own.depth[i], own.normal[i]) = (other.depth[i], other.normal[i]);
                }
            }
        }
    }

    /// Of a sum of so many exposures the mean.
    pub fn divide(&mut self, count: usize) {
        let values = self.rgb.as_flattened_mut().iter_mut().chain(self.alpha.iter_mut().flatten());
        values.for_each(|v| *v /= count as f32);
    }

    /// As a file of this name holds it.
    pub fn encode(&self, path: &Path, picture: &Picture, label: Option<&str>) -> Result<Vec<u8>, ImageError> {
        let has = |channel| picture.channels.0.contains(&channel);
        let surface = self.surface.as_ref();
        let layers = Layers {
            rgb: &self.rgb,
            alpha: self.alpha.as_deref(),
            depth: surface.map(|s| &s.depth[..]).filter(|_| has(Channel::Depth)),
            normal: surface.map(|s| &s.normal[..]).filter(|_| has(Channel::Normal)),
        };
        images::encode_layers(path, picture.size, &layers, label)
    }
}

impl Surface {
    fn read(session: &mut Session, radius: f32, pixels: usize) -> Result<Surface, HostError> {
        // A frame without particles has none.
        let Some(words) = session.words("first surface", 0)? else {
            return Ok(Surface { depth: vec![FAR; pixels], normal: vec![[0.0; 3]; pixels] });
        };
        let of = |p: &[u32; 4]| {
            let [x, y, z, depth] = p.map(f32::from_bits);
            (if depth > 0.0 { radius * depth } else { FAR }, [x, y, z])
        };
        let (depth, normal) = words.as_chunks::<4>().0.iter().map(of).unzip();
        Ok(Surface { depth, normal })
    }

    fn nearest(&self, size: [u32; 2], n: u32) -> Surface {
        let (width, n) = (size[0] as usize, n as usize);
        let (w, h) = (width / n, size[1] as usize / n);
        let block = |k: usize| {
            let all = (0..n * n).map(|i| (k / w * n + i / n) * width + k % w * n + i % n);
            let best = all.min_by(|a, b| self.depth[*a].total_cmp(&self.depth[*b])).unwrap_or(0);
            (self.depth[best], self.normal[best])
        };
        let (depth, normal) = (0..w * h).map(block).unzip();
        Surface { depth, normal }
    }
}
