//! Number density, class and ellipsoid of each particle (`glsl/shape.comp`; Imai16 §4.1, YuTurk13).

use super::{Arrays, Points, rectangle, sort::Sorted};
use crate::{
    plan::{Call, External, Plan, Target},
    scene::{Preparation, Scene},
    shader::{PARTICLE_GROUP, SHAPE_COMP, SHAPE_RUN},
};

/// What becomes of particles, in the order of `glsl/shape.comp`; the last one only where they have ids.
pub(crate) const COUNTED: [&str; 7] = [
    "splash",
    "body",
    "ellipsoid_few_neighbours",
    "ellipsoid_degenerate",
    "ellipsoid_clamped_long",
    "ellipsoid_clamped_ratio",
    "id_out_of_range",
];

/// What classes start as: as if all had been body.
const BODY: u32 = 1;

/// Classes, and ellipsoids for the body.
pub(crate) fn record(
    plan: &mut Plan,
    scene: &Scene,
    preparation: &Preparation,
    extent: Target,
    sorted: &Sorted,
) -> Arrays {
    let count = u64::from(scene.count);
    let mut array = |name| plan.array(name, 12 * count);
    let arrays = Arrays {
        centers: array("particle centres"),
        diagonals: array("particle shapes (diagonal)"),
        mixed: array("particle shapes (mixed)"),
    };
    dispatch(plan, scene, preparation, extent, sorted, false, |call| {
        call.write("centers", arrays.centers)
            .write("diagonals", arrays.diagonals)
            .write("mixed", arrays.mixed)
            .constant("YU_TURK", preparation.yu_turk)
    });
    arrays
}

/// Classes, and densities in place of ellipsoids: for a density field.
pub(crate) fn points(
    plan: &mut Plan,
    scene: &Scene,
    preparation: &Preparation,
    extent: Target,
    sorted: &Sorted,
) -> Points {
    let points = plan.array("particle points", 16 * u64::from(scene.count));
    dispatch(plan, scene, preparation, extent, sorted, true, |call| call.write("points", points));
    Points { points, extent: Some(extent) }
}

fn dispatch(
    plan: &mut Plan,
    scene: &Scene,
    preparation: &Preparation,
    extent: Target,
    sorted: &Sorted,
    points: bool,
    write: impl FnOnce(Call) -> Call,
) {
    let count = u64::from(scene.count);
    let listed = preparation.neighbours > 0;
    let by_id = preparation.kept.is_some_and(|kept| kept.by_id);
    let (alone, at_once) = if scene.four { (false, SHAPE_RUN) } else { (true, 1) };
    let variants = [listed, preparation.kept.is_some(), points, alone];
    let variant: usize = variants.into_iter().enumerate().map(|(bit, is)| usize::from(is) << bit).sum();
    let mut call = write(Call::compute(&SHAPE_COMP[variant]))
        .read("extent", extent)
        .read("order", sorted.order)
        .read("sorted", sorted.positions)
        .counting(if by_id { &COUNTED } else { &COUNTED[..6] })
        .constant("RELATION_TABLE", preparation.constants.entries_per_particle != 1)
        .push_all(&preparation.constants);
    if let Some(kept) = preparation.kept {
        let classes =
            plan.kept_array("shape", "last classes", 4 * u64::from(kept.number), preparation.anew.then_some(BODY));
        // Without ids nothing is read of what is bound instead.
        let ids = if by_id { plan.given(External::Ids) } else { sorted.order };
        call = call.update("last_classes", classes).read("ids", ids).constant("BY_ID", by_id);
    }
    if listed {
        let lists = plan.array("neighbours (debug)", 4 * (2 + u64::from(preparation.neighbours)) * count);
        call = call.write("neighbours", lists);
    }
    plan.dispatch("shape", call, rectangle(scene.count.div_ceil(at_once * PARTICLE_GROUP)));
}
