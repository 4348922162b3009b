//! Neighbours within a fixed radius, in an unbounded scene (Im16 §III).

use std::cmp::Ordering;
use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::PrepareError;
use crate::shader::{CROWD, CROWD_RELATION};

/// Whole cell coordinates. They are compared in full, so two cells never alias.
pub type Cell = [i32; 3];

/// Cells further from the origin are refused: out there neighbouring `f32` positions already lie
/// several cells apart, and an `f64` quotient no longer decides `floor` safely.
const FURTHEST_CELL: f64 = (1u32 << 28) as f64;

crate::parameters::choices! {
    /// How candidates are found. Both give the same neighbours in the same order.
    pub enum Search {
        /// Sort the `n` particles by cell and look up the runs of the cells around. Faster on every
        /// scene measured, and frugal.
        #[default]
        Runs = "runs",
        /// Im16 §III: sort 27 `n` (cell, particle) entries, so that one run holds all candidates.
        Relation = "relation",
    }
}

/// A neighbour, or in a crowd one of several that it stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Neighbour {
    /// Its place in the grid's order.
    pub index: u32,
    /// How many particles it stands for, itself included.
    pub count: u32,
}

/// A run of candidates; of one longer than `most`, evenly chosen ones that stand for the others. Without that, particles
/// on one spot would each look at all the others there.
fn thinned(run: Range<u32>, most: u32) -> impl Iterator<Item = Neighbour> {
    let step = (run.end - run.start).div_ceil(most).max(1);
    let end = run.end;
    run.step_by(step as usize).map(move |index| Neighbour { index, count: step.min(end - index) })
}

/// `floor(point / size)` on each axis; `None` where that lies beyond 2^28 cells.
pub fn cell_of(point: Vec3, size: f64) -> Option<Cell> {
    let cell = (point.as_dvec3() / size).floor();
    (cell.abs().max_element() <= FURTHEST_CELL && cell.is_finite()).then(|| cell.to_array().map(|c| c as i32))
}

/// Squared distance in `f64`, where the difference of two nearby `f32` positions is exact.
pub fn distance_squared(a: Vec3, b: Vec3) -> f64 {
    a.as_dvec3().distance_squared(b.as_dvec3())
}

/// Particles in canonical order: by cell, then by the bits of their position.
///
/// The order depends on the set of particles and not on the order in which they came, and every
/// neighbour list ascends in it, so sums over neighbours are bit-equal for a shuffled input.
pub struct Grid {
    size: f64,
    /// Positions in canonical order.
    pub positions: Vec<Vec3>,
    /// Input index of each of them.
    pub order: Vec<u32>,
    /// The occupied cells, ascending.
    cells: Vec<Cell>,
    /// Where each cell's particles start; one entry more than there are cells.
    starts: Vec<u32>,
}

impl Grid {
    /// Sorts finite `positions` into cells of `size` world units; `tie` orders the input indices
    /// of particles at exactly the same position.
    pub fn new(positions: &[Vec3], size: f64, tie: impl Fn(u32, u32) -> Ordering + Sync) -> Result<Self, PrepareError> {
        let count = u32::try_from(positions.len()).map_err(|_| PrepareError::TooMany(positions.len()))?;
        let mut keyed = Vec::with_capacity(positions.len());
        for (index, &position) in (0..count).zip(positions) {
            let cell = cell_of(position, size).ok_or(PrepareError::TooFar { index: index as usize, position, size })?;
            keyed.push((cell, index));
        }
        keyed.par_sort_unstable_by(|&(cell_a, a), &(cell_b, b)| {
            let (p, q) = (positions[a as usize], positions[b as usize]);
            cell_a
                .cmp(&cell_b)
                .then_with(|| p.x.total_cmp(&q.x))
                .then_with(|| p.y.total_cmp(&q.y))
                .then_with(|| p.z.total_cmp(&q.z))
                .then_with(|| tie(a, b))
        });

        let (mut cells, mut starts) = (Vec::new(), Vec::new());
        for (start, &(cell, _)) in (0..count).zip(&keyed) {
            if cells.last() != Some(&cell) {
                cells.push(cell);
                starts.push(start);
            }
        }
        starts.push(count);
        let order: Vec<u32> = keyed.iter().map(|&(_, index)| index).collect();
        let positions = order.iter().map(|&i| positions[i as usize]).collect();
        Ok(Self { size, positions, order, cells, starts })
    }

    /// Runs of particles that together hold every cell within `reach` cells of `cell`, ascending.
    /// Cells that differ in z alone lie side by side, so there is one run for each (x, y).
    fn runs(&self, [x, y, z]: Cell, reach: i32) -> impl Iterator<Item = Range<u32>> {
        let around = move |c: i32| c - reach..=c + reach;
        let columns = around(x).flat_map(move |x| around(y).map(move |y| [x, y]));
        columns.map(move |[x, y]| {
            let first = self.cells.partition_point(|&c| c < [x, y, z - reach]);
            let inside = |c: &&Cell| **c <= [x, y, z + reach];
            let last = first + self.cells[first..].iter().take_while(inside).count();
            self.starts[first]..self.starts[last]
        })
    }

    /// Candidates for particles within `radius` of any point in `cell` (of this grid's size).
    fn candidates(&self, cell: Cell, radius: f64) -> impl Iterator<Item = Neighbour> {
        self.runs(cell, (radius / self.size).ceil() as i32).flat_map(|run| thinned(run, CROWD))
    }

    /// Squared distance of every particle nearer to `point` than `radius`, in canonical order, and how many it stands for.
    pub fn around(&self, point: Vec3, radius: f64) -> impl Iterator<Item = (f64, u32)> {
        let cell = cell_of(point, self.size);
        cell.into_iter()
            .flat_map(move |cell| self.candidates(cell, radius))
            .map(move |j| (distance_squared(point, self.positions[j.index as usize]), j.count))
            .filter(move |(squared, _)| *squared < radius * radius)
    }

    /// Calls `f(i, neighbours)` for every particle, in parallel, and returns the answers in order.
    /// Neighbours are strictly nearer than `radius`, ascend, and include `i` itself. They are all of them where no run of
    /// cells that differ in z alone holds more than 1024 particles (in the relation table, where no 27 cells hold more
    /// than 8192): forty times what liquid at rest has in three cells, twenty-five times what it has in five.
    pub fn map_neighbours<T: Send>(
        &self,
        radius: f64,
        search: Search,
        f: impl Fn(usize, &[Neighbour]) -> T + Sync,
    ) -> Vec<T> {
        match search {
            Search::Runs => {
                let gather = |cell, out: &mut Vec<Neighbour>| out.extend(self.candidates(cell, radius));
                self.map_candidates(radius, self.size, gather, f)
            }
            Search::Relation => {
                let table = Relation::new(&self.positions, radius);
                let gather = |cell, out: &mut Vec<Neighbour>| out.extend(table.candidates(cell));
                self.map_candidates(radius, radius, gather, f)
            }
        }
    }

    /// Filters what `gather` finds for a particle's cell of `size`; once for particles in a row
    /// that share a cell.
    fn map_candidates<T: Send>(
        &self,
        radius: f64,
        size: f64,
        gather: impl Fn(Cell, &mut Vec<Neighbour>) + Sync,
        f: impl Fn(usize, &[Neighbour]) -> T + Sync,
    ) -> Vec<T> {
        let state = || (None, Vec::new(), Vec::new());
        let each = |(last, candidates, near): &mut (_, Vec<Neighbour>, Vec<Neighbour>), (i, &at): (usize, _)| {
            let cell = cell_of(at, size);
            if cell != *last {
                *last = cell;
                candidates.clear();
                cell.into_iter().for_each(|cell| gather(cell, candidates));
            }
            let inside = |j: &&Neighbour| distance_squared(at, self.positions[j.index as usize]) < radius * radius;
            near.clear();
            near.extend(candidates.iter().filter(inside));
            f(i, near)
        };
        self.positions.par_iter().enumerate().map_init(state, each).collect()
    }
}

/// The particle-cell relation table (Im16 §III): every particle entered into the 27 cells around
/// its own, sorted lexicographically, 16 bytes an entry.
struct Relation(Vec<(Cell, u32)>);

impl Relation {
    fn new(positions: &[Vec3], radius: f64) -> Self {
        let enter = |(i, &position): (usize, &Vec3)| {
            let cell = cell_of(position, radius);
            cell.into_iter().flat_map(move |[x, y, z]| {
                (0..27).map(move |k| ([x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1], i as u32))
            })
        };
        let mut entries: Vec<_> = positions.par_iter().enumerate().flat_map_iter(enter).collect();
        entries.par_sort_unstable();
        Self(entries)
    }

    fn candidates(&self, cell: Cell) -> impl Iterator<Item = Neighbour> {
        let first = self.0.partition_point(|entry| entry.0 < cell);
        let last = first + self.0[first..].partition_point(|entry| entry.0 == cell);
        let run = thinned(first as u32..last as u32, CROWD_RELATION);
        run.map(|entry| Neighbour { index: self.0[entry.index as usize].1, ..entry })
    }
}
