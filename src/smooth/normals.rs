//! Normals of the smoothed body (`glsl/normals.comp`; Green10).

use super::per_pixel;
use crate::{
    layers::Surface,
    passes::counters,
    plan::{Call, Plan, Target},
    shader::{IMAGE_GROUP, NORMALS_COMP},
};
use ash::vk::Format;

/// From depths, as a filter left them.
pub(super) fn record(plan: &mut Plan, body: &Surface, depth: Target) -> Target {
    let normal = plan.map("body normal (smoothed)", Format::R32_UINT, body.sides);
    let counters = counters(plan);
    let call = Call::compute(&NORMALS_COMP)
        .read("depth_in", depth)
        .read("normal_raw", body.normal)
        .write("normal_out", normal)
        .update("counters", counters);
    let groups = per_pixel(plan, IMAGE_GROUP, body.sides);
    plan.dispatch("normals", call, groups);
    normal
}
