//! Lists of what the cull pass left to draw, and the indirect draws of them (`glsl/compact.comp`).

use super::{Arrays, Culled, Drawn, per_block, sums_bytes};
use crate::{
    plan::{Call, Groups, Plan},
    scene::Scene,
    shader::{COMPACT_COUNT_COMP, COMPACT_SCAN_COMP, COMPACT_SCATTER_COMP, Draws},
};

/// Class and side.
const LISTS: u32 = 4;

pub(crate) fn record(plan: &mut Plan, scene: &Scene, particles: &Arrays, culled: &Culled) -> Drawn {
    let count = u64::from(scene.count);
    let sums = plan.array("list sums", sums_bytes(count, LISTS));
    // For each side splashes from the start, the body from the end.
    let lists = plan.array("drawn particles", 4 * u64::from(scene.sides()) * count);
    let draws = plan.buffer("indirect draws", u64::from(LISTS) * size_of::<Draws>() as u64);
    let blocks = per_block(scene.count);
    let counting = Call::compute(&COMPACT_COUNT_COMP).read("visible", culled.visible).update("sums", sums);
    plan.dispatch("compact", counting, blocks);
    plan.dispatch("compact", Call::compute(&COMPACT_SCAN_COMP).update("sums", sums), Groups::Direct([LISTS, 1, 1]));
    let scatter = Call::compute(&COMPACT_SCATTER_COMP)
        .read("visible", culled.visible)
        .read("sums", sums)
        .write("drawn", lists)
        .write("draws", draws)
        .read("large", culled.large)
        .counting(&["splash_drawn_front", "splash_drawn_back", "body_drawn_front", "body_drawn_back"]);
    plan.dispatch("compact", scatter, blocks);
    Drawn { particles: *particles, lists, draws }
}
