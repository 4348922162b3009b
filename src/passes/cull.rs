//! Which particles can show (`glsl/cull.comp`).

use super::{Arrays, Culled, per_particle};
use crate::{
    optics::{tiles::Tiles, walk::Walk},
    plan::{Call, Plan, Target},
    scene::Scene,
    shader::{CULL_COMP, VIEW_TILE},
};

/// `bounds`: what hides particles, if anything does.
pub(crate) fn record(plan: &mut Plan, scene: &Scene, particles: &Arrays, bounds: Option<Target>) -> Culled {
    let visible = plan.array("visible particles", 4 * u64::from(scene.count));
    let large = plan.buffer("large particles", 8);
    plan.fill("cull", large, 0, 8, 0);
    let tiles =
        Walk::of(&scene.settings.method.optics).is_some().then(|| Tiles::empty(plan, "cull", "tiles", 1, VIEW_TILE));
    let call = particles
        .read_by(Call::compute(&CULL_COMP[usize::from(tiles.is_some())]))
        // Where nothing is bounded, the shader does not look; something has to be bound all the same, and validation
        // takes it for read.
        .read("bounds", bounds.unwrap_or(particles.centers))
        .write("visible", visible)
        .update("large", large)
        .constant("OCCLUSION_CULLING", bounds.is_some())
        .constant("BACK_SIDES", scene.sides() == 2);
    let call = tiles.iter().fold(call, |call, tiles| call.update("tiles", tiles.bounds));
    plan.dispatch("cull", call, per_particle(scene.count));
    Culled { visible, large, tiles }
}
