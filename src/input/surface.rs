//! What later passes of the host's are told of the first surface that a pixel shows: images that it passes in.

use super::motion::Motion;
use crate::Error;
use ash::vk;

/// An image of the host's that a frame draws into beside its output: loaded, written where liquid shows, stored. Where none shows it
/// keeps what it holds, so that it may be the one that the host's opaque scene was drawn into, or one that it has cleared.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct SurfaceOutput {
    /// Its view, of one sample; as large as the output, and the view begins in it where it does in that. Of a format with stencil it
    /// is of both aspects or of depth alone.
    pub view: vk::ImageView,
    /// Format of the view.
    pub format: vk::Format,
    /// Layout it is in, before and after: one in which it can be attached.
    pub layout: vk::ImageLayout,
}

impl SurfaceOutput {
    /// An image, its format and the layout it is in.
    pub fn new(view: vk::ImageView, format: vk::Format, layout: vk::ImageLayout) -> SurfaceOutput {
        SurfaceOutput { view, format, layout }
    }
}

/// What a frame says of the first surface that each pixel shows; nothing costs what is not asked for. That is the surface which the
/// picture has: smoothed, hidden by the host's scene, at half resolution where more than half of the pixel is covered. An eye in the
/// liquid sees it from the near plane on, which is then the surface, facing the eye.
///
/// Images are the host's, since they are mostly there already: its depth buffer, its map of normals.
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub struct SurfaceOutputs {
    /// Its depth as the camera's projection has it, clamped to 0..1. Of a format with depth, as a depth attachment that is written
    /// without a test: the host's own depth buffer, say, if the scene that this frame samples is another image. Or of `R32_SFLOAT`.
    pub depth: Option<SurfaceOutput>,
    /// Its unit normal in world space, towards the eye's side. As it is in RGBA formats that hold signs (`R32G32B32A32_SFLOAT`,
    /// `R16G16B16A16_SFLOAT`, `R16G16B16A16_SNORM`, `R8G8B8A8_SNORM`), as (n + 1) / 2 in others (`A2B10G10R10_UNORM_PACK32`,
    /// `R16G16B16A16_UNORM`, `R8G8B8A8_UNORM`); alpha is 1.
    pub normal: Option<SurfaceOutput>,
    /// How it has moved since the frame before.
    pub motion: Option<Motion>,
    /// A mask that says how little of the pixel's history a temporal upscaler may keep (FSR: reactive, DLSS: bias of the current
    /// colour): [`SurfaceOutputs::reactive_value`], since what is seen through a surface does not move with it. `R8_UNORM`,
    /// `R16_SFLOAT` or `R32_SFLOAT`.
    pub reactive: Option<SurfaceOutput>,
    /// What the mask says where liquid shows, 0 to 1; FSR advises 0.9 at most.
    pub reactive_value: f32,
}

impl SurfaceOutputs {
    /// The same with its depth.
    #[must_use]
    pub fn depth(self, depth: impl Into<Option<SurfaceOutput>>) -> Self {
        SurfaceOutputs { depth: depth.into(), ..self }
    }

    /// The same with its normal.
    #[must_use]
    pub fn normal(self, normal: impl Into<Option<SurfaceOutput>>) -> Self {
        SurfaceOutputs { normal: normal.into(), ..self }
    }

    /// The same with its motion vectors.
    #[must_use]
    pub fn motion(self, motion: impl Into<Option<Motion>>) -> Self {
        SurfaceOutputs { motion: motion.into(), ..self }
    }

    /// The same with a mask that says this where it is.
    #[must_use]
    pub fn reactive(self, reactive: impl Into<Option<SurfaceOutput>>, value: f32) -> Self {
        SurfaceOutputs { reactive: reactive.into(), reactive_value: value, ..self }
    }

    /// The image that says this, if it is asked for.
    pub(crate) fn of(&self, says: Says) -> Option<SurfaceOutput> {
        match says {
            Says::Depth => self.depth,
            Says::Normal => self.normal,
            Says::Motion => self.motion.map(|m| m.output),
            Says::Reactive => self.reactive,
        }
    }

    /// Formats of what is asked for.
    pub(crate) fn formats(&self) -> [Option<(Says, vk::Format)>; Says::ALL.len()] {
        Says::ALL.map(|says| self.of(says).map(|output| (says, output.format)))
    }

    /// What can be told without using them; `largest` is the largest storage buffer.
    pub(crate) fn check(&self, largest: u64) -> Result<(), Error> {
        for says in Says::ALL {
            let Some(output) = self.of(says) else { continue };
            let [what, format, layout] = says.names();
            if output.view == vk::ImageView::null() {
                return Err(Error::parameter(what, "null", "give an image view, or None"));
            }
            if !says.takes(output.format) {
                return Err(Error::parameter(format, format!("{:?}", output.format), says.remedy()));
            }
            let legal = if has_depth(output.format) { DEPTH_LAYOUTS } else { COLOR_LAYOUTS };
            check_attached(layout, output.layout, legal)?;
        }
        if self.reactive.is_some() && !(0.0..=1.0).contains(&self.reactive_value) {
            return Err(Error::parameter("reactive value", self.reactive_value, "use 0 to 1"));
        }
        self.motion.map_or(Ok(()), |m| m.check(largest))
    }
}

/// What an image says of the first surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Says {
    Depth,
    Normal,
    Motion,
    Reactive,
}

impl Says {
    pub const ALL: [Says; 4] = [Says::Depth, Says::Normal, Says::Motion, Says::Reactive];

    /// What the image, its format and its layout are called in errors.
    fn names(self) -> [&'static str; 3] {
        match self {
            Says::Depth => ["surface depth", "format of the surface depth", "layout of the surface depth"],
            Says::Normal => ["surface normal", "format of the surface normal", "layout of the surface normal"],
            Says::Motion => ["motion vectors", "format of the motion vectors", "layout of the motion vectors"],
            Says::Reactive => ["reactive mask", "format of the reactive mask", "layout of the reactive mask"],
        }
    }

    /// What the image is called in errors.
    pub fn name(self) -> &'static str {
        self.names()[0]
    }

    /// Whether images that say this may be of a format.
    fn takes(self, format: vk::Format) -> bool {
        match self {
            Says::Depth => has_depth(format) || format == vk::Format::R32_SFLOAT,
            Says::Normal => SIGNED.contains(&format) || HALVED.contains(&format),
            Says::Motion => VECTORS.contains(&format),
            Says::Reactive => MASKS.contains(&format),
        }
    }

    fn remedy(self) -> String {
        match self {
            Says::Depth => "use R32_SFLOAT or a format with depth".into(),
            Says::Normal => {
                format!("use one of {SIGNED:?}, which hold n itself, or of {HALVED:?}, which hold (n + 1) / 2")
            }
            Says::Motion => format!("use one of {VECTORS:?}"),
            Says::Reactive => format!("use one of {MASKS:?}"),
        }
    }
}

/// Whether a format has depth.
pub(crate) fn has_depth(format: vk::Format) -> bool {
    use vk::Format as F;
    has_depth_and_stencil(format) || matches!(format, F::D16_UNORM | F::X8_D24_UNORM_PACK32 | F::D32_SFLOAT)
}

/// Whether a format has both.
pub(crate) fn has_depth_and_stencil(format: vk::Format) -> bool {
    use vk::Format as F;
    matches!(format, F::D16_UNORM_S8_UINT | F::D24_UNORM_S8_UINT | F::D32_SFLOAT_S8_UINT)
}

/// Whether a format holds vectors as (n + 1) / 2.
pub(crate) fn is_halved(format: vk::Format) -> bool {
    HALVED.contains(&format)
}

const SIGNED: &[vk::Format] = &[
    vk::Format::R32G32B32A32_SFLOAT,
    vk::Format::R16G16B16A16_SFLOAT,
    vk::Format::R16G16B16A16_SNORM,
    vk::Format::R8G8B8A8_SNORM,
];
const HALVED: &[vk::Format] =
    &[vk::Format::A2B10G10R10_UNORM_PACK32, vk::Format::R16G16B16A16_UNORM, vk::Format::R8G8B8A8_UNORM];
const VECTORS: &[vk::Format] = &[
    vk::Format::R16G16_SFLOAT,
    vk::Format::R32G32_SFLOAT,
    vk::Format::R16G16B16A16_SFLOAT,
    vk::Format::R32G32B32A32_SFLOAT,
];
const MASKS: &[vk::Format] = &[vk::Format::R8_UNORM, vk::Format::R16_SFLOAT, vk::Format::R32_SFLOAT];

/// Refuses a layout in which an image cannot be attached.
pub(super) fn check_attached(
    what: &'static str,
    layout: vk::ImageLayout,
    legal: &[vk::ImageLayout],
) -> Result<(), Error> {
    if legal.contains(&layout) {
        return Ok(());
    }
    let remedy = format!("bring it into one in which it can be attached: {legal:?}");
    Err(Error::parameter(what, format!("{layout:?}"), remedy))
}

/// Layouts in which an image can be a colour attachment.
pub(super) const COLOR_LAYOUTS: &[vk::ImageLayout] =
    &[vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL, vk::ImageLayout::ATTACHMENT_OPTIMAL, vk::ImageLayout::GENERAL];
/// Layouts in which its depth can be attached and written.
const DEPTH_LAYOUTS: &[vk::ImageLayout] = &[
    vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
    vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
    vk::ImageLayout::DEPTH_ATTACHMENT_STENCIL_READ_ONLY_OPTIMAL,
    vk::ImageLayout::ATTACHMENT_OPTIMAL,
    vk::ImageLayout::GENERAL,
];
