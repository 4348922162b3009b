//! The passes before the layers, preparation of particles on the device and which of them are drawn; and those after the picture, what
//! the host is told of the first surface. One file each, the same stem as its shader, twin and test.

pub(crate) mod compact;
pub(crate) mod cull;
pub(crate) mod extent;
pub(crate) mod eye;
pub(crate) mod first_surface;
pub(crate) mod motion;
pub(crate) mod occlude;
pub(crate) mod shape;
pub(crate) mod sort;
pub(crate) mod surface;

use crate::{
    optics::tiles::Tiles,
    plan::{Call, External, Groups, Plan, Target},
    shader::{BLOCK, MOST_GROUPS, PARTICLE_GROUP},
};

/// Particles as drawn: `glsl/include/particles.glsl`.
#[derive(Clone, Copy)]
pub(crate) struct Arrays {
    pub centers: Target,
    pub diagonals: Target,
    pub mixed: Target,
}

impl Arrays {
    /// Those that the host prepared.
    pub fn given(plan: &mut Plan) -> Arrays {
        Arrays {
            centers: plan.given(External::Centers),
            diagonals: plan.given(External::Diagonals),
            mixed: plan.given(External::Mixed),
        }
    }

    fn read_by(&self, call: Call) -> Call {
        call.read("centers", self.centers).read("diagonals", self.diagonals).read("mixed", self.mixed)
    }
}

/// Particles as a density field takes them: where they are, and how dense.
#[derive(Clone, Copy)]
pub(crate) struct Points {
    pub points: Target,
    /// What the extent pass has found, if the device prepares them.
    pub extent: Option<Target>,
}

impl Points {
    /// Those that the host prepared.
    pub fn given(plan: &mut Plan) -> Points {
        Points { points: plan.given(External::Points), extent: None }
    }
}

/// What the cull pass says of them.
#[derive(Clone, Copy)]
pub(crate) struct Culled {
    /// A word a particle: its class and the sides on which it shows.
    pub visible: Target,
    /// For each class how many particles are larger than a point can be.
    pub large: Target,
    /// Tiles of the view in which any shows, if the optics ask.
    pub tiles: Option<Tiles>,
}

/// What is left to draw of them.
#[derive(Clone, Copy)]
pub(crate) struct Drawn {
    pub particles: Arrays,
    /// Indices by class and side.
    pub lists: Target,
    /// Indirect draws of the lists.
    pub draws: Target,
}

/// A rectangle of at least so many groups, no longer than any device allows (`glsl/include/groups.glsl`).
fn rectangle(groups: u32) -> Groups {
    let rows = groups.div_ceil(MOST_GROUPS).max(1);
    Groups::Direct([groups.div_ceil(rows), rows, 1])
}

/// The rectangle of groups with an invocation for each particle.
pub(crate) fn per_particle(count: u32) -> Groups {
    rectangle(count.div_ceil(PARTICLE_GROUP))
}

/// The rectangle of groups with a block of particles each.
fn per_block(count: u32) -> Groups {
    rectangle(count.div_ceil(BLOCK))
}

/// Bytes of the blocks' counts in prefix sums of so many rows, with the rows' totals.
fn sums_bytes(items: u64, rows: u32) -> u64 {
    4 * u64::from(rows) * (items.div_ceil(u64::from(BLOCK)) + 1)
}
