//! All the light that comes back along a ray: a path tracer for clear liquids under a sky.
//!
//! At each interface light is reflected with the exact reflectance of an unpolarised wave and refracted with the rest; beyond the
//! critical angle all of it is reflected. Inside the liquid it is absorbed by the length of each interval (Beer–Lambert).
//! Light that counts more than [`SPLIT`] is followed both ways, which takes no chance; what counts less goes one way, by
//! chance, with the reflectance as its probability. From [`ROULETTE`] interfaces on it goes on by chance too.
//!
//! Light is bent by the shading normal, and that also decides on which side of the interface a ray arrives, as in
//! Mitsuba's `dielectric`. Whether an interval lay inside the liquid is told by the surface itself. Radiance is not scaled by the
//! square of the index where it enters a liquid: seen from outside that cancels, and an eye in the liquid sees as `render` has it.

use super::{
    random::Random,
    surface::{Hit, Ray, Surface},
    view::View,
};
use crate::Liquid;
use glam::DVec3;

/// Share of a sample's light from which on both ways are followed beyond an interface: least noise in the same time.
pub const SPLIT: f64 = 0.05;
/// Interfaces after which a path may end by chance.
pub const ROULETTE: u32 = 24;
/// Chance of going on after that, at most.
const GO_ON: f64 = 0.95;

/// What light does in a scene.
pub struct Tracer<'a> {
    /// Where liquid and air meet.
    pub surface: &'a dyn Surface,
    /// Camera and environment.
    pub view: &'a View<'a>,
    ior: f64,
    absorption: DVec3,
}

/// What becomes of light at an interface.
#[derive(Clone, Copy, Debug)]
pub struct Interface {
    /// Share that is reflected, 0 to 1.
    pub reflectance: f64,
    /// Where that goes.
    pub reflected: DVec3,
    /// Where the rest goes; nothing beyond the critical angle.
    pub refracted: Option<DVec3>,
}

/// At an interface of liquid (index `ior`) against air: `normal` points out of the liquid, `dir` towards the interface, both of
/// length 1.
pub fn interface(dir: DVec3, normal: DVec3, ior: f64) -> Interface {
    let towards = dir.dot(normal);
    let reflected = (dir - 2.0 * towards * normal).normalize();
    // Towards where the light comes from; indices there over those behind.
    let (normal, eta) = if towards < 0.0 { (normal, 1.0 / ior) } else { (-normal, ior) };
    let cos = towards.abs().min(1.0);
    let k = 1.0 - eta * eta * (1.0 - cos * cos);
    if k <= 0.0 {
        return Interface { reflectance: 1.0, reflected, refracted: None };
    }
    let behind = k.sqrt();
    let s = (eta * cos - behind) / (eta * cos + behind);
    let p = (cos - eta * behind) / (cos + eta * behind);
    let refracted = (eta * dir + (eta * cos - behind) * normal).normalize();
    Interface { reflectance: 0.5 * (s * s + p * p), reflected, refracted: Some(refracted) }
}

/// A part of the light that is still on its way.
struct Branch {
    ray: Ray,
    leaves: Option<u32>,
    /// Whether it left its last interface into the liquid: what has no end there (a half-space) absorbs.
    inside: bool,
    /// What it counts.
    weight: DVec3,
    /// Interfaces it has met.
    met: u32,
}

impl<'a> Tracer<'a> {
    /// Light in a liquid that this surface bounds.
    pub fn new(surface: &'a dyn Surface, view: &'a View<'a>, liquid: &Liquid) -> Tracer<'a> {
        Tracer { surface, view, ior: f64::from(liquid.ior), absorption: liquid.absorption.as_dvec3() }
    }

    /// Index of refraction against air.
    pub fn ior(&self) -> f64 {
        self.ior
    }

    /// What remains after a length inside the liquid; an endless one leaves only what is not absorbed at all.
    pub(super) fn transmitted(&self, length: f64) -> DVec3 {
        DVec3::from_array(self.absorption.to_array().map(|a| if a > 0.0 { (-a * length).exp() } else { 1.0 }))
    }

    /// Light that comes back along a ray, one sample of it.
    pub fn light(&self, ray: Ray, random: &mut Random) -> DVec3 {
        let mut sum = DVec3::ZERO;
        let mut open = vec![Branch { ray, leaves: None, inside: false, weight: DVec3::ONE, met: 0 }];
        while let Some(mut branch) = open.pop() {
            let Some(hit) = self.surface.hit(&branch.ray, branch.leaves) else {
                let seen = if branch.inside { self.transmitted(f64::INFINITY) } else { DVec3::ONE };
                sum += branch.weight * seen * self.view.environment(branch.ray.dir);
                continue;
            };
            if branch.ray.dir.dot(hit.geometric) > 0.0 {
                branch.weight *= self.transmitted(hit.t);
            }
            branch.met += 1;
            if branch.met > ROULETTE {
                let chance = branch.weight.max_element().min(GO_ON);
                if random.unit() >= chance {
                    continue;
                }
                branch.weight /= chance;
            }
            self.go_on(branch, &hit, random, &mut open);
        }
        sum
    }

    /// Beyond an interface: both ways, or one of them.
    fn go_on(&self, branch: Branch, hit: &Hit, random: &mut Random, open: &mut Vec<Branch>) {
        let Branch { ray, weight, met, .. } = branch;
        let origin = ray.at(hit.t);
        let at = interface(ray.dir, hit.shading, self.ior);
        let mut follow = |dir: DVec3, weight| {
            let inside = dir.dot(hit.geometric) < 0.0;
            open.push(Branch { ray: Ray { origin, dir }, leaves: Some(hit.id), inside, weight, met });
        };
        match at.refracted {
            None => follow(at.reflected, weight),
            Some(refracted) if weight.max_element() > SPLIT => {
                follow(at.reflected, weight * at.reflectance);
                follow(refracted, weight * (1.0 - at.reflectance));
            }
            Some(_) if random.unit() < at.reflectance => follow(at.reflected, weight),
            Some(refracted) => follow(refracted, weight),
        }
    }
}
