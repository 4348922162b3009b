//! Tiles: the ranges of front depths equal the twin's, bit for bit.

use crate::support::{Case, Choose, camera, each_driver, random_cloud};
use glam::Vec3;
use meniscus::{Settings, shader::WALL_TILE, twin::tiles::tiles};

#[test]
fn ranges_equal_the_twin() {
    // Sizes that end inside a tile, and clouds with either class, both and few.
    for (size, splash, body) in [([173u32, 131u32], 60, 300), ([64, 48], 30, 0), ([160, 120], 0, 200), ([33, 17], 1, 1)]
    {
        let case = Case {
            particles: random_cloud(11, 0.04, Vec3::splat(-0.6), Vec3::splat(0.6), splash, body),
            camera: camera(Vec3::new(0.2, 0.1, 2.0), Vec3::ZERO, size),
            settings: Settings::default(),
            size,
            eye_inside: false,
        };
        each_driver(|driver| {
            let shot = driver.shoot(&case);
            let maps: Vec<_> =
                ["splash depth", "body depth (smoothed, even)"].iter().filter_map(|id| shot.floats(id, 0)).collect();
            let maps: Vec<_> = maps.iter().map(Vec::as_slice).collect();
            let expected = tiles(size, &maps);
            let (low, high) =
                (shot.floats("front depth tiles", 0).unwrap(), shot.floats("front depth tiles", 1).unwrap());
            assert_eq!(low.len() as u32, size[0].div_ceil(WALL_TILE) * size[1].div_ceil(WALL_TILE));
            let found: Vec<_> = low.into_iter().zip(high).collect();
            assert_eq!(found, expected, "{}: {size:?}", driver.name);
        });
    }
}

#[test]
fn fewer_than_four_refractions_do_without() {
    let size = [64, 48];
    let mut case = Case {
        particles: random_cloud(11, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 10, 30),
        camera: camera(Vec3::new(0.2, 0.1, 2.0), Vec3::ZERO, size),
        settings: Settings::default(),
        size,
        eye_inside: false,
    };
    for refractions in [1, 2] {
        case.settings = case.settings.refractions(refractions);
        each_driver(|driver| assert!(driver.shoot(&case).words("front depth tiles", 0).is_none(), "{}", driver.name));
    }
}
