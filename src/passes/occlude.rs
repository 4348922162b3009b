//! How deep the body certainly reaches at each pixel (`glsl/occlude.comp`): what [`super::cull`] tests against.

use super::{Pipelines, classes, groups};
use crate::{
    Error,
    access::Access,
    pipeline::Pipeline,
    recorder::{Recorder, Use, bound},
    shader::{CLASS_BODY, OCCLUDE_COMP, PARTICLE_GROUP, Splat},
    targets::{Id, Needs},
};

#[derive(Default)]
pub(crate) struct Occlude {
    pub pipelines: Pipelines<()>,
}

const USES: [Use; 2] = [bound(1, Id::Particles, Access::ComputeRead), bound(2, Id::Bounds, Access::ComputeReadWrite)];

impl Occlude {
    pub fn record(&mut self, r: &mut Recorder, needs: &Needs) -> Result<(), Error> {
        let host = r.host;
        let pipeline =
            self.pipelines.get((), |()| Pipeline::compute(host, &OCCLUDE_COMP, &[], size_of::<Splat>() as u32))?;
        r.pass("occlude", &USES, |r| {
            r.bind(pipeline, &USES)?;
            for (_, splat) in classes(needs).filter(|(class, _)| *class == CLASS_BODY) {
                r.push(pipeline, &splat);
                r.dispatch(groups(splat.range.y, PARTICLE_GROUP), 1, 1);
            }
            Ok(())
        })
    }
}
