//! What the host gives a renderer from its own memory: particles as drawn, environment maps.

use super::{Renderer, SceneBounds};
use crate::{
    Error, access,
    allocator::Location,
    device::Limits,
    environment::{Equirect, footprints},
    layers::{Kind, field::MOST_POINTS},
    particles::{Particles, Point},
    prepare::PrepareError,
    resources::{Buffer, Image, ImageSpec, Resource},
    scene::Scene,
    shader,
    space::{self, Space},
};
use ash::vk;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

impl Renderer {
    /// Gives the particles of the frames to come. The host's memory is copied; the last particles are kept until the
    /// frames that draw them have completed. Speeds and points given before go with the last particles.
    pub fn set_particles(&mut self, particles: &Particles) -> Result<(), Error> {
        let count = particles.ellipsoids.len();
        if !space::RADII.contains(&particles.radius) {
            return Err(PrepareError::Radius(particles.radius).into());
        }
        if particles.splash_count > count {
            return Err(Error::parameter(
                "splash count",
                particles.splash_count,
                format!("there are {count} particles"),
            ));
        }
        check_count(&self.limits, count)?;
        let mut made = Vec::with_capacity(3);
        for name in PARTICLE_ARRAYS {
            let bytes = ARRAY_BYTES * count.max(1) as u64;
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
            match Buffer::new(&self.host, name, bytes, usage, Location::Upload) {
                Ok(buffer) => made.push(buffer),
                Err(e) => {
                    made.iter_mut().for_each(|b| b.destroy(&self.host));
                    return Err(e);
                }
            }
        }
        let Ok(mut arrays) = <[Buffer; 3]>::try_from(made) else { unreachable!("one for each array") };
        let space = Space::of(particles);
        let mut bad = None;
        for (i, e) in particles.ellipsoids.iter().enumerate() {
            let p = space.pack(e);
            // A splash's first number is negative (glsl/include/particles.glsl).
            let sign = Vec3::new(if i < particles.splash_count { -1.0 } else { 1.0 }, 1.0, 1.0);
            let parts = [p.center.truncate(), p.shape_diagonal.truncate() * sign, p.shape_mixed.truncate()];
            if !parts.iter().all(|v| v.is_finite()) && bad.is_none() {
                bad = Some(i);
            }
            let at = i * ARRAY_BYTES as usize;
            for (array, part) in arrays.iter_mut().zip(&parts) {
                array.mapped()[at..at + ARRAY_BYTES as usize].copy_from_slice(bytemuck::bytes_of(part));
            }
        }
        if let Some(i) = bad {
            arrays.iter_mut().for_each(|b| b.destroy(&self.host));
            let remedy = "centres and semi-axes have to be finite, in particle radii and squared too";
            return Err(Error::parameter("particles", format!("number {i} is out of range"), remedy));
        }
        for old in self.particles.replace(arrays).into_iter().flatten() {
            self.retire(Resource::Buffer(old));
        }
        self.given += 1;
        let bounds = particles.bounds().unwrap_or_default();
        self.speeds.take().into_iter().for_each(|old| self.retire(Resource::Buffer(old)));
        self.points.take().into_iter().for_each(|old| self.retire(Resource::Buffer(old)));
        self.scene = SceneBounds { space, splash: particles.splash_count, body: particles.body_count(), bounds };
        Ok(())
    }

    /// Says how fast the particles of [`Renderer::set_particles`] are, in world units a second and in their order; for spray
    /// ([`crate::optics::instant_liquids`]). [`crate::prepare::prepare_with_velocities`] gives speeds in this order.
    pub fn set_speeds(&mut self, speeds: &[f32]) -> Result<(), Error> {
        let count = self.scene.splash + self.scene.body;
        if speeds.len() != count {
            return Err(Error::parameter("speeds", speeds.len(), format!("give one for each of {count} particles")));
        }
        if let Some(i) = speeds.iter().position(|s| !(s.is_finite() && *s >= 0.0)) {
            let what = format!("number {i} is {}", speeds[i]);
            return Err(Error::parameter("speeds", what, "use finite values of at least 0"));
        }
        let (bytes, usage) = (4 * count.max(1) as u64, vk::BufferUsageFlags::STORAGE_BUFFER);
        let mut buffer = Buffer::new(&self.host, SPEEDS, bytes, usage, Location::Upload)?;
        buffer.mapped()[..size_of_val(speeds)].copy_from_slice(bytemuck::cast_slice(speeds));
        if let Some(old) = self.speeds.replace(buffer) {
            self.retire(Resource::Buffer(old));
        }
        Ok(())
    }

    /// Says where the particles of [`Renderer::set_particles`] are and how dense, for a density field
    /// ([`crate::layers::field`]); [`crate::prepare::points`] makes them.
    pub fn set_points(&mut self, points: &[Point]) -> Result<(), Error> {
        let count = self.scene.splash + self.scene.body;
        if points.len() != count {
            return Err(Error::parameter("points", points.len(), format!("give one for each of {count} particles")));
        }
        let wrong = |p: &Point| !(p.position.is_finite() && p.density > 0.0 && p.density.is_finite());
        if let Some(i) = points.iter().position(wrong) {
            let remedy = "use finite positions, and finite densities above 0";
            return Err(Error::parameter("points", format!("number {i} is {:?}", points[i]), remedy));
        }
        check_points_count(&self.limits, count)?;
        let (bytes, usage) = (POINT_BYTES * count.max(1) as u64, vk::BufferUsageFlags::STORAGE_BUFFER);
        let mut buffer = Buffer::new(&self.host, POINTS, bytes, usage, Location::Upload)?;
        let unit = space::power_of_two(self.scene.space.radius as f32);
        for (p, to) in points.iter().zip(buffer.mapped().chunks_exact_mut(POINT_BYTES as usize)) {
            to.copy_from_slice(bytemuck::bytes_of(&(p.position * unit).extend(p.signed_density())));
        }
        self.given += 1;
        if let Some(old) = self.points.replace(buffer) {
            self.retire(Resource::Buffer(old));
        }
        Ok(())
    }

    /// Refuses a frame that needs points and has none, or too many.
    pub(super) fn check_points(&self, scene: &Scene) -> Result<(), Error> {
        check_most_points(scene)?;
        if !has_points(scene) || scene.count == 0 || scene.prepare.is_some() || self.points.is_some() {
            return Ok(());
        }
        let remedy =
            "give where the particles are: prepare::points and Renderer::set_points, or prepare them on the device";
        Err(Error::parameter("layers", scene.settings.method.layers.name(), remedy))
    }

    /// Refuses a frame that needs speeds and has none.
    pub(super) fn check_speeds(&self, scene: &Scene) -> Result<(), Error> {
        if !scene.asks().speeds || scene.count == 0 {
            return Ok(());
        }
        let remedy = match (&scene.prepare, &self.speeds) {
            (None, Some(_)) => return Ok(()),
            (None, None) => {
                "the particles came without velocities: use a file that has them (or Renderer::set_speeds), or 0"
            }
            (Some(_), _) => "particles that the device prepares have no velocities: prepare them on the CPU, or use 0",
        };
        Err(Error::parameter("spray", "above 0", remedy))
    }

    /// Gives the environment of the frames to come; records its upload.
    ///
    /// # Safety
    /// `cmd` is recording, outside rendering, and is submitted before the frames that see the map.
    pub unsafe fn set_environment(&mut self, cmd: vk::CommandBuffer, map: &Equirect) -> Result<(), Error> {
        let size = map.size();
        if size.iter().any(|s| *s > self.limits.image_size) {
            let what = format!("{}x{}", size[0], size[1]);
            return Err(Error::parameter(
                "environment map",
                what,
                format!("use at most {} pixels each way", self.limits.image_size),
            ));
        }
        let usage = vk::BufferUsageFlags::TRANSFER_SRC;
        let bytes = footprints::BYTES * u64::from(size[0]) * u64::from(size[1]);
        let mut staging = Buffer::new(&self.host, "environment staging", bytes, usage, Location::Upload)?;
        let scale = footprints::write(map, &mut staging.mapped()[..bytes as usize]);
        let spec = ImageSpec {
            format: vk::Format::R32G32B32A32_UINT,
            size,
            layers: 1,
            array: false,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
        };
        let image = match Image::new(&self.host, "environment", &spec) {
            Ok(image) => image,
            Err(e) => {
                staging.destroy(&self.host);
                return Err(e);
            }
        };
        let mut state = access::State::default();
        for access in [access::Access::TransferWrite, access::Access::FragmentRead] {
            if let Some(b) = state.step(access, true) {
                let barrier = b.on_image(image.handle, image.aspect);
                let info = vk::DependencyInfo::default().image_memory_barriers(std::slice::from_ref(&barrier));
                // SAFETY: `cmd` is recording (this function's contract); the image is new.
                unsafe { self.host.device.cmd_pipeline_barrier2(cmd, &info) };
            }
            if access == access::Access::TransferWrite {
                let layers =
                    vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
                let extent = vk::Extent3D { width: size[0], height: size[1], depth: 1 };
                let copy = vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent);
                let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
                // SAFETY: as above; the staging buffer holds exactly this image.
                unsafe {
                    self.host.device.cmd_copy_buffer_to_image(cmd, staging.handle, image.handle, layout, &[copy])
                };
            }
        }
        self.retire(Resource::Buffer(staging));
        if let Some(old) = self.environment.replace(Footprints { image, size, scale }) {
            self.retire(Resource::Image(old.image));
        }
        Ok(())
    }
}

/// Refuses more particles than a device holds.
pub(super) fn check_count(limits: &Limits, count: usize) -> Result<(), Error> {
    let most = (limits.storage_size / ARRAY_BYTES).min(MOST_PARTICLES);
    if count as u64 > most {
        return Err(Error::parameter("particles", count, format!("this device holds {most} at most")));
    }
    Ok(())
}

/// Refuses more points than a device holds.
pub(super) fn check_points_count(limits: &Limits, count: usize) -> Result<(), Error> {
    let most = limits.storage_size / POINT_BYTES;
    if count as u64 > most {
        return Err(Error::parameter("points", count, format!("this device holds {most} at most")));
    }
    Ok(())
}

/// Refuses more particles than a density field takes, if that is what is drawn.
pub(super) fn check_most_points(scene: &Scene) -> Result<(), Error> {
    if has_points(scene) && scene.count > MOST_POINTS {
        let remedy = format!("a density field takes {MOST_POINTS} at most: use fewer, or a method of maps (imai16)");
        return Err(Error::parameter("particles", scene.count, remedy));
    }
    Ok(())
}

fn has_points(scene: &Scene) -> bool {
    matches!(scene.settings.method.layers.member().kind(), Kind::Field(_))
}

/// The environment as it was uploaded.
pub(super) struct Footprints {
    pub image: Image,
    size: [u32; 2],
    scale: f32,
}

impl Footprints {
    /// Tells shaders of it.
    pub fn describe(&self, block: &mut shader::Frame) {
        let [columns, rows] = self.size.map(|n| n as f32);
        block.environment_per_radian = Vec2::new(columns / TAU, rows / PI);
        block.environment_columns = columns;
        block.environment_scale = self.scale;
    }
}

/// Three arrays of three floats each hold the particles (glsl/include/particles.glsl).
pub(super) const PARTICLE_ARRAYS: [&str; 3] =
    ["particle centres", "particle shapes (diagonal)", "particle shapes (mixed)"];
const ARRAY_BYTES: u64 = 12;
/// A fourth holds how fast they are, where that is known.
pub(super) const SPEEDS: &str = "particle speeds";
/// And one what a density field is made of: where each is, and how dense.
pub(super) const POINTS: &str = "particle points";
const POINT_BYTES: u64 = 16;
/// Where indices of three floats each, or of a rectangle of work groups, would no longer fit 32 bits.
const MOST_PARTICLES: u64 = 1 << 30;
