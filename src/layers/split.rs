//! Splashes apart from the body: four surfaces, two of each (Imai16 §4.2).

use super::{Layering, Surfaces, splat};
use crate::{frame::Scene, method::Offers, parameters::parameters, passes::Drawn, plan::Plan, shader};

parameters! {
    /// Splashes apart from the body: nearest front and farthest back of each (Imai16 §4.2).
    pub struct Split {}
}

impl Layering for Split {
    fn offers(&self) -> Offers {
        Offers { backs: true, normals: true }
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, drawn: &Drawn) -> Surfaces {
        let surface = |plan: &mut Plan, class, there: bool| there.then(|| splat::draw(plan, scene, drawn, class));
        Surfaces {
            splash: surface(plan, shader::CLASS_SPLASH, scene.splash),
            body: surface(plan, shader::CLASS_BODY, scene.body),
        }
    }
}
