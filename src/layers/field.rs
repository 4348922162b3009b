//! A density field around the particles, whose level is the liquid's surface (`glsl/layers/field.comp`, then
//! `field_cells.comp`; Iwasaki06, volume-normalised: docs/methods.md, "Density field"). It does not hang on the view.

#[cfg(feature = "inspect")]
pub mod twin;

use super::{Filling, Kind, Layering};
use crate::{
    method::Offers,
    parameters::parameters,
    passes::{Points, per_particle},
    plan::{Call, Groups, Plan, Target},
    prepare::lattice,
    scene::Scene,
    shader::{
        FIELD_BALL, FIELD_CELL_RECORD, FIELD_CELLS_COMP, FIELD_FAR, FIELD_LACK_COMP, FIELD_LIST_COMP, FIELD_MARK_COMP,
        FIELD_MOST_BRICKS, FIELD_NODE_WORDS, FIELD_NODES, FIELD_NUMBER_COMP, FIELD_ONE, FIELD_RAISE_COMP, FIELD_RECORD,
        FIELD_SCATTER_COMP, FIELD_SLOT, FieldBuild, FieldHead, FieldStrays, SPLASH_RADIUS, Shader,
    },
    space::power_of_two,
};
use ash::vk;

parameters! {
    /// The level of a density field on a sparse grid (Iwasaki06), each particle's share divided by its number density; splashes
    /// of less than 0.35 of a filled body's are balls beside it, and so is what the surface does not enclose, though it adds to
    /// the field there: at the ends of sheets and threads, at the corners of a block. What is counted is read with the feature `inspect` (`Renderer::counters`).
    pub struct Field {
        /// Distance of the grid's nodes; ours, by measurement: half as much changes little and has eight times the nodes
        spacing: f32 = 2.0, "particle radii", "1.5 to 3" => |s| (1.5..=3.0).contains(s);
        /// How far a particle reaches; ours, by measurement
        kernel_radius: f32 = 4.0, "particle radii", "2.5 to 5" => |k| (2.5..=5.0).contains(k);
        /// Density of the surface, as a part of a filled body's; ours: it lies one radius above the outermost particles
        level: f32 = 0.57, "", "0.05 to 0.95" => |l| (0.05..=0.95).contains(l);
        /// What there is room for in proportion to the particles, whose own volume is (2 r)³ each: bricks of 64 nodes. Bricks
        /// beyond it are left out, and counted
        room: f32 = 5.0, "volumes of the particles", "1 to 1000" => |r| (1.0..=1000.0).contains(r);
    }
}

/// The field's kernel, 1 at the centre; `q`: distance / support.
pub(crate) fn kernel(q: f64) -> f64 {
    (1.0 - q * q).max(0.0).powi(2)
}

/// Its sum over the particles of a filled body, the one at its centre included; `support` in particle radii.
pub(crate) fn rest(support: f64) -> f64 {
    lattice(support).map(|point| kernel(point.length() / support)).sum()
}

/// Bricks that there is room for in any case, as far as so many particles can reach: 27 each.
const LEAST_BRICKS: u64 = 4096;

/// Cells that hold the surface in proportion to bricks: in real liquids 4 to 11, the more the fewer particles there are.
const CELLS_PER_BRICK: u64 = 5;

/// Such cells that there is room for in any case, as far as bricks have so many.
const LEAST_CELLS: u64 = 65_536;

/// Points of which 31 bits can name eight blocks each.
pub(crate) const MOST_POINTS: u32 = FIELD_FAR / 8;

/// Balls in bricks that there is room for in any case, as far as so many particles can reach: 8 bricks each.
const LEAST_BALLS: u64 = 65_536;

/// What its passes count.
const COUNTED: [&str; 5] =
    ["field_bricks", "field_cells", "field_bricks_left_out", "field_cells_left_out", "field_balls_left_out"];

/// A field as its readers find it.
#[derive(Clone, Copy)]
pub(crate) struct Volume {
    pub head: Target,
    pub table: Target,
    pub records: Target,
    pub cells: Target,
    pub balls: Target,
    pub build: FieldBuild,
    /// Distance of the nodes in particle radii.
    pub spacing: f32,
}

impl Layering for Field {
    fn offers(&self) -> Offers {
        Offers { backs: true, beyond: true, ..Offers::default() }
    }

    fn kind(&self) -> Kind<'_> {
        Kind::Field(self)
    }
}

impl Field {
    /// What the passes are told of so many particles.
    fn build(&self, scene: &Scene) -> FieldBuild {
        let count = u64::from(scene.count);
        let edge = f64::from(4.0 * self.spacing);
        let bricks = (f64::from(self.room) * count as f64 * 8.0 / edge.powi(3)) as u64;
        let bricks = bricks.max(LEAST_BRICKS).min(27 * count).min(u64::from(FIELD_MOST_BRICKS - 1));
        let cells = (CELLS_PER_BRICK * bricks).max(LEAST_CELLS).min(u64::from(FIELD_NODES) * bricks);
        let radius = scene.space.radius as f32;
        let unit = power_of_two(radius);
        let origin = scene.space.origin.as_vec3() * unit;
        FieldBuild {
            count: scene.count,
            capacity: bricks as u32 + 1,
            // Balls, which are the least that there is, reach into 1.3 blocks each, and 2.2 bricks.
            slots: (3 * bricks / 4).next_power_of_two().max(64) as u32,
            cell_capacity: cells as u32,
            // The walk reads two at once.
            ball_capacity: (count / 2).max(LEAST_BALLS).min(8 * count).next_multiple_of(2) as u32,
            spacing: self.spacing * (radius * unit),
            reach: self.kernel_radius / self.spacing,
            unit: (f64::from(FIELD_ONE) / rest(f64::from(self.kernel_radius))) as f32,
            ball: SPLASH_RADIUS / self.spacing,
            level: (self.level * FIELD_ONE as f32).round() as u32,
            origin_x: origin.x,
            origin_y: origin.y,
            origin_z: origin.z,
        }
    }

    /// Nodes that a kernel can reach on an axis.
    pub(super) fn across(build: &FieldBuild) -> u32 {
        (2.0 * build.reach).ceil() as u32
    }

    /// Builds it; what `add` does between its passes brings the particles' shares to the nodes.
    pub(super) fn build_by(
        &self,
        plan: &mut Plan,
        scene: &Scene,
        points: &Points,
        add: impl FnOnce(&mut Plan, &Building),
    ) -> Volume {
        let build = self.build(scene);
        let words = |n: u32| 4 * u64::from(n);
        let head = plan.buffer("field head", size_of::<FieldHead>() as u64);
        let table = plan.array("field directory", words(FIELD_SLOT) * (u64::from(build.slots) + 1));
        let records = plan.array("field bricks", words(FIELD_RECORD) * u64::from(build.capacity));
        let nodes = plan.array("field nodes", words(FIELD_NODE_WORDS) * u64::from(build.capacity));
        // Strays are listed where there will be cells: two words each.
        let room = words(FIELD_CELL_RECORD) * u64::from(build.cell_capacity);
        let cells = plan.array("field cells", room.max(words(2) * u64::from(build.count)));
        let balls = plan.array("field balls", words(FIELD_BALL) * u64::from(build.ball_capacity));
        let strays = plan.buffer("field strays", size_of::<FieldStrays>() as u64);
        for zeros in [head, table, records, nodes, strays] {
            plan.fill("field", zeros, 0, vk::WHOLE_SIZE, 0);
        }
        let building = Building { head, table, records, nodes, points: points.points, build };
        // Where the host prepared the points, the shaders do not look; something has to be bound all the same.
        let from_origin = |call: Call| {
            let extent = points.extent.unwrap_or(points.points);
            call.read("extent", extent).constant("ORIGIN_ON_DEVICE", points.extent.is_some())
        };
        let mark = from_origin(building.call(&FIELD_MARK_COMP))
            .read("points", points.points)
            .update("strays", strays)
            .write("stray", cells);
        plan.dispatch("field", mark, per_particle(build.count));
        let number = from_origin(building.call(&FIELD_NUMBER_COMP))
            .update("head", head)
            .read("points", points.points)
            .update("records", records);
        plan.dispatch("field", number, per_particle(build.slots));
        add(plan, &building);
        let of_strays = Groups::Indirect(strays, 0);
        let lack = building.adding(&FIELD_LACK_COMP).read("strays", strays).update("stray", cells);
        plan.dispatch("field", lack, of_strays);
        let across = Field::across(&build);
        let raise = building.adding(&FIELD_RAISE_COMP).read("strays", strays).read("stray", cells);
        plan.dispatch("field", raise.constant("ACROSS", across), of_strays);
        let list = building
            .call(&FIELD_LIST_COMP)
            .update("head", head)
            .read("points", points.points)
            .update("records", records)
            .read("nodes", nodes)
            .read("strays", strays)
            .read("stray", cells)
            .write("balls", balls);
        plan.dispatch("field", list, of_strays);
        let surface = building
            .call(&FIELD_CELLS_COMP)
            .read("head", head)
            .update("records", records)
            .read("nodes", nodes)
            .write("cells", cells);
        plan.dispatch("field", surface, Groups::Indirect(head, 0));
        Volume { head, table, records, cells, balls, build, spacing: self.spacing }
    }
}

impl Filling for Field {
    fn field(&self) -> Field {
        *self
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, points: &Points) -> Volume {
        self.build_by(plan, scene, points, |plan, building| {
            let scatter = building.adding(&FIELD_SCATTER_COMP).constant("ACROSS", Field::across(&building.build));
            plan.dispatch("field", scatter, per_particle(building.build.count));
        })
    }
}

/// A field while it is built.
pub(super) struct Building {
    pub head: Target,
    pub table: Target,
    pub records: Target,
    pub nodes: Target,
    pub points: Target,
    pub build: FieldBuild,
}

impl Building {
    /// One of its passes.
    fn call(&self, shader: &'static Shader) -> Call {
        Call::compute(shader).update("table", self.table).push_all(&self.build).counting(&COUNTED)
    }

    /// One that looks at points and nodes, and counts nothing.
    fn adding(&self, shader: &'static Shader) -> Call {
        Call::compute(shader)
            .read("head", self.head)
            .read("table", self.table)
            .read("points", self.points)
            .update("nodes", self.nodes)
            .push_all(&self.build)
    }
}
