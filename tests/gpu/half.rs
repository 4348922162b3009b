//! Surfaces at half the picture's resolution (Cords08 section 5): the maps, and the picture that is upsampled from them.

use crate::{
    background::{HostScene, painted},
    support::{Case, Cloud, Driver, SKY, Shot, camera, each_driver, lattice, random_cloud},
};
use glam::{DVec2, DVec3, Mat3, Vec3};
use meniscus::{
    Background, Method, Particles, Settings, inspect,
    optics::instant_liquids::InstantLiquids,
    prepare::Search,
    renderer::Amount,
    smooth::Smooth,
    twin::{
        background::env_color,
        optics::{fresnel, reflect, refract, spray},
        upsample::{Upsampled, upsample},
    },
};

/// Cords08's method with these optics.
pub fn settings(optics: InstantLiquids, smooth: Option<Smooth>) -> Settings {
    let mut method = Method::preset("cords08").expect("a preset");
    method.optics = optics.into();
    method.smooth = smooth.unwrap_or(method.smooth);
    Settings::from(method)
}

pub fn case(particles: Particles, size: [u32; 2], settings: Settings) -> Case {
    Case { particles, camera: camera(Vec3::new(0.4, 0.9, 2.2), Vec3::ZERO, size), settings, size, eye_inside: false }
}

/// Two blocks, the nearer before the other, and a cloud: slopes, jumps and silhouettes.
pub fn liquid() -> Particles {
    let mut particles = random_cloud(4, 0.1, Vec3::new(-0.9, -0.6, -0.9), Vec3::new(0.9, 0.1, 0.3), 0, 600);
    particles.ellipsoids.extend(lattice(Vec3::new(0.3, 0.2, 0.9), 0.08, [4, 5, 2]));
    particles
}

/// What the frame's own maps hold: depths and normals of the nearest front, as light meets it.
pub fn maps(driver: &Driver, shot: &Shot) -> (Vec<f32>, Vec<u32>) {
    let names = driver.session.borrow().renderer.surfaces();
    let depth = shot.floats(names.body_depth.expect("a body"), 0).expect("depths");
    (depth, shot.words(names.body_normal.expect("a body"), 0).expect("normals").to_vec())
}

/// Every target of surfaces and every counter.
fn assert_same(label: &str, half: &Shot, own: &Shot) {
    for name in ["splat depth test", "body depth (ray-cast)", "body normal (ray-cast)", "body depth (smoothed, odd)"] {
        assert_eq!(half.words(name, 0), own.words(name, 0), "{label}: {name}");
    }
    for name in ["body depth (smoothed, even)", "body normal (smoothed)", "visible particles", "body depth bounds"] {
        assert_eq!(half.words(name, 0), own.words(name, 0), "{label}: {name}");
    }
    for name in ["splash_drawn_front", "body_drawn_front"] {
        assert_eq!(half.counter(name), own.counter(name), "{label}: {name}");
    }
}

/// Of an even size they are, bit for bit, those of a picture half as large: cull, draw and every filter look at one view.
#[test]
fn maps_are_those_of_a_picture_half_as_large() {
    let (size, halved) = ([150, 106], [75, 53]);
    each_driver(|driver| {
        for smooth in Smooth::all() {
            let optics = InstantLiquids::default();
            let half = case(liquid(), size, settings(optics.half_resolution(true), Some(smooth)));
            // The camera stays: its projection knows the picture's shape.
            let own = Case { size: halved, settings: settings(optics, Some(smooth)), ..half.clone() };
            let (half, own) = (driver.shoot(&half), driver.shoot(&own));
            assert_same(&format!("{}: {}", driver.name, smooth.name()), &half, &own);
            assert!(own.counter("body_drawn_front") > 60, "{}: nothing to compare", driver.name);
        }
    });
}

/// The device completes the block of either scale where it prepares the particles.
#[test]
fn particles_prepared_on_the_device_are_drawn_at_half_resolution() {
    let (size, halved) = ([150, 106], [75, 53]);
    let positions: Vec<Vec3> = liquid().ellipsoids.iter().map(|e| e.center).collect();
    each_driver(|driver| {
        let optics = InstantLiquids::default();
        let half = case(liquid(), size, settings(optics.half_resolution(true), None));
        let own = Case { size: halved, settings: settings(optics, None), ..half.clone() };
        let full = Case { settings: settings(optics, None), ..half.clone() };
        let cloud = Cloud::new(&positions, Search::Runs);
        let shots = [&half, &own, &full].map(|case| driver.shoot_cloud(case, &cloud));
        assert_same(&driver.name, &shots[0], &shots[1]);
        // The picture is looked up through the block of the other scale: where the maps say nothing else, it is the same.
        let (depth, _) = maps(driver, &shots[2]);
        let empty = |i: usize| depth[i] == 0.0 && shots[0].picture[i] == shots[2].picture[i];
        let same = (0..depth.len()).filter(|i| empty(*i)).count();
        let bare = depth.iter().filter(|d| **d == 0.0).count();
        assert!(same > bare * 9 / 10 && bare > 2000, "{}: {same} of {bare}", driver.name);
    });
}

/// The colour of a pixel whose surface is given, before the environment alone.
pub fn shade(shot: &Shot, optics: &InstantLiquids, light: Vec3, pixel: DVec2, surface: &Upsampled) -> Vec3 {
    let f = &shot.frame;
    let to_env = Mat3::from_mat4(f.eye_to_env).as_dmat3();
    let ray = |p: DVec2| ((p - f.pixel_origin.as_dvec2()) / f.pixel_scale.as_dvec2()).extend(-1.0).normalize();
    let far = |dir: DVec3| env_color(&SKY, to_env * dir);
    let behind = far(ray(pixel));
    if surface.depth <= 0.0 {
        return behind;
    }
    let (dir, mut n) = (ray(pixel).as_vec3(), surface.normal.as_vec3());
    if dir.dot(n) > 0.0 {
        n = -n;
    }
    let bent = refract(dir, n, 1.0 / f.ior).expect("into water");
    let offset = optics.strength * bent.truncate() * f.pixel_scale.signum() * f.size;
    let reflectance = fresnel(-dir.dot(n), -bent.dot(n), f.ior, true);
    let mirrored = reflect(dir, n);
    let mut color = far(ray(pixel + offset.as_dvec2())).lerp(far(mirrored.as_dvec3()), reflectance);
    let (facing, mirror) = (light.dot(n), mirrored.dot(light));
    color += optics.diffuse * facing.max(0.0);
    if facing > 0.0 && mirror > 0.0 {
        color += optics.specular * mirror.powf(optics.shininess);
    }
    color = spray(color, surface.speed as f32, optics.spray, optics.spray_speed);
    behind.lerp(color, surface.coverage as f32)
}

#[test]
fn the_picture_is_the_twins() {
    let optics = InstantLiquids::default().half_resolution(true).diffuse(0.2).shininess(8.0);
    each_driver(|driver| {
        // Odd and even sizes, and pictures of hardly a pixel.
        for size in [[75, 53], [98, 64], [3, 2], [1, 1]] {
            let case = case(liquid(), size, settings(optics, None));
            let shot = driver.shoot(&case);
            let ((depth, normal), half) = (maps(driver, &shot), inspect::half(&shot.frame));
            assert_eq!(depth.len() as u32, size[0].div_ceil(2) * size[1].div_ceil(2));
            let light = case.camera.view.transform_vector3(optics.light.normalize());
            let (mut off, mut edges, mut covered) = (0, 0, 0);
            for (i, found) in shot.picture.iter().enumerate() {
                let pixel = DVec2::new((i as u32 % size[0]) as f64 + 0.5, (i as u32 / size[0]) as f64 + 0.5);
                let surface = upsample(&half, &depth, &normal, &[], pixel);
                let want = shade(&shot, &optics, light, pixel, &surface);
                // Drivers compute arc tangents of the sky's directions to 2e-4 or so: 4e-3 of its clouds.
                let error = (Vec3::from(*found) - want).abs() / (1.0 + want);
                off += usize::from(error.max_element() > 8e-3);
                covered += usize::from(surface.coverage == 1.0);
                edges += usize::from(surface.coverage > 0.0 && surface.coverage < 1.0);
            }
            println!("{}: {size:?}: {off} off; {covered} covered, {edges} at edges", driver.name);
            assert!(off * 500 <= shot.picture.len(), "{}: {size:?}: {off}", driver.name);
            assert!(size[0] < 50 || (covered > 300 && edges > 100), "{}: {covered}, {edges}", driver.name);
        }
    });
}

/// The scene hides liquid pixel by pixel of the picture; over the host's picture a pixel is the liquid's or not.
#[test]
fn before_a_scene_and_over_the_hosts_picture() {
    let size = [75, 53];
    each_driver(|driver| {
        let case = case(liquid(), size, settings(InstantLiquids::default().half_resolution(true), None));
        // Its edge lies in the middle of a pixel of the maps.
        let painted = painted(size, |x, _| if x < 37 { 0.5 } else { f64::INFINITY });
        let scene = HostScene::new(driver.gpu(), &case.camera, size, &painted);
        for background in [Background::Environment, Background::Host] {
            let shot = driver.shoot_before(&case, scene.input(), background);
            let ((depth, normal), half) = (maps(driver, &shot), inspect::half(&shot.frame));
            let (mut hidden, mut shown) = (0, 0);
            for (i, found) in shot.picture.iter().enumerate() {
                let (x, y) = (i as u32 % size[0], i as u32 / size[0]);
                let surface = upsample(&half, &depth, &normal, &[], DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
                let own = painted.1[i].to_array();
                if x < 37 {
                    hidden += usize::from(surface.coverage > 0.0);
                    // What was there before is not loaded in a picture of this test's own.
                    assert!(background == Background::Host || *found == own, "{}: {x}, {y}", driver.name);
                } else if surface.coverage >= 0.5 {
                    shown += usize::from(*found != own);
                }
            }
            assert!(hidden > 100 && shown > 100, "{}: {hidden} hidden, {shown} shown", driver.name);
        }
    });
}

/// A quarter of the memory for what the picture's size decides, and the picture is not touched where the option is off.
#[test]
fn maps_take_a_quarter_of_the_memory() {
    each_driver(|driver| {
        let session = driver.session.borrow();
        let ledger = |half: bool| {
            let settings = settings(InstantLiquids::default().half_resolution(half), None);
            let amount = Amount::Prepared { splash: 0, body: 1000 };
            session.renderer.memory_requirements([1024, 768], amount, &settings).expect("it fits")
        };
        let (full, half) = (ledger(false), ledger(true));
        let names = |l: &[meniscus::LedgerEntry]| l.iter().map(|e| e.name).collect::<Vec<_>>();
        assert_eq!(names(&full), names(&half));
        let large: Vec<_> = full.iter().zip(&half).filter(|(f, _)| f.bytes > 1 << 20).collect();
        assert!(large.len() >= 5, "{}: {large:?}", driver.name);
        for (full, half) in large {
            let ratio = full.bytes as f64 / half.bytes as f64;
            assert!((3.8..4.2).contains(&ratio), "{}: {}: {ratio}", driver.name, full.name);
        }
    });
}

/// Layers that are drawn for walks are refused, with what would do.
#[test]
fn layers_without_half_resolution_are_refused() {
    let mut settings = settings(InstantLiquids::default().half_resolution(true), None);
    settings.validate().expect("Cords08's own layers have it");
    for (layers, has) in [("split", false), ("nearest-farthest", false), ("front", true)] {
        settings.method.choose("layers", layers).expect("layers");
        let refused = settings.validate().err().map(|e| e.to_string());
        assert_eq!(refused.is_none(), has, "{layers}");
        if let Some(text) = refused {
            assert!(text.contains("half the picture's resolution") && text.contains("use front"), "{text}");
        }
    }
    settings.set("half_resolution", "maybe").expect_err("no such value");
}
