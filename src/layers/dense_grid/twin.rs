//! Twin of `glsl/layers/dense_grid.comp`: where the grid lies, which particles lie in it, and what it lacks. What they add is the
//! field's twin's.

use super::DenseGrid;
use crate::{
    layers::{Filling, field::twin::Lattice},
    shader::FIELD_BRICK,
};
use glam::{IVec3, Vec4};

/// The body's particles all of whose nodes the grid has; and nodes along each axis that it lacks.
pub fn inside(grid: &DenseGrid, points: &[Vec4], radius: f32) -> (Vec<Vec4>, [u32; 3]) {
    let lattice = Lattice::new(&grid.field(), radius);
    // The first and the last brick of the cells that a particle reaches.
    let reached = |point: &Vec4| {
        let x = point.truncate().as_dvec3();
        let first = ((x - lattice.support) / lattice.spacing).floor().as_ivec3();
        let last = ((x + lattice.support) / lattice.spacing).ceil().as_ivec3() - 1;
        [first, last].map(|node| node.map(|c| c.div_euclid(FIELD_BRICK as i32)))
    };
    let body: Vec<_> = points.iter().filter(|p| p.w > 0.0).map(|p| (*p, reached(p))).collect();
    let corner = body.iter().fold(IVec3::MAX, |low, (_, [first, _])| low.min(*first));
    let needed = body.iter().fold(IVec3::ZERO, |most, (_, [_, last])| most.max(*last - corner + 1));
    let bricks = IVec3::from(grid.bricks().map(|n| n as i32));
    let there = body.into_iter().filter(|(_, [_, last])| (*last - corner).cmplt(bricks).all());
    let lacking = FIELD_BRICK * (needed - bricks).max(IVec3::ZERO).as_uvec3();
    (there.map(|(point, _)| point).collect(), lacking.to_array())
}
