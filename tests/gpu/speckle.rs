//! No speckle: where light goes behind the liquid of jittered particles, beside the closed form of the body that they fill.

use crate::{
    analytic::{Pixel, Quadric, SIZE, case, pixels, through, view},
    support::{Choose, Random, each_driver, imai16, sphere},
    walk::degrees,
};
use glam::{DVec3, Vec3};
use meniscus::{
    Ellipsoid, Settings,
    prepare::{Input, Options, prepare},
    shader::{OUTCOME_HIT, OUTCOME_NO_LIQUID},
};

/// The default ellipsoids of a lattice of spacing 2 r, whose particles lie up to a quarter of a radius off along each axis.
fn jittered(half: i32, offset: f32, keep: impl Fn(Vec3) -> bool) -> Vec<Ellipsoid> {
    let (mut random, range) = (Random(11), -half..=half);
    let grid = range.clone().flat_map(|x| range.clone().flat_map(move |y| (-half..=half).map(move |z| [x, y, z])));
    let lattice = grid.map(|p| 2.0 * Vec3::from(p.map(|k| k as f32)) + offset).filter(|p| keep(*p));
    let positions: Vec<Vec3> = lattice.map(|p| p + random.point(Vec3::splat(-0.25), Vec3::splat(0.25))).collect();
    let (particles, _) = prepare(&Input::new(&positions, 1.0), &Options::default()).expect("they are finite");
    assert_eq!(particles.splash_count, 0);
    particles.ellipsoids
}

/// Whether a pixel's direction differs by more than 10° from those of all eight around it, where light came through there.
fn stands_out(all: &[Pixel], p: &Pixel) -> bool {
    let (width, height) = (SIZE[0] as usize, SIZE[1] as usize);
    let (x, y) = (p.index % width, p.index / width);
    let around = (0..9).filter(|k| *k != 4).map(|k| (x + k % 3, y + k / 3)); // one too far
    around.filter(|(x, y)| (1..=width).contains(x) && (1..=height).contains(y)).all(|(x, y)| {
        let other = &all[(y - 1) * width + x - 1];
        other.outcome != OUTCOME_NO_LIQUID && degrees(other.found, p.found) > 10.0
    })
}

/// The shares of pixels whose final direction is within 3°, and that stand out, of those for which one is expected.
fn shares(what: &str, all: &[Pixel], expected: impl Fn(&Pixel) -> Option<DVec3>) -> [f64; 2] {
    let covered: Vec<(&Pixel, DVec3)> = all.iter().filter_map(|p| Some((p, expected(p)?))).collect();
    assert!(covered.len() > 5000, "{what}: {} pixels", covered.len());
    let share = |count: usize| count as f64 / covered.len() as f64;
    let within = share(covered.iter().filter(|(p, e)| degrees(p.found, *e) <= 3.0).count());
    let outliers = share(covered.iter().filter(|(p, _)| stands_out(all, p)).count());
    println!("{what}: {} pixels, {within:.4} within 3 degrees, {outliers:.5} stand out", covered.len());
    assert!(covered.iter().all(|(p, _)| p.outcome == OUTCOME_HIT), "{what}: walls are missed");
    [within, outliers]
}

/// A particle is 2.5 pixels in radius, as in a dam break that is seen whole.
fn seen(tilt: f32) -> meniscus::Camera {
    view(180.0 * Vec3::new(tilt.sin(), 0.3 * tilt, tilt.cos()), Vec3::ZERO, 30.0)
}

fn smooth() -> Settings {
    imai16().iterations(5) // Imai16's, of its steps
}

#[test]
fn light_leaves_a_jittered_slab_as_it_came() {
    let case = case(1.0, &[], &jittered(26, 0.0, |p| p.z.abs() <= 6.5), seen(0.3), smooth());
    each_driver(|driver| {
        let all = pixels(&case, &driver.shoot(&case));
        let [within, outliers] = shares(&format!("{}: slab", driver.name), &all, |p| {
            // Through both faces, away from the others.
            let through = [7.0, -7.0].map(|z| p.eye + (z - p.eye.z) / p.dir.z * p.dir);
            through.iter().all(|x| x.x.abs().max(x.y.abs()) < 48.0).then_some(p.dir)
        });
        assert!(within >= 0.99 && outliers <= 0.002, "{}: {within}, {outliers}", driver.name);
    });
}

#[test]
fn light_leaves_a_jittered_ball_as_a_balls() {
    let ball = jittered(14, 1.0, |p| p.length() <= 23.5);
    // Of as much volume as these particles of (2 r)^3 each.
    let radius = (ball.len() as f64 * 6.0 / std::f64::consts::PI).cbrt();
    let case = case(1.0, &[], &ball, seen(0.3), smooth());
    let whole = Quadric::new(&sphere(Vec3::ZERO, radius as f32));
    each_driver(|driver| {
        let all = pixels(&case, &driver.shoot(&case));
        let [within, outliers] = shares(&format!("{}: ball", driver.name), &all, |p| {
            let rim = (-p.eye).cross(p.dir).length() / radius > 0.8;
            (!rim).then(|| through(&whole, p.eye, p.dir, 4).expect("it is met").0.dir)
        });
        assert!(within >= 0.97 && outliers <= 0.002, "{}: {within}, {outliers}", driver.name);
    });
}
