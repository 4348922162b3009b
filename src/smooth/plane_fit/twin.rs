//! Twin of `glsl/smooth/plane_fit.comp`: one iteration of plane fitting (Imai16 §4.3) on one layer of the body.
//!
//! The shader measures everything from the pixel's own point so that nothing large cancels in 32 bits; here the
//! formulas stand as printed, in 64 bits, on eye-space points.

use super::{PlaneFit, Weighting};
use crate::{
    shader::{FIT_GRAZING_LIMIT, FIT_UPDATE_LIMIT, Frame},
    smooth::twin::{Count, Input, Pixel, Smoothed, clipped, projected, reach},
    twin::normal::decode_normal,
};
use glam::{DVec2, DVec3};

/// What a window's plane is, and eq. (5) makes of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// |Σ w ñ| / Σ w: 1 where all normals agree, 0 where they cancel.
    pub agreement: f64,
    /// |n·v|, both unit vectors: the divisor of eq. (5).
    pub facing: f64,
    /// Depth at which the view ray meets the plane.
    pub depth: f64,
}

/// What became of a pixel's depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// No surface to fit (0: none, negative: behind the near plane); passed through.
    Passed,
    /// On its plane now.
    Fitted,
    /// Kept: the normals of the window cancel.
    ZeroNormal,
    /// Kept: the view ray runs along the plane.
    Grazing,
    /// The plane is further off than a depth is moved, or that would be before the near plane: kept then.
    Unbounded,
}

/// One iteration's result, pixel by pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Depths after it.
    pub depth: Vec<f32>,
    /// What became of each.
    pub outcome: Vec<Outcome>,
    /// The planes; `None` where there was nothing to fit.
    pub plane: Vec<Option<Plane>>,
    /// The planes of windows a pixel larger or smaller, where 32 bits may round to those.
    pub other: Vec<Option<Plane>>,
}

impl Fit {
    /// How many pixels ended so.
    pub fn count(&self, outcome: Outcome) -> u32 {
        self.outcome.iter().filter(|o| **o == outcome).count() as u32
    }
}

/// Below this agreement the sum of normals has no direction.
pub const LEAST_AGREEMENT: f64 = 1e-6;

/// Fits every pixel of one layer; `depth` and `normal` (packed, unsmoothed) row by row.
pub fn plane_fit(frame: &Frame, depth: &[f32], normal: &[u32], p: &PlaneFit) -> Fit {
    let (width, height) = (frame.size.x as i32, frame.size.y as i32);
    let sigma = f64::from(p.sigma);
    let index = |x: i32, y: i32| (y * width + x) as usize;
    let points: Vec<DVec3> = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| view_ray(frame, x, y) * f64::from(depth[index(x, y)]))
        .collect();
    let normals: Vec<DVec3> = normal.iter().map(|n| decode_normal(*n).as_dvec3()).collect();

    let plane_of = |x: i32, y: i32, reach: i32| {
        let mut normal_sum = DVec3::ZERO;
        let mut point_sum = DVec3::ZERO;
        let mut total = 0.0;
        for ny in (y - reach).max(0)..=(y + reach).min(height - 1) {
            for nx in (x - reach).max(0)..=(x + reach).min(width - 1) {
                let j = index(nx, ny);
                if depth[j] <= 0.0 {
                    continue;
                }
                let apart = points[j] - points[index(x, y)];
                let square = match p.weighting {
                    Weighting::ViewDependent => apart.z * apart.z,
                    Weighting::Euclidean => apart.length_squared(),
                };
                let w = (-square / (sigma * sigma)).exp(); // eq. (2)
                normal_sum += w * normals[j];
                point_sum += w * points[j];
                total += w;
            }
        }
        let n = normal_sum.normalize_or_zero(); // eq. (3)
        let d = n.dot(point_sum / total); // eq. (4)
        let v = view_ray(frame, x, y).normalize();
        let z = d * v.z / n.dot(v); // eq. (5)
        Plane { agreement: normal_sum.length() / total, facing: n.dot(v).abs(), depth: -z }
    };

    let mut fit = Fit {
        depth: depth.to_vec(),
        outcome: vec![Outcome::Passed; depth.len()],
        plane: vec![None; depth.len()],
        other: vec![None; depth.len()],
    };
    for y in 0..height {
        for x in 0..width {
            let i = index(x, y);
            if depth[i] <= 0.0 {
                continue;
            }
            let (own, other) = half_window(frame, p, depth[i]);
            let plane = plane_of(x, y, own);
            fit.other[i] = other.map(|reach| plane_of(x, y, reach));
            fit.outcome[i] = judge(frame, p, depth[i], &plane);
            fit.plane[i] = Some(plane);
            if matches!(fit.outcome[i], Outcome::Fitted | Outcome::Unbounded) {
                fit.depth[i] = moved(frame, p, depth[i], &plane) as f32;
            }
        }
    }
    fit
}

/// Pixels to either side of a pixel that its window holds; and how many else, where rounding may decide.
fn half_window(frame: &Frame, p: &PlaneFit, own: f32) -> (i32, Option<i32>) {
    if p.projected {
        reach(projected(frame, 0.5 * p.width, f64::from(own)), p.window / 2)
    } else {
        (p.window as i32 / 2, None)
    }
}

/// Where a depth goes that eq. (5) moves.
pub fn moved(frame: &Frame, p: &PlaneFit, own: f32, plane: &Plane) -> f64 {
    let to = cut(p, own, plane);
    if to < f64::from(frame.near) { f64::from(own) } else { to }
}

/// The plane's depth, or as far towards it as a depth is moved.
fn cut(p: &PlaneFit, own: f32, plane: &Plane) -> f64 {
    let (own, limit) = (f64::from(own), f64::from(FIT_UPDATE_LIMIT * p.sigma));
    own + (plane.depth - own).clamp(-limit, limit)
}

/// Whether eq. (5) can be trusted; docs/methods.md says where it fails.
fn judge(frame: &Frame, p: &PlaneFit, own: f32, plane: &Plane) -> Outcome {
    let update = (plane.depth - f64::from(own)).abs();
    if plane.agreement < LEAST_AGREEMENT {
        Outcome::ZeroNormal
    } else if plane.facing < f64::from(FIT_GRAZING_LIMIT) {
        Outcome::Grazing
    } else if update > f64::from(FIT_UPDATE_LIMIT * p.sigma) || cut(p, own, plane) < f64::from(frame.near) {
        Outcome::Unbounded
    } else {
        Outcome::Fitted
    }
}

/// Direction v = (vx, vy, -1) of the view ray through a pixel's centre: its point at depth d is v d.
pub fn view_ray(frame: &Frame, x: i32, y: i32) -> DVec3 {
    let center = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
    ((center - frame.pixel_origin.as_dvec2()) / frame.pixel_scale.as_dvec2()).extend(-1.0)
}

/// Error of eq. (5) in 32 bits. Storage rounds by half a step of the depth. The fraction is one of sums whose terms (up
/// to the depth itself sideways; weights leave about sigma of rise) are rounded to a step or two of the largest, weights to a few of their own; what
/// it is divided by is n.v times the length of the sum of normals.
pub fn rounding(p: &PlaneFit, own: f32, plane: &Plane) -> f64 {
    let [own, sigma] = [own, p.sigma].map(f64::from);
    let magnitude = own + (plane.depth - own).abs() + sigma;
    f64::from(f32::EPSILON) * magnitude * (0.5 + 3.0 / (plane.facing * plane.agreement))
}

/// Whether rounding decides if a guard fires.
pub fn is_close(p: &PlaneFit, frame: &Frame, own: f32, plane: &Plane) -> bool {
    let limits = [FIT_UPDATE_LIMIT * p.sigma, FIT_GRAZING_LIMIT, frame.near];
    let [limit, grazing, near] = limits.map(f64::from);
    if (plane.agreement - LEAST_AGREEMENT).abs() < 5e-7 {
        return true;
    }
    if plane.agreement < LEAST_AGREEMENT {
        return false;
    }
    if (plane.facing - grazing).abs() < 1e-6 / plane.agreement {
        return true;
    }
    let slack = rounding(p, own, plane);
    let update = (plane.depth - f64::from(own)).abs();
    plane.facing > grazing && ((update - limit).abs() < slack || (cut(p, own, plane) - near).abs() < slack)
}

/// The same as every filter's twin gives it: where rounding decides whether a guard fires, a pixel is where it was or on
/// its plane.
pub(super) fn smoothed(p: &PlaneFit, input: &Input) -> Smoothed {
    let fit = plane_fit(input.frame, input.depth, input.normal, p);
    let pixel = |(i, plane): (usize, &Option<Plane>)| {
        let own = input.depth[i];
        let Some(plane) = plane else { return Pixel::kept(own) };
        let on_plane = Pixel { depth: moved(input.frame, p, own, plane), slack: rounding(p, own, plane), or: None };
        let pixel = match (is_close(p, input.frame, own, plane), fit.outcome[i]) {
            (true, _) => Pixel { or: Some(f64::from(own)), ..on_plane },
            (false, Outcome::Fitted | Outcome::Unbounded) => on_plane,
            _ => Pixel::kept(own),
        };
        let other = fit.other[i].map(|o| Pixel {
            depth: moved(input.frame, p, own, &o),
            slack: rounding(p, own, &o),
            or: None,
        });
        pixel.either(other)
    };
    let pixels = fit.plane.iter().enumerate().map(pixel).collect();
    let count = |outcome: Outcome| {
        let mut count = Count::default();
        for (i, plane) in fit.plane.iter().enumerate() {
            let Some(plane) = plane else { continue };
            // Where rounding decides on the window, it may decide on the guard too.
            let close = fit.other[i].is_some() || is_close(p, input.frame, input.depth[i], plane);
            count.add(fit.outcome[i] == outcome, close);
        }
        count
    };
    let clipped =
        if p.projected { clipped(input.frame, input.depth, 0.5 * p.width, p.window / 2) } else { Count::default() };
    let counted = vec![
        ("plane_fit_zero_normal_sum", count(Outcome::ZeroNormal)),
        ("plane_fit_grazing", count(Outcome::Grazing)),
        ("plane_fit_update_too_long", count(Outcome::Unbounded)),
        ("plane_fit_window_clipped", clipped),
    ];
    Smoothed::new(pixels, counted)
}
