//! What a frame left behind, for tests, dumps and studies of the method: targets by name, and what walks met. No host needs
//! it to draw; the feature `inspect` brings it, with the CPU twins and the tables of shaders.

use crate::{
    Camera, Error, Renderer, Settings, passes::shape::COUNTED, plan::COUNTERS, prepare::Report, recorder::PlanEntry,
    resources::Resource, scale::Scale, scene::Scene, shader::Frame, space::Space, statistics::PassStatistics,
};
pub use crate::{
    access::{Access, Barrier, State},
    optics::{
        lookup::{Lookup, Mode, twin as lookup},
        walk::Walk,
    },
    plan::SurfaceNames,
    resources::{ImageSpec, Spec},
};
use ash::vk;
use glam::Vec3;

/// What frames write beside the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inspection {
    /// What each walk met, into "walk (debug)" and "final direction (debug)".
    pub walks: bool,
    /// Where each pixel first meets liquid, into "first surface": the normal in world space, outward, and the depth in particle
    /// radii, 0 where there is no liquid.
    pub surface: bool,
    /// Where positions are prepared on the device, so many neighbours of every particle, into "neighbours (debug)": for
    /// each its index, how many there are, and the indices of the first of them; 0 lists none.
    pub neighbours: u32,
    /// Smoothing ends after so many times that depths go through a shader, if it does not end before: of a filter's maps only
    /// the last two are still there after a frame.
    pub smoothing_steps: Option<u32>,
    /// What the device counts of each pass, for [`Renderer::statistics`]. The device was made with `pipelineStatisticsQuery`.
    pub statistics: bool,
}

impl Inspection {
    pub(crate) fn apply(&self, scene: &mut Scene) {
        scene.walks = self.walks;
        scene.surface_read = self.surface;
        scene.smoothing_steps = self.smoothing_steps;
        if let Some(p) = &mut scene.prepare {
            p.neighbours = self.neighbours;
        }
    }
}

/// What became of particles that were prepared, by the names of the counters; classes first, then guards.
pub fn counted(report: &Report) -> [(&'static str, usize); 6] {
    let r = report;
    let counts = [r.splash, r.body, r.few_neighbours, r.degenerate, r.clamped_long, r.clamped_ratio];
    std::array::from_fn(|i| (COUNTED[i], counts[i]))
}

/// The report that counters of a frame are, which prepared particles on the device.
pub fn report(counters: &[(&str, u32)]) -> Report {
    let count = |name| counters.iter().find(|c| c.0 == name).map_or(0, |c| c.1 as usize);
    let [splash, body, few_neighbours, degenerate, clamped_long, clamped_ratio, _] = COUNTED.map(count);
    Report { splash, body, few_neighbours, degenerate, clamped_long, clamped_ratio, ..Report::default() }
}

/// The block that shaders read; see [`Camera`].
pub fn uniforms(camera: &Camera, settings: &Settings, size: [u32; 2], space: &Space, bounds: (Vec3, Vec3)) -> Frame {
    camera.uniforms(settings, size, space, bounds)
}

/// The block of passes that work at half the picture's width and height, of that of the picture.
pub fn half(picture: &Frame) -> Frame {
    Scale::Half.block(picture)
}

impl Renderer {
    /// Pipelines that were made so far.
    pub fn pipelines(&self) -> usize {
        self.pipelines.len()
    }

    /// Says what frames to come write beside the picture.
    pub fn inspect(&mut self, inspection: Inspection) {
        self.inspection = inspection;
    }

    /// What the device counted of the frame last recorded into a slot, which has completed: each pass in order. `None` unless
    /// [`Inspection::statistics`] asked for it.
    pub fn statistics(&self, slot: usize) -> Option<Vec<PassStatistics>> {
        self.slots.get(slot)?.statistics.as_ref()?.read(&self.host.device)
    }

    /// Which targets hold the surfaces of the last frame.
    pub fn surfaces(&self) -> SurfaceNames {
        self.surfaces
    }

    /// The last frame's buffers of counters, and the names of their slots.
    pub fn counters(&self) -> [(&'static str, Vec<&'static str>); 2] {
        let [particles, view] = self.counters.clone();
        [(COUNTERS[0], particles), (COUNTERS[1], view)]
    }

    /// The block of the frame last recorded into this slot, as shaders read it and completed it. What they wrote is to be
    /// visible to the host.
    pub fn block(&mut self, slot: usize) -> Option<Frame> {
        let bytes = self.slots.get_mut(slot)?.frame_block.mapped().get(..size_of::<Frame>())?;
        Some(bytemuck::pod_read_unaligned(bytes))
    }

    /// Names of the targets and buffers of the last frame.
    pub fn targets(&self) -> Vec<&'static str> {
        self.tables.iter().flat_map(|t| t.names()).collect()
    }

    /// How a resource of the last frame was made; `None` if that frame did without it.
    pub fn spec(&self, name: &str) -> Option<Spec> {
        self.tables.iter().find_map(|t| t.get(name)).map(|e| e.spec)
    }
}

impl Renderer {
    /// Records a copy of one layer of a target (tightly packed rows) or of a whole buffer, as the last frame left it.
    ///
    /// # Safety
    /// `cmd` is recording, outside rendering, and runs after the frame; `to` holds the content from `offset` on, was
    /// made with `TRANSFER_DST`, and is made visible to the host by the caller.
    pub unsafe fn record_copy(
        &mut self,
        cmd: vk::CommandBuffer,
        name: &'static str,
        layer: u32,
        to: vk::Buffer,
        offset: u64,
    ) -> Result<(), Error> {
        let device = &self.host.device;
        let Some(entry) = self.tables.iter_mut().find_map(|t| t.get_mut(name)) else {
            return Err(Error::parameter("target", name, "the last frame did without it"));
        };
        let is_image = matches!(entry.resource, Resource::Image(_));
        if let Some(barrier) = entry.state.step(Access::TransferRead, is_image) {
            self.barriers.push(PlanEntry { pass: "copy", resource: name, barrier });
            let (image, buffer);
            let info = match &entry.resource {
                Resource::Image(i) => {
                    image = barrier.on_image(i.handle, i.aspect);
                    vk::DependencyInfo::default().image_memory_barriers(std::slice::from_ref(&image))
                }
                Resource::Buffer(b) => {
                    buffer = barrier.on_buffer(b.handle);
                    vk::DependencyInfo::default().buffer_memory_barriers(std::slice::from_ref(&buffer))
                }
            };
            // SAFETY: `cmd` is recording outside rendering; the resource is alive and its layout tracked.
            unsafe { device.cmd_pipeline_barrier2(cmd, &info) };
        }
        match (&entry.resource, entry.spec) {
            (Resource::Image(image), Spec::Image(spec)) => {
                let layers = vk::ImageSubresourceLayers {
                    aspect_mask: image.aspect,
                    mip_level: 0,
                    base_array_layer: layer,
                    layer_count: 1,
                };
                let extent = vk::Extent3D { width: spec.size[0], height: spec.size[1], depth: 1 };
                let copy =
                    vk::BufferImageCopy::default().buffer_offset(offset).image_subresource(layers).image_extent(extent);
                let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
                // SAFETY: the image was just brought into this layout; the rest is this function's contract.
                unsafe { device.cmd_copy_image_to_buffer(cmd, image.handle, layout, to, &[copy]) };
            }
            (Resource::Buffer(buffer), Spec::Buffer { bytes, .. }) => {
                let copy = vk::BufferCopy { src_offset: 0, dst_offset: offset, size: bytes };
                // SAFETY: as above.
                unsafe { device.cmd_copy_buffer(cmd, buffer.handle, to, &[copy]) };
            }
            _ => {}
        }
        Ok(())
    }
}
