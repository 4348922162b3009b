//! Classes kept from frame to frame while a simulation re-sorts its particles, and shapes that do not jump with them.

use crate::{
    shape::{empty, listed},
    support::{Cloud, Driver, Random, Shot, each_driver},
};
use glam::{DMat3, Mat3, Vec3};
use meniscus::{
    Class,
    prepare::{Input, Options, Search, classify, ellipsoids::eigen_symmetric, prepare},
};

const RADIUS: f32 = 0.05;
/// The upper threshold; the lower one is 0.48.
const UPPER: f32 = 0.6;

/// A jittered block whose particles lie a little further apart than at rest, so that many have densities between the
/// thresholds; larger by `scale`.
fn loose(scale: f32) -> Vec<Vec3> {
    let mut random = Random(3);
    let at = |i: i32| Vec3::new((i % 8) as f32, (i / 8 % 8) as f32, (i / 64) as f32);
    let jittered: Vec<_> = (0..512).map(|i| at(i) + 0.3 * random.point(Vec3::NEG_ONE, Vec3::ONE)).collect();
    jittered.iter().map(|p| scale * 2.4 * RADIUS * *p).collect()
}

/// The numbers below `count`, each once.
fn shuffled(random: &mut Random, count: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count as u32).collect();
    for i in (1..count).rev() {
        order.swap(i, random.between(0.0, i as f32 + 1.0) as usize);
    }
    order
}

/// Puts particles into this order.
fn sorted<T: Copy>(all: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|i| all[*i as usize]).collect()
}

fn kept<'a>(positions: &'a [Vec3], ids: Option<(&'a [u32], u32)>) -> Cloud<'a> {
    Cloud { keep_class_below: Some(UPPER), ids, ..Cloud::new(positions, Search::Runs) }
}

/// A particle as prepared: class, centre and shape in radii.
#[derive(Clone, Copy)]
struct Seen {
    class: Class,
    center: Vec3,
    shape: DMat3,
}

impl Seen {
    fn semi_axes(&self) -> Vec3 {
        eigen_symmetric(self.shape).0.map(f64::sqrt).as_vec3()
    }
}

/// What a frame made of each particle, by its place in the buffer.
fn seen(shot: &Shot, count: usize) -> Vec<Seen> {
    let read = |name| shot.floats(name, 0).expect("prepared");
    let (centers, diagonals, mixed) =
        (read("particle centres"), read("particle shapes (diagonal)"), read("particle shapes (mixed)"));
    let three = |all: &[f32], k: usize| Vec3::from_slice(&all[3 * k..]);
    let of = |k: usize| {
        let (d, m) = (three(&diagonals, k), three(&mixed, k));
        let class = if d.x < 0.0 { Class::Splash } else { Class::Body };
        let shape = Mat3::from_cols_array(&[d.x.abs(), m.x, m.y, m.x, d.y, m.z, m.y, m.z, d.z]).as_dmat3();
        Seen { class, center: shot.space.world(three(&centers, k)) / RADIUS, shape }
    };
    listed(shot, count).1.into_iter().map(of).collect()
}

fn classes(seen: &[Seen]) -> Vec<Class> {
    seen.iter().map(|s| s.class).collect()
}

/// The cloud breathes, so that densities move between the thresholds and no further, and is shuffled in each frame.
#[test]
fn a_shuffled_cloud_keeps_its_classes_by_id() {
    let count = loose(1.0).len();
    let steps = [1.06, 1.03, 1.0, 0.98, 1.0, 1.03];
    each_driver(|driver| {
        let run = |by_id: bool, stride: usize, search: Search| {
            let mut random = Random(17);
            let mut last: Option<Vec<Class>> = None;
            let (mut wrong, mut between) = (0, 0);
            driver.session.borrow_mut().renderer.abandon(0);
            for scale in steps {
                let cloud = loose(scale);
                let order = shuffled(&mut random, count);
                let positions = sorted(&cloud, &order);
                let ids = by_id.then_some((&order[..], count as u32));
                let options = Options { search, ..Options::default() };
                let shot = driver.shoot_cloud(&empty(RADIUS), &Cloud { stride, options, ..kept(&positions, ids) });
                let want = classify(&cloud, RADIUS, &Options::default(), last.as_deref().map(|l| (l, UPPER)));
                let want = want.expect("classes");
                let free = classify(&cloud, RADIUS, &Options::default(), None).expect("classes");
                let got = classes(&seen(&shot, count));
                wrong += got.iter().zip(sorted(&want, &order)).filter(|(got, want)| **got != *want).count();
                between += want.iter().zip(&free).filter(|(want, free)| want != free).count();
                if by_id {
                    assert_eq!(shot.counter("id_out_of_range"), 0, "{}", driver.name);
                }
                last = Some(want);
            }
            println!("{}: by id {by_id}, stride {stride}: {wrong} wrong, {between} kept", driver.name);
            assert!(between > 200, "{}: {between} kept", driver.name);
            wrong
        };
        for (stride, search) in [(12, Search::Runs), (16, Search::Relation), (48, Search::Runs)] {
            assert_eq!(run(true, stride, search), 0, "{}: stride {stride}", driver.name);
        }
        assert!(run(false, 12, Search::Runs) > 100, "{}: by index, shuffled", driver.name);
    });
}

/// Memory goes with ids that are away, is not there for new ones, and starts anew with another number of ids or without.
#[test]
fn memory_is_of_ids_that_were_there() {
    let (wide, narrow) = (loose(1.06), loose(0.98));
    let count = wide.len();
    let all: Vec<u32> = (0..count as u32).collect();
    let number = count as u32;
    let options = Options::default();
    let first = classify(&wide, RADIUS, &options, None).expect("classes");
    let free = classify(&narrow, RADIUS, &options, None).expect("classes");
    let later = classify(&narrow, RADIUS, &options, Some((&first, UPPER))).expect("classes");
    assert!(free.iter().zip(&later).filter(|(a, b)| a != b).count() > 50);
    each_driver(|driver| {
        let shoot = |positions: &[Vec3], ids| {
            classes(&seen(&driver.shoot_cloud(&empty(RADIUS), &kept(positions, ids)), positions.len()))
        };
        let given = Some((&all[..], number));
        assert_eq!(shoot(&wide, given), first, "{}", driver.name);
        assert_eq!(shoot(&narrow, given), later, "{}", driver.name);
        for (other, what) in [(Some((&all[..], number + 1)), "another number"), (given, "again"), (None, "none")] {
            assert_eq!(shoot(&narrow, other), free, "{}: {what}", driver.name);
            assert_eq!(shoot(&wide, other), first, "{}: {what}", driver.name);
        }
        // By index, then by as many ids.
        assert_eq!(shoot(&narrow, given), free, "{}: by id", driver.name);
        // Far from all others each is a splash, and remembered as one; the other half is new afterwards.
        driver.session.borrow_mut().renderer.abandon(0);
        let (half, far) = (count / 2, |i: &u32| Vec3::new(*i as f32, 0.0, 0.0));
        let spread: Vec<_> = all[half..].iter().map(far).collect();
        shoot(&spread, Some((&all[half..], number)));
        let lone = [Vec3::ZERO];
        shoot(&lone, Some((&all[..1], number)));
        let was: Vec<_> = (0..count).map(|i| if i < half && i != 0 { Class::Body } else { Class::Splash }).collect();
        let want = classify(&narrow, RADIUS, &options, Some((&was, UPPER))).expect("classes");
        assert_eq!(shoot(&narrow, given), want, "{}: some new", driver.name);
    });
}

#[test]
fn ids_out_of_range_have_no_memory() {
    let (wide, narrow) = (loose(1.06), loose(0.98));
    let number = wide.len() as u32;
    let strange = |i: u32| [number, number + 7, u32::MAX, u32::MAX / 4][i as usize % 4];
    let ids: Vec<u32> = (0..number).map(|i| if i % 3 == 0 { strange(i / 3) } else { i }).collect();
    let options = Options::default();
    let first = classify(&wide, RADIUS, &options, None).expect("classes");
    let remembered: Vec<_> = (0..wide.len()).map(|i| if i % 3 == 0 { Class::Body } else { first[i] }).collect();
    let want = classify(&narrow, RADIUS, &options, Some((&remembered, UPPER))).expect("classes");
    each_driver(|driver| {
        for (cloud, want) in [(&wide, &first), (&narrow, &want)] {
            let shot = driver.shoot_cloud(&empty(RADIUS), &kept(cloud, Some((&ids, number))));
            assert_eq!(&classes(&seen(&shot, cloud.len())), want, "{}", driver.name);
            assert_eq!(shot.counter("id_out_of_range"), number.div_ceil(3), "{}", driver.name);
        }
        // All with one id: whoever is remembered, nothing else happens.
        let same = vec![5; wide.len()];
        let shot = driver.shoot_cloud(&empty(RADIUS), &kept(&narrow, Some((&same, number))));
        assert_eq!(shot.counter("id_out_of_range"), 0, "{}", driver.name);
        assert_eq!(shot.counter("splash") + shot.counter("body"), number, "{}", driver.name);
    });
}

/// Shapes fade in from the upper threshold on, on the device as on the host.
#[test]
fn shapes_with_hysteresis_are_the_cpus() {
    let cloud = loose(0.98);
    let options = Options::default();
    let (particles, _) =
        prepare(&Input::new(&cloud, RADIUS).keep_class_below(Some(UPPER)), &options).expect("prepared");
    each_driver(|driver| {
        let shot = driver.shoot_cloud(&empty(RADIUS), &kept(&cloud, None));
        let (mut balls, mut worst) = (0, 0.0_f32);
        let mut rest = particles.ellipsoids.clone();
        for got in seen(&shot, cloud.len()) {
            let miss = |e: &meniscus::Ellipsoid| {
                let shape = (e.axes * e.axes.transpose() * RADIUS.powi(-2)).as_dmat3() - got.shape;
                let apart = (e.center / RADIUS - got.center).length();
                apart + shape.to_cols_array().iter().fold(0.0, |most: f64, x| most.max(x.abs())) as f32
            };
            let nearest = rest.iter().map(miss).enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).expect("one is left");
            rest.swap_remove(nearest.0);
            worst = worst.max(nearest.1);
            let axes = got.semi_axes();
            balls += usize::from(got.class == Class::Body && axes.max_element() - axes.min_element() < 1e-5);
        }
        println!("{}: worst {worst}, {balls} balls", driver.name);
        assert!(worst < 2e-4 && balls > 50, "{}: {worst} off, {balls} balls", driver.name);
    });
}

/// A loose block, and spray within and around it. In each frame every particle drifts by 0.003 radii, its own way, and
/// trembles by up to a hundredth along each axis: no step is longer than 0.038.
fn drifting(frame: u32) -> Vec<Vec3> {
    let (mut random, mut tremor) = (Random(8), Random(u64::from(frame)));
    let mut cloud: Vec<Vec3> = loose(1.0).iter().map(|p| *p / RADIUS).collect();
    cloud.extend((0..400).map(|_| random.point(Vec3::splat(-10.0), Vec3::splat(28.0))));
    let mut moved = |p: Vec3| {
        let direction = random.point(Vec3::NEG_ONE, Vec3::ONE).normalize();
        RADIUS * (p + 0.003 * frame as f32 * direction + 0.01 * tremor.point(Vec3::NEG_ONE, Vec3::ONE))
    };
    cloud.into_iter().map(&mut moved).collect()
}

/// The largest steps from one frame to the next, of a particle's centre and of its semi-axes, in radii; how many particles
/// changed their class, and how often one did.
struct Flicker {
    center: f32,
    axis: f32,
    changed: usize,
    most: u32,
}

/// Shuffled in each frame; every particle comes from where it was a splash.
fn flicker(driver: &Driver, keep_class_below: Option<f32>) -> Flicker {
    let mut random = Random(23);
    let count = drifting(0).len();
    let mut found = Flicker { center: 0.0, axis: 0.0, changed: 0, most: 0 };
    let mut last: Option<Vec<Seen>> = None;
    let mut times = vec![0; count];
    let mut shoot = |cloud: &[Vec3]| {
        let order = shuffled(&mut random, count);
        let positions = sorted(cloud, &order);
        let ids = Some((&order[..], count as u32));
        let shot = driver.shoot_cloud(&empty(RADIUS), &Cloud { keep_class_below, ..kept(&positions, ids) });
        let mut by_id: Vec<_> = order.iter().zip(seen(&shot, count)).collect();
        by_id.sort_by_key(|(id, _)| **id);
        by_id.into_iter().map(|(_, seen)| seen).collect::<Vec<_>>()
    };
    let apart: Vec<_> = (0..count).map(|i| Vec3::X * i as f32).collect();
    assert!(shoot(&apart).iter().all(|s| s.class == Class::Splash));
    for frame in 0..16 {
        let now = shoot(&drifting(frame));
        for (i, (before, after)) in last.iter().flatten().zip(&now).enumerate() {
            found.center = found.center.max((after.center - before.center).length());
            found.axis = found.axis.max((after.semi_axes() - before.semi_axes()).abs().max_element());
            times[i] += u32::from(after.class != before.class);
        }
        last = Some(now);
    }
    found.changed = times.iter().filter(|t| **t > 0).count();
    found.most = times.into_iter().max().unwrap_or_default();
    found
}

#[test]
fn a_slowly_moving_cloud_does_not_flicker() {
    each_driver(|driver| {
        for keep in [None, Some(0.55), Some(UPPER)] {
            let Flicker { center, axis, changed, most } = flicker(driver, keep);
            let label = format!("{}: {keep:?}: {center} r, {axis} r, {changed} changed, one {most} times", driver.name);
            println!("{label}");
            // 0.046 and 0.057 measured. Where shapes fade in from the lower threshold it is 0.4 and 0.8.
            assert!(center < 0.06 && axis < 0.08 && changed > 5, "{label}");
            assert!(if keep.is_some() { most == 1 } else { most > 2 }, "{label}");
        }
    });
}
