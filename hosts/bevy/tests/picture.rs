//! What Bevy shows is what meniscus draws of the same inputs without it.

use meniscus_bevy::meniscus_wgpu::{
    Frame, Liquid, Scene,
    meniscus::{Background, Camera, Equirect, Settings, glam::Vec3, prepare},
    open, wgpu,
};
use std::{fs::File, io::BufReader, path::Path, process::Command};

const SIZE: [u32; 2] = [320, 240];
const RADIUS: f32 = 0.04;
const CLEAR: wgpu::Color = wgpu::Color { r: 0.7, g: 0.3, b: 0.1, a: 1.0 };
/// Bevy's picture is of 16 bits before it is of 8.
const ROUNDING: u8 = 1;

#[test]
fn bevy_shows_what_meniscus_draws() {
    let file = std::env::temp_dir().join(format!("meniscus-bevy-{}.png", std::process::id()));
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let mut bevy = Command::new(cargo);
    bevy.args(["run", "--quiet", "--locked", "--example", "headless", "--"]).arg(&file);
    let output = bevy.output().expect("cargo");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let shown = pixels(&file);
    std::fs::remove_file(&file).expect("it was there");

    let drawn = bevy::tasks::block_on(draw());
    let liquid = drawn.iter().filter(|pixel| **pixel != drawn[0]).count();
    assert!(liquid > 5000, "{liquid} pixels of liquid");
    let difference = |(a, b): (&[u8; 4], &[u8; 4])| (0..3).map(|i| a[i].abs_diff(b[i])).max();
    let worst = shown.iter().zip(&drawn).map(difference).max().flatten();
    assert!(shown.len() == drawn.len() && worst <= Some(ROUNDING), "differ by up to {worst:?}");
}

fn pixels(file: &Path) -> Vec<[u8; 4]> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(file).expect("a picture"))).read_info().expect("PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    reader.next_frame(&mut bytes).expect("pixels");
    bytes.as_chunks().0.to_vec()
}

/// The same ball before the same colour, with a depth of the other convention.
async fn draw() -> Vec<[u8; 4]> {
    use wgpu::{TextureFormat as Format, TextureUsages as Usages};
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let power_preference = wgpu::PowerPreference::HighPerformance;
    let options = wgpu::RequestAdapterOptions { power_preference, ..Default::default() };
    let adapter = instance.request_adapter(&options).await.expect("an adapter");
    let (device, queue) = open(&adapter, &Default::default()).expect("a device");
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
    let picture = target(Format::Rgba8UnormSrgb, Usages::COPY_SRC);
    let textures = [
        picture.clone(),
        target(Format::Rgba16Float, Usages::TEXTURE_BINDING),
        target(Format::Depth32Float, Usages::TEXTURE_BINDING),
    ];
    let [output, color, depth] = textures.each_ref().map(|t| t.create_view(&Default::default()));
    let mut encoder = device.create_command_encoder(&Default::default());
    let clear = |view| {
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(CLEAR), store: wgpu::StoreOp::Store };
        Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
    };
    drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[clear(&output), clear(&color)],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        ..Default::default()
    }));

    let axis = || (-6..=6).map(|i| 2.0 * RADIUS * i as f32);
    let lattice = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x, y, z))));
    let ball: Vec<_> = lattice.filter(|p| p.length() < 12.0 * RADIUS).collect();
    let input = prepare::Input::new(&ball, RADIUS);
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let eye = Vec3::new(0.0, 0.6, 2.2);
    let camera = Camera::look_at(eye, Vec3::ZERO, Vec3::Y, std::f32::consts::FRAC_PI_4, aspect, 0.1);
    let settings = Settings::default();
    // SAFETY: the device was opened by `open`; textures live to the end, and command buffers are submitted in order.
    let mut liquid = unsafe { Liquid::new(&adapter, &device, picture.format(), 1) }.expect("a renderer");
    let particles = prepare::prepare(&input, &Default::default()).expect("particles").0;
    liquid.renderer().set_particles(&particles).expect("particles");
    liquid.renderer().set_points(&prepare::points(&input, &Default::default()).expect("points")).expect("points");
    // SAFETY: as above.
    let sky = unsafe { liquid.set_environment(&Equirect::procedural_sky()) }.expect("a sky");
    let frame = Frame {
        camera: &camera,
        settings: &settings,
        output: &output,
        scene: Some(Scene { color: &color, depth: &depth, cleared_depth: 1.0 }),
        background: Background::Host,
    };
    // SAFETY: as above.
    let [before, water] = unsafe { liquid.record(&frame, |input| input) }.expect("a frame");
    queue.submit([sky, encoder.finish(), before, water]);

    let row = 4 * SIZE[0];
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row * SIZE[1]),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(picture.as_image_copy(), to, picture.size());
    queue.submit([encoder.finish()]);
    buffer.slice(..).map_async(wgpu::MapMode::Read, |mapped| mapped.expect("a buffer to be read"));
    device.poll(wgpu::PollType::wait_indefinitely()).expect("done");
    let bytes = buffer.slice(..).get_mapped_range();
    bytes.as_chunks().0.to_vec()
}
