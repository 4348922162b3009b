//! Curvature flow against what is known of it.

use super::support::{MIDDLE, SIZE, at, depths, frame, map, middle, near, noise};
use meniscus::smooth::curvature_flow::twin::{Parameters, curvature_flow, flow};

/// In the middle of the view, a ball of radius R: -H is what a pixel covers, over R, away from the viewer, towards the
/// inside of the ball.
#[test]
fn a_ball_shrinks_by_its_curvature() {
    let (center, radius) = (12.0f64, 4.0f64);
    let frame = frame(10.0, 8.0);
    let [ax, ay] = [frame.pixel_scale.x, frame.pixel_scale.y].map(f64::from);
    let ball = map(|x, y| {
        let square = 1.0 + (f64::from(x) / ax).powi(2) + (f64::from(y) / ay).powi(2);
        let root = center.powi(2) - square * (center.powi(2) - radius.powi(2));
        if root < 0.0 { 0.0 } else { ((center - root.sqrt()) / square) as f32 }
    });
    let p = Parameters { time_step: 0.05, jump: 1.0 };
    let moved = middle(&curvature_flow(&frame, &ball, &p)) - 8.0;
    near(moved / (0.05 * 0.1 / radius), 1.0, 2e-3);
}

/// For waves much lower than long the flow is diffusion, of a / 2d square pixels a unit of time on each axis; second
/// differences of a cosine are -4 sin^2(k / 2) of it.
#[test]
fn low_waves_decay_as_heat_does() {
    let frame = frame(2.0, 10.0);
    let [ax, ay] = [frame.pixel_scale.x.abs(), frame.pixel_scale.y.abs()].map(f64::from);
    let p = Parameters { time_step: 0.1, jump: 1.0 };
    for (kx, ky) in [(0.5, 0.0), (0.0, 0.8), (0.7, 0.3), (3.0, 3.0)] {
        let wave = |x: i32, y: i32| (kx * f64::from(x)).cos() * (ky * f64::from(y)).cos();
        let depth = map(|x, y| 10.0 + 2e-3 * wave(x, y) as f32);
        let amplitude = f64::from(depth[at(MIDDLE)]) - 10.0;
        let rate = |a: f64, k: f64| 0.5 * a / 10.0 * 4.0 * (k / 2.0f64).sin().powi(2);
        let expected = amplitude * (1.0 - 0.1 * (rate(ax, kx) + rate(ay, ky)));
        near((middle(&curvature_flow(&frame, &depth, &p)) - 10.0) / expected, 1.0, 2e-3);
    }
}

/// A plane across the view stays, by however long a step; one that is tilted moves, since the paper leaves the view's
/// position in the image out of the normal: by -p d_x of the shader's sum, d_xx = 2 d_x^2 / d of a plane against it.
#[test]
fn planes_move_as_the_simplified_normal_has_it() {
    let frame = frame(4.0, 10.0);
    let p = Parameters { time_step: 1e9, jump: 1.0 };
    let flat = map(|_, _| 12.5);
    assert_eq!(depths(&curvature_flow(&frame, &flat, &p)), flat);

    let slope = 0.002;
    let depth: Vec<f32> = map(|x, _| (1.0 / (0.1 - slope / 100.0 * f64::from(x))) as f32);
    let p = Parameters { time_step: 0.1, jump: 1.0 };
    let (a, d, dx) = (f64::from(frame.pixel_scale.x.abs()), 10.0, slope);
    let (slant, dxx) = (a * dx / d, 2.0 * dx * dx / d);
    let s = 1.0 + slant * slant;
    let expected = 0.1 * 0.5 * (a * dxx - slant * dx) / (s.powf(1.5) * d);
    let moved = middle(&curvature_flow(&frame, &depth, &p)) - 10.0;
    assert!(expected > 0.0 && moved > 0.0);
    near(moved, expected, 0.5 * expected);
}

#[test]
fn nothing_crosses_a_jump() {
    let frame = frame(4.0, 10.0);
    let step = |h: f32| map(|x, _| if x > 0 { 10.0 + h } else { 10.0 });
    let p = Parameters { time_step: 0.1, jump: 0.5 };
    assert_eq!(depths(&curvature_flow(&frame, &step(0.51), &p)), step(0.51));
    let result = depths(&curvature_flow(&frame, &step(0.5), &p));
    assert!(result[at((20, 15))] > 10.0 && result[at((21, 15))] < 10.5);
    // Along the jump smoothing goes on.
    let ridge = map(|x, y| if x > 0 { 20.0 } else { 10.0 + 0.01 * (y % 2).abs() as f32 });
    let result = depths(&curvature_flow(&frame, &ridge, &p));
    assert!(result[at((20, 15))] != ridge[at((20, 15))] && result[at((21, 15))] == 20.0);
}

/// A pixel beside a hole or at the image's border has no derivative across it.
#[test]
fn silhouettes_and_borders_stay() {
    let frame = frame(4.0, 10.0);
    let bowl = map(|x, y| if x * x + y * y < 90 { 10.0 + 0.002 * (x * x) as f32 } else { 0.0 });
    let p = Parameters { time_step: 0.1, jump: 1.0 };
    let result = depths(&curvature_flow(&frame, &bowl, &p));
    let mut edge = 0;
    for y in 0..SIZE[1] {
        for x in 1..SIZE[0] - 1 {
            if bowl[at((x, y))] > 0.0 && (bowl[at((x - 1, y))] == 0.0 || bowl[at((x + 1, y))] == 0.0) {
                assert_eq!(result[at((x, y))], bowl[at((x, y))]);
                edge += 1;
            }
        }
    }
    assert!(edge > 20 && result[at(MIDDLE)] > 10.0);
    let valley = map(|x, _| 10.0 + 0.002 * (x * x) as f32);
    let result = depths(&curvature_flow(&frame, &valley, &p));
    assert_eq!(result[at((0, 15))], valley[at((0, 15))]);
    assert!(result[at((1, 0))] > valley[at((1, 0))]);
}

/// However long the step, noise does not grow: every step is shortened to the stable one.
#[test]
fn long_steps_are_shortened() {
    let frame = frame(4.0, 10.0);
    let p = Parameters { time_step: 1e9, jump: 1.0 };
    let mut state = 3;
    let mut depth: Vec<f32> =
        map(|x, y| 10.0 + 0.1 * ((x + y) & 1) as f32).iter().map(|d| d + 0.05 * noise(&mut state)).collect();
    let spread = |d: &[f32]| d.iter().fold(0.0f32, |s, d| s.max((d - 10.05).abs()));
    let before = spread(&depth);
    for _ in 0..50 {
        let step = flow(&frame, &depth, &p);
        assert_eq!((step.shortened.least as usize, step.refused.most), (depth.len(), 0));
        depth = depths(&step.pixel);
        assert!(spread(&depth) <= before * 1.0001, "{} after {before}", spread(&depth));
    }
    let stable = 10.0 / (frame.pixel_scale.x.abs() + frame.pixel_scale.y.abs());
    let flat = map(|_, _| 10.0);
    for (factor, shortened) in [(0.99, 0), (1.01, flat.len() as u32)] {
        let found = flow(&frame, &flat, &Parameters { time_step: factor * stable, jump: 1.0 }).shortened;
        assert_eq!((found.least, found.most), (shortened, shortened));
    }
}

/// A depth that would come to lie before the near plane is kept.
#[test]
fn the_near_plane_is_not_crossed() {
    let mut frame = frame(4.0, 10.0);
    let depth = map(|x, y| if (x, y) == (0, 0) { 10.0 } else { 9.9 });
    let p = Parameters { time_step: 0.1, jump: 1.0 };
    let free = middle(&curvature_flow(&frame, &depth, &p));
    assert!(free < 10.0);
    frame.near = free as f32 + 1e-4;
    let kept = flow(&frame, &depth, &p);
    assert_eq!(middle(&kept.pixel), 10.0);
    assert!(kept.refused.least > 0);
}
