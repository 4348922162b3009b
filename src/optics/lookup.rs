//! One refraction as a look-up in the picture behind the liquid (`glsl/optics/lookup.frag`): what screen-space fluid
//! rendering does in place of following rays.

#[cfg(feature = "inspect")]
pub mod twin;

use super::{Fresnel, Optics, environment};
use crate::{
    input::Background,
    layers::Surfaces,
    plan::{Call, External, Plan, Rendering, Vertices},
    scene::Scene,
    shader::{LOOKUP_BENT, LOOKUP_FRAG, LOOKUP_INDEX, LOOKUP_NORMAL, VIEW_VERT},
};
use glam::Vec3;

/// How the look-up is moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// By the normal, times a function of the thickness (Green10, Im16 fig. 4).
    Normal = LOOKUP_NORMAL as isize,
    /// To where the bent ray's direction vanishes, with an index that grows with the thickness (Im16 fig. 5).
    Index = LOOKUP_INDEX as isize,
    /// By the bent ray's lateral components (Cords08).
    Bent = LOOKUP_BENT as isize,
}

/// What a look-up is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lookup {
    /// How it is moved.
    pub mode: Mode,
    /// How far.
    pub strength: f32,
    /// Of T = 1 - exp(-scale thickness), over the particle radius.
    pub thickness_scale: f32,
    /// Reflectance.
    pub fresnel: Fresnel,
    /// Towards the light, in the world.
    pub light: Vec3,
    /// Fraction of white that is scattered, that is mirrored, and the exponent of that (Phong).
    pub phong: [f32; 3],
    /// Whether the surfaces are of half the picture's width and height, and upsampled.
    pub half_resolution: bool,
    /// Share of white, and the speed in world units a second at which and above which there is so much (Cords08 §4).
    pub spray: [f32; 2],
}

impl Lookup {
    /// The look-up that optics stand for, if they are one.
    pub fn of(optics: &Optics) -> Option<Lookup> {
        match *optics {
            Optics::Ssfr(p) => Some(p.into()),
            Optics::SsfrIndex(p) => Some(p.into()),
            Optics::InstantLiquids(p) => Some(p.into()),
            _ => None,
        }
    }

    /// Draws the picture; without liquid only what is behind it.
    pub(super) fn record(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces) {
        let body = surfaces.body.unwrap_or_else(|| super::walk::placeholder(plan));
        let (cube, thickness) = (environment::is_cube(scene), surfaces.thickness);
        let given = [scene.has_scene, cube, thickness.is_some(), surfaces.speed.is_some()];
        let variant = given.into_iter().enumerate().map(|(i, given)| usize::from(given) << i).sum::<usize>();
        let light = self.light.as_dvec3().normalize_or_zero().as_vec3();
        let light = scene.eye.transform_vector3(light);
        let [diffuse, specular, shininess] = self.phong;
        let [spray, spray_speed] = self.spray;
        let call = Call::draw(&VIEW_VERT, &LOOKUP_FRAG[variant])
            .read("body_depth", body.depth)
            .read("body_normal", body.normal)
            .constant("MODE", self.mode as u32)
            .constant("EXACT_FRESNEL", self.fresnel == Fresnel::Exact)
            .constant("ENCODE_SRGB", scene.encode_srgb())
            .constant("HOST_BACKGROUND", scene.background == Background::Host)
            .constant("HALF_RESOLUTION", self.half_resolution)
            // Positions of the picture that far off are still finite.
            .push("strength", self.strength.min(1e30))
            .push("thickness_scale", self.thickness_scale)
            .push("light_x", light.x)
            .push("light_y", light.y)
            .push("light_z", light.z)
            .push("diffuse", diffuse)
            .push("specular", specular)
            .push("shininess", shininess)
            .push("spray", spray)
            .push("spray_speed", spray_speed);
        let mut call = environment::seen_by(plan, scene, call);
        if let Some(thickness) = thickness {
            call = call.read("thickness", thickness);
        }
        if let Some(speed) = surfaces.speed {
            call = call.read("speed", speed);
        }
        if scene.has_scene {
            call = call
                .read("scene_color", plan.given(External::SceneColor))
                .read("scene_depth", plan.given(External::SceneDepth));
        }
        let output = plan.given(External::Output(scene.output));
        let rendering = Rendering::into(output, 0).keeping(scene.background == Background::Host);
        plan.render("look up", rendering, vec![(call, Vertices::Direct(3))]);
    }
}
