//! Particles, or entries of the relation table, sorted by cell (`glsl/sort.comp`; Im16 §III).

use super::{Pipelines, bind_step, per_particle};
use crate::{
    Error,
    access::Access,
    recorder::{Recorder, Use, bound, used},
    shader::{
        EXTENT_DISPATCH, Prepare, SORT_COUNT_COMP, SORT_GATHER_COMP, SORT_PASSES, SORT_SCAN_COMP, SORT_SCATTER_COMP,
    },
    targets::{Id, Needs},
};

#[derive(Default)]
pub(crate) struct Sort {
    /// By step, and whether the relation table is sorted.
    pub pipelines: Pipelines<(usize, bool)>,
}

const USES: [Use; 6] = [
    bound(1, Id::Positions, Access::ComputeRead),
    bound(2, Id::Extent, Access::ComputeRead),
    used(Id::Extent, Access::IndirectRead),
    bound(3, Id::Order, Access::ComputeReadWrite),
    bound(4, Id::Sums, Access::ComputeReadWrite),
    bound(5, Id::Sorted, Access::ComputeWrite),
];

impl Sort {
    pub fn record(&mut self, r: &mut Recorder, needs: &Needs, prepare: &Prepare) -> Result<(), Error> {
        let mut prepare = *prepare;
        r.pass("sort", &USES, |r| {
            for pass in 0..SORT_PASSES {
                prepare.sort_pass = pass;
                // How many of these passes the occupied cells need only the device knows: the others are empty.
                let blocks = 4 * u64::from(EXTENT_DISPATCH + 6 * pass);
                let steps = [(&SORT_COUNT_COMP, blocks), (&SORT_SCAN_COMP, blocks + 12), (&SORT_SCATTER_COMP, blocks)];
                for (i, (shader, arguments)) in steps.into_iter().enumerate() {
                    bind_step(&mut self.pipelines, r, (i, shader), &USES, &prepare)?;
                    r.dispatch_indirect(Id::Extent, arguments);
                    r.barriers("sort", &USES);
                }
            }
            bind_step(&mut self.pipelines, r, (3, &SORT_GATHER_COMP), &USES, &prepare)?;
            let [x, y] = per_particle(needs);
            r.dispatch(x, y, 1);
            Ok(())
        })
    }
}
