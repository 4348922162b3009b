//! Twin of `glsl/smooth/bilateral_separable.comp`.

use super::BilateralSeparable;
use crate::{
    shader::Frame,
    smooth::{
        bilateral::twin::{add, window},
        twin::{Average, Axis, Map, Pixel},
    },
};

/// As of the filter over a square window; Green10 prints no number.
pub type Parameters = crate::smooth::bilateral::twin::Parameters;

impl From<&BilateralSeparable> for Parameters {
    fn from(p: &BilateralSeparable) -> Parameters {
        let (sigma_space, sigma_depth) = (p.sigma_space, p.sigma_depth);
        Parameters { sigma_space, sigma_depth, reach: p.window / 2, projected: p.projected }
    }
}

/// One direction; an iteration is one along rows, then one along columns of what that gave.
pub fn bilateral_separable(frame: &Frame, depth: &[f32], p: &Parameters, axis: Axis) -> Vec<Pixel> {
    let map = Map::new(frame, depth);
    let (sx, sy) = axis.step();
    map.each(|x, y, own| {
        window(frame, p, own, |sigma, reach| {
            let mut average = Average::default();
            for k in -reach..=reach {
                if let Some(d) = map.surface(x + k * sx, y + k * sy) {
                    add(&mut average, f64::from(k * k), d - own, sigma, f64::from(p.sigma_depth));
                }
            }
            average.result(own)
        })
    })
}
