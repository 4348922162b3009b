//! The density field on a sparse grid against its formula: nodes, bricks, flags, balls and directory.

use crate::{
    shape::empty,
    support::{Case, Cloud, Driver, Random, Shot, each_driver},
};
use glam::{IVec3, Vec3, Vec4};
use meniscus::{
    Class, Particles, Point, Settings,
    layers::{
        Layers,
        field::{
            Field,
            twin::{Brick, Corner, Lattice, Node, Place, Words, byte, node_of, slopes, whole},
        },
    },
    prepare::{Input, Options, Search, points, prepare},
    shader::{FIELD_CELL_RECORD, FIELD_ONE},
};
use std::collections::{BTreeMap, BTreeSet};

/// Settings with a field, and light that bends so often.
pub fn settings(field: Field, optics: &str) -> Settings {
    let mut settings = Settings::default();
    settings.method.layers = Layers::Field(field);
    settings.method.choose("smooth", "none").expect("a member");
    settings.method.choose("optics", optics).expect("a member");
    settings.validate().expect("they go together");
    settings
}

/// Positions whose classes and ellipsoids the host has prepared.
pub fn prepared(positions: &[Vec3], case: &Case) -> Case {
    let (particles, _) = prepare(&Input::new(positions, case.particles.radius), &Options::default()).expect("valid");
    Case { particles, ..case.clone() }
}

/// Renders positions that the host has prepared: with their points.
pub fn shoot(driver: &Driver, positions: &[Vec3], case: &Case) -> (Shot, Vec<Vec4>) {
    let found = points(&Input::new(positions, case.particles.radius), &Options::default()).expect("valid");
    (driver.shoot_points(&prepared(positions, case), &found), packed(&found, case.particles.radius))
}

/// Points as the device has them.
fn packed(points: &[Point], radius: f32) -> Vec<Vec4> {
    let unit = 2f32.powi(-radius.log2().floor() as i32);
    points.iter().map(|p| (p.position * unit).extend(p.signed_density())).collect()
}

/// Those that the device has made.
pub fn made(shot: &Shot) -> Vec<Vec4> {
    shot.floats("particle points", 0).expect("points").chunks_exact(4).map(Vec4::from_slice).collect()
}

pub fn words(shot: &Shot) -> Words<'_> {
    Words::new(Words::BUFFERS.map(|name| shot.words(name, 0).expect("a field")))
}

/// Nodes, cells, their corners and balls of a brick.
pub type Content = (Vec<u32>, u64, Vec<[Corner; 8]>, BTreeSet<[u32; 3]>);

/// What of a field does not hang on how its bricks are numbered.
pub fn content(shot: &Shot) -> BTreeMap<Place, Content> {
    let bricks = words(shot).bricks();
    let balls = |b: &Brick| b.balls.iter().map(|c| c.map(f32::to_bits)).collect();
    bricks.iter().map(|(place, b)| (*place, (b.nodes.clone(), b.cells, b.corners.clone(), balls(b)))).collect()
}

pub fn block(n: [i32; 3], radius: f32, origin: Vec3, jitter: f32) -> Vec<Vec3> {
    let mut random = Random(3);
    let mut all = Vec::new();
    for x in 0..n[0] {
        for y in 0..n[1] {
            for z in 0..n[2] {
                let off = random.point(Vec3::splat(-jitter), Vec3::splat(jitter));
                all.push(origin + radius * (2.0 * Vec3::new(x as f32, y as f32, z as f32) + off));
            }
        }
    }
    all
}

/// Name, radius and positions.
pub fn clouds() -> Vec<(&'static str, f32, Vec<Vec3>)> {
    let mut random = Random(8);
    let mut spray = block([9, 8, 7], 0.05, Vec3::new(-0.5, -0.4, -0.3), 0.4);
    spray.extend((0..60).map(|_| random.point(Vec3::splat(-1.2), Vec3::splat(1.2))));
    let mut stray = block([4, 4, 4], 0.7, Vec3::splat(-2.1), 0.0);
    stray.push(Vec3::new(-7e4, 1.3, 2.0));
    let mut crowd = block([3, 3, 3], 0.1, Vec3::ZERO, 0.1);
    crowd.extend([Vec3::new(0.3, 0.1, 0.2); 3000]);
    // Edges and corners of a sheet, and what lies between a lone drop and a body.
    let mut thin = block([5, 1, 5], 0.1, Vec3::ZERO, 0.1);
    thin.extend(block([8, 1, 1], 0.1, Vec3::new(0.0, 0.7, 0.1), 0.1));
    thin.extend((1..9).map(|k| Vec3::new(0.9 * k as f32 + 0.02 * k as f32, -0.8, 0.0)));
    thin.extend((1..9).map(|k| Vec3::new(0.9 * k as f32 + 0.19, -0.8, 0.02 * k as f32)));
    // Blocks 512 to either side of the origin's: coordinates of more bits than a key has for them.
    let aside = |block: Vec3| 3.2 * block + 1.6;
    let far = [Vec3::new(-512.0, 1.0, 0.0), Vec3::ZERO, Vec3::new(512.0, 0.0, 0.0)].map(aside).to_vec();
    vec![
        ("blocks whose keys would be one", 0.1, far),
        ("a block and spray around the origin", 0.05, spray),
        ("a block far out", 0.01, block([6, 5, 7], 0.01, Vec3::new(-700.0, 300.0, -41.0), 0.3)),
        ("a small block", 1e-8, block([5, 5, 5], 1e-8, Vec3::splat(-3.3e-8), 0.2)),
        ("a stray 1e5 radii away", 0.7, stray),
        ("a sheet, a thread and pairs", 0.1, thin),
        ("a crowd on one spot", 0.1, crowd),
        ("one particle", 0.1, vec![Vec3::new(-0.03, 0.2, -7.0)]),
    ]
}

/// What a node may be off by, its field in whole numbers.
type Rounding = dyn Fn(&Node) -> f64;

/// Shares that are whole numbers, and their float arithmetic. What a stray adds follows from a mean of sums that are off in the same way.
const WHOLE_SHARES: &Rounding =
    &|node| 0.7 * f64::from(node.points + node.raised) + 3e-6 * node.field + 1.0 + node.raises + node.behind;

/// Compares a field with its twin. `added`: of the points those whose shares it has.
pub fn check(shot: &Shot, [points, added]: [&[Vec4]; 2], lattice: &Lattice, rounding: &Rounding, label: &str) {
    let words = words(shot);
    let bricks = words.bricks();
    // Which there are. Where rounding decides, both are right.
    let room = 1e-4 * lattice.spacing;
    let [least, most] = [-room, room].map(|more| lattice.bricks(points, more));
    assert!(least.iter().all(|b| bricks.contains_key(b)), "{label}: bricks are missing");
    let odd = bricks.keys().find(|b| !most.contains(*b));
    assert!(odd.is_none(), "{label}: {odd:?} is out of reach");
    assert_eq!(shot.counter("field_bricks") as usize, bricks.len(), "{label}");
    let left_out = ["field_bricks_left_out", "field_cells_left_out", "field_balls_left_out"];
    assert_eq!(left_out.map(|name| shot.counter(name)), [0; 3], "{label}");

    // The field at each node.
    let mut wanted = lattice.nodes(points, added);
    let (mut worst, mut inside) = (0f64, 0);
    let one = f64::from(FIELD_ONE);
    wanted.values_mut().for_each(|node| node.field *= one);
    for (place, brick) in &bricks {
        for (k, found) in brick.nodes.iter().enumerate() {
            let node = [0, 1, 2].map(|axis| 4 * place[axis] + (k >> (2 * axis) & 3) as i32);
            let wanted = wanted.get(&node).copied().unwrap_or_default();
            let off = (f64::from(*found) - wanted.field).abs() / rounding(&wanted);
            assert!(off <= 1.0, "{label}: node {node:?} holds {found} instead of {wanted:?}");
            worst = worst.max(off);
            inside += usize::from(wanted.field >= one * lattice.level);
        }
    }
    let lost = wanted.iter().find(|(place, node)| node.field > rounding(node) && node_of(&bricks, **place) == 0);
    assert!(lost.is_none(), "{label}: {lost:?}");

    // What follows from the nodes.
    let level = whole(lattice.level);
    let at = |node: Place| node_of(&bricks, node);
    let mut surface = 0;
    for (place, brick) in &bricks {
        let label = format!("{label}: brick {place:?}");
        let (mut cells, mut inside) = (0u64, 0u64);
        for k in 0..64 {
            let first = [0, 1, 2].map(|axis| 4 * place[axis] + (k >> (2 * axis) & 3));
            let corners = (0..8).map(|c| [0, 1, 2].map(|axis| first[axis] + (c >> axis & 1)));
            let within = corners.clone().filter(|c| at(*c) >= level).count();
            inside |= u64::from(at(first) >= level) << k;
            if within == 0 || within == 8 {
                continue;
            }
            // What a walk finds in it; where rounding decides, both are right.
            let found = brick.corners.get(cells.count_ones() as usize).expect("corners of each cell");
            for (c, (held, slope)) in corners.zip(found) {
                let wanted = (byte(level, at(c)), slopes(|step| at((IVec3::from(c) + step).to_array())));
                let near = (0..3).all(|axis| slope[axis].abs_diff(wanted.1[axis]) <= 1);
                assert!(*held == wanted.0 && near, "{label}: {held} {slope:?} at {c:?} instead of {wanted:?}");
            }
            cells |= 1 << k;
        }
        assert_eq!([brick.cells, brick.inside], [cells, inside], "{label}: cells and nodes inside");
        assert_eq!(brick.surface, cells != 0, "{label}: flag of the surface");
        assert_eq!(brick.has_balls, !brick.balls.is_empty(), "{label}: flag of balls");
        surface += cells.count_ones();
        assert_eq!(words.find(*place), brick.number, "{label}: look-up");
        assert_eq!(words.find(place.map(|c| c - 1_000_000)), 0, "{label}: look-up of what is not there");
    }

    // Balls, in each brick that they reach.
    let (mut balls, mut strays) = (0, 0);
    for point in points.iter().filter(|p| p.w != 0.0) {
        let x = point.truncate().as_dvec3() / lattice.spacing;
        // Splashes, and what the field does not enclose.
        let enclosed = lattice.encloses(point, |node| f64::from(node_of(&bricks, node)) / one);
        if point.w > 0.0 && enclosed > 1.0001 {
            continue;
        }
        let ball = point.truncate().extend(-point.w.abs());
        let [sure, maybe] = [-room, room].map(|more| lattice.reached(&ball, more));
        let in_brick = |place: &Place| {
            let corner = 4.0 * IVec3::from(*place).as_dvec3();
            // Within half a step on each axis.
            let near = |c: &&[f32; 3]| {
                (corner + Vec3::from(**c).as_dvec3() - x).abs().max_element() < 0.5 / 128.0 + 1e-6 * (1.0 + x.length())
            };
            bricks.get(place).is_some_and(|b| b.balls.iter().any(|c| near(&c)))
        };
        let rounding = point.w > 0.0 && enclosed > 0.9999;
        assert!(rounding || sure.iter().all(in_brick), "{label}: a ball at {point} is missing");
        strays += usize::from(point.w > 0.0);
        balls += maybe.len();
    }
    let listed: usize = bricks.values().map(|b| b.balls.len()).sum();
    assert!(listed <= balls, "{label}: {listed} balls in bricks, not {balls}");
    println!(
        "{label}: {} bricks, {inside} nodes inside, {surface} cells, {listed} balls, {strays} strays, {worst:.2}",
        bricks.len()
    );
}

#[test]
fn nodes_bricks_and_flags_are_the_twins() {
    for (name, radius, positions) in clouds() {
        for field in [
            Field::default(),
            Field::default().spacing(1.5).kernel_radius(4.0).level(0.4),
            Field::default().spacing(1.5).kernel_radius(5.0).level(0.4),
        ] {
            let lattice = Lattice::new(&field, radius);
            let case = Case { settings: settings(field, "one"), ..empty(radius) };
            each_driver(|driver| {
                let (shot, points) = shoot(driver, &positions, &case);
                check(&shot, [&points; 2], &lattice, WHOLE_SHARES, &format!("{}: {name}", driver.name));
                let shot = driver.shoot_cloud_unlisted(&case, &Cloud::new(&positions, Search::Runs));
                let own = made(&shot);
                check(&shot, [&own; 2], &lattice, WHOLE_SHARES, &format!("{}: {name}, on the device", driver.name));
                // The device's points are the host's.
                let sorted = |points: &[Vec4]| {
                    let mut all = points.to_vec();
                    all.sort_by(|a, b| a.to_array().map(f32::to_bits).cmp(&b.to_array().map(f32::to_bits)));
                    all
                };
                for (a, b) in sorted(&points).iter().zip(sorted(&own)) {
                    assert!(a.truncate() == b.truncate(), "{}: {name}: {a} and {b}", driver.name);
                    // Of a crowd each takes others that stand for it.
                    let same = (a.w - b.w).abs() <= 2e-4 * a.w.abs() || name.contains("crowd");
                    assert!(same, "{}: {name}: {a} and {b}", driver.name);
                }
            });
        }
    }
}

/// The order of the particles, and where the eye is, change no bit of the field.
#[test]
fn order_and_view_do_not_show() {
    let (_, radius, positions) = clouds().swap_remove(1);
    let mut random = Random(77);
    let mut shuffled = positions.clone();
    for i in (1..shuffled.len()).rev() {
        shuffled.swap(i, (random.unit() * (i + 1) as f32) as usize % (i + 1));
    }
    let case = Case { settings: settings(Field::default(), "four"), ..empty(radius) };
    let elsewhere = crate::support::camera(Vec3::new(0.4, 2.0, -1.0), Vec3::ZERO, case.size);
    let moved = Case { camera: elsewhere, ..case.clone() };
    each_driver(|driver| {
        let (shot, _) = shoot(driver, &positions, &case);
        let first = content(&shot);
        assert!(first.values().any(|b| b.1 != 0 && b.3.len() > 1), "{}", driver.name);
        for (what, positions, case) in
            [("shuffled", &shuffled, &case), ("seen from elsewhere", &positions, &moved), ("again", &positions, &case)]
        {
            let (other, _) = shoot(driver, positions, case);
            assert!(content(&other) == first, "{}: {what}", driver.name);
            if what != "seen from elsewhere" {
                assert!(other.picture == shot.picture, "{}: {what}: the picture", driver.name);
            }
        }
        let on_device =
            |positions: &[Vec3]| content(&driver.shoot_cloud_unlisted(&case, &Cloud::new(positions, Search::Runs)));
        assert!(on_device(&positions) == on_device(&shuffled), "{}: shuffled on the device", driver.name);
    });
}

/// A filled body's field is 1, and its level lies one radius above the outermost centres.
#[test]
fn a_filled_bodys_field_is_one_and_its_surface_where_the_liquids_is() {
    let radius = 0.05;
    let positions = block([12, 12, 12], radius, Vec3::ZERO, 0.0);
    let field = Field::default();
    let lattice = Lattice::new(&field, radius);
    let case = Case { settings: settings(field, "one"), ..empty(radius) };
    each_driver(|driver| {
        let (shot, _) = shoot(driver, &positions, &case);
        let bricks = words(&shot).bricks();
        let at = |x: f64, y: f64, z: f64| {
            let place = [x, y, z].map(|c| (c / lattice.spacing).round() as i32);
            f64::from(node_of(&bricks, place)) / f64::from(FIELD_ONE)
        };
        // The middle of the block, in the units of points.
        let r = lattice.ball / 1.24;
        let middle = at(11.0 * r, 11.0 * r, 11.0 * r);
        assert!((middle - 1.0).abs() < 0.03, "{}: {middle}", driver.name);
        // Above its face, in steps of the lattice: where the level is crossed between two nodes.
        let heights: Vec<_> = (0..12)
            .map(|k| {
                (f64::from(k) * lattice.spacing, at(11.0 * r, 11.0 * r, 22.0 * r + f64::from(k) * lattice.spacing))
            })
            .collect();
        let crossing =
            heights.windows(2).find(|w| w[0].1 >= lattice.level && w[1].1 < lattice.level).expect("a surface");
        let [(a, fa), (b, fb)] = [crossing[0], crossing[1]];
        let base = ((22.0 * r) / lattice.spacing).round() * lattice.spacing - 22.0 * r;
        let height = (base + a + (b - a) * (fa - lattice.level) / (fa - fb)) / r;
        println!("{}: the surface lies {height:.2} r above the outermost centres", driver.name);
        assert!((height - 1.0).abs() < 0.2, "{}: {height}", driver.name);
    });
}

/// Without room bricks are left out and counted, and nothing else breaks; without particles there is no field.
#[test]
fn what_there_is_no_room_for_is_counted() {
    // Far from each other and all of the body: up to 27 bricks each.
    let field = Field::default().kernel_radius(5.0);
    let positions: Vec<Vec3> =
        (0..512).map(|i| 3.0 * Vec3::new((i % 8) as f32, (i / 8 % 8) as f32, (i / 64) as f32)).collect();
    let case = Case { settings: settings(field.room(1.0), "four"), ..empty(0.1) };
    each_driver(|driver| {
        let options = Options::default().splash_threshold(0.0);
        let cloud = Cloud { options, ..Cloud::new(&positions, Search::Runs) };
        let shot = driver.shoot_cloud_unlisted(&case, &cloud);
        let [there, missing] = ["field_bricks", "field_bricks_left_out"].map(|name| shot.counter(name));
        println!("{}: {there} bricks, {missing} left out", driver.name);
        // Whole blocks are left out.
        assert!((4096 - 63..=4096).contains(&there), "{}", driver.name);
        let all = Lattice::new(&field, 0.1).bricks(&made(&shot), 0.0).len();
        assert!((there + missing).abs_diff(all as u32) <= all as u32 / 100, "{}: {missing} of {all}", driver.name);
        assert!(shot.picture.as_flattened().iter().all(|v| v.is_finite()), "{}", driver.name);
        let (nothing, _) = shoot(driver, &[], &case);
        assert!(nothing.words("field nodes", 0).is_none(), "{}", driver.name);
    });
}

/// The same of cells that hold the surface: many more of them than liquids have, in crumbs.
#[test]
fn cells_without_room_are_counted() {
    let crumb = block([2, 2, 2], 0.1, Vec3::ZERO, 0.0);
    let places = block([16, 16, 16], 0.6, Vec3::ZERO, 0.0);
    let positions: Vec<Vec3> = places.iter().flat_map(|p| crumb.iter().map(move |x| *p + *x)).collect();
    let case = Case { settings: settings(Field::default().room(34.0), "four"), ..empty(0.1) };
    each_driver(|driver| {
        let options = Options::default().splash_threshold(0.0);
        let cloud = Cloud { options, ..Cloud::new(&positions, Search::Runs) };
        let shot = driver.shoot_cloud_unlisted(&case, &cloud);
        let names = ["field_cells", "field_cells_left_out", "field_bricks_left_out"];
        let [all, missing, bricks_missing] = names.map(|name| shot.counter(name));
        let bricks = words(&shot).bricks();
        let there: u32 = bricks.values().map(|b| b.cells.count_ones()).sum();
        println!("{}: {all} cells, {missing} left out, {} bricks", driver.name, bricks.len());
        assert!(missing > 0 && bricks_missing == 0 && there + missing == all, "{}: {there} there", driver.name);
        let room = shot.words("field cells", 0).expect("cells").len() as u32 / FIELD_CELL_RECORD;
        assert!(there <= room && room - there < 64, "{}: room for {room}, {there} there", driver.name);
        assert!(shot.picture.as_flattened().iter().all(|v| v.is_finite()), "{}", driver.name);
    });
}

/// Particles that the host prepared come without points, which are asked for; and wrong ones are refused.
#[test]
fn points_are_asked_for() {
    let positions = block([3, 3, 3], 0.1, Vec3::ZERO, 0.0);
    let case = prepared(&positions, &Case { settings: settings(Field::default(), "two"), ..empty(0.1) });
    each_driver(|driver| {
        let session = &mut *driver.session.borrow_mut();
        session.renderer.set_particles(&case.particles).expect("particles");
        let input = meniscus::FrameInput::new(0, &case.camera, &case.settings, ash::vk::ImageView::null());
        let refused = session.frame(&input).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(refused.contains("layers") && refused.contains("set_points"), "{}: {refused}", driver.name);
        let good = Point { position: Vec3::ZERO, density: 1.0, class: Class::Body };
        for bad in
            [vec![good; 26], vec![Point { density: f32::NAN, ..good }; 27], vec![Point { density: 0.0, ..good }; 27]]
        {
            let refused = session.renderer.set_points(&bad).err().map(|e| e.to_string()).unwrap_or_default();
            assert!(refused.contains("points"), "{}: {refused}", driver.name);
        }
    });
}

/// A field that the device cannot bind is refused before anything is made for it, by what it would take.
#[test]
fn a_field_larger_than_the_device_binds_is_refused() {
    let positions = block([80, 32, 32], 0.1, Vec3::ZERO, 0.0);
    let ball = |center: &Vec3| crate::support::sphere(*center, 0.1);
    let particles = Particles { radius: 0.1, ellipsoids: positions.iter().map(ball).collect(), splash_count: 0 };
    let points: Vec<_> = positions.iter().map(|p| Point { position: *p, density: 1.0, class: Class::Body }).collect();
    let case = Case { particles, settings: settings(Field::default().room(1000.0), "two"), ..empty(0.1) };
    each_driver(|driver| {
        let session = &mut *driver.session.borrow_mut();
        session.renderer.set_particles(&case.particles).expect("particles");
        session.renderer.set_points(&points).expect("points");
        let input = meniscus::FrameInput::new(0, &case.camera, &case.settings, ash::vk::ImageView::null());
        match session.frame(&input) {
            Err(e) => assert!(e.to_string().contains("field nodes would take 163840"), "{}: {e}", driver.name),
            Ok(_) => assert!(!driver.name.contains("Mesa"), "{}: lavapipe binds 128 MiB", driver.name),
        }
    });
}
