//! The renderer's own environment map, packed and unpacked, against the twin: all around, at the seam and the poles, and
//! light of any strength.

use crate::{
    host::with_renderer,
    support::{Random, each_driver},
};
use ash::vk;
use glam::{DMat3, DVec3, Mat3, Vec3};
use meniscus::{Camera, Equirect, FrameInput, Settings, host::Canvas, twin::background::env_color};

const FLOAT4: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
/// Odd: the pixel in the middle looks straight up, and straight down.
const SIZE: [u32; 2] = [65, 49];
/// How far the angles of a direction may be off.
const ANGLE: f64 = 2e-5;

/// Colours of a part of the range each, from one column to the next, and within a texel.
fn map(width: u32, height: u32) -> Equirect {
    let mut random = Random(11);
    let texel = |i: u32| {
        let strength = 10f32.powi((i % width) as i32 % 13 - 6);
        (strength * random.point(Vec3::splat(0.01), Vec3::ONE)).to_array()
    };
    Equirect::new(width, height, &(0..width * height).map(texel).collect::<Vec<_>>()).expect("a map")
}

#[test]
fn light_of_any_strength_is_seen_as_the_twin_sees_it() {
    let maps = [map(26, 13), map(1, 1), map(7, 3)];
    each_driver(|driver| {
        with_renderer(driver, FLOAT4, 1, |gpu, renderer| {
            renderer.resize(SIZE).expect("size");
            let output = Canvas::new(gpu, FLOAT4, 16, SIZE).expect("canvas");
            for map in &maps {
                // SAFETY: recorded outside rendering; no frame is in flight.
                gpu.run(|cmd| Ok(unsafe { renderer.set_environment(cmd, map) }?)).expect("environment");
                let (mut worst, mut poles) = (0f64, 0);
                for target in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
                    let up = if target.y == 0.0 { Vec3::Y } else { Vec3::Z };
                    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
                    let mut camera = Camera::look_at(Vec3::ZERO, target, up, 2.0, aspect, 0.1);
                    camera.up = Vec3::Y;
                    let settings = Settings::default();
                    let input = FrameInput::new(0, &camera, &settings, output.view);
                    gpu.run(|cmd| {
                        let written = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
                        output.transition(cmd, vk::ImageLayout::UNDEFINED, written);
                        // SAFETY: `cmd` is recording outside rendering; the output was just brought into this layout.
                        Ok(unsafe { renderer.record(cmd, &input) }?)
                    })
                    .expect("frame");
                    let floats: Vec<f32> = bytemuck::pod_collect_to_vec(&output.read().expect("picture"));
                    let to_world = Mat3::from_mat4(camera.view).transpose().as_dmat3();
                    for (i, pixel) in floats.as_chunks::<4>().0.iter().enumerate() {
                        let dir = to_world * ray(&camera, i);
                        if dir.x.hypot(dir.z) < 1e-5 {
                            // At the pole all columns meet.
                            let held = pixel[..3].iter().all(|v| *v > 0.0 && *v <= 1.01 * map.largest());
                            assert!(held, "{}: {target}: {pixel:?}", driver.name);
                            poles += 1;
                            continue;
                        }
                        let [want, room] = around(map, dir);
                        for k in 0..3 {
                            let off = (f64::from(pixel[k]) - want[k]).abs();
                            let most = 1.1 * room[k] + 2e-6 * want[k];
                            // Not `off > most`: that is false of what is no number.
                            assert!(off <= most, "{}: {target}, pixel {i}: {pixel:?}, not {want}", driver.name);
                            worst = worst.max(off / want[k].max(1e-12));
                        }
                    }
                }
                assert_eq!(poles, 2, "{}", driver.name);
                println!("{}: {:?}: {worst} of the light off at most", driver.name, map.size());
            }
        });
    });
}

fn ray(camera: &Camera, i: usize) -> DVec3 {
    let p = camera.projection.as_dmat4();
    let at = |v: usize, size: u32| (v as f64 + 0.5) / f64::from(size) * 2.0 - 1.0;
    let (x, y) = (at(i % SIZE[0] as usize, SIZE[0]), at(i / SIZE[0] as usize, SIZE[1]));
    DVec3::new(x / p.x_axis.x, y / p.y_axis.y, -1.0).normalize()
}

/// The twin's light from a direction, and how much it changes as far around as angles may be off: near a pole, where rounding
/// leaves little of the way to it, further.
fn around(map: &Equirect, dir: DVec3) -> [DVec3; 2] {
    let seen = |dir| env_color(map, dir).as_dvec3();
    let middle = seen(dir);
    let flat = dir.x.hypot(dir.z);
    let down = ANGLE + (1e-7 / flat.max(1e-9)).min(5e-4);
    let turn = ANGLE + 3e-7 / flat.max(1e-9);
    let axis = if flat > 0.0 { DVec3::new(dir.z, 0.0, -dir.x) / flat } else { DVec3::X };
    let mut room = DVec3::ZERO;
    for turned in [
        DMat3::from_axis_angle(axis, down) * dir,
        DMat3::from_axis_angle(axis, -down) * dir,
        DMat3::from_rotation_y(turn) * dir,
        DMat3::from_rotation_y(-turn) * dir,
    ] {
        room += (seen(turned) - middle).abs();
    }
    [middle, room]
}
