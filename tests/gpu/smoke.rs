//! Two drivers, one frame: it renders, and validation is silent.

use crate::support::{Case, camera, each_driver, imai16, random_cloud};
use glam::Vec3;

#[test]
fn a_random_cloud_renders() {
    let size = [160, 120];
    let case = Case {
        particles: random_cloud(7, 0.05, Vec3::splat(-0.5), Vec3::splat(0.5), 40, 400),
        camera: camera(Vec3::new(0.3, 0.4, 2.0), Vec3::ZERO, size),
        settings: imai16(),
        size,
        eye_inside: false,
    };
    each_driver(|driver| {
        let shot = driver.shoot(&case);
        let front = shot.floats("body depth (ray-cast)", 0).expect("there is a body");
        assert!(front.iter().filter(|d| **d > 0.0).count() > 1000, "{}", driver.name);
        assert!(shot.picture.iter().flatten().all(|v| v.is_finite() && *v >= 0.0), "{}", driver.name);
    });
}
