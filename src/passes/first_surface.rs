//! The first surface that each pixel shows (`glsl/first_surface.frag`), for what is said of it to the host ([`super::surface`]).

use crate::{
    layers::Surfaces,
    optics::{field_walk, lookup::Lookup, walk::Walk},
    plan::{Call, External, Plan, Rendering, Target, Vertices},
    scene::Scene,
    shader::{FIRST_SURFACE_FRAG, VIEW_VERT},
};
use ash::vk::Format;

/// World-space normal, and linear depth in particle radii; zeros where no liquid shows.
pub(crate) fn record(plan: &mut Plan, scene: &Scene, surfaces: &Surfaces) -> Target {
    let variant = usize::from(surfaces.field.is_some()) + 2 * usize::from(scene.has_scene);
    let shader = &FIRST_SURFACE_FRAG[variant];
    let drawn = match &surfaces.field {
        Some(field) => field_walk::first_walls(plan, scene, field, shader),
        None => Some((maps(plan, scene, surfaces, Call::draw(&VIEW_VERT, shader)), Vertices::Direct(3))),
    };
    let first = plan.flat("first surface", Format::R32G32B32A32_SFLOAT);
    let draws = drawn.into_iter().map(|(call, vertices)| match scene.has_scene {
        true => (call.read("scene_depth", plan.given(External::SceneDepth)), vertices),
        false => (call, vertices),
    });
    let draws = draws.collect();
    plan.render("first surface", Rendering::into(first, 0), draws);
    first
}

fn maps(plan: &mut Plan, scene: &Scene, surfaces: &Surfaces, call: Call) -> Call {
    let optics = &scene.settings.method.optics;
    let walk = Walk::of(optics);
    // Look-ups show the body alone, wherever the eye is.
    let splash = surfaces.splash.filter(|_| walk.is_some());
    let any = surfaces.body.or(splash).unwrap_or_else(|| crate::optics::walk::placeholder(plan));
    let (of_body, of_splash) = (surfaces.body.unwrap_or(any), splash.unwrap_or(any));
    call.read("body_depth", of_body.depth)
        .read("body_normal", of_body.normal)
        .read("splash_depth", of_splash.depth)
        .read("splash_normal", of_splash.normal)
        .constant("HAS_BODY", surfaces.body.is_some())
        .constant("HAS_SPLASH", splash.is_some())
        .constant("EYE_MAY_BE_INSIDE", walk.is_some())
        // With one refraction no far side says how far the body around the eye reaches.
        .constant("BACKS", walk.is_some_and(|w| w.refractions > 1))
        .constant("HALF_RESOLUTION", Lookup::of(optics).is_some_and(|l| l.half_resolution))
}
