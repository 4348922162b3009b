//! The search for walls, on its own maps.

use super::{
    Case, Measure, NO_NUMBER, Step, median, percent,
    shot::{View, degrees},
};
use crate::{
    Ellipsoid, Equirect, Particles,
    inspect::Walk,
    study::random::Random,
    twin::{
        walk::walk,
        walls::{Map, Maps},
    },
};
use glam::{DVec3, Mat3, Vec3};
use rayon::prelude::*;

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

/// Beside a search that misses nothing.
pub const SEARCH: Case = Case {
    name: "search",
    about: "random clouds: where walks end, beside a slow march and bisection in the same maps",
    x: "cloud",
    promised: true,
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
        let sky = Equirect::procedural_sky();
        let mut found = Vec::new();
        for &x in steps {
            let view = View::new(DVec3::new(2.0, 3.0, 18.0), DVec3::ZERO, DVec3::Y, 45.0);
            let shot = rig.draw(&random_cloud(x as u64), &view, settings)?;
            let maps = shot.maps.each_ref().map(|class| class.each_ref().map(|(depth, normal)| Map { depth, normal }));
            let maps = Maps { frame: &shot.frame, maps, scene: None };
            // The slow march knows optics that follow rays through the maps of a class or two.
            let rays =
                Walk::of(&settings.method.optics).filter(|w| w.refractions == 1 || !maps.maps[1][1].depth.is_empty());
            let chosen =
                (0..shot.picture.len()).step_by(7).filter(|i| rays.is_some() && shot.covered(*i) == Some(true));
            let chosen: Vec<usize> = chosen.collect();
            let off = |i: &usize| {
                let twin = walk(&maps, rays.as_ref()?, &sky, [i % shot.width(), i / shot.width()]);
                shot.last_direction(*i).map(|d| degrees(d, twin.direction))
            };
            let off: Vec<f64> = chosen.par_iter().filter_map(off).collect();
            let beyond = |limit: f64| percent(off.iter().filter(|a| **a > limit).count(), off.len());
            let shares = [beyond(1.0), beyond(0.1)];
            found.push(Step { x, found: vec![Some(shot.no_number()), median(off), shares[0], shares[1]] });
        }
        Ok(found)
    },
};
