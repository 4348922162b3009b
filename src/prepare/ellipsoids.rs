//! An ellipsoid for each particle of the body: in place, or an anisotropic kernel (YuTurk13).

use glam::{DMat3, DVec3};

use super::density::{lattice, rest_density, spline};
use super::neighbours::{Grid, Neighbour};
use super::options::{Fit, Options, Scale};
use crate::{
    particles::Ellipsoid,
    shader::{
        DEGENERATE_VARIANCE, ELLIPSOID_PULL, ELLIPSOID_SIZE, ELLIPSOID_SMOOTHING, ELLIPSOID_THIN, ELLIPSOID_WIDE,
        SPLASH_FADE, SPLASH_RADIUS,
    },
};

/// How an ellipsoid came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// Not fitted: a splash's sphere, or the caller's ellipsoid.
    Given,
    /// A splash's sphere in place of the caller's ellipsoid.
    AxesIgnored,
    /// A sphere: too few neighbours.
    FewNeighbours,
    /// A sphere: the neighbours coincide.
    Degenerate,
    /// Fitted; whether a semi-axis was cut to the longest allowed, and whether one was raised to
    /// the shortest, or to the largest ratio allowed.
    Fitted { long: bool, ratio: bool },
}

/// YuTurk13's weight 1 - (d / reach)³ of a neighbour at distance d.
fn weight(distance: f64, reach: f64) -> f64 {
    let q = distance / reach;
    1.0 - q * q * q
}

/// Eigenvalue (all three are equal) of the weighted covariance of a filled body's [`lattice`],
/// `reach` and the result in particle radii and their square.
pub fn lattice_variance(reach: f64) -> f64 {
    let (mut sum, mut squares) = (0.0, 0.0);
    for point in lattice(reach) {
        let w = weight(point.length(), reach);
        sum += w;
        squares += w * point.x * point.x;
    }
    squares / sum
}

/// How far below a particle on the flat surface of a filled body's [`lattice`] the weighted mean of its neighbours lies;
/// `reach` and the result in particle radii.
pub fn flat_offset(reach: f64) -> f64 {
    let (mut sum, mut offset) = (0.0, 0.0);
    for point in lattice(reach).filter(|p| p.z <= 0.0) {
        let w = weight(point.length(), reach);
        sum += w;
        offset -= w * point.z;
    }
    offset / sum
}

/// Fits the ellipsoid of each particle from its neighbours within the reach.
pub(super) struct Fitter<'a> {
    grid: &'a Grid,
    options: &'a Options,
    scale: Scale,
    /// From what density on, as a part of a filled body's, a shape differs from a splash's.
    fade_from: f32,
    /// A filled body's variance, density (both as of [`Sums`]), and offset below a flat surface, in world units.
    full: f64,
    filled: f64,
    flat: f64,
}

/// Weighted sums over a particle's neighbours, divided by the weights' sum; offsets are measured from the particle, so that
/// nothing is lost far from the origin.
struct Sums {
    mean: DVec3,
    squares: DMat3,
    /// Number density, as a part of a filled body's.
    density: f64,
}

impl<'a> Fitter<'a> {
    pub fn new(grid: &'a Grid, scale: Scale, options: &'a Options, fade_from: f32) -> Self {
        let (reach, radius) = (scale.reach / scale.radius, scale.radius);
        let full = lattice_variance(reach) * radius.powi(2);
        let filled = rest_density(scale.support / radius);
        Self { grid, options, scale, fade_from, full, filled, flat: flat_offset(reach) * radius }
    }

    /// Particle `i`'s ellipsoid. It counts in its own sums with weight 1.
    pub fn fit(&self, i: usize, near: &[Neighbour]) -> (Ellipsoid, Shape) {
        match self.options.ellipsoids {
            Fit::InPlace => self.in_place(i, near),
            Fit::YuTurk => self.yu_turk(i, near),
        }
    }

    fn sums(&self, i: usize, near: &[Neighbour]) -> Sums {
        let origin = self.grid.positions[i].as_dvec3();
        let (mut sum, mut mean, mut squares, mut density) = (0.0, DVec3::ZERO, DMat3::ZERO, 0.0);
        for j in near {
            let offset = self.grid.positions[j.index as usize].as_dvec3() - origin;
            let weight = f64::from(j.count) * weight(offset.length(), self.scale.reach);
            let weighted = offset * weight;
            sum += weight;
            mean += weighted;
            squares += outer(offset, weighted);
            density += f64::from(j.count) * spline(offset.length() / self.scale.support);
        }
        Sums { mean: mean / sum, squares: squares * (1.0 / sum), density: density / self.filled }
    }

    /// Semi-axes follow how neighbours spread along one direction against the others, whatever their spacing: balls inside,
    /// flat on a surface or in a sheet, long in a jet. Their lengths are such that the mean height of a surface, dents
    /// between particles included, is that of the liquid's: what is drawn is these ellipsoids, not a field around them.
    ///
    /// Centres follow their neighbours a little, and more where these lie further to one side than under a flat surface: such
    /// a particle protrudes. One with hardly more density than a splash, or than one that a splash may have that was
    /// one before, has hardly another shape.
    fn in_place(&self, i: usize, near: &[Neighbour]) -> (Ellipsoid, Shape) {
        let Sums { mean, squares, density } = self.sums(i, near);
        let (variances, frame) = eigen_symmetric(squares - outer(mean, mean));
        // The addend makes nothing of a spread of nothing.
        let variances = variances.max(DVec3::ZERO) / self.full + f64::from(DEGENERATE_VARIANCE);
        let spread = (variances / variances.element_product().cbrt()).map(f64::sqrt);
        let [size, thin, wide] = [ELLIPSOID_SIZE, ELLIPSOID_THIN, ELLIPSOID_WIDE].map(f64::from);
        let [splash, fade] = [SPLASH_RADIUS, SPLASH_FADE].map(f64::from);
        let [smoothing, pull] = [ELLIPSOID_SMOOTHING, ELLIPSOID_PULL].map(f64::from);
        let wanted = spread * size;
        let share = ((density - f64::from(self.fade_from)) / fade).clamp(0.0, 1.0);
        let lengths = DVec3::splat(splash).lerp(wanted.clamp(DVec3::splat(thin), DVec3::splat(wide)), share);
        let protrudes = (1.0 - self.flat / mean.length()).max(0.0); // 0 of a mean of 0
        let center = self.grid.positions[i].as_dvec3() + mean * (share * (smoothing + pull * protrudes));
        let axes = (frame * DMat3::from_diagonal(lengths * self.scale.radius)).as_mat3();
        let shape = Shape::Fitted { long: wanted.x > wide, ratio: wanted.z < thin };
        (Ellipsoid { center: center.as_vec3(), axes }, shape)
    }

    /// YuTurk13 §4 with the eigenvalues themselves, not their roots, as lengths.
    ///
    /// As in the paper, liquid shrinks: with the defaults the outermost centres of a flat surface
    /// sink by 1.85 r, the next layer by 0.94 r, and a lone block of 27 particles from 6 r to
    /// 1.25 r across. A smaller support or λ takes less.
    fn yu_turk(&self, i: usize, near: &[Neighbour]) -> (Ellipsoid, Shape) {
        let (center, radius) = (self.grid.positions[i], self.scale.radius);
        let sphere = super::sphere(center, radius as f32);
        if near.iter().map(|j| j.count as usize).sum::<usize>() <= self.options.min_neighbours + 1 {
            return (sphere, Shape::FewNeighbours);
        }
        let Sums { mean, squares, .. } = self.sums(i, near);
        let (variances, frame) = eigen_symmetric(squares - outer(mean, mean));
        if variances.x < f64::from(DEGENERATE_VARIANCE) * self.full {
            return (sphere, Shape::Degenerate);
        }

        let least = variances.x / f64::from(self.options.max_ratio);
        let wanted = variances.max(DVec3::splat(least)) * (radius / self.full);
        let longest = radius * f64::from(self.options.max_semi_axis);
        let lengths = wanted.min(DVec3::splat(longest));
        let center = center.as_dvec3() + mean * f64::from(self.options.smoothing);
        let axes = (frame * DMat3::from_diagonal(lengths)).as_mat3();
        let shape = Shape::Fitted { long: wanted.x > longest, ratio: variances.z < least };
        (Ellipsoid { center: center.as_vec3(), axes }, shape)
    }
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Eigenvalues of a symmetric matrix in descending order, and its eigenvectors as the columns of
/// a right-handed frame: eight sweeps of cyclic Jacobi rotations, where five suffice.
///
/// The largest component of the first two vectors is positive, so equal input gives equal signs.
pub fn eigen_symmetric(matrix: DMat3) -> (DVec3, DMat3) {
    let mut a = matrix.to_cols_array_2d();
    let mut vectors = DVec3::AXES;
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            // The smaller root of t² + 2θt - 1 = 0; an overflowing θ gives t = 0.
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = 1f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            let (shift, k) = (t * a[p][q], 3 - p - q);
            a[p][p] -= shift;
            a[q][q] += shift;
            (a[p][q], a[q][p]) = (0.0, 0.0);
            let (kp, kq) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
            (a[k][p], a[p][k], a[k][q], a[q][k]) = (kp, kp, kq, kq);
            let (vp, vq) = (vectors[p], vectors[q]);
            (vectors[p], vectors[q]) = (vp * c - vq * s, vp * s + vq * c);
        }
    }
    let mut index = [0, 1, 2];
    index.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
    let [first, second] = [0, 1].map(|k| positive(vectors[index[k]]));
    let values = DVec3::from(index.map(|i| a[i][i]));
    (values, DMat3::from_cols(first, second, first.cross(second)))
}

fn positive(vector: DVec3) -> DVec3 {
    let largest = vector[vector.abs().max_position()];
    if largest < 0.0 { -vector } else { vector }
}
