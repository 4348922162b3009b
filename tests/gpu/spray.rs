//! Spray (Cords08 section 4): the velocity map against the ray-casting twin, and the picture that it whitens.

use crate::{
    half::{case, liquid, maps, settings, shade},
    host,
    splat::packed,
    support::{Cloud, Driver, Random, camera, each_driver, random_cloud},
};
use glam::{DVec2, Vec3};
use meniscus::{
    FrameInput, Particles, inspect,
    optics::instant_liquids::InstantLiquids,
    prepare::{DevicePositions, Search},
    shader::{CLASS_BODY, CLASS_SPLASH, SIDE_FRONT},
    twin::{
        normal::decode_normal,
        splat::splat,
        upsample::{Upsampled, upsample},
    },
};

const SIZE: [u32; 2] = [75, 53];

/// A speed for each particle, from 0 to 3.
fn speeds(particles: &Particles) -> Vec<f32> {
    let mut random = Random(7);
    particles.ellipsoids.iter().map(|_| random.between(0.0, 3.0)).collect()
}

/// Droplets and a body, one among the other.
#[test]
fn a_pixel_has_the_speed_of_the_particle_it_shows() {
    let particles = random_cloud(11, 0.12, Vec3::new(-0.9, -0.6, -0.9), Vec3::new(0.9, 0.6, 0.9), 60, 200);
    let speeds = speeds(&particles);
    let all = [packed(&particles, CLASS_SPLASH), packed(&particles, CLASS_BODY)].concat();
    each_driver(|driver| {
        for (half, quads) in [(false, false), (true, false), (false, true)] {
            let mut settings = settings(InstantLiquids::default().spray(0.5).half_resolution(half), None);
            settings.drawing.quads_only = quads;
            let shot = driver.shoot_moving(&case(particles.clone(), SIZE, settings), &speeds);
            let frame = if half { inspect::half(&shot.frame) } else { shot.frame };
            let found = shot.floats("speed", 0).expect("a velocity map");
            let want = splat(&frame, &all, &vec![3; all.len()], SIDE_FRONT);
            assert_eq!(found.len(), want.len());
            let (mut compared, mut moving) = (0, 0);
            for (i, (found, want)) in found.iter().zip(&want).enumerate() {
                // Where float32 may decide which of two particles is in front, or whether it is there.
                if want.margin < 1e-2 || want.silhouette < 5e-3 {
                    continue;
                }
                let want = speeds.get(want.particle).copied().unwrap_or(0.0);
                assert_eq!(*found, want, "{}: half {half}, quads {quads}: pixel {i}", driver.name);
                compared += 1;
                moving += usize::from(want > 0.0);
            }
            assert!(
                compared * 10 > found.len() * 8 && moving * 8 > found.len(),
                "{}: {compared}, {moving}",
                driver.name
            );
        }
    });
}

#[test]
fn fast_liquid_turns_white_as_the_twin_says() {
    let particles = liquid();
    let speeds = speeds(&particles);
    each_driver(|driver| {
        for half in [false, true] {
            let optics = InstantLiquids::default().half_resolution(half).spray(0.8).spray_speed(2.0);
            let case = case(particles.clone(), SIZE, settings(optics, None));
            let shot = driver.shoot_moving(&case, &speeds);
            let ((depth, normal), speed) = (maps(driver, &shot), shot.floats("speed", 0).expect("a velocity map"));
            let light = case.camera.view.transform_vector3(optics.light.normalize());
            let (mut off, mut white) = (0, 0);
            for (i, found) in shot.picture.iter().enumerate() {
                let pixel = DVec2::new((i as u32 % SIZE[0]) as f64 + 0.5, (i as u32 / SIZE[0]) as f64 + 0.5);
                let surface = if half {
                    upsample(&inspect::half(&shot.frame), &depth, &normal, &speed, pixel)
                } else {
                    let (depth, normal) = (f64::from(depth[i]), decode_normal(normal[i]).as_dvec3());
                    Upsampled { depth, normal, coverage: 1.0, speed: speed[i].into() }
                };
                let want = shade(&shot, &optics, light, pixel, &surface);
                off += usize::from(((Vec3::from(*found) - want).abs() / (1.0 + want)).max_element() > 8e-3);
                white += usize::from(surface.depth > 0.0 && surface.speed > 1.0);
            }
            println!("{}: half {half}: {off} off, {white} moving", driver.name);
            assert!(off * 500 <= shot.picture.len() && white > 200, "{}: half {half}: {off}, {white}", driver.name);
        }
    });
}

/// What a frame is refused with.
fn refused(driver: &Driver, change: &dyn for<'b> Fn(FrameInput<'b>) -> FrameInput<'b>) -> String {
    let session = &mut *driver.session.borrow_mut();
    let settings = settings(InstantLiquids::default().spray(0.5), None);
    let camera = camera(Vec3::new(0.4, 0.9, 2.2), Vec3::ZERO, SIZE);
    session.resize(SIZE).expect("size");
    let input = FrameInput::new(0, &camera, &settings, ash::vk::ImageView::null());
    session.frame(&change(input)).err().map(|e| e.to_string()).unwrap_or_default()
}

#[test]
fn spray_without_velocities_is_refused() {
    let ball = host::ball();
    each_driver(|driver| {
        let with = |particles: &Particles, speeds: Option<&[f32]>| {
            let renderer = &mut driver.session.borrow_mut().renderer;
            renderer.set_particles(particles).expect("particles");
            speeds.map(|s| renderer.set_speeds(s)).transpose().err().map(|e| e.to_string()).unwrap_or_default()
        };
        let still = vec![0.5; ball.ellipsoids.len()];
        assert_eq!(with(&ball, Some(&still)), "");
        assert_eq!(refused(driver, &|input| input), "");
        // They went with the particles that they were of.
        with(&ball, None);
        let text = refused(driver, &|input| input);
        assert!(text.contains("spray") && text.contains("velocities"), "{}: {text}", driver.name);
        for bad in [vec![], vec![0.5; still.len() + 1], vec![f32::NAN; still.len()], vec![-1.0; still.len()]] {
            assert!(with(&ball, Some(&bad)).contains("speeds"), "{}: {bad:?}", driver.name);
        }
        // Without particles there is nothing to whiten.
        with(&Particles { ellipsoids: Vec::new(), splash_count: 0, ..ball.clone() }, None);
        assert_eq!(refused(driver, &|input| input), "");
        let positions = DevicePositions::packed(ash::vk::Buffer::null(), 5, 0.1);
        let text = refused(driver, &|input| input.positions(positions));
        assert!(text.contains("device") && text.contains("velocities"), "{}: {text}", driver.name);
        // Without spray no velocity map is drawn.
        let shot = driver.shoot_cloud(
            &case(liquid(), SIZE, settings(InstantLiquids::default(), None)),
            &Cloud::new(&[Vec3::ZERO, Vec3::X], Search::Runs),
        );
        assert!(shot.floats("speed", 0).is_none(), "{}", driver.name);
    });
}
