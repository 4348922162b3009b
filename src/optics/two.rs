//! Light bends at up to two surfaces.

use super::{
    Fresnel, Shading,
    walk::{Walk, walk_parameters},
};
use crate::{layers::Surfaces, method::Offers, parameters::parameters, plan::Plan, scene::Scene};

walk_parameters! {
    /// Up to two refractions, through one volume of liquid (Imai14), with total internal reflection.
    pub struct Two,
    refractions: |_| 2
}

impl Shading for Two {
    fn asks(&self) -> Offers {
        Offers { backs: true, beyond: self.trace_reflections > 0, ..Offers::default() }
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces) {
        Walk::from(*self).record(plan, scene, surfaces);
    }
}
