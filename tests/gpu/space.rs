//! The same liquid at another scale, in another place, in a left-handed world: the same picture.

use crate::{
    cull::assert_same,
    support::{Case, Choose, Cloud, Driver, Random, Shot, camera, each_driver, imai16, random_cloud},
};
use glam::{Mat3, Mat4, Vec3};
use meniscus::{
    Camera, Ellipsoid, Particles,
    prepare::{Input, Options, Search, prepare},
};

const SIZE: [u32; 2] = [160, 120];
/// As far as radii may go.
const SCALES: [f32; 8] = [1.1e-30, 1e-20, 1e-8, 1e-5, 1e5, 1e9, 1e20, 9e31];

/// A ball of liquid, jittered, with droplets around it; radius 0.1.
fn liquid() -> Vec<Vec3> {
    let mut random = Random(4);
    let axis = || (-4..=4).map(|i| 0.2 * i as f32);
    let lattice = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x, y, z))));
    let ball: Vec<_> = lattice.filter(|p| p.length() < 0.85).collect();
    let mut jittered: Vec<_> =
        ball.into_iter().map(|p| p + random.point(Vec3::splat(-0.02), Vec3::splat(0.02))).collect();
    jittered.extend([Vec3::new(1.2, 0.3, 0.1), Vec3::new(-1.1, -0.4, 0.5), Vec3::new(0.2, 1.1, 0.0)]);
    jittered
}

/// The whole scene `scale` times as large.
fn scaled(scale: f32, shift: Vec3) -> (Case, Vec<Vec3>) {
    let positions: Vec<_> = liquid().into_iter().map(|p| p * scale + shift).collect();
    let input = Input::new(&positions, 0.1 * scale);
    let particles = prepare(&input, &Options::default()).expect("prepared").0;
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let eye = Vec3::new(0.6, 0.8, 3.0) * scale + shift;
    let camera = Camera::look_at(eye, shift, Vec3::Y, 45f32.to_radians(), aspect, 0.01 * scale);
    let settings = imai16().absorption(Vec3::new(0.2, 0.6, 0.9) / scale);
    (Case { particles, camera, settings, size: SIZE, eye_inside: false }, positions)
}

/// Pixels whose light differs by more than a fiftieth.
fn different(a: &Shot, b: &Shot) -> usize {
    let far = |(a, b): &(&[f32; 3], &[f32; 3])| (0..3).any(|k| (a[k] - b[k]).abs() > 0.02 * (a[k].abs() + 0.5));
    a.picture.iter().zip(&b.picture).filter(far).count()
}

fn liquid_pixels(shot: &Shot) -> usize {
    shot.floats("walk (debug)", 0).expect("debug").chunks(4).filter(|w| w[0] != 0.0).count()
}

/// Rounding moves a ray here and there past a wall's edge, or the sun's.
fn assert_few_differ(driver: &Driver, what: &str, want: &Shot, got: &Shot) {
    let differ = different(want, got);
    println!("{}: {what}: {differ} of {} pixels differ", driver.name, liquid_pixels(want));
    assert!(liquid_pixels(want) > 2000, "{}: {what}", driver.name);
    assert!(differ <= 30, "{}: {what}: {differ} pixels differ", driver.name);
}

#[test]
fn every_scale_gives_the_same_picture() {
    let (case, positions) = scaled(1.0, Vec3::ZERO);
    each_driver(|driver| {
        let want = driver.shoot(&case);
        for scale in SCALES {
            assert_few_differ(driver, &format!("scale {scale:e}"), &want, &driver.shoot(&scaled(scale, Vec3::ZERO).0));
        }
        // A power of two rounds nothing at all.
        assert_same(&want, &driver.shoot(&scaled(2f32.powi(-60), Vec3::ZERO).0), &driver.name);
        for search in [Search::Runs, Search::Relation] {
            let want = driver.shoot_cloud(&case, &Cloud::new(&positions, search));
            for scale in SCALES {
                let (case, positions) = scaled(scale, Vec3::ZERO);
                let got = driver.shoot_cloud(&case, &Cloud::new(&positions, search));
                assert_few_differ(driver, &format!("{search:?}, scale {scale:e}"), &want, &got);
            }
        }
    });
}

#[test]
fn every_place_gives_the_same_picture() {
    let (case, positions) = scaled(1.0, Vec3::ZERO);
    // Coordinates are multiples of 2^-10 here, and so exact even far out.
    let snap = |v: f32| (v * 1024.0).round() / 1024.0;
    let (case, positions) = {
        let snapped: Vec<_> = positions.iter().map(|p| Vec3::new(snap(p.x), snap(p.y), snap(p.z))).collect();
        (case, snapped)
    };
    let at = |shift: Vec3| {
        let positions: Vec<_> = positions.iter().map(|p| *p + shift).collect();
        let input = Input::new(&positions, 0.125);
        let particles = prepare(&input, &Options::default()).expect("prepared").0;
        let mut camera = case.camera;
        camera.view *= Mat4::from_translation(-shift);
        (Case { particles, camera, ..case.clone() }, positions)
    };
    let shift = Vec3::new(4096.0, -2048.0, 1024.0);
    each_driver(|driver| {
        let (here, there) = (at(Vec3::ZERO), at(shift));
        // The camera's own translation rounds at a two-thousandth of a unit out there: half a hundredth of a radius.
        let (want, got) = (driver.shoot(&here.0), driver.shoot(&there.0));
        let off = covered_off(&want, &got);
        println!("{}: {off} outlines moved", driver.name);
        assert!(off < 100, "{}: {off} outlines moved", driver.name);
        let (want, got) = [&here, &there].map(|(c, p)| driver.shoot_cloud(c, &Cloud::new(p, Search::Runs))).into();
        assert!(covered_off(&want, &got) < 100, "{}: on the device", driver.name);
    });
}

/// Beyond what float32 has room for, it is said.
#[test]
fn radii_without_room_are_refused() {
    for scale in [1e-32, 1e33] {
        let positions: Vec<_> = liquid().into_iter().map(|p| p * scale).collect();
        let input = Input::new(&positions, 0.1 * scale);
        let said = prepare(&input, &Options::default()).expect_err("no room").to_string();
        assert!(said.contains("particle radius") && said.contains("1e-31 to 1e31"), "{said}");
    }
}

/// Pixels that only one of two frames covers.
fn covered_off(a: &Shot, b: &Shot) -> usize {
    let [a, b] = [a, b].map(|s| s.floats("body depth (ray-cast)", 0).expect("a body"));
    a.iter().zip(&b).filter(|(a, b)| (**a > 0.0) != (**b > 0.0)).count()
}

/// Mirrored at z = 0 with its camera, a scene has the same depths and normals, bit for bit, and mirrored directions.
#[test]
fn a_left_handed_world_is_drawn_as_its_mirror_image() {
    let mirror = Mat3::from_diagonal(Vec3::new(1.0, 1.0, -1.0));
    let right = random_cloud(3, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 20, 150);
    let mirrored = |e: &Ellipsoid| Ellipsoid { center: mirror * e.center, axes: mirror * e.axes };
    let left = Particles { ellipsoids: right.ellipsoids.iter().map(mirrored).collect(), ..right.clone() };
    let camera = camera(Vec3::new(0.4, 0.5, 2.2), Vec3::ZERO, SIZE);
    let mut mirrored_camera = camera;
    mirrored_camera.view *= Mat4::from_mat3(mirror);
    let case = |particles, camera| Case { particles, camera, settings: imai16(), size: SIZE, eye_inside: false };
    let right = case(right, camera);
    let left = case(left, mirrored_camera);
    left.camera.validate().expect("a reflection is rigid");
    each_driver(|driver| {
        let (a, b) = (driver.shoot(&right), driver.shoot(&left));
        for id in [
            "splash depth",
            "splash normal",
            "body depth (ray-cast)",
            "body normal (ray-cast)",
            "body depth (smoothed, even)",
            "body normal (smoothed)",
        ] {
            for layer in 0..2 {
                assert!(a.words(id, layer) == b.words(id, layer), "{}: {id:?} {layer}", driver.name);
            }
        }
        assert!(a.words("walk (debug)", 0) == b.words("walk (debug)", 0), "{}: walks", driver.name);
        let directions = [&a, &b].map(|s| s.floats("final direction (debug)", 0).expect("debug"));
        for (a, b) in directions[0].chunks(4).zip(directions[1].chunks(4)) {
            assert!([a[0], a[1], -a[2]] == [b[0], b[1], b[2]], "{}: {a:?} {b:?}", driver.name);
        }
    });
}

/// A hundred thousand particles on one spot, and thousands on two others: linear time, and drawn as one each.
#[test]
fn crowds_take_no_longer_than_liquid() {
    let spots = [(100_000, Vec3::ZERO), (5_000, Vec3::new(1.1, 0.0, 0.0)), (3, Vec3::new(-1.1, 0.2, 0.0))];
    let positions: Vec<_> = spots.iter().flat_map(|(n, p)| vec![*p; *n]).collect();
    let start = std::time::Instant::now();
    let input = Input::new(&positions, 0.1);
    let (particles, report) = prepare(&input, &Options::default()).expect("prepared");
    println!("{} s on the CPU", start.elapsed().as_secs_f64());
    // All pairs would be ten thousand million, twice over.
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
    assert_eq!((report.body, report.degenerate, report.few_neighbours), (105_003, 0, 0), "{report:?}");
    let case = Case {
        particles,
        camera: camera(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, SIZE),
        settings: imai16().refractions(1),
        size: SIZE,
        eye_inside: false,
    };
    each_driver(|driver| {
        let start = std::time::Instant::now();
        let (host, device) =
            (driver.shoot(&case), driver.shoot_cloud_unlisted(&case, &Cloud::new(&positions, Search::Runs)));
        println!("{}: {} s", driver.name, start.elapsed().as_secs_f64());
        for (what, shot) in [("host", &host), ("device", &device)] {
            let drawn = shot.counter("body_drawn_front");
            assert_eq!(drawn, 3, "{}: {what}: {drawn} drawn", driver.name);
            assert!(shot.floats("body depth (ray-cast)", 0).expect("drawn").iter().filter(|d| **d > 0.0).count() > 100);
        }
        assert_eq!(different(&host, &device), 0, "{}", driver.name);
        assert!(start.elapsed().as_secs() < 60, "{}: {:?}", driver.name, start.elapsed());
    });
}
