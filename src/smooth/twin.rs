//! What the twins of all smoothing filters share: the result of a pixel with what rounding may do to it, the map as
//! filters read it, and averages of depths.

use crate::shader::Frame;

/// What one step of a filter reads, of one side of the body.
#[derive(Clone, Copy)]
pub struct Input<'a> {
    /// The block that shaders read.
    pub frame: &'a Frame,
    /// Depths before the step, row by row, in particle radii.
    pub depth: &'a [f32],
    /// Normals of the particles (`glsl/include/normal.glsl`); empty where the layers have none.
    pub normal: &'a [u32],
    /// What the step before left beside the depths, if it does; else empty.
    pub beside: &'a [f32],
}

/// What one step of a filter makes of one side of the body.
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothed {
    /// Depths.
    pub pixels: Vec<Pixel>,
    /// What it counts, by the counters' names: each of them.
    pub counted: Vec<(&'static str, Count)>,
    /// What it leaves beside the depths for the next step; empty if nothing.
    pub beside: Vec<Pixel>,
}

impl Smoothed {
    /// Nothing but depths, and what is counted.
    pub(crate) fn new(pixels: Vec<Pixel>, counted: Vec<(&'static str, Count)>) -> Smoothed {
        Smoothed { pixels, counted, beside: Vec::new() }
    }
}

/// At how many pixels a guard fires.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// At least.
    pub least: u32,
    /// At most, where rounding decides.
    pub most: u32,
}

impl Count {
    /// One pixel more, at which it fires, or may fire.
    pub fn add(&mut self, fires: bool, close: bool) {
        self.least += u32::from(fires && !close);
        self.most += u32::from(fires || close);
    }
}

/// One pixel after a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// The depth.
    pub depth: f64,
    /// How far from it the 32-bit result may lie.
    pub slack: f64,
    /// The other result, where rounding may decide a branch.
    pub or: Option<f64>,
}

impl Pixel {
    /// A depth that is passed through bit by bit.
    pub fn kept(depth: f32) -> Pixel {
        Pixel { depth: f64::from(depth), slack: 0.0, or: None }
    }

    /// Whether a 32-bit result is one that it may be.
    pub fn admits(&self, result: f32) -> bool {
        let near = |d: f64| (f64::from(result) - d).abs() <= self.slack;
        near(self.depth) || self.or.is_some_and(near)
    }

    /// One result where two are possible.
    pub(crate) fn either(self, other: Option<Pixel>) -> Pixel {
        match other {
            Some(other) => Pixel { slack: self.slack.max(other.slack), or: Some(other.depth), ..self },
            None => self,
        }
    }
}

/// Axis of one direction of a separable filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Axis {
    /// Along rows.
    X = 0,
    /// Along columns.
    Y = 1,
}

impl Axis {
    /// Rows for 0, columns for 1.
    pub fn of(index: u32) -> Axis {
        if index == 0 { Axis::X } else { Axis::Y }
    }

    /// One pixel along it.
    pub fn step(self) -> (i32, i32) {
        match self {
            Axis::X => (1, 0),
            Axis::Y => (0, 1),
        }
    }
}

/// A depth map as filters read it.
#[derive(Clone, Copy)]
pub struct Map<'a> {
    /// Width and height.
    pub size: (i32, i32),
    /// Depths, row by row.
    pub depth: &'a [f32],
}

impl<'a> Map<'a> {
    /// Of this frame's size.
    pub fn new(frame: &Frame, depth: &'a [f32]) -> Map<'a> {
        let size = (frame.size.x as i32, frame.size.y as i32);
        assert_eq!(depth.len(), (size.0 * size.1) as usize, "one depth a pixel");
        Map { size, depth }
    }

    /// What the map holds there; `None` outside.
    pub fn at(&self, x: i32, y: i32) -> Option<f32> {
        let inside = (0..self.size.0).contains(&x) && (0..self.size.1).contains(&y);
        inside.then(|| self.depth[(y * self.size.0 + x) as usize])
    }

    /// The surface there, if there is one.
    pub fn surface(&self, x: i32, y: i32) -> Option<f64> {
        self.at(x, y).filter(|d| *d > 0.0).map(f64::from)
    }

    /// A result for each pixel with a surface; the others are kept.
    pub fn each(&self, mut f: impl FnMut(i32, i32, f64) -> Pixel) -> Vec<Pixel> {
        let mut all = Vec::with_capacity(self.depth.len());
        for y in 0..self.size.1 {
            for x in 0..self.size.0 {
                all.push(match self.surface(x, y) {
                    Some(own) => f(x, y, own),
                    None => Pixel::kept(self.depth[(y * self.size.0 + x) as usize]),
                });
            }
        }
        all
    }
}

/// Pixels that a length at this depth covers, seen across the view axis.
pub fn projected(frame: &Frame, length: f32, depth: f64) -> f64 {
    f64::from(length) * f64::from(frame.pixel_scale.y).abs() / depth
}

/// Whole pixels that hold a kernel of so many, `most` at most; a second number where 32 bits may round to that. What
/// is wanted is a product and a quotient: 4 ulp, with the 2.5 that Vulkan allows a division.
pub fn reach(wanted: f64, most: u32) -> (i32, Option<i32>) {
    let whole = |w: f64| w.ceil().min(f64::from(most)) as i32;
    let slack = 4.0 * f64::from(f32::EPSILON) * wanted;
    let (low, own, high) = (whole(wanted - slack), whole(wanted), whole(wanted + slack));
    (own, [low, high].into_iter().find(|r| *r != own))
}

/// Pixels with a surface at which a kernel of this length needs more than `most` pixels to either side; see [`reach`].
pub fn clipped(frame: &Frame, depth: &[f32], length: f32, most: u32) -> Count {
    let mut count = Count::default();
    for own in depth.iter().filter(|d| **d > 0.0) {
        let wanted = projected(frame, length, f64::from(*own));
        let beyond = wanted - f64::from(most);
        count.add(beyond > 0.0, beyond.abs() <= 4.0 * f64::from(f32::EPSILON) * wanted);
    }
    count
}

/// A weighted average of rises above a pixel's own depth, and what 32 bits do to it.
#[derive(Default)]
pub struct Average {
    /// Weight, rise, error of the weight in ulp.
    terms: Vec<(f64, f64, f64)>,
}

impl Average {
    /// One neighbour.
    pub fn add(&mut self, weight: f64, rise: f64, ulp: f64) {
        self.terms.push((weight, rise, ulp));
    }

    /// Own depth plus the average. A step (ulp) is 2^-23 of a value at most. Each weight's error moves the average by
    /// its share of the distance from it; each rise, product and partial sum is rounded by half a step; the division may
    /// be off by 2.5; the last sum, which is what the image stores, by half a step of the depth.
    pub fn result(&self, own: f64) -> Pixel {
        let total: f64 = self.terms.iter().map(|t| t.0).sum();
        let mean = self.terms.iter().map(|t| t.0 * t.1).sum::<f64>() / total;
        let size = self.terms.iter().map(|t| t.0 * t.1.abs()).sum::<f64>() / total;
        let weights = self.terms.iter().map(|t| t.0 * t.2 * (t.1 - mean).abs()).sum::<f64>() / total;
        let depth = own + mean;
        let half = 0.5 * self.terms.len() as f64;
        let steps = 0.5 * depth.abs() + weights + (half + 1.0) * size + (half + 2.5) * mean.abs();
        Pixel { depth, slack: f64::from(f32::EPSILON) * steps, or: None }
    }
}

/// Error of exp(-x) in 32 bits, in ulp: 3 + 2 x by Vulkan's rules, and x times the error of x (in ulp).
pub fn exp_ulp(x: f64, argument: f64) -> f64 {
    3.0 + 2.0 * x + argument * x
}
