//! The box of all positions, and what follows from it (`glsl/extent.comp`).

use super::per_block;
use crate::{
    plan::{Call, External, Groups, Home, Plan, Target},
    scale::Scale,
    scene::Scene,
    shader::{EXTENT_MOST, EXTENT_PLAN_COMP, EXTENT_REDUCE_COMP, EXTENT_WORDS, Prepare},
};
use ash::vk;

/// Gives the buffer of what it found. Particles that stay where they are need no more than what is done for the view.
pub(crate) fn record(plan: &mut Plan, scene: &Scene, prepare: &Prepare) -> Target {
    let extent = plan.buffer("extent", 4 * u64::from(EXTENT_WORDS));
    let positions = plan.given(External::Positions);
    // Where the host knows their number nothing comes of what is read there.
    let number = if scene.counted { plan.given(External::Count) } else { positions };
    let least = 4 * u64::from(EXTENT_MOST);
    plan.fill("extent", extent, 0, least, u32::MAX);
    plan.fill("extent", extent, least, vk::WHOLE_SIZE, 0);
    let reduce = Call::compute(&EXTENT_REDUCE_COMP).counting(&["not_finite"]);
    let relation = prepare.entries_per_particle != 1;
    let dispatch = |plan: &mut Plan, call: Call, groups| {
        let call =
            call.read("positions", positions).read("device_count", number).update("extent", extent).push_all(prepare);
        plan.dispatch("extent", call, groups);
    };
    dispatch(plan, reduce, per_block(scene.count));
    plan.work_for(Home::View, "particles");
    // The block of each scale at which the frame works is completed on its own; what else that finds is the same each time.
    for scale in Scale::ALL.into_iter().filter(|s| *s == Scale::Full || *s == scene.scale()) {
        let frame = plan.given(External::FrameBlock(scale));
        let find = Call::compute(&EXTENT_PLAN_COMP).update("frame", frame).constant("RELATION_TABLE", relation);
        dispatch(plan, find, Groups::Direct([1, 1, 1]));
    }
    plan.work_for(Home::Particles, "particles");
    extent
}
