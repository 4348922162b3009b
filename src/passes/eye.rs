//! Whether the eye is inside the body (`glsl/eye.comp`), where the host leaves that to the device.

use super::sort::Sorted;
use crate::{
    Error,
    optics::walk::Walk,
    plan::{Call, External, Groups, Plan, Target},
    scale::Scale,
    scene::{Preparation, Scene},
    shader::EYE_COMP,
};

/// Whether anybody has to be told: walks through maps, in which there is nothing of a surface behind the eye. Look-ups show fronts
/// alone, wherever the eye is, and a density field is looked at where rays start.
pub(crate) fn wanted(scene: &Scene) -> bool {
    scene.eye_on_device && scene.body && Walk::of(&scene.settings.method.optics).is_some()
}

/// Completes the frame's block, from positions on the device: those that the host prepared tell nothing of densities.
pub(crate) fn record(plan: &mut Plan, sorted: Option<&(&Preparation, Target, Sorted)>) {
    let Some((preparation, extent, sorted)) = sorted else {
        let remedy = "particles that the host prepared have their positions there: say Inside or Outside, as \
                      prepare::DensityField (C: meniscus_density_at) has it, or give FrameInput::positions";
        return plan.fail(Error::parameter("eye inside", "left to the device", remedy));
    };
    // Walks are at the picture's own scale.
    let frame = plan.given(External::FrameBlock(Scale::Full));
    let call = Call::compute(&EYE_COMP)
        .update("frame", frame)
        .read("extent", *extent)
        .read("order", sorted.order)
        .read("sorted", sorted.positions)
        .constant("RELATION_TABLE", preparation.constants.entries_per_particle != 1)
        .push_all(&preparation.constants);
    plan.dispatch("eye", call, Groups::Direct([1, 1, 1]));
}
