//! The box of all positions and what follows from it, against the twin.

use crate::support::{Cloud, each_driver};
use glam::Vec3;
use meniscus::{
    prepare::{Fit, Options, Search},
    shader::{
        ELLIPSOID_WIDE, EXTENT_BITS, EXTENT_FIRST_CELL, EXTENT_LAST_CELL, EXTENT_LEAST, EXTENT_MOST, EXTENT_ORIGIN,
        EXTENT_PASSES,
    },
    twin::extent::{Kept, drawn, extent, kept},
};

#[test]
fn boxes_cells_and_bits_are_the_twins() {
    each_driver(|driver| {
        let lost_only = ("none finite", 0.05, vec![Vec3::NAN; 5]);
        for (name, radius, mut positions) in crate::shape::clouds().into_iter().chain([lost_only]) {
            for lost in [0, 3] {
                // Positions that are not finite count for nothing.
                positions.extend([Vec3::NAN, Vec3::INFINITY, Vec3::new(0.0, f32::NEG_INFINITY, 0.0)].iter().take(lost));
                for (ellipsoids, search, edge, more) in [
                    (Fit::InPlace, Search::Runs, 4.0, 0),
                    (Fit::InPlace, Search::Relation, 4.0, 1),
                    (Fit::YuTurk, Search::Relation, 8.0, 1),
                ] {
                    let want = extent(&positions, edge * radius, more);
                    let mut cloud = Cloud::new(&positions, search);
                    cloud.options.ellipsoids = ellipsoids;
                    let shot = driver.shoot_cloud(&crate::shape::empty(radius), &cloud);
                    let words = shot.words("extent", 0).expect("extent");
                    let three = |at: u32| <[u32; 3]>::try_from(&words[at as usize..][..3]).expect("three words");
                    let origin = three(EXTENT_ORIGIN).map(f32::from_bits);
                    let found = Kept { least: three(EXTENT_LEAST), most: three(EXTENT_MOST), origin };
                    let label = format!("{}: {name}: {search:?}, {lost} lost", driver.name);
                    assert_eq!(found, kept(&positions, radius), "{label}");
                    let cells = (three(EXTENT_FIRST_CELL), three(EXTENT_LAST_CELL));
                    assert_eq!((cells.0.map(|c| c as i32), cells.1.map(|c| c as i32)), want.cells, "{label}");
                    assert_eq!(three(EXTENT_BITS), want.bits, "{label}");
                    assert_eq!(words[EXTENT_PASSES as usize], want.bits.iter().sum::<u32>().div_ceil(5), "{label}");
                    assert_eq!(shot.counter("not_finite"), want.lost, "{label}");
                    // Differences, products with 1 / r (3 ulp), and sums.
                    let longest = match ellipsoids {
                        Fit::YuTurk => Options::default().max_semi_axis,
                        _ => ELLIPSOID_WIDE,
                    };
                    let drawn = drawn(&positions, radius, longest);
                    for (found, want) in [(shot.block.bounds_min, drawn.0), (shot.block.bounds_max, drawn.1)] {
                        let off = (found.as_dvec3() - want).abs();
                        let slack = 5.0 * f64::from(f32::EPSILON) * (want.abs() + 2.4);
                        assert!(off.cmple(slack).all(), "{label}: box at {found}, not {want}");
                    }
                }
            }
        }
    });
}
