//! The two problems that Imai16 §3.2 finds in Imai14, and says to have solved: the presets of both are to show it.

use crate::{
    analytic::{Quadric, SIZE, pixels, through, view},
    support::{Case, Driver, Shot, each_driver, imai16, sphere},
    walk::degrees,
};
use glam::{DVec3, Mat3, Vec3};
use meniscus::{Ellipsoid, Method, Particles, Settings, shader::SIDE_FRONT, twin::normal::decode_normal};

fn preset(name: &str) -> Settings {
    let mut settings = imai16();
    settings.method = Method::preset(name).expect("a preset");
    settings
}

fn median(mut values: Vec<f64>) -> f64 {
    assert!(values.len() > 500, "only {} pixels", values.len());
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Problem 1: a droplet before a body. The measure is the share of the gap of air between the two that a ray is said to have
/// gone through as liquid, (length found - length in droplet and slab) / gap: 1 where droplet and slab are fused, 0 where they
/// are two. And how far off the direction is in which the ray goes on: medians over the pixels well within the droplet.
fn fused(driver: &Driver, method: &str) -> [f64; 2] {
    // About eleven radii apart: more than the filter's weights reach.
    let ball = sphere(Vec3::new(0.05, 0.02, 0.8), 0.1);
    let axes = Mat3::from_rotation_y(0.2) * Mat3::from_diagonal(Vec3::new(2.0, 2.0, 0.3));
    let body = Ellipsoid { center: Vec3::new(0.0, 0.0, -0.7), axes };
    let particles = Particles { radius: 0.1, ellipsoids: vec![ball, body], splash_count: 1 };
    let camera = view(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 20.0);
    let case = Case { particles, camera, settings: preset(method), size: SIZE, eye_inside: false };
    let (first, second) = (Quadric::new(&ball), Quadric::new(&body));
    let (mut shares, mut angles) = (Vec::new(), Vec::new());
    for p in pixels(&case, &driver.shoot(&case)) {
        let Some((droplet, _)) = through(&first, p.eye, p.dir, 0).filter(|(_, cos)| *cos >= 0.6) else { continue };
        let (slab, _) = through(&second, droplet.at, droplet.dir, 0).expect("the slab is wide");
        if slab.limited || slab.margin < 0.05 {
            continue;
        }
        let gap = second.crossings(droplet.at, droplet.dir).expect("the same").0;
        shares.push((p.length - droplet.length - slab.length) / gap);
        angles.push(degrees(p.found, slab.dir));
    }
    [median(shares), median(angles)]
}

#[test]
fn a_droplet_before_a_body_is_not_fused_with_it() {
    each_driver(|driver| {
        let [before, after] = ["imai14", "imai16"].map(|method| fused(driver, method));
        println!(
            "{}: gap taken for liquid, direction off in degrees: imai14 {before:?}, imai16 {after:?}",
            driver.name
        );
        assert!(before[0] > 0.8 && before[1] > 2.0, "{}: imai14 {before:?}", driver.name);
        assert!(after[0].abs() < 0.01 && after[1] < 0.2, "{}: imai16 {after:?}", driver.name);
    });
}

const RADIUS: f32 = 0.05;

/// A plate of flat particles, tilted so that its upper edge is its farthest: the surface of a body as YuTurk13's ellipsoids
/// have it, with a boundary and a slope there.
fn plate(tilt: f32) -> (Vec<Ellipsoid>, DVec3) {
    let turn = Mat3::from_rotation_x(-tilt.to_radians());
    let axes = turn * Mat3::from_diagonal(RADIUS * Vec3::new(1.2, 1.2, 0.1));
    let all = (-20..=20).flat_map(|i| (-20..=20).map(move |j| turn * (RADIUS * Vec3::new(i as f32, j as f32, 0.0))));
    (all.map(|center| Ellipsoid { center, axes }).collect(), (turn * Vec3::Z).as_dvec3())
}

/// Problem 2: filtered depths warp towards the viewer where a surface ends. The measures are means over the pixels up to four
/// inside the plate's far edge, columns at its middle: by how many particle radii the smoothed depth is nearer than the
/// unsmoothed, and by how many degrees the smoothed normal is turned from the plate's.
fn warped(driver: &Driver, smooth: &str) -> [f64; 2] {
    let (ellipsoids, normal) = plate(60.0);
    let particles = Particles { radius: RADIUS, ellipsoids, splash_count: 0 };
    let camera = view(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 45.0);
    let mut settings = preset("imai16");
    settings.method.choose("smooth", smooth).expect("a filter");
    let case = Case { particles, camera, settings, size: SIZE, eye_inside: false };
    let shot = driver.shoot(&case);
    let names = driver.session.borrow().renderer.surfaces();
    let raw = shot.floats("body depth (ray-cast)", SIDE_FRONT).unwrap();
    let smoothed = shot.floats(names.body_depth.unwrap(), SIDE_FRONT).unwrap();
    let normals = shot.words(names.body_normal.unwrap(), SIDE_FRONT).unwrap();
    let at = |x: u32, y: u32| (y * SIZE[0] + x) as usize;
    let (mut nearer, mut turned) = (Vec::new(), Vec::new());
    for x in SIZE[0] / 2 - 40..SIZE[0] / 2 + 40 {
        let edge = (0..SIZE[1]).find(|y| raw[at(x, *y)] > 0.0).expect("the plate is there");
        for i in (edge..edge + 4).map(|y| at(x, y)) {
            nearer.push(f64::from(raw[i] - smoothed[i]));
            turned.push(degrees(decode_normal(normals[i]).as_dvec3(), normal));
        }
    }
    [nearer, turned].map(|v| v.iter().sum::<f64>() / v.len() as f64)
}

#[test]
fn depths_warp_at_boundaries_under_filters_and_not_under_planes() {
    each_driver(|driver| {
        let [filtered, fitted] = ["bilateral", "plane-fit"].map(|smooth| warped(driver, smooth));
        println!("{}: radii nearer, degrees turned: bilateral {filtered:?}, plane-fit {fitted:?}", driver.name);
        assert!(filtered[0] > 0.5 && filtered[1] > 10.0, "{}: bilateral {filtered:?}", driver.name);
        assert!(fitted[0].abs() < 0.05 && fitted[1] < 2.0, "{}: plane-fit {fitted:?}", driver.name);
    });
}

/// The flattened look of splashes that Imai16 finds in Imai14: how much of a droplet's relief is left, as the spread of its
/// front depths within 0.9 of its rim over what it was.
fn relief(driver: &Driver, method: &str) -> f64 {
    let ball = sphere(Vec3::new(0.1, 0.05, 0.0), RADIUS);
    // Something of the body's, for imai16 has none of its maps otherwise.
    let body = sphere(Vec3::new(-0.3, 0.05, 0.0), RADIUS);
    let particles = Particles { radius: RADIUS, ellipsoids: vec![ball, body], splash_count: 1 };
    let camera = view(Vec3::new(0.1, 0.05, 1.5), Vec3::new(0.1, 0.05, 0.0), 30.0);
    let case = Case { particles, camera, settings: preset(method), size: SIZE, eye_inside: false };
    let shot: Shot = driver.shoot(&case);
    let names = driver.session.borrow().renderer.surfaces();
    let found = shot.floats(names.splash_depth.or(names.body_depth).unwrap(), SIDE_FRONT).unwrap();
    let q = Quadric::new(&ball);
    let (mut own, mut seen) = (Vec::new(), Vec::new());
    for p in pixels(&case, &shot) {
        let middle = ball.center.as_dvec3() - p.eye;
        if middle.cross(p.dir).length() < 0.9 * f64::from(RADIUS) {
            let near = q.crossings(p.eye, p.dir).expect("within the rim").0;
            own.push(near * p.slant / f64::from(RADIUS));
            seen.push(f64::from(found[p.index]));
        }
    }
    let spread = |v: &[f64]| {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        (v.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / v.len() as f64).sqrt()
    };
    assert!(own.len() > 500, "{}: {}", driver.name, own.len());
    spread(&seen) / spread(&own)
}

#[test]
fn droplets_are_not_flattened() {
    each_driver(|driver| {
        let [before, after] = ["imai14", "imai16"].map(|method| relief(driver, method));
        println!("{}: relief left: imai14 {before:.3}, imai16 {after:.6}", driver.name);
        assert!(before < 0.6, "{}: imai14 {before}", driver.name);
        assert!((after - 1.0).abs() < 1e-3, "{}: imai16 {after}", driver.name);
    });
}
