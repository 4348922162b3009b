//! Every smoothing filter against its twin, which is fed the depths that the GPU itself read, step by step.

use crate::support::{Case, Choose, Driver, Shot, camera, each_driver, imai16, lattice, random_cloud, sphere};
use glam::Vec3;
use meniscus::{
    Particles,
    smooth::{
        Smooth,
        curvature_flow::CurvatureFlow,
        twin::{Count, Input},
    },
};
use std::collections::{BTreeMap, BTreeSet};

const SIZE: [u32; 2] = [75, 53];
const RAW: &str = "body depth (ray-cast)";
const STEPS: [&str; 2] = ["body depth (smoothed, odd)", "body depth (smoothed, even)"];

/// Parameters beside the defaults: each kind of a filter is to be among them, each kind of step among the first two or the
/// last of one of them, and each guard is to fire.
const KINDS: &[(&str, &[(&str, &str)])] = &[
    ("plane-fit", &[("window", "7"), ("iterations", "1")]),
    ("plane-fit", &[("projected", "true"), ("width", "1.7"), ("window", "25"), ("iterations", "1")]),
    ("plane-fit", &[("projected", "true"), ("window", "7"), ("weighting", "euclidean")]),
    ("bilateral", &[("iterations", "1"), ("sigma_space", "0.8"), ("window", "9")]),
    ("bilateral", &[("iterations", "2"), ("projected", "false"), ("sigma_space", "2"), ("window", "49")]),
    ("bilateral-separable", &[("sigma_space", "0.6"), ("sigma_depth", "0.5")]),
    ("bilateral-separable", &[("sigma_space", "0.8"), ("window", "11")]),
    ("bilateral-separable", &[("iterations", "2"), ("projected", "false"), ("sigma_space", "3"), ("window", "15")]),
    ("binomial", &[("window", "5")]),
    ("binomial", &[("kernel", "2"), ("iterations", "2")]),
    ("binomial", &[("kernel", "0.7"), ("silhouette_map", "false")]),
    ("curvature-flow", &[("iterations", "1"), ("time_step", "0.3")]),
    ("curvature-flow", &[("iterations", "2"), ("jump", "0.2")]),
    ("curvature-flow", &[("iterations", "2"), ("time_step", "100"), ("jump", "1000")]),
    ("narrow-range", &[("shape", "square"), ("iterations", "1"), ("kernel", "1.5"), ("threshold", "0.7")]),
    ("narrow-range", &[("shape", "square"), ("iterations", "2"), ("empty_far", "true"), ("window", "5")]),
    ("narrow-range", &[("iterations", "2"), ("kernel", "2"), ("threshold", "0.5"), ("clamp", "0.3")]),
    ("narrow-range", &[("iterations", "2"), ("empty_far", "true")]),
    ("narrow-range", &[("iterations", "2"), ("kernel", "2"), ("window", "9")]),
    ("narrow-range", &[("iterations", "1"), ("threshold", "0.5")]),
];

/// Every member as it comes, and the kinds.
fn filters() -> Vec<(String, Smooth)> {
    let mut all: Vec<_> = Smooth::all().into_iter().map(|f| (f.name().to_owned(), f)).collect();
    for (name, values) in KINDS {
        let mut filter = Smooth::named(name).expect("a filter");
        for (parameter, value) in *values {
            filter.parameters_mut().set(parameter, value).expect("a parameter");
        }
        all.push((format!("{name} {values:?}"), filter));
    }
    all
}

/// A step on one side, from one target to another: how many pixels it changed, and what its twin counts.
fn compare(label: &str, filter: &Smooth, shot: &Shot, step: u32, side: u32) -> (usize, Counted) {
    let from = if step == 0 { RAW } else { STEPS[(step as usize - 1) % 2] };
    let (depth, found) = (shot.floats(from, side).unwrap(), shot.floats(STEPS[step as usize % 2], side).unwrap());
    let normal = shot.words("body normal (ray-cast)", side).unwrap_or_default();
    let beside = filter.beside(step).map(|name| shot.floats(name, side).expect(name)).unwrap_or_default();
    let want = filter.twin(step, &Input { frame: &shot.frame, depth: &depth, normal, beside: &beside });
    let mut changed = 0;
    for (i, pixel) in want.pixels.iter().enumerate() {
        let at = || {
            format!("{label}, step {step}, side {side}, pixel {}, {}", i as u32 % shot.size[0], i as u32 / shot.size[0])
        };
        assert!(pixel.admits(found[i]), "{}: {} became {}, not {pixel:?}", at(), depth[i], found[i]);
        assert!(depth[i] > 0.0 || found[i].to_bits() == depth[i].to_bits(), "{}: nothing to smooth", at());
        changed += usize::from(found[i] != depth[i]);
    }
    if !want.beside.is_empty() {
        let name = filter.beside(step + 1).expect("what the next step reads");
        for (i, (pixel, found)) in want.beside.iter().zip(shot.floats(name, side).expect(name)).enumerate() {
            assert!(pixel.admits(found), "{label}, step {step}, side {side}, {name} at {i}: {found}, not {pixel:?}");
        }
    }
    (changed, want.counted)
}

type Counted = Vec<(&'static str, Count)>;

/// Compares every filter's steps, and what they count. Gives the counters of guards that fired, without doubt, at some pixel.
fn check(driver: &Driver, name: &str, case: &Case, least: usize) -> BTreeSet<&'static str> {
    let mut unsmoothed = case.clone();
    unsmoothed.settings.method.smooth = Smooth::named("none").expect("a filter");
    let mut others = driver.shoot(&unsmoothed).counters;
    others.push(("normals_lone_pixel", 0)); // whatever has been smoothed has other normals
    let mut fired = BTreeSet::new();
    for (kind, filter) in filters() {
        let mut case = case.clone();
        case.settings.method.smooth = filter;
        case.settings.validate().expect("in range");
        let (steps, mut changed) = (filter.steps(), 0);
        let label = format!("{}: {name}: {kind}", driver.name);
        // What the first two steps read and wrote is still there after them, and what the last did at the end.
        let first = steps.min(2);
        let shot = driver.shoot_step(&case, first);
        let mut counted: BTreeMap<&str, Count> = BTreeMap::new();
        for (step, side) in (0..first).flat_map(|step| [(step, 0), (step, 1)]) {
            let (moved, counts) = compare(&label, &filter, &shot, step, side);
            changed += moved;
            for (name, count) in counts {
                let sum = counted.entry(name).or_default();
                (sum.least, sum.most) = (sum.least + count.least, sum.most + count.most);
            }
        }
        // All that a filter counts, its twin counts too.
        for (counter, found) in &shot.counters {
            match counted.remove(counter) {
                Some(want) => {
                    let right = (want.least..=want.most).contains(found);
                    assert!(right, "{label}: {counter} is {found}, not {want:?}");
                    if want.least > 0 {
                        fired.insert(*counter);
                    }
                }
                None => {
                    assert!(steps == 0 || others.iter().any(|(o, _)| o == counter), "{label}: no twin of {counter}")
                }
            }
        }
        assert!(counted.is_empty(), "{label}: nothing counts {counted:?}");
        if steps > first {
            let shot = driver.shoot(&case);
            (0..2).for_each(|side| changed += compare(&label, &filter, &shot, steps - 1, side).0);
        }
        assert!(steps == 0 || changed >= least, "{label}: only {changed} pixels change");
    }
    fired
}

fn case(particles: Particles, eye: Vec3) -> Case {
    let settings = imai16().refractions(2).reflections(0);
    Case { particles, camera: camera(eye, Vec3::ZERO, SIZE), settings, size: SIZE, eye_inside: false }
}

#[test]
fn a_rough_body() {
    let particles = random_cloud(4, 0.12, Vec3::new(-0.9, -0.6, -0.9), Vec3::new(0.9, 0.6, 0.9), 0, 260);
    let case = case(particles, Vec3::new(0.4, 0.9, 2.2));
    each_driver(|driver| {
        let fired = check(driver, "rough", &case, 500);
        let guards = [
            "bilateral_kernel_clipped",
            "binomial_kernel_clipped",
            "curvature_flow_step_shortened",
            "narrow_range_kernel_clipped",
            "plane_fit_window_clipped",
        ];
        for guard in guards {
            assert!(fired.contains(guard), "{}: {guard} never fires", driver.name);
        }
    });
}

#[test]
fn blocks_one_before_the_other() {
    let mut ellipsoids = lattice(Vec3::new(-0.3, 0.0, -1.5), 0.1, [9, 6, 3]);
    ellipsoids.extend(lattice(Vec3::new(0.4, 0.2, 0.9), 0.06, [5, 4, 2]));
    let case = case(Particles { radius: 0.1, ellipsoids, splash_count: 0 }, Vec3::new(0.2, 0.4, 2.4));
    each_driver(|driver| {
        check(driver, "blocks", &case, 300);
    });
}

/// Depths pass through that say that the near plane lies in a particle: everywhere, and in the middle of the picture.
#[test]
fn the_eye_among_particles() {
    let around = sphere(Vec3::new(0.0, 0.0, 0.9), 0.2);
    let eye = Vec3::new(0.0, 0.0, 2.2);
    let before = sphere(eye - Vec3::new(0.0, 0.0, 0.01), 0.003);
    for (name, ellipsoid, eye) in [("around", around, Vec3::new(0.0, 0.0, 0.95)), ("before", before, eye)] {
        let mut particles = random_cloud(9, 0.2, Vec3::splat(-1.0), Vec3::splat(1.0), 0, 120);
        particles.ellipsoids.push(ellipsoid);
        let case = case(particles, eye);
        each_driver(|driver| {
            let raw = driver.shoot(&case).floats(RAW, 0).unwrap();
            let (inside, beyond) = (raw.iter().filter(|d| **d < 0.0).count(), raw.iter().filter(|d| **d > 0.0).count());
            assert!(inside > 100 && (name == "around" || beyond > 100), "{}: {name}: {inside}, {beyond}", driver.name);
            check(driver, &format!("a particle {name} the eye"), &case, 50);
        });
    }
}

/// Where nothing is a jump, the mixed derivative of curvature flow leads before the near plane at silhouettes just behind it:
/// here of small balls before a wall.
#[test]
fn the_near_plane_is_not_crossed() {
    let size = [240, 180];
    let radius = 0.02; // the near plane lies at half of it
    let mut ellipsoids = vec![sphere(Vec3::new(0.0, 0.0, -2.0), 1.4)];
    for k in 0..25 {
        let at = Vec3::new((k % 5 - 2) as f32 * 0.12, (k / 5 - 2) as f32 * 0.12, -0.605 - 0.002 * k as f32);
        ellipsoids.push(sphere(radius * at, 0.05 * radius));
    }
    let mut case = case(Particles { radius, ellipsoids, splash_count: 0 }, Vec3::ZERO);
    (case.size, case.camera) = (size, camera(Vec3::ZERO, Vec3::NEG_Z, size));
    let flow = CurvatureFlow::default().iterations(1).time_step(100.0).jump(1000.0);
    case.settings.method.smooth = flow.into();
    each_driver(|driver| {
        let shot = driver.shoot(&case);
        let mut want = Count::default();
        for side in 0..2 {
            let (_, counted) = compare(&driver.name, &flow.into(), &shot, 0, side);
            let [_, (_, refused)] = counted[..] else { panic!("two guards") };
            (want.least, want.most) = (want.least + refused.least, want.most + refused.most);
        }
        let found = shot.counter("curvature_flow_before_near_plane");
        println!("{}: {found} of {want:?}", driver.name);
        assert!(want.least > 0 && (want.least..=want.most).contains(&found), "{}: {found}, not {want:?}", driver.name);
    });
}

/// A frame hardly larger than a kernel, with one pixel and with one row.
#[test]
fn small_pictures() {
    let particles = random_cloud(3, 0.3, Vec3::splat(-0.5), Vec3::splat(0.5), 0, 20);
    each_driver(|driver| {
        for size in [[1, 1], [9, 1], [2, 7]] {
            for (kind, filter) in filters() {
                let mut case = case(particles.clone(), Vec3::new(0.1, 0.2, 2.0));
                (case.size, case.camera) = (size, camera(Vec3::new(0.1, 0.2, 2.0), Vec3::ZERO, size));
                case.settings.method.smooth = filter;
                let shot = driver.shoot(&case);
                assert!(shot.picture.as_flattened().iter().all(|v| v.is_finite()), "{}: {kind}: {size:?}", driver.name);
            }
        }
    });
}
