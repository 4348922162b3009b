//! Images as engines have them: views in parts of larger ones, each format and layout that is legal.

use crate::{
    background::painted,
    field_walk, half,
    host::{SIZE, ball, case},
    support::{Case, Driver, camera, each_driver, imai16, random_cloud},
    surface::{BEFORE, can_be_in, floats, has, image},
};
use ash::vk::{Format, Handle, ImageLayout as Layout, ImageView};
use glam::Vec3;
use meniscus::{
    Background, FrameInput, Method, Renderer, SceneInput, SurfaceOutput, SurfaceOutputs,
    host::{Canvas, Gpu},
    inspect::Inspection,
    layers::field::Field,
    optics::instant_liquids::InstantLiquids,
    twin::optics::encode_srgb,
};

const FLOAT4: Format = Format::R32G32B32A32_SFLOAT;
const ATTACHED: Layout = Layout::COLOR_ATTACHMENT_OPTIMAL;
const READ: Layout = Layout::SHADER_READ_ONLY_OPTIMAL;

/// Records a frame of the session's own renderer, without anything that is only inspected, and waits for it.
fn frame(driver: &Driver, case: &Case, input: &FrameInput) -> Result<(), String> {
    driver.give(case);
    let mut session = driver.session.borrow_mut();
    session.resize(case.size).expect("size");
    session.renderer.inspect(Inspection::default());
    let (gpu, renderer) = (session.gpu, &mut session.renderer);
    // SAFETY: recorded outside rendering; `run` waits; images are in the stated layouts, and what is refused is not used.
    gpu.run(|cmd| Ok(unsafe { renderer.record(cmd, input) }?)).map_err(|e| e.to_string())
}

fn new<'a>(case: &'a Case, output: &Canvas) -> FrameInput<'a> {
    FrameInput::new(0, &case.camera, &case.settings, output.view).eye_inside(case.eye_inside)
}

/// Rows of a part of an image.
fn part(bytes: &[u8], texel: usize, whole: [u32; 2], at: [u32; 2], size: [u32; 2]) -> Vec<u8> {
    let row = |y: u32| {
        let begin = ((at[1] + y) * whole[0] + at[0]) as usize * texel;
        bytes[begin..begin + size[0] as usize * texel].to_vec()
    };
    (0..size[1]).flat_map(row).collect()
}

/// An image larger than a view, which holds these texels where the view is, and others around it.
fn around<'a>(gpu: &'a Gpu<'a>, format: Format, texels: &[u8], size: [u32; 2], at: [u32; 2]) -> Canvas<'a> {
    let texel = texels.len() / (size[0] * size[1]) as usize;
    let whole = [size[0] + at[0] + 3, size[1] + at[1] + 7];
    let mut all = vec![BEFORE; (whole[0] * whole[1]) as usize * texel];
    for (y, row) in texels.chunks_exact(size[0] as usize * texel).enumerate() {
        let begin = ((at[1] as usize + y) * whole[0] as usize + at[0] as usize) * texel;
        all[begin..begin + row.len()].copy_from_slice(row);
    }
    let canvas = Canvas::new(gpu, format, texel as u64, whole).expect("canvas");
    canvas.write(&all, READ).expect("written");
    canvas
}

/// Each kind of optics and layers.
fn methods() -> Vec<(&'static str, Case)> {
    let particles = random_cloud(7, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 30, 300);
    let eye = camera(Vec3::new(0.4, 0.3, 2.4), Vec3::ZERO, SIZE);
    let green10 = Method::preset("green10").expect("a preset").into();
    let of = |settings| Case { particles: particles.clone(), camera: eye, settings, size: SIZE, eye_inside: false };
    let optics = InstantLiquids::default().half_resolution(true);
    let half = half::case(half::liquid(), [75, 53], half::settings(optics, None));
    vec![
        ("field", field_walk::case(Field::default(), 4, 4)),
        ("imai16", of(imai16())),
        ("green10", of(green10)),
        ("half", half),
    ]
}

/// What a view shows does not hang on where in an image it is, and nothing beside it is touched; nor on where in theirs the host's
/// scene is.
#[test]
fn a_view_in_an_atlas_is_the_view_alone() {
    let (origin, of_scene) = ([17, 9], [5, 11]);
    for (name, case) in methods() {
        let size = case.size;
        let painted = painted(size, |x, y| if (x / 16 + y / 16) % 3 == 0 { 2.2 } else { f64::INFINITY });
        let p = case.camera.projection;
        let z = |d: &f64| if d.is_finite() { (p.w_axis.z - p.z_axis.z * *d as f32) / *d as f32 } else { 1.0 };
        let depths: Vec<f32> = painted.0.iter().map(z).collect();
        let colors: Vec<f32> = painted.1.iter().flat_map(|c| [c.x, c.y, c.z, 1.0]).collect();
        each_driver(|driver| {
            let gpu = driver.gpu();
            for background in [Background::Environment, Background::Host] {
                let shoot = |origin: [u32; 2], of_scene: [u32; 2]| {
                    let color = around(gpu, FLOAT4, bytemuck::cast_slice(&colors), size, of_scene);
                    let depth = around(gpu, Format::R32_SFLOAT, bytemuck::cast_slice(&depths), size, of_scene);
                    let whole = [size[0] + origin[0] + 5, size[1] + origin[1] + 4];
                    let (output, normal) =
                        (image(gpu, FLOAT4, 16, whole, ATTACHED), image(gpu, FLOAT4, 16, whole, ATTACHED));
                    let scene = SceneInput::new((color.view, READ), (depth.view, READ), 1.0).origin(of_scene);
                    let told = SurfaceOutputs::default().normal(SurfaceOutput::new(normal.view, FLOAT4, ATTACHED));
                    let input = new(&case, &output).scene(scene).origin(origin).surface(told).background(background);
                    frame(driver, &case, &input).expect("a frame");
                    [output, normal].map(|canvas| {
                        let bytes = canvas.read().expect("read");
                        let view = part(&bytes, 16, whole, origin, size);
                        let touched = bytes.chunks_exact(16).filter(|t| **t != [BEFORE; 16]).count();
                        let own = view.chunks_exact(16).filter(|t| **t != [BEFORE; 16]).count();
                        assert_eq!(touched, own, "{}: {name}: pixels beside the view", driver.name);
                        (view, own)
                    })
                };
                let (alone, there) = (shoot([0, 0], [0, 0]), shoot(origin, of_scene));
                assert!(alone == there, "{}: {name}, {background:?}: another view", driver.name);
                assert!(alone[1].1 > 300, "{}: {name}: {} pixels of liquid", driver.name, alone[1].1);
            }
        });
    }
}

/// A view that does not fit where it is said to begin.
#[test]
fn origins_beyond_all_images_are_refused() {
    let case = case(ball());
    each_driver(|driver| {
        let [output, other] = [(); 2].map(|()| image(driver.gpu(), FLOAT4, 16, SIZE, ATTACHED));
        let most = driver.gpu().info.image_size;
        for origin in [[most - 5, 0], [0, u32::MAX]] {
            let said = frame(driver, &case, &new(&case, &output).origin(origin)).expect_err("refused");
            assert!(said.contains(&format!("origin is {origin:?}")), "{said}");
            let scene = SceneInput::new((other.view, READ), (other.view, READ), 1.0).origin(origin);
            let said = frame(driver, &case, &new(&case, &output).scene(scene)).expect_err("refused");
            assert!(said.contains(&format!("origin of the scene is {origin:?}")), "{said}");
        }
    });
}

/// Each output in each layout in which it can be attached: HDR, encoded by the hardware, encoded by the shader.
#[test]
fn outputs_of_each_kind_in_each_layout() {
    let case = case(ball());
    each_driver(|driver| {
        let gpu = driver.gpu();
        let linear = driver.shoot(&case).picture;
        for (format, texel, step) in [
            (FLOAT4, 16, 1e-3),
            (Format::R16G16B16A16_SFLOAT, 8, 2e-3),
            (Format::R8G8B8A8_SRGB, 4, 5e-3),
            (Format::B8G8R8A8_UNORM, 4, 5e-3),
        ] {
            // SAFETY: the device outlives the renderer, and has the required features.
            let mut renderer = unsafe { Renderer::new(gpu.host(1), format) }.expect("renderer");
            renderer.resize(SIZE).expect("size");
            renderer.set_particles(&case.particles).expect("particles");
            // SAFETY: recorded outside rendering, before any frame.
            gpu.run(|cmd| Ok(unsafe { renderer.set_environment(cmd, &meniscus::harness::SKY) }?)).expect("environment");
            for layout in [ATTACHED, Layout::ATTACHMENT_OPTIMAL, Layout::GENERAL] {
                let output = image(gpu, format, texel, SIZE, layout);
                let input = new(&case, &output).output_layout(layout);
                // SAFETY: as above; the output is in this layout.
                gpu.run(|cmd| Ok(unsafe { renderer.record(cmd, &input) }?)).expect("frame");
                let bytes = output.read_in(layout).expect("read");
                let encoded = |c: &[f32; 3]| if texel == 4 { Vec3::from(c.map(encode_srgb)) } else { Vec3::from(*c) };
                let found = |at: &[u8]| match format {
                    FLOAT4 => Vec3::from_slice(&floats(at)),
                    Format::R16G16B16A16_SFLOAT => Vec3::from(
                        [0, 2, 4].map(|o| crate::surface::f16(u16::from_ne_bytes([at[o], at[o + 1]])) as f32),
                    ),
                    Format::B8G8R8A8_UNORM => Vec3::new(at[2].into(), at[1].into(), at[0].into()) / 255.0,
                    _ => Vec3::new(at[0].into(), at[1].into(), at[2].into()) / 255.0,
                };
                let far = |(at, c): (&[u8], &[f32; 3])| {
                    let wanted = encoded(c);
                    ((found(at) - wanted).abs() / wanted.max(Vec3::ONE)).max_element() > step
                };
                let off = bytes.chunks_exact(texel as usize).zip(&linear).filter(|p| far(*p)).count();
                // Pixels on the ball's rim may walk another way in the other program.
                assert!(off * 500 < linear.len() * 3, "{}: {format:?} in {layout:?}: {off} pixels", driver.name);
            }
            // SAFETY: every frame was waited for.
            unsafe { renderer.destroy() };
        }
    });
}

const COLORS: [Layout; 3] = [READ, Layout::READ_ONLY_OPTIMAL, Layout::GENERAL];
const DEPTHS: [Layout; 6] = [
    READ,
    Layout::READ_ONLY_OPTIMAL,
    Layout::GENERAL,
    Layout::DEPTH_READ_ONLY_OPTIMAL,
    Layout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
    Layout::DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL,
];

/// Each format of the scene's depth in each pair of layouts in which colour and depth can be sampled: the same picture, but for what
/// the depth's bits leave of it.
#[test]
fn scenes_of_each_depth_in_each_pair_of_layouts() {
    let case = case(ball());
    let p = case.camera.projection;
    let z = (p.w_axis.z - p.z_axis.z * 2.7) / 2.7;
    let left = |i: u32| i % SIZE[0] < SIZE[0] / 2;
    let pixels = SIZE[0] * SIZE[1];
    let colors: Vec<f32> = (0..pixels).flat_map(|i| [0.9, 0.1, (i % 7) as f32 / 7.0, 1.0]).collect();
    each_driver(|driver| {
        let gpu = driver.gpu();
        let mut first: Option<Vec<u8>> = None;
        for format in [
            Format::R32_SFLOAT,
            Format::D32_SFLOAT,
            Format::D32_SFLOAT_S8_UINT,
            Format::D24_UNORM_S8_UINT,
            Format::X8_D24_UNORM_PACK32,
            Format::D16_UNORM,
        ] {
            if !has(gpu, format) {
                println!("{}: no {format:?}", driver.name);
                continue;
            }
            let value = |i: u32| if left(i) { z } else { 1.0 };
            let (mut depths, mut texel) = (Vec::new(), 4);
            for i in 0..pixels {
                match format {
                    Format::D16_UNORM => {
                        texel = 2;
                        depths.extend(((value(i) * 65535.0).round() as u16).to_ne_bytes());
                    }
                    Format::D24_UNORM_S8_UINT | Format::X8_D24_UNORM_PACK32 => {
                        depths.extend(((f64::from(value(i)) * f64::from(0xff_ffff)).round() as u32).to_ne_bytes());
                    }
                    _ => depths.extend(value(i).to_ne_bytes()),
                }
            }
            let color_only = format == Format::R32_SFLOAT;
            let mut of_format: Option<Vec<u8>> = None;
            let of_depths = if color_only { &COLORS[..] } else { &DEPTHS };
            for of_depth in of_depths.iter().filter(|l| can_be_in(format, **l)) {
                for of_color in COLORS {
                    let label = format!("{}: {format:?} in {of_depth:?}, colour in {of_color:?}", driver.name);
                    let (color, depth) = (Canvas::new(gpu, FLOAT4, 16, SIZE), Canvas::new(gpu, format, texel, SIZE));
                    let (color, depth) = (color.expect("colour"), depth.expect("depth"));
                    color.write(bytemuck::cast_slice(&colors), of_color).expect("colour");
                    depth.write(&depths, *of_depth).expect("depth");
                    let output = image(gpu, FLOAT4, 16, SIZE, ATTACHED);
                    let scene = SceneInput::new((color.view, of_color), (depth.view, *of_depth), 1.0);
                    frame(driver, &case, &new(&case, &output).scene(scene)).expect("a frame");
                    let picture = output.read().expect("read");
                    assert!(of_format.get_or_insert_with(|| picture.clone()) == &picture, "{label}: another picture");
                }
            }
            let picture = of_format.expect("some");
            // The board beside the ball and before its rim is the host's own colour, and beside it the environment is.
            let first = first.get_or_insert_with(|| picture.clone());
            let off = first.chunks_exact(16).zip(picture.chunks_exact(16)).filter(|(a, b)| {
                let (a, b) = (Vec3::from_slice(&floats(a)), Vec3::from_slice(&floats(b)));
                (a - b).abs().max_element() > 1e-2
            });
            let most = if format == Format::D16_UNORM { 60 } else { 10 };
            let off = off.count();
            assert!(off < most, "{}: {format:?}: {off} pixels", driver.name);
        }
        let shown = first.expect("R32_SFLOAT");
        let own = |i: &u32| {
            left(*i)
                && shown[16 * *i as usize..][..12]
                    == bytemuck::cast_slice::<f32, u8>(&colors[4 * *i as usize..][..3])[..]
        };
        let seen = (0..pixels).filter(own).count() as u32;
        assert!(seen > pixels / 4 && seen < pixels / 2, "{}: {seen} pixels of the board", driver.name);
    });
}

/// Layouts in which nothing can be attached, or sampled, by name.
#[test]
fn illegal_layouts_are_refused() {
    let case = case(ball());
    let view = ImageView::from_raw(1);
    let others = [
        Layout::UNDEFINED,
        Layout::PREINITIALIZED,
        Layout::TRANSFER_SRC_OPTIMAL,
        Layout::TRANSFER_DST_OPTIMAL,
        Layout::PRESENT_SRC_KHR,
        Layout::DEPTH_ATTACHMENT_OPTIMAL,
        Layout::DEPTH_ATTACHMENT_STENCIL_READ_ONLY_OPTIMAL,
        Layout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
        Layout::STENCIL_READ_ONLY_OPTIMAL,
    ];
    each_driver(|driver| {
        let input = FrameInput::new(0, &case.camera, &case.settings, view);
        for layout in others.into_iter().chain(COLORS[..2].iter().copied()).chain(DEPTHS[3..].iter().copied()) {
            let said = frame(driver, &case, &input.output_layout(layout)).expect_err("refused");
            assert!(said.contains(&format!("layout of the output is {layout:?}")), "{said}");
        }
        let attached = [ATTACHED, Layout::ATTACHMENT_OPTIMAL];
        for layout in others.into_iter().chain(attached) {
            let scene = SceneInput::new((view, READ), (view, layout), 1.0);
            let said = frame(driver, &case, &input.scene(scene)).expect_err("refused");
            assert!(said.contains(&format!("scene depth is in {layout:?}")), "{said}");
        }
        for layout in others.into_iter().chain(attached).chain(DEPTHS[3..].iter().copied()) {
            let scene = SceneInput::new((view, layout), (view, READ), 1.0);
            let said = frame(driver, &case, &input.scene(scene)).expect_err("refused");
            assert!(said.contains(&format!("scene colour is in {layout:?}")), "{said}");
        }
    });
}
