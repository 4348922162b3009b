//! How the first surface has moved since the frame before, as temporal upscalers ask for it.

use super::surface::SurfaceOutput;
use crate::{
    Camera, Error,
    device::{BINDING_ALIGNMENT, bound},
    prepare::{DeviceCount, Words},
    shader::{Motions, Moving},
};
use ash::vk;
use glam::{DMat4, DVec3, Mat4, Vec4};

/// Motion vectors of the first surface: where each pixel's surface was in the frame before, less where it is, in parts of the
/// picture's width and height, y down (FSR and DLSS: scale them by the size in pixels). Both places are without jitter, by the
/// projections given here. Where it was not before that eye they are 0.
///
/// What moves is the point of the surface that the pixel shows: with the camera, and with [`Motion::particles`] as the particle
/// nearest to it does. What is seen through it moves otherwise: see [`super::SurfaceOutputs::reactive`].
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Motion {
    /// Where they go, `R16G16_SFLOAT`, `R32G32_SFLOAT` or with two more components, which become 0: the host's own, say, in which
    /// its opaque scene's already are.
    pub output: SurfaceOutput,
    /// World to eye of the frame before.
    pub previous_view: Mat4,
    /// The frame before's projection, without its jitter.
    pub previous_projection: Mat4,
    /// This frame's projection, without its jitter.
    pub projection: Mat4,
    /// How the liquid itself moves; without, it stands still, and only the camera moves.
    pub particles: Option<MovingParticles>,
}

impl Motion {
    /// By the camera alone.
    pub fn new(output: SurfaceOutput, (previous_view, previous_projection): (Mat4, Mat4), projection: Mat4) -> Motion {
        Motion { output, previous_view, previous_projection, projection, particles: None }
    }

    /// The same with particles that move, or none.
    #[must_use]
    pub fn particles(self, particles: impl Into<Option<MovingParticles>>) -> Self {
        Motion { particles: particles.into(), ..self }
    }
}

/// Vectors in a buffer of the host's: three 32-bit floats each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DeviceVectors {
    /// The buffer, with usage `STORAGE_BUFFER`.
    pub buffer: vk::Buffer,
    /// Where the first one begins, in bytes; a multiple of 4.
    pub offset: u64,
    /// Bytes from one to the next; a multiple of 4, at least 12.
    pub stride: u64,
}

impl DeviceVectors {
    /// Vectors that fill a buffer without gaps.
    pub fn packed(buffer: vk::Buffer) -> DeviceVectors {
        DeviceVectors { buffer, offset: 0, stride: 12 }
    }

    /// The same, beginning at a byte of the buffer and lying so many bytes apart.
    #[must_use]
    pub fn laid_out(self, offset: u64, stride: u64) -> Self {
        DeviceVectors { offset, stride, ..self }
    }

    fn bound(&self, count: u32) -> (vk::Buffer, u64, u64) {
        bound(self.buffer, self.offset, self.stride, 12, count)
    }

    /// So many words after what is bound begins.
    fn first_word(&self) -> u32 {
        (self.offset % BINDING_ALIGNMENT / 4) as u32
    }

    fn check(&self, what: &'static str, [offset_of, stride_of]: [&'static str; 2], count: u32) -> Result<(), Error> {
        if self.buffer == vk::Buffer::null() {
            return Err(Error::parameter(what, "null", "give the buffer that holds them"));
        }
        Words { offset_of, stride_of, offset: self.offset, stride: self.stride, bytes: 12 }.check(count)
    }
}

/// What is known of each particle's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Before {
    /// Where it was in the frame before, in world units, in the order of the positions now.
    Positions(DeviceVectors),
    /// How fast it is, in world units a second, and the seconds since the frame before.
    Velocities(DeviceVectors, f32),
}

/// Particles and how they move, in buffers that are read in vertex shaders. They need not be those that are drawn: others at the same
/// places, or some of them, will do. One that is not finite is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MovingParticles {
    /// How many there are, or may be.
    pub count: u32,
    /// How many of them there are, where only the device knows.
    pub device_count: Option<DeviceCount>,
    /// Where they are, in world units.
    pub positions: DeviceVectors,
    /// And how they came there.
    pub before: Before,
}

impl MovingParticles {
    /// So many particles.
    pub fn new(count: u32, positions: DeviceVectors, before: Before) -> MovingParticles {
        MovingParticles { count, device_count: None, positions, before }
    }

    /// The same, but only so many of them as the device says.
    #[must_use]
    pub fn device_count(self, count: impl Into<Option<DeviceCount>>) -> Self {
        MovingParticles { device_count: count.into(), ..self }
    }

    /// Where they were, or their velocities; and the seconds that these count for.
    pub(crate) fn vectors(&self) -> (DeviceVectors, Option<f32>) {
        match self.before {
            Before::Positions(vectors) => (vectors, None),
            Before::Velocities(vectors, seconds) => (vectors, Some(seconds)),
        }
    }

    fn check(&self, largest: u64) -> Result<(), Error> {
        if self.count == 0 {
            return Ok(());
        }
        let (before, seconds) = self.vectors();
        let positions = ["offset of moving positions", "stride of moving positions"];
        self.positions.check("buffer of moving positions", positions, self.count)?;
        before.check("buffer of motions", ["offset of motions", "stride of motions"], self.count)?;
        if let Some(count) = self.device_count {
            count.check(["buffer of the moving count", "offset of the moving count"])?;
        }
        if let Some(seconds) = seconds.filter(|s| !s.is_finite()) {
            return Err(Error::parameter("seconds of velocities", seconds, "use a finite time"));
        }
        let bytes = self.positions.stride.max(before.stride) * u64::from(self.count) + BINDING_ALIGNMENT;
        if bytes > largest || u64::from(self.count) > u64::from(u32::MAX) / 6 {
            let remedy = format!("they take {bytes} bytes; this device binds {largest} at most");
            return Err(Error::parameter("moving particles", self.count, remedy));
        }
        Ok(())
    }
}

/// Particles that move, as the pass is told of them.
#[derive(Clone, Copy)]
pub(crate) struct Moves {
    /// That there may be.
    pub count: u32,
    /// Whether the device knows how many there are.
    pub counted: bool,
    /// Whether their velocities are known, or where they were.
    pub velocities: bool,
    pub block: Moving,
}

impl Motion {
    fn moving(&self) -> Option<MovingParticles> {
        self.particles.filter(|p| p.count > 0)
    }

    /// The buffers, and what of them is bound.
    pub(crate) fn bound(&self) -> [(vk::Buffer, u64, u64); 3] {
        let bound = |p: MovingParticles| {
            let count = p.device_count.map_or_else(Default::default, |c| c.bound());
            [p.positions.bound(p.count), p.vectors().0.bound(p.count), count]
        };
        self.moving().map(bound).unwrap_or_default()
    }

    /// How the camera has moved since, where the liquid's unit is so long.
    pub(crate) fn uniforms(&self, radius: f64, camera: &Camera) -> Motions {
        let then =
            self.previous_projection.as_dmat4() * self.previous_view.as_dmat4() * camera.view.as_dmat4().inverse();
        let then = then * DMat4::from_scale(DVec3::splat(radius));
        let p = &self.projection;
        Motions {
            then_x: then.row(0).as_vec4(),
            then_y: then.row(1).as_vec4(),
            then_w: then.row(3).as_vec4(),
            now: Vec4::new(p.x_axis.x, p.y_axis.y, -p.z_axis.x, -p.z_axis.y),
        }
    }

    /// And what has moved before it.
    pub(crate) fn moves(&self, radius: f64, camera: &Camera) -> Option<Moves> {
        self.moving().map(|p| {
            let eye = DMat4::from_scale(DVec3::splat(radius.recip())) * camera.view.as_dmat4();
            let (before, seconds) = p.vectors();
            let count_word = p.device_count.map_or(0, |c| c.word(BINDING_ALIGNMENT));
            let block = Moving {
                eye_x: eye.row(0).as_vec4(),
                eye_y: eye.row(1).as_vec4(),
                eye_z: eye.row(2).as_vec4(),
                first_words: p.positions.first_word() | before.first_word() << 8 | count_word << 16,
                word_stride: (p.positions.stride / 4) as u32,
                before_stride: (before.stride / 4) as u32,
                seconds: seconds.unwrap_or_default(),
            };
            Moves { count: p.count, counted: p.device_count.is_some(), velocities: seconds.is_some(), block }
        })
    }

    /// What can be told without using it; `largest` is the largest storage buffer.
    pub(crate) fn check(&self, largest: u64) -> Result<(), Error> {
        for (what, matrix) in [
            ("previous view", self.previous_view),
            ("previous projection", self.previous_projection),
            ("projection without jitter", self.projection),
        ] {
            if !matrix.is_finite() {
                return Err(Error::parameter(what, matrix, "use finite numbers"));
            }
        }
        self.particles.map_or(Ok(()), |p| p.check(largest))
    }
}
