//! Number density relative to a filled body, and what it tells: splash or body (Imai16 §4.1).

use glam::{DVec3, Vec3};

use super::neighbours::{Grid, Neighbour, Search, distance_squared};
use super::options::{Options, Scale};
use super::{PrepareError, check_lengths, check_positions};
use crate::particles::Class;

/// Cubic spline of support 1 at `q` = distance / support, scaled to 1 at the centre.
pub fn spline(q: f64) -> f64 {
    match q {
        q if q < 0.5 => 1.0 - 6.0 * q * q * (1.0 - q),
        q if q < 1.0 => 2.0 * (1.0 - q) * (1.0 - q) * (1.0 - q),
        _ => 0.0,
    }
}

/// Points of the cubic lattice of spacing 2 strictly nearer to the origin than `reach`: a filled
/// body at rest, in particle radii.
pub fn lattice(reach: f64) -> impl Iterator<Item = DVec3> {
    let n = (reach / 2.0).ceil() as i32;
    let axis = move || (-n..=n).map(|i| 2.0 * f64::from(i));
    axis()
        .flat_map(move |x| axis().flat_map(move |y| axis().map(move |z| DVec3::new(x, y, z))))
        .filter(move |point| point.length_squared() < reach * reach)
}

/// Sum of [`spline`] over the [`lattice`], the particle at its centre included; `support` in
/// particle radii.
pub fn rest_density(support: f64) -> f64 {
    lattice(support).map(|point| spline(point.length() / support)).sum()
}

/// ρ/ρ0 of every particle, itself included, in the grid's order.
pub(super) fn relative_densities(grid: &Grid, scale: Scale, search: Search) -> Vec<f64> {
    let rest = rest_density(scale.support / scale.radius);
    grid.map_neighbours(scale.support, search, |i, near| {
        let weight = |j: &Neighbour| {
            let squared = distance_squared(grid.positions[i], grid.positions[j.index as usize]);
            f64::from(j.count) * spline(squared.sqrt() / scale.support)
        };
        near.iter().map(weight).sum::<f64>() / rest
    })
}

/// The class of every particle, in the order of `positions`, by `options.splash_threshold`.
///
/// Against popping from frame to frame there are two thresholds: a particle of `last` class (same
/// order) keeps it while its ρ/ρ0 lies in `splash_threshold..upper`. Hand the result to
/// [`prepare`](super::prepare) as [`Input::classes`](super::Input::classes), and `upper` as
/// [`Input::keep_class_below`](super::Input::keep_class_below).
pub fn classify(
    positions: &[Vec3],
    radius: f32,
    options: &Options,
    last: Option<(&[Class], f32)>,
) -> Result<Vec<Class>, PrepareError> {
    let scale = Scale::new(radius, options)?;
    check_positions(positions)?;
    check_lengths("last classes", last.map(|(classes, _)| classes.len()), positions.len())?;
    let grid = Grid::new(positions, scale.support, |a, b| a.cmp(&b))?;
    let mut classes = vec![Class::Body; positions.len()];
    let densities = relative_densities(&grid, scale, options.search);
    for (&index, density) in grid.order.iter().zip(densities) {
        let index = index as usize;
        classes[index] = match last {
            Some((last, upper)) if (options.splash_threshold..upper).contains(&(density as f32)) => last[index],
            _ => class_of(density, options),
        };
    }
    Ok(classes)
}

/// ρ/ρ0 of every particle, in the order of `positions`.
pub fn densities(positions: &[Vec3], radius: f32, options: &Options) -> Result<Vec<f32>, PrepareError> {
    let scale = Scale::new(radius, options)?;
    check_positions(positions)?;
    let grid = Grid::new(positions, scale.support, |a, b| a.cmp(&b))?;
    let mut all = vec![0.0; positions.len()];
    for (&index, density) in grid.order.iter().zip(relative_densities(&grid, scale, options.search)) {
        all[index as usize] = density as f32;
    }
    Ok(all)
}

/// The classes after several frames whose [`densities`] are these, the first one's first: as [`classify`] has them where it is told
/// of each frame's classes in the next. They hang on these frames alone, whatever was before.
pub fn classes_over(frames: &[&[f32]], options: &Options, upper: f32) -> Result<Vec<Class>, PrepareError> {
    let Some((first, later)) = frames.split_first() else { return Ok(Vec::new()) };
    let mut classes: Vec<Class> = first.iter().map(|d| class_of((*d).into(), options)).collect();
    for frame in later {
        check_lengths("densities", Some(frame.len()), classes.len())?;
        for (class, density) in classes.iter_mut().zip(*frame) {
            if !(options.splash_threshold..upper).contains(density) {
                *class = class_of((*density).into(), options);
            }
        }
    }
    Ok(classes)
}

/// Splash where ρ/ρ0 lies below the threshold (Imai16 §4.1).
pub(super) fn class_of(relative_density: f64, options: &Options) -> Class {
    if relative_density < f64::from(options.splash_threshold) { Class::Splash } else { Class::Body }
}

/// The liquid's number density at any point, for instance at the camera.
pub struct DensityField {
    grid: Grid,
    support: f64,
    rest: f64,
}

impl DensityField {
    /// Sorts the particles once. `radius` and `options.support` in world units.
    pub fn new(positions: &[Vec3], radius: f32, options: &Options) -> Result<Self, PrepareError> {
        let scale = Scale::new(radius, options)?;
        check_positions(positions)?;
        let grid = Grid::new(positions, scale.support, |a, b| a.cmp(&b))?;
        Ok(Self { grid, support: scale.support, rest: rest_density(scale.support / scale.radius) })
    }

    /// ρ/ρ0 at `point`: about 1 inside the liquid at rest, ½ on a flat surface (one radius above
    /// the outermost centres), 0 far away or where `point` is not finite.
    pub fn relative_density(&self, point: Vec3) -> f32 {
        let weight = |(squared, count): (f64, u32)| f64::from(count) * spline(squared.sqrt() / self.support);
        let sum: f64 = self.grid.around(point, self.support).map(weight).sum();
        (sum / self.rest) as f32
    }
}
