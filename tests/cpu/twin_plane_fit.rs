//! Plane fitting (Imai16 §4.3) against what its formulas promise, on maps with closed forms.

use glam::{DVec3, Vec3};
use meniscus::inspect::uniforms;
use meniscus::shader::Frame;
use meniscus::smooth::plane_fit::twin::{Fit, Outcome, plane_fit, view_ray};
use meniscus::smooth::plane_fit::{PlaneFit, Weighting};
use meniscus::space::Space;
use meniscus::twin::normal::{decode_normal, encode_normal};
use meniscus::{Camera, Settings};

const SIZE: [u32; 2] = [61, 47];

fn fit_of(sigma: f32, window: u32, weighting: Weighting) -> PlaneFit {
    PlaneFit::default().sigma(sigma).window(window).weighting(weighting)
}

/// Uniforms of a camera 40 degrees high, in a space of radius 1.
pub fn frame(size: [u32; 2]) -> Frame {
    let camera =
        Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 40f32.to_radians(), size[0] as f32 / size[1] as f32, 0.01);
    let space = Space::new(1.0, Vec3::ZERO);
    uniforms(&camera, &Settings::default(), size, &space, (Vec3::ZERO, Vec3::ONE))
}

/// A plane's normal as a code and as what the code says: of the two only the latter is exact.
pub fn tilted(tilt_degrees: f64, azimuth_degrees: f64) -> (u32, DVec3) {
    let (t, a) = (tilt_degrees.to_radians(), azimuth_degrees.to_radians());
    let n = DVec3::new(t.sin() * a.cos(), t.sin() * a.sin(), t.cos());
    let code = encode_normal(n.as_vec3());
    (code, decode_normal(code).as_dvec3())
}

/// Depth map of the plane with this normal through (0, 0, -`depth`), where `keep` says so and the ray meets it well
/// before the horizon.
pub fn plane(frame: &Frame, n: DVec3, depth: f64, keep: impl Fn(i32, i32) -> bool) -> Vec<f32> {
    let (w, h) = (frame.size.x as i32, frame.size.y as i32);
    let mut map = Vec::new();
    for y in 0..h {
        for x in 0..w {
            let v = view_ray(frame, x, y);
            let facing = -n.dot(v) / v.length();
            let d = n.dot(DVec3::NEG_Z) * depth / n.dot(v);
            let seen = keep(x, y) && facing > 0.012 && d > 0.05 && d < 20.0;
            map.push(if seen { d as f32 } else { 0.0 });
        }
    }
    map
}

fn flat(frame: &Frame, depth: f32) -> (Vec<f32>, Vec<u32>) {
    let count = (frame.size.x * frame.size.y) as usize;
    (vec![depth; count], vec![encode_normal(Vec3::Z); count])
}

fn at(x: i32, y: i32) -> usize {
    (y * SIZE[0] as i32 + x) as usize
}

fn run(sigma: f32, frame: &Frame, depth: &[f32], normal: &[u32]) -> Fit {
    plane_fit(frame, depth, normal, &fit_of(sigma, 9, Weighting::ViewDependent))
}

/// A plane is a fixed point at any tilt, at its silhouette and at the image's border too, where an average of depths
/// would pull the edge towards whatever side the window still sees.
#[test]
fn a_plane_stays_where_it_is() {
    let disc = |x: i32, y: i32| (x - 31).pow(2) + (y - 20).pow(2) < 15 * 15;
    for weighting in [Weighting::ViewDependent, Weighting::Euclidean] {
        for (tilt, azimuth) in [(0, 0), (15, 70), (30, 200), (45, 33), (60, 120), (75, 250), (85, 300), (89, 95)] {
            for masked in [false, true] {
                let frame = frame(SIZE);
                let (code, n) = tilted(f64::from(tilt), f64::from(azimuth));
                let depth = plane(&frame, n, 1.5, |x, y| !masked || disc(x, y));
                let fit = plane_fit(&frame, &depth, &vec![code; depth.len()], &fit_of(0.3, 9, weighting));
                let (mut fitted, mut averaged) = (0, 0.0f64);
                for y in 0..SIZE[1] as i32 {
                    for x in 0..SIZE[0] as i32 {
                        let i = at(x, y);
                        if depth[i] == 0.0 {
                            assert_eq!(fit.depth[i], 0.0);
                            continue;
                        }
                        assert_eq!(fit.outcome[i], Outcome::Fitted, "{tilt} degrees at {x}, {y}");
                        fitted += 1;
                        // Input and output are rounded to half a step each; eq. (5) scales a neighbour's error by
                        // n.v_j / n.v_i, which within a window of such a map stays below 8.
                        let tolerance = 4.0 * f32::EPSILON * depth[i];
                        let error = (fit.depth[i] - depth[i]).abs();
                        assert!(error <= tolerance, "{tilt} degrees at {x}, {y}: moved by {error} of {}", depth[i]);
                        let near = (-4..=4).flat_map(|j| (-4..=4).map(move |k| (x + k, y + j)));
                        let inside =
                            |(a, b): &(i32, i32)| (0..SIZE[0] as i32).contains(a) && (0..SIZE[1] as i32).contains(b);
                        let all: Vec<_> =
                            near.filter(inside).map(|(a, b)| depth[at(a, b)]).filter(|d| *d > 0.0).collect();
                        let mean = all.iter().sum::<f32>() / all.len() as f32;
                        averaged = averaged.max(f64::from((mean - depth[i]).abs() / depth[i]));
                    }
                }
                assert!(fitted > 200, "{tilt}: {fitted}");
                // The average of depths does warp this very map: what stays above is the plane's doing.
                assert!(tilt < 15 || averaged > 1e-3, "{tilt}: {averaged}");
            }
        }
    }
}

/// A gap of several sigma weighs e^-36: nothing crosses it.
#[test]
fn a_step_is_kept() {
    let frame = frame(SIZE);
    let (mut depth, normal) = flat(&frame, 1.0);
    depth.iter_mut().enumerate().filter(|(i, _)| i % SIZE[0] as usize >= 30).for_each(|(_, d)| *d = 1.6);
    assert_eq!(run(0.1, &frame, &depth, &normal).depth, depth);
    // While one of half a sigma is smoothed.
    depth.iter_mut().filter(|d| **d > 1.0).for_each(|d| *d = 1.05);
    let fit = run(0.1, &frame, &depth, &normal);
    assert!(fit.depth[at(29, 20)] > 1.015 && fit.depth[at(30, 20)] < 1.035);
    assert_eq!(fit.depth[at(20, 20)], 1.0);
}

/// Imai16 fig. 5: distances discount a pixel's own surface at the far end of the window as well, so that what lies
/// across a gap gains; differences of depth do not.
#[test]
fn euclidean_weights_smooth_a_gap_that_depth_differences_keep() {
    let frame = frame(SIZE);
    // A pixel is sigma wide; the centre is cut off from its own surface by a ring 1.5 sigma behind.
    let pixel = frame.pixel_scale.x;
    let (mut depth, normal) = flat(&frame, pixel);
    for y in 19..=21 {
        for x in 29..=31 {
            depth[at(x, y)] = pixel + 1.5;
        }
    }
    depth[at(30, 20)] = pixel;
    let moved = |weighting| {
        let fit = plane_fit(&frame, &depth, &normal, &fit_of(1.0, 9, weighting));
        fit.plane[at(30, 20)].expect("it has a depth").depth - f64::from(pixel)
    };
    let (kept, smoothed) = (moved(Weighting::ViewDependent), moved(Weighting::Euclidean));
    // 1.5 * 8 e^-2.25 / (73 + 8 e^-2.25)
    assert!((kept - 0.01714).abs() < 1e-4, "{kept}");
    assert!(smoothed > 0.2 && smoothed < 0.25, "{smoothed}");
}

#[test]
fn a_lone_pixel_keeps_its_depth() {
    let frame = frame(SIZE);
    for (x, y) in [(0, 0), (60, 46), (30, 20)] {
        let mut depth = vec![0.0; (SIZE[0] * SIZE[1]) as usize];
        depth[at(x, y)] = 1.25;
        // Too far for a window of 9, and one that lies behind the near plane and is no neighbour.
        depth[at(if x < 30 { x + 5 } else { x - 5 }, y)] = 3.0;
        depth[at(x, if y < 30 { y + 1 } else { y - 1 })] = -0.5;
        let (code, _) = tilted(40.0, 10.0);
        let fit = run(0.3, &frame, &depth, &vec![code; depth.len()]);
        assert_eq!(fit.depth, depth);
        assert_eq!(fit.count(Outcome::Fitted), 2);
    }
}

#[test]
fn the_window_ends_where_it_should() {
    let frame = frame(SIZE);
    let normal = vec![encode_normal(Vec3::Z); (SIZE[0] * SIZE[1]) as usize];
    for window in [3, 9, 17, 19, 25] {
        let reach = window as i32 / 2;
        for (apart, moves) in [(reach, true), (reach + 1, false)] {
            let mut depth = vec![0.0; normal.len()];
            depth[at(30, 20)] = 1.0;
            depth[at(30 + apart, 20)] = 2.0;
            let fit = plane_fit(&frame, &depth, &normal, &fit_of(10.0, window, Weighting::ViewDependent));
            // Two weights that are all but equal: the mean.
            let expected = if moves { 1.5 } else { 1.0 };
            assert!((fit.depth[at(30, 20)] - expected).abs() < 0.02, "{window}, {apart}");
        }
    }
}

#[test]
fn guards_keep_the_depth_and_are_counted() {
    let frame = frame(SIZE);
    // Normals that cancel.
    let mut depth = vec![0.0; (SIZE[0] * SIZE[1]) as usize];
    let mut normal = vec![0; depth.len()];
    let (code, n) = tilted(30.0, 0.0);
    (depth[at(30, 20)], normal[at(30, 20)]) = (1.0, code);
    (depth[at(31, 20)], normal[at(31, 20)]) = (1.0, encode_normal(-n.as_vec3()));
    let fit = run(0.3, &frame, &depth, &normal);
    assert_eq!((fit.depth, fit.outcome[at(30, 20)]), (depth.clone(), Outcome::ZeroNormal));
    assert_eq!(fit.outcome.iter().filter(|o| **o == Outcome::ZeroNormal).count(), 2);

    // A plane along the view rays.
    for (facing, expected) in [(0.008, Outcome::Grazing), (0.012, Outcome::Fitted)] {
        let mut depth = vec![0.0; normal.len()];
        let v = view_ray(&frame, 30, 20).normalize();
        let across = v.cross(DVec3::Y).normalize();
        let n = facing * -v + (1.0 - facing * facing).sqrt() * across;
        depth[at(30, 20)] = 1.0;
        let fit = run(0.3, &frame, &depth, &vec![encode_normal(n.as_vec3()); depth.len()]);
        assert_eq!((fit.depth[at(30, 20)], fit.outcome[at(30, 20)]), (1.0, expected));
        assert_eq!(fit.count(Outcome::Grazing), u32::from(expected == Outcome::Grazing));
    }

    // Two pixels side by side whose common plane is steep: it passes between them, so that one's ray meets it half a
    // pixel times tan 84 degrees in front and the other's as far behind. If sigma is small they go only a fifth of that;
    // one stays where the near plane is too far.
    let (code, _) = tilted(84.0, 0.0);
    let mut depth = vec![0.0; normal.len()];
    (depth[at(30, 20)], depth[at(31, 20)]) = (1.0, 1.0);
    let codes = vec![code; depth.len()];
    let fit = run(0.01, &frame, &depth, &codes);
    assert_eq!(fit.count(Outcome::Unbounded), 2);
    let mut ends = [fit.depth[at(30, 20)], fit.depth[at(31, 20)]];
    ends.sort_by(f32::total_cmp);
    assert_eq!(ends, [1.0 - 0.002, 1.0 + 0.002]);
    let mut far = frame;
    far.near = 0.999;
    let fit = run(1.0, &far, &depth, &codes);
    assert_eq!((fit.count(Outcome::Unbounded), fit.count(Outcome::Fitted)), (1, 1));
}

#[test]
fn noise_is_reduced() {
    let frame = frame(SIZE);
    let (code, n) = tilted(40.0, 60.0);
    let truth = plane(&frame, n, 1.5, |_, _| true);
    let mut state = 1u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32 - 0.5
    };
    let noisy: Vec<f32> = truth.iter().map(|d| d + 0.02 * noise()).collect();
    let spread = |map: &[f32]| {
        let squares: f64 = map.iter().zip(&truth).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        (squares / map.len() as f64).sqrt()
    };
    let (mut map, before) = (noisy, spread(&truth));
    assert_eq!(before, 0.0);
    let mut last = spread(&map);
    let first = last;
    for _ in 0..3 {
        map = run(0.3, &frame, &map, &vec![code; map.len()]).depth;
        assert!(spread(&map) < last, "{} after {last}", spread(&map));
        last = spread(&map);
    }
    // One pass averages 81 pixels: a ninth, if they all counted alike; borders see fewer.
    assert!(last < first / 8.0, "{first} to {last}");
}
