//! Twin of `glsl/smooth/binomial.comp` (Cords08 §2.2 and §3).

use super::Binomial;
use crate::{
    shader::Frame,
    smooth::twin::{Average, Map, Pixel, projected, reach},
};

/// What the filter can be told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Pixels to either side, in projected particle radii; at least 0. Cords08: 1.
    pub kernel: f32,
    /// Pixels to either side at most; 60 at most, where the last weight nears the least 32-bit number.
    pub reach: u32,
    /// Whether only pixels are drawn whose smoothed silhouette is 1; Cords08: yes.
    pub silhouette_map: bool,
}

impl From<&Binomial> for Parameters {
    fn from(p: &Binomial) -> Parameters {
        Parameters { kernel: p.kernel, reach: p.window / 2, silhouette_map: p.silhouette_map }
    }
}

/// Binomial coefficient B(n, k).
fn binomial_coefficient(n: i32, k: i32) -> f64 {
    (1..=k).map(|i| f64::from(n - k + i) / f64::from(i)).product()
}

/// One direction's kernel at every pixel with a surface: `sample(x, y)` is called with the offset and its weight over the
/// middle one's, and the error of that in 32 bits: a product and a division (3 ulp) for each pixel further out.
fn each_kernel(
    frame: &Frame,
    map: Map,
    p: &Parameters,
    result: impl Fn(i32, i32, f64, &[(i32, f64, f64)]) -> Pixel,
) -> Vec<Pixel> {
    map.each(|x, y, own| {
        let (near, other) = reach(projected(frame, p.kernel, own), p.reach);
        let with = |k: i32| {
            let middle = binomial_coefficient(2 * k, k);
            let kernel: Vec<_> =
                (-k..=k).map(|i| (i, binomial_coefficient(2 * k, k + i) / middle, 3.0 * f64::from(i.abs()))).collect();
            result(x, y, own, &kernel)
        };
        with(near).either(other.map(with))
    })
}

/// The row pass: depths, and what each pixel's silhouette lacks from 1.
pub fn across(frame: &Frame, depth: &[f32], p: &Parameters) -> (Vec<Pixel>, Vec<Pixel>) {
    let map = Map::new(frame, depth);
    let depths = each_kernel(frame, map, p, |x, y, own, kernel| {
        smoothed(own, kernel.iter().map(|(i, w, e)| (map.surface(x + i, y), *w, *e)))
    });
    let mut missing = each_kernel(frame, map, p, |x, y, _, kernel| {
        share(kernel.iter().filter_map(|(i, w, e)| map.at(x + i, y).map(|d| (f64::from(u8::from(d == 0.0)), *w, *e))))
    });
    // Pixels without a surface: there is liquid where the eye is inside it, and none elsewhere.
    for (m, d) in missing.iter_mut().zip(depth).filter(|(_, d)| **d <= 0.0) {
        *m = Pixel::kept(if *d == 0.0 { 1.0 } else { 0.0 });
    }
    (depths, missing)
}

/// The column pass, on what the row pass left (`missing`: of the silhouette).
pub fn down(frame: &Frame, depth: &[f32], missing: &[f32], p: &Parameters) -> Vec<Pixel> {
    let map = Map::new(frame, depth);
    let lack = Map::new(frame, missing);
    each_kernel(frame, map, p, |x, y, own, kernel| {
        let whole = kernel.iter().all(|(i, ..)| {
            map.at(x, y + i).is_none_or(|d| d != 0.0) && lack.at(x, y + i).is_none_or(|missing| missing == 0.0)
        });
        if p.silhouette_map && !whole {
            return Pixel::kept(0.0);
        }
        smoothed(own, kernel.iter().map(|(i, w, e)| (map.surface(x, y + i), *w, *e)))
    })
}

fn smoothed(own: f64, samples: impl Iterator<Item = (Option<f64>, f64, f64)>) -> Pixel {
    let mut average = Average::default();
    samples.for_each(|(d, w, e)| d.into_iter().for_each(|d| average.add(w, d - own, e)));
    average.result(own)
}

/// Weighted share of ones.
fn share(samples: impl Iterator<Item = (f64, f64, f64)>) -> Pixel {
    let mut average = Average::default();
    samples.for_each(|(one, w, e)| average.add(w, one, e));
    average.result(0.0)
}
