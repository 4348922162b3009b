//! The passes of a frame: one file each, the same stem as its shader, twin and test.

pub(crate) mod compact;
pub(crate) mod cull;
pub(crate) mod extent;
pub(crate) mod normals;
pub(crate) mod occlude;
pub(crate) mod plane_fit;
pub(crate) mod refract;
pub(crate) mod reset;
pub(crate) mod shape;
pub(crate) mod sort;
pub(crate) mod splat;
pub(crate) mod tiles;

use crate::{
    Error,
    access::Access,
    device::{Host, Limits},
    pipeline::Pipeline,
    recorder::{Recorder, Use, bound},
    shader::{BLOCK, CLASS_BODY, CLASS_SPLASH, PARTICLE_GROUP, Prepare, Shader},
    targets::{Id, Needs},
};
use ash::vk;
use std::collections::HashMap;

/// All passes, made once for a device and an output format.
pub(crate) struct Passes {
    pub reset: reset::Reset,
    pub extent: extent::Extent,
    pub sort: sort::Sort,
    pub shape: shape::Shape,
    pub occlude: occlude::Occlude,
    pub cull: cull::Cull,
    pub compact: compact::Compact,
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
            extent: extent::Extent::default(),
            sort: sort::Sort::default(),
            shape: shape::Shape::default(),
            occlude: occlude::Occlude::default(),
            cull: cull::Cull::default(),
            compact: compact::Compact::default(),
            splat: splat::SplatPass::new(limits),
            plane_fit: plane_fit::PlaneFit::default(),
            normals: normals::Normals::default(),
            tiles: tiles::Tiles::default(),
            refract: refract::Refract::new(output),
        }
    }

    pub fn destroy(&mut self, host: &Host) {
        self.extent.pipelines.destroy(host);
        self.sort.pipelines.destroy(host);
        self.shape.pipelines.destroy(host);
        self.occlude.pipelines.destroy(host);
        self.cull.pipelines.destroy(host);
        self.compact.pipelines.destroy(host);
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

/// Binds a step of the preparation, with its constants.
fn bind_step(
    pipelines: &mut Pipelines<(usize, bool)>,
    r: &mut Recorder,
    (i, shader): (usize, &Shader),
    uses: &[Use],
    prepare: &Prepare,
) -> Result<(), Error> {
    let host = r.host;
    let make = |(_, relation): &(usize, bool)| {
        Pipeline::compute(host, shader, &[u32::from(*relation)], size_of::<Prepare>() as u32)
    };
    let pipeline = pipelines.get((i, prepare.entries_per_particle != 1), make)?;
    r.bind(pipeline, uses)?;
    r.push(pipeline, prepare);
    Ok(())
}

/// The classes that may have particles.
fn classes(needs: &Needs) -> impl Iterator<Item = u32> {
    [(CLASS_SPLASH, needs.splash), (CLASS_BODY, needs.body)].into_iter().filter(|(_, there)| *there).map(|(c, _)| c)
}

/// The particles as drawn, at the bindings of `glsl/include/particles.glsl`.
const fn particles(access: Access) -> [Use; 3] {
    [bound(1, Id::Centers, access), bound(2, Id::Diagonals, access), bound(3, Id::Mixed, access)]
}

/// Groups that cover `count` invocations.
fn groups(count: u32, group: u32) -> u32 {
    count.div_ceil(group)
}

/// A rectangle of at least so many groups, no longer than any device allows (`glsl/include/groups.glsl`).
fn rectangle(groups: u32) -> [u32; 2] {
    let rows = groups.div_ceil(MOST_GROUPS).max(1);
    [groups.div_ceil(rows), rows]
}

/// What Vulkan guarantees of maxComputeWorkGroupCount.
const MOST_GROUPS: u32 = 65535;

/// The rectangle of groups with an invocation for each particle.
fn per_particle(needs: &Needs) -> [u32; 2] {
    rectangle(groups(needs.count, PARTICLE_GROUP))
}

/// The rectangle of groups with a block of particles each.
fn per_block(needs: &Needs) -> [u32; 2] {
    rectangle(groups(needs.count, BLOCK))
}
