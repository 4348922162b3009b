//! What can be chosen, and its checks.

use super::PrepareError;
use super::neighbours::Search;
use crate::{
    Error, Parameters,
    parameters::{Value, choices, parameters},
    shader::ELLIPSOID_WIDE,
    space,
};

choices! {
    /// How ellipsoids are fitted to a body particle's neighbours.
    pub enum Fit {
        /// Around the particle itself, so that the liquid's surface stays where it is.
        #[default]
        InPlace = "in-place",
        /// Around the neighbours' mean (YuTurk13): liquid shrinks.
        YuTurk = "yu-turk",
    }
}

parameters! {
    []
    /// What can be chosen; the defaults suit SPH frames with a support of four radii.
    ///
    /// At rest spacing and the default support a lone particle has 0.32 of a filled body's density, a pair 0.40, a row or a
    /// triangle 0.478, a corner 0.61, a sheet one particle thin 0.70, an edge 0.72, a flat surface 0.85.
    pub struct Options {
        /// Smoothing radius h
        support: Option<f32> = None, "world units", "2 to 64 radii, or none for 4 radii"
            => |h| h.is_none_or(|h| h.is_finite() && h > 0.0);
        /// Particles with less than this share of a filled body's density are splash: τ (Imai16 §4.1)
        splash_threshold: f32 = 0.48, "", "a number" => |t| !t.is_nan();
        /// How a body particle's ellipsoid is fitted: in place, or as YuTurk13 has it, which shrinks the liquid
        ellipsoids: Fit = Fit::InPlace, "", "in-place or yu-turk" => |_| true;
        /// With yu-turk: how far a centre moves to its neighbours' mean, λ
        smoothing: f32 = 0.9, "", "0 to 1" => |s| (0.0..=1.0).contains(s);
        /// With yu-turk: largest ratio of two semi-axes, k_r
        max_ratio: f32 = 4.0, "", "1 to 1000" => |r| (1.0..=1e3).contains(r);
        /// With yu-turk: a body particle with this many neighbours or fewer stays a sphere
        min_neighbours: usize = 25, "", "0 to 1000000" => |n| *n <= 1_000_000;
        /// With yu-turk: longest semi-axis (Imai16 §4.2)
        max_semi_axis: f32 = 1.2, "particle radii", "0.01 to 100" => |a| (0.01..=100.0).contains(a);
        /// How neighbours are found; the result is the same
        search: Search = Search::Runs, "", "runs or relation (Im16's table)" => |_| true;
    }
}

impl Options {
    /// Longest semi-axis of a body particle, in particle radii.
    pub fn longest(&self) -> f32 {
        match self.ellipsoids {
            Fit::InPlace => ELLIPSOID_WIDE,
            Fit::YuTurk => self.max_semi_axis,
        }
    }

    /// From what share of a filled body's density on a shape differs from a splash's, where classes are kept below another
    /// share, if they are.
    pub(super) fn fade_from(&self, keep_class_below: Option<f32>) -> Result<f32, Error> {
        match keep_class_below {
            Some(k) if k.is_nan() => Err(Error::parameter("upper splash threshold", k, "use a number")),
            Some(k) => Ok(k.max(self.splash_threshold)),
            None => Ok(self.splash_threshold),
        }
    }
}

/// Lengths in world units.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    pub radius: f64,
    /// The density's support h.
    pub support: f64,
    /// Within what distance neighbours shape an ellipsoid.
    pub reach: f64,
}

impl Scale {
    /// Checks the radius and every option.
    pub fn new(radius: f32, options: &Options) -> Result<Self, PrepareError> {
        if !space::RADII.contains(&radius) {
            return Err(PrepareError::Radius(radius));
        }
        options.validate()?;
        let support = options.support.unwrap_or(4.0 * radius);
        if !(2.0..=64.0).contains(&(support / radius)) {
            return Err(Error::parameter("support", support.text(), "use 2 to 64 radii").into());
        }
        let (radius, support) = (f64::from(radius), f64::from(support));
        let reach = match options.ellipsoids {
            // Closer by lie too few to tell a shape.
            Fit::InPlace => support.max(4.0 * radius),
            Fit::YuTurk => 2.0 * support,
        };
        Ok(Self { radius, support, reach })
    }
}

impl From<Error> for PrepareError {
    fn from(e: Error) -> PrepareError {
        match e {
            Error::Parameter { parameter, value, remedy } => PrepareError::Option { name: parameter, value, remedy },
            other => PrepareError::Option { name: "options", value: String::new(), remedy: other.to_string() },
        }
    }
}
