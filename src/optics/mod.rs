//! How light goes through the liquid's surfaces.

mod environment;
pub(crate) mod field_walk;
pub mod four;
pub mod instant_liquids;
pub(crate) mod lookup;
pub mod many;
pub mod one;
pub mod ssfr;
pub mod ssfr_index;
pub(crate) mod tiles;
pub mod two;
pub(crate) mod walk;
mod walls;

use crate::{
    layers::Surfaces,
    method::Offers,
    parameters::{choices, family},
    plan::Plan,
    scene::Scene,
};

family! {
    /// How light goes through the liquid's surfaces.
    pub enum Optics: Shading {
        Four(four) = "four",
        Two(two) = "two",
        One(one) = "one",
        Many(many) = "many",
        Ssfr(ssfr) = "ssfr",
        SsfrIndex(ssfr_index) = "ssfr-index",
        InstantLiquids(instant_liquids) = "instant-liquids",
    }
}

/// A member of the family.
pub(crate) trait Shading {
    /// What it asks of the layers.
    fn asks(&self) -> Offers {
        Offers::default()
    }
    /// Draws the picture.
    fn record(&self, plan: &mut Plan, scene: &Scene, surfaces: &Surfaces);
}

choices! {
    /// Reflectance of the water surface.
    pub enum Fresnel {
        /// Schlick's approximation (Imai16).
        #[default]
        Schlick = "schlick",
        /// Exact, for unpolarised light between dielectrics.
        Exact = "exact",
    }
}
