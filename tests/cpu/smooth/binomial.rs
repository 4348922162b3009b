//! The binomial filter and its silhouette map.

use super::support::{MIDDLE, SIZE, at, depths, frame, map, middle, near, only};
use meniscus::smooth::binomial::twin::{Parameters, across, down};

fn kernel(kernel: f32) -> Parameters {
    Parameters { kernel, reach: 30, silhouette_map: true }
}

/// Rows of Pascal's triangle: a spike of 16 times its weight.
#[test]
fn weights_are_binomial_coefficients() {
    for (k, row) in [(1, &[1, 2, 1][..]), (2, &[1, 4, 6, 4, 1]), (3, &[1, 6, 15, 20, 15, 6, 1]), (0, &[1])] {
        // A particle at the surface's depth covers k pixels to either side, with a hair's room.
        let frame = frame(k as f32 - 0.01, 10.0);
        let p = kernel(if k == 0 { 0.0 } else { 1.0 });
        let flat = map(|_, _| 10.0);
        for offset in -4..=4 {
            let mut depth = flat.clone();
            depth[at((MIDDLE.0 + offset, MIDDLE.1))] = 10.5;
            let weight = row.get((offset + k) as usize).copied().unwrap_or(0);
            // The spike itself is nearer than the rest, and its kernel smaller by nothing that rounds.
            let expected = 10.0 + 0.5 * f64::from(weight) / f64::from(1 << (2 * k));
            near(middle(&across(&frame, &depth, &p).0), expected, 1e-6);
            let mut depth = flat.clone();
            depth[at((MIDDLE.0, MIDDLE.1 + offset))] = 10.5;
            near(middle(&down(&frame, &depth, &vec![0.0; depth.len()], &p)), expected, 1e-6);
        }
    }
}

/// The kernel is the projected radius: half as many pixels at twice the depth.
#[test]
fn the_kernel_follows_the_depth() {
    let frame = frame(7.9, 10.0);
    for (factor, depth, k) in [(1.0, 10.0, 8), (1.0, 20.0, 4), (0.5, 10.0, 4), (2.0, 10.0, 16), (9.0, 10.0, 30)] {
        for (apart, seen) in [(k, true), (k + 1, false)] {
            if apart > MIDDLE.0 {
                continue;
            }
            let mut map = map(|_, _| 0.0);
            (map[at(MIDDLE)], map[at((MIDDLE.0 - apart, MIDDLE.1))]) = (depth, depth + 1.0);
            let moved = middle(&across(&frame, &map, &kernel(factor)).0) != f64::from(depth);
            assert_eq!(moved, seen, "{factor}, {depth}, {apart}");
        }
    }
}

fn iteration(frame: &meniscus::shader::Frame, depth: &[f32], p: &Parameters) -> Vec<f32> {
    let (rows, missing) = across(frame, depth, p);
    depths(&down(frame, &depths(&rows), &depths(&missing), p))
}

/// Drawn is only where the kernel's whole footprint is liquid: the silhouette shrinks by k, but not at the image's border.
#[test]
fn silhouettes_shrink_by_the_kernel() {
    let (k, frame) = (2, frame(1.99, 10.0));
    let liquid = |x: i32, y: i32| x * x + y * y < 100 || x < -12;
    let depth = map(|x, y| if liquid(x, y) { 10.0 } else { 0.0 });
    let result = iteration(&frame, &depth, &kernel(1.0));
    let mut drawn = 0;
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let inside = |x: &i32, y: &i32| (0..SIZE[0]).contains(x) && (0..SIZE[1]).contains(y);
            let whole = (-k..=k).flat_map(|j| (-k..=k).map(move |i| (x + i, y + j)));
            let whole = whole.filter(|(x, y)| inside(x, y)).all(|p| depth[at(p)] > 0.0);
            assert_eq!(result[at((x, y))], if whole { 10.0 } else { 0.0 }, "{x}, {y}");
            drawn += u32::from(whole);
        }
    }
    assert!(drawn > 100);
    assert_eq!(result[at((0, 0))], 10.0);
    // Without the map nothing is lost.
    let p = Parameters { silhouette_map: false, ..kernel(1.0) };
    assert_eq!(iteration(&frame, &depth, &p), depth);
}

/// Where the eye is inside the liquid there is liquid.
#[test]
fn the_eye_inside_is_no_hole() {
    let frame = frame(1.99, 10.0);
    let with = |d: f32| map(|x, y| if (x, y) == (3, 0) { d } else { 10.0 });
    let result = iteration(&frame, &with(-0.5), &kernel(1.0));
    assert_eq!(result, with(-0.5));
    let result = iteration(&frame, &with(0.0), &kernel(1.0));
    assert_eq!(result.iter().filter(|d| **d == 0.0).count(), 25);
}

/// Half of what a silhouette lacks is a hole's weight.
#[test]
fn what_is_missing_is_the_weight_of_the_holes() {
    let frame = frame(0.99, 10.0);
    let depth = only(&[((1, 0), 10.0)]);
    let missing = across(&frame, &depth, &kernel(1.0)).1;
    near(missing[at(MIDDLE)].depth, 0.25, 1e-12);
    near(missing[at((0, 0))].depth, 1.0, 0.0);
}

/// Nothing stops at a jump: that is the method's failure, and kept.
#[test]
fn jumps_are_smoothed() {
    let frame = frame(0.99, 10.0);
    let depth = map(|x, _| if x > 0 { 30.0 } else { 10.0 });
    near(middle(&across(&frame, &depth, &kernel(1.0)).0), 15.0, 1e-12);
}
