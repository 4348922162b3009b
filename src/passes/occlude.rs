//! How deep the body certainly reaches at each pixel (`glsl/occlude.comp`): what [`super::cull`] tests against.

use super::{Arrays, per_particle};
use crate::{
    layers::Mapping,
    plan::{Call, Plan, Target},
    scene::Scene,
    shader::OCCLUDE_COMP,
};

/// Whether hidden particles are dropped before drawing. That only saves time: where the bounds do not fit a storage buffer,
/// everything is drawn.
pub(crate) fn wanted(scene: &Scene, maps: &dyn Mapping) -> bool {
    let pixels: u64 = scene.scale().size(scene.size).map(u64::from).iter().product();
    let wanted = scene.settings.drawing.occlusion_culling && maps.may_cull(scene);
    scene.body && wanted && 8 * pixels <= scene.storage_size
}

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
