//! Bounds of the body's depth: the twin's, and never beyond what is drawn.

use crate::{
    cull::around_the_near_plane,
    splat::{case, packed},
    support::{Case, Driver, Shot, camera, each_driver, random_cloud},
};
use glam::Vec3;
use meniscus::{
    shader::{CLASS_BODY, DEPTH_ROUNDING, SILHOUETTE},
    twin::occlude::{Bounds, occlude},
};

/// Depths round in particle radii: G by the ratio of the semi-axes (16 for S), a dozen operations of 6e-8 each, and the
/// root of a discriminant more than that where it is small. The cull pass allows as much.
const ROUNDING: f64 = DEPTH_ROUNDING as f64;

/// Front and back bounds as the GPU has them.
fn bounds(shot: &Shot) -> Bounds {
    Bounds::from_words(shot.words("body depth bounds", 0).expect("there is a body"))
}

/// A pixel may differ only if some ray there nearly grazes a particle: then one that leaves out none of these, or three
/// times as many, agrees with the GPU.
fn check(driver: &Driver, case: &Case, what: &str, bounded_at_least: f64) -> Shot {
    let shot = driver.shoot(case);
    let Bounds { front, back } = bounds(&shot);
    let body = packed(&case.particles, CLASS_BODY);
    let [want, large, small] = [1.0, 0.0, 3.0].map(|share| occlude(&shot.frame, &body, share * f64::from(SILHOUETTE)));
    let rounding = ROUNDING;
    let (mut bounded, mut edges) = (0, 0);
    for i in 0..front.len() {
        let label = format!("{}: {what}: pixel {i}", driver.name);
        assert_eq!(front[i].is_finite(), back[i] > 0.0, "{label}: {} {}", front[i], back[i]);
        let (low, high) = (large.front[i] - rounding, small.front[i] + rounding);
        assert!((low..=high).contains(&front[i]), "{label}: front {}, should be {}", front[i], want.front[i]);
        let (low, high) = (small.back[i] - rounding, large.back[i] + rounding);
        assert!((low..=high).contains(&back[i]), "{label}: back {}, should be {}", back[i], want.back[i]);
        // Where the twin's three sizes agree, the ranges above are one value, rounded.
        let same = |a: f64, b: f64| a == b || (a - b).abs() <= rounding;
        edges += usize::from(!same(front[i], want.front[i]) || !same(back[i], want.back[i]));
        bounded += usize::from(front[i].is_finite());
    }
    println!("{}: {what}: {bounded} of {} pixels bounded, {edges} differ at an edge", driver.name, front.len());
    assert!(edges <= front.len() / 1000 + 1, "{}: {what}: {edges} pixels differ", driver.name);
    assert!(bounded as f64 >= bounded_at_least * front.len() as f64, "{}: {what}: {bounded}", driver.name);

    // Safe: whatever is drawn in front is at least as near, and what is drawn behind at least as far.
    let (nearest, farthest) =
        (shot.floats("body depth (ray-cast)", 0).unwrap(), shot.floats("body depth (ray-cast)", 1).unwrap());
    for i in (0..front.len()).filter(|i| front[*i].is_finite()) {
        let (nearest, farthest) = (f64::from(nearest[i].abs()), f64::from(farthest[i]));
        let label = format!("{}: {what}: pixel {i}", driver.name);
        assert!(nearest > 0.0 && nearest <= front[i] + rounding, "{label}: front {nearest} > {}", front[i]);
        assert!(farthest >= back[i] - rounding, "{label}: back {farthest} < {}", back[i]);
    }
    shot
}

#[test]
fn bounds_are_the_twins_and_safe() {
    let size = [200, 150];
    let eye = camera(Vec3::new(0.5, 0.4, 1.9), Vec3::ZERO, size);
    let cloud =
        |seed, radius, body| case(random_cloud(seed, radius, Vec3::splat(-0.5), Vec3::splat(0.5), 5, body), eye, size);
    each_driver(|driver| {
        check(driver, &cloud(1, 0.02, 6000), "radius 2 px", 0.05);
        check(driver, &cloud(2, 0.08, 800), "radius 8 px", 0.2);
        check(driver, &cloud(3, 0.4, 20), "radius 40 px", 0.2);
    });
}

#[test]
#[cfg(feature = "io")]
fn a_real_frame_is_bounded_and_safe() {
    let case = crate::splat::dam_break();
    each_driver(|driver| {
        check(driver, case, "dam break", 0.1);
    });
}

#[test]
fn the_near_plane_bounds_nothing() {
    let crossing = around_the_near_plane();
    // Only those that reach it or lie behind: nothing is certain.
    let mut only = crossing.clone();
    only.particles.ellipsoids.truncate(6);
    only.particles.ellipsoids.remove(2);
    only.particles.splash_count = 0;
    each_driver(|driver| {
        check(driver, &crossing, "near plane", 0.1);
        let Bounds { front, back } = bounds(&driver.shoot(&only));
        assert!(front.iter().all(|d| *d == f64::INFINITY) && back.iter().all(|d| *d == 0.0), "{}", driver.name);
    });
}
