//! Instant Liquids (Cords08): one refraction as a look-up moved by the bent ray, reflections of the environment, Phong.

use super::{
    Fresnel, Shading,
    lookup::{Lookup, Mode},
};
use crate::{layers::Surfaces, method::Offers, parameters::parameters, plan::Plan, scene::Scene};
use glam::Vec3;

parameters! {
    /// A look-up moved by the bent ray's lateral components (Cords08 eqs. 6 to 8), reflections of the environment, Phong;
    /// the paper prints formulas and no numbers.
    pub struct InstantLiquids {
        /// Offset where the bent ray lies across the view, c_int of eq. (8); ours: the paper leaves it to the user
        strength: f32 = 0.1, "picture edges", "a finite value of at least 0" => |s| s.is_finite() && *s >= 0.0;
        /// Reflectance; the paper has the Fresnel equations
        fresnel: Fresnel = Fresnel::Exact, "", "schlick (Schlick's approximation) or exact" => |_| true;
        /// Direction towards the light; ours
        light: Vec3 = Vec3::new(0.4, 0.8, 0.4), "", "a finite direction that is not zero"
            => |l| l.is_finite() && *l != Vec3::ZERO;
        /// Fraction of the light that is scattered; ours
        diffuse: f32 = 0.0, "", "0 to 1" => |d| (0.0..=1.0).contains(d);
        /// Brightness of the light's mirror image; ours
        specular: f32 = 0.5, "", "a finite value of at least 0" => |s| s.is_finite() && *s >= 0.0;
        /// Exponent of the mirror image: the larger, the smaller that is; ours
        shininess: f32 = 64.0, "", "1 to 10000" => |s| (1.0..=10000.0).contains(s);
        /// Whether the surface is drawn and smoothed at half the picture's width and height, and upsampled (Cords08 section 5)
        half_resolution: bool = false, "", "true or false" => |_| true;
        /// Spray: fraction of white where the liquid is as fast as spray_speed; above 0 the particles need velocities. Ours: the
        /// paper shows it in a figure and gives no formula
        spray: f32 = 0.0, "", "0 to 1" => |s| (0.0..=1.0).contains(s);
        /// Speed at which spray is whitest; ours
        spray_speed: f32 = 1.0, "world units / second", "a finite value above 0" => |s| s.is_finite() && *s > 0.0;
    }
}

impl Shading for InstantLiquids {
    fn asks(&self) -> Offers {
        Offers { maps: true, half: self.half_resolution, speeds: self.spray > 0.0, ..Offers::default() }
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces) {
        Lookup::from(*self).record(plan, scene, surfaces);
    }
}

impl From<InstantLiquids> for Lookup {
    fn from(p: InstantLiquids) -> Lookup {
        Lookup {
            mode: Mode::Bent,
            strength: p.strength,
            thickness_scale: 0.0,
            fresnel: p.fresnel,
            light: p.light,
            phong: [p.diffuse, p.specular, p.shininess],
            half_resolution: p.half_resolution,
            spray: [p.spray, p.spray_speed],
        }
    }
}
