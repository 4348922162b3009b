//! Smoothing by iterative plane fitting (`glsl/plane_fit.comp`; Imai16 §4.3).

use super::{Pipelines, groups};
use crate::{
    Error,
    access::Access,
    pipeline::Pipeline,
    recorder::{Recorder, bound},
    settings::{Settings, Weighting},
    shader::PLANE_FIT_COMP,
    targets::{Id, Needs},
};

#[derive(Default)]
pub(crate) struct PlaneFit {
    /// By specialisation: tile (twice: width, height), reach, Euclidean weights.
    pub pipelines: Pipelines<[u32; 4]>,
}

/// Edge of a work group: 16 bytes a tile entry have to fit the guaranteed 16 KiB of shared memory.
fn tile(reach: u32) -> u32 {
    if reach <= 8 { 16 } else { 8 }
}

impl PlaneFit {
    pub fn record(
        &mut self,
        r: &mut Recorder,
        needs: &Needs,
        settings: &Settings,
        iteration: u32,
    ) -> Result<(), Error> {
        // raw -> A -> B -> A -> …
        let (from, to) = match iteration {
            0 => (Id::BodyDepthRaw, Id::BodyDepthA),
            n if n % 2 == 1 => (Id::BodyDepthA, Id::BodyDepthB),
            _ => (Id::BodyDepthB, Id::BodyDepthA),
        };
        let uses = [
            bound(1, from, Access::ComputeRead),
            bound(2, Id::BodyNormalRaw, Access::ComputeRead),
            bound(3, to, Access::ComputeWrite),
            bound(4, Id::Counters, Access::ComputeReadWrite),
        ];
        let reach = settings.window / 2;
        let edge = tile(reach);
        let key = [edge, edge, reach, u32::from(settings.weighting == Weighting::Euclidean)];
        let host = r.host;
        let pipeline = self.pipelines.get(key, |key| Pipeline::compute(host, &PLANE_FIT_COMP, key, 0))?;
        r.pass("plane fit", &uses, |r| {
            r.bind(pipeline, &uses)?;
            r.dispatch(groups(needs.size[0], edge), groups(needs.size[1], edge), needs.sides());
            Ok(())
        })
    }
}
