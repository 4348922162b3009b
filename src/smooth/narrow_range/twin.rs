//! Twin of `glsl/smooth/narrow_range.comp` (Truong18).

use super::NarrowRange;
use crate::{
    shader::Frame,
    smooth::twin::{Average, Axis, Map, Pixel, exp_ulp, projected, reach},
};

/// What the filter can be told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Pixels to either side, as a length in particle radii at the pixel's depth; at least 0. Three sigma. Truong18's demo
    /// program: 0.5.
    pub kernel: f32,
    /// δ: how far beyond what is already in range a depth may lie, in particle radii; more than 0. Truong18: 10.
    pub threshold: f32,
    /// μ: how far behind the pixel what is too far counts, in particle radii; at least 0. Truong18: 1.
    pub clamp: f32,
    /// Pixels to either side at most. Truong18's own program: 100.
    pub reach: u32,
    /// Whether the kernel is `reach` pixels at any depth. Truong18's clean-up: so, with 4.
    pub fixed: bool,
    /// Whether no surface counts as too far (Truong18) or for nothing.
    pub empty_far: bool,
}

impl From<&NarrowRange> for Parameters {
    fn from(p: &NarrowRange) -> Parameters {
        Parameters {
            kernel: p.kernel,
            threshold: p.threshold,
            clamp: p.clamp,
            reach: p.window / 2,
            fixed: false,
            empty_far: p.empty_far,
        }
    }
}

impl Parameters {
    /// The clean-up that ends the two directions' turns.
    pub fn clean_up(self) -> Parameters {
        Parameters { reach: 4, fixed: true, ..self }
    }
}

/// What a neighbour is to a pixel.
#[derive(Clone, Copy, PartialEq)]
enum Sample {
    /// Nothing there, or nothing that counts.
    Nothing,
    /// Too near: it and its opposite are left out.
    Near,
    /// Too far: clamped.
    Far,
    /// In range, at this depth.
    Within(f32),
}

/// Depths that are in range. In 32 bits: a sum is rounded alike everywhere, so that both sides take the same branch.
#[derive(Clone, Copy)]
struct Range {
    low: f32,
    high: f32,
}

impl Range {
    fn around(depth: f32, threshold: f32) -> Range {
        Range { low: depth - threshold, high: depth + threshold }
    }

    fn judge(self, depth: Option<f32>, p: &Parameters) -> Sample {
        match depth {
            Some(0.0) if p.empty_far => Sample::Far,
            Some(d) if d > 0.0 && d < self.low => Sample::Near,
            Some(d) if d > 0.0 && d > self.high => Sample::Far,
            Some(d) if d > 0.0 => Sample::Within(d),
            _ => Sample::Nothing,
        }
    }

    fn widened(self, sample: Sample, p: &Parameters) -> Range {
        match sample {
            Sample::Within(d) => {
                let new = Range::around(d, p.threshold);
                Range { low: self.low.min(new.low), high: self.high.max(new.high) }
            }
            _ => self,
        }
    }
}

/// The filter over a square window.
pub fn narrow_range(frame: &Frame, depth: &[f32], p: &Parameters) -> Vec<Pixel> {
    let map = Map::new(frame, depth);
    each_kernel(frame, map, p, |x, y, own, reach| {
        let mut average = Average::default();
        average.add(1.0, 0.0, 0.0);
        let mut range = Range::around(own as f32, p.threshold);
        for ring in 1..=reach {
            let mut wider = range;
            for dy in -ring..=ring {
                for dx in -ring..=ring {
                    if dx.abs().max(dy.abs()) != ring {
                        continue;
                    }
                    let [here, opposite] = [(dx, dy), (-dx, -dy)].map(|(i, j)| range.judge(map.at(x + i, y + j), p));
                    wider = wider.widened(here, p);
                    if opposite != Sample::Near {
                        add(&mut average, here, own, f64::from(dx * dx + dy * dy), reach, p);
                    }
                }
            }
            range = wider;
        }
        average.result(own)
    })
}

/// One direction of the separated filter.
pub fn narrow_range_along(frame: &Frame, depth: &[f32], p: &Parameters, axis: Axis) -> Vec<Pixel> {
    let map = Map::new(frame, depth);
    let (sx, sy) = axis.step();
    each_kernel(frame, map, p, |x, y, own, reach| {
        let mut average = Average::default();
        average.add(1.0, 0.0, 0.0);
        let mut ranges = [Range::around(own as f32, p.threshold); 2];
        for k in 1..=reach {
            let samples = [0, 1].map(|side| {
                let i = if side == 0 { -k } else { k };
                ranges[side].judge(map.at(x + i * sx, y + i * sy), p)
            });
            for (range, sample) in ranges.iter_mut().zip(samples) {
                *range = range.widened(sample, p);
            }
            if !samples.contains(&Sample::Near) {
                samples.into_iter().for_each(|s| add(&mut average, s, own, f64::from(k * k), reach, p));
            }
        }
        average.result(own)
    })
}

/// Gauss with sigma a third of the reach.
fn add(average: &mut Average, sample: Sample, own: f64, square: f64, reach: i32, p: &Parameters) {
    let rise = match sample {
        Sample::Within(d) => f64::from(d) - own,
        Sample::Far => f64::from(p.clamp),
        Sample::Near | Sample::Nothing => return,
    };
    let sigma = f64::from(reach) / 3.0;
    let x = square / (2.0 * sigma * sigma);
    average.add((-x).exp(), rise, exp_ulp(x, 4.0));
}

fn each_kernel(frame: &Frame, map: Map, p: &Parameters, result: impl Fn(i32, i32, f64, i32) -> Pixel) -> Vec<Pixel> {
    map.each(|x, y, own| {
        if p.fixed {
            return result(x, y, own, p.reach as i32);
        }
        let (near, other) = reach(projected(frame, p.kernel, own), p.reach);
        result(x, y, own, near).either(other.map(|r| result(x, y, own, r)))
    })
}
