//! Light bends once, where it enters.

use super::{Fresnel, Shading, four::Four, walk::Walk};
use crate::{layers::Surfaces, parameters::parameters, plan::Plan, scene::Scene};

parameters! {
    /// One refraction, at the front; far sides are not even drawn.
    pub struct One {
        /// Reflectance
        fresnel: Fresnel = Fresnel::Schlick, "", "schlick (Schlick's approximation) or exact" => |_| true;
    }
}

impl Shading for One {
    fn record(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces) {
        Walk::from(*self).record(plan, scene, surfaces);
    }
}

impl From<One> for Walk {
    fn from(p: One) -> Walk {
        // Inside the body nothing is followed; what is said of that is the default, so that pipelines are shared.
        Walk { refractions: 1, fresnel: p.fresnel, ..Four::default().into() }
    }
}
