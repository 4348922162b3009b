//! The box of all positions, and what follows from it (`glsl/extent.comp`).

use super::per_block;
use crate::{
    frame::Scene,
    plan::{Call, External, Groups, Plan, Target},
    shader::{EXTENT_MOST, EXTENT_PLAN_COMP, EXTENT_REDUCE_COMP, EXTENT_WORDS, Prepare},
};
use ash::vk;

/// Gives the buffer of what it found.
pub(crate) fn record(plan: &mut Plan, scene: &Scene, prepare: &Prepare) -> Target {
    let extent = plan.buffer("extent", 4 * u64::from(EXTENT_WORDS));
    let (frame, positions) = (plan.given(External::FrameBlock), plan.given(External::Positions));
    let least = 4 * u64::from(EXTENT_MOST);
    plan.fill("extent", extent, 0, least, u32::MAX);
    plan.fill("extent", extent, least, vk::WHOLE_SIZE, 0);
    let reduce = Call::compute(&EXTENT_REDUCE_COMP).counting(&["not_finite"]);
    let relation = prepare.entries_per_particle != 1;
    let find = Call::compute(&EXTENT_PLAN_COMP).update("frame", frame).constant("RELATION_TABLE", relation);
    for (call, groups) in [(reduce, per_block(scene.count)), (find, Groups::Direct([1, 1, 1]))] {
        let call = call.read("positions", positions).update("extent", extent).push_all(prepare);
        plan.dispatch("extent", call, groups);
    }
    extent
}
