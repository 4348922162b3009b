//! Twin of `glsl/layers/field.comp`: the density field in 64 bits, from its formula; and what the device has built, read back.

use super::Field;
use crate::{
    prepare::density::{rest_density, spline},
    shader::{
        FIELD_BALLS, FIELD_BRICK, FIELD_CELLS, FIELD_CROWD, FIELD_DENSEST, FIELD_FIRST_BALL, FIELD_FLAGS, FIELD_INSIDE,
        FIELD_MOST_BRICKS, FIELD_NODES, FIELD_ONE, FIELD_PLACE, FIELD_PROBES, FIELD_RECORD, FIELD_SURFACE, FIELD_TAG,
        SPLASH_RADIUS,
    },
    space::power_of_two,
};
use glam::{DVec3, IVec3, Vec4};
use std::collections::{BTreeMap, BTreeSet};

/// Coordinates of a node or a brick.
pub type Place = [i32; 3];

/// The field's lattice and kernel, lengths in the units of points: world units times the power of two that brings the radius into
/// 1..2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// From node to node; as the device has it, in single precision.
    pub spacing: f64,
    /// Support of the kernel.
    pub support: f64,
    /// Radius of a ball.
    pub ball: f64,
    /// What the weights of a filled body add up to.
    pub rest: f64,
    /// Density of the surface.
    pub level: f64,
}

impl Lattice {
    /// Of particles with this radius in world units.
    pub fn new(field: &Field, radius: f32) -> Lattice {
        let radius = radius * power_of_two(radius);
        Lattice {
            spacing: f64::from(field.spacing * radius),
            support: f64::from(field.kernel_radius) * f64::from(radius),
            ball: f64::from(SPLASH_RADIUS) * f64::from(radius),
            rest: rest_density(f64::from(field.kernel_radius)),
            level: f64::from(field.level),
        }
    }

    /// Position of a node.
    pub fn node(&self, node: Place) -> DVec3 {
        IVec3::from(node).as_dvec3() * self.spacing
    }

    /// What a point adds to the field at a position: W / rho.
    pub fn share(&self, point: &Vec4, position: DVec3) -> f64 {
        let density = f64::from(point.w);
        if density <= 0.0 {
            return 0.0;
        }
        let divisor = density.min(f64::from(FIELD_DENSEST)).max(f64::from(FIELD_CROWD) * density);
        spline(position.distance(point.truncate().as_dvec3()) / self.support) / (self.rest * divisor)
    }

    /// Each node that a point reaches, with the field there and how many points that is of.
    pub fn nodes(&self, points: &[Vec4]) -> BTreeMap<Place, (f64, u32)> {
        let mut all = BTreeMap::new();
        for point in points.iter().filter(|p| p.w > 0.0) {
            let x = point.truncate().as_dvec3();
            let low = ((x - self.support) / self.spacing).floor().as_ivec3();
            let high = ((x + self.support) / self.spacing).ceil().as_ivec3();
            for node in places(low, high) {
                let share = self.share(point, self.node(node));
                if share > 0.0 {
                    let (sum, count) = all.entry(node).or_insert((0.0, 0));
                    *sum += share;
                    *count += 1;
                }
            }
        }
        all
    }

    /// Bricks whose cells lie nearer to a point than it reaches, plus so much more.
    pub fn bricks(&self, points: &[Vec4], more: f64) -> BTreeSet<Place> {
        points.iter().filter(|p| p.w != 0.0).flat_map(|p| self.reached(p, more)).collect()
    }

    /// The same of one point.
    pub fn reached(&self, point: &Vec4, more: f64) -> Vec<Place> {
        let reach = more + if point.w < 0.0 { self.ball } else { self.support };
        let (x, edge) = (point.truncate().as_dvec3(), f64::from(FIELD_BRICK) * self.spacing);
        let [low, high] = [x - reach, x + reach].map(|x| (x / edge).floor().as_ivec3());
        let distance = |brick: &Place| {
            let corner = IVec3::from(*brick).as_dvec3() * edge;
            x.distance(x.clamp(corner, corner + edge))
        };
        places(low, high).filter(|brick| distance(brick) < reach).collect()
    }
}

/// All from one corner to the other, both included.
fn places(low: IVec3, high: IVec3) -> impl Iterator<Item = Place> {
    let plane = move |x| (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| [x, y, z]));
    (low.x..=high.x).flat_map(plane)
}

/// A brick as the device has built it.
#[derive(Clone, Debug, PartialEq)]
pub struct Brick {
    /// Where its nodes are among all.
    pub number: u32,
    /// Some of its cells hold the surface; some of its cells' nodes are inside; balls reach into it.
    pub flags: u32,
    /// The field at its nodes times [`FIELD_ONE`], x before y before z.
    pub nodes: Vec<u32>,
    /// One bit for each cell that holds the surface.
    pub cells: u64,
    /// Numbers of the bricks next to it, by which coordinates are larger there; its own first.
    pub neighbours: [u32; 8],
    /// Centres of its balls, in spacings from its first node on, in no order.
    pub balls: Vec<[f32; 3]>,
}

impl Brick {
    /// Whether there is this in it: [`FIELD_SURFACE`], [`FIELD_INSIDE`] or [`FIELD_BALLS`].
    pub fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }
}

/// The field as the device has built it, from its buffers' words.
#[derive(Clone, Copy, Debug)]
pub struct Words<'a> {
    /// "field directory"
    pub directory: &'a [u32],
    /// "field bricks"
    pub records: &'a [u32],
    /// "field nodes"
    pub nodes: &'a [u32],
    /// "field balls"
    pub balls: &'a [u32],
}

impl Words<'_> {
    fn record(&self, number: u32) -> &[u32] {
        &self.records[(FIELD_RECORD * number) as usize..][..FIELD_RECORD as usize]
    }

    fn place(&self, number: u32) -> Place {
        let at = FIELD_PLACE as usize;
        [0, 1, 2].map(|axis| self.record(number)[at + axis] as i32)
    }

    /// All bricks that there is room for.
    pub fn bricks(&self) -> BTreeMap<Place, Brick> {
        let taken = self.directory.iter().filter(|word| **word & FIELD_MOST_BRICKS != 0);
        taken.map(|word| (self.place(*word & FIELD_MOST_BRICKS), self.brick(*word))).collect()
    }

    fn brick(&self, word: u32) -> Brick {
        let number = word & FIELD_MOST_BRICKS;
        let record = self.record(number);
        let [low, high] = [FIELD_CELLS, FIELD_CELLS + 1].map(|at| u64::from(record[at as usize]));
        let mut neighbours = [number; 8];
        neighbours[1..].copy_from_slice(&record[1..8]);
        let mut balls = Vec::new();
        let mut next = record[FIELD_FIRST_BALL as usize];
        while next != 0 {
            let ball = &self.balls[4 * (next - 1) as usize..][..4];
            balls.push([ball[0], ball[1], ball[2]].map(f32::from_bits));
            next = ball[3];
        }
        let nodes = self.nodes[(FIELD_NODES * number) as usize..][..FIELD_NODES as usize].to_vec();
        let flags = word >> FIELD_FLAGS & (FIELD_SURFACE | FIELD_INSIDE | FIELD_BALLS);
        Brick { number, flags, nodes, cells: low | high << 32, neighbours, balls }
    }

    /// The number of a brick, as readers find it; 0 where there is none.
    pub fn find(&self, brick: Place) -> u32 {
        let [x, y, z] = brick.map(|c| c as u32);
        let mixed = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ z.wrapping_mul(0xc2b2_ae3d);
        let mixed = (mixed ^ mixed >> 15).wrapping_mul(0x2c1b_3c6d);
        let hash = mixed ^ mixed >> 13;
        let slots = (0..FIELD_PROBES).map(|i| self.directory[(hash.wrapping_add(i)) as usize % self.directory.len()]);
        let tagged = slots.take_while(|word| *word != 0).filter(|word| word >> FIELD_TAG == (hash >> FIELD_TAG).max(1));
        let mut numbers = tagged.map(|word| word & FIELD_MOST_BRICKS);
        numbers.find(|number| self.place(*number) == brick).unwrap_or(0)
    }
}

/// The field at a node, from bricks; 0 where there is none.
pub fn node_of(bricks: &BTreeMap<Place, Brick>, node: Place) -> u32 {
    let edge = FIELD_BRICK as i32;
    let [x, y, z] = node.map(|c| c.rem_euclid(edge) as usize);
    let edge_nodes = edge as usize;
    bricks.get(&node.map(|c| c.div_euclid(edge))).map_or(0, |b| b.nodes[x + edge_nodes * (y + edge_nodes * z)])
}

/// A level or density in the whole numbers of a node.
pub fn whole(density: f64) -> f64 {
    density * f64::from(FIELD_ONE)
}
