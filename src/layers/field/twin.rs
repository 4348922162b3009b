//! Twin of `glsl/layers/field.comp` and `field_cells.comp`: the density field in 64 bits, from its formula; and what the device has built, read back.

use super::{Field, kernel, rest};
use crate::{
    shader::{
        FIELD_BALL, FIELD_BALL_BELOW, FIELD_BALL_BITS, FIELD_BALL_STEPS, FIELD_BALLS, FIELD_BEYOND, FIELD_BRICK,
        FIELD_CELL_RECORD, FIELD_CELLS, FIELD_CROWD, FIELD_DENSEST, FIELD_ENOUGH, FIELD_FIRST_BALL, FIELD_FIRST_BRICK,
        FIELD_FIRST_CELL, FIELD_HALF, FIELD_INSIDE, FIELD_NODE_WORDS, FIELD_NODES, FIELD_ONE, FIELD_PLACE,
        FIELD_PROBES, FIELD_RAISED, FIELD_RECORD, FIELD_RIM, FIELD_SLOT, FIELD_STEEPEST, FIELD_SURE, FIELD_SURFACE,
        FIELD_THERE, FIELD_THIN, FIELD_THINNED, FIELD_TIP, SPLASH_RADIUS,
    },
    space::power_of_two,
};
use glam::{DVec3, I8Vec3, IVec3, Vec4};
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
            rest: rest(f64::from(field.kernel_radius)),
            level: f64::from(field.level),
        }
    }

    /// Position of a node.
    pub fn node(&self, node: Place) -> DVec3 {
        IVec3::from(node).as_dvec3() * self.spacing
    }

    /// What a point adds to the field where its kernel is 1: 1 / rho.
    pub fn share(&self, point: &Vec4) -> f64 {
        let density = f64::from(point.w);
        if density <= 0.0 {
            return 0.0;
        }
        let rim = (FIELD_RIM - FIELD_THINNED * (FIELD_RIM - point.w)).max(FIELD_THIN);
        let divisor = density.min(f64::from(rim.min(FIELD_DENSEST))).max(f64::from(FIELD_CROWD) * density);
        (self.rest * divisor).recip()
    }

    /// A point's kernel at a position.
    pub fn kernel(&self, point: &Vec4, position: DVec3) -> f64 {
        kernel(position.distance(point.truncate().as_dvec3()) / self.support)
    }

    /// How far the field encloses one of its particles, as a part of the level, or surely; from its values at nodes.
    pub fn encloses(&self, point: &Vec4, at: impl Fn(Place) -> f64) -> f64 {
        if point.w >= FIELD_SURE {
            return f64::INFINITY;
        }
        let x = point.truncate().as_dvec3() / self.spacing;
        let first = x.floor();
        let node = |step: IVec3| at((first.as_ivec3() + step).to_array());
        let f = |part: DVec3| -> f64 { weights(part).map(|(step, weight)| weight * node(step)).sum() };
        let part = x - first;
        // Along an axis what is trilinear is straight.
        let slope = |axis: usize| {
            let [mut low, mut high] = [part; 2];
            (low[axis], high[axis]) = (0.0, 1.0);
            f(high) - f(low)
        };
        let radius = self.ball / self.spacing / f64::from(SPLASH_RADIUS);
        let beyond = if point.w < FIELD_TIP { f64::from(FIELD_BEYOND) * radius } else { 0.0 };
        (f(part) - beyond * DVec3::from([0, 1, 2].map(slope)).length()) / self.level
    }

    /// What one of its particles adds besides where its kernel is 1, since the sum of all shares does not enclose it.
    pub fn raise(&self, point: &Vec4, at: impl Fn(Place) -> f64) -> f64 {
        let lacking = self.level * (1.0 + f64::from(FIELD_ENOUGH) - self.encloses(point, at));
        let x = point.truncate().as_dvec3() / self.spacing;
        let first = x.floor();
        let kernel = |step: IVec3| self.kernel(point, (first + step.as_dvec3()) * self.spacing);
        let own: f64 = weights(x - first).map(|(step, weight)| weight * kernel(step)).sum();
        if lacking > 0.0 { (f64::from(FIELD_RAISED) * lacking / own).min(self.share(point)) } else { 0.0 }
    }

    /// Each node that a point reaches. `added`: of all points those whose shares are in it.
    pub fn nodes(&self, points: &[Vec4], added: &[Vec4]) -> BTreeMap<Place, Node> {
        let mut all: BTreeMap<Place, Node> = BTreeMap::new();
        for point in added.iter().filter(|p| p.w > 0.0) {
            self.each_reached(point, |node, kernel| {
                let node = all.entry(node).or_default();
                node.field += self.share(point) * kernel;
                node.points += 1;
            });
        }
        let shares = all.clone();
        let at = |node: Place| shares.get(&node).map_or(0.0, |n| n.field);
        for point in points.iter().filter(|p| p.w > 0.0) {
            let raise = self.raise(point, at);
            let first = (point.truncate().as_dvec3() / self.spacing).floor().as_ivec3();
            let around = places(first, first + 1).filter_map(|node| shares.get(&node));
            let behind = around.map(|n| n.points).max().unwrap_or(0);
            // Rounding decides whether it is a little or nothing.
            if raise > 0.0 || self.encloses(point, at) < 1.1 {
                self.each_reached(point, |node, kernel| {
                    let node = all.entry(node).or_default();
                    node.field += raise * kernel;
                    node.raised += 1;
                    node.raises += kernel;
                    node.behind += f64::from(behind) * kernel;
                });
            }
        }
        all
    }

    /// The nodes that a point reaches, and its kernel there.
    fn each_reached(&self, point: &Vec4, mut each: impl FnMut(Place, f64)) {
        let x = point.truncate().as_dvec3();
        let low = ((x - self.support) / self.spacing).floor().as_ivec3();
        let high = ((x + self.support) / self.spacing).ceil().as_ivec3();
        for node in places(low, high) {
            let kernel = self.kernel(point, self.node(node));
            if kernel > 0.0 {
                each(node, kernel);
            }
        }
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

/// The field at a node, and what rounding in it comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Node {
    /// As a part of a filled body's.
    pub field: f64,
    /// How many points it is of.
    pub points: u32,
    /// How many of these add more;
    pub raised: u32,
    /// their kernels there;
    pub raises: f64,
    /// and of how many points the sums are that this follows from, by the same kernels.
    pub behind: f64,
}

/// All from one corner to the other, both included.
fn places(low: IVec3, high: IVec3) -> impl Iterator<Item = Place> {
    let plane = move |x| (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| [x, y, z]));
    (low.x..=high.x).flat_map(plane)
}

/// A node as a walk finds it: the field in a byte, and its gradient.
pub type Corner = (u8, [i8; 3]);

/// The field at a node as a walk finds it: in 1/128 of the level, rounded down.
pub fn byte(level: u32, sum: u32) -> u8 {
    (u64::from(sum) * u64::from(FIELD_HALF) / u64::from(level)).min(255) as u8
}

/// Its gradient there, from the sums of the nodes around it, by how far away these are: Scharr's central differences, by 3 : 10 : 3 across.
pub fn slopes(sum: impl Fn(IVec3) -> u32) -> [i8; 3] {
    let across = |step: i32| if step == 0 { 10.0 / 16.0 } else { 3.0 / 16.0 };
    let mut slope = [0.0; 3];
    for step in places(-IVec3::ONE, IVec3::ONE).map(IVec3::from) {
        for axis in 0..3 {
            let [a, b] = [(axis + 1) % 3, (axis + 2) % 3].map(|other| across(step[other]));
            slope[axis] += f64::from(step[axis]) / 2.0 * a * b * f64::from(sum(step));
        }
    }
    let slope = slope.map(|s| s / (FIELD_STEEPEST as f64 * f64::from(FIELD_ONE)));
    // What is steeper keeps its direction.
    let steepest = slope.iter().fold(1f64, |most, s| most.max(s.abs()));
    slope.map(|s| (127.0 * s / steepest).round() as i8)
}

/// A brick as the device has built it.
#[derive(Clone, Debug, PartialEq)]
pub struct Brick {
    /// Where its nodes are among all.
    pub number: u32,
    /// Some of its cells hold the surface.
    pub surface: bool,
    /// Balls reach into it.
    pub has_balls: bool,
    /// The field at its nodes times [`FIELD_ONE`], x before y before z.
    pub nodes: Vec<u32>,
    /// One bit for each node that is inside.
    pub inside: u64,
    /// One bit for each cell that holds the surface.
    pub cells: u64,
    /// Of each of these, in the order of the bits, what its corners hold, x before y before z.
    pub corners: Vec<[Corner; 8]>,
    /// Centres of its balls, in spacings from its first node on, in no order.
    pub balls: Vec<[f32; 3]>,
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
    /// "field cells"
    pub cells: &'a [u32],
    /// "field balls"
    pub balls: &'a [u32],
}

impl<'a> Words<'a> {
    /// Names of these buffers, in their order.
    pub const BUFFERS: [&'static str; 5] =
        ["field directory", "field bricks", "field nodes", "field cells", "field balls"];

    /// Of the buffers in the order of [`Words::BUFFERS`].
    pub fn new([directory, records, nodes, cells, balls]: [&'a [u32]; 5]) -> Words<'a> {
        Words { directory, records, nodes, cells, balls }
    }

    fn slot(&self, slot: usize) -> &[u32] {
        &self.directory[FIELD_SLOT as usize * slot..][..FIELD_SLOT as usize]
    }

    /// Those that blocks can have; one more follows them, which has nothing in it.
    fn slots(&self) -> usize {
        self.directory.len() / FIELD_SLOT as usize - 1
    }

    fn bits(&self, slot: usize, which: u32) -> u64 {
        bits(&self.slot(slot)[which as usize..])
    }

    fn place(&self, slot: usize) -> IVec3 {
        let place = &self.slot(slot)[FIELD_PLACE as usize..];
        IVec3::new(place[0] as i32, place[1] as i32, place[2] as i32)
    }

    /// The number of the k-th brick of a slot's block, if it has that.
    fn number(&self, slot: usize, k: u32) -> Option<u32> {
        let there = self.bits(slot, FIELD_THERE);
        let before = (there & ((1 << k) - 1)).count_ones();
        (there >> k & 1 == 1).then(|| self.slot(slot)[FIELD_FIRST_BRICK as usize] + before)
    }

    /// All bricks that there is room for.
    pub fn bricks(&self) -> BTreeMap<Place, Brick> {
        let all = (0..self.slots()).flat_map(|slot| (0..FIELD_NODES).map(move |k| (slot, k)));
        let brick = |(slot, k): (usize, u32)| {
            let number = self.number(slot, k)?;
            let local = IVec3::new(k as i32 & 3, k as i32 >> 2 & 3, k as i32 >> 4);
            let place = FIELD_BRICK as i32 * self.place(slot) + local;
            Some((place.to_array(), self.brick(slot, k, number)))
        };
        all.filter_map(brick).collect()
    }

    fn brick(&self, slot: usize, k: u32, number: u32) -> Brick {
        let record = &self.records[(FIELD_RECORD * number) as usize..][..FIELD_RECORD as usize];
        let cells = bits(&record[FIELD_CELLS as usize..]);
        let first = record[FIELD_FIRST_CELL as usize];
        let corners = (first..first + cells.count_ones()).map(|cell| self.corners(cell)).collect();
        let mut balls = Vec::new();
        let mut next = record[FIELD_FIRST_BALL as usize];
        while next != 0 {
            let ball = &self.balls[(FIELD_BALL * (next - 1)) as usize..][..FIELD_BALL as usize];
            let steps = [0, 1, 2].map(|axis| ball[0] >> (FIELD_BALL_BITS * axis) & ((1 << FIELD_BALL_BITS) - 1));
            balls.push(steps.map(|s| s as f32 / FIELD_BALL_STEPS as f32 - FIELD_BALL_BELOW as f32));
            next = ball[1];
        }
        let words = &self.nodes[(FIELD_NODE_WORDS * number) as usize..][..FIELD_NODE_WORDS as usize];
        let nodes = words.iter().flat_map(|w| [w & 0xffff, w >> 16]).collect();
        let flag = |which| self.bits(slot, which) >> k & 1 == 1;
        Brick {
            number,
            surface: flag(FIELD_SURFACE),
            has_balls: flag(FIELD_BALLS),
            nodes,
            inside: bits(&record[FIELD_INSIDE as usize..]),
            cells,
            corners,
            balls,
        }
    }

    fn corners(&self, cell: u32) -> [Corner; 8] {
        let words = &self.cells[(FIELD_CELL_RECORD * cell) as usize..][..FIELD_CELL_RECORD as usize];
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        [0, 1, 2, 3, 4, 5, 6, 7].map(|c| (bytes[c], [8, 16, 24].map(|at| bytes[at + c] as i8)))
    }

    /// The number of a brick, as readers find it; 0 where there is none.
    pub fn find(&self, brick: Place) -> u32 {
        let block: IVec3 = IVec3::from(brick) >> 2;
        let [x, y, z] = block.to_array().map(|c| c as u32);
        let mixed = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ z.wrapping_mul(0xc2b2_ae3d);
        let mixed = (mixed ^ mixed >> 15).wrapping_mul(0x2c1b_3c6d);
        let hash = mixed ^ mixed >> 13;
        let slots = (0..FIELD_PROBES).map(|i| hash.wrapping_add(i) as usize % self.slots());
        let mut own = slots.take_while(|s| self.slot(*s)[0] != 0).filter(|s| self.place(*s) == block);
        let local = local_bit(IVec3::from(brick) & 3);
        own.next().and_then(|slot| self.number(slot, local)).unwrap_or(0)
    }
}

/// Which bit of a brick's a cell or node has, by its place in it; or of a block's a brick.
pub fn local_bit(local: IVec3) -> u32 {
    (local.x | local.y << 2 | local.z << 4) as u32
}

/// The corners of a cell, x before y before z: from its first node on, and what each weighs at a place in the cell.
pub fn weights(f: DVec3) -> impl Iterator<Item = (IVec3, f64)> {
    let steps = (0..8).map(|c| IVec3::new(c & 1, c >> 1 & 1, c >> 2));
    steps.map(move |step| (step, DVec3::select(step.cmpeq(IVec3::ONE), f, 1.0 - f).element_product()))
}

/// The field less its level, in 1/256 of twice the level: in the middle of what a node's byte stands for.
pub fn held(byte: u8) -> f64 {
    f64::from(byte) + 0.5 - f64::from(FIELD_HALF)
}

/// Its gradient there, in no unit.
pub fn slope(bytes: [i8; 3]) -> DVec3 {
    I8Vec3::from(bytes).as_dvec3()
}

/// Two words as one, the lower bits first.
fn bits(words: &[u32]) -> u64 {
    u64::from(words[0]) | u64::from(words[1]) << 32
}

/// The field at a node times [`FIELD_ONE`], from bricks; 0 where there is none.
pub fn node_of(bricks: &BTreeMap<Place, Brick>, node: Place) -> u32 {
    let edge = FIELD_BRICK as i32;
    let [x, y, z] = node.map(|c| c.rem_euclid(edge) as usize);
    let edge_nodes = edge as usize;
    bricks.get(&node.map(|c| c.div_euclid(edge))).map_or(0, |b| b.nodes[x + edge_nodes * (y + edge_nodes * z)])
}

/// A level or density in the whole numbers of a node.
pub fn whole(density: f64) -> u32 {
    (density * f64::from(FIELD_ONE)).round() as u32
}
