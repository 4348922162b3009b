//! Each filter's shader against its twin, on hand-made depth maps.
#![cfg(feature = "host")]

mod bench;

use bench::{Done, Job, each_driver, run};
use glam::Vec3;
use meniscus::glam;
use meniscus::host::Gpu;
use meniscus::shader::*;
use meniscus::smooth::twin::{Axis, Pixel};
use meniscus::smooth::{bilateral, bilateral_separable, binomial, curvature_flow, narrow_range};
use meniscus::space::Space;
use meniscus::{Camera, Settings};

const SLOT: u32 = 3;

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
    fn between(&mut self, a: f32, b: f32) -> f32 {
        a + (b - a) * self.unit()
    }
}

struct Case {
    name: &'static str,
    frame: Frame,
    /// Two layers.
    depth: Vec<f32>,
}

fn frame(size: [u32; 2], near: f32) -> Frame {
    let camera =
        Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 40f32.to_radians(), size[0] as f32 / size[1] as f32, near);
    let space = Space::new(1.0, Vec3::ZERO);
    camera.uniforms(&Settings::default(), size, &space, (Vec3::ZERO, Vec3::ONE))
}

fn case(name: &'static str, size: [u32; 2], mut f: impl FnMut(u32, u32, u32) -> f32) -> Case {
    let mut depth = Vec::new();
    for layer in 0..2 {
        for y in 0..size[1] {
            for x in 0..size[0] {
                depth.push(f(x, y, layer));
            }
        }
    }
    Case { name, frame: frame(size, 1e-4), depth }
}

/// Fronts and backs of random balls.
fn balls(size: [u32; 2], count: usize, z: [f32; 2], radius: f32) -> Case {
    let f = frame(size, 0.01);
    let mut r = Random(7);
    let mut all = Vec::new();
    for _ in 0..count {
        let d = r.between(z[0], z[1]);
        let p = [r.between(0.0, size[0] as f32), r.between(0.0, size[1] as f32)];
        all.push(Vec3::new((p[0] - f.to_pixel.z) / f.to_pixel.x * d, (p[1] - f.to_pixel.w) / f.to_pixel.y * d, -d));
    }
    case("balls", size, |x, y, layer| {
        let v = Vec3::new(
            (x as f32 + 0.5 - f.to_pixel.z) / f.to_pixel.x,
            (y as f32 + 0.5 - f.to_pixel.w) / f.to_pixel.y,
            -1.0,
        );
        let mut best = 0.0f32;
        for c in &all {
            let (a, b, k) = (v.dot(v), v.dot(*c), c.dot(*c) - radius * radius);
            let disc = b * b - a * k;
            if disc <= 0.0 {
                continue;
            }
            let d = if layer == 0 { (b - disc.sqrt()) / a } else { (b + disc.sqrt()) / a };
            let better = if layer == 0 { best == 0.0 || d < best } else { d > best };
            if better {
                best = d;
            }
        }
        best
    })
}

fn cases() -> Vec<Case> {
    let mut r = Random(1);
    let mut all = vec![];
    all.push(case("noise with holes and negatives", [61, 47], |x, _, _| match r.unit() {
        u if u < 0.15 => 0.0,
        u if u < 0.2 => -r.unit(),
        _ => 20.0 + r.between(-1.0, 1.0) + if x > 30 { 15.0 } else { 0.0 },
    }));
    all.push(balls([96, 64], 400, [30.0, 45.0], 1.2));
    all.push(balls([64, 64], 30, [6.0, 12.0], 1.0));
    let mut r = Random(2);
    all.push(case("every magnitude", [33, 29], |_, _, _| match r.unit() {
        u if u < 0.1 => 0.0,
        _ => 10f32.powf(r.between(-3.0, 12.0)),
    }));
    all.push(case("far", [33, 29], |_, _, _| 1e12 * r.between(0.9, 1.1)));
    all.push(case("near", [33, 29], |_, _, _| 1e-3 * r.between(0.5, 2.0)));
    let mut at_near = case("at the near plane", [33, 29], |_, _, _| 1.0 + 0.1 * r.unit());
    at_near.frame.viewport.z = 1.05;
    all.push(at_near);
    all.push(case("tilted, with jumps of exactly 1 and 10", [70, 33], |x, y, _| {
        10.0 + 0.25 * x as f32 + [0.0, 1.0, 11.0, 1.0][(y / 4) as usize % 4]
    }));
    all.push(case("flat", [40, 40], |_, _, l| 8.0 + l as f32));
    let mut r = Random(5);
    all.push(case("lone pixels", [50, 40], |_, _, _| if r.unit() < 0.02 { r.between(2.0, 30.0) } else { 0.0 }));
    all.push(case("one pixel", [1, 1], |_, _, l| 2.0 + l as f32));
    all.push(case("one row", [37, 1], |x, _, _| 5.0 + (x % 3) as f32 * 0.1));
    all
}

struct Tally {
    pixels: usize,
    worst: f64,
    either: usize,
    moved: usize,
}

fn compare(label: &str, case: &Case, result: &[f32], twin: impl Fn(&[f32], usize) -> Vec<Pixel>) -> Tally {
    let n = case.depth.len() / 2;
    let mut t = Tally { pixels: 0, worst: 0.0, either: 0, moved: 0 };
    let mut bad = 0;
    for layer in 0..2 {
        let input = &case.depth[layer * n..][..n];
        for (i, p) in twin(input, layer).iter().enumerate() {
            let got = result[layer * n + i];
            t.pixels += 1;
            t.either += usize::from(p.or.is_some());
            t.moved += usize::from(got != input[i]);
            assert!(got.is_finite(), "{label}: {got}");
            if p.slack == 0.0 && p.or.is_none() {
                assert_eq!(got.to_bits(), (p.depth as f32).to_bits(), "{label} {i}: {p:?} from {}", input[i]);
            } else {
                let near = |d: f64| (f64::from(got) - d).abs() / p.slack;
                let e = p.or.map_or(near(p.depth), |o| near(p.depth).min(near(o)));
                t.worst = t.worst.max(e);
                if !p.admits(got) {
                    bad += 1;
                    if bad < 5 {
                        println!("  !! {label}, layer {layer}, pixel {i}: {got} for {p:?}, from {}", input[i]);
                    }
                }
            }
        }
    }
    println!(
        "{label}: {} pixels, {} moved, worst {:.3} of slack, {} either, {bad} beyond",
        t.pixels, t.moved, t.worst, t.either
    );
    assert_eq!(bad, 0, "{label}");
    t
}

fn job(gpu: &Gpu, case: &Case, shader: &Shader, constants: &[u32], push: &[f32]) -> Done {
    let edge = if shader.name.ends_with("bilateral.comp") { constants[0] } else { IMAGE_GROUP };
    run(gpu, &Job { shader, frame: &case.frame, inputs: &[("depth_in", &case.depth)], constants, push, edge })
}

fn layered(case: &Case, f: impl Fn(&[f32]) -> u32) -> u32 {
    case.depth.chunks(case.depth.len() / 2).map(f).sum()
}

#[test]
fn bilateral_filters() {
    each_driver(|gpu| {
        for c in cases() {
            for (sigma_space, sigma_depth, reach, projected) in [
                (2.0, 1.5, 4, false),
                (0.3, 3.0, 12, true),
                (1.0, 0.2, 6, true),
                (50.0, 1e6, 3, false),
                (0.6, 2.0, 27, true),
            ] {
                let p = bilateral::twin::Parameters { sigma_space, sigma_depth, reach, projected };
                let push = [sigma_space, sigma_depth];
                let label = format!("bilateral {}, {p:?}", c.name);
                let edge = if reach <= 23 { 16 } else { 8 };
                let constants = [edge, edge, reach, u32::from(projected), SLOT];
                let done = job(gpu, &c, &BILATERAL_COMP, &constants, &push);
                compare(&label, &c, &done.images["depth_out"], |d, _| bilateral::twin::bilateral(&c.frame, d, &p));
                clipped(&label, &c, &done, if projected { 3.0 * sigma_space } else { 0.0 }, reach);
                for axis in [Axis::X, Axis::Y] {
                    let label = format!("separable {}, {p:?}, {axis:?}", c.name);
                    let constants = [reach, u32::from(projected), SLOT, axis as u32];
                    let done = job(gpu, &c, &BILATERAL_SEPARABLE_COMP, &constants, &push);
                    compare(&label, &c, &done.images["depth_out"], |d, _| {
                        bilateral_separable::twin::bilateral_separable(&c.frame, d, &p, axis)
                    });
                    clipped(&label, &c, &done, if projected { 3.0 * sigma_space } else { 0.0 }, reach);
                }
            }
        }
    });
}

/// The first counter is the pixels whose kernel is larger than its reach, but for those that rounding decides.
fn clipped(label: &str, c: &Case, done: &Done, kernel: f32, reach: u32) {
    let count = |e: f64| {
        layered(c, |d| {
            let wanted = |d: f32| f64::from(kernel) * f64::from(c.frame.to_pixel.y.abs()) / f64::from(d) * e;
            d.iter().filter(|d| **d > 0.0 && wanted(**d).ceil() > f64::from(reach)).count() as u32
        })
    };
    let got = done.counters[SLOT as usize];
    assert!((count(1.0 - 1e-6)..=count(1.0 + 1e-6)).contains(&got), "{label}: {got} for {}", count(1.0));
    let others = done.counters.iter().enumerate().filter(|(i, _)| *i != SLOT as usize).map(|(_, n)| n).sum::<u32>();
    assert_eq!(others, 0, "{label}");
}

#[test]
fn binomial_filter() {
    each_driver(|gpu| {
        for c in cases() {
            for (kernel, reach, silhouette_map) in [(1.0, 32, true), (0.5, 60, false), (2.0, 5, true), (0.0, 5, true)] {
                let p = binomial::twin::Parameters { kernel, reach, silhouette_map };
                let label = format!("binomial {}, {p:?}", c.name);
                let constants = [reach, u32::from(silhouette_map), SLOT];
                let done = job(gpu, &c, &BINOMIAL_ACROSS_COMP, &constants, &[kernel]);
                let (depth, missing) = (&done.images["depth_out"], &done.images["missing_out"]);
                compare(&format!("{label} across"), &c, depth, |d, _| binomial::twin::across(&c.frame, d, &p).0);
                compare(&format!("{label} missing"), &c, missing, |d, _| binomial::twin::across(&c.frame, d, &p).1);
                clipped(&label, &c, &done, kernel, reach);
                let between = Case { name: c.name, frame: c.frame, depth: depth.clone() };
                let inputs: [(&str, &[f32]); 2] = [("depth_in", depth), ("missing_in", missing)];
                let shader = &BINOMIAL_DOWN_COMP;
                let (constants, push, edge) = (&constants, &[kernel], IMAGE_GROUP);
                let done = run(gpu, &Job { shader, frame: &c.frame, inputs: &inputs, constants, push, edge });
                let n = depth.len() / 2;
                compare(&format!("{label} down"), &between, &done.images["depth_out"], |d, layer| {
                    binomial::twin::down(&c.frame, d, &missing[layer * n..][..n], &p)
                });
                clipped(&label, &between, &done, kernel, reach);
            }
        }
    });
}

#[test]
fn curvature_flow_step() {
    each_driver(|gpu| {
        for c in cases() {
            for (time_step, jump) in [(0.01, 5.0), (0.3, 1.0), (100.0, 10.0), (0.1, 0.05), (1e9, 1000.0)] {
                let p = curvature_flow::twin::Parameters { time_step, jump };
                let label = format!("curvature flow {}, {p:?}", c.name);
                let done = job(gpu, &c, &CURVATURE_FLOW_COMP, &[SLOT], &[time_step, jump]);
                compare(&label, &c, &done.images["depth_out"], |d, _| {
                    curvature_flow::twin::curvature_flow(&c.frame, d, &p)
                });
                let n = c.depth.len() / 2;
                let flows: Vec<_> = c.depth.chunks(n).map(|d| curvature_flow::twin::flow(&c.frame, d, &p)).collect();
                let doubt: u32 = flows.iter().map(|f| f.undecided).sum();
                let at = SLOT as usize;
                for (got, twin) in [
                    (done.counters[at], flows.iter().map(|f| f.shortened).sum::<u32>()),
                    (done.counters[at + 1], flows.iter().map(|f| f.refused).sum()),
                ] {
                    assert!(got.abs_diff(twin) <= doubt, "{label}: {got} for {twin}, {doubt} in doubt");
                }
                println!("    counters {:?}, {doubt} in doubt", &done.counters[at..at + 2]);
            }
        }
    });
}

#[test]
fn narrow_range_filter() {
    each_driver(|gpu| {
        for c in cases() {
            for (kernel, threshold, clamp, reach, fixed, empty_far) in [
                (0.5, 10.0, 1.0, 12, false, false),
                (1.5, 1.0, 0.5, 9, false, true),
                (0.5, 10.0, 1.0, 4, true, false),
                (0.5, 0.25, 1.0, 4, true, true),
            ] {
                let p = narrow_range::twin::Parameters { kernel, threshold, clamp, reach, fixed, empty_far };
                let push = [kernel, threshold, clamp];
                let constants = [reach, u32::from(fixed), SLOT, u32::from(empty_far)];
                let label = format!("narrow range {}, {p:?}", c.name);
                let done = job(gpu, &c, &NARROW_RANGE_FULL_COMP, &constants, &push);
                compare(&label, &c, &done.images["depth_out"], |d, _| {
                    narrow_range::twin::narrow_range(&c.frame, d, &p)
                });
                clipped(&label, &c, &done, if fixed { 0.0 } else { kernel }, reach);
                for axis in [Axis::X, Axis::Y] {
                    let label = format!("{label}, {axis:?}");
                    let constants = [reach, u32::from(fixed), SLOT, u32::from(empty_far), axis as u32];
                    let done = job(gpu, &c, &NARROW_RANGE_ALONG_COMP, &constants, &push);
                    compare(&label, &c, &done.images["depth_out"], |d, _| {
                        narrow_range::twin::narrow_range_along(&c.frame, d, &p, axis)
                    });
                    clipped(&label, &c, &done, if fixed { 0.0 } else { kernel }, reach);
                }
            }
        }
    });
}
