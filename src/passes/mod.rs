//! The passes of a frame: one file each, the same stem as its shader, twin and test.

pub(crate) mod cull;
pub(crate) mod normals;
pub(crate) mod occlude;
pub(crate) mod plane_fit;
pub(crate) mod refract;
pub(crate) mod reset;
pub(crate) mod splat;
pub(crate) mod tiles;

use crate::{
    Error,
    device::{Host, Limits},
    pipeline::Pipeline,
    shader::{CLASS_BODY, CLASS_SPLASH, Splat},
    targets::Needs,
};
use ash::vk;
use glam::UVec4;
use std::collections::HashMap;

/// All passes, made once for a device and an output format.
pub(crate) struct Passes {
    pub reset: reset::Reset,
    pub occlude: occlude::Occlude,
    pub cull: cull::Cull,
    pub splat: splat::SplatPass,
    pub plane_fit: plane_fit::PlaneFit,
    pub normals: normals::Normals,
    pub tiles: tiles::Tiles,
    pub refract: refract::Refract,
}

impl Passes {
    pub fn new(limits: &Limits, output: vk::Format) -> Passes {
        Passes {
            reset: reset::Reset,
            occlude: occlude::Occlude::default(),
            cull: cull::Cull::default(),
            splat: splat::SplatPass::new(limits),
            plane_fit: plane_fit::PlaneFit::default(),
            normals: normals::Normals::default(),
            tiles: tiles::Tiles::default(),
            refract: refract::Refract::new(output),
        }
    }

    pub fn destroy(&mut self, host: &Host) {
        self.occlude.pipelines.destroy(host);
        self.cull.pipelines.destroy(host);
        self.splat.pipelines.destroy(host);
        self.plane_fit.pipelines.destroy(host);
        self.normals.pipelines.destroy(host);
        self.tiles.pipelines.destroy(host);
        self.refract.pipelines.destroy(host);
    }
}

/// A pass's pipelines, made when a frame first needs them: one for each set of specialisation constants.
pub(crate) struct Pipelines<K>(HashMap<K, Pipeline>);

impl<K> Default for Pipelines<K> {
    fn default() -> Self {
        Pipelines(HashMap::new())
    }
}

impl<K: std::hash::Hash + Eq + Clone> Pipelines<K> {
    pub fn get(&mut self, key: K, make: impl FnOnce(&K) -> Result<Pipeline, Error>) -> Result<&Pipeline, Error> {
        if !self.0.contains_key(&key) {
            let pipeline = make(&key)?;
            self.0.insert(key.clone(), pipeline);
        }
        Ok(&self.0[&key])
    }

    fn destroy(&mut self, host: &Host) {
        self.0.drain().for_each(|(_, mut p)| p.destroy(host));
    }
}

/// The classes that have particles: class, and its range in the particle buffer, as push constants.
fn classes(needs: &Needs) -> impl Iterator<Item = (u32, Splat)> {
    let ranges = [(CLASS_SPLASH, 0, needs.splash), (CLASS_BODY, needs.splash, needs.body)];
    ranges
        .into_iter()
        .filter(|(_, _, count)| *count > 0)
        .map(|(class, first, count)| (class, Splat { range: UVec4::new(first, count, class, 0) }))
}

/// Groups that cover `count` invocations.
fn groups(count: u32, group: u32) -> u32 {
    count.div_ceil(group)
}
