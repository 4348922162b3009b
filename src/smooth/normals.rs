//! Normals of the smoothed body (`glsl/smooth/normals.comp`; Green10).

#[cfg(feature = "inspect")]
pub mod twin;

use super::per_pixel;
use crate::{
    layers::Body,
    plan::{Call, Plan, Target},
    shader::{IMAGE_GROUP, NORMALS_COMP},
};
use ash::vk::Format;

/// From depths, as a filter left them.
pub(super) fn record(plan: &mut Plan, body: &Body, depth: Target) -> Target {
    let normal = plan.map("body normal (smoothed)", Format::R32_UINT, body.sides);
    let mut call = Call::compute(&NORMALS_COMP[usize::from(body.normal.is_some())])
        .read("depth_in", depth)
        .write("normal_out", normal)
        .counting(&["normals_lone_pixel"]);
    // Where differences say nothing the particle's own normal stays, if there is one.
    if let Some(raw) = body.normal {
        call = call.read("normal_raw", raw);
    }
    let groups = per_pixel(plan, IMAGE_GROUP, body.sides);
    plan.dispatch("normals", call, groups);
    normal
}
