//! What a frame draws, as its passes see it: all that decides which of them there are.

use crate::{
    Settings,
    device::Limits,
    input::{Background, EnvironmentShape, Moves, Says},
    method::Offers,
    prepare::Kept,
    scale::Scale,
    shader,
    space::Space,
};
use ash::vk;
use glam::{Mat4, Vec3};

/// What a frame draws: all that decides which passes it has.
pub(crate) struct Scene<'a> {
    pub settings: &'a Settings,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Particles that there may be.
    pub count: u32,
    /// Whether the device knows how many there are.
    pub counted: bool,
    /// Whether any of them may be splash.
    pub splash: bool,
    /// Whether any of them may belong to the body.
    pub body: bool,
    /// Preparation on the device, if the frame starts from positions there.
    pub prepare: Option<Preparation>,
    pub has_scene: bool,
    /// How the host's own environment maps directions; `None` for the renderer's.
    pub environment: Option<EnvironmentShape>,
    pub background: Background,
    pub output: vk::Format,
    /// Formats of the images that say something of the first surface.
    pub surface: [Option<(Says, vk::Format)>; Says::ALL.len()],
    /// How it has moved, in this view.
    pub motions: shader::Motions,
    /// And by itself, if it does.
    pub moves: Option<Moves>,
    /// What the mask of it says.
    pub reactive: f32,
    /// World to eye.
    pub eye: Mat4,
    /// Whether the device has to find out if that is inside the body.
    pub eye_on_device: bool,
    /// The liquid's own space; where the device prepares particles only its unit counts.
    pub space: Space,
    /// Whether what each walk met is written too.
    pub walks: bool,
    /// Whether the first surface is found, for whoever reads it.
    pub surface_read: bool,
    /// Of smoothing only so many steps, if it has more.
    pub smoothing_steps: Option<u32>,
    /// Whether the device has points larger than a pixel.
    pub points: bool,
    /// Whether an invocation that sums over neighbours takes four particles at once.
    pub four: bool,
    /// Largest edge of an image.
    pub image_size: u32,
    /// Largest storage buffer in bytes, and texel buffer.
    pub storage_size: u64,
    pub texels_size: u64,
}

/// What the preparation on the device is told.
#[derive(Clone, Copy)]
pub(crate) struct Preparation {
    pub constants: shader::Prepare,
    /// Entries of the sort: one a particle, or 27.
    pub entries: u64,
    /// Whether ellipsoids are YuTurk13's.
    pub yu_turk: bool,
    /// By what classes are kept from frame to frame, if they are.
    pub kept: Option<Kept>,
    /// Whether no classes of the last frame's count.
    pub anew: bool,
    /// Neighbours of each particle that are listed.
    pub neighbours: u32,
}

impl<'a> Scene<'a> {
    /// A frame of so many particles, before the environment alone.
    pub fn new(settings: &'a Settings, size: [u32; 2], [splash, body]: [usize; 2], limits: &Limits) -> Scene<'a> {
        Scene {
            settings,
            size,
            count: (splash + body) as u32,
            counted: false,
            splash: splash > 0,
            body: body > 0,
            prepare: None,
            has_scene: false,
            environment: None,
            background: Background::Environment,
            output: vk::Format::R32G32B32A32_SFLOAT,
            surface: Default::default(),
            motions: bytemuck::Zeroable::zeroed(),
            moves: None,
            reactive: 0.0,
            eye: Mat4::IDENTITY,
            eye_on_device: false,
            space: Space::new(1.0, Vec3::ZERO),
            walks: false,
            surface_read: false,
            smoothing_steps: None,
            points: limits.point_size > 1.0,
            four: settings.drawing.at_once.is_four(limits.cpu),
            image_size: limits.image_size,
            storage_size: limits.storage_size,
            texels_size: limits.texels_size,
        }
    }

    /// What smoothing and optics ask of the layers.
    pub fn asks(&self) -> Offers {
        self.settings.method.asks()
    }

    /// At what scale of the picture surfaces are drawn and smoothed.
    pub fn scale(&self) -> Scale {
        if self.asks().half { Scale::Half } else { Scale::Full }
    }

    /// Sides of each class that are drawn: front only, or front and back.
    pub fn sides(&self) -> u32 {
        if self.asks().backs { 2 } else { 1 }
    }

    /// What is said of the first surface, and in what format.
    pub fn surface_formats(&self) -> impl Iterator<Item = (Says, vk::Format)> {
        self.surface.into_iter().flatten()
    }

    /// Whether the last shader encodes sRGB.
    pub fn encode_srgb(&self) -> bool {
        takes_linear(self.output) == Some(false)
    }
}

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
