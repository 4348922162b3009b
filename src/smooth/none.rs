//! No smoothing: the body stays as its particles' surfaces are.

use super::Filter;
use crate::{
    layers::Body,
    parameters::parameters,
    plan::{Plan, Target},
};

parameters! {
    /// The body as its particles' surfaces are.
    pub struct Unsmoothed {}
}

impl Filter for Unsmoothed {
    fn record(&self, _: &mut Plan, body: &Body) -> Target {
        body.depth
    }
}
