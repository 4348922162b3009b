//! Normals of the smoothed body (`glsl/normals.comp`; Green10).

use super::{Pipelines, groups};
use crate::{
    Error,
    access::Access,
    pipeline::Pipeline,
    recorder::{Recorder, bound},
    shader::{IMAGE_GROUP, NORMALS_COMP},
    targets::{Id, Needs},
};

#[derive(Default)]
pub(crate) struct Normals {
    pub pipelines: Pipelines<()>,
}

impl Normals {
    pub fn record(&mut self, r: &mut Recorder, needs: &Needs) -> Result<(), Error> {
        let uses = [
            bound(1, needs.body_depth(), Access::ComputeRead),
            bound(2, Id::BodyNormalRaw, Access::ComputeRead),
            bound(3, Id::BodyNormal, Access::ComputeWrite),
            bound(4, Id::Counters, Access::ComputeReadWrite),
        ];
        let host = r.host;
        let pipeline = self.pipelines.get((), |()| Pipeline::compute(host, &NORMALS_COMP, &[], 0))?;
        r.pass("normals", &uses, |r| {
            r.bind(pipeline, &uses)?;
            r.dispatch(groups(needs.size[0], IMAGE_GROUP), groups(needs.size[1], IMAGE_GROUP), needs.sides());
            Ok(())
        })
    }
}
