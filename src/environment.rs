//! Environment maps: what is infinitely far away.

pub(crate) mod footprints;

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
    /// The largest of red, green and blue in all of it.
    largest: f32,
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
        let mut map = EquirectBuilder::new(width, height, 1)?;
        for (y, row) in (0..).zip(rgb.chunks_exact(width as usize)) {
            map.add(0, 1, y, row.iter().copied())?;
        }
        Ok(map.finish())
    }

    /// Width and height in texels.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// RGBA texels, row by row.
    pub fn texels(&self) -> &[f32] {
        &self.texels
    }

    /// The largest value of red, green and blue in all of the map.
    pub fn largest(&self) -> f32 {
        self.largest
    }

    /// A sky for those who have no map: a clear afternoon over a tiled floor that fades into haze, so that
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

/// Makes an [`Equirect`] from texels that come row by row, block by block or in any order, and holds no more of them than
/// the result has: each of its texels is the mean, in linear light, of the area it covers.
#[derive(Clone, Debug)]
pub struct EquirectBuilder {
    size: [u32; 2],
    map: Equirect,
    /// For each column and row given, where it goes.
    columns: Vec<Share>,
    rows: Vec<Share>,
    scale: f32,
}

/// Where a column or row goes: the texel its near edge falls on, the part of it that does, and the part of the next texel.
#[derive(Clone, Copy, Debug)]
struct Share {
    at: u32,
    near: f32,
    far: f32,
}

impl Share {
    /// For each of `from` columns laid over `to`, at most as many.
    fn all(from: u32, to: u32) -> Vec<Share> {
        let (from, to) = (u64::from(from), u64::from(to));
        (0..from)
            .map(|i| {
                // In parts of which `from` make a texel of the result, and `to` one that is given.
                let (start, end) = (i * to, (i + 1) * to);
                let edge = (start / from + 1) * from;
                let near = edge.min(end) - start;
                Share { at: (start / from) as u32, near: near as f32 / to as f32, far: (to - near) as f32 / to as f32 }
            })
            .collect()
    }
}

impl EquirectBuilder {
    /// For a map of `width` x `height` texels, averaged down by the whole `factor`: the result has ⌈width / factor⌉ x
    /// ⌈height / factor⌉ texels, 16 bytes each. With a factor of 1 it has exactly the texels that are given.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a size or the factor is 0.
    pub fn new(width: u32, height: u32, factor: u32) -> Result<EquirectBuilder, Error> {
        if width == 0 || height == 0 || factor == 0 {
            let what = format!("{width}x{height}, averaged over {factor}");
            return Err(Error::parameter("environment map", what, "none of these can be 0"));
        }
        let [w, h] = [width, height].map(|n| n.div_ceil(factor));
        let texels = vec![0.0; 4 * w as usize * h as usize];
        let scale = ((f64::from(w) / f64::from(width)) * (f64::from(h) / f64::from(height))) as f32;
        Ok(EquirectBuilder {
            size: [width, height],
            map: Equirect { width: w, height: h, texels, largest: 0.0 },
            columns: Share::all(width, w),
            rows: Share::all(height, h),
            scale,
        })
    }

    /// Adds linear RGB of row `y`, for the columns `x`, `x + step`, `x + 2 step` and so on. Each texel is to be given once;
    /// one that never is counts as black.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a value is negative or not finite, or a texel is not on the map.
    pub fn add(&mut self, x: u32, step: u32, y: u32, rgb: impl IntoIterator<Item = [f32; 3]>) -> Result<(), Error> {
        let [width, height] = self.size;
        let exact = self.size == self.map.size();
        let mut columns = self.columns.iter().skip(x as usize).step_by(step.max(1) as usize);
        let row = self.rows.get(y as usize);
        for (i, color) in rgb.into_iter().enumerate() {
            let (Some(row), Some(column)) = (row, columns.next()) else {
                let what = format!("given a texel in row {y} beyond {width}x{height}");
                return Err(Error::parameter("environment map", what, "give width x height texels"));
            };
            if let Some(bad) = color.into_iter().find(|v| !v.is_finite() || *v < 0.0) {
                let pixel = u64::from(y) * u64::from(width) + u64::from(x) + i as u64 * u64::from(step);
                let what = format!("{bad} at pixel {pixel}");
                return Err(Error::parameter("environment map", what, "light is finite and at least 0"));
            }
            let at = 4 * (row.at as usize * self.map.width as usize + column.at as usize);
            if exact {
                self.map.texels[at..at + 3].copy_from_slice(&color);
                continue;
            }
            for (next_row, down) in [(0, row.near), (self.map.width as usize, row.far)] {
                for (next_column, right) in [(0, column.near), (1, column.far)] {
                    let share = down * right * self.scale;
                    if share > 0.0 {
                        let at = at + 4 * (next_row + next_column);
                        self.map.texels[at..at + 3].iter_mut().zip(color).for_each(|(sum, v)| *sum += share * v);
                    }
                }
            }
        }
        Ok(())
    }

    /// The map.
    pub fn finish(mut self) -> Equirect {
        for texel in self.map.texels.as_chunks_mut::<4>().0 {
            // Rounding may take the mean of the brightest values there are beyond them.
            texel[..3].iter_mut().for_each(|v| *v = v.min(f32::MAX));
            self.map.largest = texel[..3].iter().copied().fold(self.map.largest, f32::max);
            texel[3] = 1.0;
        }
        self.map
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
