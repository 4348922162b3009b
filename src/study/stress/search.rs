//! The search for walls, in its own maps or field.

use super::{
    Case, Extent, Measure, NO_NUMBER, Rig, Step, StressError, median, percent,
    shot::{Shot, View},
};
use crate::{Ellipsoid, Equirect, Particles, Settings, study::random::Random};
use glam::{DVec3, Mat3, Vec3};

/// Random ellipsoids: body, and splashes among them.
fn random_cloud(seed: u64) -> Particles {
    let mut random = Random::of(seed, 3);
    let mut unit = move || random.unit() as f32;
    let mut point = || 2.0 * Vec3::new(unit(), unit(), unit()) - 1.0;
    let splash_count = 12;
    let ellipsoids = (0..52).map(|k| {
        let center = 6.5 * point();
        let sizes = 0.75 + 0.45 * point();
        let turn = Mat3::from_axis_angle((point() + Vec3::splat(1e-3)).normalize(), 3.0 * point().x);
        let axes =
            if k < splash_count { Mat3::from_diagonal(Vec3::splat(1.24)) } else { turn * Mat3::from_diagonal(sizes) };
        Ellipsoid { center, axes }
    });
    Particles { radius: 1.0, ellipsoids: ellipsoids.collect(), splash_count }
}

/// A random cloud, and how far walks through it end from where a search that misses nothing ends, in degrees.
fn residuals(rig: &mut Rig, settings: &Settings, cloud: u64) -> Result<(Shot, Vec<f64>), StressError> {
    let view = View::new(DVec3::new(2.0, 3.0, 18.0), DVec3::ZERO, DVec3::Y, 45.0);
    let shot = rig.draw(&random_cloud(cloud), &view, settings)?;
    // In a field that takes longer.
    let every = if shot.walked.field.is_some() { 29 } else { 7 };
    let chosen: Vec<usize> = (0..shot.picture.len()).step_by(every).collect();
    let off = shot.walked.off(settings, &Equirect::procedural_sky(), &chosen);
    Ok((shot, off))
}

/// Beside a search that misses nothing.
pub const SEARCH: Case = Case {
    name: "search",
    about: "random clouds: where walks end, beside a slow march and bisection in the same maps or field",
    x: "cloud",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        Measure {
            name: "directions off, degrees, in the median",
            bound: 0.02,
            beyond: "walls are found at other places",
        },
        Measure { name: "off by more than a degree, %", bound: 6.0, beyond: "walls are missed" },
        Measure { name: "off by more than 0.1 degrees, %", bound: 7.0, beyond: "walls are found roughly" },
    ],
    steps: |extent| extent.of(&[1.0], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
    run: |rig, settings, steps| {
        let mut found = Vec::new();
        for &x in steps {
            let (shot, off) = residuals(rig, settings, x as u64)?;
            let beyond = |limit: f64| percent(off.iter().filter(|a| **a > limit).count(), off.len());
            let shares = [beyond(1.0), beyond(0.1)];
            found.push(Step { x, found: vec![Some(shot.no_number()), median(off), shares[0], shares[1]] });
        }
        Ok(found)
    },
};

/// The same as a histogram.
pub const RESIDUALS: Case = Case {
    name: "residuals",
    about: "the same of all clouds as a histogram: of each angle, how many walks end that far off, but further than the angle before",
    x: "degrees off, at most",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        Measure { name: "walks, %", bound: f64::INFINITY, beyond: "" },
        Measure { name: "walks further off than a degree, %", bound: 6.0, beyond: "walls are missed" },
    ],
    steps: |_| vec![1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 180.0],
    run: |rig, settings, steps| {
        let clouds = if rig.extent == Extent::Small { 1 } else { 6 };
        let (mut all, mut no_number) = (Vec::new(), 0.0);
        for cloud in 1..=clouds {
            let (shot, off) = residuals(rig, settings, cloud)?;
            no_number += shot.no_number();
            all.extend(off);
        }
        let below = |limit: f64| all.iter().filter(|a| **a <= limit).count();
        let mut found = Vec::new();
        for (i, &x) in steps.iter().enumerate() {
            let before = if i == 0 { 0 } else { below(steps[i - 1]) };
            // The rest, what is no number too, is in the last.
            let up_to = if i + 1 == steps.len() { all.len() } else { below(x) };
            let share = percent(up_to - before, all.len());
            found.push(Step { x, found: vec![Some(no_number), share, share.filter(|_| x > 1.0)] });
        }
        Ok(found)
    },
};
