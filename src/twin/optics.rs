//! Twin of `glsl/include/optics.glsl`: light at one water surface, and sRGB; and of the spray in `glsl/optics/lookup.frag`.

pub use crate::srgb::{decode_srgb, encode_srgb, srgb_byte};
use glam::Vec3;

/// Reflectance of a surface; `air` and `water` are the cosines on either side, `ior` is water against air.
pub fn fresnel(air: f32, water: f32, ior: f32, exact: bool) -> f32 {
    if exact {
        let s = (air - ior * water) / (air + ior * water);
        let p = (ior * air - water) / (ior * air + water);
        return 0.5 * (s * s + p * p);
    }
    let r0 = ((ior - 1.0) / (ior + 1.0)).powi(2);
    r0 + (1.0 - r0) * (1.0 - air).powi(5)
}

/// Snell's law in vectors: `dir` towards the surface, `n` against it, `eta` the ratio of indices (from / to).
/// `None` beyond the critical angle.
pub fn refract(dir: Vec3, n: Vec3, eta: f32) -> Option<Vec3> {
    let cos = -dir.dot(n);
    let k = 1.0 - eta * eta * (1.0 - cos * cos);
    (k >= 0.0).then(|| eta * dir + (eta * cos - k.sqrt()) * n)
}

/// Mirror direction.
pub fn reflect(dir: Vec3, n: Vec3) -> Vec3 {
    dir - 2.0 * dir.dot(n) * n
}

/// Spray (Cords08 §4): colour shifted to white, by the share `spray` at `whitest` and above.
pub fn spray(color: Vec3, speed: f32, spray: f32, whitest: f32) -> Vec3 {
    color.lerp(Vec3::ONE, spray * (speed / whitest).min(1.0))
}
