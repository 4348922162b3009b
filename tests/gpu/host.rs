//! The contract with the host: frames in flight, replaced resources, host scenes, output formats.

use crate::support::{Case, Choose, Cloud, Driver, camera, each_driver, imai16, random_cloud, sphere};
use ash::vk::{self, Handle};
use glam::Vec3;
use meniscus::harness::SKY;
use meniscus::{
    Error, FrameInput, Particles, Renderer, SceneInput, SurfaceOutput, SurfaceOutputs,
    host::{Canvas, Gpu, HostError, Upload},
    prepare::{DeviceIds, DevicePositions, Search},
    renderer::Amount,
    twin::optics::srgb_byte,
};

pub const SIZE: [u32; 2] = [96, 72];

pub fn case(particles: Particles) -> Case {
    let eye = Vec3::new(0.0, 0.0, 3.0);
    Case { particles, camera: camera(eye, Vec3::ZERO, SIZE), settings: imai16(), size: SIZE, eye_inside: false }
}

pub fn ball() -> Particles {
    Particles { radius: 0.5, ellipsoids: vec![sphere(Vec3::ZERO, 0.5)], splash_count: 1 }
}

/// A renderer on a device of its own, given to `body`, then destroyed.
pub fn with_renderer(driver: &Driver, format: vk::Format, frames: u32, body: impl FnOnce(&Gpu, &mut Renderer)) {
    let device = driver.instance.pick(Some(&driver.name)).expect("it was there a moment ago");
    let gpu = Gpu::new(driver.instance, device).expect("device");
    // SAFETY: the device outlives the renderer and has the required features.
    let mut renderer = unsafe { Renderer::new(gpu.host(frames), format) }.expect("renderer");
    renderer.resize(SIZE).expect("size");
    // SAFETY: recorded outside rendering, before any frame.
    gpu.run(|cmd| Ok(unsafe { renderer.set_environment(cmd, &SKY) }?)).expect("environment");
    body(&gpu, &mut renderer);
    // SAFETY: every command buffer was waited for.
    unsafe { renderer.destroy() };
}

pub fn input<'a>(case: &'a Case, slot: usize, output: vk::ImageView) -> FrameInput<'a> {
    FrameInput::new(slot, &case.camera, &case.settings, output)
}

/// The picture in a canvas is the expected one. The debug variant that `shoot` draws with is another program, which may
/// round otherwise.
fn assert_shows(canvas: &Canvas, expected: &[[f32; 3]], what: &str) {
    let words = canvas.read().expect("picture");
    let float = |p: &[u8], o: usize| f32::from_ne_bytes([p[o], p[o + 1], p[o + 2], p[o + 3]]);
    let found: Vec<f32> = words.chunks_exact(16).flat_map(|p| [0, 4, 8].map(|o| float(p, o))).collect();
    assert_same(&found, expected, what);
}

fn assert_same(found: &[f32], expected: &[[f32; 3]], what: &str) {
    assert!(found.len() == expected.as_flattened().len() && found.iter().all(|v| v.is_finite()), "{what}");
    let differ = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-3 * a.abs().max(0.1);
    let differ = expected.iter().flatten().zip(found).filter(differ).count();
    assert!(differ * 100 < 3 * expected.len(), "{what}: {differ} values differ");
}

#[test]
fn two_frames_in_flight_from_positions_on_the_device() {
    each_driver(|driver| {
        with_renderer(driver, vk::Format::R32G32B32A32_SFLOAT, 2, |gpu, renderer| {
            let cloud = |i: u64, n: usize| random_cloud(i, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 0, n);
            let canvas = || Canvas::new(gpu, vk::Format::R32G32B32A32_SFLOAT, 16, SIZE).expect("canvas");
            let canvases = [canvas(), canvas()];
            // Two buffers in turns, other particles and another number of them in each; between them a frame without.
            for pair in 0..2u64 {
                let clouds = [cloud(pair, 700), cloud(10 + pair, 200 + 900 * pair as usize)]
                    .map(|c| c.ellipsoids.iter().map(|e| e.center).collect::<Vec<_>>());
                let uploads = clouds.each_ref().map(|c| Upload::new(gpu, bytemuck::cast_slice(c)).expect("upload"));
                let case = case(cloud(20, 30));
                renderer.set_particles(&case.particles).expect("particles");
                gpu.run(|cmd| {
                    for slot in 0..2 {
                        let canvas = &canvases[slot];
                        canvas.transition(cmd, vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
                        let positions = DevicePositions::packed(uploads[slot].buffer, clouds[slot].len() as u32, 0.1);
                        let input = input(&case, slot, canvas.view).positions(positions);
                        // SAFETY: `cmd` is recording outside rendering; the slot's last frame was waited for by `run`.
                        unsafe { renderer.record(cmd, &input) }?;
                    }
                    Ok(())
                })
                .expect("frames");
                for (slot, canvas) in canvases.iter().enumerate() {
                    let alone = driver.shoot_cloud(&case, &Cloud::new(&clouds[slot], Search::Runs));
                    assert_shows(canvas, &alone.picture, &format!("{}: pair {pair}, slot {slot}", driver.name));
                }
            }
        });
    });
}

#[test]
fn two_frames_in_flight_with_everything_replaced_between() {
    each_driver(|driver| {
        with_renderer(driver, vk::Format::R32G32B32A32_SFLOAT, 2, |gpu, renderer| {
            let clouds: Vec<_> = (0..4)
                .map(|i| case(random_cloud(i, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 10 * i as usize, 60)))
                .collect();
            let canvases: Vec<_> =
                (0..2).map(|_| Canvas::new(gpu, vk::Format::R32G32B32A32_SFLOAT, 16, SIZE).expect("canvas")).collect();
            // Both slots of a pair go out in one submission: the second is recorded while the first has not run yet,
            // with other particles, and with settings that need other targets.
            for pair in 0..2 {
                gpu.run(|cmd| {
                    for slot in 0..2 {
                        let mut case = clouds[2 * pair + slot].clone();
                        case.settings = case.settings.refractions([4, 1][slot]).iterations(1 + slot as u32);
                        renderer.set_particles(&case.particles)?;
                        let canvas = &canvases[slot];
                        canvas.transition(cmd, vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
                        // SAFETY: `cmd` is recording outside rendering; the slot's last frame was waited for by `run`.
                        unsafe { renderer.record(cmd, &input(&case, slot, canvas.view)) }?;
                    }
                    Ok(())
                })
                .expect("frames");
                for (slot, canvas) in canvases.iter().enumerate() {
                    let mut alone = clouds[2 * pair + slot].clone();
                    alone.settings = alone.settings.refractions([4, 1][slot]).iterations(1 + slot as u32);
                    assert_shows(canvas, &driver.shoot(&alone).picture, &format!("{}: slot {slot}", driver.name));
                }
                assert!(renderer.times(0).is_some() && renderer.times(1).is_some(), "{}: no times", driver.name);
            }
        });
    });
}

#[test]
fn memory_is_known_before_it_is_allocated() {
    each_driver(|driver| {
        with_renderer(driver, vk::Format::R32G32B32A32_SFLOAT, 1, |gpu, renderer| {
            let case = case(random_cloud(5, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 5, 60));
            let amount = Amount::Prepared { splash: 5, body: 60 };
            let asked = renderer.memory_requirements(SIZE, amount, &case.settings).expect("a valid size");
            renderer.set_particles(&case.particles).expect("particles");
            let canvas = Canvas::new(gpu, vk::Format::R32G32B32A32_SFLOAT, 16, SIZE).expect("canvas");
            gpu.run(|cmd| {
                canvas.transition(cmd, vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
                // SAFETY: as above.
                Ok(unsafe { renderer.record(cmd, &input(&case, 0, canvas.view)) }?)
            })
            .expect("frame");
            let got = renderer.memory();
            for entry in &asked {
                assert!(got.contains(entry), "{}: asked {entry:?}, got {got:?}", driver.name);
            }
            // Beside them only what is extra by its documentation.
            assert_eq!(got.len(), asked.len() + 4, "{}: {got:?}", driver.name);
        });
    });
}

#[test]
fn unorm_outputs_are_encoded_as_srgb() {
    each_driver(|driver| {
        let case = case(ball());
        let linear = driver.shoot(&case).picture;
        with_renderer(driver, vk::Format::R8G8B8A8_UNORM, 1, |gpu, renderer| {
            renderer.set_particles(&case.particles).expect("particles");
            let canvas = Canvas::new(gpu, vk::Format::R8G8B8A8_UNORM, 4, SIZE).expect("canvas");
            gpu.run(|cmd| {
                canvas.transition(cmd, vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
                // SAFETY: as above.
                Ok(unsafe { renderer.record(cmd, &input(&case, 0, canvas.view)) }?)
            })
            .expect("frame");
            let bytes = canvas.read().expect("picture");
            let found = bytes.chunks_exact(4).flat_map(|p| &p[..3]);
            let worse = found.zip(linear.iter().flatten()).filter(|(b, v)| b.abs_diff(srgb_byte(**v)) > 1).count();
            // Pixels on the ball's rim may walk another way in the other program.
            assert!(worse * 500 < linear.len() * 3, "{}: {worse} bytes differ by more than 1", driver.name);
        });
    });
}

#[test]
fn a_host_scene_is_hidden_seen_and_seen_through_the_liquid() {
    const RED: [f32; 4] = [0.9, 0.1, 0.2, 1.0];
    each_driver(|driver| {
        with_renderer(driver, vk::Format::R32G32B32A32_SFLOAT, 1, |gpu, renderer| {
            let case = case(ball());
            renderer.set_particles(&case.particles).expect("particles");
            let canvas = |format, texel| Canvas::new(gpu, format, texel, SIZE).expect("canvas");
            let output = canvas(vk::Format::R32G32B32A32_SFLOAT, 16);
            let color = canvas(vk::Format::R32G32B32A32_SFLOAT, 16);
            let depth = canvas(vk::Format::R32_SFLOAT, 4);
            // A red wall at linear depth d: z = (P22 z_e + P23) / -z_e. The camera's z is 1 infinitely far away.
            let p = case.camera.projection;
            let at = |d: f32| (p.w_axis.z - p.z_axis.z * d) / d;
            let render = |renderer: &mut Renderer, z: f32| {
                gpu.run(|cmd| {
                    let general = vk::ImageLayout::GENERAL;
                    for (canvas, value) in [(&color, RED), (&depth, [z; 4])] {
                        canvas.transition(cmd, vk::ImageLayout::UNDEFINED, general);
                        canvas.clear(cmd, general, value);
                        canvas.transition(cmd, general, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
                    }
                    output.transition(cmd, vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
                    let scene = SceneInput::new(
                        (color.view, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL),
                        (depth.view, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL),
                        1.0,
                    );
                    let input = input(&case, 0, output.view).scene(scene);
                    // SAFETY: as above; the scene was just brought into the stated layout.
                    Ok(unsafe { renderer.record(cmd, &input) }?)
                })
                .expect("frame");
                let bytes = output.read().expect("picture");
                let float = |o: usize| f32::from_ne_bytes([bytes[o], bytes[o + 1], bytes[o + 2], bytes[o + 3]]);
                (0..(SIZE[0] * SIZE[1]) as usize)
                    .map(|i| [float(16 * i), float(16 * i + 4), float(16 * i + 8)])
                    .collect::<Vec<_>>()
            };
            let red = |c: &[f32; 3]| (0..3).all(|k| (c[k] - RED[k]).abs() < 1e-6);
            let middle = (SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2) as usize;
            // Before the ball: the wall is all there is.
            assert!(render(renderer, at(2.0)).iter().all(red), "{}: the wall hides the ball", driver.name);
            // Behind it: the wall around, and through the ball's middle, where a ray goes almost straight, less what
            // two surfaces reflect (2 % each at normal incidence).
            let picture = render(renderer, at(4.0));
            assert!(red(&picture[0]), "{}: the wall beside the ball {:?}", driver.name, picture[0]);
            let c = picture[middle];
            assert!(c[0] > 0.93 * RED[0] && c[0] < 1.05 * RED[0], "{}: through the ball {c:?}", driver.name);
            // Nothing there (cleared depth): the environment, as without a scene, however red the image is.
            let plain = driver.shoot(&case).picture;
            let cleared = render(renderer, 1.0);
            assert_same(cleared.as_flattened(), &plain, &format!("{}: the environment behind nothing", driver.name));
            assert!(!cleared.iter().any(red), "{}: red from nothing", driver.name);
        });
    });
}

#[test]
fn what_the_caller_gets_wrong_is_said() {
    each_driver(|driver| {
        with_renderer(driver, vk::Format::R32G32B32A32_SFLOAT, 1, |gpu, renderer| {
            let case = case(ball());
            assert!(renderer.resize([0, 5]).is_err() && renderer.resize([1 << 20, 5]).is_err());
            let bad = Particles { radius: f32::NAN, ..ball() };
            assert!(renderer.set_particles(&bad).is_err());
            let canvas = Canvas::new(gpu, vk::Format::R32G32B32A32_SFLOAT, 16, SIZE).expect("canvas");
            // SAFETY: refused before anything is recorded.
            let nowhere = unsafe { renderer.record(vk::CommandBuffer::null(), &input(&case, 0, canvas.view)) };
            assert!(nowhere.unwrap_err().to_string().contains("command buffer is null"));
            let mut refused = |input: &FrameInput| {
                gpu.run(|cmd| {
                    // SAFETY: refused before anything is recorded.
                    Ok(unsafe { renderer.record(cmd, input) }.unwrap_err().to_string())
                })
                .expect("an empty command buffer")
            };
            assert!(refused(&input(&case, 7, canvas.view)).contains("slot is 7"));
            let mut skewed = case.clone();
            skewed.camera.view.x_axis *= 2.0;
            assert!(refused(&input(&skewed, 0, canvas.view)).contains("camera view"));
            let mut flat = case.clone();
            flat.camera.near = 0.0;
            assert!(refused(&input(&flat, 0, canvas.view)).contains("near plane"));
            let mut far = case.clone();
            far.camera.view.w_axis.x = 1e30;
            assert!(refused(&input(&far, 0, canvas.view)).contains("particle radii away"));
            assert!(refused(&input(&case, 0, vk::ImageView::null())).contains("output is null"));
            let read = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
            let scene = |color, color_layout, cleared_depth| {
                let scene = SceneInput::new((color, color_layout), (canvas.view, read), cleared_depth);
                input(&case, 0, canvas.view).scene(scene)
            };
            assert!(refused(&scene(vk::ImageView::null(), read, 1.0)).contains("scene colour is null"));
            assert!(
                refused(&scene(canvas.view, vk::ImageLayout::UNDEFINED, 1.0)).contains("scene colour is in UNDEFINED")
            );
            assert!(refused(&scene(canvas.view, read, f32::NAN)).contains("cleared depth is NaN"));
            assert!(
                refused(&scene(canvas.view, read, 1.0)).contains("output is the view that is the scene colour, too")
            );
            let attached = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
            let normal = SurfaceOutput::new(canvas.view, vk::Format::R32G32B32A32_SFLOAT, attached);
            let twice = input(&case, 0, canvas.view).surface(SurfaceOutputs::default().normal(normal));
            assert!(refused(&twice).contains("surface normal is the view that is the output, too"));
            let mut narrow = case.clone();
            narrow.camera.projection.x_axis.x = 1e12;
            assert!(refused(&input(&narrow, 0, canvas.view)).contains("camera projection"));
            // Positions on the device. Nothing is recorded, so their buffer need not be there.
            let positions = DevicePositions::packed(vk::Buffer::null(), 10, 0.1);
            let somewhere = vk::Buffer::from_raw(1);
            let there = DevicePositions::packed(somewhere, 10, 0.1);
            let far_too_many = u32::try_from(u64::from(u32::MAX) / 2).expect("it fits");
            for (wrong, word) in [
                (positions, "buffer of positions is null"),
                (positions.laid_out(6, 12), "offset of positions is 6"),
                (positions.laid_out(u64::MAX - 3, 12), "beyond any buffer"),
                (positions.laid_out(0, 8), "stride of positions is 8"),
                (positions.laid_out(0, 13), "stride of positions is 13"),
                (DevicePositions::packed(positions.buffer, 10, -1.0), "particle radius is -1"),
                (positions.keep_class_below(f32::NAN), "upper splash threshold"),
                (positions.ids(DeviceIds::packed(somewhere, 10).laid_out(6, 4)), "offset of ids is 6"),
                (
                    positions.ids(DeviceIds::packed(somewhere, 10).laid_out(1 << 60, 4)),
                    "offset of ids is 1152921504606846976: offset and stride",
                ),
                (positions.ids(DeviceIds::packed(somewhere, 10).laid_out(0, 0)), "stride of ids is 0"),
                (positions.ids(DeviceIds::packed(somewhere, 10).laid_out(0, 7)), "stride of ids is 7"),
                (positions.ids(DeviceIds::packed(somewhere, 0)), "number of ids is 0"),
                (there.ids(DeviceIds::packed(vk::Buffer::null(), 10)), "buffer of ids is null"),
                (
                    there.keep_class_below(0.6).ids(DeviceIds::packed(somewhere, u32::MAX)),
                    "last classes would take 17179869180 bytes",
                ),
                (DevicePositions::packed(positions.buffer, far_too_many, 0.1), "particles is 2147483647"),
            ] {
                let input = input(&case, 0, canvas.view).positions(wrong);
                let said = refused(&input);
                assert!(said.contains(word), "{said}");
            }
            // Four gigabytes are more than most CPU drivers say they have: refused before anything is made.
            if gpu.info.memory < 4 << 30 {
                renderer.resize([8192, 8192]).expect("a size that images have");
                let both = random_cloud(1, 0.1, Vec3::splat(-0.5), Vec3::splat(0.5), 5, 30);
                renderer.set_particles(&both).expect("particles");
                let before = renderer.memory().len();
                let short = gpu.run(|cmd| {
                    // SAFETY: refused before anything is recorded.
                    Ok(unsafe { renderer.record(cmd, &input(&case, 0, canvas.view)) }.unwrap_err())
                });
                match short.expect("an empty command buffer") {
                    Error::MemoryShort { needed, available, missing } => {
                        assert!(needed == available + missing && missing > 0 && renderer.memory().len() == before);
                        assert_eq!(available, gpu.info.memory, "{}", driver.name);
                    }
                    other => panic!("{}: {other}", driver.name),
                }
            }
            // SAFETY: a new renderer on the same device; refused or destroyed at once.
            let other = unsafe { Renderer::new(gpu.host(1), vk::Format::R32G32_UINT) };
            assert!(other.err().expect("no colour attachment").to_string().contains("R32G32_UINT"));
        });
    });
}

/// Frames that are recorded and thrown away, between frames that run, with everything kept from frame to frame.
#[test]
fn frames_that_never_run_leave_no_trace() {
    each_driver(|driver| {
        with_renderer(driver, vk::Format::R32G32B32A32_SFLOAT, 2, |gpu, renderer| {
            let cloud = random_cloud(2, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 0, 700);
            let positions: Vec<Vec3> = cloud.ellipsoids.iter().map(|e| e.center).collect();
            let upload = Upload::new(gpu, bytemuck::cast_slice(&positions)).expect("upload");
            let case = case(cloud);
            let canvas = Canvas::new(gpu, vk::Format::R32G32B32A32_SFLOAT, 16, SIZE).expect("canvas");
            let packed = DevicePositions::packed(upload.buffer, positions.len() as u32, 0.1);
            let kept = packed.keep_class_below(0.6);
            let mut pictures = Vec::new();
            for (slot, runs) in [(0, true), (1, false), (0, true), (1, true), (0, false), (1, false), (0, true)] {
                let done = gpu.run(|cmd| {
                    canvas.transition(cmd, vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
                    let input = input(&case, slot, canvas.view).positions(kept);
                    // SAFETY: `cmd` is recording outside rendering; the slot's last frame was waited for, or abandoned.
                    unsafe { renderer.record(cmd, &input) }?;
                    // An error makes `run` throw the command buffer away.
                    if runs { Ok(()) } else { Err(HostError::Renderer(Error::Order("thrown away"))) }
                });
                assert_eq!(done.is_ok(), runs, "{}: {done:?}", driver.name);
                if runs {
                    assert!(renderer.times(slot).is_some(), "{}: no times", driver.name);
                    pictures.push(canvas.read().expect("picture"));
                } else {
                    renderer.abandon(slot);
                    assert!(renderer.times(slot).is_none(), "{}: times of nothing", driver.name);
                }
            }
            assert!(pictures.windows(2).all(|p| p[0] == p[1]), "{}: other pictures", driver.name);
        });
    });
}
