//! A guess at the particle radius, for files that do not tell it.

use glam::Vec3;
use rayon::prelude::*;

use super::neighbours::distance_squared;

/// The nearest-neighbour distance of compressed, turbulent frames is 0.84–0.96 of the rest
/// spacing; half the median is divided by the middle of that.
const COMPRESSION: f32 = 0.9;

/// Half the median nearest-neighbour distance ([`spacing`]), divided by 0.9.
///
/// A guess, good to about 7 % on simulated liquid (too large by 11 % on an undisturbed lattice):
/// a radius from the simulation is always better.
pub fn estimate_radius(positions: &[Vec3]) -> Option<f32> {
    spacing(positions).map(radius_of_spacing)
}

/// The radius that a median nearest-neighbour distance tells: see [`estimate_radius`].
pub fn radius_of_spacing(median: f32) -> f32 {
    0.5 * median / COMPRESSION
}

/// The median nearest-neighbour distance of the distinct finite positions; `None` where fewer than two are distinct.
pub fn spacing(positions: &[Vec3]) -> Option<f32> {
    let mut points: Vec<Vec3> = positions.iter().copied().filter(|p| p.is_finite()).collect();
    let key = |p: &Vec3| (*p + Vec3::ZERO).to_array().map(f32::to_bits); // -0 and 0 are one place
    points.par_sort_unstable_by_key(key);
    points.dedup_by_key(|p| key(p));
    if points.len() < 2 {
        return None;
    }
    let mut axes = vec![0; points.len()];
    split(&mut points, &mut axes);
    let nearest = |p: &Vec3| {
        let mut best = f64::INFINITY;
        search(&points, &axes, *p, &mut best);
        best
    };
    let mut squared: Vec<f64> = points.par_iter().map(nearest).collect();
    let middle = squared.len() / 2;
    let (_, median, _) = squared.select_nth_unstable_by(middle, f64::total_cmp);
    Some(median.sqrt() as f32)
}

/// Orders points as a k-d tree: the root in the middle, split across the axis noted there.
fn split(points: &mut [Vec3], axes: &mut [usize]) {
    if points.len() < 2 {
        return;
    }
    let low = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    let (axis, middle) = ((high - low).max_position(), points.len() / 2);
    points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    axes[middle] = axis;
    let (low, high) = points.split_at_mut(middle);
    let (low_axes, high_axes) = axes.split_at_mut(middle);
    rayon::join(|| split(low, low_axes), || split(&mut high[1..], &mut high_axes[1..]));
}

/// Lowers `best`, a squared distance, to that of the nearest point that is not `point` itself.
fn search(points: &[Vec3], axes: &[usize], point: Vec3, best: &mut f64) {
    let middle = points.len() / 2;
    let Some(&root) = points.get(middle) else {
        return;
    };
    if root != point {
        *best = best.min(distance_squared(point, root));
    }
    let low = (&points[..middle], &axes[..middle]);
    let high = (&points[middle + 1..], &axes[middle + 1..]);
    let gap = f64::from(point[axes[middle]]) - f64::from(root[axes[middle]]);
    let (near, far) = if gap < 0.0 { (low, high) } else { (high, low) };
    search(near.0, near.1, point, best);
    if gap * gap < *best {
        search(far.0, far.1, point, best);
    }
}
