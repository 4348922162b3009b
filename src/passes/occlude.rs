//! How deep the body certainly reaches at each pixel (`glsl/occlude.comp`): what [`super::cull`] tests against.

use super::{Arrays, per_particle};
use crate::{
    frame::Scene,
    plan::{Call, Plan, Target},
    shader::OCCLUDE_COMP,
};

/// Two 32-bit bounds a pixel: nearest front, then farthest back.
pub(crate) fn record(plan: &mut Plan, scene: &Scene, particles: &Arrays) -> Target {
    let [width, height] = plan.size().map(u64::from);
    let half = 4 * width * height;
    let bounds = plan.buffer("body depth bounds", 2 * half);
    // No front is certain: infinitely far. No back: at the eye.
    plan.fill("occlude", bounds, 0, half, f32::INFINITY.to_bits());
    plan.fill("occlude", bounds, half, half, 0);
    let call = particles.read_by(Call::compute(&OCCLUDE_COMP)).update("bounds", bounds);
    plan.dispatch("occlude", call, per_particle(scene.count));
    bounds
}
