//! What optics make of a surface, against closed forms on a ball.

use super::{liquid, view};
use glam::{DVec2, DVec3, Vec3};
use meniscus::{
    Camera, Equirect, Fresnel, Settings,
    optics::{Optics, four::Four, instant_liquids::InstantLiquids, one::One, ssfr::Ssfr, two::Two},
    study::{
        analytic::scene,
        light_model::picture,
        tracer::{Tracer, interface},
    },
    twin::optics::fresnel,
};

/// Light that differs everywhere, and slowly.
fn sky() -> Equirect {
    let texel = |i: usize| {
        let (x, y) = ((i % 256) as f32 / 256.0, (i / 256) as f32 / 128.0);
        [1.0 + (std::f32::consts::TAU * x).sin() * y * (1.0 - y) * 2.0, 0.5 + y, 2.0 - y]
    };
    Equirect::new(256, 128, &(0..256 * 128).map(texel).collect::<Vec<_>>()).expect("a map")
}

const SIZE: [u32; 2] = [24, 24];
const ABSORPTION: f64 = 0.7;

fn camera() -> Camera {
    Camera::look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, Vec3::Y, 0.6, 1.0, 0.1)
}

fn settings(optics: impl Into<Optics>) -> Settings {
    let mut settings = Settings::default();
    settings.liquid = liquid(ABSORPTION as f32);
    settings.method.optics = optics.into();
    settings
}

/// Of each pixel whose ray meets the ball: the ray's direction, the normal where it does, the picture there, and the sky.
fn each(optics: impl Into<Optics>, check: impl Fn(DVec3, DVec3, Vec3, &dyn Fn(DVec3) -> DVec3)) {
    let (map, settings) = (sky(), settings(optics));
    let view = view(&map, SIZE);
    let ball = scene("ball").expect("a scene");
    let tracer = Tracer::new(&ball, &view, &settings.liquid);
    let seen = picture(&tracer, &camera(), &settings, 0.1, 1).expect("a picture");
    let mut met = 0;
    for (i, color) in seen.iter().enumerate() {
        let ray = view.ray(DVec2::new((i % 24) as f64, (i / 24) as f64) + 0.5);
        let middle = -ray.origin.dot(ray.dir);
        let across = ray.origin + middle * ray.dir;
        if across.length() >= 0.999 {
            let beside = view.environment(ray.dir).as_vec3();
            assert!((*color - beside).abs().max_element() < 1e-4 || across.length() < 1.001, "{color} beside the ball");
            continue;
        }
        met += 1;
        let normal = across - (1.0 - across.length_squared()).sqrt() * ray.dir;
        check(ray.dir, normal, *color, &|dir| view.environment(dir));
    }
    assert!(met > 100, "{met}");
}

fn close(seen: Vec3, wanted: DVec3) {
    assert!((seen.as_dvec3() - wanted).abs().max_element() < 2e-3, "{seen} instead of {wanted}");
}

#[test]
fn rays_bend_as_often_as_the_optics_know() {
    let ior = f64::from(liquid(0.0).ior);
    // Schlick's approximation, with the cosine in air.
    let schlick = |cos: f64| {
        let r = ((ior - 1.0) / (ior + 1.0)).powi(2);
        r + (1.0 - r) * (1.0 - cos).powi(5)
    };
    each(One::default(), |dir, normal, seen, sky| {
        let at = interface(dir, normal, ior);
        let r = schlick(-dir.dot(normal));
        close(seen, r * sky(at.reflected) + (1.0 - r) * sky(at.refracted.expect("into the liquid")));
    });
    let through = |exact: bool| {
        move |dir: DVec3, normal: DVec3, seen: Vec3, sky: &dyn Fn(DVec3) -> DVec3| {
            let at = interface(dir, normal, ior);
            let r = if exact { at.reflectance } else { schlick(-dir.dot(normal)) };
            let within = at.refracted.expect("into the liquid");
            // By symmetry the second surface is met at the same angle.
            let length = -2.0 * within.dot(normal);
            let behind = normal + length * within;
            let out = interface(within, behind, ior);
            let light = (1.0 - r) * (-ABSORPTION * length).exp();
            let onwards = r * sky(out.reflected) + (1.0 - r) * sky(out.refracted.expect("out of it"));
            close(seen, r * sky(at.reflected) + light * onwards);
        }
    };
    each(Two::default().fresnel(Fresnel::Exact), through(true));
    // There is no second volume.
    each(Four::default(), through(false));
}

#[test]
fn look_ups_get_depth_normal_and_thickness() {
    let ior = liquid(0.0).ior;
    let reflectance = |dir: DVec3, normal: DVec3, exact| {
        let bent = interface(dir, normal, f64::from(ior)).refracted.expect("into the liquid");
        f64::from(fresnel(-dir.dot(normal) as f32, -bent.dot(normal) as f32, ior, exact))
    };
    // Not moved at all: what lies straight behind, through as much liquid as there is.
    each(Ssfr::default().strength(0.0), |dir, normal, seen, sky| {
        let (at, r) = (interface(dir, normal, f64::from(ior)), reflectance(dir, normal, false));
        let length = -2.0 * dir.dot(normal);
        close(seen, sky(dir) * (1.0 - r) * (-ABSORPTION * length).exp() + r * sky(at.reflected));
    });
    each(InstantLiquids::default().strength(0.0).specular(0.0), |dir, normal, seen, sky| {
        let (at, r) = (interface(dir, normal, f64::from(ior)), reflectance(dir, normal, true));
        close(seen, sky(dir) * (1.0 - r) + r * sky(at.reflected));
    });
    // Spray asks for speeds, which no surface has.
    let (map, settings) = (sky(), settings(InstantLiquids::default().spray(0.5)));
    let (view, ball) = (view(&map, SIZE), scene("ball").expect("a scene"));
    assert!(picture(&Tracer::new(&ball, &view, &settings.liquid), &camera(), &settings, 0.1, 1).is_none());
}

/// A pixel is the mean of its samples, which lie where those of a picture so many times as large do.
#[test]
fn samples_are_averaged() {
    let (map, settings) = (sky(), settings(Two::default()));
    let ball = scene("ball").expect("a scene");
    let of = |times: u32, each_way| {
        let view = view(&map, SIZE.map(|n| times * n));
        picture(&Tracer::new(&ball, &view, &settings.liquid), &camera(), &settings, 0.1, each_way).expect("a picture")
    };
    let (averaged, large) = (of(1, 3), of(3, 1));
    let mut uneven = 0;
    for (i, seen) in averaged.iter().enumerate() {
        let own: Vec<Vec3> = (0..9).map(|k| large[(3 * (i / 24) + k / 3) * 72 + 3 * (i % 24) + k % 3]).collect();
        close(*seen, own.iter().sum::<Vec3>().as_dvec3() / 9.0);
        uneven += usize::from((own[0] - own[8]).abs().max_element() > 0.05);
    }
    assert!(averaged.len() == 24 * 24 && uneven > 20, "{uneven}");
}
