//! The walk of each view ray through a density field and balls (`glsl/optics/field_walk.frag`), and between which depths it can meet
//! any (`glsl/optics/field_tiles.comp`).

use super::{tiles::Tiles, walk::variant};
use crate::{
    layers::field::Volume,
    plan::{Call, Groups, Plan, Vertices},
    scene::Scene,
    shader::{FIELD_TILE, FIELD_TILES_COMP, FIELD_WALK_FRAG, Shader},
};

/// The tiles of the view, in the ledger.
const TILES: &str = "field tiles";
/// What is bound in place of buffers that are too large to be read as texels.
const NO_TEXELS: &str = "no texels";

/// The draw of the walk in tiles of the view that have liquid, but for what all walks' optics call for; and these tiles.
pub(super) fn draw(
    plan: &mut Plan,
    scene: &Scene,
    field: &Volume,
    trace_reflections: u32,
) -> (Tiles, (Call, Vertices)) {
    let tiles = Tiles::empty(plan, TILES, TILES, 2, FIELD_TILE);
    let bounds = Call::compute(&FIELD_TILES_COMP)
        .read("head", field.head)
        .read("table", field.table)
        .read("records", field.records)
        .read("balls", field.balls)
        .update("tiles", tiles.bounds)
        .push("capacity", field.build.capacity)
        .push("spacing", field.spacing)
        .push("ball", field.build.ball);
    plan.dispatch(TILES, bounds, Groups::Indirect(field.head, 0));
    let (call, vertices) = through(plan, scene, field, &tiles, &FIELD_WALK_FRAG[variant(scene)]);
    (tiles, (call.constant("TRACE_REFLECTIONS", trace_reflections), vertices))
}

/// The draw of another shader that looks for walls as the walk does, after [`draw`]; none of what has no walk.
pub(crate) fn first_walls(
    plan: &mut Plan,
    scene: &Scene,
    field: &Volume,
    shader: &'static Shader,
) -> Option<(Call, Vertices)> {
    let tiles = Tiles { bounds: plan.find(TILES)?, words: 2, edge: FIELD_TILE };
    Some(through(plan, scene, field, &tiles, shader))
}

/// The draw of a shader in tiles of the view that have liquid, with all that it needs to find walls.
fn through(plan: &mut Plan, scene: &Scene, field: &Volume, tiles: &Tiles, shader: &'static Shader) -> (Call, Vertices) {
    let read = [
        ("table", "table_texels", field.table),
        ("records", "record_texels", field.records),
        ("cells", "cell_texels", field.cells),
        ("balls", "ball_texels", field.balls),
    ];
    // As texels too, where the device has so large texel buffers.
    let texels = read.iter().all(|(.., buffer)| plan.bytes(*buffer).is_some_and(|bytes| bytes <= scene.texels_size));
    let small = (!texels).then(|| plan.find(NO_TEXELS).unwrap_or_else(|| plan.buffer(NO_TEXELS, 16)));
    let (call, vertices) = tiles.draw(plan, scene, shader, false);
    let call = call
        .read("head", field.head)
        .read("tiles", tiles.bounds)
        .constant("TEXELS", texels)
        .push("slots", field.build.slots)
        .push("ball", field.build.ball)
        .push("spacing", field.spacing);
    let call = read
        .into_iter()
        .fold(call, |call, (name, as_texels, buffer)| call.read(name, buffer).read(as_texels, small.unwrap_or(buffer)));
    (call, vertices)
}
