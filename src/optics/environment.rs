//! The environment as optics see it (`glsl/include/environment.glsl`): the renderer's own, or the host's.

use crate::{
    frame::Scene,
    input::EnvironmentShape,
    plan::{Call, External, Plan, Target},
    resources::ImageSpec,
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
        true => (nothing(plan, "no environment", Format::R32G32B32A32_SFLOAT), plan.given(External::Footprints)),
        false => (plan.given(External::Environment), nothing(plan, "no footprints", Format::R32G32B32A32_UINT)),
    };
    call.read("environment", map).read("footprints", footprints).constant("OWN_ENVIRONMENT", own)
}

/// An image that nothing looks at; the same one each time.
fn nothing(plan: &mut Plan, name: &'static str, format: Format) -> Target {
    let spec = ImageSpec { format, size: [1, 1], layers: 1, array: false, usage: Default::default() };
    plan.find(name).unwrap_or_else(|| plan.image(name, spec))
}
