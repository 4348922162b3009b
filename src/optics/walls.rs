//! What rays meet at each pixel and in each tile of the view, in one texel (`glsl/optics/walls.comp`): the body's interval and the
//! splash in front.

use crate::{
    layers::{Surface, Surfaces},
    plan::{Call, Groups, Plan, Target},
    resources::ImageSpec,
    shader::{WALL_TILE, WALLS_COMP},
};
use ash::vk::Format;

/// Pixels, and below them tiles.
pub(super) fn record(plan: &mut Plan, surfaces: &Surfaces, body: &Surface, splash: &Surface) -> Target {
    let [width, height] = plan.size();
    let tiles = [width, height].map(|s| s.div_ceil(WALL_TILE));
    let size = [width, height + tiles[1]];
    let format = Format::R32G32B32A32_SFLOAT;
    let walls = plan.image("walls", ImageSpec { format, size, layers: 1, array: false, usage: Default::default() });
    let call = Call::compute(&WALLS_COMP)
        .read("body_depth", body.depth)
        .read("splash_depth", splash.depth)
        .write("walls", walls)
        .constant("HAS_SPLASH", surfaces.splash.is_some())
        .constant("HAS_BODY", surfaces.body.is_some());
    plan.dispatch("walls", call, Groups::Direct([tiles[0].div_ceil(WALL_TILE), tiles[1], 1]));
    walls
}
