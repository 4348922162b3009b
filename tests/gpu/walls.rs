//! What rays meet at each pixel and in each tile equals the twin's, bit for bit.

use crate::support::{Case, Choose, camera, each_driver, imai16, random_cloud};
use glam::Vec3;
use meniscus::{
    shader::WALL_TILE,
    twin::texels::{pixels, tiles},
};

#[test]
fn texels_equal_the_twin() {
    // Sizes that end inside a tile, and clouds with either class, both and few; and an eye among particles.
    let far = Vec3::new(0.2, 0.1, 2.0);
    for (size, splash, body, eye, eye_inside) in [
        ([173u32, 131u32], 60, 300, far, false),
        ([64, 48], 30, 0, far, false),
        ([160, 120], 0, 200, far, false),
        ([33, 17], 1, 1, far, false),
        ([160, 120], 2000, 4000, Vec3::ZERO, false),
        ([64, 48], 60, 300, far, true),
    ] {
        let case = Case {
            particles: random_cloud(11, 0.04, Vec3::splat(-0.6), Vec3::splat(0.6), splash, body),
            camera: camera(eye, Vec3::new(-0.2, -0.1, -2.0), size),
            settings: imai16(),
            size,
            eye_inside,
        };
        each_driver(|driver| {
            let shot = driver.shoot(&case);
            let [splash, body] = ["splash depth", "body depth (smoothed, even)"]
                .map(|id| [0, 1].map(|side| shot.floats(id, side).unwrap_or_default()));
            let slices = |class| <[Vec<f32>; 2]>::each_ref(class).map(Vec::as_slice);
            let expected = pixels(&shot.frame, slices(&body), slices(&splash));
            if eye == Vec3::ZERO {
                let around = splash[0].iter().chain(&body[0]).filter(|d| **d < 0.0).count();
                assert!(around > 100, "{}: {around}", driver.name);
            }
            let found = shot.floats("walls", 0).unwrap();
            let (above, below) = found.split_at(4 * expected.len());
            let label = format!("{}: {size:?}", driver.name);
            assert!(above == expected.as_flattened(), "{label}");
            // Tiles fill the rows below from their start.
            let expected = tiles(size, &expected);
            let across = size[0].div_ceil(WALL_TILE) as usize;
            let rows = below.chunks_exact(4 * size[0] as usize).map(|row| &row[..4 * across]);
            assert!(rows.flatten().eq(expected.as_flattened()), "{label}: tiles");
        });
    }
}

#[test]
fn one_refraction_does_without() {
    let size = [64, 48];
    let mut case = Case {
        particles: random_cloud(11, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 10, 30),
        camera: camera(Vec3::new(0.2, 0.1, 2.0), Vec3::ZERO, size),
        settings: imai16(),
        size,
        eye_inside: false,
    };
    for (refractions, there) in [(1, false), (2, true)] {
        case.settings = case.settings.refractions(refractions);
        each_driver(|driver| {
            assert_eq!(driver.shoot(&case).words("walls", 0).is_some(), there, "{}", driver.name);
        });
    }
}
