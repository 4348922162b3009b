//! What is not as it has to be is an error, and frames that never run are none.

use crate::drivers;
use meniscus_wgpu::{
    Error, Frame, Liquid, Scene,
    meniscus::{Background, Camera, Equirect, Settings, glam::Vec3, prepare},
    open,
};

const OUTPUT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

#[test]
fn frames_that_never_run_are_no_frames() {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    let wanted = drivers::all();
    let is_wanted = |adapter: &&wgpu::Adapter| {
        let info = adapter.get_info();
        wanted.iter().any(|w| *w == format!("{} {}", info.driver, info.driver_info).trim())
    };
    let adapter = adapters.iter().find(is_wanted).expect("a driver");
    let (device, queue) = open(adapter, &wgpu::DeviceDescriptor::default()).expect("a device");
    let view = |format| {
        let picture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: 32, height: 32, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        picture.create_view(&Default::default())
    };
    let [output, float, depth] =
        [OUTPUT, wgpu::TextureFormat::Rgba16Float, wgpu::TextureFormat::Depth32Float].map(view);
    let camera = Camera::look_at(Vec3::new(0.0, 0.0, 1.0), Vec3::ZERO, Vec3::Y, 0.7, 1.0, 0.1);
    let settings = Settings::default();
    let frame = Frame {
        camera: &camera,
        settings: &settings,
        output: &output,
        scene: None,
        background: Background::Environment,
    };
    // SAFETY: the device was opened by `open`; handles live to the end of the test, and command buffers run in order.
    unsafe {
        let mut liquid = Liquid::new(adapter, &device, OUTPUT, 2).expect("a renderer");
        let input = prepare::Input::new(&[Vec3::ZERO], 0.1);
        let particles = prepare::prepare(&input, &Default::default()).expect("particles").0;
        liquid.renderer().set_particles(&particles).expect("particles");
        liquid.renderer().set_points(&prepare::points(&input, &Default::default()).expect("points")).expect("points");
        queue.submit([liquid.set_environment(&Equirect::procedural_sky()).expect("a sky")]);
        let refused =
            |frame: &Frame<'_>, liquid: &mut Liquid| liquid.record(frame, |input| input).expect_err("refused");
        let other = refused(&Frame { output: &float, ..frame }, &mut liquid);
        assert!(matches!(other, Error::Format { wanted: OUTPUT, .. }), "{other}");
        let scene = Some(Scene { color: &output, depth: &depth, cleared_depth: 1.0 });
        let own = refused(&Frame { scene, ..frame }, &mut liquid);
        assert!(matches!(own, Error::SceneIsOutput), "{own}");
        let held: Vec<_> = (0..2).map(|_| liquid.record(&frame, |input| input).expect("a frame")).collect();
        let refused = liquid.record(&frame, |input| input).expect_err("more than may be in flight");
        assert!(matches!(refused, Error::Unsubmitted(2)), "{refused}");
        drop(held);
        for _ in 0..5 {
            queue.submit(liquid.record(&frame, |input| input).expect("slots of what was dropped are free"));
        }
        let refused =
            Liquid::new(adapter, &device, wgpu::TextureFormat::R8Unorm, 2).err().expect("no output of one channel");
        assert!(refused.to_string().contains("RGBA"), "{refused}");
    }
}
