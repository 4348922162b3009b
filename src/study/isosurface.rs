//! A second surface of particles, beside splashsurf's: marching cubes of our own density field (`layers::field`), on nodes twice as
//! dense, by its CPU twin's formula; what is a ball beside the field is one here. Of splashsurf there is only the table of triangles in
//! it: kernel, normalisation, level and normals are others, and nothing is smoothed.

use super::{mesh::Mesh, reconstruct::ReconstructError};
use crate::{
    Point,
    layers::field::{
        Field,
        twin::{Lattice, Place, weights},
    },
    space::power_of_two,
};
use glam::{DVec3, IVec3, Vec3, Vec4};
use rayon::prelude::*;
use splashsurf_lib::{
    density_map::DensityMap, marching_cubes::triangulate_density_map, nalgebra::Vector3, uniform_grid::UniformGrid,
};
use std::collections::HashMap;

/// Distance of nodes in particle radii.
pub const SPACING: f32 = 1.0;

/// Edge of the blocks that are summed up at once, in nodes.
const EDGE: i32 = 16;

/// Points, and balls, that reach a block.
type Reached = (Vec<usize>, Vec<usize>);

/// The field at the nodes of blocks, lengths in spacings.
struct Nodes {
    blocks: HashMap<Place, Vec<f64>>,
}

impl Nodes {
    /// Of points with what each adds where its kernel is 1.
    fn new(points: &[Vec4], shares: &[f64], balls: &[DVec3], lattice: &Lattice) -> Nodes {
        let mut reach: HashMap<Place, Reached> = HashMap::new();
        let mut reached = |x: DVec3, by: f64, note: &dyn Fn(&mut Reached)| {
            let [low, high] = [x - by, x + by].map(|x| (x / f64::from(EDGE)).floor().as_ivec3());
            for z in low.z..=high.z {
                for y in low.y..=high.y {
                    (low.x..=high.x).for_each(|x| note(reach.entry([x, y, z]).or_default()));
                }
            }
        };
        let place = |p: &Vec4| p.truncate().as_dvec3() / lattice.spacing;
        let ball = lattice.ball / lattice.spacing;
        for (i, p) in points.iter().enumerate() {
            reached(place(p), lattice.support / lattice.spacing, &|block| block.0.push(i));
        }
        for (i, center) in balls.iter().enumerate() {
            reached(*center, 2.0 * ball, &|block| block.1.push(i));
        }
        let sum = |(block, (own, balls_of)): (Place, Reached)| {
            let first = EDGE * IVec3::from(block);
            let mut sums = vec![0.0; (EDGE * EDGE * EDGE) as usize];
            let mut each = |x: DVec3, by: f64, add: &dyn Fn(&mut f64, IVec3)| {
                let low = ((x - by).ceil().as_ivec3() - first).max(IVec3::ZERO);
                let high = ((x + by).floor().as_ivec3() - first).min(IVec3::splat(EDGE - 1));
                for z in low.z..=high.z {
                    for y in low.y..=high.y {
                        for x in low.x..=high.x {
                            add(&mut sums[(x + EDGE * (y + EDGE * z)) as usize], first + IVec3::new(x, y, z));
                        }
                    }
                }
            };
            for (point, share) in own.iter().map(|i| (&points[*i], shares[*i])) {
                let share = |node: IVec3| share * lattice.kernel(point, lattice.node(node.to_array()));
                each(place(point), lattice.support / lattice.spacing, &|sum, node| *sum += share(node));
            }
            for center in balls_of.iter().map(|i| balls[*i]) {
                // Falls through the level at the ball.
                let inside = |node: IVec3| lattice.level * (2.0 - node.as_dvec3().distance(center) / ball);
                each(center, 2.0 * ball, &|sum, node| *sum = sum.max(inside(node)));
            }
            (block, sums)
        };
        let mut reach: Vec<_> = reach.into_iter().collect();
        // The same sums in the same order, however the map is.
        reach.sort_unstable_by_key(|(block, _)| *block);
        Nodes { blocks: reach.into_par_iter().map(sum).collect() }
    }

    fn at(&self, node: IVec3) -> f64 {
        let local = node.rem_euclid(IVec3::splat(EDGE));
        let block = node.div_euclid(IVec3::splat(EDGE)).to_array();
        self.blocks.get(&block).map_or(0.0, |sums| sums[(local.x + EDGE * (local.y + EDGE * local.z)) as usize])
    }

    /// Trilinear between nodes.
    fn between(&self, x: DVec3) -> f64 {
        let corner = x.floor();
        weights(x - corner).map(|(step, weight)| weight * self.at(corner.as_ivec3() + step)).sum()
    }

    /// Against the gradient, over a spacing each way.
    fn normal(&self, x: DVec3) -> Vec3 {
        let slope = DVec3::AXES.map(|axis| self.between(x - axis) - self.between(x + axis));
        DVec3::from(slope).normalize_or_zero().as_vec3()
    }
}

/// A mesh around particles, which [`crate::prepare::points`] gives; radius in world units.
pub fn isosurface(points: &[Point], radius: f32) -> Result<Mesh, ReconstructError> {
    if points.is_empty() {
        return Err(ReconstructError::NoParticles);
    }
    let unit = power_of_two(radius);
    let mut lattice = Lattice::new(&Field::default(), radius);
    lattice.spacing = f64::from(SPACING * radius * unit);
    let (splash, body): (Vec<&Point>, Vec<&Point>) = points.iter().partition(|p| p.is_ball());
    let body: Vec<Vec4> = body.iter().map(|p| (p.position * unit).extend(p.density)).collect();
    let balls: Vec<DVec3> = splash.iter().map(|p| (p.position * unit).as_dvec3() / lattice.spacing).collect();
    let mut shares: Vec<f64> = body.iter().map(|p| lattice.share(p)).collect();
    let sums = Nodes::new(&body, &shares, &[], &lattice);
    for (point, share) in body.iter().zip(&mut shares) {
        *share += lattice.raise(point, |node| sums.at(node.into()));
    }
    let nodes = Nodes::new(&body, &shares, &balls, &lattice);
    let low = nodes.blocks.keys().fold(IVec3::MAX, |low, b| low.min(IVec3::from(*b)));
    let high = nodes.blocks.keys().fold(IVec3::MIN, |high, b| high.max(IVec3::from(*b) + 1));
    let (first, cells) = (EDGE * low - 1, (EDGE * (high - low)).to_array().map(|n| i64::from(n) + 1));
    let failed = |e: &dyn std::fmt::Display| ReconstructError::Failed(e.to_string());
    let grid = UniformGrid::<i64, f64>::new(&Vector3::zeros(), &cells, 1.0).map_err(|e| failed(&e))?;
    let mut map = DensityMap::default();
    if let DensityMap::Standard(map) = &mut map {
        for (block, sums) in &nodes.blocks {
            for (i, sum) in (0..).zip(sums).filter(|(_, sum)| **sum > 0.0) {
                let local = IVec3::new(i % EDGE, i / EDGE % EDGE, i / (EDGE * EDGE));
                let node = (EDGE * IVec3::from(*block) + local - first).to_array().map(i64::from);
                map.insert(grid.flatten_point_index_array(&node), *sum);
            }
        }
    }
    let made = triangulate_density_map(&grid, &map, lattice.level).map_err(|e| failed(&e))?;
    if made.triangles.is_empty() {
        return Err(ReconstructError::NoSurface);
    }
    let places: Vec<DVec3> = made.vertices.iter().map(|v| DVec3::new(v.x, v.y, v.z) + first.as_dvec3()).collect();
    Ok(Mesh {
        normals: Some(places.par_iter().map(|x| nodes.normal(*x)).collect()),
        vertices: places.iter().map(|x| *x * (lattice.spacing / f64::from(unit))).collect(),
        triangles: made.triangles.iter().map(|t| t.map(|i| i as u32)).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::{Input, Options, points};
    use crate::shader::SPLASH_RADIUS;

    /// A splash is its ball; a block has about its particles' volume, and its faces lie a radius above the outermost particles.
    #[test]
    fn surfaces_are_where_the_liquids_are() {
        let radius = 0.03f32;
        let alone = points(&Input::new(&[Vec3::new(0.4, -2.0, 7.0)], radius), &Options::default()).expect("valid");
        let drop = isosurface(&alone, radius).expect("a drop");
        drop.check().expect("closed");
        let ball = f64::from(SPLASH_RADIUS * radius);
        for v in &drop.vertices {
            let off = v.distance(DVec3::new(0.4, -2.0, 7.0)) / ball;
            // Along an edge of a cube the distance is not quite linear.
            assert!((0.95..1.01).contains(&off), "{off}");
        }
        let place = |i: i32| Vec3::new((i % 12) as f32, (i / 12 % 12) as f32, (i / 144) as f32) * 2.0 * radius;
        let block: Vec<Vec3> = (0..12 * 12 * 12).map(place).collect();
        let found = points(&Input::new(&block, radius), &Options::default()).expect("valid");
        let mesh = isosurface(&found, radius).expect("a block");
        mesh.check().expect("closed");
        let volume = mesh.volume() / (1728.0 * 8.0 * f64::from(radius).powi(3));
        assert!((0.9..1.1).contains(&volume), "{volume}");
        let middle = f64::from(radius) * 11.0;
        let normals = mesh.normals.as_ref().expect("normals");
        let mut face = 0;
        for (v, n) in mesh.vertices.iter().zip(normals) {
            let from_middle = (*v - middle) / f64::from(radius);
            if from_middle.x > 9.0 && from_middle.y.abs().max(from_middle.z.abs()) < 6.0 {
                face += 1;
                assert!((from_middle.x - 12.0).abs() < 0.25 && n.x > 0.98, "{from_middle} {n}");
            }
        }
        assert!(face > 50, "{face}");
        assert_eq!(isosurface(&[], radius), Err(ReconstructError::NoParticles));
    }
}
