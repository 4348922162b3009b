//! Small maps with known answers.

use glam::Vec3;
use meniscus::{Camera, Settings, glam, shader::Frame, smooth::twin::Pixel, space::Space};

/// Odd, so that one pixel is the middle.
pub const SIZE: [i32; 2] = [41, 31];
pub const MIDDLE: (i32, i32) = (20, 15);

/// A camera on which a length of 1 at depth `depth` covers `pixels` pixels.
pub fn frame(pixels: f32, depth: f32) -> Frame {
    let angle = 2.0 * (SIZE[1] as f32 / (2.0 * pixels * depth)).atan();
    let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, angle, SIZE[0] as f32 / SIZE[1] as f32, 0.01);
    let size = SIZE.map(|n| n as u32);
    meniscus::inspect::uniforms(
        &camera,
        &Settings::default(),
        size,
        &Space::new(1.0, Vec3::ZERO),
        (Vec3::ZERO, Vec3::ONE),
    )
}

pub fn at((x, y): (i32, i32)) -> usize {
    (y * SIZE[0] + x) as usize
}

/// A map of depths; x and y are measured from the middle.
pub fn map(f: impl Fn(i32, i32) -> f32) -> Vec<f32> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x - MIDDLE.0, y - MIDDLE.1))).map(|(x, y)| f(x, y)).collect()
}

/// Nothing but the middle, at 10, and these, measured from it.
pub fn only(others: &[((i32, i32), f32)]) -> Vec<f32> {
    map(|x, y| match others.iter().find(|(p, _)| *p == (x, y)) {
        Some((_, d)) => *d,
        None if (x, y) == (0, 0) => 10.0,
        None => 0.0,
    })
}

pub fn depths(pixels: &[Pixel]) -> Vec<f32> {
    pixels.iter().map(|p| p.depth as f32).collect()
}

/// The middle's result.
pub fn middle(pixels: &[Pixel]) -> f64 {
    pixels[at(MIDDLE)].depth
}

#[track_caller]
pub fn near(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value}, not {expected}");
}

/// Uniform in -0.5..0.5, the same numbers everywhere.
pub fn noise(state: &mut u64) -> f32 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as f32 / (1u64 << 24) as f32 - 0.5
}
