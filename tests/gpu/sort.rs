//! The order by cell: the twin's, on clouds that need no pass, few, and all of them.

use crate::support::{Cloud, Driver, each_driver};
use glam::Vec3;
use meniscus::{
    prepare::Search,
    shader::EXTENT_PASSES,
    twin::sort::{relation, sort},
};

/// Entries as the last pass of the sort left them.
fn order(driver: &Driver, positions: &[Vec3], radius: f32, search: Search) -> (Vec<u32>, u32) {
    let shot = driver.shoot_cloud(&crate::shape::empty(radius), &Cloud::new(positions, search));
    let passes = shot.words("extent", 0).expect("extent")[EXTENT_PASSES as usize];
    let all = shot.words("sort order", 0).expect("order");
    let half = all.len() / 2;
    if passes == 0 {
        return ((0..half as u32).collect(), 0);
    }
    (all[(passes as usize & 1) * half..][..half].to_vec(), passes)
}

#[test]
fn entries_are_in_the_twins_order() {
    each_driver(|driver| {
        let mut most = 0;
        for (name, radius, positions) in crate::shape::clouds() {
            // A cell is as wide as the support, four radii, and so is one of the relation table.
            let (runs, passes) = order(driver, &positions, radius, Search::Runs);
            assert_eq!(runs, sort(&positions, 4.0 * radius), "{}: {name}", driver.name);
            let (table, more) = order(driver, &positions, radius, Search::Relation);
            assert_eq!(table, relation(&positions, 4.0 * radius), "{}: {name}: relation", driver.name);
            println!("{}: {name}: {passes} and {more} passes", driver.name);
            most = most.max(passes);
        }
        assert!(most >= 12, "no cloud is wide enough to need many passes: {most}");
    });
}
