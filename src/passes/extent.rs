//! The box of all positions, and what follows from it (`glsl/extent.comp`).

use super::{Pipelines, bind_step, per_block};
use crate::{
    Error,
    access::Access,
    recorder::{Recorder, Use, bound, used},
    shader::{EXTENT_MOST, EXTENT_PLAN_COMP, EXTENT_REDUCE_COMP, Prepare, Shader},
    targets::{Id, Needs},
};
use ash::vk;

#[derive(Default)]
pub(crate) struct Extent {
    /// By step, and whether the relation table is sorted.
    pub pipelines: Pipelines<(usize, bool)>,
}

const USES: [Use; 4] = [
    bound(0, Id::FrameBlock, Access::ComputeReadWrite),
    bound(1, Id::Positions, Access::ComputeRead),
    bound(2, Id::Extent, Access::ComputeReadWrite),
    bound(3, Id::Counters, Access::ComputeReadWrite),
];

impl Extent {
    pub fn record(&mut self, r: &mut Recorder, needs: &Needs, prepare: &Prepare) -> Result<(), Error> {
        let host = r.host;
        let [x, y] = per_block(needs);
        let steps: [(&Shader, [u32; 2]); 2] = [(&EXTENT_REDUCE_COMP, [x, y]), (&EXTENT_PLAN_COMP, [1, 1])];
        r.pass("extent", &[used(Id::Extent, Access::TransferWrite)], |r| {
            let least = 4 * u64::from(EXTENT_MOST);
            // SAFETY: `cmd` is recording outside rendering; the buffer has TRANSFER_DST and more than six words.
            unsafe {
                host.device.cmd_fill_buffer(r.cmd, r.buffer(Id::Extent), 0, least, u32::MAX);
                host.device.cmd_fill_buffer(r.cmd, r.buffer(Id::Extent), least, vk::WHOLE_SIZE, 0);
            }
            for (i, (shader, [x, y])) in steps.into_iter().enumerate() {
                r.barriers("extent", &USES);
                bind_step(&mut self.pipelines, r, (i, shader), &USES, prepare)?;
                r.dispatch(x, y, 1);
            }
            Ok(())
        })
    }
}
