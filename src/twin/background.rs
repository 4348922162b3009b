//! Twin of `glsl/include/background.glsl` without a host scene: the environment at infinity, b(direction) of eq. 6.

use crate::Equirect;
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Light from a direction of the environment map's own space (+y up), bilinear; columns wrap around, rows end at the
/// poles.
pub fn env_color(map: &Equirect, dir: DVec3) -> Vec3 {
    let [width, height] = map.size().map(|n| n as usize);
    // Column 0 at atan2(z, x) = -π, row 0 straight up; texel centres at +0.5.
    let column = (dir.z.atan2(dir.x) / TAU + 0.5) * width as f64 - 0.5;
    let row = dir.y.clamp(-1.0, 1.0).acos() / PI * height as f64 - 0.5;
    let texel = |x: f64, y: f64| {
        let x = x.rem_euclid(width as f64) as usize % width;
        let y = y.clamp(0.0, height as f64 - 1.0) as usize;
        let rgba = &map.texels()[4 * (y * width + x)..];
        Vec3::new(rgba[0], rgba[1], rgba[2])
    };
    let (x, y) = (column.floor(), row.floor());
    let (fx, fy) = ((column - x) as f32, (row - y) as f32);
    let upper = texel(x, y).lerp(texel(x + 1.0, y), fx);
    let lower = texel(x, y + 1.0).lerp(texel(x + 1.0, y + 1.0), fx);
    upper.lerp(lower, fy)
}
