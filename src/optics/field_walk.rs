//! The walk of each view ray through a density field and balls (`glsl/optics/field_walk.frag`), and between which depths it can meet
//! any (`glsl/optics/field_tiles.comp`).

use super::{tiles::Tiles, walk::variant};
use crate::{
    frame::Scene,
    layers::field::Volume,
    plan::{Call, Groups, Plan, Vertices},
    shader::{FIELD_TILE, FIELD_TILES_COMP, FIELD_WALK_FRAG},
};

/// The draw of the walk in tiles of the view that have liquid, but for what all walks' optics call for; and these tiles.
pub(super) fn draw(
    plan: &mut Plan,
    scene: &Scene,
    field: &Volume,
    trace_reflections: u32,
) -> (Tiles, (Call, Vertices)) {
    let tiles = Tiles::empty(plan, "field tiles", "field tiles", 2, FIELD_TILE);
    let bounds = Call::compute(&FIELD_TILES_COMP)
        .read("head", field.head)
        .read("table", field.table)
        .read("records", field.records)
        .read("balls", field.balls)
        .update("tiles", tiles.bounds)
        .push("capacity", field.build.capacity)
        .push("spacing", field.spacing)
        .push("ball", field.build.ball);
    plan.dispatch("field tiles", bounds, Groups::Indirect(field.head, 0));
    let read = [
        ("table", "table_texels", field.table),
        ("records", "record_texels", field.records),
        ("cells", "cell_texels", field.cells),
    ];
    // As texels too, where the device has so large texel buffers.
    let texels = read.iter().all(|(.., buffer)| plan.bytes(*buffer).is_some_and(|bytes| bytes <= scene.texels_size));
    let no_texels = (!texels).then(|| plan.buffer("no texels", 16));
    let (call, vertices) = tiles.draw(plan, scene, &FIELD_WALK_FRAG[variant(scene)], false);
    let call = call
        .read("head", field.head)
        .read("balls", field.balls)
        .read("tiles", tiles.bounds)
        .constant("TEXELS", texels)
        .constant("TRACE_REFLECTIONS", trace_reflections)
        .push("slots", field.build.slots)
        .push("ball", field.build.ball)
        .push("spacing", field.spacing);
    let call = read.into_iter().fold(call, |call, (name, as_texels, buffer)| {
        call.read(name, buffer).read(as_texels, no_texels.unwrap_or(buffer))
    });
    (tiles, (call, vertices))
}
