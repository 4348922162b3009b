//! How deep the body certainly reaches at each pixel (`glsl/occlude.comp`): what [`super::cull`] tests against.

use super::{Arrays, per_particle};
use crate::{
    frame::Scene,
    plan::{Call, Plan, Target},
    shader::OCCLUDE_COMP,
};

/// Two bounds a pixel, of front and back (`glsl/include/bounds.glsl`).
pub(crate) fn record(plan: &mut Plan, scene: &Scene, particles: &Arrays) -> Target {
    let [width, height] = plan.size().map(u64::from);
    let bytes = 8 * width * height;
    let bounds = plan.buffer("body depth bounds", bytes);
    plan.fill("occlude", bounds, 0, bytes, f32::INFINITY.to_bits());
    let call = particles
        .read_by(Call::compute(&OCCLUDE_COMP))
        .update("bounds", bounds)
        .constant("BACK_SIDES", scene.sides() == 2);
    plan.dispatch("occlude", call, per_particle(scene.count));
    bounds
}
