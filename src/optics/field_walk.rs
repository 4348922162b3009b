//! The walk of each view ray through a density field and balls (`glsl/optics/field_walk.frag`), and between which depths it can meet
//! any (`glsl/optics/field_tiles.comp`).

use super::walk::variant;
use crate::{
    frame::Scene,
    layers::field::Volume,
    plan::{Call, Groups, Plan, Vertices},
    shader::{FIELD_TILE, FIELD_TILES_COMP, FIELD_TILES_VERT, FIELD_WALK_FRAG},
};
use ash::vk;

/// The draws of the walk: of tiles of the view that have liquid, and of those that have none; each with what the optics call
/// for it adds.
pub(super) fn draws(
    plan: &mut Plan,
    scene: &Scene,
    field: &Volume,
    optics: impl Fn(&mut Plan, Call, bool) -> Call,
) -> Vec<(Call, Vertices)> {
    let points = scene.points && !scene.settings.drawing.quads_only;
    let [across, down] = plan.size().map(|s| s.div_ceil(FIELD_TILE));
    let tiles = plan.buffer("field tiles", 8 * u64::from(across) * u64::from(down));
    plan.fill("field tiles", tiles, 0, vk::WHOLE_SIZE, f32::INFINITY.to_bits());
    let bounds = Call::compute(&FIELD_TILES_COMP)
        .read("head", field.head)
        .read("table", field.table)
        .read("records", field.records)
        .read("balls", field.balls)
        .update("tiles", tiles)
        .push("capacity", field.build.capacity)
        .push("spacing", field.spacing)
        .push("ball", field.build.ball);
    plan.dispatch("field tiles", bounds, Groups::Indirect(field.head, 0));
    let read = [field.table, field.records, field.cells];
    // As texels too, where the device has so large texel buffers.
    let texels = read.iter().all(|buffer| plan.bytes(*buffer).is_some_and(|bytes| bytes <= scene.texels_size));
    let no_texels = (!texels).then(|| plan.buffer("no texels", 16));
    let as_texels = |buffer| no_texels.unwrap_or(buffer);
    let draw = |plan: &mut Plan, empty: bool| {
        let fragment = &FIELD_WALK_FRAG[variant(scene) + 8 * usize::from(empty)];
        let call = Call::draw(&FIELD_TILES_VERT[usize::from(!points)], fragment)
            .read("bounds", tiles)
            .constant("EMPTY", empty);
        let call = if points { call.topology(vk::PrimitiveTopology::POINT_LIST) } else { call };
        let call = match empty {
            true => call,
            false => call
                .read("head", field.head)
                .read("table", field.table)
                .read("table_texels", as_texels(field.table))
                .read("records", field.records)
                .read("record_texels", as_texels(field.records))
                .read("cells", field.cells)
                .read("cell_texels", as_texels(field.cells))
                .read("balls", field.balls)
                .read("tiles", tiles)
                .constant("TEXELS", texels)
                .push("slots", field.build.slots)
                .push("ball", field.build.ball)
                .push("spacing", field.spacing),
        };
        let vertices = across * down * if points { 1 } else { 6 };
        (optics(plan, call, empty), Vertices::Direct(vertices))
    };
    [true, false].map(|empty| draw(plan, empty)).into()
}
