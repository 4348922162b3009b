//! Splashes apart from the body: four surfaces, two of each (Imai16 §4.2).

use super::{
    Body, Kind, Layered, Layering, Mapping,
    splat::{self, Names},
};
use crate::{
    method::Offers,
    parameters::parameters,
    passes::Drawn,
    plan::Plan,
    scene::Scene,
    shader::{CLASS_BODY, CLASS_SPLASH},
};

parameters! {
    /// Splashes apart from the body: nearest front and farthest back of each (Imai16 §4.2).
    pub struct Split {}
}

const SPLASH: Names = Names { depth: "splash depth", normal: "splash normal", passes: ["splash front", "splash back"] };
pub(super) const BODY: Names =
    Names { depth: "body depth (ray-cast)", normal: "body normal (ray-cast)", passes: ["body front", "body back"] };

impl Layering for Split {
    fn offers(&self) -> Offers {
        Offers { maps: true, backs: true, normals: true, ..Offers::default() }
    }

    fn kind(&self) -> Kind<'_> {
        Kind::Maps(self)
    }
}

impl Mapping for Split {
    fn may_cull(&self, _: &Scene) -> bool {
        true
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, drawn: &Drawn) -> Layered {
        let sides = scene.sides();
        let splash = scene.splash.then(|| match sides {
            1 => splat::surface(plan, scene, drawn, &[CLASS_SPLASH], 1, &SPLASH),
            _ => splat::balls(plan, scene, drawn, &SPLASH),
        });
        let body = scene.body.then(|| splat::surface(plan, scene, drawn, &[CLASS_BODY], sides, &BODY));
        Layered { splash, body: body.map(Body::from), thickness: None, speed: None }
    }
}
