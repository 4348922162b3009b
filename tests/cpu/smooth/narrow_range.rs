//! The narrow-range filter's rules, one by one.

use super::support::{at, depths, frame, map, middle, near, only};
use meniscus::shader::Frame;
use meniscus::smooth::narrow_range::twin::{Parameters, narrow_range, narrow_range_along};
use meniscus::smooth::twin::{Axis, Pixel};

const P: Parameters = Parameters { kernel: 1.0, threshold: 1.0, clamp: 0.25, reach: 3, fixed: true, empty_far: false };

/// The middle after the filter over a square and along rows.
fn both(frame: &Frame, depth: &[f32], p: &Parameters) -> [f64; 2] {
    let result: [Vec<Pixel>; 2] = [narrow_range(frame, depth, p), narrow_range_along(frame, depth, p, Axis::X)];
    result.map(|r| middle(&r))
}

/// Gauss with sigma a third of the reach.
fn weight(x: f64, reach: f64) -> f64 {
    (-x * x / (2.0 * (reach / 3.0).powi(2))).exp()
}

#[test]
fn weights_are_gaussians_of_a_third_of_the_reach() {
    let frame = frame(4.0, 10.0);
    let projected = |kernel, reach| Parameters { kernel, reach, fixed: false, ..P };
    for (p, reach) in [
        (P, 3),
        (Parameters { reach: 4, ..P }, 4),
        (projected(0.99, 20), 4),
        (projected(1.01, 20), 5),
        (projected(1.01, 4), 4),
    ] {
        for apart in 1..=6 {
            let w = if apart <= reach { weight(f64::from(apart), f64::from(reach)) } else { 0.0 };
            for value in both(&frame, &only(&[((apart, 0), 10.5)]), &p) {
                near(value, 10.0 + 0.5 * w / (1.0 + w), 1e-12);
            }
        }
    }
}

/// In range: averaged. Too far: counted a clamp behind. Too near: left out, and what is opposite with it.
#[test]
fn the_range_is_asymmetric() {
    let frame = frame(4.0, 10.0);
    let w = weight(1.0, 3.0);
    let pair = |left: f32, right: f32| both(&frame, &only(&[((-1, 0), left), ((1, 0), right)]), &P);
    for (left, right, expected) in [
        (11.0, 10.5, 1.5 * w / (1.0 + 2.0 * w)),
        (11.5, 10.5, 0.75 * w / (1.0 + 2.0 * w)),
        (90.0, 90.0, 0.5 * w / (1.0 + 2.0 * w)),
        (9.0, 10.5, -0.5 * w / (1.0 + 2.0 * w)),
        (8.9, 10.5, 0.0),
        (10.5, 8.9, 0.0),
        (8.9, 90.0, 0.0),
        (8.9, 0.0, 0.0),
        (0.0, 10.5, 0.5 * w / (1.0 + w)),
    ] {
        for value in pair(left, right) {
            near(value, 10.0 + expected, 1e-12);
        }
    }
}

#[test]
fn no_surface_is_too_far_if_wanted() {
    let frame = frame(4.0, 10.0);
    let p = Parameters { empty_far: true, reach: 1, ..P };
    let w = weight(1.0, 1.0);
    let depth = only(&[((1, 0), 10.5)]);
    near(middle(&narrow_range_along(&frame, &depth, &p, Axis::X)), 10.0 + 0.75 * w / (1.0 + 2.0 * w), 1e-12);
    // Not so what lies outside the image, or around the eye.
    let edge = map(|x, y| if (x, y) == (-20, 0) { 10.0 } else { -1.0 });
    assert_eq!(depths(&narrow_range_along(&frame, &edge, &p, Axis::X)), edge);
}

/// A stair of steps within the threshold is in range to its end, though that is beyond the threshold by itself.
#[test]
fn the_range_grows_outwards() {
    let frame = frame(4.0, 10.0);
    let stair = only(&[((1, 0), 10.9), ((2, 0), 11.8), ((3, 0), 12.7)]);
    let w = [1.0, 2.0, 3.0].map(|x| weight(x, 3.0));
    let sum = 0.9 * w[0] + 1.8 * w[1] + 2.7 * w[2];
    for value in both(&frame, &stair, &P) {
        near(value, 10.0 + sum / (1.0 + w[0] + w[1] + w[2]), 1e-6);
    }
    // Without its first step, the rest is too far.
    let gap = only(&[((2, 0), 11.8), ((3, 0), 12.7)]);
    for value in both(&frame, &gap, &P) {
        near(value, 10.0 + 0.25 * (w[1] + w[2]) / (1.0 + w[1] + w[2]), 1e-12);
    }
    // Towards the viewer it grows as well.
    let down = only(&[((1, 0), 9.1), ((2, 0), 8.2), ((3, 0), 7.3)]);
    for value in both(&frame, &down, &P) {
        near(value, 10.0 - sum / (1.0 + w[0] + w[1] + w[2]), 1e-6);
    }
}

/// Along an axis each side has a range of its own; over a square all share one, that grows ring by ring.
#[test]
fn who_shares_a_range() {
    let frame = frame(4.0, 10.0);
    let depth = only(&[((1, 0), 11.0), ((-2, 0), 12.0)]);
    let w = [1.0, 2.0].map(|x| weight(x, 3.0));
    let [square, along] = both(&frame, &depth, &P);
    near(along, 10.0 + (w[0] + 0.25 * w[1]) / (1.0 + w[0] + w[1]), 1e-12);
    near(square, 10.0 + (w[0] + 2.0 * w[1]) / (1.0 + w[0] + w[1]), 1e-12);
    // Within one ring nobody gains from another.
    let depth = only(&[((1, 0), 11.0), ((0, 1), 12.0), ((-1, -1), 12.0)]);
    let d = weight(2f64.sqrt(), 3.0);
    near(both(&frame, &depth, &P)[0], 10.0 + (w[0] + 0.25 * w[0] + 0.25 * d) / (1.0 + 2.0 * w[0] + d), 1e-12);
}

/// A large jump: the nearer side keeps its depth but for the clamp that rounds its edge off; the farther side, all of it.
#[test]
fn jumps_are_kept() {
    let frame = frame(4.0, 10.0);
    let depth = map(|x, _| if x > 0 { 30.0 } else { 10.0 });
    let result = depths(&narrow_range(&frame, &depth, &P));
    for x in 0..41 {
        let (value, own) = (result[at((x, 15))], depth[at((x, 15))]);
        match x {
            18..=20 => assert!(value > own && value < own + P.clamp, "{x}: {value}"),
            _ => assert_eq!(value, own, "{x}"),
        }
    }
    let small = map(|x, _| if x > 0 { 10.9 } else { 10.0 });
    let result = depths(&narrow_range(&frame, &small, &P));
    assert!(result[at((20, 15))] > 10.15 && result[at((21, 15))] < 10.75);
}

/// A slope keeps its depths but near its ends.
#[test]
fn a_slope_stays() {
    let frame = frame(4.0, 10.0);
    let depth = map(|x, y| 16.0 + 0.25 * x as f32 - 0.125 * y as f32);
    for value in both(&frame, &depth, &P) {
        near(value, 16.0, 1e-12);
    }
}
