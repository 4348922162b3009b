//! What the host gives for one frame: particles and camera, its own picture, and where the result goes.

mod motion;
mod surface;

use crate::{
    Error,
    prepare::DevicePositions,
    settings::{Camera, Settings},
};
use ash::vk;
pub(crate) use motion::Moves;
pub use motion::{Before, DeviceVectors, Motion, MovingParticles};
#[cfg(feature = "host")]
pub(crate) use surface::has_depth_and_stencil;
use surface::{COLOR_LAYOUTS, check_attached};
pub(crate) use surface::{Says, has_depth, is_halved};
pub use surface::{SurfaceOutput, SurfaceOutputs};

/// What a frame shows where no liquid is, and what rays bring back that meet neither liquid nor scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Background {
    /// The environment, and before it the scene: every pixel of the output is written, with alpha 1. What the output held
    /// is lost, and where the scene's depth is cleared, so is its colour.
    #[default]
    Environment,
    /// The host's own picture: the output is loaded, and only pixels that show liquid are written, with alpha 1, so that
    /// alpha is the liquid's coverage where the host cleared it to 0. Rays that meet nothing take the scene's colour where
    /// its depth is cleared in the direction they go (the host's sky), and the environment where that is out of view.
    Host,
}

/// An environment of the host's own, in place of [`crate::Renderer::set_environment`]'s.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct EnvironmentInput {
    /// Linear light, infinitely far away, sampled in the fragment stage; mip level 0 is used. Of any format that reads as
    /// floats (float, UNORM or sRGB).
    pub view: vk::ImageView,
    /// Layout it is in, before and after.
    pub layout: vk::ImageLayout,
    /// How directions find their texel.
    pub shape: EnvironmentShape,
}

/// How an environment maps directions; those of the world, turned so that [`Camera::up`] becomes +y.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum EnvironmentShape {
    /// A `TYPE_2D` view, laid out as [`crate::Equirect`] is.
    #[default]
    Equirect,
    /// A `TYPE_CUBE` view, looked up by the direction itself, as Vulkan defines it.
    Cube,
}

/// Whether the eye is inside the body: every ray then starts in it. Walks through maps of depths have to be told, since what is behind
/// the eye is in none of them. A density field ([`crate::layers::field`]) knows by itself, and look-ups show fronts alone: for
/// these nothing comes of what is said here, and nothing is done for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum EyeInside {
    /// It is not.
    #[default]
    Outside,
    /// It is: [`crate::prepare::DensityField`] has at least half of a filled body's density there, say.
    Inside,
    /// The device finds that out by the same measure, of [`FrameInput::positions`] as they are when the frame runs. Particles that the
    /// host prepared are an error: there are no positions of theirs to look at.
    OnDevice,
}

impl From<bool> for EyeInside {
    fn from(inside: bool) -> EyeInside {
        if inside { EyeInside::Inside } else { EyeInside::Outside }
    }
}

/// The host's opaque scene, rendered before the liquid at the same size and with the same camera, of one sample a pixel: what was
/// multisampled is resolved before, its depth by one of its samples (a mean of depths is nobody's). It hides liquid, is seen
/// through it, and ends rays under water. Liquid whose wall lies up to three and a half radii (across that wall) before an
/// opaque surface touches it: simulated particles stop short of floors.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct SceneInput {
    /// Linear colour, sampled in the fragment stage.
    pub color: vk::ImageView,
    /// Layout the colour is in, before and after.
    pub color_layout: vk::ImageLayout,
    /// Depth buffer (depth aspect) of the camera's projection, sampled in the fragment stage.
    pub depth: vk::ImageView,
    /// Layout the depth is in, before and after.
    pub depth_layout: vk::ImageLayout,
    /// Where the view begins in both, in pixels: they may be larger than it.
    pub origin: [u32; 2],
    /// Depth value where nothing was drawn, 0 to 1: 1 with depths that grow away from the eye ([`Camera::look_at`]), 0 with
    /// reversed ones. Compared for equality: what is infinitely far away is seen there (see [`Background`]).
    pub cleared_depth: f32,
}

impl EnvironmentInput {
    /// A map and the layout it is in.
    pub fn new(view: vk::ImageView, layout: vk::ImageLayout, shape: EnvironmentShape) -> EnvironmentInput {
        EnvironmentInput { view, layout, shape }
    }
}

impl SceneInput {
    /// Colour and depth, each with the layout it is in, and the depth where nothing was drawn.
    pub fn new(
        (color, color_layout): (vk::ImageView, vk::ImageLayout),
        (depth, depth_layout): (vk::ImageView, vk::ImageLayout),
        cleared_depth: f32,
    ) -> SceneInput {
        SceneInput { color, color_layout, depth, depth_layout, origin: [0, 0], cleared_depth }
    }

    /// The same in a part of larger images (an atlas, say), whose upper left corner is this pixel.
    #[must_use]
    pub fn origin(self, origin: [u32; 2]) -> Self {
        SceneInput { origin, ..self }
    }
}

/// One frame.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct FrameInput<'a> {
    /// Which of the frames in flight this is. That the frame last recorded into it has completed nobody checks: its descriptors are
    /// written anew.
    pub slot: usize,
    /// Camera.
    pub camera: &'a Camera,
    /// Method, liquid and drawing.
    pub settings: &'a Settings,
    /// Positions on the device, to be prepared in this frame and drawn instead of [`crate::Renderer::set_particles`]'s.
    pub positions: Option<DevicePositions>,
    /// Whether the particles are those of the frame recorded before, and have not moved since: then what follows from them
    /// alone is kept (their order, classes and ellipsoids, a density field), and only what hangs on the view is done. Where that
    /// cannot be, since other settings ask for something else of them or they were given anew, it is done all the same.
    pub still: bool,
    /// Host's opaque scene, if there is one.
    pub scene: Option<SceneInput>,
    /// What is seen where no liquid is.
    pub background: Background,
    /// Host's own environment. One of the two is always needed; without this one it is that of
    /// [`crate::Renderer::set_environment`].
    pub environment: Option<EnvironmentInput>,
    /// Whether the eye is inside the body.
    pub eye_inside: EyeInside,
    /// Output, of one sample, of the format given to [`crate::Renderer::new`] and at least of the size given to
    /// [`crate::Renderer::resize`].
    pub output: vk::ImageView,
    /// Layout the output is in, before and after: one in which it can be attached. Usually `COLOR_ATTACHMENT_OPTIMAL`.
    pub output_layout: vk::ImageLayout,
    /// Where the view begins in the output and in the images of [`FrameInput::surface`], in pixels: they may be larger than it. What
    /// is beside it stays as it is. Sizes of the host's images are not known here: that the view ends within them is the host's to see to.
    pub origin: [u32; 2],
    /// What later passes are told of the first surface: its depth, its normal, its motion, where it is.
    pub surface: SurfaceOutputs,
}

/// Layouts in which a shader may sample a colour.
const SAMPLED: &[vk::ImageLayout] =
    &[vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL, vk::ImageLayout::READ_ONLY_OPTIMAL, vk::ImageLayout::GENERAL];
/// And a depth, of whatever format.
const SAMPLED_DEPTH: &[vk::ImageLayout] = &[
    vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
    vk::ImageLayout::READ_ONLY_OPTIMAL,
    vk::ImageLayout::GENERAL,
    vk::ImageLayout::DEPTH_READ_ONLY_OPTIMAL,
    vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
    vk::ImageLayout::DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL,
];

fn check_sampled(
    what: &'static str,
    view: vk::ImageView,
    layout: vk::ImageLayout,
    legal: &[vk::ImageLayout],
) -> Result<(), Error> {
    if view == vk::ImageView::null() {
        return Err(Error::parameter(what, "null", "give an image view, or None for the whole"));
    }
    if !legal.contains(&layout) {
        let remedy = format!("bring it into a layout in which it can be sampled: {legal:?}");
        return Err(Error::parameter(what, format!("in {layout:?}"), remedy));
    }
    Ok(())
}

impl<'a> FrameInput<'a> {
    /// What can be told of the host's handles without using them.
    pub(crate) fn check_handles(&self) -> Result<(), Error> {
        if self.output == vk::ImageView::null() {
            return Err(Error::parameter("output", "null", "give the view that is to be drawn into"));
        }
        check_attached("layout of the output", self.output_layout, COLOR_LAYOUTS)?;
        if let Some(e) = &self.environment {
            check_sampled("environment", e.view, e.layout, SAMPLED)?;
        }
        if let Some(s) = &self.scene {
            check_sampled("scene colour", s.color, s.color_layout, SAMPLED)?;
            check_sampled("scene depth", s.depth, s.depth_layout, SAMPLED_DEPTH)?;
            if !(0.0..=1.0).contains(&s.cleared_depth) {
                return Err(Error::parameter(
                    "cleared depth",
                    s.cleared_depth,
                    "use 0 to 1, what the depth was cleared to",
                ));
            }
        }
        self.check_apart()?;
        if self.positions.is_some_and(|p| p.count > 0 && p.buffer == vk::Buffer::null()) {
            return Err(Error::parameter("buffer of positions", "null", "give the buffer that holds them"));
        }
        if let Some(count) = self.positions.filter(|p| p.count > 0).and_then(|p| p.device_count) {
            count.check(["buffer of the particle count", "offset of the particle count"])?;
        }
        if self.positions.is_some_and(|p| p.count > 0 && p.ids.is_some_and(|ids| ids.buffer == vk::Buffer::null())) {
            return Err(Error::parameter("buffer of ids", "null", "give the buffer that holds them, or no ids"));
        }
        Ok(())
    }

    /// Refuses a view that is written and read, or written as two things.
    fn check_apart(&self) -> Result<(), Error> {
        let surface = Says::ALL.into_iter().filter_map(|says| Some((says.name(), self.surface.of(says)?.view)));
        let written: Vec<_> = [("output", self.output)].into_iter().chain(surface).collect();
        let scene = self.scene.into_iter().flat_map(|s| [("scene colour", s.color), ("scene depth", s.depth)]);
        let read: Vec<_> = scene.chain(self.environment.map(|e| ("environment", e.view))).collect();
        for (i, &(what, view)) in written.iter().enumerate() {
            if let Some((other, _)) = written[..i].iter().chain(&read).find(|other| other.1 == view) {
                let is = format!("the view that is the {other}, too");
                return Err(Error::parameter(what, is, "give each an image of its own: a frame writes this one"));
            }
        }
        Ok(())
    }

    /// A frame of the particles last given, before the environment alone; the methods below change that.
    pub fn new(slot: usize, camera: &'a Camera, settings: &'a Settings, output: vk::ImageView) -> FrameInput<'a> {
        FrameInput {
            slot,
            camera,
            settings,
            positions: None,
            still: false,
            scene: None,
            background: Background::Environment,
            environment: None,
            eye_inside: EyeInside::Outside,
            output,
            output_layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            origin: [0, 0],
            surface: SurfaceOutputs::default(),
        }
    }

    /// The same of positions on the device, or of the particles last given.
    #[must_use]
    pub fn positions(self, positions: impl Into<Option<DevicePositions>>) -> Self {
        FrameInput { positions: positions.into(), ..self }
    }

    /// The same of particles that have not moved since the frame before, or of others.
    #[must_use]
    pub fn still(self, still: bool) -> Self {
        FrameInput { still, ..self }
    }

    /// The same before a scene of the host's, or without one.
    #[must_use]
    pub fn scene(self, scene: impl Into<Option<SceneInput>>) -> Self {
        FrameInput { scene: scene.into(), ..self }
    }

    /// The same before another background.
    #[must_use]
    pub fn background(self, background: Background) -> Self {
        FrameInput { background, ..self }
    }

    /// The same in an environment of the host's own, or in the renderer's.
    #[must_use]
    pub fn environment(self, environment: impl Into<Option<EnvironmentInput>>) -> Self {
        FrameInput { environment: environment.into(), ..self }
    }

    /// The same with the eye inside the body (`true` will do), outside, or wherever the device finds it.
    #[must_use]
    pub fn eye_inside(self, inside: impl Into<EyeInside>) -> Self {
        FrameInput { eye_inside: inside.into(), ..self }
    }

    /// The same into another output.
    #[must_use]
    pub fn output(self, output: vk::ImageView) -> Self {
        FrameInput { output, ..self }
    }

    /// The same with an output in another layout, before and after.
    #[must_use]
    pub fn output_layout(self, output_layout: vk::ImageLayout) -> Self {
        FrameInput { output_layout, ..self }
    }

    /// The same in a part of larger images (an atlas, say), whose upper left corner is this pixel.
    #[must_use]
    pub fn origin(self, origin: [u32; 2]) -> Self {
        FrameInput { origin, ..self }
    }

    /// The same with images that say something of the first surface.
    #[must_use]
    pub fn surface(self, surface: SurfaceOutputs) -> Self {
        FrameInput { surface, ..self }
    }
}
