//! Layers of all particles together: nearest and farthest surface, and one front surface with the thickness behind it.

use crate::{
    background::{HostScene, painted, z_at},
    cull::{around_the_near_plane, drawn_as_quads},
    splat::{TARGETS, Tolerance, case, check_layer, packed, tolerance},
    support::{Case, Choose, Driver, Random, Shot, camera, each_driver, random_cloud},
};
use glam::{DVec3, Vec3};
use meniscus::{
    Background, Method, Particles,
    layers::{front::twin as chords, nearest_farthest::twin::nearest_farthest},
    prepare::{Input, Options, prepare},
    shader::{CLASS_BODY, CLASS_SPLASH, Particle, SIDE_BACK, SIDE_FRONT},
    twin::quadric::pixel_ray,
};

const DEPTH: &str = "body depth (ray-cast)";
const NORMAL: &str = "body normal (ray-cast)";

/// The case with these layers, nothing smoothed.
fn with(case: &Case, layers: &str, optics: &str) -> Case {
    let mut case = case.clone();
    for (family, member) in [("layers", layers), ("smooth", "none"), ("optics", optics)] {
        case.settings.method.choose(family, member).expect("a member");
    }
    case.settings.validate().expect("they go together");
    case
}

fn all(particles: &Particles) -> Vec<Particle> {
    [CLASS_SPLASH, CLASS_BODY].into_iter().flat_map(|class| packed(particles, class)).collect()
}

/// Both sides against the twin.
fn check(driver: &Driver, case: &Case, what: &str, tolerance: Tolerance) -> Shot {
    let shot = driver.shoot(&with(case, "nearest-farthest", "two"));
    let want = nearest_farthest(&shot.frame, &all(&case.particles));
    for side in [SIDE_FRONT, SIDE_BACK] {
        let label = format!("{}: {what}: side {side} of all", driver.name);
        check_layer(&want[side as usize], &shot.floats(DEPTH, side).unwrap(), None, &shot, tolerance, &label);
    }
    shot
}

const SIZE: [u32; 2] = [160, 120];

/// Droplets and a body in one box; radii of so many pixels.
fn cloud(seed: u64, pixels: f32, splash: usize, body: usize) -> Case {
    let radius = pixels * 2.2 / 145.0;
    let particles = random_cloud(seed, radius, Vec3::splat(-0.7), Vec3::splat(0.7), splash, body);
    case(particles, camera(Vec3::new(0.4, 0.7, 2.1), Vec3::ZERO, SIZE), SIZE)
}

#[test]
fn nearest_and_farthest_are_the_twins() {
    each_driver(|driver| {
        for (seed, pixels, splash, body) in [(1, 1.0, 300, 2000), (2, 5.0, 60, 400), (3, 15.0, 20, 0), (4, 40.0, 0, 12)]
        {
            let case = cloud(seed, pixels, splash, body);
            check(driver, &case, &format!("radius {pixels} px"), tolerance(f64::from(pixels)));
        }
        let shot = check(driver, &around_the_near_plane(), "near plane", tolerance(30.0));
        let (near, front) = (shot.frame.near, shot.floats(DEPTH, SIDE_FRONT).unwrap());
        let inside = front.iter().filter(|d| **d == -near).count();
        assert!(inside > 200 && front.iter().any(|d| *d > 0.0), "{}: {inside}", driver.name);
        // Light that bends once meets no far side.
        let one = driver.shoot(&with(&cloud(2, 5.0, 60, 400), "nearest-farthest", "one"));
        assert!(one.words(DEPTH, SIDE_FRONT).is_some() && one.words(DEPTH, SIDE_BACK).is_none(), "{}", driver.name);
    });
}

/// Particles in another order, ties in depth among them, and as quads in place of points: not a bit of the surfaces changes,
/// and the thickness by no more than the order of its sum.
#[test]
fn order_and_primitives_do_not_show() {
    let mut random = Random(3);
    let mut positions: Vec<_> = (0..500).map(|_| random.point(Vec3::splat(-0.4), Vec3::splat(0.4))).collect();
    positions.extend((0..40).map(|_| random.point(Vec3::splat(-0.9), Vec3::splat(0.9))));
    positions.extend_from_within(0..40);
    let prepared = |positions: &[Vec3]| {
        let input = Input::new(positions, 0.05);
        prepare(&input, &Options::default()).expect("valid").0
    };
    let view = camera(Vec3::new(0.3, 0.4, 2.0), Vec3::ZERO, SIZE);
    let sorted = case(prepared(&positions), view, SIZE);
    // Drawn in the opposite order, without being sorted anew.
    let mut turned = sorted.clone();
    let (splash, body) = turned.particles.ellipsoids.split_at_mut(sorted.particles.splash_count);
    assert!(!splash.is_empty() && !body.is_empty());
    splash.reverse();
    body.reverse();
    let mut quads = sorted.clone();
    quads.settings = quads.settings.quads_only(true);
    each_driver(|driver| {
        for (what, other) in [("turned", &turned), ("quads", &quads)] {
            let [a, b] = [&sorted, other].map(|case| driver.shoot(&with(case, "nearest-farthest", "two")));
            assert_eq!(drawn_as_quads(&b, CLASS_BODY), what == "quads", "{}", driver.name);
            for side in [SIDE_FRONT, SIDE_BACK] {
                assert!(a.words(DEPTH, side) == b.words(DEPTH, side), "{}: {what}: side {side}", driver.name);
            }
            let [a, b] = [&sorted, other].map(|case| driver.shoot(&with(case, "front", "ssfr")));
            assert!(a.words(DEPTH, 0) == b.words(DEPTH, 0) && a.words(NORMAL, 0) == b.words(NORMAL, 0), "{what}");
            let [a, b] = [&a, &b].map(|shot| shot.floats("thickness", 0).expect("asked for"));
            let most = a.iter().zip(&b).map(|(a, b)| (a - b).abs() / a.max(1.0)).fold(0.0, f32::max);
            println!("{}: {what}: thickness differs by {most:.1e} of itself at most", driver.name);
            assert!(most < 1e-5, "{}: {what}: {most}", driver.name);
        }
    });
}

/// One front surface is the nearer of both classes', with its normal.
#[test]
fn the_front_is_the_nearer_of_both() {
    each_driver(|driver| {
        for (what, case) in [("cloud", cloud(2, 5.0, 60, 400)), ("near plane", around_the_near_plane())] {
            let (apart, together) =
                (driver.shoot(&with(&case, "split", "one")), driver.shoot(&with(&case, "front", "one")));
            let of = |class: u32| {
                let (depth, normal) = TARGETS[class as usize];
                (apart.floats(depth, 0).unwrap(), apart.words(normal, 0).unwrap())
            };
            let classes = [of(CLASS_SPLASH), of(CLASS_BODY)];
            let (depth, normal) = (together.floats(DEPTH, 0).unwrap(), together.words(NORMAL, 0).unwrap());
            let (mut from, mut tied) = ([0, 0], 0);
            for i in 0..depth.len() {
                let [a, b] = classes.each_ref().map(|(d, _)| if d[i] == 0.0 { f32::INFINITY } else { d[i].abs() });
                let nearer = usize::from(b < a);
                let want = if a.min(b).is_finite() { classes[nearer].0[i] } else { 0.0 };
                // The depth test tells near / d apart, which has coarser steps.
                if (a - b).abs() < 1e-4 {
                    assert!((depth[i] - want).abs() < 1e-4, "{}: {what}: pixel {i}", driver.name);
                    tied += 1;
                    continue;
                }
                assert_eq!(depth[i], want, "{}: {what}: pixel {i}", driver.name);
                assert!(want <= 0.0 || normal[i] == classes[nearer].1[i], "{}: {what}: normal {i}", driver.name);
                from[nearer] += usize::from(want != 0.0);
            }
            println!("{}: {what}: {from:?} pixels of splash and body, {tied} of both", driver.name);
            assert!(what != "cloud" || from.iter().all(|n| *n > 500), "{}: {from:?}", driver.name);
            assert!(together.words("thickness", 0).is_none(), "{}: nobody asks for it", driver.name);
        }
    });
}

/// Thickness against the sum of the chords; how many pixels have liquid. `scene` in particle radii.
fn check_thickness(driver: &Driver, shot: &Shot, particles: &Particles, scene: Option<&[f64]>, what: &str) -> usize {
    let want = chords::thickness(&shot.frame, &all(particles), scene);
    let (mut wet, mut most, mut least_slack) = (0, 0.0f64, f64::INFINITY);
    for (i, (found, want)) in shot.floats("thickness", 0).expect("asked for").into_iter().zip(&want).enumerate() {
        let off = (f64::from(found) - want.length).abs();
        assert!(off <= want.slack, "{}: {what}: pixel {i} has {found}, {off} off {want:?}", driver.name);
        if want.length > 0.0 {
            (wet, most, least_slack) = (wet + 1, most.max(off / want.length.max(1.0)), least_slack.min(want.slack));
        }
    }
    let mut slacks: Vec<_> = want.iter().filter(|w| w.length > 0.0).map(|w| w.slack / w.length).collect();
    slacks.sort_by(f64::total_cmp);
    let middle = slacks[slacks.len() / 2];
    println!("{}: {what}: {wet} pixels, {most:.1e} off at most, slack of {middle:.1e} in the middle", driver.name);
    // What is allowed tells a chord from none.
    assert!(middle < 5e-3, "{}: {what}: {middle}", driver.name);
    wet
}

#[test]
fn thickness_is_the_sum_of_chords() {
    each_driver(|driver| {
        for (seed, pixels, splash, body) in [(1, 2.0, 300, 2000), (2, 6.0, 60, 400), (3, 20.0, 20, 0)] {
            let case = with(&cloud(seed, pixels, splash, body), "front", "ssfr");
            let (shot, what) = (driver.shoot(&case), format!("radius {pixels} px"));
            let wet = check_thickness(driver, &shot, &case.particles, None, &what);
            assert!(wet > 3000, "{}: {what}: {wet}", driver.name);
        }
        let case = with(&around_the_near_plane(), "front", "ssfr-index");
        check_thickness(driver, &driver.shoot(&case), &case.particles, None, "near plane");
    });
}

/// No liquid counts behind what the host has drawn, and half a particle as much as lies before it.
#[test]
fn thickness_ends_at_the_hosts_scene() {
    let case = with(&cloud(2, 8.0, 60, 400), "front", "ssfr");
    // Before, among and behind the particles, slanted, and nothing.
    let scene = painted(SIZE, |x, y| match (x / 20 + y / 20) % 4 {
        0 => 1.2,
        1 => 2.1 + 0.002 * f64::from(x),
        2 => 4.0,
        _ => f64::INFINITY,
    });
    each_driver(|driver| {
        let images = HostScene::new(driver.gpu(), &case.camera, SIZE, &scene);
        let shot = driver.shoot_before(&case, images.input(), Background::Environment);
        // As the depth buffer holds it.
        let (scale, offset) = (f64::from(shot.frame.scene_z_scale), f64::from(shot.frame.scene_z_offset));
        let linear = |d: &f64| if d.is_finite() { offset / (f64::from(z_at(&case.camera, *d)) + scale) } else { *d };
        let depth: Vec<f64> = scene.0.iter().map(linear).collect();
        let wet = check_thickness(driver, &shot, &case.particles, Some(&depth), "before a scene");
        let free = check_thickness(driver, &driver.shoot(&case), &case.particles, None, "without");
        assert!(wet > 2000 && wet + 1000 < free, "{}: {wet} of {free}", driver.name);
    });
}

/// A ball in closed form: 2 (r² - p²)^½ where the ray passes its centre at the distance p.
#[test]
fn a_ball_is_as_thick_as_its_chord() {
    let (r, center) = (0.25f32, Vec3::new(0.4, -0.25, -1.5));
    let ball = Particles { radius: r, ellipsoids: vec![crate::support::sphere(center, r)], splash_count: 1 };
    let case = with(&case(ball, camera(Vec3::ZERO, Vec3::NEG_Z, SIZE), SIZE), "front", "ssfr");
    assert_eq!(case.settings.method.layers, Method::preset("green10").expect("a preset").layers);
    each_driver(|driver| {
        let shot = driver.shoot(&case);
        let mut seen = 0;
        for (i, found) in shot.floats("thickness", 0).unwrap().into_iter().enumerate() {
            let v: DVec3 = pixel_ray(&shot.frame, i as u32 % SIZE[0], i as u32 / SIZE[0]).normalize();
            let p = v.cross(center.as_dvec3()).length() / f64::from(r);
            let want = 2.0 * (1.0 - p * p).max(0.0).sqrt();
            // At the rim an error of 1e-6 radii sideways is one of 1e-3 along the ray.
            let off = (f64::from(found) - want).abs();
            assert!(off < 2e-5 || off * want < 1e-5 || (p - 1.0).abs() < 1e-5, "{}: {i}: {found} {want}", driver.name);
            seen += usize::from(want > 0.0);
        }
        assert!(seen > 700, "{}: {seen}", driver.name);
    });
}
