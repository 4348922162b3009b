//! How deep the body certainly reaches at each pixel (`glsl/occlude.comp`): what [`super::cull`] tests against.

use super::{Pipelines, particles, per_particle};
use crate::{
    Error,
    access::Access,
    pipeline::Pipeline,
    recorder::{Recorder, bound},
    shader::OCCLUDE_COMP,
    targets::{Id, Needs},
};

#[derive(Default)]
pub(crate) struct Occlude {
    pub pipelines: Pipelines<()>,
}

impl Occlude {
    pub fn record(&mut self, r: &mut Recorder, needs: &Needs) -> Result<(), Error> {
        let host = r.host;
        let [centers, diagonals, mixed] = particles(Access::ComputeRead);
        let uses = [centers, diagonals, mixed, bound(4, Id::Bounds, Access::ComputeReadWrite)];
        let pipeline = self.pipelines.get((), |()| Pipeline::compute(host, &OCCLUDE_COMP, &[], 0))?;
        r.pass("occlude", &uses, |r| {
            r.bind(pipeline, &uses)?;
            let [x, y] = per_particle(needs);
            r.dispatch(x, y, 1);
            Ok(())
        })
    }
}
