//! Environment maps: what is infinitely far away.

use crate::Error;
use glam::Vec3;

/// An equirectangular map of linear light: row 0 is straight up (+y), the columns run once around, column 0 at
/// `atan2(z, x) = -π`.
#[derive(Clone, Debug, PartialEq)]
pub struct Equirect {
    width: u32,
    height: u32,
    /// RGBA, row by row.
    texels: Vec<f32>,
}

impl Equirect {
    /// From linear RGB, row by row. Values must be finite and at least 0.
    pub fn new(width: u32, height: u32, rgb: &[[f32; 3]]) -> Result<Equirect, Error> {
        if width == 0 || height == 0 || rgb.len() as u64 != u64::from(width) * u64::from(height) {
            let what = format!("{width}x{height} with {} pixels", rgb.len());
            return Err(Error::parameter(
                "environment map",
                what,
                "give one RGB triple for each of width x height pixels",
            ));
        }
        if let Some(bad) = rgb.iter().flatten().position(|v| !v.is_finite() || *v < 0.0) {
            let what = format!("{} at pixel {}", rgb[bad / 3][bad % 3], bad / 3);
            return Err(Error::parameter("environment map", what, "light is finite and at least 0"));
        }
        Ok(Equirect { width, height, texels: rgb.iter().flat_map(|c| [c[0], c[1], c[2], 1.0]).collect() })
    }

    /// Width and height in texels.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// RGBA texels, row by row.
    pub fn texels(&self) -> &[f32] {
        &self.texels
    }

    /// The sky used when there is no map: a clear afternoon over a tiled floor that fades into haze, so that
    /// refraction has straight lines to bend. Made here, needs no file.
    pub fn procedural_sky() -> Equirect {
        let (width, height) = (2048u32, 1024u32);
        let mut rgb = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            for x in 0..width {
                let polar = (y as f32 + 0.5) / height as f32 * std::f32::consts::PI;
                let around = ((x as f32 + 0.5) / width as f32 - 0.5) * std::f32::consts::TAU;
                let dir = Vec3::new(polar.sin() * around.cos(), polar.cos(), polar.sin() * around.sin());
                rgb.push(sky(dir).to_array());
            }
        }
        Equirect::new(width, height, &rgb).expect("the sky is finite")
    }
}

/// Light from one direction of the procedural sky.
fn sky(dir: Vec3) -> Vec3 {
    let (zenith, horizon) = (Vec3::new(0.07, 0.2, 0.52), Vec3::new(0.72, 0.8, 0.86));
    let smooth = |a: f32, b: f32, x: f32| {
        let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    if dir.y >= 0.0 {
        let air = horizon.lerp(zenith, dir.y.powf(0.45));
        let sun = Vec3::new(0.48, 0.62, -0.62).normalize();
        let toward = dir.dot(sun).max(0.0);
        // Soft streaks of cloud: a few waves, bent by each other.
        let p = Vec3::new(dir.x, 0.0, dir.z) / (dir.y + 0.25);
        let wave = (2.3 * p.x + 1.1 * (1.7 * p.z).sin()).sin() * (1.9 * p.z + 0.8 * (2.1 * p.x).cos()).sin();
        let cloud = smooth(0.1, 0.9, wave) * smooth(0.02, 0.25, dir.y) * 0.55;
        let glow = Vec3::new(1.0, 0.9, 0.7) * (0.5 * toward.powi(24) + 40.0 * smooth(0.9985, 0.9995, toward));
        return air.lerp(Vec3::splat(1.05), cloud) + glow;
    }
    // A floor one unit below: dark tiles with light joints, two shades, fading into the haze of the horizon.
    let p = glam::Vec2::new(dir.x, dir.z) / -dir.y;
    let tile = p * 2.0;
    let far = p.length();
    let edge = (tile - tile.round()).abs().min_element();
    // A texel sees ever more floor with distance: joints widen with it, and pale as they do, so that they do not alias.
    let width = 0.04f32.max(0.014 * (1.0 + far * far));
    let joint = (1.0 - smooth(0.3 * width, width, edge)) * (0.04 / width).min(1.0);
    let odd = (tile.x.floor() + tile.y.floor()).rem_euclid(2.0) - 0.5;
    let stone = Vec3::new(0.135, 0.15, 0.17) * (1.0 + 0.7 * odd * (-0.35 * far).exp());
    let ground = stone.lerp(Vec3::new(0.55, 0.52, 0.46), 0.75 * joint);
    (0.8 * horizon).lerp(ground, (-0.05 * far).exp())
}
