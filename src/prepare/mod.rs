//! From simulated particles to what is drawn: spheres for splashes, ellipsoids for the body.
//!
//! This is the CPU's way, once for each frame of particles, and the twin of the GPU's
//! ([`DevicePositions`]). The result depends on the set of particles alone: a shuffled input gives
//! bit-identical output, on any number of threads.

#[cfg(not(feature = "inspect"))]
mod density;
#[cfg(feature = "inspect")]
pub mod density;
mod device;
#[cfg(not(feature = "inspect"))]
mod ellipsoids;
#[cfg(feature = "inspect")]
pub mod ellipsoids;
#[cfg(not(feature = "inspect"))]
mod neighbours;
#[cfg(feature = "inspect")]
pub mod neighbours;
mod options;
mod points;
mod spacing;

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DMat3, Mat3, Vec3};

pub(crate) use density::lattice;
pub use density::{DensityField, classes_over, classify, densities};
pub use device::{DeviceCount, DeviceIds, DevicePositions};
pub(crate) use device::{Kept, Words};
pub use neighbours::Search;
pub use options::{Fit, Options};
pub use points::points;
pub use spacing::{estimate_radius, radius_of_spacing, spacing};

use crate::{
    particles::{Class, Ellipsoid, Particles},
    shader::SPLASH_RADIUS,
};
use ellipsoids::{Fitter, Shape};
use neighbours::Grid;
use options::Scale;

/// One frame of particles, in world units.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Input<'a> {
    /// Centres.
    pub positions: &'a [Vec3],
    /// Particle radius: half the rest spacing.
    pub radius: f32,
    /// Classes to use instead of the threshold's.
    pub classes: Option<&'a [Class]>,
    /// Semi-axes (columns) to use unchanged, instead of fitted ones, for particles of the body. A splash stays a ball
    /// ([`Class::Splash`]) whatever is given here; [`Report::splash_axes_ignored`] counts the ellipsoids that are another.
    pub ellipsoids: Option<&'a [Mat3]>,
    /// Below what share of a filled body's density the classes were kept ([`classify`]'s upper threshold): ellipsoids in
    /// place grow out of the splash's ball from there on, so that none jumps with its class.
    pub keep_class_below: Option<f32>,
}

impl<'a> Input<'a> {
    /// Centres, and the radius of all: classes follow from the threshold, ellipsoids are fitted.
    pub fn new(positions: &'a [Vec3], radius: f32) -> Input<'a> {
        Input { positions, radius, classes: None, ellipsoids: None, keep_class_below: None }
    }

    /// Classes of the caller's, one for each particle.
    pub fn classes(self, classes: Option<&'a [Class]>) -> Input<'a> {
        Input { classes, ..self }
    }

    /// Ellipsoids of the caller's, one for each particle.
    pub fn ellipsoids(self, ellipsoids: Option<&'a [Mat3]>) -> Input<'a> {
        Input { ellipsoids, ..self }
    }

    /// Classes that were kept from frame to frame, below this share of a filled body's density.
    pub fn keep_class_below(self, share: Option<f32>) -> Input<'a> {
        Input { keep_class_below: share, ..self }
    }
}

/// How many particles went which way; the guards count particles of the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Report {
    /// Particles drawn as splash.
    pub splash: usize,
    /// Particles drawn as body.
    pub body: usize,
    /// Left spheres for want of neighbours.
    pub few_neighbours: usize,
    /// Left spheres because their neighbours coincide.
    pub degenerate: usize,
    /// Cut to the longest semi-axis.
    pub clamped_long: usize,
    /// Thickened to the shortest semi-axis, or with YuTurk13's fit to the largest ratio.
    pub clamped_ratio: usize,
    /// Splashes that came with an ellipsoid other than the ball they are drawn as.
    pub splash_axes_ignored: usize,
}

/// Why particles could not be prepared. Indices are those of the input.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // the fields are what the messages below say they are
#[non_exhaustive]
pub enum PrepareError {
    /// A radius outside of [`crate::space::RADII`].
    #[error("particle radius {0:?}: {remedy}", remedy = device::radius_remedy())]
    Radius(f32),
    /// An option out of its range.
    #[error("{name} is {value}: {remedy}")]
    Option { name: &'static str, value: String, remedy: String },
    /// A position that is not finite.
    #[error("particle {index} at {position} is not finite: remove it")]
    Position { index: usize, position: Vec3 },
    /// A velocity that is not finite.
    #[error("the velocity {velocity} of particle {index} is not finite: remove it")]
    Velocity { index: usize, velocity: Vec3 },
    /// An array that does not hold one entry for each particle.
    #[error("{what}: {found} of them for {particles} particles; give one for each, or none at all")]
    Length { what: &'static str, found: usize, particles: usize },
    /// A position too far out for whole cells of `size`, the support.
    #[error(
        "particle {index} at {position} lies more than 2^28 cells of {size} from the origin: \
         remove it, or check the radius"
    )]
    TooFar { index: usize, position: Vec3, size: f64 },
    /// A given ellipsoid that has no volume.
    #[error("the ellipsoid of particle {index} is flat or not finite: give three independent semi-axes")]
    Ellipsoid { index: usize },
    /// More particles than 32-bit indices tell apart.
    #[error("{0} particles: at most 2^32 - 1 fit")]
    TooMany(usize),
}

fn check_positions(positions: &[Vec3]) -> Result<(), PrepareError> {
    match positions.iter().position(|p| !p.is_finite()) {
        Some(index) => Err(PrepareError::Position { index, position: positions[index] }),
        None => Ok(()),
    }
}

fn check_lengths(what: &'static str, found: Option<usize>, particles: usize) -> Result<(), PrepareError> {
    match found {
        Some(found) if found != particles => Err(PrepareError::Length { what, found, particles }),
        _ => Ok(()),
    }
}

/// Finite, and its columns well away from one plane (which is judged without their lengths).
fn is_ellipsoid(axes: &Mat3) -> bool {
    let axes = axes.as_dmat3();
    let box_volume = axes.x_axis.length() * axes.y_axis.length() * axes.z_axis.length();
    axes.is_finite() && box_volume > 0.0 && axes.determinant().abs() > 1e-6 * box_volume
}

/// Classifies particles and gives each its ellipsoid; see [`prepare_with_progress`].
pub fn prepare(input: &Input, options: &Options) -> Result<(Particles, Report), PrepareError> {
    prepare_with_progress(input, options, &|_| ())
}

/// Classifies particles by number density (Imai16 §4.1), and gives those of the body the ellipsoids
/// of [`Options::ellipsoids`] and a splash a sphere, splashes first.
///
/// `progress` is told how many particles are done, now and then, from any thread and not always in
/// order; the last number is the count of particles.
pub fn prepare_with_progress(
    input: &Input,
    options: &Options,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<(Particles, Report), PrepareError> {
    prepare_all(input, None, options, progress).map(|(particles, report, _)| (particles, report))
}

/// [`prepare_with_progress`] of particles whose velocities are known, in world units a second: also gives the speed of each
/// particle as drawn, for [`crate::Renderer::set_speeds`].
pub fn prepare_with_velocities(
    input: &Input,
    velocities: &[Vec3],
    options: &Options,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<(Particles, Report, Vec<f32>), PrepareError> {
    check_lengths("velocities", Some(velocities.len()), input.positions.len())?;
    if let Some(index) = velocities.iter().position(|v| !v.is_finite()) {
        return Err(PrepareError::Velocity { index, velocity: velocities[index] });
    }
    prepare_all(input, Some(velocities), options, progress)
}

fn prepare_all(
    input: &Input,
    velocities: Option<&[Vec3]>,
    options: &Options,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<(Particles, Report, Vec<f32>), PrepareError> {
    let Input { positions, radius, classes, ellipsoids, keep_class_below } = *input;
    let scale = Scale::new(radius, options)?;
    check_lengths("classes", classes.map(<[_]>::len), positions.len())?;
    check_lengths("ellipsoids", ellipsoids.map(<[_]>::len), positions.len())?;
    check_positions(positions)?;
    let fade_from = options.fade_from(keep_class_below)?;

    // What tells particles at the same place apart.
    let extra = |i: u32| {
        let axes = ellipsoids.map(|given| given[i as usize].to_cols_array().map(f32::to_bits));
        let velocity = velocities.map(|given| given[i as usize].to_array().map(f32::to_bits));
        (classes.map(|given| given[i as usize] as u8), axes, velocity)
    };
    let grid = Grid::new(positions, scale.support, |a, b| extra(a).cmp(&extra(b)))?;
    let classes: Vec<Class> = match classes {
        Some(given) => grid.order.iter().map(|&i| given[i as usize]).collect(),
        None => density::relative_densities(&grid, scale, options.search)
            .into_iter()
            .map(|relative| density::class_of(relative, options))
            .collect(),
    };

    let shapes = match ellipsoids {
        Some(given) => given_shapes(&grid, radius, &classes, given)?,
        None => {
            let fitter = Fitter::new(&grid, scale, options, fade_from);
            let done = AtomicUsize::new(0);
            grid.map_neighbours(scale.reach, options.search, |i, near| {
                let before = done.fetch_add(1, Ordering::Relaxed);
                if before % 4096 == 4095 {
                    progress(before + 1);
                }
                match classes[i] {
                    Class::Splash => (splash(grid.positions[i], radius), Shape::Given),
                    Class::Body => fitter.fit(i, near),
                }
            })
        }
    };
    progress(positions.len());
    let (particles, report) = assemble(radius, &classes, &shapes);
    let of_class = |class: Class| {
        let moving = grid.order.iter().zip(&classes).filter(move |(_, c)| **c == class);
        // In double precision: squares may not be float32 numbers.
        let speed = |v: Vec3| v.as_dvec3().length().min(f64::from(f32::MAX)) as f32;
        moving.filter_map(move |(i, _)| velocities.map(|v| speed(v[*i as usize])))
    };
    let speeds = of_class(Class::Splash).chain(of_class(Class::Body)).collect();
    Ok((particles, report, speeds))
}

fn splash(center: Vec3, radius: f32) -> Ellipsoid {
    sphere(center, SPLASH_RADIUS * radius)
}

fn sphere(center: Vec3, radius: f32) -> Ellipsoid {
    let axes = Mat3::from_diagonal(Vec3::splat(radius));
    Ellipsoid { center, axes }
}

/// Whether these are the semi-axes of another ellipsoid than a splash's ball, by more than writing and reading them rounds. What
/// is no ellipsoid, such as zeros, stands for none.
fn differs_from_splash(axes: &Mat3, radius: f32) -> bool {
    let in_balls = axes.as_dmat3() * f64::from(SPLASH_RADIUS * radius).recip();
    let off = in_balls * in_balls.transpose() - DMat3::IDENTITY;
    is_ellipsoid(axes) && off.to_cols_array().iter().any(|x| x.abs() > 1e-4)
}

/// The caller's ellipsoids, checked, in the grid's order.
fn given_shapes(
    grid: &Grid,
    radius: f32,
    classes: &[Class],
    given: &[Mat3],
) -> Result<Vec<(Ellipsoid, Shape)>, PrepareError> {
    let mut shapes = Vec::with_capacity(classes.len());
    let mut bad = None;
    for ((&index, &center), class) in grid.order.iter().zip(&grid.positions).zip(classes) {
        let (index, axes) = (index as usize, given[index as usize]);
        shapes.push(match class {
            Class::Splash if differs_from_splash(&axes, radius) => (splash(center, radius), Shape::AxesIgnored),
            Class::Splash => (splash(center, radius), Shape::Given),
            Class::Body => (Ellipsoid { center, axes }, Shape::Given),
        });
        if *class == Class::Body && !is_ellipsoid(&axes) && bad.is_none_or(|bad| index < bad) {
            bad = Some(index);
        }
    }
    match bad {
        Some(index) => Err(PrepareError::Ellipsoid { index }),
        None => Ok(shapes),
    }
}

/// Splashes first, then the body, each in the grid's order.
fn assemble(radius: f32, classes: &[Class], shapes: &[(Ellipsoid, Shape)]) -> (Particles, Report) {
    let mut report = Report::default();
    let (mut ellipsoids, mut body) = (Vec::with_capacity(shapes.len()), Vec::new());
    for (&(ellipsoid, shape), class) in shapes.iter().zip(classes) {
        match class {
            Class::Splash => ellipsoids.push(ellipsoid),
            Class::Body => body.push(ellipsoid),
        }
        match shape {
            Shape::Given => {}
            Shape::AxesIgnored => report.splash_axes_ignored += 1,
            Shape::FewNeighbours => report.few_neighbours += 1,
            Shape::Degenerate => report.degenerate += 1,
            Shape::Fitted { long, ratio } => {
                report.clamped_long += usize::from(long);
                report.clamped_ratio += usize::from(ratio);
            }
        }
    }
    (report.splash, report.body) = (ellipsoids.len(), body.len());
    ellipsoids.append(&mut body);
    let splash_count = report.splash;
    (Particles { radius, ellipsoids, splash_count }, report)
}
