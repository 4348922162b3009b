//! Lists of what the cull pass left to draw, and the indirect draws of them (`glsl/compact.comp`).

use super::{Pipelines, per_block};
use crate::{
    Error,
    access::Access,
    pipeline::Pipeline,
    recorder::{Recorder, Use, bound},
    shader::{COMPACT_COUNT_COMP, COMPACT_SCAN_COMP, COMPACT_SCATTER_COMP, Shader},
    targets::{Id, Needs},
};

#[derive(Default)]
pub(crate) struct Compact {
    /// By step.
    pub pipelines: Pipelines<usize>,
}

const USES: [Use; 5] = [
    bound(1, Id::Visible, Access::ComputeRead),
    bound(2, Id::Sums, Access::ComputeReadWrite),
    bound(3, Id::Drawn, Access::ComputeReadWrite),
    bound(4, Id::Draws, Access::ComputeReadWrite),
    bound(5, Id::Counters, Access::ComputeReadWrite),
];

/// Class and side.
const LISTS: u32 = 4;

impl Compact {
    pub fn record(&mut self, r: &mut Recorder, needs: &Needs) -> Result<(), Error> {
        let host = r.host;
        let [x, y] = per_block(needs);
        let steps: [(&Shader, [u32; 2]); 3] =
            [(&COMPACT_COUNT_COMP, [x, y]), (&COMPACT_SCAN_COMP, [LISTS, 1]), (&COMPACT_SCATTER_COMP, [x, y])];
        r.pass("compact", &USES, |r| {
            for (i, (shader, [x, y])) in steps.into_iter().enumerate() {
                if i > 0 {
                    r.barriers("compact", &USES);
                }
                let pipeline = self.pipelines.get(i, |_| Pipeline::compute(host, shader, &[], 0))?;
                r.bind(pipeline, &USES)?;
                r.dispatch(x, y, 1);
            }
            Ok(())
        })
    }
}
