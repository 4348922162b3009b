//! Where the study finds the surface of a field that the device has built: exactly.

use crate::{
    field::{prepared, settings, shoot, words},
    support::{Case, Random, camera, each_driver},
};
use glam::{DVec3, Vec3};
use meniscus::{
    layers::field::{Field, twin::Lattice},
    shader::SPLASH_RADIUS,
    space::Space,
    study::built_field::BuiltField,
};

/// A block with drops around it.
fn scene() -> Vec<Vec3> {
    let mut random = Random(5);
    let mut all: Vec<Vec3> = Vec::new();
    for i in 0..7 * 5 * 6 {
        let at = Vec3::new((i % 7) as f32, (i / 7 % 5) as f32, (i / 35) as f32);
        all.push(0.05 * (2.0 * at + random.point(Vec3::splat(-0.4), Vec3::splat(0.4))) - Vec3::new(0.3, 0.2, 0.25));
    }
    all.extend((0..30).map(|_| random.point(Vec3::splat(-0.6), Vec3::splat(0.6))));
    all
}

/// What a ray meets is the level or a ball, nothing is before it, and where it meets nothing there is nothing.
#[test]
fn rays_meet_the_level_first() {
    let field = Field::default();
    let size = [32, 24];
    let base = crate::shape::empty(0.05);
    let case = Case {
        settings: settings(field, "four"),
        camera: camera(Vec3::new(0.4, 0.7, 2.0), Vec3::ZERO, size),
        size,
        ..base
    };
    let (case, radius) = (prepared(&scene(), &case), 0.05f32);
    each_driver(|driver| {
        let (shot, _) = shoot(driver, &scene(), &case);
        let built = BuiltField::new(words(&shot).bricks(), &field, radius).expect("a field");
        let space = Space::of(&case.particles);
        let twin = built.twin(&space);
        let lattice = Lattice::new(&field, radius);
        // World to the twin's own places, which count from its base node.
        let scale = lattice.ball / f64::from(SPLASH_RADIUS * radius) / lattice.spacing;
        let place = |x: DVec3| (x - space.origin) * scale + twin.part;
        let balls: Vec<DVec3> = words(&shot)
            .bricks()
            .iter()
            .flat_map(|(p, b)| {
                b.balls.iter().map(move |c| 4.0 * DVec3::from(p.map(f64::from)) + DVec3::from(c.map(f64::from)))
            })
            .collect();
        let ball = lattice.ball / lattice.spacing;
        let to_nearest = |x: DVec3| balls.iter().map(|c| c.distance(x * scale) - ball).fold(f64::INFINITY, f64::min);
        let mut random = Random(9);
        let (mut walls, mut drops, mut beside) = (0, 0, 0);
        for i in 0..200 {
            let origin = 2.0 * random.point(Vec3::splat(-1.0), Vec3::splat(1.0)).normalize().as_dvec3();
            let mut aim = random.point(Vec3::splat(-0.6), Vec3::splat(0.6)).as_dvec3();
            // Along an axis, too.
            if i % 5 == 0 {
                aim = origin * DVec3::AXES[i / 5 % 3].map(|a| 1.0 - a);
            }
            let dir = (aim - origin).normalize();
            let hit = built.first(origin, dir);
            let end = hit.map_or(4.0, |h| h.0);
            let outside = |t: f64| twin.at(place(origin + t * dir)) < 0.5 && to_nearest(origin + t * dir) > -0.01;
            let early = (0..400).map(|k| end * (f64::from(k) + 0.5) / 401.0).find(|t| !outside(*t));
            assert_eq!(early, None, "{}: ray {i} is in the liquid before {hit:?}", driver.name);
            let Some((t, normal)) = hit else {
                beside += 1;
                continue;
            };
            let at = origin + t * dir;
            assert!(built.holds(at + 0.02 * 0.05 * dir) || normal.dot(dir).abs() < 0.2, "{}: ray {i}", driver.name);
            assert!(
                (normal.length() - 1.0).abs() < 1e-6 && normal.dot(dir) < 0.3,
                "{}: {normal} along {dir}",
                driver.name
            );
            if to_nearest(at).abs() < 0.02 {
                drops += 1;
            } else {
                assert!(twin.at(place(at)).abs() < 0.05, "{}: {} at {at}", driver.name, twin.at(place(at)));
                walls += 1;
            }
        }
        println!("  {walls} walls, {drops} drops, {beside} beside");
        assert!(walls > 40 && drops > 15 && beside > 20, "{}: {walls} {drops} {beside}", driver.name);
    });
}
