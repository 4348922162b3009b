//! The environment as optics see it (`glsl/include/environment.glsl`): the renderer's own, or the host's.

use crate::{
    input::EnvironmentShape,
    plan::{Call, External, Plan},
    scene::Scene,
};
use ash::vk::Format;

/// Whether a shader needs its variant CUBE.
pub(super) fn is_cube(scene: &Scene) -> bool {
    scene.environment == Some(EnvironmentShape::Cube)
}

/// Adds to a call of a shader that includes `environment.glsl` what that is told.
pub(super) fn seen_by(plan: &mut Plan, scene: &Scene, call: Call) -> Call {
    if is_cube(scene) {
        return call.read("environment", plan.given(External::Environment));
    }
    // Of the host's map and our own one is looked at; something has to be bound as the other.
    let own = scene.environment.is_none();
    let (map, footprints) = match own {
        true => (plan.nothing("no environment", Format::R32G32B32A32_SFLOAT, false), plan.given(External::Footprints)),
        false => (plan.given(External::Environment), plan.nothing("no footprints", Format::R32G32B32A32_UINT, false)),
    };
    call.read("environment", map).read("footprints", footprints).constant("OWN_ENVIRONMENT", own)
}
