//! Brings what the particle passes count and bound to its start: nothing counted, nothing certain.

use crate::{
    Error,
    access::Access,
    recorder::{Recorder, used},
    targets::{Id, Needs},
};
use ash::vk;

pub(crate) struct Reset;

impl Reset {
    pub fn record(&self, r: &mut Recorder, needs: &Needs) -> Result<(), Error> {
        let all = [Id::Bounds, Id::Counters].map(|id| used(id, Access::TransferWrite));
        let uses = if needs.spec(Id::Bounds).is_some() { &all[..] } else { &all[1..] };
        r.pass("reset", uses, |r| {
            let (device, cmd) = (&r.host.device, r.cmd);
            // SAFETY: `cmd` is recording outside rendering; the ranges lie inside the buffers, which were made for
            // these needs with TRANSFER_DST.
            unsafe {
                device.cmd_fill_buffer(cmd, r.buffer(Id::Counters), 0, vk::WHOLE_SIZE, 0);
                if needs.spec(Id::Bounds).is_some() {
                    let half = 4 * u64::from(needs.size[0]) * u64::from(needs.size[1]);
                    // No front is certain: infinitely far. No back: at the eye.
                    device.cmd_fill_buffer(cmd, r.buffer(Id::Bounds), 0, half, f32::INFINITY.to_bits());
                    device.cmd_fill_buffer(cmd, r.buffer(Id::Bounds), half, half, 0);
                }
            }
            Ok(())
        })
    }
}
