//! Particles of a class and side, drawn as point sprites or quads (`glsl/layers/splat.vert`); nearest front and farthest back of
//! a class, ray-cast (`glsl/layers/splat.frag`; Imai16 §4.2, Sigg06).

use super::Surface;
use crate::{
    passes::Drawn,
    plan::{Call, Plan, Rendering, Target, Vertices},
    scene::Scene,
    shader::{self, CLASS_BODY, CLASS_SPLASH, SIDE_BACK, SIDE_FRONT, Shader, Splat},
};
use ash::vk::{CompareOp, Format, PrimitiveTopology};

/// Draws of one class as it shows on one side: as points, and as quads where those are too small. One of the two draws
/// nothing: the compact pass chose. `speeds`, of all particles, for a shader that asks for them.
pub(super) fn particles(
    scene: &Scene,
    drawn: &Drawn,
    fragment: &'static Shader,
    class: u32,
    side: u32,
    speeds: Option<Target>,
) -> Vec<(Call, Vertices)> {
    let draw = |quads: bool| {
        let topology = if quads { PrimitiveTopology::TRIANGLE_STRIP } else { PrimitiveTopology::POINT_LIST };
        let vertex = usize::from(quads) + 2 * usize::from(speeds.is_some());
        let call = Call::draw(&shader::SPLAT_VERT[vertex], fragment)
            .topology(topology)
            .read("centers", drawn.particles.centers)
            .read("diagonals", drawn.particles.diagonals)
            .read("mixed", drawn.particles.mixed)
            .read("drawn", drawn.lists)
            .push_all(&Splat { cls: class, side });
        let call = speeds.into_iter().fold(call, |call, speeds| call.read("speeds", speeds));
        let half = size_of::<shader::Draws>() as u64 / 2;
        let offset = u64::from(2 * class + side) * 2 * half + if quads { half } else { 0 };
        (call, Vertices::Indirect(drawn.draws, offset))
    };
    [false, true].into_iter().filter(|quads| *quads || scene.points).map(draw).collect()
}

/// The classes that may have particles.
pub(super) fn classes(scene: &Scene) -> impl Iterator<Item = u32> {
    let all = [(CLASS_SPLASH, scene.splash), (CLASS_BODY, scene.body)];
    all.into_iter().filter(|(_, there)| *there).map(|(class, _)| class)
}

/// Names of a surface's maps, and of the passes that draw its front and its back.
pub(super) struct Names {
    pub depth: &'static str,
    pub normal: &'static str,
    pub passes: [&'static str; 2],
}

/// What depths are tested against, in one draw after the other.
pub(super) fn depth_test(plan: &mut Plan) -> Target {
    plan.find("splat depth test").unwrap_or_else(|| plan.flat("splat depth test", Format::D32_SFLOAT))
}

/// Draws some classes together, on each side that is wanted.
pub(super) fn surface(
    plan: &mut Plan,
    scene: &Scene,
    drawn: &Drawn,
    classes: &[u32],
    sides: u32,
    names: &Names,
) -> Surface {
    let depth = plan.map(names.depth, Format::R32_SFLOAT, sides);
    let normal = plan.map(names.normal, Format::R32_UINT, sides);
    // The depth test of whichever class and side is being drawn.
    let test = depth_test(plan);
    for side in [SIDE_FRONT, SIDE_BACK].into_iter().take(sides as usize) {
        // The depth test works on near / d: nearest is largest. Nothing there: 0 for fronts, 1 for backs.
        let (compare, clear) = if side == SIDE_FRONT { (CompareOp::GREATER, 0.0) } else { (CompareOp::LESS, 1.0) };
        let rendering = Rendering::into(depth, side).and(normal, side).testing(test, clear, compare);
        let draws =
            classes.iter().flat_map(|class| particles(scene, drawn, &shader::SPLAT_FRAG[0], *class, side, None));
        plan.render(names.passes[side as usize], rendering, draws.collect());
    }
    Surface { depth, normal, sides }
}

/// Draws the nearest splashes: where each pixel's ray enters one, and, in layer 1 of the depths, where it leaves the same.
pub(super) fn balls(plan: &mut Plan, scene: &Scene, drawn: &Drawn, names: &Names) -> Surface {
    let depth = plan.map(names.depth, Format::R32_SFLOAT, 2);
    let normal = plan.map(names.normal, Format::R32_UINT, 1);
    let test = depth_test(plan);
    let rendering = Rendering::into(depth, 0).and(normal, 0).and(depth, 1).testing(test, 0.0, CompareOp::GREATER);
    let draws = particles(scene, drawn, &shader::SPLAT_FRAG[1], CLASS_SPLASH, SIDE_FRONT, None);
    plan.render(names.passes[0], rendering, draws);
    Surface { depth, normal, sides: 2 }
}
