//! The nearest and the farthest surface of all particles together (Imai14, as Imai16 §3 has it): dual depth peeling, which
//! for two layers is one pass that keeps the largest of (-d, d).

#[cfg(feature = "inspect")]
pub mod twin;

use super::{
    Body, Kind, Layered, Layering, Mapping,
    splat::{classes, particles},
};
use crate::{
    method::Offers,
    parameters::parameters,
    passes::Drawn,
    plan::{Blend, Call, Groups, Plan, Rendering},
    scene::Scene,
    shader::{EXTREMES_COMP, EXTREMES_FRAG, IMAGE_GROUP, SIDE_FRONT},
};
use ash::vk::Format;

parameters! {
    /// Nearest and farthest surface of all particles together, without normals (Imai14).
    pub struct NearestFarthest {}
}

impl Layering for NearestFarthest {
    fn offers(&self) -> Offers {
        Offers { maps: true, backs: true, ..Offers::default() }
    }

    fn kind(&self) -> Kind<'_> {
        Kind::Maps(self)
    }
}

impl Mapping for NearestFarthest {
    fn may_cull(&self, _: &Scene) -> bool {
        // A particle is drawn once for both sides, so one that shows on either has to be there.
        false
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, drawn: &Drawn) -> Layered {
        let peeled = plan.flat("nearest and farthest depth", Format::R32G32_SFLOAT);
        let rendering = Rendering::into(peeled, 0).blending(Blend::Largest, [f32::NEG_INFINITY, 0.0, 0.0, 0.0]);
        let draws = classes(scene).flat_map(|class| particles(scene, drawn, &EXTREMES_FRAG, class, SIDE_FRONT, None));
        plan.render("nearest and farthest", rendering, draws.collect());
        let sides = scene.sides();
        let depth = plan.map("body depth (ray-cast)", Format::R32_SFLOAT, sides);
        let call = Call::compute(&EXTREMES_COMP).read("peeled", peeled).write("depth_out", depth);
        let [width, height] = plan.size().map(|s| s.div_ceil(IMAGE_GROUP));
        plan.dispatch("sides", call, Groups::Direct([width, height, sides]));
        Layered { splash: None, body: Some(Body { depth, normal: None, sides }), thickness: None, speed: None }
    }
}
