//! What can be chosen, and its checks.

use super::PrepareError;
use super::neighbours::Search;
use crate::space;

/// What can be chosen; the defaults suit SPH frames with a support of four radii.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Smoothing radius h in world units, 2 to 64 radii; 4 radii if `None`.
    pub support: Option<f32>,
    /// τ: a particle of lower ρ/ρ0 is a splash (Imai16 §4.1). At rest spacing and the default
    /// support a lone particle has 0.32, a pair 0.40, a row or a triangle 0.478, a corner 0.61, a
    /// sheet one particle thin 0.70, an edge 0.72, a flat surface 0.85.
    pub splash_threshold: f32,
    /// λ: how far a centre moves to its neighbours' mean, 0 to 1 (YuTurk13).
    pub smoothing: f32,
    /// k_r: the largest ratio of two semi-axes, at least 1 (YuTurk13).
    pub max_ratio: f32,
    /// A body particle with this many neighbours or fewer stays a sphere (YuTurk13).
    pub min_neighbours: usize,
    /// Longest semi-axis, in particle radii (Imai16 §4.2).
    pub max_semi_axis: f32,
    /// How neighbours are found; the result is the same.
    pub search: Search,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            support: None,
            splash_threshold: 0.48,
            smoothing: 0.9,
            max_ratio: 4.0,
            min_neighbours: 25,
            max_semi_axis: 1.2,
            search: Search::Runs,
        }
    }
}

/// Radius and support h, in world units.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    pub radius: f64,
    pub support: f64,
}

impl Scale {
    /// Checks the radius and every option.
    pub fn new(radius: f32, options: &Options) -> Result<Self, PrepareError> {
        if !space::RADII.contains(&radius) {
            return Err(PrepareError::Radius(radius));
        }
        let support = options.support.unwrap_or(4.0 * radius);
        let check = |valid, name, value, must| {
            if valid { Ok(()) } else { Err(PrepareError::Option { name, value, must }) }
        };
        let Options { splash_threshold, smoothing, max_ratio, max_semi_axis, .. } = *options;
        let relative = support / radius;
        check((2.0..=64.0).contains(&relative), "support", support, "2 to 64 radii")?;
        check(!splash_threshold.is_nan(), "splash_threshold", splash_threshold, "a number")?;
        check((0.0..=1.0).contains(&smoothing), "smoothing", smoothing, "0 to 1")?;
        check((1.0..=1e3).contains(&max_ratio), "max_ratio", max_ratio, "1 to 1000")?;
        let long = (0.01..=100.0).contains(&max_semi_axis);
        check(long, "max_semi_axis", max_semi_axis, "0.01 to 100 radii")?;
        Ok(Self { radius: f64::from(radius), support: f64::from(support) })
    }

    /// Within what distance neighbours shape an ellipsoid (YuTurk13: 2 h).
    pub fn reach(self) -> f64 {
        2.0 * self.support
    }
}
