//! Twin of `glsl/layers/thickness.frag`: the sum of all particles' chords along a pixel's ray, each from the near plane on
//! and up to the host's scene (Green10).

use crate::{
    shader::{Frame, Particle},
    twin::{
        quadric::{Quadric, pixel_ray, scale_offset, viewport},
        splat::candidates,
    },
};
use glam::DVec3;

/// What one pixel's ray has of liquid, in particle radii.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thickness {
    /// All chords together; where particles overlap, twice.
    pub length: f64,
    /// How far from it the 32-bit sum may lie.
    pub slack: f64,
    /// Particles that the ray meets.
    pub met: u32,
}

/// How far sideways 32 bits may displace a silhouette, in pixels: x/d and (pixel - b) / a are of order one, three roundings
/// of 6e-8 each, times some 300 pixels per unit, and as much again from S in float32.
const SIDEWAYS: f64 = 5e-4;

/// Every pixel; `scene` is the linear depth of the host's scene, infinite where nothing is.
pub fn thickness(frame: &Frame, particles: &[Particle], scene: Option<&[f64]>) -> Vec<Thickness> {
    let (width, height, near) = viewport(frame);
    let mut all = vec![Thickness::default(); (width * height) as usize];
    for particle in particles {
        let q = Quadric::new(frame, particle);
        let Some([columns, rows]) = candidates(frame, &q) else { continue };
        // A pixel, measured in the frame where the ellipsoid is a unit sphere, across the thinnest semi-axis at least.
        let thin = (0..3).map(|i| q.to_unit.col(i).length_squared()).sum::<f64>().sqrt().recip();
        let pixel = q.reach()[1] / (thin * scale_offset(frame).0.abs().min_element());
        for y in rows[0]..=rows[1] {
            for x in columns[0]..=columns[1] {
                let i = (y * width + x) as usize;
                let v = pixel_ray(frame, x, y);
                let most = scene.map_or(f64::INFINITY, |s| s[i]);
                let [own, wider, narrower] =
                    [0.0, -SIDEWAYS * pixel, SIDEWAYS * pixel].map(|shift| chord(&q, v, shift, [near, most]));
                let at = &mut all[i];
                at.length += own;
                at.met += u32::from(own > 0.0);
                // A root's two ends are rounded to a few steps of their depth.
                let steps = if wider > 0.0 { 4.0 * v.length() * q.reach()[1] } else { 0.0 };
                at.slack += wider - narrower + f64::from(f32::EPSILON) * steps;
            }
        }
    }
    for t in &mut all {
        // In whatever order: each of the sums before the last is rounded by half a step of at most the whole.
        t.slack += 0.5 * f64::from(f32::EPSILON) * f64::from(t.met) * t.length;
    }
    all
}

/// Length of a ray x = v d in an ellipsoid, between two depths. In the frame where that is a unit sphere a ray at the
/// distance p from the middle has a chord of 2 (1 - p²)^½; `shift` is added to p.
fn chord(q: &Quadric, v: DVec3, shift: f64, [from, to]: [f64; 2]) -> f64 {
    let (o, w) = (q.to_unit * -q.center, q.to_unit * v);
    let middle = -o.dot(w) / w.length_squared();
    let p = ((o + middle * w).length() + shift).max(0.0);
    let half = (1.0 - p * p).max(0.0).sqrt() / w.length();
    let (enter, leave) = ((middle - half).max(from), (middle + half).min(to));
    (leave - enter).max(0.0) * v.length()
}
