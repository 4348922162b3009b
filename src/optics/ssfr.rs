//! Screen-space fluid rendering's refraction: a look-up moved by the normal (van der Laan et al.; Green10; Im16 fig. 4).

use super::{
    Fresnel, Shading,
    lookup::{Lookup, Mode},
};
use crate::{layers::Surfaces, method::Offers, parameters::parameters, plan::Plan, scene::Scene};
use glam::Vec3;

parameters! {
    /// A look-up moved by the surface's normal times T = 1 - exp(-thickness) (Im16 fig. 4).
    pub struct Ssfr {
        /// Offset where T is 1 and the normal lies across the view (Im16 fig. 4: 1)
        strength: f32 = 1.0, "picture edges", "a finite value of at least 0" => |s| s.is_finite() && *s >= 0.0;
        /// What thickness is multiplied by in T; ours: the papers do not say in what unit theirs is
        thickness_scale: f32 = 0.1, "1 / particle radius", "a finite value of at least 0"
            => |s| s.is_finite() && *s >= 0.0;
        /// Reflectance; ours: Im16 names Fresnel and no formula
        fresnel: Fresnel = Fresnel::Schlick, "", "schlick (Schlick's approximation) or exact" => |_| true;
    }
}

impl Shading for Ssfr {
    fn asks(&self) -> Offers {
        Offers { maps: true, thickness: true, ..Offers::default() }
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces) {
        Lookup::from(*self).record(plan, scene, surfaces);
    }
}

impl From<Ssfr> for Lookup {
    fn from(p: Ssfr) -> Lookup {
        Lookup {
            mode: Mode::Normal,
            strength: p.strength,
            thickness_scale: p.thickness_scale,
            fresnel: p.fresnel,
            light: Vec3::ZERO,
            phong: [0.0; 3],
            half_resolution: false,
            spray: [0.0, 1.0],
        }
    }
}
