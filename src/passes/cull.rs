//! Which particles can show (`glsl/cull.comp`).

use super::{Arrays, counters, per_particle};
use crate::{
    frame::Scene,
    plan::{Call, Plan, Target},
    shader::CULL_COMP,
};

/// A word a particle: its class and the sides on which it shows. `bounds`: what hides particles, if anything does.
pub(crate) fn record(plan: &mut Plan, scene: &Scene, particles: &Arrays, bounds: Option<Target>) -> Target {
    let visible = plan.array("visible particles", 4 * u64::from(scene.count));
    let call = particles
        .read_by(Call::compute(&CULL_COMP))
        // Where nothing is bounded, the shader does not look; something has to be bound all the same, and validation
        // takes it for read.
        .read("bounds", bounds.unwrap_or(particles.centers))
        .write("visible", visible)
        .update("counters", counters(plan))
        .constant("OCCLUSION_CULLING", bounds.is_some())
        .constant("BACK_SIDES", scene.sides() == 2);
    plan.dispatch("cull", call, per_particle(scene.count));
    visible
}
