//! Screen-space refraction that knows the index of refraction (Im16 fig. 5).

use super::{
    Fresnel, Shading,
    lookup::{Lookup, Mode},
};
use crate::{layers::Surfaces, method::Offers, parameters::parameters, plan::Plan, scene::Scene};
use glam::Vec3;

parameters! {
    /// A look-up where the bent ray's direction vanishes; thin liquid bends less (Im16 fig. 5). Its line "refract(...).xy -
    /// E.z" would add 1 to both coordinates in the middle of the picture: what it must mean is the perspective division.
    pub struct SsfrIndex {
        /// What thickness is multiplied by in T = 1 - exp(-thickness); ours: the paper does not say in what unit its own is
        thickness_scale: f32 = 0.1, "1 / particle radius", "a finite value of at least 0"
            => |s| s.is_finite() && *s >= 0.0;
        /// Reflectance; ours: Im16 names Fresnel and no formula
        fresnel: Fresnel = Fresnel::Schlick, "", "schlick (Schlick's approximation) or exact" => |_| true;
    }
}

impl Shading for SsfrIndex {
    fn asks(&self) -> Offers {
        Offers { maps: true, thickness: true, ..Offers::default() }
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces) {
        Lookup::from(*self).record(plan, scene, surfaces);
    }
}

impl From<SsfrIndex> for Lookup {
    fn from(p: SsfrIndex) -> Lookup {
        Lookup {
            mode: Mode::Index,
            strength: 0.0,
            thickness_scale: p.thickness_scale,
            fresnel: p.fresnel,
            light: Vec3::ZERO,
            phong: [0.0; 3],
            half_resolution: false,
            spray: [0.0, 1.0],
        }
    }
}
