//! Positions in memory of another device's, which the host has imported: a buffer like any other.

use crate::{
    shape,
    support::{Case, Driver, Random, SKY, camera, each_driver, imai16},
};
use ash::vk;
use glam::Vec3;
use meniscus::{
    FrameInput,
    host::{Gpu, HostError, Session, Upload},
    prepare::DevicePositions,
};

const RADIUS: f32 = 0.05;
const SIZE: [u32; 2] = [64, 48];
const SHARED: vk::ExternalMemoryHandleTypeFlags = vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD;
const USAGE: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
    vk::BufferUsageFlags::STORAGE_BUFFER.as_raw() | vk::BufferUsageFlags::TRANSFER_DST.as_raw(),
);

/// In which stages a buffer is used, and how.
type Use = (vk::PipelineStageFlags2, vk::AccessFlags2);

fn cloud(seed: u64) -> Vec<Vec3> {
    let mut random = Random(seed);
    (0..2000).map(|_| random.point(Vec3::splat(-0.5), Vec3::splat(0.5))).collect()
}

/// A buffer in memory that two devices share.
struct Shared<'a> {
    gpu: &'a Gpu<'a>,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    bytes: u64,
}

impl<'a> Shared<'a> {
    /// In new memory, or in that of a file descriptor, which becomes the device's.
    fn new(gpu: &'a Gpu<'a>, bytes: u64, descriptor: Option<i32>) -> Shared<'a> {
        let mut external = vk::ExternalMemoryBufferCreateInfo::default().handle_types(SHARED);
        let info = vk::BufferCreateInfo::default().size(bytes).usage(USAGE).push_next(&mut external);
        // SAFETY: complete infos on a live device, which has the extension; the memory is the buffer's alone.
        unsafe {
            let buffer = gpu.device.create_buffer(&info, None).expect("buffer");
            let needed = gpu.device.get_buffer_memory_requirements(buffer);
            let mut export = vk::ExportMemoryAllocateInfo::default().handle_types(SHARED);
            let mut import = vk::ImportMemoryFdInfoKHR::default().handle_type(SHARED).fd(descriptor.unwrap_or(-1));
            let mut alone = vk::MemoryDedicatedAllocateInfo::default().buffer(buffer);
            let allocate = vk::MemoryAllocateInfo::default()
                .allocation_size(needed.size)
                .memory_type_index(needed.memory_type_bits.trailing_zeros())
                .push_next(&mut alone);
            let allocate = match descriptor {
                None => allocate.push_next(&mut export),
                Some(_) => allocate.push_next(&mut import),
            };
            let memory = gpu.device.allocate_memory(&allocate, None).expect("memory");
            gpu.device.bind_buffer_memory(buffer, memory, 0).expect("bound");
            Shared { gpu, buffer, memory, bytes }
        }
    }

    fn descriptor(&self) -> i32 {
        let functions = ash::khr::external_memory_fd::Device::new(&self.gpu.host(1).instance, &self.gpu.device);
        let info = vk::MemoryGetFdInfoKHR::default().memory(self.memory).handle_type(SHARED);
        // SAFETY: memory that was made to be exported so.
        unsafe { functions.get_memory_fd(&info) }.expect("a file descriptor")
    }

    /// Takes the buffer from whoever has it outside, or hands it over; `use_of` it: what this device does with it.
    fn transfer(&self, cmd: vk::CommandBuffer, takes: bool, use_of: Use) -> Result<(), HostError> {
        let own = self.gpu.host(1).queue_family;
        let barrier = vk::BufferMemoryBarrier2::default().buffer(self.buffer).size(vk::WHOLE_SIZE);
        let barrier = match takes {
            true => barrier.dst_stage_mask(use_of.0).dst_access_mask(use_of.1),
            false => barrier.src_stage_mask(use_of.0).src_access_mask(use_of.1),
        };
        let (from, to) = if takes { (vk::QUEUE_FAMILY_EXTERNAL, own) } else { (own, vk::QUEUE_FAMILY_EXTERNAL) };
        let barrier = [barrier.src_queue_family_index(from).dst_queue_family_index(to)];
        let info = vk::DependencyInfo::default().buffer_memory_barriers(&barrier);
        // SAFETY: `cmd` is recording, on a queue of that family.
        unsafe { self.gpu.device.cmd_pipeline_barrier2(cmd, &info) };
        Ok(())
    }

    /// A step of the simulation.
    fn write(&self, positions: &[Vec3], first: bool) {
        let write = (vk::PipelineStageFlags2::ALL_TRANSFER, vk::AccessFlags2::TRANSFER_WRITE);
        let step = self.gpu.run(|cmd| {
            if !first {
                self.transfer(cmd, true, write)?;
            }
            // SAFETY: `cmd` is recording; the positions fill the buffer.
            unsafe { self.gpu.device.cmd_update_buffer(cmd, self.buffer, 0, bytemuck::cast_slice(positions)) };
            self.transfer(cmd, false, write)
        });
        step.expect("written");
    }
}

impl Drop for Shared<'_> {
    fn drop(&mut self) {
        // SAFETY: `Gpu::run` and frames of a session wait.
        unsafe {
            self.gpu.device.destroy_buffer(self.buffer, None);
            self.gpu.device.free_memory(self.memory, None);
        }
    }
}

/// Whether the driver can share such a buffer.
fn shares(driver: &Driver) -> bool {
    let host = driver.gpu().host(1);
    let info = vk::PhysicalDeviceExternalBufferInfo::default().usage(USAGE).handle_type(SHARED);
    let mut found = vk::ExternalBufferProperties::default();
    // SAFETY: the device's own instance and physical device.
    unsafe { host.instance.get_physical_device_external_buffer_properties(host.physical_device, &info, &mut found) };
    use vk::ExternalMemoryFeatureFlags as F;
    found.external_memory_properties.external_memory_features.contains(F::EXPORTABLE | F::IMPORTABLE)
}

/// One device simulates, another one of the same driver draws what lies in its memory, step by step.
#[test]
fn positions_of_another_device() {
    each_driver(|driver| {
        let info = || driver.instance.pick(Some(&driver.name)).expect("it was there a moment ago");
        let device = || Gpu::importing(driver.instance, info()).expect("a device");
        let (Some(simulates), Some(draws)) = (device(), device()) else {
            println!("{}: no VK_KHR_external_memory_fd", driver.name);
            assert!(!driver.name.contains("Mesa 25"), "it had it before");
            return;
        };
        assert!(shares(driver), "{}: has the extension", driver.name);
        let view = camera(Vec3::new(0.3, 0.5, 2.4), Vec3::ZERO, SIZE);
        let case = Case { camera: view, settings: imai16(), size: SIZE, ..shape::empty(RADIUS) };
        let mut session = Session::new(&draws, SIZE, &SKY).expect("session");
        let mut picture = |buffer: vk::Buffer, count: usize| {
            let positions = DevicePositions::packed(buffer, count as u32, RADIUS);
            let input = FrameInput::new(0, &case.camera, &case.settings, vk::ImageView::null()).positions(positions);
            session.frame(&input).expect("frame");
            session.picture().expect("picture")
        };
        let steps = [cloud(1), cloud(2)];
        let bytes = std::mem::size_of_val(&steps[0][..]) as u64;
        let own = Shared::new(&simulates, bytes, None);
        let imported = Shared::new(&draws, own.bytes, Some(own.descriptor()));
        let read = (vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_STORAGE_READ);
        let mut seen = Vec::new();
        for (i, positions) in steps.iter().enumerate() {
            own.write(positions, i == 0);
            draws.run(|cmd| imported.transfer(cmd, true, read)).expect("taken");
            let found = picture(imported.buffer, positions.len());
            draws.run(|cmd| imported.transfer(cmd, false, read)).expect("handed over");
            let usual = Upload::new(&draws, bytemuck::cast_slice(positions)).expect("upload");
            assert!(found == picture(usual.buffer, positions.len()), "{}: step {i}", driver.name);
            seen.push(found);
        }
        assert!(seen[0] != seen[1], "{}: both steps look the same", driver.name);
        session.end();
    });
}
