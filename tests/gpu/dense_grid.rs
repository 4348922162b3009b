//! The density field on a dense grid against the formula of the sparse one: nodes and all that follows from them.

use crate::{
    field::{block, check, clouds, content, made, shoot},
    shape::empty,
    support::{Case, Choose, Cloud, Shot, each_driver},
};
use glam::{Vec3, Vec4};
use meniscus::{
    Settings,
    layers::{
        Layers,
        dense_grid::{DenseGrid, twin::inside},
        field::{
            Field,
            twin::{Lattice, Node, node_of},
        },
    },
    prepare::{Options, Search},
};
use std::cell::Cell;

fn settings(grid: DenseGrid) -> Settings {
    let mut settings = Settings::default();
    settings.method.layers = Layers::DenseGrid(grid);
    settings.validate().expect("they go together");
    settings
}

fn nodes(grid: DenseGrid, [x, y, z]: [u32; 3]) -> DenseGrid {
    grid.nodes_x(x).nodes_y(y).nodes_z(z)
}

/// Sums are floats of 24 bits, rounded once to whole numbers; shares as of the field. What strays add is whole numbers, and follows from these sums.
fn rounding(node: &Node) -> f64 {
    (3e-6 + 6e-8 * f64::from(node.points)) * node.field + 0.51 + 0.51 * f64::from(node.raised) + 2.0 * node.raises
}

fn left_out(shot: &Shot) -> [u32; 3] {
    ["dense_grid_x_left_out", "dense_grid_y_left_out", "dense_grid_z_left_out"].map(|name| shot.counter(name))
}

fn compare(shot: &Shot, points: &[Vec4], grid: &DenseGrid, radius: f32, label: &str) -> [u32; 3] {
    let field = Layers::DenseGrid(*grid).field().expect("a field");
    let (added, lacking) = inside(grid, points, radius);
    assert_eq!(left_out(shot), lacking, "{label}: nodes beyond the grid");
    check(shot, [points, &added], &Lattice::new(&field, radius), &rounding, label);
    lacking
}

/// The clouds that the sparse field is compared on, on grids that have room for them and on some that have not.
#[test]
fn nodes_bricks_and_flags_are_the_fields_twins() {
    let wide = nodes(DenseGrid::default(), [60, 96, 64]);
    // Just so far that no particle of a lattice reaches exactly up to a brick, where rounding says whether the grid has it.
    let tight = nodes(DenseGrid::default().spacing(1.5).kernel_radius(4.99).level(0.4), [12, 16, 12]);
    let (all, part) = (Cell::new(0), Cell::new(0));
    for (name, radius, positions) in clouds() {
        for grid in [wide, tight] {
            let case = Case { settings: settings(grid), ..empty(radius) };
            each_driver(|driver| {
                let label = format!("{}: {name}, {} nodes on x", driver.name, grid.nodes_x);
                let (shot, points) = shoot(driver, &positions, &case);
                let lacking = compare(&shot, &points, &grid, radius, &label);
                let shot = driver.shoot_cloud_unlisted(&case, &Cloud::new(&positions, Search::Runs));
                compare(&shot, &made(&shot), &grid, radius, &format!("{label}, on the device"));
                let full = points.iter().any(|p| p.w > 0.0) && lacking == [0; 3];
                all.set(all.get() + u32::from(full));
                part.set(part.get() + u32::from(lacking != [0; 3]));
            });
        }
    }
    let [all, part] = [all, part].map(Cell::into_inner);
    assert!(all > 0 && part > 0, "{all} with all of the body, {part} with a part of it");
}

/// Slices one after the other: a body longer on each axis in turn, with as many tiles as it takes.
#[test]
fn each_axis_has_its_nodes() {
    for (size, n) in [([40, 3, 4], [48, 12, 16]), ([3, 40, 4], [12, 48, 16]), ([4, 3, 40], [16, 12, 52])] {
        let positions = block(size, 0.1, Vec3::new(-1.3, 0.4, -2.0), 0.3);
        let grid = nodes(DenseGrid::default(), n);
        let case = Case { settings: settings(grid), ..empty(0.1) };
        each_driver(|driver| {
            let (shot, points) = shoot(driver, &positions, &case);
            let lacking = compare(&shot, &points, &grid, 0.1, &format!("{}: {size:?}", driver.name));
            assert_eq!(lacking, [0; 3], "{}: {size:?}", driver.name);
            // One brick less, and its nodes are missing, and said to be.
            let axis = size.iter().position(|s| *s == 40).expect("a long one");
            let mut less = n;
            less[axis] = 24;
            let grid = nodes(grid, less);
            let (shot, points) = shoot(driver, &positions, &Case { settings: settings(grid), ..case.clone() });
            let lacking = compare(&shot, &points, &grid, 0.1, &format!("{}: {size:?}, cut", driver.name));
            assert!(lacking[axis] > 0, "{}: {lacking:?}", driver.name);
        });
    }
}

/// Blending goes in the order of the sprites: the same bits each time, from wherever they are seen, and as quads.
#[test]
fn the_same_particles_give_the_same_bits() {
    let (_, radius, positions) = clouds().swap_remove(1);
    let case = Case { settings: settings(DenseGrid::default()), ..empty(radius) };
    let elsewhere = crate::support::camera(Vec3::new(0.4, 2.0, -1.0), Vec3::ZERO, case.size);
    let moved = Case { camera: elsewhere, ..case.clone() };
    let quads = Case { settings: case.settings.quads_only(true), ..case.clone() };
    each_driver(|driver| {
        let (shot, _) = shoot(driver, &positions, &case);
        let first = content(&shot);
        assert!(first.values().any(|b| b.1 != 0 && b.3.len() > 1), "{}", driver.name);
        for (what, other) in [("again", &case), ("seen from elsewhere", &moved), ("as quads", &quads)] {
            let (shot, _) = shoot(driver, &positions, other);
            assert!(content(&shot) == first, "{}: {what}", driver.name);
        }
    });
}

/// The picture is the field's, but for how sums are rounded.
#[test]
fn the_picture_is_the_fields() {
    let positions = block([8, 7, 6], 0.1, Vec3::splat(-0.7), 0.3);
    let case = Case { settings: settings(DenseGrid::default()), ..empty(0.1) };
    let sparse = Case { settings: crate::field::settings(Field::default(), "four"), ..case.clone() };
    each_driver(|driver| {
        let [dense, sparse] = [&case, &sparse].map(|case| shoot(driver, &positions, case).0.picture);
        let off = |(a, b): (&f32, &f32)| f64::from((a - b).abs());
        let all: Vec<f64> = dense.as_flattened().iter().zip(sparse.as_flattened()).map(off).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        println!("{}: {mean:.5} in the mean", driver.name);
        assert!(mean < 2e-3, "{}: {mean}", driver.name);
    });
}

/// Splashes alone have no grid, and no node; a grid that no image of the device can hold is refused, by its size.
#[test]
fn without_a_body_there_is_nothing_and_without_room_a_reason() {
    let positions: Vec<Vec3> = (0..20).map(|i| Vec3::new(i as f32, 0.3, -0.2)).collect();
    let case = Case { settings: settings(DenseGrid::default()), ..empty(0.1) };
    let large = nodes(DenseGrid::default(), [2048; 3]);
    each_driver(|driver| {
        let cloud = Cloud { options: Options::default().splash_threshold(2.0), ..Cloud::new(&positions, Search::Runs) };
        let shot = driver.shoot_cloud_unlisted(&case, &cloud);
        let bricks = crate::field::words(&shot).bricks();
        assert!(bricks.values().any(|b| b.has_balls), "{}", driver.name);
        assert!(bricks.keys().all(|b| node_of(&bricks, b.map(|c| 4 * c + 1)) == 0), "{}", driver.name);
        assert_eq!(left_out(&shot), [0; 3], "{}", driver.name);

        let case = crate::field::prepared(&positions, &Case { settings: settings(large), ..case.clone() });
        driver.give(&case);
        let session = &mut *driver.session.borrow_mut();
        let input = meniscus::FrameInput::new(0, &case.camera, &case.settings, ash::vk::ImageView::null());
        let refused = session.frame(&input).err().map(|e| e.to_string()).unwrap_or_default();
        let said = ["nodes_x", "47104x47104", "use fewer"].iter().all(|word| refused.contains(word));
        assert!(said, "{}: {refused}", driver.name);
    });
}
