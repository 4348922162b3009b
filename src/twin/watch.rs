//! The verdict on a ray of the twin's walk, sample by sample: on which side of the body's wall it is.

use super::walls::{Maps, Ray, Tolerance, Wall, bisect};
use crate::shader::START_PIXELS;

/// On which side of the body's wall a ray has been so far.
pub(super) struct Watch<'a> {
    ray: &'a Ray,
    /// Whether its own side, on which it starts, is the inside.
    inside: bool,
    /// The last sample that counted as on its own side.
    last: f64,
    /// The last sample that was.
    own: Option<f64>,
}

impl Watch<'_> {
    pub(super) fn new(ray: &Ray, inside: bool) -> Watch<'_> {
        Watch { ray, inside, last: 0.0, own: None }
    }

    /// g, negative on the ray's own side.
    fn beyond(&self, maps: &Maps, t: f64) -> f64 {
        let g = maps.g(self.ray.at(t));
        if self.inside { g } else { -g }
    }

    /// Whether the ray counts as on its own side at t. It starts on a wall, which may lie a little off.
    fn stays(&self, maps: &Maps, t: f64) -> bool {
        let (g, x) = (self.beyond(maps, t), self.ray.at(t));
        let starting = maps.project(x).distance(maps.project(self.ray.origin)) <= f64::from(START_PIXELS);
        let from = self.ray.origin;
        // On the front or back on which it starts.
        let same = || maps.g(from).abs() <= Tolerance::at(maps.frame, -x.z).accepted && maps.side(x) == maps.side(from);
        g < 0.0 || (starting && same() && g <= Tolerance::at(maps.frame, -x.z).start)
    }

    /// The wall, if the ray has passed one at this sample.
    pub(super) fn passes(&mut self, maps: &Maps, t: f64) -> Option<Wall> {
        if self.stays(maps, t) {
            self.last = t;
            if self.beyond(maps, t) < 0.0 {
                self.own = Some(t);
            }
            return None;
        }
        Some(self.passed(maps, t).unwrap_or_else(|| {
            // It never was on its own side: the wall is where that is no longer overlooked.
            let (own, other) = bisect(self.last, t, |t| !self.stays(maps, t));
            self.between(maps, own, other, |at| at.start)
        }))
    }

    /// The wall, if the ray is on the other side at t and was on its own before: where g passes through zero, however late it
    /// is noticed so near the start.
    pub(super) fn passed(&self, maps: &Maps, t: f64) -> Option<Wall> {
        let own = self.own.filter(|_| self.beyond(maps, t) >= 0.0)?;
        let (own, other) = bisect(own, t, |t| self.beyond(maps, t) >= 0.0);
        Some(self.between(maps, own, other, |at| at.accepted))
    }

    fn between(&self, maps: &Maps, own: f64, other: f64, accepted: impl Fn(Tolerance) -> f64) -> Wall {
        let (inside, outside) = if self.inside { (own, other) } else { (other, own) };
        maps.wall(self.ray, inside, outside, accepted)
    }
}
