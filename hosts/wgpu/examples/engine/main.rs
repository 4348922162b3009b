//! The smallest engine on wgpu that meniscus fits into: it draws a scene of its own, has the liquid drawn over and through
//! it, and draws a bar over both. Its picture, but for the bar, is that of `examples/embed.rs`, which does the same on
//! Vulkan.
//!
//! ```sh
//! cargo run -p meniscus-wgpu --example engine -- water.png [part of a driver's name] [--validate]
//! ```

mod scene;
mod validation;

use meniscus_wgpu::{
    Frame, Liquid, Scene,
    meniscus::{Background, Equirect, Settings, glam::Vec3, prepare},
    open,
};
use scene::{RADIUS, Rect, SIZE};
use validation::Validation;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const IN_FLIGHT: u32 = 2;
const FRAMES: usize = 6;
/// Encodes what is drawn into it as sRGB.
const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const SCENE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const SKY: wgpu::Color = wgpu::Color { r: 0.25, g: 0.42, b: 0.75, a: 0.0 };

fn main() -> Result<()> {
    let (validate, args): (Vec<_>, Vec<_>) = std::env::args().skip(1).partition(|arg| arg == "--validate");
    let file = args.first().map_or("water.png", String::as_str);
    let driver = args.get(1).map_or("", String::as_str);

    let (instance, validation) = if validate.is_empty() {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN;
        (wgpu::Instance::new(descriptor), None)
    } else {
        let (instance, validation) = Validation::instance()?;
        (instance, Some(validation))
    };
    let pixels = pollster::block_on(draw(&instance, driver))?;
    drop(instance);
    if let Some(validation) = validation {
        // Everything is destroyed by now.
        let messages = validation.end();
        println!("validation: {} messages", messages.len());
        if !messages.is_empty() {
            return Err(messages.join("\n").into());
        }
    }
    let mut png = png::Encoder::new(std::fs::File::create(file)?, SIZE[0], SIZE[1]);
    png.set_color(png::ColorType::Rgba);
    png.write_header()?.write_image_data(&pixels)?;
    Ok(())
}

/// Draws all frames; the last one's pixels.
async fn draw(instance: &wgpu::Instance, driver: &str) -> Result<Vec<u8>> {
    let adapters = instance.enumerate_adapters(wgpu::Backends::VULKAN).await;
    let name = |adapter: &wgpu::Adapter| {
        let info = adapter.get_info();
        format!("{} {} {}", info.name, info.driver, info.driver_info)
    };
    let adapter = adapters.iter().find(|adapter| name(adapter).contains(driver));
    let adapter = adapter
        .ok_or_else(|| format!("no adapter \"{driver}\" among {:?}", adapters.iter().map(name).collect::<Vec<_>>()))?;
    println!("adapter: {}", name(adapter));
    // All that differs from any other program of wgpu's: who opens the device.
    let (device, queue) = open(adapter, &wgpu::DeviceDescriptor::default())?;
    let engine = Engine::new(&device);

    // SAFETY: the device was opened by `open`.
    let mut liquid = unsafe { Liquid::new(adapter, &device, PICTURE, IN_FLIGHT + 1) }?;
    let positions = scene::positions();
    let input = prepare::Input::new(&positions, RADIUS);
    liquid.renderer().set_particles(&prepare::prepare(&input, &Default::default())?.0)?;
    liquid.renderer().set_points(&prepare::points(&input, &Default::default())?)?;
    let mut settings = Settings::default();
    settings.liquid.absorption = Vec3::new(0.9, 0.3, 0.15);
    // At loading time: frames with these settings compile nothing.
    liquid.renderer().warm_up(&settings)?;
    // SAFETY: it is submitted, before any frame is recorded.
    queue.submit([unsafe { liquid.set_environment(&Equirect::procedural_sky()) }?]);

    let [picture, color, depth] =
        [&engine.picture, &engine.color, &engine.depth].map(|t| t.create_view(&Default::default()));
    for frame in 0..FRAMES {
        let (eye, camera) = scene::camera(frame);
        let drawn = engine.draw_scene(&device, &scene::boards(eye, &camera), &color, &depth, &picture);
        let frame_input = Frame {
            camera: &camera,
            settings: &settings,
            output: &picture,
            scene: Some(Scene { color: &color, depth: &depth, cleared_depth: 1.0 }),
            background: Background::Host,
        };
        // SAFETY: the textures outlive the device's work, for which `Liquid` waits when it is dropped; frames are submitted
        // as they come.
        let [before, water] = unsafe { liquid.record(&frame_input, |input| input) }?;
        // wgpu goes on: it draws over the liquid.
        let over = engine.draw_over(&device, &scene::bar(frame, FRAMES), &picture);
        queue.submit([drawn, before, water, over]);
    }
    engine.read(&device, &queue)
}

/// The engine's own renderer.
struct Engine {
    picture: wgpu::Texture,
    color: wgpu::Texture,
    depth: wgpu::Texture,
    /// Rectangles into the scene, and over the picture.
    boards: wgpu::RenderPipeline,
    over: wgpu::RenderPipeline,
    copy: wgpu::RenderPipeline,
}

impl Engine {
    fn new(device: &wgpu::Device) -> Engine {
        use wgpu::TextureUsages as Usages;
        let target = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: Usages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let module = device.create_shader_module(wgpu::include_wgsl!("shaders.wgsl"));
        let rects = wgpu::VertexBufferLayout {
            array_stride: size_of::<Rect>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &Rect::ATTRIBUTES,
        };
        let pipeline = |[vertex, fragment]: [&str; 2], format, depth| {
            let constants: &[(&str, f64)] = match vertex {
                "rect" => &[("width", SIZE[0] as f64), ("height", SIZE[1] as f64)],
                _ => &[],
            };
            let buffers = [Some(rects.clone())];
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(fragment),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(vertex),
                    compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
                    buffers: if vertex == "rect" { &buffers } else { &[] },
                },
                primitive: wgpu::PrimitiveState {
                    topology: wgpu::PrimitiveTopology::TriangleStrip,
                    ..Default::default()
                },
                depth_stencil: depth,
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(fragment),
                    compilation_options: Default::default(),
                    targets: &[Some(wgpu::ColorTargetState {
                        format,
                        blend: None,
                        write_mask: wgpu::ColorWrites::ALL,
                    })],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let depth = wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            // As where each is cleared to its depth: the last of those that share a pixel stays.
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        };
        Engine {
            picture: target(PICTURE, Usages::COPY_SRC),
            color: target(SCENE, Usages::TEXTURE_BINDING),
            depth: target(DEPTH, Usages::TEXTURE_BINDING),
            boards: pipeline(["rect", "fill"], SCENE, Some(depth)),
            over: pipeline(["rect", "fill"], PICTURE, None),
            copy: pipeline(["whole", "copy"], PICTURE, None),
        }
    }

    /// The scene into its colour and depth, and its colour into the picture.
    fn draw_scene(
        &self,
        device: &wgpu::Device,
        boards: &[Rect],
        color: &wgpu::TextureView,
        depth: &wgpu::TextureView,
        picture: &wgpu::TextureView,
    ) -> wgpu::CommandBuffer {
        let mut encoder = device.create_command_encoder(&Default::default());
        let rects = rects(device, boards);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(attachment(color, wgpu::LoadOp::Clear(SKY)))],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.boards);
        pass.set_vertex_buffer(0, rects.slice(..));
        pass.draw(0..4, 0..boards.len() as u32);
        drop(pass);

        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.copy.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(color) }],
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(attachment(picture, wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT)))],
            ..Default::default()
        });
        pass.set_pipeline(&self.copy);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        encoder.finish()
    }

    /// A rectangle over the picture.
    fn draw_over(&self, device: &wgpu::Device, rect: &Rect, picture: &wgpu::TextureView) -> wgpu::CommandBuffer {
        let mut encoder = device.create_command_encoder(&Default::default());
        let rects = rects(device, std::slice::from_ref(rect));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("bar"),
            color_attachments: &[Some(attachment(picture, wgpu::LoadOp::Load))],
            ..Default::default()
        });
        pass.set_pipeline(&self.over);
        pass.set_vertex_buffer(0, rects.slice(..));
        pass.draw(0..4, 0..1);
        drop(pass);
        encoder.finish()
    }

    /// The picture's pixels.
    fn read(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<u8>> {
        // Rows of a copy begin at multiples of 256 bytes, as these do.
        let row = 4 * SIZE[0];
        assert_eq!(row % wgpu::COPY_BYTES_PER_ROW_ALIGNMENT, 0);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row) * u64::from(SIZE[1]),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            self.picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
            },
            self.picture.size(),
        );
        queue.submit([encoder.finish()]);
        buffer.slice(..).map_async(wgpu::MapMode::Read, |mapped| mapped.expect("a buffer to be read"));
        device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(buffer.slice(..).get_mapped_range()?.to_vec())
    }
}

fn attachment(view: &wgpu::TextureView, load: wgpu::LoadOp<wgpu::Color>) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}

fn rects(device: &wgpu::Device, rects: &[Rect]) -> wgpu::Buffer {
    use wgpu::util::DeviceExt;
    let contents = bytemuck::cast_slice(rects);
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents,
        usage: wgpu::BufferUsages::VERTEX,
    })
}
