//! Light bends at up to four surfaces.

use super::{
    Fresnel, Shading,
    walk::{Walk, walk_parameters},
};
use crate::{layers::Surfaces, method::Offers, parameters::parameters, plan::Plan, scene::Scene};

walk_parameters! {
    /// Up to four refractions, through two volumes of liquid (Imai16 §4.4), with total internal reflection.
    pub struct Four,
    refractions: |_| 4
}

impl Shading for Four {
    fn asks(&self) -> Offers {
        Offers { backs: true, beyond: self.trace_reflections > 0, ..Offers::default() }
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces) {
        Walk::from(*self).record(plan, scene, surfaces);
    }
}
