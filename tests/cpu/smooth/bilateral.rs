//! The bilateral filters' weights.

use super::support::{at, depths, frame, map, middle, near, noise, only};
use meniscus::smooth::bilateral::twin::{Parameters, bilateral};
use meniscus::smooth::bilateral_separable::twin::bilateral_separable;
use meniscus::smooth::twin::Axis;

fn pixels(sigma_space: f32, sigma_depth: f32, reach: u32) -> Parameters {
    Parameters { sigma_space, sigma_depth, reach, projected: false }
}

/// Two pixels: the average of two depths, with the weight as it is defined.
#[test]
fn weights_are_gaussians_of_distance_and_of_depth() {
    let frame = frame(4.0, 10.0);
    for (offset, rise) in [((1, 0), 0.5), ((0, -2), -0.25), ((-3, 1), 1.0), ((2, 4), 0.1)] {
        let depth = only(&[(offset, 10.0 + rise)]);
        let square = f64::from(offset.0 * offset.0 + offset.1 * offset.1);
        let rise = f64::from(rise);
        let rise = f64::from((10.0 + rise) as f32) - 10.0;
        for (p, sigma) in [
            (pixels(1.7, 0.6, 4), 1.7),
            // Half a radius is two pixels; the window is then ceil(3 * 2).
            (Parameters { sigma_space: 0.5, sigma_depth: 0.6, reach: 20, projected: true }, 2.0),
        ] {
            let w = (-square / (2.0 * sigma * sigma) - rise * rise / (2.0 * 0.36)).exp();
            near(middle(&bilateral(&frame, &depth, &p)), 10.0 + w * rise / (1.0 + w), 1e-6);
            let along = if offset.1 == 0 { w * rise / (1.0 + w) } else { 0.0 };
            near(middle(&bilateral_separable(&frame, &depth, &p, Axis::X)), 10.0 + along, 1e-6);
        }
    }
}

#[test]
fn the_window_ends_where_it_should() {
    let frame = frame(4.0, 10.0);
    // At 1.01 pixels a sigma, three of them reach 4 pixels; at most 3, if clipped.
    let projected = |reach| Parameters { sigma_space: 0.2525, sigma_depth: 10.0, reach, projected: true };
    for (p, last) in [(pixels(3.0, 10.0, 3), 3), (pixels(3.0, 10.0, 7), 7), (projected(9), 4), (projected(3), 3)] {
        for (apart, moves) in [(last, true), (last + 1, false)] {
            let depth = only(&[((apart, 0), 10.5)]);
            assert_eq!(middle(&bilateral(&frame, &depth, &p)) != 10.0, moves, "{p:?}, {apart}");
            assert_eq!(middle(&bilateral_separable(&frame, &depth, &p, Axis::X)) != 10.0, moves, "{p:?}, {apart}");
        }
    }
}

/// A jump of many sigma is kept, one of half a sigma is smoothed.
#[test]
fn large_jumps_are_kept() {
    let frame = frame(4.0, 10.0);
    let p = pixels(2.0, 0.1, 4);
    let step = |h: f32| map(|x, _| if x > 0 { 10.0 + h } else { 10.0 });
    let kept = step(2.0);
    assert_eq!(depths(&bilateral(&frame, &kept, &p)), kept);
    assert_eq!(depths(&bilateral_separable(&frame, &kept, &p, Axis::X)), kept);
    let result = depths(&bilateral(&frame, &step(0.05), &p));
    assert!(result[at((20, 15))] > 10.01 && result[at((21, 15))] < 10.04);
}

/// A slope stays in the middle and warps at its edge (Imai16 §3.2, problem 2).
#[test]
fn slopes_warp_at_their_edges_only() {
    let frame = frame(4.0, 10.0);
    let slope = map(|x, _| if x <= 15 { 10.0 + 0.125 * x as f32 } else { 0.0 });
    let p = pixels(2.0, 1.0, 4);
    let result = bilateral(&frame, &slope, &p);
    near(middle(&result), 10.0, 1e-12);
    assert!(result[at((35, 15))].depth < f64::from(slope[at((35, 15))]) - 0.1);
}

/// With a sigma in depth beyond all rises, the filter is Gauss's, and that is separable.
#[test]
fn rows_then_columns_are_the_square_where_depth_plays_no_part() {
    let frame = frame(4.0, 10.0);
    let mut state = 4;
    let depth: Vec<f32> = map(|_, _| 10.0).iter().map(|d| d + noise(&mut state)).collect();
    let p = pixels(1.5, 1e6, 5);
    let rows = depths(&bilateral_separable(&frame, &depth, &p, Axis::X));
    let both = bilateral_separable(&frame, &rows, &p, Axis::Y);
    for (a, b) in both.iter().zip(bilateral(&frame, &depth, &p)) {
        near(a.depth, b.depth, 2e-6);
    }
}
