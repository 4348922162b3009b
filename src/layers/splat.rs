//! Nearest front and farthest back of a class, ray-cast from point sprites or quads (`glsl/splat.vert`,
//! `glsl/splat.frag`; Imai16 §4.2, Sigg06).

use super::Surface;
use crate::{
    frame::Scene,
    passes::Drawn,
    plan::{Call, Plan, Rendering, Vertices},
    shader::{self, CLASS_SPLASH, SIDE_BACK, SIDE_FRONT, Splat},
};
use ash::vk::{CompareOp, Format, PrimitiveTopology};
use glam::UVec4;

/// Draws one class on each side that is wanted.
pub(crate) fn draw(plan: &mut Plan, scene: &Scene, drawn: &Drawn, class: u32) -> Surface {
    let sides = scene.sides();
    let [depth, normal, passes @ ..] = if class == CLASS_SPLASH {
        ["splash depth", "splash normal", "splash front", "splash back"]
    } else {
        ["body depth (ray-cast)", "body normal (ray-cast)", "body front", "body back"]
    };
    let depth = plan.map(depth, Format::R32_SFLOAT, sides);
    let normal = plan.map(normal, Format::R32_UINT, sides);
    // The depth test of whichever class and side is being drawn.
    let test = plan.find("splat depth test").unwrap_or_else(|| plan.flat("splat depth test", Format::D32_SFLOAT));
    for side in [SIDE_FRONT, SIDE_BACK].into_iter().take(sides as usize) {
        // The depth test works on near / d: nearest is largest. Nothing there: 0 for fronts, 1 for backs.
        let (compare, clear) = if side == SIDE_FRONT { (CompareOp::GREATER, 0.0) } else { (CompareOp::LESS, 1.0) };
        let rendering = Rendering::into(depth, side).and(normal, side).testing(test, clear, compare);
        let draw = |quads: bool| {
            let topology = if quads { PrimitiveTopology::TRIANGLE_STRIP } else { PrimitiveTopology::POINT_LIST };
            let call = Call::draw(&shader::SPLAT_VERT[usize::from(quads)], &shader::SPLAT_FRAG)
                .topology(topology)
                .read("centers", drawn.particles.centers)
                .read("diagonals", drawn.particles.diagonals)
                .read("mixed", drawn.particles.mixed)
                .read("drawn", drawn.lists)
                .push_all(&Splat { what: UVec4::new(class, side, 0, 0) });
            // One of the two draws nothing: the compact pass chose.
            let half = size_of::<shader::Draws>() as u64 / 2;
            let offset = u64::from(2 * class + side) * 2 * half + if quads { half } else { 0 };
            (call, Vertices::Indirect(drawn.draws, offset))
        };
        let draws = [false, true].into_iter().filter(|quads| *quads || scene.points);
        plan.render(passes[side as usize], rendering, draws.map(draw).collect());
    }
    Surface { depth, normal, sides }
}
