//! The walk of each view ray through the liquid, and its colour (`glsl/optics/walk.frag`; Imai16 §4.4, §4.5).

use super::{
    Fresnel, environment, field_walk,
    tiles::{self, Tiles},
    walls,
};
use crate::{
    input::Background,
    layers::{Surface, Surfaces},
    plan::{Call, External, Plan, Rendering, Vertices},
    scene::Scene,
    shader::WALK_FRAG,
};
use ash::vk::Format;

/// A walk that follows light inside the liquid: its parameters, and at how many surfaces they have it bend.
macro_rules! walk_parameters {
    ($(#[doc = $about:literal])+ pub struct $Name:ident $({ $($own:tt)* })?, refractions: $refractions:expr) => {
        parameters! {
            $(#[doc = $about])+
            pub struct $Name {
                $($($own)*)?
                /// Total internal reflections followed in one walk; ours: the papers follow none
                internal_reflections: u32 = 4, "", "0 to 64" => |n| *n <= 64;
                /// Reflectance (Imai16: Schlick's)
                fresnel: Fresnel = Fresnel::Schlick, "", "schlick (Schlick's approximation) or exact" => |_| true;
                /// Reflected rays a pixel that are followed, which may meet the liquid again; the others bring back what is infinitely
                /// far away. In a density field alone
                trace_reflections: u32 = 0, "", "0 to 16" => |n| *n <= 16;
            }
        }

        impl From<$Name> for Walk {
            fn from(p: $Name) -> Walk {
                let refractions: fn(&$Name) -> u32 = $refractions;
                Walk {
                    refractions: refractions(&p),
                    internal_reflections: p.internal_reflections,
                    fresnel: p.fresnel,
                    trace_reflections: p.trace_reflections,
                }
            }
        }
    };
}
pub(super) use walk_parameters;

/// What a walk is told: the members of [`super::Optics`] that follow rays are such.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk {
    /// Surfaces at which light bends: 1, or two for each volume of liquid.
    pub refractions: u32,
    /// Total internal reflections followed.
    pub internal_reflections: u32,
    /// Reflectance.
    pub fresnel: Fresnel,
    /// Reflected rays followed in each pixel, in a density field.
    pub trace_reflections: u32,
}

impl Walk {
    /// The walk that optics stand for, if they are one.
    pub fn of(optics: &super::Optics) -> Option<Walk> {
        use super::Optics;
        match *optics {
            Optics::Four(p) => Some(p.into()),
            Optics::Many(p) => Some(p.into()),
            Optics::Two(p) => Some(p.into()),
            Optics::One(p) => Some(p.into()),
            _ => None,
        }
    }

    pub(super) fn record(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces) {
        let liquid = match (&surfaces.field, surfaces.tiles) {
            (Some(field), _) => Some(field_walk::draw(plan, scene, field, self.trace_reflections)),
            (None, Some(tiles)) => Some((tiles, self.maps(plan, scene, surfaces, &tiles))),
            (None, None) => None,
        };
        // A point at the view's border may reach into the tile before: liquid is drawn over what is seen past it.
        let mut draws = Vec::from_iter(tiles::past(plan, scene, liquid.as_ref().map(|(tiles, _)| tiles)));
        if let Some((_, (call, vertices))) = liquid {
            draws.push((self.light(plan, scene, call), vertices));
        }
        let output = plan.given(External::Output(scene.output));
        let mut rendering = Rendering::into(output, 0).keeping(scene.background == Background::Host);
        if scene.walks {
            for name in ["walk (debug)", "final direction (debug)"] {
                rendering = rendering.and(plan.flat(name, Format::R32G32B32A32_SFLOAT), 0);
            }
        }
        plan.render("walk", rendering, draws);
    }

    /// What becomes of light on the way, and what it brings back.
    fn light(&self, plan: &mut Plan, scene: &Scene, call: Call) -> Call {
        let call = environment::seen_by(plan, scene, call)
            .constant("ENCODE_SRGB", scene.encode_srgb())
            .constant("HOST_BACKGROUND", scene.background == Background::Host)
            .constant("REFRACTIONS", self.refractions)
            .constant("INTERNAL_REFLECTIONS", self.internal_reflections)
            .constant("EXACT_FRESNEL", self.fresnel == Fresnel::Exact);
        tiles::with_scene(plan, scene, call)
    }

    /// The walk through maps of depths.
    fn maps(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces, tiles: &Tiles) -> (Call, Vertices) {
        // Of a class without particles the shader does not look at its maps, but something has to be bound: the other
        // class's, or without any particles what no shader has written.
        let any = surfaces.body.or(surfaces.splash).unwrap_or_else(|| placeholder(plan));
        let (body, splash) = (surfaces.body.unwrap_or(any), surfaces.splash.unwrap_or(any));
        // One refraction looks at fronts alone.
        let walls = match self.refractions > 1 {
            true => walls::record(plan, surfaces, &body, &splash),
            false => plan.nothing("no walls", Format::R32G32B32A32_SFLOAT, false),
        };

        let (call, vertices) = tiles.draw(plan, scene, &WALK_FRAG[variant(scene)], false);
        let call = call
            .read("walls", walls)
            .read("body_depth", body.depth)
            .read("body_normal", body.normal)
            .read("splash_depth", splash.depth)
            .read("splash_normal", splash.normal)
            .constant("HAS_SPLASH", surfaces.splash.is_some())
            .constant("HAS_BODY", surfaces.body.is_some());
        (call, vertices)
    }
}

/// Which of a walk's shaders.
pub(super) fn variant(scene: &Scene) -> usize {
    let cube = environment::is_cube(scene);
    usize::from(scene.walks) + 2 * usize::from(scene.has_scene) + 4 * usize::from(cube)
}

/// Maps that nothing looks at.
pub(crate) fn placeholder(plan: &mut Plan) -> Surface {
    let depth = plan.nothing("no depth", Format::R32_SFLOAT, true);
    Surface { depth, normal: plan.nothing("no normal", Format::R32_UINT, true), sides: 1 }
}
