//! The walk of each view ray through the liquid, and its colour (`glsl/refract.frag`; Imai16 §4.4, §4.5).

use super::Pipelines;
use crate::{
    Error,
    access::Access,
    input::{Background, EnvironmentShape},
    pipeline::{Graphics, Pipeline},
    recorder::{Recorder, bound, used},
    settings::{Fresnel, Settings},
    shader::{self, REFRACT_VERT, Shader},
    targets::{Id, Needs},
};
use ash::vk;

pub(crate) struct Refract {
    /// By specialisation, and place in [`FRAGMENT`].
    pub pipelines: Pipelines<([u32; 7], [usize; 3])>,
    output: vk::Format,
}

/// By whether it writes what the walk met, whether there is a scene, and whether the environment is a cube.
static FRAGMENT: [[[&Shader; 2]; 2]; 2] = [
    [
        [&shader::REFRACT_FRAG, &shader::REFRACT_CUBE_FRAG],
        [&shader::REFRACT_SCENE_FRAG, &shader::REFRACT_SCENE_CUBE_FRAG],
    ],
    [
        [&shader::REFRACT_DEBUG_FRAG, &shader::REFRACT_DEBUG_CUBE_FRAG],
        [&shader::REFRACT_DEBUG_SCENE_FRAG, &shader::REFRACT_DEBUG_SCENE_CUBE_FRAG],
    ],
];

/// Whether a format takes light as it is (float, or sRGB, which the hardware encodes) or encoded by the shader (UNORM);
/// `None` for formats that cannot hold a picture.
pub(crate) fn takes_linear(format: vk::Format) -> Option<bool> {
    use vk::Format as F;
    match format {
        F::R32G32B32A32_SFLOAT | F::R16G16B16A16_SFLOAT | F::B10G11R11_UFLOAT_PACK32 => Some(true),
        F::R8G8B8A8_SRGB | F::B8G8R8A8_SRGB | F::A8B8G8R8_SRGB_PACK32 => Some(true),
        F::R8G8B8A8_UNORM | F::B8G8R8A8_UNORM | F::A8B8G8R8_UNORM_PACK32 => Some(false),
        F::A2B10G10R10_UNORM_PACK32 | F::A2R10G10B10_UNORM_PACK32 | F::R16G16B16A16_UNORM => Some(false),
        _ => None,
    }
}

impl Refract {
    pub fn new(output: vk::Format) -> Refract {
        Refract { pipelines: Pipelines::default(), output }
    }

    pub fn record(&mut self, r: &mut Recorder, needs: &Needs, settings: &Settings) -> Result<(), Error> {
        let has_scene = r.externals.scene.is_some();
        let cube = r.externals.environment_shape == EnvironmentShape::Cube;
        let (splash, body) = (needs.splash, needs.body);
        let ((body_depth, body_normal), (splash_depth, splash_normal)) =
            (needs.maps_or_other(true), needs.maps_or_other(false));
        // Without a second volume there are no tiles, and the shader does not look.
        let tiles = if needs.tiles() { Id::FrontTiles } else { body_depth };
        let mut uses = vec![
            bound(1, body_depth, Access::FragmentRead),
            bound(2, body_normal, Access::FragmentRead),
            bound(3, splash_depth, Access::FragmentRead),
            bound(4, splash_normal, Access::FragmentRead),
            bound(5, tiles, Access::FragmentRead),
            bound(6, Id::Environment, Access::FragmentRead),
            used(Id::Output, Access::ColorAttachment),
        ];
        if has_scene {
            uses.push(bound(8, Id::SceneColor, Access::FragmentRead));
            uses.push(bound(9, Id::SceneDepth, Access::FragmentRead));
        }
        let mut colors = vec![(Id::Output, 0)];
        let mut formats = vec![self.output];
        if needs.debug {
            for id in [Id::Walk, Id::Direction] {
                uses.push(used(id, Access::ColorAttachment));
                colors.push((id, 0));
                formats.push(vk::Format::R32G32B32A32_SFLOAT);
            }
        }
        let constants = [
            settings.refractions,
            settings.internal_reflections,
            u32::from(settings.fresnel == Fresnel::Exact),
            u32::from(splash),
            u32::from(body),
            u32::from(takes_linear(self.output) == Some(false)),
            u32::from(r.externals.background == Background::Host),
        ];
        let host = r.host;
        let variant = [needs.debug, has_scene, cube].map(usize::from);
        let pipeline = self.pipelines.get((constants, variant), |(constants, [debug, scene, cube])| {
            Pipeline::graphics(
                host,
                &Graphics {
                    vertex: &REFRACT_VERT,
                    fragment: FRAGMENT[*debug][*scene][*cube],
                    constants,
                    topology: vk::PrimitiveTopology::TRIANGLE_LIST,
                    colors: &formats,
                    depth: false,
                    push_bytes: 0,
                },
            )
        })?;
        r.pass("refract", &uses, |r| {
            r.render(&colors, None, |r| {
                r.bind(pipeline, &uses)?;
                // SAFETY: inside rendering, with the pipeline and its set bound.
                unsafe { host.device.cmd_draw(r.cmd, 3, 1, 0, 0) };
                Ok(())
            })
        })
    }
}
