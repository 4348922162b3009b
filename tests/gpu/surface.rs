//! What the host is told of the first surface: depths of its own projection, normals, in each format and layout that it may choose.

use crate::{
    background::HostScene,
    host::{SIZE, ball, case},
    support::{Case, Driver, Shot, each_driver},
};
use ash::vk::{Format, ImageLayout as Layout, ImageView};
use glam::{DVec3, Mat4, Vec3, Vec4};
use meniscus::{
    Camera, FrameInput, SurfaceOutput, SurfaceOutputs,
    host::{Canvas, Gpu},
    twin::surface::{halved, host_depth},
};

const ATTACHED: Layout = Layout::COLOR_ATTACHMENT_OPTIMAL;
/// What images hold before the frame: bytes of it all over. As a float 1.5e-10, as parts of 255 47.
pub const BEFORE: u8 = 47;

/// Images of the host's for a depth and a normal, in floats.
pub struct Asked<'a> {
    depth: Canvas<'a>,
    normal: Canvas<'a>,
}

/// An image that holds `BEFORE`.
pub fn image<'a>(gpu: &'a Gpu<'a>, format: Format, texel: u64, size: [u32; 2], layout: Layout) -> Canvas<'a> {
    let canvas = Canvas::new(gpu, format, texel, size).expect("canvas");
    canvas.write(&vec![BEFORE; (u64::from(size[0] * size[1]) * texel) as usize], layout).expect("written");
    canvas
}

pub fn asking<'a>(gpu: &'a Gpu<'a>, size: [u32; 2]) -> Asked<'a> {
    let depth = image(gpu, Format::R32_SFLOAT, 4, size, ATTACHED);
    Asked { depth, normal: image(gpu, Format::R32G32B32A32_SFLOAT, 16, size, ATTACHED) }
}

impl Asked<'_> {
    pub fn outputs(&self) -> SurfaceOutputs {
        let output = |canvas: &Canvas, format| SurfaceOutput::new(canvas.view, format, ATTACHED);
        SurfaceOutputs::default()
            .depth(output(&self.depth, Format::R32_SFLOAT))
            .normal(output(&self.normal, Format::R32G32B32A32_SFLOAT))
    }
}

pub fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// Normal and depth in world units of each pixel that shows liquid.
pub fn firsts(shot: &Shot) -> Vec<Option<(DVec3, f64)>> {
    let words = shot.floats("first surface", 0).expect("asked for");
    let first = |w: &[f32]| (Vec3::new(w[0], w[1], w[2]).as_dvec3(), f64::from(w[3]) * shot.space.radius);
    words.chunks_exact(4).map(|w| (w[3] != 0.0).then(|| first(w))).collect()
}

/// The same view, by other conventions of depth: what it is called, its projection, and the depth that it is cleared to.
fn conventions(camera: &Camera) -> Vec<(&'static str, Camera, f32)> {
    let (near, far) = (0.5, 12.0);
    let depth = |scale: f32, offset: f32| {
        let mut p = camera.projection;
        (p.z_axis.z, p.w_axis.z) = (scale, offset);
        let mut camera = *camera;
        camera.projection = p;
        camera
    };
    let mut off_centre = depth(0.0, near);
    (off_centre.projection.z_axis.x, off_centre.projection.z_axis.y) = (0.1, -0.2);
    off_centre.projection.y_axis.y *= -1.0;
    vec![
        ("infinite", depth(-1.0, -near), 1.0),
        ("finite", depth(-far / (far - near), -far * near / (far - near)), 1.0),
        ("reversed, finite", depth(near / (far - near), far * near / (far - near)), 0.0),
        ("reversed, infinite", depth(0.0, near), 0.0),
        ("reversed, off-centre and upside down", off_centre, 0.0),
    ]
}

/// The host's scene, a board through the left half of the ball and nothing else, with depths of this convention.
fn board<'a>(driver: &Driver<'a>, camera: &Camera, cleared: f32) -> HostScene<'a> {
    let p = camera.projection;
    let at = |d: f32| (p.w_axis.z - p.z_axis.z * d) / d;
    let depths: Vec<f32> =
        (0..SIZE[0] * SIZE[1]).map(|i| if i % SIZE[0] < SIZE[0] / 2 { at(2.6) } else { cleared }).collect();
    let colors = vec![Vec3::new(0.9, 0.1, 0.2); depths.len()];
    HostScene::of_depths(driver.gpu(), SIZE, &depths, &colors)
}

/// Depths are the host's own whatever its convention, pixels without liquid keep what they hold, and the picture is the one of a frame
/// that says nothing; a scene of the same convention hides the same liquid.
#[test]
fn depths_are_those_of_the_hosts_projection() {
    let case = case(ball());
    each_driver(|driver| {
        let mut hidden = Vec::new();
        for (name, camera, cleared) in conventions(&case.camera) {
            let case = Case { camera, ..case.clone() };
            let board = board(driver, &camera, cleared);
            for before in [false, true] {
                let label = format!("{}: {name}, scene {before}", driver.name);
                let asked = asking(driver.gpu(), SIZE);
                let scene = before.then(|| board.cleared_to(cleared));
                let plain = driver.shoot_with(&case, &|input| input.scene(scene));
                assert!(plain.words("first surface", 0).is_none(), "{label}: nobody asked");
                let shot = driver.shoot_with(&case, &|input| input.scene(scene).surface(asked.outputs()));
                assert_eq!(shot.picture, plain.picture, "{label}: another picture");
                let depths = floats(&asked.depth.read().expect("depths"));
                let normals = floats(&asked.normal.read().expect("normals"));
                let untouched = f32::from_ne_bytes([BEFORE; 4]);
                let firsts = firsts(&shot);
                for (i, first) in firsts.iter().enumerate() {
                    let normal = &normals[4 * i..][..4];
                    let Some((n, d)) = first else {
                        assert_eq!((depths[i], normal), (untouched, &[untouched; 4][..]), "{label}: pixel {i}");
                        continue;
                    };
                    let wanted = host_depth(&camera, *d);
                    assert!((f64::from(depths[i]) - wanted).abs() < 1e-6, "{label}: {} and {wanted}", depths[i]);
                    assert_eq!(normal, [n.x as f32, n.y as f32, n.z as f32, 1.0], "{label}: pixel {i}");
                    // Where the ball is: its own normal, in the world.
                    let x = position(&camera, SIZE, i, *d);
                    assert!((x.normalize() - *n).length() < 2e-3, "{label}: pixel {i}: {x} and {n}");
                }
                if before {
                    hidden.push((name, firsts.iter().map(Option::is_some).collect::<Vec<_>>()));
                } else {
                    assert!(firsts.iter().flatten().count() > 400, "{label}");
                }
            }
        }
        let left = |f: &[bool]| f.iter().enumerate().filter(|(i, shown)| **shown && i % 96 < 48).count();
        for (name, shown) in &hidden[..4] {
            assert_eq!(shown, &hidden[0].1, "{}: {name}", driver.name);
        }
        // Of the left half what is nearer than the board.
        let (shown, hides) = (hidden[0].1.iter().filter(|s| **s).count(), left(&hidden[0].1));
        assert!(hides > 50 && hides < (shown - hides) * 3 / 5, "{}: {shown}, {hides}", driver.name);
    });
}

/// Where in the world a pixel's view ray is so deep.
pub fn position(camera: &Camera, size: [u32; 2], pixel: usize, depth: f64) -> DVec3 {
    let at = [(pixel as u32 % size[0]) as f64 + 0.5, (pixel as u32 / size[0]) as f64 + 0.5];
    let p = camera.projection.as_dmat4();
    let across = |k: usize| (2.0 * at[k] / f64::from(size[k]) - 1.0 + p.z_axis[k]) / p.col(k)[k] * depth;
    let eye = DVec3::new(across(0), across(1), -depth);
    camera.view.as_dmat4().inverse().transform_point3(eye)
}

/// A projection that is jittered by whole pixels shows the same, so many pixels on.
#[test]
fn jitter_moves_the_picture() {
    let case = case(ball());
    let mut jittered = case.clone();
    jittered.camera.projection = Mat4::from_cols(
        case.camera.projection.x_axis,
        case.camera.projection.y_axis,
        case.camera.projection.z_axis - Vec4::new(2.0 * 5.0 / SIZE[0] as f32, 2.0 * -3.0 / SIZE[1] as f32, 0.0, 0.0),
        case.camera.projection.w_axis,
    );
    each_driver(|driver| {
        let [still, moved] = [&case, &jittered].map(|case| {
            let asked = asking(driver.gpu(), SIZE);
            let shot = driver.shoot_with(case, &|input| input.surface(asked.outputs()));
            (shot.picture, floats(&asked.depth.read().expect("depths")))
        });
        let (mut off, mut shown) = (0, 0);
        for y in 8..SIZE[1] as usize - 8 {
            for x in 8..SIZE[0] as usize - 8 {
                let (a, b) = (y * 96 + x, (y - 3) * 96 + x + 5);
                shown += usize::from(still.1[a] > 0.01);
                off += usize::from(
                    (still.1[a] - moved.1[b]).abs() > 1e-5
                        || Vec3::from(still.0[a]).distance(Vec3::from(moved.0[b])) > 0.02,
                );
            }
        }
        assert!(shown > 400 && off * 100 <= shown, "{}: {off} of {shown}", driver.name);
    });
}

/// A format, bytes of its depth and how its bits are a number.
type Depths = (Format, u64, fn(u32) -> f64);

const DEPTHS: [Depths; 6] = [
    (Format::R32_SFLOAT, 4, |w| f64::from(f32::from_bits(w))),
    (Format::D32_SFLOAT, 4, |w| f64::from(f32::from_bits(w))),
    (Format::D32_SFLOAT_S8_UINT, 4, |w| f64::from(f32::from_bits(w))),
    (Format::X8_D24_UNORM_PACK32, 4, |w| f64::from(w & 0xff_ffff) / f64::from(0xff_ffff)),
    (Format::D24_UNORM_S8_UINT, 4, |w| f64::from(w & 0xff_ffff) / f64::from(0xff_ffff)),
    (Format::D16_UNORM, 2, |w| f64::from(w & 0xffff) / 65535.0),
];

const COLOR_LAYOUTS: [Layout; 3] = [ATTACHED, Layout::ATTACHMENT_OPTIMAL, Layout::GENERAL];
const DEPTH_LAYOUTS: [Layout; 5] = [
    Layout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
    Layout::DEPTH_ATTACHMENT_OPTIMAL,
    Layout::DEPTH_ATTACHMENT_STENCIL_READ_ONLY_OPTIMAL,
    Layout::ATTACHMENT_OPTIMAL,
    Layout::GENERAL,
];

/// Each format of depth in each layout in which it can be attached, given and found again in it; a format that the device does not
/// have is said by name.
#[test]
fn each_format_of_depth_in_each_layout() {
    let case = case(ball());
    each_driver(|driver| {
        let gpu = driver.gpu();
        for (format, texel, number) in DEPTHS {
            let color = format == Format::R32_SFLOAT;
            let layouts = if color { &COLOR_LAYOUTS[..] } else { &DEPTH_LAYOUTS };
            for layout in layouts.iter().filter(|l| can_be_in(format, **l)) {
                let label = format!("{}: {format:?} in {layout:?}", driver.name);
                if !has(gpu, format) {
                    let nowhere = <ImageView as ash::vk::Handle>::from_raw(1);
                    let said = refused(driver, &case, |s| s.depth(SurfaceOutput::new(nowhere, format, *layout)));
                    assert!(said.contains(&format!("{format:?} as depth attachment")), "{label}: {said}");
                    continue;
                }
                let depth = image(gpu, format, texel, SIZE, *layout);
                let output = SurfaceOutput::new(depth.view, format, *layout);
                let shot = driver.shoot_with(&case, &|i| i.surface(SurfaceOutputs::default().depth(output)));
                let bytes = depth.read_in(*layout).expect("depths");
                let step = if texel == 2 { 1.0 / 65535.0 } else { 1e-6 };
                let mut shown = 0;
                for (at, first) in bytes.chunks_exact(texel as usize).zip(firsts(&shot)) {
                    let word = at.iter().rev().fold(0, |w, b| w << 8 | u32::from(*b));
                    match first {
                        Some((_, d)) => {
                            let (found, wanted) = (number(word), host_depth(&case.camera, d));
                            assert!((found - wanted).abs() <= step, "{label}: {found} and {wanted}");
                            shown += 1;
                        }
                        None => assert_eq!(number(word), number(u32::from_ne_bytes([BEFORE; 4])), "{label}"),
                    }
                }
                assert!(shown > 400, "{label}: {shown}");
            }
        }
    });
}

/// Whether an image of a format can be in a layout as a whole: one with a stencil is in layouts of its depth alone where the host has
/// enabled `separateDepthStencilLayouts`, which ours does not.
pub fn can_be_in(format: Format, layout: Layout) -> bool {
    let stencil = matches!(format, Format::D24_UNORM_S8_UINT | Format::D32_SFLOAT_S8_UINT | Format::D16_UNORM_S8_UINT);
    !stencil || ![Layout::DEPTH_ATTACHMENT_OPTIMAL, Layout::DEPTH_READ_ONLY_OPTIMAL].contains(&layout)
}

pub fn has(gpu: &Gpu, format: Format) -> bool {
    let host = gpu.host(1);
    // SAFETY: the device's own instance and physical device.
    let found = unsafe { host.instance.get_physical_device_format_properties(host.physical_device, format) };
    let wanted = match format {
        Format::D16_UNORM
        | Format::D16_UNORM_S8_UINT
        | Format::X8_D24_UNORM_PACK32
        | Format::D24_UNORM_S8_UINT
        | Format::D32_SFLOAT
        | Format::D32_SFLOAT_S8_UINT => ash::vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT,
        _ => ash::vk::FormatFeatureFlags::COLOR_ATTACHMENT,
    };
    found.optimal_tiling_features.contains(wanted)
}

/// What a frame with such outputs is refused with.
pub fn refused(driver: &Driver, case: &Case, asked: impl Fn(SurfaceOutputs) -> SurfaceOutputs) -> String {
    driver.give(case);
    let mut session = driver.session.borrow_mut();
    session.resize(case.size).expect("size");
    let input = FrameInput::new(0, &case.camera, &case.settings, ImageView::null());
    session.frame(&input.surface(asked(SurfaceOutputs::default()))).expect_err("refused").to_string()
}

/// Each format of normals in each layout.
#[test]
fn each_format_of_normals_in_each_layout() {
    let case = case(ball());
    let signed = |bits: u32| move |v: i64| (v as f64 / f64::from((1u32 << (bits - 1)) - 1)).max(-1.0);
    let (snorm8, snorm16) = (signed(8), signed(16));
    each_driver(|driver| {
        for layout in COLOR_LAYOUTS {
            for (format, texel, step) in [
                (Format::R32G32B32A32_SFLOAT, 16, 1e-6),
                (Format::R16G16B16A16_SFLOAT, 8, 1e-3),
                (Format::R16G16B16A16_SNORM, 8, 1e-4),
                (Format::R8G8B8A8_SNORM, 4, 9e-3),
                (Format::A2B10G10R10_UNORM_PACK32, 4, 1.1e-3),
                (Format::R16G16B16A16_UNORM, 8, 2e-5),
                (Format::R8G8B8A8_UNORM, 4, 4e-3),
            ] {
                let label = format!("{}: {format:?} in {layout:?}", driver.name);
                // Those of signed numbers a device need not have.
                if !has(driver.gpu(), format) {
                    let nowhere = <ImageView as ash::vk::Handle>::from_raw(1);
                    let said = refused(driver, &case, |s| s.normal(SurfaceOutput::new(nowhere, format, layout)));
                    assert!(said.contains(&format!("{format:?} as colour attachment")), "{label}: {said}");
                    continue;
                }
                let normal = image(driver.gpu(), format, texel, SIZE, layout);
                let output = SurfaceOutput::new(normal.view, format, layout);
                let shot = driver.shoot_with(&case, &|i| i.surface(SurfaceOutputs::default().normal(output)));
                let bytes = normal.read_in(layout).expect("normals");
                let mut shown = 0;
                for (at, first) in bytes.chunks_exact(texel as usize).zip(firsts(&shot)) {
                    let Some((n, _)) = first else {
                        assert!(at.iter().all(|b| *b == BEFORE), "{label}: {at:?}");
                        continue;
                    };
                    let half = |k: usize| u16::from_ne_bytes([at[2 * k], at[2 * k + 1]]);
                    let value = |k: usize| match format {
                        Format::R32G32B32A32_SFLOAT => f64::from(floats(at)[k]),
                        Format::R16G16B16A16_SFLOAT => f16(half(k)),
                        Format::R16G16B16A16_SNORM => snorm16(i64::from(half(k) as i16)),
                        Format::R8G8B8A8_SNORM => snorm8(i64::from(at[k] as i8)),
                        Format::R16G16B16A16_UNORM => f64::from(half(k)) / 65535.0,
                        Format::R8G8B8A8_UNORM => f64::from(at[k]) / 255.0,
                        _ => {
                            let word = u32::from_ne_bytes([at[0], at[1], at[2], at[3]]) >> (10 * k);
                            if k == 3 { f64::from(word) / 3.0 } else { f64::from(word & 1023) / 1023.0 }
                        }
                    };
                    let stored = DVec3::new(value(0), value(1), value(2));
                    let wanted = if format!("{format:?}").contains("UNORM") { halved(n) } else { n };
                    assert!((stored - wanted).abs().max_element() <= step, "{label}: {stored} and {wanted}");
                    assert!((value(3) - 1.0).abs() < 1e-6, "{label}: alpha {}", value(3));
                    shown += 1;
                }
                assert!(shown > 400, "{label}: {shown}");
            }
        }
    });
}

/// A float of 16 bits, none of them an infinity.
pub fn f16(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    let size = if exponent == 0 { fraction * 2f64.powi(-14) } else { (1.0 + fraction) * 2f64.powi(exponent - 15) };
    if bits >> 15 == 1 { -size } else { size }
}

/// Layouts in which nothing can be attached, formats that hold something else, no image.
#[test]
fn what_cannot_be_is_said() {
    let case = case(ball());
    let view = <ImageView as ash::vk::Handle>::from_raw(1);
    each_driver(|driver| {
        let rgba = Format::R8G8B8A8_UNORM;
        for layout in [
            Layout::UNDEFINED,
            Layout::PREINITIALIZED,
            Layout::SHADER_READ_ONLY_OPTIMAL,
            Layout::READ_ONLY_OPTIMAL,
            Layout::TRANSFER_SRC_OPTIMAL,
            Layout::TRANSFER_DST_OPTIMAL,
            Layout::DEPTH_READ_ONLY_OPTIMAL,
            Layout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
            Layout::DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL,
            Layout::PRESENT_SRC_KHR,
        ] {
            let said = refused(driver, &case, |s| s.normal(SurfaceOutput::new(view, rgba, layout)));
            assert!(said.contains(&format!("layout of the surface normal is {layout:?}")), "{said}");
            for format in [Format::R32_SFLOAT, Format::D32_SFLOAT] {
                let said = refused(driver, &case, |s| s.depth(SurfaceOutput::new(view, format, layout)));
                assert!(said.contains(&format!("layout of the surface depth is {layout:?}")), "{said}");
            }
        }
        for (format, layout) in [(Format::R32_SFLOAT, DEPTH_LAYOUTS[1]), (Format::D32_SFLOAT, ATTACHED)] {
            let said = refused(driver, &case, |s| s.depth(SurfaceOutput::new(view, format, layout)));
            assert!(said.contains("layout of the surface depth is"), "{said}");
        }
        for format in [Format::R8_UNORM, Format::S8_UINT, rgba] {
            let said = refused(driver, &case, |s| s.depth(SurfaceOutput::new(view, format, ATTACHED)));
            assert!(said.contains(&format!("format of the surface depth is {format:?}: use R32_SFLOAT")), "{said}");
        }
        for format in [Format::R8G8B8A8_SRGB, Format::R8G8B8A8_UINT, Format::R16G16_SNORM, Format::D32_SFLOAT] {
            let said = refused(driver, &case, |s| s.normal(SurfaceOutput::new(view, format, ATTACHED)));
            assert!(said.contains(&format!("format of the surface normal is {format:?}: use one of")), "{said}");
        }
        let null = ImageView::null();
        let said = refused(driver, &case, |s| s.normal(SurfaceOutput::new(null, rgba, ATTACHED)));
        assert!(said.contains("surface normal is null"), "{said}");
    });
}
