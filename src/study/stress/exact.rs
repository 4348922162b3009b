//! Where light goes through a block or a ball, in closed form.

use crate::study::tracer::interface;
use glam::DVec3;

/// Liquid around the origin.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// Half its edges.
    Block(DVec3),
    /// Its radius.
    Ball(f64),
}

impl Shape {
    /// Where a ray comes in and where it goes out, if it meets the shape at all: distances, and outward normals.
    pub fn crossings(&self, origin: DVec3, dir: DVec3) -> Option<[(f64, DVec3); 2]> {
        match *self {
            Shape::Ball(radius) => {
                let half = -origin.dot(dir);
                let reach = (radius * radius - (origin + half * dir).length_squared()).max(-1.0);
                let root = (reach >= 0.0).then(|| reach.sqrt())?;
                Some([half - root, half + root].map(|t| (t, (origin + t * dir) / radius)))
            }
            Shape::Block(half) => {
                let (mut enter, mut leave) = ((f64::NEG_INFINITY, DVec3::ZERO), (f64::INFINITY, DVec3::ZERO));
                for axis in 0..3 {
                    let sign = if dir[axis] < 0.0 { -1.0 } else { 1.0 };
                    let mut normal = DVec3::ZERO;
                    normal[axis] = sign;
                    let at = |side: f64| (side * half[axis] - origin[axis]) / dir[axis];
                    let (near, far) = (at(-sign), at(sign));
                    if near > enter.0 {
                        enter = (near, -normal);
                    }
                    if far < leave.0 {
                        leave = (far, normal);
                    }
                    if dir[axis] == 0.0 && origin[axis].abs() > half[axis] {
                        return None;
                    }
                }
                (enter.0 <= leave.0).then_some([enter, leave])
            }
        }
    }

    /// Where a ray goes that is refracted into the shape and out of it again, after so many total internal reflections at most:
    /// the direction, and by how much of the critical angle's sine light was from it at the closest. `None` if it misses the
    /// shape or is still inside then.
    pub fn through(&self, origin: DVec3, dir: DVec3, ior: f64, reflections: u32) -> Option<(DVec3, f64)> {
        let [(t, normal), _] = self.crossings(origin, dir)?;
        let bent = interface(dir, normal, ior).refracted?;
        self.out(origin + t * dir, bent, ior, reflections)
    }

    /// The same of a ray that starts inside.
    pub fn out(&self, mut at: DVec3, mut dir: DVec3, ior: f64, reflections: u32) -> Option<(DVec3, f64)> {
        let mut margin = f64::INFINITY;
        for _ in 0..=reflections {
            let [_, (t, normal)] = self.crossings(at, dir)?;
            at += t * dir;
            margin = margin.min((ior * dir.cross(normal).length() - 1.0).abs());
            let met = interface(dir, normal, ior);
            if let Some(bent) = met.refracted {
                return Some((bent, margin));
            }
            dir = met.reflected;
        }
        None
    }
}
