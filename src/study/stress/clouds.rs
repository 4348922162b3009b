//! Particles of the cases: radius 1, at rest spacing, somewhat off their places.

use crate::study::random::Random;
use glam::{DVec3, Vec3};

/// How far particles are off their places along each axis, at most: what a calm simulation leaves.
const JITTER: f64 = 0.25;

/// Particles at spacing 2 of which a shape keeps those it has room for, each a little off its place. Places lie half a spacing
/// from the origin along axes with an even number of them.
pub fn filled(counts: [usize; 3], keep: impl Fn(DVec3) -> bool) -> Vec<Vec3> {
    let [nx, ny, nz] = counts;
    let middle = (DVec3::new(nx as f64, ny as f64, nz as f64) - 1.0) / 2.0;
    let places = (0..nx * ny * nz).map(|i| DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / (nx * ny)) as f64));
    let mut found = Vec::new();
    for (i, place) in places.map(|p| 2.0 * (p - middle)).enumerate().filter(|(_, p)| keep(*p)) {
        let mut random = Random::of(i as u64, 7);
        // In steps of a 32nd: such sums are exact in single precision far from the origin too.
        let mut off = || ((2.0 * random.unit() - 1.0) * JITTER * 32.0).round() / 32.0;
        found.push((place + DVec3::new(off(), off(), off())).as_vec3());
    }
    found
}

/// A block of so many particles along each axis; its faces lie as far from the origin along an axis as there are particles.
pub fn block(counts: [usize; 3]) -> Vec<Vec3> {
    filled(counts, |_| true)
}

/// A ball of liquid of this radius around the origin: as many particles as have its volume.
pub fn ball(radius: f64) -> Vec<Vec3> {
    filled([radius.ceil() as usize + 1; 3], |p| p.length() <= radius)
}

/// A block with a ball above and drops beside it: body, splash, silhouettes, volumes before each other.
pub fn mixed() -> Vec<Vec3> {
    let mut all = block([14, 6, 14]);
    all.extend(ball(5.0).into_iter().map(|p| p + Vec3::new(2.0, 13.0, 4.0)));
    all.extend((0..12).map(|i| Vec3::new(3.0 * i as f32 - 18.0, 10.0 + (i % 4) as f32, 14.0 - (i % 3) as f32)));
    all
}
