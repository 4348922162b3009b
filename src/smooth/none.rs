//! No smoothing: the body stays as its particles' surfaces are.

use super::Filter;
use crate::{
    layers::Body,
    method::Offers,
    parameters::parameters,
    plan::{Plan, Target},
};

parameters! {
    /// The body as its particles' surfaces are.
    pub struct Unsmoothed {}
}

impl Filter for Unsmoothed {
    fn asks(&self) -> Offers {
        Offers::default()
    }

    fn record(&self, _: &mut Plan, body: &Body) -> Target {
        body.depth
    }

    #[cfg(feature = "inspect")]
    fn steps(&self) -> u32 {
        0
    }

    #[cfg(feature = "inspect")]
    fn twin(&self, _: u32, input: &super::twin::Input) -> super::twin::Smoothed {
        let pixels = input.depth.iter().map(|d| super::twin::Pixel::kept(*d)).collect();
        super::twin::Smoothed::new(pixels, Vec::new())
    }
}
