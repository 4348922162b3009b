//! Number density, class and ellipsoid of each particle (`glsl/shape.comp`; Imai16 §4.1, YuTurk13).

use super::{Arrays, rectangle, sort::Sorted};
use crate::{
    frame::{Preparation, Scene},
    plan::{Call, Plan, Target},
    shader::{PARTICLE_GROUP, SHAPE_COMP, SHAPE_RUN},
};

/// What becomes of particles, in the order of `glsl/shape.comp`.
pub(crate) const COUNTED: [&str; 6] = [
    "splash",
    "body",
    "ellipsoid_few_neighbours",
    "ellipsoid_degenerate",
    "ellipsoid_clamped_long",
    "ellipsoid_clamped_ratio",
];

/// The array that keeps classes from frame to frame.
pub(crate) const LAST_CLASSES: &str = "last classes";

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
    let listed = preparation.neighbours > 0;
    let mut call = Call::compute(&SHAPE_COMP[usize::from(listed) + 2 * usize::from(preparation.keep_classes)])
        .read("extent", extent)
        .read("order", sorted.order)
        .read("sorted", sorted.positions)
        .write("centers", arrays.centers)
        .write("diagonals", arrays.diagonals)
        .write("mixed", arrays.mixed)
        .counting(&COUNTED)
        .constant("RELATION_TABLE", preparation.constants.entries_per_particle != 1)
        .constant("YU_TURK", preparation.yu_turk)
        .push_all(&preparation.constants);
    if preparation.keep_classes {
        call = call.update("last_classes", plan.array(LAST_CLASSES, 4 * count));
    }
    if listed {
        let lists = plan.array("neighbours (debug)", 4 * (2 + u64::from(preparation.neighbours)) * count);
        call = call.write("neighbours", lists);
    }
    plan.dispatch("shape", call, rectangle(scene.count.div_ceil(SHAPE_RUN * PARTICLE_GROUP)));
    arrays
}
