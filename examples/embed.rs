//! The smallest engine that meniscus fits into: its own instance, device, allocator and frames in flight; an orbiting
//! camera; a frame recorded while the last one runs. It needs none of meniscus' optional features, and writes the last
//! picture as a PPM.
//!
//! ```sh
//! cargo run --example embed -- water.ppm
//! ```

use ash::vk;
use glam::Vec3;
use gpu_allocator::{
    MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc},
};
use meniscus::{Camera, Equirect, FrameInput, Host, Renderer, Settings, device, prepare};
use std::{
    io::Write,
    sync::{Arc, Mutex},
};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const SIZE: [u32; 2] = [640, 480];
const IN_FLIGHT: usize = 2;
const FRAMES: usize = 6;
const RADIUS: f32 = 0.02;
const COLOR: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

/// A frame in flight of this engine.
struct Slot {
    cmd: vk::CommandBuffer,
    done: vk::Fence,
    picture: vk::Image,
    memory: Allocation,
    view: vk::ImageView,
    readback: vk::Buffer,
    readback_memory: Allocation,
}

/// A ball of liquid, and a droplet beside it.
fn positions() -> Vec<Vec3> {
    let axis = || (-12..=12).map(|i| 2.0 * RADIUS * i as f32);
    let lattice = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x, y, z))));
    lattice.filter(|p| p.length() < 24.0 * RADIUS).chain([Vec3::new(0.7, 0.1, 0.0)]).collect()
}

fn main() -> Result<()> {
    let file = std::env::args().nth(1).unwrap_or_else(|| "water.ppm".into());
    // SAFETY: the loader stays loaded, and every handle below is destroyed once, children first, with the device idle.
    unsafe {
        // The engine's own Vulkan: any 1.3 device that will do, with what meniscus asks for enabled.
        let entry = ash::Entry::load()?;
        let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let instance = entry.create_instance(&vk::InstanceCreateInfo::default().application_info(&app), None)?;
        let family = 0;
        let physical = instance.enumerate_physical_devices()?;
        let physical = physical.into_iter().find(|d| device::check(&instance, *d, family).is_ok());
        let physical = physical.ok_or("no Vulkan device that meniscus can use")?;
        let large_points = instance.get_physical_device_features(physical).large_points != 0;
        let features = vk::PhysicalDeviceFeatures::default().large_points(large_points);
        let mut features13 = device::required_features();
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_features(&features);
        let device = instance.create_device(physical, &info.push_next(&mut features13), None)?;
        let queue = device.get_device_queue(family, 0);
        let allocator = Arc::new(Mutex::new(Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })?));
        let pool_info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(family)
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        let pool = device.create_command_pool(&pool_info, None)?;
        let mut slots = (0..IN_FLIGHT).map(|_| slot(&device, &allocator, pool)).collect::<Result<Vec<_>>>()?;

        // meniscus borrows all that. A UNORM output receives sRGB-encoded colour.
        let host = Host {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: physical,
            queue_family: family,
            allocator: allocator.clone(),
            frames_in_flight: IN_FLIGHT as u32,
            large_points,
            debug_utils: None,
        };
        let mut renderer = Renderer::new(host, vk::Format::R8G8B8A8_UNORM)?;
        renderer.resize(SIZE)?;
        let positions = positions();
        let input = prepare::Input { positions: &positions, radius: RADIUS, classes: None, ellipsoids: None };
        renderer.set_particles(&prepare::prepare(&input, &Default::default())?.0)?;
        let settings = Settings { absorption: Vec3::new(0.9, 0.3, 0.15), ..Settings::default() };

        for frame in 0..FRAMES {
            // The engine's frame: wait for this slot's last one, record, submit. Only the engine waits.
            let s = &slots[frame % IN_FLIGHT];
            device.wait_for_fences(&[s.done], true, u64::MAX)?;
            device.reset_fences(&[s.done])?;
            device.begin_command_buffer(s.cmd, &vk::CommandBufferBeginInfo::default())?;
            if frame == 0 {
                renderer.set_environment(s.cmd, &Equirect::procedural_sky())?;
            }
            let (undefined, drawn) = (vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
            layout(&device, s, undefined, drawn);
            let angle = 0.3 * frame as f32;
            let eye = Vec3::new(2.2 * angle.sin(), 0.6, 2.2 * angle.cos());
            let aspect = SIZE[0] as f32 / SIZE[1] as f32;
            let camera = Camera::look_at(eye, Vec3::ZERO, Vec3::Y, 0.7, aspect, 0.1);
            let input = FrameInput::new(frame % IN_FLIGHT, &camera, &settings, s.view);
            renderer.record(s.cmd, &input)?;
            layout(&device, s, drawn, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
            let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
            let copy = vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent());
            let source = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
            device.cmd_copy_image_to_buffer(s.cmd, s.picture, source, s.readback, &[copy]);
            let visible = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::HOST)
                .dst_access_mask(vk::AccessFlags2::HOST_READ)];
            device.cmd_pipeline_barrier2(s.cmd, &vk::DependencyInfo::default().memory_barriers(&visible));
            device.end_command_buffer(s.cmd)?;
            let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(s.cmd)];
            let submit = vk::SubmitInfo2::default().command_buffer_infos(&commands);
            device.queue_submit2(queue, &[submit], s.done)?;
        }
        device.device_wait_idle()?;

        let last = &slots[(FRAMES - 1) % IN_FLIGHT];
        let pixels = last.readback_memory.mapped_slice().ok_or("the readback buffer is not mapped")?;
        let mut ppm = format!("P6 {} {} 255\n", SIZE[0], SIZE[1]).into_bytes();
        ppm.extend(pixels.chunks_exact(4).take((SIZE[0] * SIZE[1]) as usize).flat_map(|p| &p[..3]));
        std::fs::File::create(&file)?.write_all(&ppm)?;

        renderer.destroy();
        for s in slots.drain(..) {
            device.destroy_image_view(s.view, None);
            device.destroy_image(s.picture, None);
            device.destroy_buffer(s.readback, None);
            device.destroy_fence(s.done, None);
            let mut allocator = allocator.lock().map_err(|e| e.to_string())?;
            allocator.free(s.memory)?;
            allocator.free(s.readback_memory)?;
        }
        drop(allocator);
        device.destroy_command_pool(pool, None);
        device.destroy_device(None);
        instance.destroy_instance(None);
    }
    Ok(())
}

fn extent() -> vk::Extent3D {
    vk::Extent3D { width: SIZE[0], height: SIZE[1], depth: 1 }
}

/// # Safety
/// `device` is alive; `pool` and `allocator` are its own.
unsafe fn slot(device: &ash::Device, allocator: &Mutex<Allocator>, pool: vk::CommandPool) -> Result<Slot> {
    let signaled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
    let command = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
    let image = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(vk::Format::R8G8B8A8_UNORM)
        .extent(extent())
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC);
    let bytes = u64::from(SIZE[0]) * u64::from(SIZE[1]) * 4;
    let buffer = vk::BufferCreateInfo::default().size(bytes).usage(vk::BufferUsageFlags::TRANSFER_DST);
    let allocate = |requirements, location, linear| {
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let desc = AllocationCreateDesc { name: "engine", requirements, location, linear, allocation_scheme };
        allocator.lock().map_err(|e| e.to_string())?.allocate(&desc).map_err(|e| e.to_string())
    };
    // SAFETY: complete infos on a live device (this function's contract); memory of each object's own requirements.
    unsafe {
        let picture = device.create_image(&image, None)?;
        let memory = allocate(device.get_image_memory_requirements(picture), MemoryLocation::GpuOnly, false)?;
        device.bind_image_memory(picture, memory.memory(), memory.offset())?;
        let view = vk::ImageViewCreateInfo::default()
            .image(picture)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(vk::Format::R8G8B8A8_UNORM)
            .subresource_range(COLOR);
        let readback = device.create_buffer(&buffer, None)?;
        let readback_memory =
            allocate(device.get_buffer_memory_requirements(readback), MemoryLocation::GpuToCpu, true)?;
        device.bind_buffer_memory(readback, readback_memory.memory(), readback_memory.offset())?;
        Ok(Slot {
            cmd: device.allocate_command_buffers(&command)?[0],
            done: device.create_fence(&signaled, None)?,
            view: device.create_image_view(&view, None)?,
            picture,
            memory,
            readback,
            readback_memory,
        })
    }
}

/// Records a full barrier between two layouts of a slot's picture.
///
/// # Safety
/// The slot's command buffer is recording, and the picture is in `from`.
unsafe fn layout(device: &ash::Device, slot: &Slot, from: vk::ImageLayout, to: vk::ImageLayout) {
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
        .old_layout(from)
        .new_layout(to)
        .image(slot.picture)
        .subresource_range(COLOR)];
    // SAFETY: this function's contract.
    unsafe { device.cmd_pipeline_barrier2(slot.cmd, &vk::DependencyInfo::default().image_memory_barriers(&barrier)) };
}
