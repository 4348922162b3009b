//! How the first surface moves: as the particle nearest to it does (`glsl/motion.frag`).

use crate::{
    input::Moves,
    plan::{Call, External, Plan, Rendering, Target, Vertices},
    shader::{MOTION_FRAG, MOTION_VERT},
};
use ash::vk::{CompareOp, Format};

/// How far it has come since the frame before, in eye space and in particle radii, where any particle is near.
pub(crate) fn record(plan: &mut Plan, moves: &Moves, first: Target) -> Target {
    let moved = plan.flat("surface motion", Format::R32G32B32A32_SFLOAT);
    let nearest = plan.flat("nearest particle test", Format::D32_SFLOAT);
    let positions = plan.given(External::MovingPositions);
    // Where the host knows their number nothing is read there.
    let number = if moves.counted { plan.given(External::MovingCount) } else { positions };
    let call = Call::draw(&MOTION_VERT, &MOTION_FRAG)
        .read("positions", positions)
        .read("device_count", number)
        .read("before", plan.given(External::Motions))
        .read("first_surface", first)
        .constant("VELOCITIES", moves.velocities)
        .constant("COUNTED", moves.counted)
        .push_all(&moves.block);
    let rendering = Rendering::into(moved, 0).testing(nearest, 1.0, CompareOp::LESS);
    // As quads: what is as large as this is mostly larger than points.
    plan.render("surface motion", rendering, vec![(call, Vertices::Direct(6 * moves.count))]);
    moved
}
