//! Verdicts of the cull pass: the twin's, never against a particle that shows. What it drops, whether it chooses points
//! or quads, and in which order particles came: none of it changes a bit.

use crate::{
    splat::{TARGETS, case, packed},
    support::{Case, Choose, Driver, Random, Shot, camera, each_driver, random_cloud, sphere},
};
use glam::{Mat3, Vec3};
use meniscus::{
    Camera, Ellipsoid, Particles,
    prepare::{Input, Options, prepare},
    shader::{CLASS_BODY, CLASS_SPLASH, SIDE_BACK, SIDE_FRONT, VISIBLE_BACK, VISIBLE_BODY, VISIBLE_FRONT},
    twin::{cull::cull, occlude::Bounds, splat::splat},
};

/// Counters of what is drawn, by class and side.
pub const DRAWN: [&str; 4] = ["splash_drawn_front", "splash_drawn_back", "body_drawn_front", "body_drawn_back"];

/// Every layer of depth and normals and the picture have the same bits.
pub fn assert_same(a: &Shot, b: &Shot, what: &str) {
    for id in TARGETS.iter().flat_map(|(d, n)| [*d, *n]) {
        for side in [SIDE_FRONT, SIDE_BACK] {
            assert!(a.words(id, side) == b.words(id, side), "{what}: {id:?} {side} differs");
        }
    }
    let bits = |s: &Shot| s.picture.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert!(bits(a) == bits(b), "{what}: the picture differs");
}

/// Whether the cull pass chose quads for a class.
pub fn drawn_as_quads(shot: &Shot, class: u32) -> bool {
    let draws = &shot.words("indirect draws", 0).expect("there are particles")[16 * class as usize..][..8];
    let quads = draws[5] > 0;
    assert!(quads != (draws[0] > 0), "either points or quads: {draws:?}");
    quads
}

/// Splash and body from the same ellipsoids.
pub fn both(radius: f32, ellipsoids: &[Ellipsoid]) -> Particles {
    Particles { radius, ellipsoids: ellipsoids.repeat(2), splash_count: ellipsoids.len() }
}

/// Particles that cross the near plane (at 0.5), touch it, hold the camera, and lie behind it; some ordinary ones.
pub fn around_the_near_plane() -> Case {
    let size = [160, 120];
    let stretched = Mat3::from_rotation_x(0.6) * Mat3::from_diagonal(Vec3::new(0.03, 0.12, 0.3));
    let ellipsoids = vec![
        sphere(Vec3::new(-0.12, 0.1, -0.5), 0.1),
        sphere(Vec3::new(0.2, 0.1, -0.42), 0.1),
        sphere(Vec3::new(0.1, -0.1, -0.61), 0.1),
        Ellipsoid { center: Vec3::new(-0.1, -0.12, -0.4), axes: stretched },
        sphere(Vec3::new(0.0, 0.0, 0.3), 0.2),
        sphere(Vec3::new(0.0, 0.0, -0.35), 0.1),
        sphere(Vec3::new(0.0, 0.05, -1.2), 0.3),
        sphere(Vec3::new(-0.25, 0.0, -0.9), 0.1),
    ];
    let particles = both(0.1, &ellipsoids);
    let mut case = case(particles, camera(Vec3::ZERO, Vec3::NEG_Z, size), size);
    case.camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 45f32.to_radians(), 160.0 / 120.0, 0.5);
    case
}

/// Verdicts of one class as the GPU has them.
fn verdicts(shot: &Shot, particles: &Particles, class: u32) -> Vec<u32> {
    let (splash, body) =
        shot.words("visible particles", 0).expect("there are particles").split_at(particles.splash_count);
    let (words, mark) = if class == CLASS_SPLASH { (splash, 0) } else { (body, VISIBLE_BODY) };
    assert!(words.iter().all(|v| *v == 0 || v & VISIBLE_BODY == mark), "every particle knows its class");
    words.iter().map(|v| v & (VISIBLE_FRONT | VISIBLE_BACK)).collect()
}

/// Largest point of a driver, in pixels.
pub fn point_size(driver: &Driver) -> f64 {
    f64::from(driver.gpu().info.point_size)
}

/// Compares with the twin on the GPU's own bounds, and with what every particle, drawn, would show.
fn check(driver: &Driver, case: &Case, what: &str) -> Shot {
    let shot = driver.shoot(case);
    for class in [CLASS_SPLASH, CLASS_BODY] {
        let particles = packed(&case.particles, class);
        if particles.is_empty() {
            continue;
        }
        let label = format!("{}: {what}: class {class}", driver.name);
        // Splash particles are never tested against the body: the two volumes overlap.
        let bounds = shot.words("body depth bounds", 0).filter(|_| class == CLASS_BODY).map(Bounds::from_words);
        let sides = if case.settings.walk().refractions == 1 { 1 } else { 2 };
        let want = cull(&shot.frame, &particles, bounds.as_ref(), sides);
        let got = verdicts(&shot, &case.particles, class);
        // A rectangle's edge on a pixel's centre, or a depth that equals a bound, may go either way in float32.
        let differ = got.iter().zip(&want.verdicts).filter(|(a, b)| a != b).count();
        println!("{label}: {:?} of {} show, {differ} differ", want.counts, got.len());
        assert!(differ <= got.len() / 1000 + 1, "{label}: {differ} verdicts differ");
        // The words and the counters come from the same shader: these agree exactly.
        for side in [SIDE_FRONT, SIDE_BACK] {
            let count = got.iter().filter(|v| *v & (1 << side) != 0).count();
            assert_eq!(shot.counter(DRAWN[(2 * class + side) as usize]) as usize, count, "{label} side {side}");
        }
        let limit = point_size(driver);
        if (want.largest_point - limit).abs() > 0.1 {
            let quads = want.largest_point > limit || case.settings.drawing.quads_only;
            assert_eq!(drawn_as_quads(&shot, class), quads, "{label}: {} px", want.largest_point);
        }
        // Any pixel's surface, if float32 can tell it from its rivals', belongs to a particle that is drawn.
        for side in [SIDE_FRONT, SIDE_BACK].into_iter().take(sides as usize) {
            for surface in splat(&shot.frame, &particles, &vec![3; particles.len()], side) {
                let sure = surface.margin > 1e-4 && surface.silhouette > 2e-3;
                if surface.depth != 0.0 && sure {
                    assert!(got[surface.particle] & (1 << side) != 0, "{label}: {surface:?} is hidden");
                }
            }
        }
    }
    shot
}

/// Same picture without occlusion culling; returns the shares of the body's fronts and backs that it dropped.
fn changes_no_bit(driver: &Driver, case: &Case, what: &str) -> [f64; 2] {
    let on = check(driver, case, what);
    let mut off = case.clone();
    off.settings = off.settings.occlusion_culling(false);
    let off = driver.shoot(&off);
    assert!(off.words("body depth bounds", 0).is_none(), "nothing is bounded that nobody reads");
    assert_same(&on, &off, &format!("{}: {what}", driver.name));
    [SIDE_FRONT, SIDE_BACK].map(|side| {
        let drawn = |shot: &Shot| f64::from(shot.counter(DRAWN[(2 * CLASS_BODY + side) as usize]));
        1.0 - drawn(&on) / drawn(&off)
    })
}

#[test]
fn culling_of_dense_clouds_changes_no_bit() {
    let size = [160, 120];
    let eye = camera(Vec3::new(0.5, 0.4, 1.9), Vec3::ZERO, size);
    each_driver(|driver| {
        for (seed, radius, body) in [(1, 0.03, 6000), (2, 0.09, 1500)] {
            let cloud = random_cloud(seed, radius, Vec3::splat(-0.5), Vec3::splat(0.5), 30, body);
            let dropped = changes_no_bit(driver, &case(cloud, eye, size), &format!("cloud {seed}"));
            assert!(dropped[0] > 0.1 && dropped[1] > 0.1, "{}: {dropped:?}", driver.name);
        }
    });
}

#[test]
#[cfg(feature = "io")]
fn culling_of_a_real_frame_drops_a_third_and_changes_no_bit() {
    let case = crate::splat::dam_break();
    each_driver(|driver| {
        let dropped = changes_no_bit(driver, case, "dam break");
        println!("{}: dropped {dropped:?}", driver.name);
        assert!(dropped[0] > 1.0 / 3.0 && dropped[1] > 1.0 / 3.0, "{}: {dropped:?}", driver.name);
    });
}

#[test]
fn particles_at_the_near_plane_are_kept() {
    let crossing = around_the_near_plane();
    let mut fronts = crossing.clone();
    fronts.settings = fronts.settings.refractions(1);
    each_driver(|driver| {
        changes_no_bit(driver, &crossing, "near plane");
        let shot = check(driver, &fronts, "fronts only");
        assert!(shot.words("visible particles", 0).unwrap().iter().all(|v| v & 2 == 0), "{}", driver.name);
    });
}

#[test]
fn particles_outside_the_view_are_dropped() {
    // Tangent of half the view: 0.414 high, 0.552 wide. A sphere's tangent plane tells on which side of an edge it is:
    // centres 0.02 beyond the touching position are outside, 0.02 before it inside.
    let (size, r) = ([160, 120], 0.1f32);
    let half = [0.414_213_56f32 * 160.0 / 120.0, 0.414_213_56];
    let mut ellipsoids = Vec::new();
    for outside in [false, true] {
        let by = if outside { 0.02 } else { -0.02 };
        for (axis, edge) in half.into_iter().enumerate() {
            for sign in [-1.0, 1.0] {
                // At depth 2 the plane x = edge d is touched from outside at x = 2 edge + r sqrt(1 + edge²).
                let mut at = Vec3::new(0.0, 0.0, -2.0);
                at[axis] = sign * (2.0 * edge + r * (1.0 + edge * edge).sqrt() + by);
                ellipsoids.push(sphere(at, r));
            }
        }
        // The near plane lies at 0.01.
        ellipsoids.push(sphere(Vec3::new(0.0, 0.0, r - 0.01 + by), r));
    }
    let splash_count = ellipsoids.len();
    ellipsoids.extend_from_within(..);
    let particles = Particles { radius: r, ellipsoids, splash_count };
    let mut case = case(particles, camera(Vec3::ZERO, Vec3::NEG_Z, size), size);
    case.settings = case.settings.occlusion_culling(false);
    each_driver(|driver| {
        let shot = check(driver, &case, "edges of the view");
        for class in [CLASS_SPLASH, CLASS_BODY] {
            let got = verdicts(&shot, &case.particles, class);
            assert_eq!(got, [3, 3, 3, 3, 3, 0, 0, 0, 0, 0], "{}: class {class}", driver.name);
        }
    });
}

#[test]
fn quads_draw_what_points_draw() {
    let size = [160, 120];
    let cloud = random_cloud(11, 0.08, Vec3::splat(-0.9), Vec3::splat(0.9), 60, 600);
    let cases = [around_the_near_plane(), case(cloud, camera(Vec3::new(0.5, 0.3, 1.9), Vec3::ZERO, size), size)];
    each_driver(|driver| {
        for points in &cases {
            let mut quads = points.clone();
            quads.settings = quads.settings.quads_only(true);
            let (a, b) = (driver.shoot(points), driver.shoot(&quads));
            assert!(!drawn_as_quads(&a, CLASS_BODY) && drawn_as_quads(&b, CLASS_BODY), "{}", driver.name);
            assert_same(&a, &b, &driver.name);
        }
    });
}

#[test]
fn the_order_of_input_changes_no_bit() {
    let (size, radius) = ([160, 120], 0.05);
    let mut random = Random(3);
    let mut positions: Vec<_> = (0..700).map(|_| random.point(Vec3::splat(-0.4), Vec3::splat(0.4))).collect();
    positions.extend((0..40).map(|_| random.point(Vec3::splat(-0.9), Vec3::splat(0.9))));
    positions.extend_from_within(0..40); // at the same place: exact ties in depth
    let prepared = |positions: &[Vec3]| {
        let input = Input::new(positions, radius);
        prepare(&input, &Options::default()).expect("valid").0
    };
    let camera = camera(Vec3::new(0.3, 0.4, 2.0), Vec3::ZERO, size);
    let sorted = case(prepared(&positions), camera, size);
    assert!(sorted.particles.splash_count > 0 && sorted.particles.body_count() > 0);
    for i in (1..positions.len()).rev() {
        positions.swap(i, random.between(0.0, i as f32 + 1.0) as usize);
    }
    let shuffled = case(prepared(&positions), camera, size);
    each_driver(|driver| assert_same(&driver.shoot(&sorted), &driver.shoot(&shuffled), &driver.name));
}
