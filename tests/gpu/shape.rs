//! Neighbours, classes and ellipsoids prepared on the device: the same sets as trying every pair, and what the CPU
//! prepares.

use crate::support::{Case, Choose, Cloud, Driver, Random, Shot, camera, each_driver, imai16};
use glam::Vec3;
use meniscus::{
    AtOnce, Class, Particles, Settings,
    prepare::{Fit, Input, Options, Search, classify, prepare},
    twin::shape::neighbours,
};

/// A frame in which only the preparation matters.
pub fn empty(radius: f32) -> Case {
    let size = [16, 16];
    Case {
        particles: Particles { radius, ellipsoids: Vec::new(), splash_count: 0 },
        camera: camera(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, size),
        settings: imai16().refractions(1),
        size,
        eye_inside: false,
    }
}

/// Clouds that preparation has to get right: name, particle radius, positions.
pub fn clouds() -> Vec<(&'static str, f32, Vec<Vec3>)> {
    let mut random = Random(5);
    let mut scatter = |n: usize, low: Vec3, high: Vec3| (0..n).map(|_| random.point(low, high)).collect::<Vec<_>>();
    let random_box = scatter(3000, Vec3::splat(-0.4), Vec3::splat(0.4));
    let mut clustered = Vec::new();
    for center in scatter(12, Vec3::splat(-2.0), Vec3::splat(2.0)) {
        clustered.extend(scatter(150, center - 0.1, center + 0.1));
    }
    let plane = scatter(800, Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 0.0, 1.0));
    // Distances that are exactly the reach, or the support: spacing, radius and reach are powers of two.
    let grid = |n: i32, step: f32| {
        let axis = move || (-n..=n).map(move |i| step * i as f32);
        axis().flat_map(move |x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x, y, z)))).collect::<Vec<_>>()
    };
    let far = |v: Vec3| scattered_far(v);
    let mut wide = far(Vec3::splat(1e6));
    wide.extend(far(Vec3::new(-1e6, 1e6, -1e6)));
    wide.extend(scatter(300, Vec3::splat(-0.1), Vec3::splat(0.1)));
    let mut coincident = vec![Vec3::new(0.3, -0.2, 0.1); 300];
    coincident.extend(vec![Vec3::new(0.35, -0.2, 0.1); 40]);
    // Distances that float32 rounds to either side of the reach, whichever of its invocation's particles the center is.
    let center = Vec3::new(0.3, -0.2, 0.1);
    let mut shell = vec![center; 9];
    let directions = scatter(1200, Vec3::NEG_ONE, Vec3::ONE);
    shell.extend(directions.iter().map(|d| (center.as_dvec3() + 0.4 * d.as_dvec3().normalize()).as_vec3()));
    vec![
        ("one", 0.05, vec![Vec3::new(0.3, 0.2, -0.7)]),
        ("two", 0.05, vec![Vec3::ZERO, Vec3::new(0.1, 0.0, 0.0)]),
        ("line", 0.05, (0..60).map(|i| Vec3::new(0.1 * i as f32 - 3.0, 0.0, 0.0)).collect()),
        ("random", 0.03, random_box),
        ("clustered", 0.02, clustered),
        ("plane", 0.04, plane),
        ("lattice with ties", 0.0625, grid(6, 0.125)),
        ("coincident", 0.05, coincident),
        ("a shell at the reach", 0.05, shell),
        ("a million away", 0.25, far(Vec3::new(1e6, -1e6, 1e6))),
        ("two millions wide", 0.01, wide),
    ]
}

fn scattered_far(v: Vec3) -> Vec<Vec3> {
    let mut random = Random(9);
    (0..700).map(|_| v + random.point(Vec3::splat(-2.0), Vec3::splat(2.0))).collect()
}

/// Each input index's neighbours, ascending; the places of the particles in the order of the device.
pub fn listed(shot: &Shot, count: usize) -> (Vec<Vec<u32>>, Vec<usize>) {
    let words = shot.words("neighbours (debug)", 0).expect("neighbours");
    let room = words.len() / count;
    let (mut lists, mut places) = (vec![Vec::new(); count], vec![usize::MAX; count]);
    for (k, list) in words.chunks(room).enumerate() {
        let (index, number) = (list[0] as usize, list[1] as usize);
        assert!(number <= room - 2, "{number} neighbours do not fit the list");
        lists[index] = list[2..][..number].to_vec();
        lists[index].sort_unstable();
        places[index] = k;
    }
    (lists, places)
}

#[test]
fn neighbours_are_the_same_sets() {
    each_driver(|driver| {
        for (name, radius, positions) in clouds() {
            for (ellipsoids, supports) in [(Fit::InPlace, 1.0), (Fit::YuTurk, 2.0)] {
                let want = neighbours(&positions, supports * 4.0 * radius);
                let total: usize = want.iter().map(Vec::len).sum();
                for search in [Search::Runs, Search::Relation] {
                    let options = Options { ellipsoids, search, ..Options::default() };
                    let cloud = Cloud { options, ..Cloud::new(&positions, search) };
                    let shot = driver.shoot_cloud(&empty(radius), &cloud);
                    let (got, _) = listed(&shot, positions.len());
                    let label = format!("{}: {name}: {ellipsoids:?}: {search:?}", driver.name);
                    for (i, (got, want)) in got.iter().zip(&want).enumerate() {
                        assert!(got == want, "{label}: particle {i}: {got:?}, not {want:?}");
                    }
                }
                println!("{}: {name}: {} particles, {total} neighbours", driver.name, positions.len());
            }
        }
    });
}

/// Compares classes, centres and shapes with the CPU's; float32 sums of a few hundred terms of order one, 6e-8 each, and
/// mean squares less squared means: 1e-4 of a radius, or of its square.
fn agrees(driver: &Driver, name: &str, radius: f32, positions: &[Vec3], options: &Options, tolerance: f32) {
    let cloud = Cloud { options: *options, ..Cloud::new(positions, options.search) };
    let shot = driver.shoot_cloud(&empty(radius), &cloud);
    let (_, places) = listed(&shot, positions.len());
    let classes = classify(positions, radius, options, None).expect("classes");
    let label = format!("{}: {name}: {:?}", driver.name, options.search);
    let read = |id| shot.floats(id, 0).expect("prepared");
    let (centers, diagonals, mixed) =
        (read("particle centres"), read("particle shapes (diagonal)"), read("particle shapes (mixed)"));
    let three = |all: &[f32], k: usize| Vec3::from_slice(&all[3 * k..]);
    // One particle after the other through the CPU's path keeps the input's order.
    let given: Vec<Class> = classes.clone();
    let input = Input::new(positions, radius).classes(Some(&given));
    let (want, report) = prepare(&input, options).expect("prepared");
    let mut rest: Vec<_> = want.ellipsoids.iter().map(|e| (e.center, shot.space.pack(e))).collect();
    let mut worst: f32 = 0.0;
    for (i, k) in places.iter().enumerate() {
        let (center, d, m) = (shot.space.world(three(&centers, *k)), three(&diagonals, *k), three(&mixed, *k));
        assert!(center.is_finite() && d.is_finite() && m.is_finite(), "{label}: particle {i}: {center} {d} {m}");
        assert_eq!(d.x < 0.0, classes[i] == Class::Splash, "{label}: class of particle {i}: {d}");
        // Places round in the liquid's own space, on both sides of the comparison, by their distance from its origin.
        let step = f32::EPSILON * three(&centers, *k).length();
        // The twin's answer nearest to this one, each used once.
        let distance = |(c, p): &(Vec3, meniscus::shader::Particle)| {
            let shape = (p.shape_diagonal.truncate() - d.abs()).length() + (p.shape_mixed.truncate() - m).length();
            ((*c - center).length() / radius - step).max(0.0) + shape
        };
        let (at, miss) = rest.iter().map(distance).enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).expect("one is left");
        // Where places are that coarse, several share one.
        if step < 1.0 {
            rest.swap_remove(at);
        }
        worst = worst.max(miss);
        assert!(miss <= tolerance, "{label}: particle {i} is {miss} off: {center} {d} {m}");
    }
    println!("{label}: worst {worst}");
    let counted =
        ["splash", "body", "ellipsoid_few_neighbours", "ellipsoid_degenerate"].map(|c| shot.counter(c) as usize);
    let known = [report.splash, report.body, report.few_neighbours, report.degenerate];
    assert_eq!(counted, known, "{label}");
    for (slot, known) in
        [("ellipsoid_clamped_long", report.clamped_long), ("ellipsoid_clamped_ratio", report.clamped_ratio)]
    {
        // A length that equals its limit may be cut or not.
        let got = shot.counter(slot) as usize;
        assert!(
            got.abs_diff(known) <= 1 + known / 100 || name.contains("lattice"),
            "{label}: {got} clamped, not {known}"
        );
    }
}

#[test]
fn classes_and_ellipsoids_are_the_cpus() {
    each_driver(|driver| {
        for (name, radius, positions) in clouds() {
            let tolerance = 1e-4;
            for search in [Search::Runs, Search::Relation] {
                agrees(driver, name, radius, &positions, &Options { search, ..Options::default() }, tolerance);
            }
            let yu_turk = Options::default().ellipsoids(Fit::YuTurk);
            agrees(driver, name, radius, &positions, &yu_turk, tolerance);
            for other in [
                Options { smoothing: 0.5, max_ratio: 2.0, min_neighbours: 3, search: Search::Relation, ..yu_turk },
                // Two cells around, not one; and a wider fade.
                Options { support: Some(3.0 * radius), ..Options::default() },
                Options { support: Some(6.0 * radius), splash_threshold: 0.7, ..Options::default() },
            ] {
                agrees(driver, name, radius, &positions, &other, tolerance);
            }
        }
    });
}

/// Four particles an invocation as on CPUs, or one as on GPUs.
#[test]
fn one_at_a_time_changes_no_bit() {
    let ellipsoids = &["particle centres", "particle shapes (diagonal)", "particle shapes (mixed)"][..];
    each_driver(|driver| {
        for (name, radius, positions) in clouds() {
            for (settings, arrays) in
                [(imai16().refractions(1), ellipsoids), (Settings::default(), &["particle points"])]
            {
                let [four, one] = [AtOnce::Four, AtOnce::One].map(|at_once| {
                    let mut case = Case { settings, ..empty(radius) };
                    case.settings.drawing.at_once = at_once;
                    let shot = driver.shoot_cloud(&case, &Cloud::new(&positions, Search::Runs));
                    let read = |id: &&'static str| shot.words(id, 0).expect("prepared").to_vec();
                    (arrays.iter().map(read).collect::<Vec<_>>(), listed(&shot, positions.len()))
                });
                assert!(four == one, "{}: {name}: {arrays:?}", driver.name);
            }
        }
    });
}

#[test]
fn positions_may_lie_anywhere_in_a_buffer() {
    let (_, radius, positions) = clouds().swap_remove(3);
    each_driver(|driver| {
        let bits = |offset, stride| {
            let cloud = Cloud { offset, stride, ..Cloud::new(&positions, Search::Runs) };
            let shot = driver.shoot_cloud(&empty(radius), &cloud);
            ["particle centres", "particle shapes (diagonal)", "particle shapes (mixed)"]
                .map(|id| shot.words(id, 0).expect("prepared").to_vec())
        };
        let want = bits(0, 12);
        for (offset, stride) in [(0, 16), (4, 12), (252, 32), (1040, 48)] {
            assert!(bits(offset, stride) == want, "{}: offset {offset}, stride {stride}", driver.name);
        }
    });
}

#[test]
#[cfg(feature = "io")]
fn a_frame_from_the_device_is_the_cpus() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/dam_break.bgeo");
    let file = meniscus::io::particles::read(path.as_ref()).expect("the frame reads");
    let positions: Vec<Vec3> = file.positions.iter().map(|p| p.as_vec3()).collect();
    let case = crate::splat::dam_break();
    each_driver(|driver| {
        let want = driver.shoot(case);
        let got = driver.shoot_cloud(case, &Cloud::new(&positions, Search::Runs));
        let again = driver.shoot_cloud(case, &Cloud::new(&positions, Search::Runs));
        for (depth, normal) in crate::splat::TARGETS {
            for side in [0, 1] {
                let label = format!("{}: {depth:?} {side}", driver.name);
                assert!(got.words(depth, side) == again.words(depth, side), "{label}: not the same bits twice");
                assert!(got.words(normal, side) == again.words(normal, side), "{label}: not the same bits twice");
                let (a, b) = (want.depths(depth, side).expect("drawn"), got.depths(depth, side).expect("drawn"));
                let covered = a.iter().filter(|d| **d != 0.0).count();
                // Silhouettes and grazing rays move with the last bits of a shape.
                let off = |(a, b): &(&f32, &f32)| (**a == 0.0) != (**b == 0.0) || (**a - **b).abs() > 1e-3 * 0.025;
                let differ = a.iter().zip(&b).filter(off).count();
                println!("{label}: {differ} of {covered} pixels differ");
                assert!(covered > 100 && differ * 500 <= covered, "{label}: {differ} of {covered} pixels differ");
            }
        }
        assert_eq!(got.picture, again.picture, "{}: not the same bits twice", driver.name);
    });
}

#[test]
fn classes_are_kept_between_two_thresholds() {
    // A particle leaves a block: its density falls little by little. One threshold flips its class once; with two it flips
    // later, and back later still.
    let radius = 0.05;
    let block: Vec<Vec3> =
        (0..125).map(|i| 0.1 * Vec3::new((i % 5) as f32, (i / 5 % 5) as f32, (i / 25) as f32)).collect();
    let at = |gap: f32| block.iter().copied().chain([Vec3::new(0.2, 0.2, 0.4 + gap)]).collect::<Vec<_>>();
    each_driver(|driver| {
        let options = Options::default();
        let upper = options.splash_threshold + 0.12;
        let mut last: Option<Vec<Class>> = None;
        let (mut kept, mut changes) = (0, 0);
        for step in 0..24 {
            let positions = at(0.06 + 0.01 * (12 - (step - 12_i32).abs()) as f32);
            let cloud = Cloud { keep_class_below: Some(upper), ..Cloud::new(&positions, Search::Runs) };
            let shot = driver.shoot_cloud(&empty(radius), &cloud);
            let got: Vec<u32> = shot.words("last classes", 0).expect("kept").to_vec();
            let want = classify(&positions, radius, &options, last.as_deref().map(|l| (l, upper))).expect("classes");
            assert_eq!(got, want.iter().map(|c| *c as u32).collect::<Vec<_>>(), "{}: step {step}", driver.name);
            let free = classify(&positions, radius, &options, None).expect("classes");
            kept += usize::from(free != want);
            changes += usize::from(last.as_ref().is_some_and(|l| *l != want));
            last = Some(want);
        }
        assert!(kept > 0 && changes == 2, "{}: {kept} kept, {changes} changes", driver.name);
    });
}

#[test]
fn what_is_not_finite_is_left_out() {
    let (_, radius, positions) = clouds().swap_remove(3);
    let mut holed = positions.clone();
    for i in (0..holed.len()).step_by(17) {
        holed[i] = [Vec3::NAN, Vec3::INFINITY, Vec3::new(f32::NEG_INFINITY, 0.0, f32::NAN)][i % 3];
    }
    let finite: Vec<Vec3> = holed.iter().copied().filter(|p| p.is_finite()).collect();
    each_driver(|driver| {
        for search in [Search::Runs, Search::Relation] {
            let shot = driver.shoot_cloud(&empty(radius), &Cloud::new(&holed, search));
            let clean = driver.shoot_cloud(&empty(radius), &Cloud::new(&finite, search));
            for slot in ["splash", "body", "ellipsoid_few_neighbours"] {
                assert_eq!(shot.counter(slot), clean.counter(slot), "{}: {search:?}", driver.name);
            }
            let nothing =
                shot.floats("particle shapes (diagonal)", 0).expect("shapes").chunks(3).filter(|d| d[0] == 0.0).count();
            assert_eq!(nothing, holed.len() - finite.len(), "{}: {search:?}", driver.name);
            assert_eq!(listed(&shot, holed.len()).0, neighbours(&holed, 4.0 * radius), "{}: {search:?}", driver.name);
            assert!(shot.picture.iter().flatten().all(|v| v.is_finite()), "{}", driver.name);
        }
    });
}

/// Flat bodies of some layers, looked at along their normal: the front map lies where the liquid's surface is, one radius
/// above the outermost centres, before smoothing and after, and has no gaps. With YuTurk13's fit it lies far below.
#[test]
fn the_surface_is_where_the_liquids_is() {
    let (radius, distance, size) = (0.05, 3.0, [160, 120]);
    let case = Case { camera: camera(Vec3::Z * distance, Vec3::ZERO, size), size, ..empty(radius) };
    let slab = |layers: i32| {
        let mut random = Random(21);
        let flat = move |z: i32| {
            (0..441).map(move |i| 2.0 * radius * Vec3::new((i % 21 - 10) as f32, (i / 21 - 10) as f32, z as f32))
        };
        let lattice = (1 - layers..=0).flat_map(flat);
        lattice.map(|p| p + 0.25 * radius * random.point(Vec3::NEG_ONE, Vec3::ONE)).collect::<Vec<_>>()
    };
    each_driver(|driver| {
        for (layers, ellipsoids) in
            [(1, Fit::InPlace), (2, Fit::InPlace), (3, Fit::InPlace), (8, Fit::InPlace), (8, Fit::YuTurk)]
        {
            let positions = slab(layers);
            let options = Options::default().ellipsoids(ellipsoids);
            let cloud = Cloud { options, ..Cloud::new(&positions, Search::Runs) };
            let shot = driver.shoot_cloud_unlisted(&case, &cloud);
            for map in ["body depth (ray-cast)", "body depth (smoothed, odd)"] {
                let depths = shot.depths(map, 0).expect("drawn");
                // The middle of the picture: half of the slab's width.
                let middle = |i: &usize| (i % 160).abs_diff(80) < 24 && (i / 160).abs_diff(60) < 24;
                let seen: Vec<f32> =
                    (0..depths.len()).filter(middle).map(|i| (distance - depths[i]) / radius - 1.0).collect();
                let (surface, gaps): (Vec<f32>, Vec<f32>) = seen.iter().partition(|e| (-2.0..2.0).contains(*e));
                let error = surface.iter().sum::<f32>() / surface.len() as f32;
                let gaps = gaps.len() as f32 / seen.len() as f32;
                let label = format!("{}: {layers} layers, {ellipsoids:?}, {map}: {error} r, {gaps} gaps", driver.name);
                println!("{label}");
                let right = if ellipsoids == Fit::YuTurk { gaps > 0.5 } else { error.abs() <= 0.2 && gaps <= 0.01 };
                assert!(right, "{label}");
            }
        }
    });
}
