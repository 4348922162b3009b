//! What the host gives for one frame.

use crate::{
    camera::MeniscusCamera,
    settings::MeniscusSettings,
    status::Failure,
    versioned::{Versioned, borrow, read, read_some},
};
use renderer::{
    Background, Before, Camera, DeviceVectors, EnvironmentInput, EnvironmentShape, EyeInside, FrameInput, Motion,
    MovingParticles, SceneInput, Settings, SurfaceOutput, SurfaceOutputs,
    ash::vk::{
        Bool32 as VkBool32, Buffer as VkBuffer, DeviceSize as VkDeviceSize, Format as VkFormat,
        ImageLayout as VkImageLayout, ImageView as VkImageView,
    },
    glam::Mat4,
    prepare::{DeviceCount, DeviceIds, DevicePositions, Options},
};
use std::mem::offset_of;

/// MeniscusFrame::background: the environment, and before it the scene. Every pixel of the output is written, with alpha 1.
pub const MENISCUS_BACKGROUND_ENVIRONMENT: u32 = 0;
/// MeniscusFrame::background: the host's own picture, which the output holds. Only pixels that show liquid are written, with
/// alpha 1. Rays that meet nothing take the scene's colour where its depth is cleared in the direction they go.
pub const MENISCUS_BACKGROUND_HOST: u32 = 1;

/// MeniscusEnvironment::shape: a 2D view, equirectangular: the first row is straight up, columns run once around.
pub const MENISCUS_ENVIRONMENT_EQUIRECT: u32 = 0;
/// MeniscusEnvironment::shape: a cube view.
pub const MENISCUS_ENVIRONMENT_CUBE: u32 = 1;

/// MeniscusFrame::eye_inside: the eye is outside the body.
pub const MENISCUS_EYE_OUTSIDE: u32 = 0;
/// MeniscusFrame::eye_inside: it is inside, where meniscus_density_at gives half at least, say. VK_TRUE is the same.
pub const MENISCUS_EYE_INSIDE: u32 = 1;
/// MeniscusFrame::eye_inside: the device finds out, by the same measure, of MeniscusFrame::positions as they are when the frame runs.
/// With particles that the host prepared a method that has to know is an error.
pub const MENISCUS_EYE_ON_DEVICE: u32 = 2;

/// Positions in device memory, prepared within the frame that draws them: neighbours, classes, shapes, with no word about them to
/// the host. How says the frame's settings (support, splash_threshold and so on).
///
/// The buffers have usage STORAGE_BUFFER, and their writes are visible to reads in compute shaders before the frame, which only
/// reads them.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusPositions {
    /// sizeof(MeniscusPositions).
    pub struct_size: usize,
    /// Three 32-bit floats a particle, in world units. A position that is not finite is left out.
    pub buffer: VkBuffer,
    /// Where the first one begins, in bytes; a multiple of 4.
    pub offset: VkDeviceSize,
    /// Bytes from one to the next; a multiple of 4, at least 12. 0 stands for 12.
    pub stride: VkDeviceSize,
    /// How many there are; with count_buffer how many there may be.
    pub count: u32,
    /// Particle radius in world units: half the rest spacing.
    pub radius: f32,
    /// Hysteresis against popping: a particle keeps the class that the last frame gave it while its density lies between the
    /// setting splash_threshold and this share of a filled body's; a tenth above the threshold is plenty. 0 stands for none.
    pub keep_class_below: f32,
    /// How many ids there may be: all are below this. 0 stands for no ids: then particles go by their place in the buffer.
    pub id_number: u32,
    /// One id of 32 bits a particle, for keep_class_below: needed where the simulation re-sorts its particles, or their number
    /// changes. It may be the buffer of the positions.
    pub id_buffer: VkBuffer,
    /// Where the first id begins, in bytes; a multiple of 4.
    pub id_offset: VkDeviceSize,
    /// Bytes from one id to the next; a multiple of 4. 0 stands for 4.
    pub id_stride: VkDeviceSize,
    /// How many particles there are, where only the device knows: 32 bits, read when the frame runs; or VK_NULL_HANDLE. What lies
    /// behind so many is not there, whatever it holds. It may be the buffer of the positions.
    pub count_buffer: VkBuffer,
    /// Where that number lies, in bytes; a multiple of 4.
    pub count_offset: VkDeviceSize,
}

// SAFETY: repr(C); its size first; no padding (a test adds it up); numbers and handles.
unsafe impl Versioned for MeniscusPositions {
    const NAME: &'static str = "MeniscusPositions";
    const LEAST: usize = offset_of!(MeniscusPositions, keep_class_below);
}

/// What the renderer takes; null is none.
fn device_count(buffer: VkBuffer, offset: VkDeviceSize) -> Option<DeviceCount> {
    (buffer != VkBuffer::null()).then(|| DeviceCount::new(buffer, offset))
}

impl MeniscusPositions {
    /// What the renderer takes.
    pub(crate) fn get(&self, options: &Options) -> DevicePositions {
        let or = |given, usual| if given == 0 { usual } else { given };
        let ids = DeviceIds::packed(self.id_buffer, self.id_number).laid_out(self.id_offset, or(self.id_stride, 4));
        DevicePositions::packed(self.buffer, self.count, self.radius)
            .laid_out(self.offset, or(self.stride, 12))
            .options(*options)
            .keep_class_below((self.keep_class_below != 0.0).then_some(self.keep_class_below))
            .ids((self.id_number > 0).then_some(ids))
            .device_count(device_count(self.count_buffer, self.count_offset))
    }
}

/// The host's opaque scene, rendered before the liquid at the same size and with the same camera, of one sample a pixel: what was
/// multisampled is resolved before, its depth by one of its samples. It hides liquid, is seen through
/// it, and ends rays under water. Both images are sampled in the fragment stage.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusScene {
    /// sizeof(MeniscusScene).
    pub struct_size: usize,
    /// Linear colour.
    pub color: VkImageView,
    /// Depth buffer (depth aspect) of the camera's projection.
    pub depth: VkImageView,
    /// Layout the colour is in, before and after.
    pub color_layout: VkImageLayout,
    /// Layout the depth is in, before and after.
    pub depth_layout: VkImageLayout,
    /// Depth value where nothing was drawn: 1, or 0 with reversed depths.
    pub cleared_depth: f32,
    /// 0.
    pub reserved: u32,
    /// Where the view begins in both, in pixels: they may be larger than it.
    pub origin: [u32; 2],
}

// SAFETY: repr(C); its size first; no padding (a test adds it up); numbers and handles.
unsafe impl Versioned for MeniscusScene {
    const NAME: &'static str = "MeniscusScene";
    const LEAST: usize = offset_of!(MeniscusScene, reserved);

    fn reserved(&self) -> u32 {
        self.reserved
    }
}

/// An environment of the host's own, in place of the one that the renderer was given: linear light, infinitely far away, sampled in
/// the fragment stage.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusEnvironment {
    /// sizeof(MeniscusEnvironment).
    pub struct_size: usize,
    /// Of any format that reads as floats; mip level 0 is used.
    pub view: VkImageView,
    /// Layout it is in, before and after.
    pub layout: VkImageLayout,
    /// MENISCUS_ENVIRONMENT_...
    pub shape: u32,
}

// SAFETY: repr(C); its size first; no padding (a test adds it up); numbers and handles.
unsafe impl Versioned for MeniscusEnvironment {
    const NAME: &'static str = "MeniscusEnvironment";
    const LEAST: usize = offset_of!(MeniscusEnvironment, shape);
}

/// Motion vectors of the first surface: where each pixel's surface was in the frame before, less where it is, in parts of the
/// picture's width and height, y down, both without jitter (FSR and DLSS: scale them by the size in pixels). It moves with the
/// camera, and as the particle nearest to it does.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusMotion {
    /// sizeof(MeniscusMotion).
    pub struct_size: usize,
    /// Where they go: R16G16_SFLOAT, R32G32_SFLOAT, or with two more components, which become 0.
    pub output: VkImageView,
    /// Format of the output's view.
    pub output_format: VkFormat,
    /// Layout the output is in, before and after: one in which it can be attached.
    pub output_layout: VkImageLayout,
    /// World to eye of the frame before, column by column.
    pub previous_view: [f32; 16],
    /// The frame before's projection, without its jitter.
    pub previous_projection: [f32; 16],
    /// This frame's projection, without its jitter.
    pub projection: [f32; 16],
    /// Particles that move: three 32-bit floats each, in world units. Read in vertex shaders, as `before`.
    pub positions: VkBuffer,
    /// Where the first one begins, in bytes; a multiple of 4.
    pub position_offset: VkDeviceSize,
    /// Bytes from one to the next; a multiple of 4, at least 12. 0 stands for 12.
    pub position_stride: VkDeviceSize,
    /// Their velocities, in world units a second; or where they were in the frame before, if `seconds` is 0.
    pub before: VkBuffer,
    /// Where the first one begins, in bytes; a multiple of 4.
    pub before_offset: VkDeviceSize,
    /// Bytes from one to the next; a multiple of 4, at least 12. 0 stands for 12.
    pub before_stride: VkDeviceSize,
    /// How many particles, with count_buffer how many there may be; 0: the liquid stands still, and only the camera moves.
    pub count: u32,
    /// Seconds since the frame before, that velocities count for; 0 where `before` holds positions.
    pub seconds: f32,
    /// How many particles there are, where only the device knows: 32 bits; or VK_NULL_HANDLE. Read in vertex shaders.
    pub count_buffer: VkBuffer,
    /// Where that number lies, in bytes; a multiple of 4.
    pub count_offset: VkDeviceSize,
}

// SAFETY: repr(C); its size first; no padding (a test adds it up); numbers and handles.
unsafe impl Versioned for MeniscusMotion {
    const NAME: &'static str = "MeniscusMotion";
    const LEAST: usize = offset_of!(MeniscusMotion, positions);
}

impl MeniscusMotion {
    /// What the renderer takes.
    fn get(&self) -> Motion {
        let vectors = |buffer, offset, stride| {
            DeviceVectors::packed(buffer).laid_out(offset, if stride == 0 { 12 } else { stride })
        };
        let before = vectors(self.before, self.before_offset, self.before_stride);
        let before = match self.seconds == 0.0 {
            true => Before::Positions(before),
            false => Before::Velocities(before, self.seconds),
        };
        let positions = vectors(self.positions, self.position_offset, self.position_stride);
        let matrix = |m: &[f32; 16]| Mat4::from_cols_array(m);
        let output = SurfaceOutput::new(self.output, self.output_format, self.output_layout);
        let previous = (matrix(&self.previous_view), matrix(&self.previous_projection));
        Motion::new(output, previous, matrix(&self.projection)).particles((self.count > 0).then(|| {
            let count = device_count(self.count_buffer, self.count_offset);
            MovingParticles::new(self.count, positions, before).device_count(count)
        }))
    }
}

/// What a frame says of the first surface that each pixel shows, the one that the picture has, into images of the host's: loaded,
/// written where liquid shows, stored. Where none shows they keep what they hold. They are of one sample and of the output's size. An
/// eye in the liquid sees it from the near plane on, which is then the surface, facing the eye.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusSurface {
    /// sizeof(MeniscusSurface).
    pub struct_size: usize,
    /// Its depth as the camera's projection has it, clamped to 0..1; or null. Of a format with depth, as a depth attachment that is
    /// written without a test: the host's own depth buffer, say, if the scene that this frame samples is another image. Or of
    /// R32_SFLOAT.
    pub depth: VkImageView,
    /// Its unit normal in world space, towards the eye's side; or null. As it is in RGBA formats that hold signs
    /// (R32G32B32A32_SFLOAT, R16G16B16A16_SFLOAT, R16G16B16A16_SNORM, R8G8B8A8_SNORM), as (n + 1) / 2 in others
    /// (A2B10G10R10_UNORM_PACK32, R16G16B16A16_UNORM, R8G8B8A8_UNORM); alpha is 1.
    pub normal: VkImageView,
    /// Format of the depth's view.
    pub depth_format: VkFormat,
    /// Layout the depth is in, before and after: one in which it can be attached.
    pub depth_layout: VkImageLayout,
    /// Format of the normal's view.
    pub normal_format: VkFormat,
    /// Layout the normal is in, before and after: one in which it can be attached.
    pub normal_layout: VkImageLayout,
    /// How it has moved since the frame before; or null.
    pub motion: *const MeniscusMotion,
    /// A mask that says how little of the pixel's history a temporal upscaler may keep (FSR: reactive, DLSS: bias of the current
    /// colour); or null. R8_UNORM, R16_SFLOAT or R32_SFLOAT.
    pub reactive: VkImageView,
    /// Format of the mask's view.
    pub reactive_format: VkFormat,
    /// Layout the mask is in, before and after: one in which it can be attached.
    pub reactive_layout: VkImageLayout,
    /// What the mask says where liquid shows, 0 to 1; FSR advises 0.9 at most.
    pub reactive_value: f32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C); its size first; no padding (a test adds it up); numbers, handles and a pointer that may be null.
unsafe impl Versioned for MeniscusSurface {
    const NAME: &'static str = "MeniscusSurface";
    const LEAST: usize = offset_of!(MeniscusSurface, motion);

    fn reserved(&self) -> u32 {
        self.reserved
    }
}

impl MeniscusSurface {
    /// What the renderer takes.
    ///
    /// # Safety
    /// As [`read_some`], for the motion.
    unsafe fn get(&self) -> Result<SurfaceOutputs, Failure> {
        // SAFETY: this function's contract.
        let motion = unsafe { read_some(self.motion) }?.map(|m: MeniscusMotion| m.get());
        let output =
            |view, format, layout| (view != VkImageView::null()).then(|| SurfaceOutput::new(view, format, layout));
        Ok(SurfaceOutputs::default()
            .depth(output(self.depth, self.depth_format, self.depth_layout))
            .normal(output(self.normal, self.normal_format, self.normal_layout))
            .motion(motion)
            .reactive(output(self.reactive, self.reactive_format, self.reactive_layout), self.reactive_value))
    }
}

/// One frame. Pointers are read before the call returns.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusFrame {
    /// sizeof(MeniscusFrame).
    pub struct_size: usize,
    /// Camera.
    pub camera: *const MeniscusCamera,
    /// Method, liquid, drawing; and how positions on the device are prepared.
    pub settings: *const MeniscusSettings,
    /// Of one sample, of the format that the renderer was given, and at least of its size.
    pub output: VkImageView,
    /// Which of the frames in flight this is: below MeniscusHost::frames_in_flight.
    pub slot: u32,
    /// MENISCUS_BACKGROUND_...
    pub background: u32,
    /// Positions on the device, drawn instead of the particles last given; or null.
    pub positions: *const MeniscusPositions,
    /// The host's opaque scene; or null.
    pub scene: *const MeniscusScene,
    /// The host's own environment; or null for the one that the renderer was given.
    pub environment: *const MeniscusEnvironment,
    /// VK_TRUE if the particles are those of the frame recorded before and have not moved since: then what follows from them alone is
    /// kept.
    pub still: VkBool32,
    /// MENISCUS_EYE_...: whether the eye is inside the body; every ray then starts in it. A density field knows by itself.
    pub eye_inside: u32,
    /// What later passes are told of the first surface; or null.
    pub surface: *const MeniscusSurface,
    /// Where the view begins in the output and in the images of `surface`, in pixels: they may be larger than it. What is beside it
    /// stays as it is.
    pub origin: [u32; 2],
    /// Layout the output is in, before and after: COLOR_ATTACHMENT_OPTIMAL, ATTACHMENT_OPTIMAL or GENERAL. 0 stands for the first.
    pub output_layout: VkImageLayout,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C); its size first; no padding (a test adds it up); numbers, handles and pointers that may be null.
unsafe impl Versioned for MeniscusFrame {
    const NAME: &'static str = "MeniscusFrame";
    const LEAST: usize = offset_of!(MeniscusFrame, background);

    fn reserved(&self) -> u32 {
        self.reserved
    }
}

/// A frame as it was read.
pub(crate) struct Read {
    slot: usize,
    camera: Camera,
    settings: Settings,
    positions: Option<DevicePositions>,
    scene: Option<SceneInput>,
    environment: Option<EnvironmentInput>,
    background: Background,
    output: VkImageView,
    output_layout: VkImageLayout,
    origin: [u32; 2],
    still: bool,
    eye_inside: EyeInside,
    surface: SurfaceOutputs,
}

impl Read {
    /// # Safety
    /// As [`read`], for the frame and what it points to; the settings are ours.
    pub unsafe fn new(frame: *const MeniscusFrame) -> Result<Read, Failure> {
        // SAFETY: this function's contract.
        let (f, camera, settings, positions, scene, environment, surface) = unsafe {
            let f = read(frame)?;
            let settings = borrow(f.settings, "MeniscusFrame::settings")?;
            let camera = MeniscusCamera::get(f.camera)?;
            let (scene, environment) = (read_some(f.scene)?, read_some(f.environment)?);
            let surface: Option<MeniscusSurface> = read_some(f.surface)?;
            let surface = surface.map(|s| s.get()).transpose()?.unwrap_or_default();
            (f, camera, settings, read_some(f.positions)?, scene, environment, surface)
        };
        let background = match f.background {
            MENISCUS_BACKGROUND_ENVIRONMENT => Background::Environment,
            MENISCUS_BACKGROUND_HOST => Background::Host,
            other => return Err(unknown("MeniscusFrame::background", other, "MENISCUS_BACKGROUND_")),
        };
        let eye_inside = match f.eye_inside {
            MENISCUS_EYE_OUTSIDE => EyeInside::Outside,
            MENISCUS_EYE_INSIDE => EyeInside::Inside,
            MENISCUS_EYE_ON_DEVICE => EyeInside::OnDevice,
            other => return Err(unknown("MeniscusFrame::eye_inside", other, "MENISCUS_EYE_")),
        };
        let environment = match environment {
            None => None,
            Some(e) => {
                let shape = match e.shape {
                    MENISCUS_ENVIRONMENT_EQUIRECT => EnvironmentShape::Equirect,
                    MENISCUS_ENVIRONMENT_CUBE => EnvironmentShape::Cube,
                    other => return Err(unknown("MeniscusEnvironment::shape", other, "MENISCUS_ENVIRONMENT_")),
                };
                Some(EnvironmentInput::new(e.view, e.layout, shape))
            }
        };
        Ok(Read {
            slot: f.slot as usize,
            camera,
            settings: settings.settings,
            positions: positions.map(|p: MeniscusPositions| p.get(&settings.options)),
            scene: scene.map(|s: MeniscusScene| {
                SceneInput::new((s.color, s.color_layout), (s.depth, s.depth_layout), s.cleared_depth).origin(s.origin)
            }),
            environment,
            background,
            output: f.output,
            output_layout: match f.output_layout {
                VkImageLayout::UNDEFINED => VkImageLayout::COLOR_ATTACHMENT_OPTIMAL,
                layout => layout,
            },
            origin: f.origin,
            still: f.still != 0,
            eye_inside,
            surface,
        })
    }

    /// What the renderer takes.
    pub fn input(&self) -> FrameInput<'_> {
        FrameInput::new(self.slot, &self.camera, &self.settings, self.output)
            .positions(self.positions)
            .scene(self.scene)
            .environment(self.environment)
            .background(self.background)
            .still(self.still)
            .eye_inside(self.eye_inside)
            .surface(self.surface)
            .origin(self.origin)
            .output_layout(self.output_layout)
    }
}

fn unknown(what: &str, value: u32, names: &str) -> Failure {
    Failure::parameter(format!("{what} is {value}: use one of {names}..."))
}
