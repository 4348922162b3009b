//! Normals of the smoothed body against their twin, which is fed the depths that the GPU itself smoothed.

use crate::support::{Case, Choose, Driver, camera, each_driver, imai16, lattice, random_cloud, sphere};
use glam::Vec3;
use meniscus::shader::SIDE_BACK;
use meniscus::smooth::{normals::twin::normals, plane_fit::twin::view_ray};
use meniscus::twin::normal::decode_normal;
use meniscus::{Particles, Settings};

/// 0.004 degrees for each of two roundings to a code, and as much for 32-bit differences.
const TOLERANCE: f64 = 0.02;

/// Returns how many pixels kept the ray-cast normal.
fn check(driver: &Driver, name: &str, case: &Case) -> u32 {
    let shot = driver.shoot(case);
    let smoothed = if case.settings.fit().iterations % 2 == 1 {
        "body depth (smoothed, odd)"
    } else {
        "body depth (smoothed, even)"
    };
    let (mut degenerate, mut seen) = (0, 0u32);
    let (mut off, mut ties) = (0u32, 0u32);
    for layer in 0..2 {
        let label = format!("{}, {name}, layer {layer}", driver.name);
        let depth = shot.floats(smoothed, layer).expect("smoothed depth");
        let raw = shot.words("body normal (ray-cast)", layer).expect("normals");
        let found = shot.words("body normal (smoothed)", layer).expect("smoothed normals");
        let twin = normals(&shot.frame, &depth, raw, layer);
        degenerate += twin.degenerate;
        for (i, d) in depth.iter().enumerate() {
            let (x, y) = (i as i32 % shot.size[0] as i32, i as i32 / shot.size[0] as i32);
            if *d <= 0.0 {
                assert_eq!(found[i], 0, "{label}, pixel {x}, {y}: no surface");
                continue;
            }
            seen += 1;
            let n = decode_normal(found[i]).as_dvec3();
            let expected = decode_normal(twin.normal[i]).as_dvec3();
            let angle = n.cross(expected).length().atan2(n.dot(expected)).to_degrees();
            // A float's step at this depth is as much as two differences of depths can be off.
            let tie = twin.margin[i] <= f64::from(f32::EPSILON * d);
            ties += u32::from(tie);
            off += u32::from(angle > TOLERANCE && !tie);
            // What the two agree on must face the right way; a raw normal may be rounded just past the silhouette.
            let away = n.dot(view_ray(&shot.frame, x, y).normalize());
            let facing = if layer == SIDE_BACK { away } else { -away };
            assert!(facing > -2e-4, "{label}, pixel {x}, {y}: faces the wrong way, {facing}");
        }
    }
    println!("{}, {name}: {seen} seen, {off} off, {ties} ties, {degenerate} degenerate", driver.name);
    assert!(seen > 1000, "{name}: only {seen} pixels");
    assert!(
        off * 1000 <= seen,
        "{}, {name}: {off} of {seen} normals are off by more than {TOLERANCE} degrees",
        driver.name
    );
    assert!(ties * 100 <= seen, "{}, {name}: {ties} of {seen} are ties", driver.name);
    // Exact: whether there are neighbours does not depend on rounding.
    assert_eq!(shot.counter("normals_lone_pixel"), degenerate, "{}, {name}", driver.name);
    degenerate
}

fn settings(iterations: u32) -> Settings {
    imai16().refractions(2).reflections(0).iterations(iterations)
}

#[test]
fn random_clouds() {
    let size = [173, 131];
    each_driver(|driver| {
        for iterations in [1, 2] {
            let case = Case {
                particles: random_cloud(11, 0.05, Vec3::splat(-0.7), Vec3::splat(0.7), 10, 500),
                camera: camera(Vec3::new(0.2, 0.3, 1.6), Vec3::ZERO, size),
                settings: settings(iterations),
                size,
                eye_inside: false,
            };
            check(driver, "cloud", &case);
        }
    });
}

/// Faces at grazing angles, and droplets a pixel or so wide: lone pixels, which keep the ray-cast normal.
#[test]
fn a_lattice_body_and_lone_pixels() {
    let size = [173, 131];
    each_driver(|driver| {
        let mut ellipsoids = lattice(Vec3::ZERO, 0.04, [14, 5, 14]);
        ellipsoids.extend((0..40).map(|i| {
            let at = Vec3::new(0.043 * i as f32 - 0.9, 0.35 + 0.013 * (i % 7) as f32, 0.1);
            sphere(at, 0.005)
        }));
        let case = Case {
            particles: Particles { radius: 0.04, ellipsoids, splash_count: 0 },
            camera: camera(Vec3::new(0.5, 0.5, 1.3), Vec3::ZERO, size),
            settings: settings(1),
            size,
            eye_inside: false,
        };
        let kept = check(driver, "lattice", &case);
        assert!(kept >= 10, "{}: {kept} lone pixels", driver.name);
    });
}

/// What lies behind the near plane is no neighbour.
#[test]
fn the_eye_in_a_particle() {
    each_driver(|driver| {
        check(driver, "eye inside", &crate::plane_fit::eye_in_a_particle());
    });
}

#[test]
#[cfg(feature = "io")]
fn a_dam_break() {
    each_driver(|driver| {
        for iterations in [2, 3] {
            let case = Case { settings: settings(iterations), ..crate::plane_fit::dam_break([240, 180]) };
            check(driver, "dam break", &case);
        }
    });
}
