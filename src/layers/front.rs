//! One surface, the nearest, and how much liquid lies behind it: what screen-space fluid rendering keeps (Cords08,
//! Green10).

#[cfg(feature = "inspect")]
pub mod twin;

use super::{
    Body, Kind, Layered, Layering, Mapping,
    splat::{classes, depth_test, particles, surface},
    split::BODY,
};
use crate::{
    method::Offers,
    parameters::parameters,
    passes::Drawn,
    plan::{Blend, Call, External, Plan, Rendering},
    scene::Scene,
    shader::{SIDE_FRONT, SPEED_FRAG, THICKNESS_FRAG},
};
use ash::vk::{CompareOp, Format};

parameters! {
    /// The nearest surface of all particles, and where the optics ask for it the thickness of all behind it (Green10)
    /// or how fast it is (Cords08).
    pub struct Front {}
}

impl Layering for Front {
    fn offers(&self) -> Offers {
        Offers { maps: true, normals: true, thickness: true, half: true, speeds: true, ..Offers::default() }
    }

    fn kind(&self) -> Kind<'_> {
        Kind::Maps(self)
    }
}

impl Mapping for Front {
    fn may_cull(&self, scene: &Scene) -> bool {
        // What is hidden counts for the thickness.
        !scene.asks().thickness
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, drawn: &Drawn) -> Layered {
        let all: Vec<u32> = classes(scene).collect();
        let body = surface(plan, scene, drawn, &all, 1, &BODY);
        let thickness = scene.asks().thickness.then(|| {
            let thickness = plan.flat("thickness", Format::R32_SFLOAT);
            let rendering = Rendering::into(thickness, 0).blending(Blend::Add, [0.0; 4]);
            let fragment = &THICKNESS_FRAG[usize::from(scene.has_scene)];
            let mut draws: Vec<(Call, _)> =
                all.iter().flat_map(|class| particles(scene, drawn, fragment, *class, SIDE_FRONT, None)).collect();
            if scene.has_scene {
                let depth = plan.given(External::SceneDepth);
                draws = draws.into_iter().map(|(call, v)| (call.read("scene_depth", depth), v)).collect();
            }
            plan.render("thickness", rendering, draws);
            thickness
        });
        let speed = scene.asks().speeds.then(|| {
            let speed = plan.flat("speed", Format::R32_SFLOAT);
            let test = depth_test(plan);
            let rendering = Rendering::into(speed, 0).testing(test, 0.0, CompareOp::GREATER);
            let speeds = Some(plan.given(External::Speeds));
            let draws = all.iter().flat_map(|c| particles(scene, drawn, &SPEED_FRAG, *c, SIDE_FRONT, speeds));
            plan.render("speed", rendering, draws.collect());
            speed
        });
        Layered { splash: None, body: Some(Body::from(body)), thickness, speed }
    }
}
