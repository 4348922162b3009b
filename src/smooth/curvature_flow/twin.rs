//! Twin of `glsl/smooth/curvature_flow.comp`: vdLaan09's formulas as printed, in 64 bits and with z = -depth, where the shader
//! has one sum of small terms.

use super::CurvatureFlow;
use crate::{
    shader::Frame,
    smooth::twin::{Count, Map, Pixel},
};

/// What the filter can be told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Δt, in particle radii times pixels; at least 0. vdLaan09 prints none.
    pub time_step: f32,
    /// A larger difference between neighbours is a boundary, in particle radii; 0 to 1000. vdLaan09 prints
    /// none; Truong18 compares with 5.
    pub jump: f32,
}

impl From<&CurvatureFlow> for Parameters {
    fn from(p: &CurvatureFlow) -> Parameters {
        Parameters { time_step: p.time_step, jump: p.jump }
    }
}

/// One step's result.
#[derive(Clone, Debug, PartialEq)]
pub struct Flow {
    /// Depths.
    pub pixel: Vec<Pixel>,
    /// Pixels whose step was shortened to the stable one.
    pub shortened: Count,
    /// Pixels that were not moved, as they would have come to lie before the near plane.
    pub refused: Count,
}

/// One explicit step.
pub fn curvature_flow(frame: &Frame, depth: &[f32], p: &Parameters) -> Vec<Pixel> {
    flow(frame, depth, p).pixel
}

/// One explicit step, with what the guards count.
pub fn flow(frame: &Frame, depth: &[f32], p: &Parameters) -> Flow {
    let map = Map::new(frame, depth);
    let [ax, ay] = [frame.pixel_scale.x, frame.pixel_scale.y].map(|a| f64::from(a).abs());
    let (cx, cy) = (1.0 / ax, 1.0 / ay);
    let (mut shortened, mut refused) = (Count::default(), Count::default());
    let pixel = map.each(|x, y, own| {
        let (d, sizes) = derivatives(&map, x, y, p.jump);
        let stable = own / (ax + ay);
        let step = f64::from(p.time_step).min(stable);
        let excess = f64::from(p.time_step) - stable;
        shortened.add(excess > 0.0, excess.abs() < 4.0 * f64::from(f32::EPSILON) * stable);
        let rate = |d: [f64; 5]| mean_curvature([cx, cy], -own, &d.map(|v| -v));
        let moved = own - rate(d) * step;
        // The rises that a derivative adds up are rounded by half a step each, and so is their sum.
        let shaken = (0..5).map(|k| {
            let mut other = d;
            other[k] += 1.5 * f64::from(f32::EPSILON) * sizes[k];
            (rate(other) - rate(d)).abs()
        });
        let slack = rounding([ax, ay], own, &d, step, moved) + step * shaken.sum::<f64>();
        let pixel = Pixel { depth: moved, slack, or: None };
        let near = f64::from(frame.near);
        let (before, close) = (moved < near, (moved - near).abs() <= slack);
        refused.add(before, close);
        match (before, close) {
            (false, false) => pixel,
            (true, false) => Pixel { depth: own, slack: 0.0, or: None },
            (_, true) => Pixel { or: Some(own), ..pixel },
        }
    });
    Flow { pixel, shortened, refused }
}

/// d_x, d_y, d_xx, d_yy, d_xy: central differences; zero across a boundary. Then what the rises they are made of would add
/// up to without their signs.
fn derivatives(map: &Map, x: i32, y: i32, jump: f32) -> ([f64; 5], [f64; 5]) {
    let own = map.at(x, y).unwrap_or(0.0);
    // Rises before and after, and whether both are there.
    let pair = |i: i32, j: i32| {
        let [a, b] = [map.at(x - i, y - j), map.at(x + i, y + j)].map(|d| d.filter(|d| *d > 0.0));
        let (a, b) = (a?, b?);
        // In 32 bits, as the shader decides it: a difference is rounded alike everywhere.
        let near = (a - own).abs() <= jump && (b - own).abs() <= jump;
        near.then_some([a, b].map(|d| f64::from(d) - f64::from(own)))
    };
    let along = |i, j| pair(i, j).unwrap_or_default();
    let ([w, e], [n, s]) = (along(1, 0), along(0, 1));
    let [size_x, size_y] = [w.abs() + e.abs(), n.abs() + s.abs()];
    let (dxy, size_xy) = match (pair(1, 1), pair(1, -1)) {
        (Some([a, b]), Some([c, d])) => (0.25 * (a + b - c - d), a.abs() + b.abs() + c.abs() + d.abs()),
        _ => (0.0, 0.0),
    };
    let derivatives = [0.5 * (e - w), 0.5 * (s - n), e + w, s + n, dxy];
    (derivatives, [0.5 * size_x, 0.5 * size_y, size_x, size_y, 0.25 * size_xy])
}

/// H from D, its derivatives, E_x and E_y. C_x and C_y are negative because eye-space positions are multiples of z, which is;
/// the other sign would roughen.
fn mean_curvature([cx, cy]: [f64; 2], z: f64, [zx, zy, zxx, zyy, zxy]: &[f64; 5]) -> f64 {
    let (cx, cy) = (-cx, -cy);
    let d = (cy * zx).powi(2) + (cx * zy).powi(2) + (cx * cy * z).powi(2);
    let d_x = 2.0 * (cy.powi(2) * zx * zxx + cx.powi(2) * zy * zxy + (cx * cy).powi(2) * z * zx);
    let d_y = 2.0 * (cy.powi(2) * zx * zxy + cx.powi(2) * zy * zyy + (cx * cy).powi(2) * z * zy);
    let e_x = 0.5 * zx * d_x - zxx * d;
    let e_y = 0.5 * zy * d_y - zyy * d;
    0.5 * (cy * e_x + cx * e_y) / d.powf(1.5)
}

/// Each term of the shader's sum is a product of up to a dozen factors: 24 ulp of what all terms would add up to without
/// their signs; then half a step of the depth.
fn rounding([ax, ay]: [f64; 2], own: f64, [dx, dy, dxx, dyy, dxy]: &[f64; 5], step: f64, moved: f64) -> f64 {
    let (p, q) = (ax * dx / own, ay * dy / own);
    let s = 1.0 + p * p + q * q;
    let size = ax * dxx.abs() * (1.0 + q * q)
        + ay * dyy.abs() * (1.0 + p * p)
        + (ax + ay) * (p * q * dxy).abs()
        + (p * dx).abs()
        + (q * dy).abs();
    f64::from(f32::EPSILON) * (0.5 * moved.abs() + 24.0 * step * 0.5 * size / (s.powf(1.5) * own))
}
