//! Particles, or entries of the relation table, sorted by cell (`glsl/sort.comp`; Im16 §III).

use super::{per_particle, sums_bytes};
use crate::{
    plan::{Call, External, Groups, Plan, Target},
    scene::{Preparation, Scene},
    shader::{
        DIGITS, EXTENT_DISPATCH, Prepare, SORT_COUNT_COMP, SORT_GATHER_COMP, SORT_PASSES, SORT_SCAN_COMP,
        SORT_SCATTER_COMP, Shader,
    },
};

/// The order, and positions in it.
#[derive(Clone, Copy)]
pub(crate) struct Sorted {
    pub order: Target,
    pub positions: Target,
}

pub(crate) fn record(plan: &mut Plan, scene: &Scene, preparation: &Preparation, extent: Target) -> Sorted {
    // Indices, read from one half and written to the other.
    let order = plan.array("sort order", 8 * preparation.entries);
    let sorted = plan.array("sorted positions", 16 * u64::from(scene.count));
    let sums = plan.array("digit sums", sums_bytes(preparation.entries, DIGITS));
    let positions = plan.given(External::Positions);
    let mut prepare = preparation.constants;
    let step = |shader: &'static Shader, prepare: &Prepare| {
        let relation = preparation.constants.entries_per_particle != 1;
        Call::compute(shader).constant("RELATION_TABLE", relation).push_all(prepare)
    };
    let keys = |call: Call| call.read("positions", positions).read("extent", extent);
    for pass in 0..SORT_PASSES {
        prepare.sort_pass = pass;
        // How many of these passes the occupied cells need only the device knows: the others are empty.
        let (blocks, rows) = (4 * u64::from(EXTENT_DISPATCH + 6 * pass), 4 * u64::from(EXTENT_DISPATCH + 6 * pass + 3));
        let count =
            keys(step(&SORT_COUNT_COMP, &prepare)).read("order", order).update("sorted", sorted).update("sums", sums);
        let relation = preparation.constants.entries_per_particle != 1;
        let scan = Call::compute(&SORT_SCAN_COMP)
            .constant("RELATION_TABLE", relation)
            .read("extent", extent)
            .update("sums", sums);
        let scatter =
            keys(step(&SORT_SCATTER_COMP, &prepare)).update("order", order).read("sorted", sorted).read("sums", sums);
        for (call, arguments) in [(count, blocks), (scan, rows), (scatter, blocks)] {
            plan.dispatch("sort", call, Groups::Indirect(extent, arguments));
        }
    }
    let gather = keys(step(&SORT_GATHER_COMP, &prepare)).update("order", order).write("sorted", sorted);
    plan.dispatch("sort", gather, per_particle(scene.count));
    Sorted { order, positions: sorted }
}
