use super::{liquid, uniform_sky, view};
use glam::{DVec2, DVec3, Mat3, Vec3};
use meniscus::{
    Camera, Equirect, Settings, inspect,
    space::Space,
    study::{
        analytic::{SCENES, scene},
        first,
        random::Random,
        surface::{Ray, Surface},
        tracer::{Tracer, interface},
        view::View,
    },
    twin::background::env_color,
};

const IOR: f64 = 1.333;

#[test]
fn reflectance_is_fresnels() {
    let at = |dir: DVec3| interface(dir, DVec3::Y, IOR);
    let straight = at(-DVec3::Y);
    assert!((straight.reflectance - ((IOR - 1.0) / (IOR + 1.0)).powi(2)).abs() < 1e-15);
    // At Brewster's angle nothing is reflected of the light that swings in the plane: tan b = n, and half of sin²(b - t) stays.
    let b = IOR.atan();
    let t = std::f64::consts::FRAC_PI_2 - b;
    let brewster = at(DVec3::new(b.sin(), -b.cos(), 0.0));
    assert!((brewster.reflectance - 0.5 * (b - t).sin().powi(2)).abs() < 1e-14, "{brewster:?}");
    for degrees in [5.0f64, 30.0, 60.0, 85.0, 89.9] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let seen = at(DVec3::new(sin, -cos, 0.0));
        let (i, t) = (degrees.to_radians(), (sin / IOR).asin());
        let refracted = seen.refracted.expect("into the liquid");
        assert!((refracted - DVec3::new(t.sin(), -t.cos(), 0.0)).length() < 1e-12, "{degrees}: {refracted}");
        assert!((seen.reflected - DVec3::new(sin, cos, 0.0)).length() < 1e-12);
        // The formulas in sines and tangents, for the wave that swings across and within the plane.
        let s = ((i - t).sin() / (i + t).sin()).powi(2);
        let p = ((i - t).tan() / (i + t).tan()).powi(2);
        assert!((seen.reflectance - 0.5 * (s + p)).abs() < 1e-10, "{degrees}");
        // The way back loses as much.
        let back = at(DVec3::new(-t.sin(), t.cos(), 0.0));
        assert!((back.reflectance - seen.reflectance).abs() < 1e-10);
        assert!((back.refracted.expect("out") - DVec3::new(-sin, cos, 0.0)).length() < 1e-7);
    }
    let critical = (1.0 / IOR).asin();
    for (angle, all) in [(critical - 1e-6, false), (critical + 1e-6, true)] {
        let seen = at(DVec3::new(angle.sin(), angle.cos(), 0.0));
        assert_eq!(seen.refracted.is_none(), all, "{angle}");
        assert_eq!(seen.reflectance == 1.0, all, "{angle}");
    }
}

/// The mean of many samples along a ray.
fn mean(tracer: &Tracer, ray: Ray, samples: u64) -> DVec3 {
    (0..samples).map(|i| tracer.light(ray, &mut Random::of(7, i))).sum::<DVec3>() / samples as f64
}

/// Under the same light from everywhere clear liquid cannot be seen, whatever its shape.
#[test]
fn no_light_is_lost_or_made() {
    let map = uniform_sky();
    let view = view(&map, [16, 16]);
    for (name, _) in SCENES {
        let shapes = scene(name).expect("it is listed");
        let tracer = Tracer::new(&shapes, &view, &liquid(0.0));
        for i in 0..64 {
            let point = DVec2::new(f64::from(i % 8), f64::from(i / 8)) * 2.0 + 0.37;
            let seen = mean(&tracer, view.ray(point), 64);
            assert!((seen - 1.0).abs().max_element() < 0.02, "{name} at {point}: {seen}");
        }
    }
}

/// All reflections between a slab's sides add up to a geometric series.
#[test]
fn a_slab_absorbs_as_its_series_says() {
    let map = uniform_sky();
    let view = view(&map, [2, 2]);
    let shapes = scene("slab").expect("a scene");
    let absorption = 0.7;
    let tracer = Tracer::new(&shapes, &view, &liquid(absorption as f32));
    for degrees in [0.0f64, 40.0, 75.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let dir = DVec3::new(sin, 0.0, -cos);
        let r = interface(dir, DVec3::Z, f64::from(liquid(0.0).ior)).reflectance;
        let t = (-absorption / (1.0 - (sin / IOR).powi(2)).sqrt()).exp();
        let within = (1.0 - r) * (1.0 - r) * t / (1.0 - r * r * t * t);
        let expected = r + within * (1.0 + r * t);
        let seen = mean(&tracer, Ray { origin: DVec3::new(-5.0 * sin, 0.0, 5.0 * cos), dir }, 20_000);
        assert!((seen.x - expected).abs() < 2e-3, "{degrees}: {seen} instead of {expected}");
    }
}

/// An interval without an end absorbs everything that is absorbed at all.
#[test]
fn below_an_endless_plane_only_clear_liquid_is_bright() {
    let map = uniform_sky();
    let view = view(&map, [2, 2]);
    let plane = scene("tilted-plane").expect("a scene");
    let ray = Ray { origin: DVec3::Z * 5.0, dir: -DVec3::Z };
    // 60 degrees from the plane's normal.
    let r = interface(ray.dir, DVec3::new(0.0, 30f64.to_radians().cos(), 0.5), f64::from(liquid(0.0).ior)).reflectance;
    let dark = Tracer::new(&plane, &view, &liquid(1e-6)).light(ray, &mut Random::of(0, 0));
    assert!((dark - r).abs().max_element() < 1e-12 && r > 0.05 && r < 0.1, "{dark} {r}");
    assert!((Tracer::new(&plane, &view, &liquid(0.0)).light(ray, &mut Random::of(0, 0)).x - 1.0).abs() < 1e-12);
}

/// A ray through a ball turns by twice the difference of the angles, at an impact parameter b: sin i = b, sin t = b / n.
#[test]
fn a_ball_turns_rays_as_descartes_says() {
    let map = uniform_sky();
    let view = view(&map, [64, 64]);
    let shapes = scene("ball").expect("a scene");
    let maps = first::maps(&Tracer::new(&shapes, &view, &liquid(0.0)));
    let mut met = 0;
    for (i, seen) in maps.iter().enumerate() {
        let ray = view.ray(DVec2::new((i % 64) as f64 + 0.5, (i / 64) as f64 + 0.5));
        let b = (ray.origin + ray.dir * -ray.origin.dot(ray.dir)).length();
        assert_eq!(seen.hits, if b < 1.0 { 2 } else { 0 }, "{b}");
        if b >= 1.0 {
            assert!(seen.depth.is_nan() && seen.path_length == 0.0);
            continue;
        }
        met += 1;
        let t = (b / f64::from(liquid(0.0).ior)).asin();
        let turn = 2.0 * (b.asin() - t);
        let angle = seen.final_direction.as_dvec3().dot(ray.dir).min(1.0).acos();
        assert!((angle - turn).abs() < 1e-3, "{b}: {angle} instead of {turn}");
        assert!((f64::from(seen.path_length) - 2.0 * t.cos()).abs() < 1e-5);
        // On the ball, which the view axis meets at z = 1.
        let depth = f64::from(seen.depth);
        let at = ray.origin + ray.dir * (depth / -ray.dir.z);
        assert!((at.length() - 1.0).abs() < 1e-6 && (at - seen.normal.as_dvec3()).length() < 1e-6);
    }
    assert!(met > 500, "{met}");
}

#[test]
fn shapes_are_met_at_their_nearest_and_left_behind() {
    let shapes = scene("ball-before-slab").expect("a scene");
    let mut ray = Ray { origin: DVec3::new(0.3, 0.1, 9.0), dir: -DVec3::Z };
    let side = (0.36f64 - 0.1).sqrt();
    let (mut leaves, mut met) = (None, Vec::new());
    while let Some(hit) = shapes.hit(&ray, leaves) {
        ray.origin = ray.at(hit.t);
        leaves = Some(hit.id);
        met.push(ray.origin.z);
        assert_eq!(hit.geometric.dot(ray.dir) < 0.0, met.len() % 2 == 1);
    }
    let expected = [1.5 + side, 1.5 - side, 0.5, -0.5];
    assert!(met.len() == 4 && met.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{met:?}");
    let stack = scene("stack").expect("a scene");
    let (mut ray, mut leaves, mut met) = (Ray { origin: DVec3::Z * 3.0, dir: -DVec3::Z }, None, 0);
    while let Some(hit) = stack.hit(&ray, leaves) {
        (ray.origin, leaves, met) = (ray.at(hit.t), Some(hit.id), met + 1);
    }
    assert_eq!(met, 5);
    // Straight on, two slabs of 0.3; below the last plane the path has no end.
    let map = uniform_sky();
    let view = view(&map, [3, 3]);
    let middle = first::maps(&Tracer::new(&stack, &view, &liquid(0.0)))[4];
    assert!((middle.path_length - 0.6).abs() < 1e-6 && middle.hits == 5, "{middle:?}");
}

/// Rays and the environment are those of the renderer's own uniform block, for any camera.
#[test]
fn the_view_is_the_renderers() {
    let texels: Vec<[f32; 3]> = (0..512).map(|i| [i as f32, (i * 7 % 64) as f32, 1.0]).collect();
    let map = Equirect::new(32, 16, &texels).expect("a map");
    let size = [40, 30];
    let mut camera = Camera::look_at(Vec3::new(3.0, 1.0, -2.0), Vec3::new(0.0, 0.3, 0.1), Vec3::Y, 0.8, 4.0 / 3.0, 0.1);
    camera.up = Vec3::new(0.3, 1.0, -0.5).normalize();
    camera.environment_rotation = 0.7;
    camera.projection.z_axis.x = 0.2;
    let view = View::new(&camera, size, &map);
    let block =
        inspect::uniforms(&camera, &Settings::default(), size, &Space::new(1.0, Vec3::ZERO), (Vec3::ZERO, Vec3::ONE));
    for point in [DVec2::new(0.0, 0.0), DVec2::new(12.25, 25.0), DVec2::new(39.5, 0.5)] {
        let ray = view.ray(point);
        let eye = camera.view.transform_point3(ray.at(3.0).as_vec3());
        let seen = block.pixel_scale * eye.truncate() / -eye.z + block.pixel_origin;
        assert!((seen.as_dvec2() - point).length() < 1e-3, "{seen} instead of {point}");
        assert!((view.depth(ray.at(3.0)) - f64::from(-eye.z)).abs() < 1e-5);
        let dir = Mat3::from_mat4(camera.view) * ray.dir.as_vec3();
        let looked_up = Mat3::from_mat4(block.eye_to_env).as_dmat3() * dir.as_dvec3();
        let light = env_color(&map, looked_up).as_dvec3();
        assert!((view.environment(ray.dir) - light).length() < 1e-2, "{light}");
    }
}
