//! What every filter promises.

use super::support::{MIDDLE, SIZE, at, depths, frame, map, noise, only};
use meniscus::shader::Frame;
use meniscus::smooth::twin::{Axis, Pixel};
use meniscus::smooth::{bilateral, bilateral_separable, binomial, curvature_flow, narrow_range};

type Filter = fn(&Frame, &[f32]) -> Vec<Pixel>;

const BILATERAL: bilateral::twin::Parameters =
    bilateral::twin::Parameters { sigma_space: 0.5, sigma_depth: 1.0, reach: 6, projected: true };
const BINOMIAL: binomial::twin::Parameters =
    binomial::twin::Parameters { kernel: 1.0, reach: 9, silhouette_map: false };
const FLOW: curvature_flow::twin::Parameters = curvature_flow::twin::Parameters { time_step: 0.1, jump: 1.0 };
const NARROW: narrow_range::twin::Parameters = narrow_range::twin::Parameters {
    kernel: 1.0,
    threshold: 1.0,
    clamp: 0.5,
    reach: 9,
    fixed: false,
    empty_far: false,
};

/// A pass of each kind; those along an axis with the axis they go along.
const ALL: &[(&str, Option<Axis>, Filter)] = &[
    ("bilateral", None, |f, d| bilateral::twin::bilateral(f, d, &BILATERAL)),
    ("bilateral rows", Some(Axis::X), |f, d| bilateral_separable::twin::bilateral_separable(f, d, &BILATERAL, Axis::X)),
    ("bilateral columns", Some(Axis::Y), |f, d| {
        bilateral_separable::twin::bilateral_separable(f, d, &BILATERAL, Axis::Y)
    }),
    ("binomial rows", Some(Axis::X), |f, d| binomial::twin::across(f, d, &BINOMIAL).0),
    ("binomial columns", Some(Axis::Y), |f, d| binomial::twin::down(f, d, &vec![0.0; d.len()], &BINOMIAL)),
    ("curvature flow", None, |f, d| curvature_flow::twin::curvature_flow(f, d, &FLOW)),
    ("narrow range", None, |f, d| narrow_range::twin::narrow_range(f, d, &NARROW)),
    ("narrow range rows", Some(Axis::X), |f, d| narrow_range::twin::narrow_range_along(f, d, &NARROW, Axis::X)),
    ("narrow range columns", Some(Axis::Y), |f, d| narrow_range::twin::narrow_range_along(f, d, &NARROW, Axis::Y)),
];

fn rough(seed: u64, holes: f32) -> Vec<f32> {
    let mut state = seed;
    let mut depth = map(|_, _| 10.0);
    for d in &mut depth {
        let kind = noise(&mut state) + 0.5;
        *d = if kind < holes { 0.0 } else { *d + 0.4 * noise(&mut state) };
    }
    depth
}

#[test]
fn a_constant_stays() {
    let frame = frame(3.7, 10.0);
    let depth = map(|x, y| if (x * x + y * y) % 7 == 3 { 0.0 } else { 10.3 });
    for (name, _, filter) in ALL {
        assert_eq!(depths(&filter(&frame, &depth)), depth, "{name}");
    }
}

#[test]
fn a_lone_pixel_stays() {
    let frame = frame(3.7, 10.0);
    for depth in [only(&[]), only(&[((1, 0), -0.5), ((0, -1), -3.0), ((-1, -1), -1.0)])] {
        for (name, _, filter) in ALL {
            let result = filter(&frame, &depth);
            assert_eq!(depths(&result), depth, "{name}");
        }
    }
}

/// Neither 0 nor a negative depth is changed, or averaged into what is beside it.
#[test]
fn no_surface_counts_for_nothing() {
    let frame = frame(3.7, 10.0);
    let holes = rough(3, 0.3);
    let mut state = 9;
    let negative: Vec<f32> =
        holes.iter().map(|d| if *d == 0.0 { -5.0 * (noise(&mut state) + 0.6) } else { *d }).collect();
    for (name, _, filter) in ALL {
        let (a, b) = (filter(&frame, &holes), filter(&frame, &negative));
        let mut moved = 0;
        for (i, d) in holes.iter().enumerate() {
            if *d == 0.0 {
                assert_eq!((a[i], b[i]), (Pixel::kept(0.0), Pixel::kept(negative[i])), "{name}");
            } else {
                assert_eq!(a[i], b[i], "{name}");
                assert!(a[i].depth > 9.7 && a[i].depth < 10.3, "{name}: {}", a[i].depth);
                moved += u32::from(a[i].depth as f32 != *d);
            }
        }
        let least = if *name == "curvature flow" { 100 } else { 500 };
        assert!(moved > least, "{name}: {moved}");
    }
}

/// A mirrored map becomes the mirrored result: no side counts more than the other.
#[test]
fn mirrored_maps_have_mirrored_results() {
    let frame = frame(3.7, 10.0);
    let depth = rough(5, 0.1);
    let mirror = |d: &[f64], along: Axis| -> Vec<f64> {
        let other = |x: i32, y: i32| match along {
            Axis::X => (SIZE[0] - 1 - x, y),
            Axis::Y => (x, SIZE[1] - 1 - y),
        };
        (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))).map(|(x, y)| d[at(other(x, y))]).collect()
    };
    let wide = |d: &[f32]| -> Vec<f64> { d.iter().map(|d| f64::from(*d)).collect() };
    for (name, _, filter) in ALL {
        let result: Vec<f64> = filter(&frame, &depth).iter().map(|p| p.depth).collect();
        for along in [Axis::X, Axis::Y] {
            let turned: Vec<f32> = mirror(&wide(&depth), along).iter().map(|d| *d as f32).collect();
            let again: Vec<f64> = filter(&frame, &turned).iter().map(|p| p.depth).collect();
            for (a, b) in mirror(&again, along).iter().zip(&result) {
                assert!((a - b).abs() < 1e-12, "{name}: {a} and {b}");
            }
        }
    }
}

/// One direction sees nothing beside its row or column.
#[test]
fn directions_are_directions() {
    let frame = frame(3.7, 10.0);
    let depth = rough(6, 0.0);
    for (name, axis, filter) in ALL {
        let Some(axis) = axis else { continue };
        let before = filter(&frame, &depth)[at(MIDDLE)];
        for (i, j) in [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1)] {
            let mut other = depth.clone();
            other[at((MIDDLE.0 + i, MIDDLE.1 + j))] += 0.1;
            let seen = filter(&frame, &other)[at(MIDDLE)] != before;
            let expected = if *axis == Axis::X { j == 0 } else { i == 0 };
            assert_eq!(seen, expected, "{name}, {i}, {j}");
        }
    }
}

#[test]
fn noise_is_reduced() {
    let frame = frame(3.7, 10.0);
    let depth = rough(8, 0.0);
    let spread = |d: &[f32]| {
        let mean = d.iter().sum::<f32>() / d.len() as f32;
        (d.iter().map(|d| (d - mean).powi(2)).sum::<f32>() / d.len() as f32).sqrt()
    };
    for (name, _, filter) in ALL {
        let mut current = depth.clone();
        for _ in 0..3 {
            let next = depths(&filter(&frame, &current));
            assert!(spread(&next) < 0.97 * spread(&current), "{name}: {} to {}", spread(&current), spread(&next));
            current = next;
        }
    }
}
