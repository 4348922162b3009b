//! Twin of `glsl/smooth/bilateral.comp`.

use super::Bilateral;
use crate::{
    shader::Frame,
    smooth::twin::{Average, Count, Map, Pixel, clipped, exp_ulp, projected, reach},
};

/// What the filter can be told; Imai16 §3.1 prints no number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Spread of the weights across the image: pixels, or particle radii if `projected`; more than 0.
    pub sigma_space: f32,
    /// Spread of the weights in depth, in particle radii; more than 0. Truong18 compares with a third of 10.
    pub sigma_depth: f32,
    /// The window is 2 `reach` + 1 pixels, or at most that if `projected`; 27 at most, or 64 along one axis.
    pub reach: u32,
    /// Whether `sigma_space` is a length at the pixel's depth; the window is then 3 of it.
    pub projected: bool,
}

impl From<&Bilateral> for Parameters {
    fn from(p: &Bilateral) -> Parameters {
        Parameters {
            sigma_space: p.sigma_space,
            sigma_depth: p.sigma_depth,
            reach: p.window / 2,
            projected: p.projected,
        }
    }
}

/// One iteration.
pub fn bilateral(frame: &Frame, depth: &[f32], p: &Parameters) -> Vec<Pixel> {
    let map = Map::new(frame, depth);
    map.each(|x, y, own| {
        window(frame, p, own, |sigma, reach| {
            let mut average = Average::default();
            for ny in y - reach..=y + reach {
                for nx in x - reach..=x + reach {
                    let Some(d) = map.surface(nx, ny) else { continue };
                    let square = f64::from((nx - x).pow(2) + (ny - y).pow(2));
                    add(&mut average, square, d - own, sigma, f64::from(p.sigma_depth));
                }
            }
            average.result(own)
        })
    })
}

/// What both bilateral filters count.
pub(crate) fn counted(frame: &Frame, depth: &[f32], p: &Parameters) -> Vec<(&'static str, Count)> {
    let clipped = if p.projected { clipped(frame, depth, 3.0 * p.sigma_space, p.reach) } else { Count::default() };
    vec![("bilateral_kernel_clipped", clipped)]
}

/// A pixel's result with the kernel that its depth gives it, or with either of two.
pub(crate) fn window(frame: &Frame, p: &Parameters, own: f64, result: impl Fn(f64, i32) -> Pixel) -> Pixel {
    if !p.projected {
        return result(f64::from(p.sigma_space), p.reach as i32);
    }
    let sigma = projected(frame, p.sigma_space, own);
    let (near, other) = reach(3.0 * sigma, p.reach);
    result(sigma, near).either(other.map(|r| result(sigma, r)))
}

/// One neighbour: exp(-|x|²/2σ_s²) exp(-Δd²/2σ_d²).
pub(crate) fn add(average: &mut Average, square: f64, rise: f64, sigma_space: f64, sigma_depth: f64) {
    let x = 0.5 * (square / sigma_space.powi(2) + (rise / sigma_depth).powi(2));
    // The argument: a sigma (4 ulp) squared and inverted, products and a sum.
    average.add((-x).exp(), rise, exp_ulp(x, 14.0));
}
