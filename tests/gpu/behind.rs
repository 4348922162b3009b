//! What is seen past the liquid: the background at pixels without any, against the twin.

use crate::{
    background::{HostScene, painted},
    host::{self, with_renderer},
    support::{Choose, Random, Shot, each_driver, imai16, random_cloud},
};
use ash::vk;
use glam::{Mat3, Vec3};
use meniscus::{
    Background, Camera, Equirect, FrameInput, host::Canvas, shader::OUTCOME_NO_LIQUID, twin::background::env_color,
};

const FLOAT4: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const WRITTEN: vk::ImageLayout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;

/// A map of few texels of any colour: what lies beside, above and around the corner of each is another one, as it is at the
/// seam and around the poles.
#[test]
fn coarse_maps_are_seen_as_the_twin_sees_them() {
    let mut random = Random(3);
    let texels: Vec<[f32; 3]> =
        (0..16 * 8).map(|_| random.point(Vec3::splat(0.1), Vec3::splat(3.0)).to_array()).collect();
    let map = Equirect::new(16, 8, &texels).expect("a map");
    each_driver(|driver| {
        with_renderer(driver, FLOAT4, 1, |gpu, renderer| {
            // SAFETY: recorded outside rendering; no frame is in flight.
            gpu.run(|cmd| Ok(unsafe { renderer.set_environment(cmd, &map) }?)).expect("environment");
            let output = Canvas::new(gpu, FLOAT4, 16, host::SIZE).expect("canvas");
            for target in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
                let up = if target.y == 0.0 { Vec3::Y } else { Vec3::Z };
                let aspect = host::SIZE[0] as f32 / host::SIZE[1] as f32;
                let mut camera = Camera::look_at(Vec3::ZERO, target, up, 2.0, aspect, 0.1);
                camera.up = Vec3::Y;
                let settings = imai16();
                let input = FrameInput::new(0, &camera, &settings, output.view);
                gpu.run(|cmd| {
                    output.transition(cmd, vk::ImageLayout::UNDEFINED, WRITTEN);
                    // SAFETY: `cmd` is recording outside rendering; the output was just brought into the stated layout.
                    Ok(unsafe { renderer.record(cmd, &input) }?)
                })
                .expect("frame");
                let floats: Vec<f32> = bytemuck::pod_collect_to_vec(&output.read().expect("picture"));
                let to_world = Mat3::from_mat4(camera.view).transpose().as_dmat3();
                let p = camera.projection.as_dmat4();
                let mut worst = 0f32;
                for (i, pixel) in floats.chunks_exact(4).enumerate() {
                    let at = |v: usize, size: u32| (v as f64 + 0.5) / f64::from(size) * 2.0 - 1.0;
                    let width = host::SIZE[0] as usize;
                    let (x, y) = (at(i % width, host::SIZE[0]), at(i / width, host::SIZE[1]));
                    let ray = glam::DVec3::new(x / p.x_axis.x, y / p.y_axis.y, -1.0).normalize();
                    let off = Vec3::new(pixel[0], pixel[1], pixel[2]) - env_color(&map, to_world * ray);
                    // `max` would drop what is no number.
                    assert!(off.is_finite(), "{}: towards {target}: pixel {i} is {pixel:?}", driver.name);
                    worst = worst.max(off.abs().max_element());
                }
                println!("{}: towards {target}: {worst} off at most", driver.name);
                // atan and acos are off by up to 1e-4, of texels 0.4 wide and up to 2.9 brighter than the next.
                assert!(worst <= 2e-3, "{}: towards {target}: {worst} off", driver.name);
            }
        });
    });
}

/// Beside the liquid, and where something stands before it, a pixel has the very colour that the host gave it; or the
/// environment's where the host drew nothing. With the host's background it is not touched at all.
#[test]
fn the_hosts_scene_is_copied_where_there_is_no_liquid() {
    const BEFORE: [f32; 4] = [0.25, 0.5, 0.75, 0.125];
    let mut case = host::case(random_cloud(6, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 20, 300));
    case.settings = case.settings.refractions(2);
    // Strips: before all of the liquid, behind it, and nothing.
    let strips = |x: u32, _: u32| [1.5, 6.0, f64::INFINITY][(x / 4 % 3) as usize];
    let scene = painted(host::SIZE, strips);
    each_driver(|driver| {
        let images = HostScene::new(driver.gpu(), &case.camera, host::SIZE, &scene);
        let shot = driver.shoot_before(&case, images.input(), Background::Environment);
        let clear = driver.shoot(&case);
        let pattern = |shot: &Shot, i: usize| shot.floats("walk (debug)", 0).expect("debug")[4 * i + 1] as u32;
        let (mut copied, mut hidden, mut sky) = (0, 0, 0);
        let dry: Vec<bool> = (0..scene.0.len()).map(|i| pattern(&shot, i) == OUTCOME_NO_LIQUID).collect();
        for (i, dry) in dry.iter().enumerate() {
            let liquid = pattern(&clear, i) != OUTCOME_NO_LIQUID;
            assert_eq!(*dry, !liquid || scene.0[i] == 1.5, "{}: pixel {i}", driver.name);
            if *dry && scene.0[i].is_finite() {
                assert_eq!(shot.picture[i], scene.1[i].to_array(), "{}: pixel {i}", driver.name);
                copied += 1;
                hidden += usize::from(liquid);
            } else if *dry {
                let off = (Vec3::from(shot.picture[i]) - Vec3::from(clear.picture[i])).abs().max_element();
                assert!(off <= 1e-5, "{}: pixel {i} is {off} off the environment", driver.name);
                sky += 1;
            }
        }
        println!("{}: {copied} copied, {hidden} of them hide liquid, {sky} of the sky", driver.name);
        assert!(copied > 1000 && hidden > 200 && sky > 500, "{}: {copied}, {hidden}, {sky}", driver.name);
        with_renderer(driver, FLOAT4, 1, |gpu, renderer| {
            let images = HostScene::new(gpu, &case.camera, host::SIZE, &scene);
            renderer.set_particles(&case.particles).expect("particles");
            let output = Canvas::new(gpu, FLOAT4, 16, host::SIZE).expect("canvas");
            output.write(bytemuck::cast_slice(&BEFORE.repeat(dry.len())), WRITTEN).expect("written");
            let input = host::input(&case, 0, output.view);
            let input = input.scene(images.input()).background(Background::Host);
            // SAFETY: `cmd` is recording outside rendering; the output was just brought into the stated layout.
            gpu.run(|cmd| Ok(unsafe { renderer.record(cmd, &input) }?)).expect("frame");
            let floats: Vec<f32> = bytemuck::pod_collect_to_vec(&output.read().expect("picture"));
            for (i, (pixel, dry)) in floats.chunks_exact(4).zip(&dry).enumerate() {
                assert_eq!(pixel == BEFORE, *dry, "{}: pixel {i}: {pixel:?}", driver.name);
                assert!(*dry || pixel[3] == 1.0, "{}: coverage of pixel {i}: {pixel:?}", driver.name);
            }
        });
    });
}
