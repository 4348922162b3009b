//! Which particles can show, and whether their class is drawn as points or as quads (`glsl/cull.comp`).

use super::{Pipelines, classes, groups};
use crate::{
    Error,
    access::Access,
    pipeline::Pipeline,
    recorder::{Recorder, bound},
    shader::{CLASS_BODY, CULL_COMP, PARTICLE_GROUP, Splat},
    targets::{Id, Needs},
};

#[derive(Default)]
pub(crate) struct Cull {
    /// By (occlusion, back side).
    pub pipelines: Pipelines<[u32; 2]>,
}

impl Cull {
    pub fn record(&mut self, r: &mut Recorder, needs: &Needs) -> Result<(), Error> {
        let occlusion = needs.spec(Id::Bounds).is_some();
        // Where nothing is bounded, the shader does not look; something has to be bound all the same, and validation
        // takes it for read.
        let bounds = if occlusion {
            bound(2, Id::Bounds, Access::ComputeRead)
        } else {
            bound(2, Id::Particles, Access::ComputeRead)
        };
        let uses = [
            bound(1, Id::Particles, Access::ComputeRead),
            bounds,
            bound(3, Id::Visible, Access::ComputeReadWrite),
            bound(4, Id::Draws, Access::ComputeReadWrite),
            bound(5, Id::Counters, Access::ComputeReadWrite),
        ];
        let host = r.host;
        r.pass("cull", &uses, |r| {
            for (class, splat) in classes(needs) {
                let key = [u32::from(occlusion && class == CLASS_BODY), u32::from(needs.sides() == 2)];
                let make = |key: &[u32; 2]| Pipeline::compute(host, &CULL_COMP, key, size_of::<Splat>() as u32);
                let pipeline = self.pipelines.get(key, make)?;
                r.bind(pipeline, &uses)?;
                r.push(pipeline, &splat);
                r.dispatch(groups(splat.range.y, PARTICLE_GROUP), 1, 1);
            }
            Ok(())
        })
    }
}
