//! Twin of `glsl/include/background.glsl`: b(direction) of eq. 6, the environment at infinity or the host's opaque scene.

use super::walls::{Maps, Ray, bisect};
use crate::{
    Equirect,
    shader::{SCENE_BEHIND, STEEP},
};
use glam::{DVec3, Mat3, Vec3};
use std::f64::consts::{PI, TAU};

/// The host's opaque scene, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Linear depth in particle radii; infinite where it was cleared.
    pub depth: &'a [f64],
    /// Linear colour.
    pub color: &'a [Vec3],
    /// Whether the host's own sky is seen where it was cleared ([`crate::Background::Host`]).
    pub sky: bool,
}

impl Maps<'_> {
    fn index(&self, pixel: [usize; 2]) -> usize {
        pixel[1] * self.frame.size.x as usize + pixel[0]
    }

    /// Linear depth of the host's scene at a pixel; infinite without one.
    pub fn scene_depth(&self, pixel: [usize; 2]) -> f64 {
        self.scene.map_or(f64::INFINITY, |s| s.depth[self.index(pixel)])
    }

    /// Where a ray first meets the scene, in steps of an eighth of a pixel: it reaches the pixel's depth within the
    /// pixel, or comes into the pixel a little behind that depth and was in front of the scene until there. Where it
    /// comes in further behind, it passes behind an object.
    pub fn meets_scene(&self, ray: &Ray) -> Option<(f64, [usize; 2])> {
        self.scene?;
        let slope = f64::from(STEEP / self.frame.pixel_scale.x.abs());
        let pixel_at = |t: f64| self.clamped(self.project(ray.at(t)));
        let behind = |t: f64, pixel| -ray.at(t).z - self.scene_depth(pixel);
        // Whether it was in front of the scene before this pixel, and whether it just came into it.
        let (mut before, mut entered) = (true, true);
        let (mut last, mut pixel) = (0.0, pixel_at(0.0));
        loop {
            let on_entering = behind(last, pixel);
            let limit = self.scene_depth(pixel) * f64::from(SCENE_BEHIND).max(slope);
            if entered && before && on_entering > 0.0 && on_entering <= limit {
                return Some((last, pixel));
            }
            let next = self.next_on_screen(ray, last);
            let next_pixel = pixel_at(next);
            // As far as the ray stays in this pixel, and where it comes into the next.
            let (stays, comes) =
                if next_pixel == pixel { (next, next) } else { bisect(last, next, |t| pixel_at(t) == next_pixel) };
            if on_entering <= 0.0 && behind(stays, pixel) >= 0.0 {
                return Some((bisect(last, stays, |t| behind(t, pixel) >= 0.0).1, pixel));
            }
            if next >= ray.box_end || !self.in_view(ray.at(next)) {
                return None;
            }
            before = behind(stays, pixel) <= 0.0;
            entered = next_pixel != pixel;
            (last, pixel) = (comes, next_pixel);
        }
    }

    /// Light of the scene at a pixel.
    pub fn scene_light(&self, pixel: [usize; 2]) -> Vec3 {
        self.scene.map_or(Vec3::ZERO, |s| s.color[self.index(pixel)])
    }

    /// What a ray from x brings back that meets no more liquid.
    pub fn background(&self, environment: &Equirect, x: DVec3, dir: DVec3) -> Vec3 {
        // Further than anything is, yet near enough that depths differ.
        let ray = Ray::new(self.frame, x, dir).up_to(1e12);
        if let Some((_, pixel)) = self.meets_scene(&ray) {
            return self.scene_light(pixel);
        }
        if self.scene.is_some_and(|s| s.sky) && dir.z < 0.0 && self.in_view(dir * 1e12) {
            let pixel = self.clamped(self.project(dir));
            if self.scene_depth(pixel).is_infinite() {
                return self.scene_light(pixel);
            }
        }
        env_color(environment, Mat3::from_mat4(self.frame.eye_to_env).as_dmat3() * dir)
    }
}

/// A texel as shaders have it, of a map whose largest value is this: red, green and blue are multiples of a common power of two,
/// fewer than 512 of it.
fn rounded(rgb: DVec3, largest: f64) -> Vec3 {
    // The largest of the three fills nine bits, before rounding and after.
    let step = |largest: f64| {
        let step = (largest.log2().floor() - 8.0).exp2();
        if (largest / step).round() < 512.0 { step } else { 2.0 * step }
    };
    // Of exponents there are 32. In f32's last octave 511 of them are the most that is finite.
    let top = step(largest.max(f64::MIN_POSITIVE)).min(119f64.exp2());
    let step = step(rgb.max_element().max(f64::MIN_POSITIVE)).clamp(31f64.exp2().recip() * top, top);
    ((rgb / step).round().min(DVec3::splat(511.0)) * step).as_vec3()
}

/// Light from a direction of the environment map's own space (+y up), bilinear; columns wrap around, rows end at the
/// poles. Texels are rounded as those are that the renderer uploads (`src/environment/footprints.rs`).
pub fn env_color(map: &Equirect, dir: DVec3) -> Vec3 {
    let [width, height] = map.size().map(|n| n as usize);
    // Column 0 at atan2(z, x) = -π, row 0 straight up; texel centres at +0.5.
    let column = (dir.z.atan2(dir.x) / TAU + 0.5) * width as f64 - 0.5;
    let row = dir.y.clamp(-1.0, 1.0).acos() / PI * height as f64 - 0.5;
    let texel = |x: f64, y: f64| {
        let x = x.rem_euclid(width as f64) as usize % width;
        let y = y.clamp(0.0, height as f64 - 1.0) as usize;
        let rgba = &map.texels()[4 * (y * width + x)..];
        rounded(DVec3::new(rgba[0].into(), rgba[1].into(), rgba[2].into()), map.largest().into())
    };
    let (x, y) = (column.floor(), row.floor());
    let (fx, fy) = ((column - x) as f32, (row - y) as f32);
    let upper = texel(x, y).lerp(texel(x + 1.0, y), fx);
    let lower = texel(x, y + 1.0).lerp(texel(x + 1.0, y + 1.0), fx);
    upper.lerp(lower, fy)
}
