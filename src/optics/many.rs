//! Light bends at as many surfaces as there are.

use super::{
    Fresnel, Shading,
    walk::{Walk, walk_parameters},
};
use crate::{layers::Surfaces, method::Offers, parameters::parameters, plan::Plan, scene::Scene};

walk_parameters! {
    /// Refractions through many volumes of liquid, in a density field alone: maps of depths know two.
    pub struct Many {
        /// Volumes of liquid that a ray goes through at most; it is refracted twice in each
        volumes: u32 = 8, "", "1 to 32" => |n| (1..=32).contains(n);
    },
    refractions: |p| 2 * p.volumes
}

impl Shading for Many {
    fn asks(&self) -> Offers {
        Offers { beyond: true, ..Offers::default() }
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces) {
        Walk::from(*self).record(plan, scene, surfaces);
    }
}
