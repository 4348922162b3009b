//! The smallest engine that meniscus fits into: its own instance, device, allocator and frames in flight; an orbiting
//! camera; a frame recorded while the last one runs; an opaque scene of its own (a chequered wall, and a post that stands in
//! the liquid) and its own sky, over and through which the liquid is drawn. It needs none of meniscus' optional features,
//! and writes the last picture as a PPM.
//!
//! ```sh
//! cargo run --example embed -- water.ppm [part of a driver's name]
//! ```

use ash::vk;
use glam::{Vec2, Vec3};
use gpu_allocator::{
    MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc},
};
use meniscus::{Background, Camera, Equirect, FrameInput, Host, Renderer, SceneInput, Settings, device, prepare};
use std::{
    io::Write,
    sync::{Arc, Mutex},
};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const SIZE: [u32; 2] = [640, 480];
const IN_FLIGHT: usize = 2;
const FRAMES: usize = 6;
const RADIUS: f32 = 0.02;
/// Encodes what is blitted into it, or drawn, as sRGB.
const PICTURE: vk::Format = vk::Format::R8G8B8A8_SRGB;
const SCENE: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
const SKY: [f32; 4] = [0.25, 0.42, 0.75, 0.0];

/// A frame in flight of this engine.
struct Slot {
    cmd: vk::CommandBuffer,
    done: vk::Fence,
    picture: Target,
    scene: Target,
    depth: Target,
    readback: vk::Buffer,
    readback_memory: Allocation,
}

/// An image of this engine's.
struct Target {
    image: vk::Image,
    aspect: vk::ImageAspectFlags,
    view: vk::ImageView,
    memory: Allocation,
}

/// An opaque board that faces the camera.
struct Board {
    center: Vec3,
    half: Vec2,
    color: [f32; 4],
}

/// A chequered wall behind the liquid as seen from the eye, and a post through its middle; far boards first.
fn boards(eye: Vec3) -> Vec<Board> {
    let (back, up) = (-eye.normalize(), Vec3::Y);
    let right = back.cross(up).normalize();
    let tile = |i: i32, j: i32| Board {
        center: 1.2 * back + 0.3 * (i as f32 * right + j as f32 * up),
        half: Vec2::splat(0.15),
        color: if (i + j) % 2 == 0 { [0.7, 0.65, 0.55, 1.0] } else { [0.12, 0.13, 0.16, 1.0] },
    };
    let wall = (-4..=4).flat_map(|i| (-4..=1).map(move |j| tile(i, j)));
    let post = Board { center: Vec3::ZERO, half: Vec2::new(0.05, 0.75), color: [0.8, 0.08, 0.05, 1.0] };
    wall.chain([post]).collect()
}

/// A ball of liquid, and a droplet beside it.
fn positions() -> Vec<Vec3> {
    let axis = || (-12..=12).map(|i| 2.0 * RADIUS * i as f32);
    let lattice = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x, y, z))));
    lattice.filter(|p| p.length() < 24.0 * RADIUS).chain([Vec3::new(0.7, 0.1, 0.0)]).collect()
}

fn main() -> Result<()> {
    let file = std::env::args().nth(1).unwrap_or_else(|| "water.ppm".into());
    let driver = std::env::args().nth(2).unwrap_or_default();
    // SAFETY: the loader stays loaded, and every handle below is destroyed once, children first, with the device idle.
    unsafe {
        // The engine's own Vulkan: any 1.3 device that will do, with what meniscus asks for enabled.
        let entry = ash::Entry::load()?;
        let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let instance = entry.create_instance(&vk::InstanceCreateInfo::default().application_info(&app), None)?;
        let family = 0;
        let physical = instance.enumerate_physical_devices()?;
        let wanted = |d: &vk::PhysicalDevice| {
            device::check(&instance, *d, family).is_ok() && driver_name(&instance, *d).contains(&driver)
        };
        let physical = physical.into_iter().find(wanted);
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

        // meniscus borrows all that. An sRGB output receives linear colour, and encodes it.
        let mut host = Host::new(instance.clone(), device.clone(), physical, family, allocator.clone());
        host.frames_in_flight = IN_FLIGHT as u32;
        host.large_points = large_points;
        let mut renderer = Renderer::new(host, PICTURE)?;
        renderer.resize(SIZE)?;
        let positions = positions();
        let input = prepare::Input::new(&positions, RADIUS);
        renderer.set_particles(&prepare::prepare(&input, &Default::default())?.0)?;
        renderer.set_points(&prepare::points(&input, &Default::default())?)?;
        let mut settings = Settings::default();
        settings.liquid.absorption = Vec3::new(0.9, 0.3, 0.15);
        // At loading time: frames with these settings compile nothing.
        renderer.warm_up(&settings)?;

        for frame in 0..FRAMES {
            // The engine's frame: wait for this slot's last one, record, submit. Only the engine waits.
            let s = &slots[frame % IN_FLIGHT];
            device.wait_for_fences(&[s.done], true, u64::MAX)?;
            device.reset_fences(&[s.done])?;
            device.begin_command_buffer(s.cmd, &vk::CommandBufferBeginInfo::default())?;
            if frame == 0 {
                renderer.set_environment(s.cmd, &Equirect::procedural_sky())?;
            }
            let angle = 0.3 * frame as f32;
            let eye = Vec3::new(2.2 * angle.sin(), 0.6, 2.2 * angle.cos());
            let aspect = SIZE[0] as f32 / SIZE[1] as f32;
            let camera = Camera::look_at(eye, Vec3::ZERO, Vec3::Y, 0.7, aspect, 0.1);
            draw_scene(&device, s, &camera, &boards(eye));
            // Then the liquid, over the picture of the scene and through it.
            let input = FrameInput::new(frame % IN_FLIGHT, &camera, &settings, s.picture.view)
                .scene(SceneInput::new((s.scene.view, READ), (s.depth.view, READ), 1.0))
                .background(Background::Host);
            renderer.record(s.cmd, &input)?;
            layout(&device, s.cmd, &s.picture, DRAWN, SOURCE);
            let copy = vk::BufferImageCopy::default().image_subresource(layers()).image_extent(extent());
            device.cmd_copy_image_to_buffer(s.cmd, s.picture.image, SOURCE, s.readback, &[copy]);
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
            let mut allocator = allocator.lock().map_err(|e| e.to_string())?;
            for target in [s.picture, s.scene, s.depth] {
                device.destroy_image_view(target.view, None);
                device.destroy_image(target.image, None);
                allocator.free(target.memory)?;
            }
            device.destroy_buffer(s.readback, None);
            device.destroy_fence(s.done, None);
            allocator.free(s.readback_memory)?;
        }
        drop(allocator);
        device.destroy_command_pool(pool, None);
        device.destroy_device(None);
        instance.destroy_instance(None);
    }
    Ok(())
}

/// # Safety
/// The physical device is the instance's, and of Vulkan 1.2 at least.
unsafe fn driver_name(instance: &ash::Instance, physical: vk::PhysicalDevice) -> String {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: this function's contract; the chain lives on this stack frame.
    unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
    let [name, version] = [driver.driver_name_as_c_str(), driver.driver_info_as_c_str()]
        .map(|s| s.map(|s| s.to_string_lossy().into_owned()).unwrap_or_default());
    format!("{name} {version}")
}

const UNDEFINED: vk::ImageLayout = vk::ImageLayout::UNDEFINED;
const DRAWN: vk::ImageLayout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
const SOURCE: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
const READ: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;

fn extent() -> vk::Extent3D {
    vk::Extent3D { width: SIZE[0], height: SIZE[1], depth: 1 }
}

fn layers() -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1)
}

/// The engine's own renderer: boards into colour and depth, and the colour into the picture. Leaves the picture to be drawn
/// over, and the scene to be read.
///
/// # Safety
/// The slot's command buffer is recording; `device` is alive.
unsafe fn draw_scene(device: &ash::Device, s: &Slot, camera: &Camera, boards: &[Board]) {
    let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width: SIZE[0], height: SIZE[1] } };
    let sky = vk::ClearValue { color: vk::ClearColorValue { float32: SKY } };
    let nothing = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 } };
    let attachment = |target: &Target, layout, clear| {
        vk::RenderingAttachmentInfo::default()
            .image_view(target.view)
            .image_layout(layout)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(clear)
    };
    let depth_layout = vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL;
    let color = [attachment(&s.scene, DRAWN, sky)];
    let depth = attachment(&s.depth, depth_layout, nothing);
    let info = vk::RenderingInfo::default()
        .render_area(area)
        .layer_count(1)
        .color_attachments(&color)
        .depth_attachment(&depth);
    let corner = vk::Offset3D { x: SIZE[0] as i32, y: SIZE[1] as i32, z: 1 };
    let blit = [vk::ImageBlit::default()
        .src_subresource(layers())
        .src_offsets([vk::Offset3D::default(), corner])
        .dst_subresource(layers())
        .dst_offsets([vk::Offset3D::default(), corner])];
    let target = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
    // SAFETY: this function's contract; every image is in the layout stated.
    unsafe {
        layout(device, s.cmd, &s.scene, UNDEFINED, DRAWN);
        layout(device, s.cmd, &s.depth, UNDEFINED, depth_layout);
        device.cmd_begin_rendering(s.cmd, &info);
        for board in boards {
            // A rectangle of one depth can be cleared, so this engine needs no pipeline.
            let Some((rect, z)) = project(camera, board) else { continue };
            let depth = vk::ClearDepthStencilValue { depth: z, stencil: 0 };
            let values = [
                vk::ClearAttachment {
                    aspect_mask: vk::ImageAspectFlags::COLOR,
                    color_attachment: 0,
                    clear_value: vk::ClearValue { color: vk::ClearColorValue { float32: board.color } },
                },
                vk::ClearAttachment {
                    aspect_mask: vk::ImageAspectFlags::DEPTH,
                    color_attachment: 0,
                    clear_value: vk::ClearValue { depth_stencil: depth },
                },
            ];
            device.cmd_clear_attachments(s.cmd, &values, &[rect]);
        }
        device.cmd_end_rendering(s.cmd);
        layout(device, s.cmd, &s.scene, DRAWN, SOURCE);
        layout(device, s.cmd, &s.picture, UNDEFINED, target);
        device.cmd_blit_image(s.cmd, s.scene.image, SOURCE, s.picture.image, target, &blit, vk::Filter::NEAREST);
        layout(device, s.cmd, &s.picture, target, DRAWN);
        layout(device, s.cmd, &s.scene, SOURCE, READ);
        layout(device, s.cmd, &s.depth, depth_layout, READ);
    }
}

/// The pixels that a board covers, and its depth in the depth buffer; `None` if it is out of view.
fn project(camera: &Camera, board: &Board) -> Option<(vk::ClearRect, f32)> {
    let eye = camera.view.transform_point3(board.center);
    if -eye.z <= camera.near {
        return None;
    }
    let size = Vec2::new(SIZE[0] as f32, SIZE[1] as f32);
    let pixel = |x: Vec2| {
        let clip = camera.projection.project_point3(x.extend(eye.z));
        (0.5 * (clip.truncate() + 1.0) * size).round().clamp(Vec2::ZERO, size)
    };
    let (a, b) = (pixel(eye.truncate() - board.half), pixel(eye.truncate() + board.half));
    let (low, span) = (a.min(b).as_uvec2(), (a - b).abs().as_uvec2());
    let rect = vk::Rect2D {
        offset: vk::Offset2D { x: low.x as i32, y: low.y as i32 },
        extent: vk::Extent2D { width: span.x, height: span.y },
    };
    let z = camera.projection.project_point3(eye).z;
    (span.x > 0 && span.y > 0).then_some((vk::ClearRect { rect, base_array_layer: 0, layer_count: 1 }, z))
}

/// # Safety
/// `device` is alive; `pool` and `allocator` are its own.
unsafe fn slot(device: &ash::Device, allocator: &Mutex<Allocator>, pool: vk::CommandPool) -> Result<Slot> {
    use vk::ImageUsageFlags as Usage;
    let signaled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
    let command = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
    let bytes = u64::from(SIZE[0]) * u64::from(SIZE[1]) * 4;
    let buffer = vk::BufferCreateInfo::default().size(bytes).usage(vk::BufferUsageFlags::TRANSFER_DST);
    let (color, depth) = (vk::ImageAspectFlags::COLOR, vk::ImageAspectFlags::DEPTH);
    let copied = Usage::TRANSFER_SRC | Usage::TRANSFER_DST;
    // SAFETY: complete infos on a live device (this function's contract); memory of the buffer's own requirements.
    unsafe {
        let readback = device.create_buffer(&buffer, None)?;
        let requirements = device.get_buffer_memory_requirements(readback);
        let readback_memory = allocate(allocator, requirements, MemoryLocation::GpuToCpu, true)?;
        device.bind_buffer_memory(readback, readback_memory.memory(), readback_memory.offset())?;
        Ok(Slot {
            cmd: device.allocate_command_buffers(&command)?[0],
            done: device.create_fence(&signaled, None)?,
            picture: target(device, allocator, PICTURE, color, Usage::COLOR_ATTACHMENT | copied)?,
            scene: target(device, allocator, SCENE, color, Usage::COLOR_ATTACHMENT | Usage::SAMPLED | copied)?,
            depth: target(device, allocator, DEPTH, depth, Usage::DEPTH_STENCIL_ATTACHMENT | Usage::SAMPLED)?,
            readback,
            readback_memory,
        })
    }
}

fn allocate(
    allocator: &Mutex<Allocator>,
    requirements: vk::MemoryRequirements,
    location: MemoryLocation,
    linear: bool,
) -> Result<Allocation> {
    let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
    let desc = AllocationCreateDesc { name: "engine", requirements, location, linear, allocation_scheme };
    Ok(allocator.lock().map_err(|e| e.to_string())?.allocate(&desc)?)
}

/// # Safety
/// `device` is alive; `allocator` is its own.
unsafe fn target(
    device: &ash::Device,
    allocator: &Mutex<Allocator>,
    format: vk::Format,
    aspect: vk::ImageAspectFlags,
    usage: vk::ImageUsageFlags,
) -> Result<Target> {
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(format)
        .extent(extent())
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(usage);
    // SAFETY: complete infos on a live device (this function's contract); memory of the image's own requirements.
    unsafe {
        let image = device.create_image(&info, None)?;
        let requirements = device.get_image_memory_requirements(image);
        let memory = allocate(allocator, requirements, MemoryLocation::GpuOnly, false)?;
        device.bind_image_memory(image, memory.memory(), memory.offset())?;
        let view = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(range(aspect));
        Ok(Target { view: device.create_image_view(&view, None)?, image, aspect, memory })
    }
}

fn range(aspect: vk::ImageAspectFlags) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1)
}

/// Records a full barrier between two layouts of a target.
///
/// # Safety
/// The command buffer is recording outside rendering, and the target is in `from`.
unsafe fn layout(
    device: &ash::Device,
    cmd: vk::CommandBuffer,
    target: &Target,
    from: vk::ImageLayout,
    to: vk::ImageLayout,
) {
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
        .old_layout(from)
        .new_layout(to)
        .image(target.image)
        .subresource_range(range(target.aspect))];
    // SAFETY: this function's contract.
    unsafe { device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().image_memory_barriers(&barrier)) };
}
