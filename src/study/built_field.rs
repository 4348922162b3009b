//! A density field as the device has built it, and where rays meet it and the balls beside it: exactly, cell by cell.

use crate::{
    Particles,
    host::{HostError, Session},
    layers::field::{
        Field,
        twin::{Brick, Corner, Lattice, Place, Words, held, local_bit, slope, weights},
    },
    shader::{FIELD_BRICK, SPLASH_RADIUS},
    space::{Space, power_of_two},
    twin::field_walk,
};
use glam::{DVec3, IVec3, Vec3};
use std::collections::{BTreeMap, HashMap};

/// What a frame built of a field.
pub struct BuiltField {
    bricks: BTreeMap<Place, Brick>,
    /// The same, found faster.
    by_place: HashMap<Place, Brick>,
    field: Field,
    lattice: Lattice,
    /// World units to spacings.
    scale: f64,
    /// Of what there is, in spacings.
    bounds: [DVec3; 2],
}

/// Parts of a ray's way through a cell at whose ends the field is looked at: along it the field is a cubic.
const PARTS: u32 = 16;

/// The most bricks that a ray can be in.
const FAR: f64 = 1e6;

impl BuiltField {
    /// Of the last frame; nothing if it built none.
    pub fn read(session: &mut Session, field: &Field, radius: f32) -> Result<Option<BuiltField>, HostError> {
        let Some(all) = session.all_words(Words::BUFFERS)? else { return Ok(None) };
        Ok(BuiltField::new(Words::new(all.each_ref().map(Vec::as_slice)).bricks(), field, radius))
    }

    /// Of what [`Words::bricks`] gives of particles with this radius in world units.
    pub fn new(bricks: BTreeMap<Place, Brick>, field: &Field, radius: f32) -> Option<BuiltField> {
        let lattice = Lattice::new(field, radius);
        let edge = FIELD_BRICK as i32;
        let low = bricks.keys().fold(IVec3::MAX, |low, p| low.min(IVec3::from(*p)));
        let high = bricks.keys().fold(IVec3::MIN, |high, p| high.max(IVec3::from(*p) + 1));
        (!bricks.is_empty()).then(|| BuiltField {
            by_place: bricks.clone().into_iter().collect(),
            field: *field,
            scale: f64::from(power_of_two(radius)) / lattice.spacing,
            bounds: [low, high].map(|p| (edge * p).as_dvec3()),
            bricks,
            lattice,
        })
    }

    /// As the walk's twin reads it. `space` is the liquid's own.
    pub fn twin(&self, space: &Space) -> field_walk::Field<'_> {
        let origin = space.origin * self.scale;
        let block = f64::from(FIELD_BRICK * FIELD_BRICK);
        // Places count from the first node of the block there.
        let base = block * (origin / block).floor();
        let [spacing, level] = [self.field.spacing, self.field.level].map(f64::from);
        field_walk::Field::new(&self.bricks, base.as_ivec3().to_array(), origin - base, spacing, level)
    }

    /// Of a particle, in world units.
    pub fn radius(&self) -> f64 {
        self.lattice.ball / self.lattice.spacing / f64::from(SPLASH_RADIUS) / self.scale
    }

    /// Whether a point of the world lies in the liquid.
    pub fn holds(&self, point: DVec3) -> bool {
        let x = point * self.scale;
        let (cell, edge) = (x.floor().as_ivec3(), FIELD_BRICK as i32);
        let place = cell.div_euclid(IVec3::splat(edge));
        let Some(brick) = self.by_place.get(&place.to_array()) else { return false };
        let first = edge * place;
        let bit = local_bit(cell - first);
        let in_field = match corners_of(brick, bit) {
            Some(corners) => above(corners, x - cell.as_dvec3()) >= 0.0,
            None => brick.inside >> bit & 1 == 1,
        };
        let center = |ball: &[f32; 3]| first.as_dvec3() + Vec3::from(*ball).as_dvec3();
        in_field || brick.balls.iter().any(|ball| center(ball).distance(x) < self.lattice.ball / self.lattice.spacing)
    }

    /// Where a ray that starts outside comes in first, and the outward normal there. Positions and distances are the world's.
    pub fn first(&self, origin: DVec3, dir: DVec3) -> Option<(f64, DVec3)> {
        let x = origin * self.scale;
        let [a, b] = self.bounds.map(|side| (side - x) / dir);
        // No number where the ray runs in a face of the box: then that says nothing.
        let most = |v: DVec3| v.to_array().into_iter().filter(|t| !t.is_nan()).fold(0.0, f64::max);
        let least = |v: DVec3| v.to_array().into_iter().filter(|t| !t.is_nan()).fold(FAR, f64::min);
        let (start, end) = (most(a.min(b)), least(a.max(b)));
        let mut ball: Option<(f64, DVec3)> = None;
        let mut wall = None;
        let edge = f64::from(FIELD_BRICK);
        steps(x, dir, start, end, edge, |place, from, to| {
            let Some(brick) = self.by_place.get(&place) else { return ball.is_some_and(|b| b.0 <= to) };
            for center in &brick.balls {
                let center = edge * IVec3::from(place).as_dvec3() + Vec3::from(*center).as_dvec3();
                let t = self.enters_ball(center, x, dir).filter(|t| ball.is_none_or(|b| *t < b.0));
                ball = t.map(|t| (t, (x + t * dir - center).normalize())).or(ball);
            }
            if brick.cells != 0 {
                let first = FIELD_BRICK as i32 * IVec3::from(place);
                steps(x, dir, from, to, 1.0, |cell, from, to| {
                    let local = (IVec3::from(cell) - first).clamp(IVec3::ZERO, IVec3::splat(FIELD_BRICK as i32 - 1));
                    let Some(corners) = corners_of(brick, local_bit(local)) else { return false };
                    let low = (first + local).as_dvec3();
                    wall = rises(corners, x - low, dir, from, to).map(|t| (t, normal(corners, x - low + t * dir)));
                    wall.is_some()
                });
            }
            wall.is_some() || ball.is_some_and(|b| b.0 <= to)
        });
        let nearer = match (wall, ball) {
            (Some(wall), Some(ball)) if ball.0 < wall.0 => Some(ball),
            (wall, ball) => wall.or(ball),
        };
        nearer.map(|(t, normal)| (t / self.scale, normal))
    }

    fn enters_ball(&self, center: DVec3, x: DVec3, dir: DVec3) -> Option<f64> {
        let q = x - center;
        let middle = -q.dot(dir);
        let square = (self.lattice.ball / self.lattice.spacing).powi(2) - (q + middle * dir).length_squared();
        (square > 0.0).then(|| middle - square.sqrt()).filter(|t| *t > 0.0)
    }
}

/// The liquid's own space, of particles that the host or the device has prepared.
pub fn space(session: &mut Session, particles: &Particles) -> Result<Space, HostError> {
    let extent = session.words("extent", 0)?;
    Ok(extent.map_or_else(|| Space::of(particles), |words| Space::prepared(particles.radius, &words)))
}

/// Visits boxes of a lattice along a ray, each with where the ray comes into it and leaves it, until `visit` says so or the end.
fn steps(x: DVec3, dir: DVec3, from: f64, end: f64, edge: f64, mut visit: impl FnMut(Place, f64, f64) -> bool) {
    let mut place = ((x + from * dir) / edge).floor();
    let mut t = from;
    while t < end {
        // Where the ray meets the next box's face on each axis; never, along a zero.
        let faces = edge * (place + DVec3::select(dir.cmpgt(DVec3::ZERO), DVec3::ONE, DVec3::ZERO));
        let next = DVec3::select(dir.cmpeq(DVec3::ZERO), DVec3::INFINITY, (faces - x) / dir);
        let axis = next.min_position();
        let leaves = next[axis].clamp(t, end);
        if visit(place.as_ivec3().to_array(), t, leaves) {
            return;
        }
        t = leaves;
        place[axis] += dir[axis].signum();
    }
}

/// What is trilinear between a cell's corners.
fn between(corners: &[Corner; 8], f: DVec3, value: impl Fn(&Corner) -> DVec3) -> DVec3 {
    corners.iter().zip(weights(f)).map(|(corner, (_, weight))| weight * value(corner)).sum()
}

/// What the corners of a cell hold, if the surface is in it.
fn corners_of(brick: &Brick, bit: u32) -> Option<&[Corner; 8]> {
    let before = (brick.cells & ((1 << bit) - 1)).count_ones();
    (brick.cells >> bit & 1 == 1).then(|| brick.corners.get(before as usize)).flatten()
}

/// The field less its level.
fn above(corners: &[Corner; 8], f: DVec3) -> f64 {
    between(corners, f, |corner| DVec3::splat(held(corner.0))).x
}

/// Where the field rises through its level along a ray's way through a cell; places are counted from its first node.
fn rises(corners: &[Corner; 8], x: DVec3, dir: DVec3, from: f64, to: f64) -> Option<f64> {
    let h = |t: f64| above(corners, x + t * dir);
    let at = |part: u32| from + (to - from) * f64::from(part) / f64::from(PARTS);
    let part = (0..PARTS).find(|part| h(at(part + 1)) >= 0.0)?;
    let (mut below, mut above) = (at(part), at(part + 1));
    // What has risen before the cell began rises there.
    if h(below) >= 0.0 {
        return Some(below);
    }
    for _ in 0..40 {
        let middle = 0.5 * (below + above);
        *(if h(middle) >= 0.0 { &mut above } else { &mut below }) = middle;
    }
    Some(above)
}

fn normal(corners: &[Corner; 8], f: DVec3) -> DVec3 {
    -between(corners, f, |corner| slope(corner.1)).normalize_or(DVec3::NEG_Y)
}
