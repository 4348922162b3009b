//! What the host is told of the first surface (`glsl/surface.frag`): its depth, its normal, its motion and where it is, each into an
//! image of the host's.

use crate::{
    input::{Says, has_depth, is_halved},
    plan::{Call, External, Plan, Rendering, Target, Vertices},
    scene::Scene,
    shader::{
        SURFACE_DEPTH_AS_COLOR_FRAG, SURFACE_DEPTH_FRAG, SURFACE_MOTION_FRAG, SURFACE_NORMAL_FRAG,
        SURFACE_REACTIVE_FRAG, VIEW_VERT,
    },
};
use ash::vk::Format;

/// Draws each that is asked for over what is there.
pub(crate) fn record(plan: &mut Plan, scene: &Scene, first: Target) {
    for (says, format) in scene.surface_formats() {
        let output = plan.given(External::Surface(says, format));
        let over = Rendering::into(output, 0).keeping(true);
        let draw = |shader| Call::draw(&VIEW_VERT, shader).read("first_surface", first);
        let (rendering, call) = match says {
            Says::Depth if has_depth(format) => (Rendering::over_depth(output), draw(&SURFACE_DEPTH_FRAG)),
            Says::Depth => (over, draw(&SURFACE_DEPTH_AS_COLOR_FRAG)),
            Says::Normal => (over, draw(&SURFACE_NORMAL_FRAG).constant("HALVED", is_halved(format))),
            Says::Motion => {
                let moved = scene.moves.as_ref().map(|moves| super::motion::record(plan, moves, first));
                let motion = moved.unwrap_or_else(|| plan.nothing("no motion", Format::R32G32B32A32_SFLOAT, false));
                let call = draw(&SURFACE_MOTION_FRAG).read("surface_motion", motion);
                (over, call.constant("MOVES", moved.is_some()).push_all(&scene.motions))
            }
            Says::Reactive => (over, draw(&SURFACE_REACTIVE_FRAG).push("reactive", scene.reactive)),
        };
        plan.render("surface", rendering, vec![(call, Vertices::Direct(3))]);
    }
}
