//! The range of front depths in each tile (`glsl/optics/tiles.comp`): lets rays outside the liquid skip what they pass by.

use crate::{
    layers::{Surface, Surfaces},
    plan::{Call, Groups, Plan, Target},
    resources::ImageSpec,
    shader::{FRONT_TILE, TILES_COMP},
};
use ash::vk::Format;

/// Of both classes together: layer 0 holds each tile's smallest front depth, layer 1 the largest.
pub(super) fn record(plan: &mut Plan, surfaces: &Surfaces, body: &Surface, splash: &Surface) -> Target {
    let size = plan.size().map(|s| s.div_ceil(FRONT_TILE));
    let spec = ImageSpec { format: Format::R32_SFLOAT, size, layers: 2, array: true, usage: Default::default() };
    let ranges = plan.image("front depth tiles", spec);
    let call = Call::compute(&TILES_COMP)
        .read("body_depth", body.depth)
        .read("splash_depth", splash.depth)
        .write("front_tiles", ranges)
        .constant("HAS_SPLASH", surfaces.splash.is_some())
        .constant("HAS_BODY", surfaces.body.is_some());
    plan.dispatch("tiles", call, Groups::Direct([size[0], size[1], 1]));
    ranges
}
