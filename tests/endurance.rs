//! What a long run costs: memory stays flat and no frame compiles anything, on each driver, over hundreds of frames. A
//! binary of its own, because it watches the memory of the whole process.

use glam::Vec3;
use meniscus::{
    Camera, Equirect, FrameInput, Settings,
    host::{Gpu, Instance, Session, Upload},
    prepare::{self, DevicePositions},
};
use std::time::Instant;

/// Resident memory of this process in bytes.
fn resident() -> u64 {
    let text = std::fs::read_to_string("/proc/self/statm").expect("Linux");
    4096 * text.split(' ').nth(1).and_then(|w| w.parse::<u64>().ok()).expect("pages")
}

fn ball(radius: f32) -> Vec<Vec3> {
    let axis = || (-5..=5).map(|i| 2.0 * radius * i as f32);
    let lattice = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x, y, z))));
    lattice.filter(|p| p.length() < 11.0 * radius).collect()
}

#[test]
fn memory_and_time_stay_flat() {
    let names: Vec<_> = Instance::new(false).and_then(|i| i.devices()).expect("a loader");
    for d in names.into_iter().filter(|d| d.refusal.is_none()) {
        let instance = Instance::new(false).expect("instance");
        let gpu = Gpu::new(&instance, instance.pick(Some(&d.name)).expect("device")).expect("device");
        let positions = ball(0.05);
        for (refractions, iterations, on_device, inside) in [
            (1, 0, false, false),
            (1, 2, false, false),
            (2, 0, false, false),
            (4, 0, false, false),
            (4, 2, false, false),
            (4, 2, true, false),
            (4, 0, false, true),
        ] {
            let size = [16, 12];
            let mut session = Session::new(&gpu, size, &Equirect::new(2, 1, &[[0.5; 3]; 2]).unwrap()).expect("session");
            let settings = Settings { refractions, iterations, ..Settings::default() };
            let camera = Camera::look_at(Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO, Vec3::Y, 0.7, 4.0 / 3.0, 0.01);
            let input = prepare::Input { positions: &positions, radius: 0.05, classes: None, ellipsoids: None };
            session.renderer.set_particles(&prepare::prepare(&input, &Default::default()).unwrap().0).unwrap();
            let upload = Upload::new(&gpu, bytemuck::cast_slice(&positions)).unwrap();
            let mut first = 0;
            let mut start = Instant::now();
            for frame in 0..300 {
                if frame == 100 {
                    first = resident();
                    start = Instant::now();
                }
                let positions = on_device.then(|| DevicePositions::packed(upload.buffer, positions.len() as u32, 0.05));
                session
                    .frame(&FrameInput {
                        eye_inside: inside,
                        positions,
                        ..FrameInput::new(0, &camera, &settings, ash::vk::ImageView::null())
                    })
                    .unwrap();
            }
            let ms = start.elapsed().as_secs_f64() * 1e3 / 200.0;
            println!(
                "{} r{refractions} i{iterations} dev {on_device} inside {inside}: {:.1} kB a frame, {ms:.2} ms a frame",
                d.driver,
                (resident() as f64 - first as f64) / 200.0 / 1e3
            );
            session.end();
        }
    }
}
