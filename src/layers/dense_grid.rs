//! The density field on a dense grid around the body, four slices at once in the channels of an image to which sprites of the
//! particles add (`glsl/layers/dense_grid.vert`, `.frag` and `.comp`; Iwasaki06: docs/methods.md, "A dense grid").

#[cfg(feature = "inspect")]
pub mod twin;

use super::{
    Filling, Kind, Layering,
    field::{Building, Field, Volume},
};
use crate::{
    Error,
    method::Offers,
    parameters::parameters,
    passes::{Points, per_particle},
    plan::{Blend, Call, Plan, Rendering, Vertices},
    resources::ImageSpec,
    scene::Scene,
    shader::{
        DENSE_GRID_CORNER_COMP, DENSE_GRID_EMPTY, DENSE_GRID_FRAG, DENSE_GRID_GATHER_COMP, DENSE_GRID_VERT, FIELD_BRICK,
    },
};
use ash::vk;

parameters! {
    /// The level of the same density field on a dense grid, to whose slices sprites of the particles add, four at once
    /// (Iwasaki06); splashes of less than 0.35 of a filled body's number density are balls beside it. What of the liquid lies beyond
    /// the grid is left out, and counted.
    pub struct DenseGrid {
        /// Distance of the grid's nodes, as of `field`
        spacing: f32 = 2.0, "particle radii", "1.5 to 3" => |s| (1.5..=3.0).contains(s);
        /// How far a particle reaches, as of `field`
        kernel_radius: f32 = 4.0, "particle radii", "2.5 to 5" => |k| (2.5..=5.0).contains(k);
        /// Density of the surface, as a part of a filled body's; as of `field`
        level: f32 = 0.57, "", "0.05 to 0.95" => |l| (0.05..=0.95).contains(l);
        /// What there is room for of the bricks in which rays find the surface, as of `field`
        room: f32 = 5.0, "volumes of the particles", "1 to 1000" => |r| (1.0..=1000.0).contains(r);
        /// Nodes of the grid along x (Iwasaki06's n_x), from the first that the body reaches on
        nodes_x: u32 = 192, "", "4 to 2048, a multiple of 4" => |n| (4..=2048).contains(n) && n % FIELD_BRICK == 0;
        /// Along y
        nodes_y: u32 = 192, "", "4 to 2048, a multiple of 4" => |n| (4..=2048).contains(n) && n % FIELD_BRICK == 0;
        /// Along z: its slices
        nodes_z: u32 = 128, "", "4 to 2048, a multiple of 4" => |n| (4..=2048).contains(n) && n % FIELD_BRICK == 0;
    }
}

/// What sprites add to. Half as wide a float rounds with every particle: docs/methods.md says by how much.
const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// What its passes count: nodes along each axis that the body reaches and the grid has not.
const COUNTED: [&str; 3] = ["dense_grid_x_left_out", "dense_grid_y_left_out", "dense_grid_z_left_out"];

impl Layering for DenseGrid {
    fn offers(&self) -> Offers {
        self.field().offers()
    }

    fn kind(&self) -> Kind<'_> {
        Kind::Field(self)
    }
}

impl Filling for DenseGrid {
    fn field(&self) -> Field {
        let field = Field::default().spacing(self.spacing).kernel_radius(self.kernel_radius);
        field.level(self.level).room(self.room)
    }

    fn record(&self, plan: &mut Plan, scene: &Scene, points: &Points) -> Volume {
        self.field().build_by(plan, scene, points, |plan, building| self.add(plan, scene, building))
    }
}

impl DenseGrid {
    /// Bricks of the grid along each axis.
    fn bricks(&self) -> [u32; 3] {
        [self.nodes_x, self.nodes_y, self.nodes_z].map(|n| n / FIELD_BRICK)
    }

    /// Tiles of four slices each: columns and rows of them in an image that is as square as it can be.
    fn tiles(&self) -> [u32; 2] {
        let [x, y, z] = self.bricks().map(f64::from);
        let columns = (z * y / x).sqrt().round().clamp(1.0, z);
        [columns as u32, (z / columns).ceil() as u32]
    }

    /// Adds the particles' shares up in the grid, and takes them to the bricks.
    fn add(&self, plan: &mut Plan, scene: &Scene, building: &Building) {
        let Building { build, points, .. } = *building;
        let ([x, y, z], [columns, rows]) = (self.bricks(), self.tiles());
        let size = [columns * self.nodes_x, rows * self.nodes_y];
        if size.iter().any(|edge| *edge > scene.image_size) {
            let remedy = format!(
                "its slices take an image of {}x{}, and this device has {} texels each way: use fewer nodes",
                size[0], size[1], scene.image_size
            );
            let nodes = [self.nodes_x, self.nodes_y, self.nodes_z].map(|n| n.to_string()).join(", ");
            return plan.fail(Error::parameter("nodes_x, nodes_y, nodes_z", nodes, remedy));
        }

        let bounds = plan.buffer("dense grid box", 6 * 4);
        plan.fill("dense grid", bounds, 0, vk::WHOLE_SIZE, DENSE_GRID_EMPTY);
        let corner =
            Call::compute(&DENSE_GRID_CORNER_COMP).update("box", bounds).read("points", points).push_all(&build);
        plan.dispatch("dense grid", corner, per_particle(build.count));

        let spec = ImageSpec { format: FORMAT, size, layers: 1, array: false, usage: Default::default() };
        let grid = plan.image("dense grid", spec);
        let sprites = (Field::across(&build) + 2) / FIELD_BRICK + 1;
        let quads = !scene.points || scene.settings.drawing.quads_only;
        let topology = if quads { vk::PrimitiveTopology::TRIANGLE_LIST } else { vk::PrimitiveTopology::POINT_LIST };
        let draw = Call::draw(&DENSE_GRID_VERT[usize::from(quads)], &DENSE_GRID_FRAG)
            .topology(topology)
            .read("box", bounds)
            .read("points", points)
            .push_all(&build);
        let draw = [
            ("BRICKS_X", x),
            ("BRICKS_Y", y),
            ("BRICKS_Z", z),
            ("COLUMNS", columns),
            ("ROWS", rows),
            ("SPRITES", sprites),
        ]
        .into_iter()
        .fold(draw, |draw, (name, value)| draw.constant(name, value));
        let Some(vertices) = (if quads { 6 * sprites } else { sprites }).checked_mul(build.count) else {
            let remedy = "more sprites of a dense grid than one draw has: use the layers field";
            return plan.fail(Error::parameter("particles", build.count, remedy));
        };
        let rendering = Rendering::into(grid, 0).blending(Blend::Add, [0.0; 4]);
        plan.render("dense grid", rendering, vec![(draw, Vertices::Direct(vertices))]);

        let gather = Call::compute(&DENSE_GRID_GATHER_COMP)
            .update("box", bounds)
            .read("head", building.head)
            .read("table", building.table)
            .read("records", building.records)
            .write("nodes", building.nodes)
            .read("grid", grid)
            .counting(&COUNTED)
            .push_all(&build);
        let gather = [("BRICKS_X", x), ("BRICKS_Y", y), ("BRICKS_Z", z), ("COLUMNS", columns)]
            .into_iter()
            .fold(gather, |gather, (name, value)| gather.constant(name, value));
        plan.dispatch("dense grid", gather, per_particle(8 * build.capacity));
    }
}
