//! Nearest front and farthest back of each class, ray-cast from point sprites or quads (`glsl/splat.vert`,
//! `glsl/splat.frag`; Imai16 §4.2, Sigg06).

use super::{Pipelines, classes, particles};
use crate::{
    Error,
    access::Access,
    device::Limits,
    pipeline::{Graphics, Pipeline},
    recorder::{Recorder, Use, bound, used},
    shader::{self, CLASS_SPLASH, SIDE_BACK, SIDE_FRONT, Splat},
    targets::{Id, Needs},
};
use ash::vk;

pub(crate) struct SplatPass {
    /// By "quads".
    pub pipelines: Pipelines<bool>,
    /// Whether the device has points larger than a pixel.
    points: bool,
}

fn uses(depth: Id, normal: Id) -> [Use; 8] {
    let [centers, diagonals, mixed] = particles(Access::VertexRead);
    [
        centers,
        diagonals,
        mixed,
        bound(4, Id::Drawn, Access::VertexRead),
        used(Id::Draws, Access::IndirectRead),
        used(depth, Access::ColorAttachment),
        used(normal, Access::ColorAttachment),
        used(Id::SplatDepth, Access::DepthAttachment),
    ]
}

impl SplatPass {
    pub fn new(limits: &Limits) -> SplatPass {
        SplatPass { pipelines: Pipelines::default(), points: limits.point_size > 1.0 }
    }

    pub fn record(&mut self, r: &mut Recorder, needs: &Needs) -> Result<(), Error> {
        for class in classes(needs) {
            for side in [SIDE_FRONT, SIDE_BACK].into_iter().take(needs.sides() as usize) {
                self.draw(r, class, side)?;
            }
        }
        Ok(())
    }

    fn draw(&mut self, r: &mut Recorder, class: u32, side: u32) -> Result<(), Error> {
        let (name, depth, normal) = match (class == CLASS_SPLASH, side == SIDE_FRONT) {
            (true, true) => ("splash front", Id::SplashDepth, Id::SplashNormal),
            (true, false) => ("splash back", Id::SplashDepth, Id::SplashNormal),
            (false, true) => ("body front", Id::BodyDepthRaw, Id::BodyNormalRaw),
            (false, false) => ("body back", Id::BodyDepthRaw, Id::BodyNormalRaw),
        };
        let uses = uses(depth, normal);
        let splat = Splat { cls: class, side };
        // The depth test works on near / d: nearest is largest. Nothing there: 0 for fronts, 1 for backs.
        let (compare, clear) =
            if side == SIDE_FRONT { (vk::CompareOp::GREATER, 0.0) } else { (vk::CompareOp::LESS, 1.0) };
        let (host, points) = (r.host, self.points);
        r.pass(name, &uses, |r| {
            r.render(&[(depth, side as usize), (normal, side as usize)], Some(clear), |r| {
                for quads in [false, true] {
                    if !quads && !points {
                        continue;
                    }
                    let pipeline = self.pipelines.get(quads, |quads| {
                        Pipeline::graphics(
                            host,
                            &Graphics {
                                vertex: if *quads { &shader::SPLAT_QUADS_VERT } else { &shader::SPLAT_POINTS_VERT },
                                fragment: &shader::SPLAT_FRAG,
                                constants: &[],
                                topology: if *quads {
                                    vk::PrimitiveTopology::TRIANGLE_STRIP
                                } else {
                                    vk::PrimitiveTopology::POINT_LIST
                                },
                                colors: &[vk::Format::R32_SFLOAT, vk::Format::R32_UINT],
                                depth: true,
                                push_bytes: size_of::<Splat>() as u32,
                            },
                        )
                    })?;
                    r.bind(pipeline, &uses)?;
                    r.push(pipeline, &splat);
                    // One of the two draws nothing: the compact pass chose.
                    let half = size_of::<shader::Draws>() as u64 / 2;
                    let offset = u64::from(2 * class + side) * 2 * half + if quads { half } else { 0 };
                    // SAFETY: inside rendering with a graphics pipeline bound; the arguments were written by
                    // `compact`, and made visible to this stage by this pass's declaration.
                    unsafe {
                        host.device.cmd_set_depth_compare_op(r.cmd, compare);
                        host.device.cmd_draw_indirect(r.cmd, r.buffer(Id::Draws), offset, 1, 0);
                    }
                }
                Ok(())
            })
        })
    }
}
