//! Which particles can show (`glsl/cull.comp`).

use super::{Pipelines, particles, per_particle};
use crate::{
    Error,
    access::Access,
    pipeline::Pipeline,
    recorder::{Recorder, bound},
    shader::CULL_COMP,
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
        let bounds = if occlusion { Id::Bounds } else { Id::Centers };
        let [centers, diagonals, mixed] = particles(Access::ComputeRead);
        let uses = [
            centers,
            diagonals,
            mixed,
            bound(4, bounds, Access::ComputeRead),
            bound(5, Id::Visible, Access::ComputeWrite),
            bound(6, Id::Counters, Access::ComputeReadWrite),
        ];
        let host = r.host;
        let key = [u32::from(occlusion), u32::from(needs.sides() == 2)];
        let pipeline = self.pipelines.get(key, |key| Pipeline::compute(host, &CULL_COMP, key, 0))?;
        r.pass("cull", &uses, |r| {
            r.bind(pipeline, &uses)?;
            let [x, y] = per_particle(needs);
            r.dispatch(x, y, 1);
            Ok(())
        })
    }
}
