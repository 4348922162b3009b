//! Refraction as a look-up against its twin, which reads the GPU's own depths, normals and thickness, and in closed form.

use crate::{
    analytic::{Quadric, snell},
    background::{HostScene, Painted, linear_cube, linear_light, painted},
    cull::around_the_near_plane,
    host::{self, with_renderer},
    splat,
    support::{Case, Driver, SKY, Shot, camera, each_driver, imai16, random_cloud, sphere},
};
use ash::vk;
use glam::{DVec2, DVec3, Mat3, Vec3};
use meniscus::{
    Background, Ellipsoid, EnvironmentInput, EnvironmentShape, Particles, Settings,
    host::Canvas,
    inspect::{
        Lookup,
        lookup::{Input, Seen},
    },
    twin::{background::Scene, background::env_color, optics::fresnel},
};

const SIZE: [u32; 2] = [160, 120];
const TINTED: Vec3 = Vec3::new(0.2, 1.5, 3.0);

/// A published method's layers and optics with values of its parameters. The particles' own surfaces, unsmoothed.
fn settings(optics: &str, values: &[(&str, &str)]) -> Settings {
    let mut settings = imai16();
    for (family, member) in [("layers", "front"), ("smooth", "none"), ("optics", optics)] {
        settings.method.choose(family, member).expect("a member");
    }
    for (name, value) in values {
        settings.set(name, value).expect("a parameter");
    }
    settings.liquid.absorption = TINTED;
    settings.validate().expect("in range");
    settings
}

/// Each kind of look-up, as it comes and otherwise; some of them absurd.
const KINDS: &[(&str, &[(&str, &str)])] = &[
    ("ssfr", &[]),
    ("ssfr", &[("strength", "0.2"), ("thickness_scale", "3"), ("fresnel", "exact")]),
    ("ssfr", &[("strength", "1e30"), ("thickness_scale", "1e30")]),
    ("ssfr", &[("strength", "3e38"), ("thickness_scale", "3e38")]),
    ("ssfr-index", &[]),
    ("ssfr-index", &[("thickness_scale", "1"), ("fresnel", "exact")]),
    ("ssfr-index", &[("thickness_scale", "1e30"), ("ior", "4")]),
    ("instant-liquids", &[]),
    ("instant-liquids", &[("diffuse", "0.7"), ("shininess", "5"), ("fresnel", "schlick"), ("light", "-1,0.3,2")]),
    ("instant-liquids", &[("strength", "1e30"), ("specular", "1e4"), ("shininess", "10000")]),
];

/// Every pixel's light as the twin has it.
fn twin(case: &Case, shot: &Shot, scene: Option<Scene>, environment: &(dyn Fn(DVec3) -> Vec3 + Sync)) -> Vec<Seen> {
    let input = Input {
        frame: &shot.frame,
        depth: &shot.floats("body depth (ray-cast)", 0).expect("drawn"),
        normal: shot.words("body normal (ray-cast)", 0).expect("drawn"),
        thickness: &shot.floats("thickness", 0).unwrap_or_default(),
        scene,
        environment,
    };
    let lookup = Lookup::of(&case.settings.method.optics).expect("a look-up");
    let width = case.size[0] as usize;
    (0..shot.picture.len()).map(|i| input.look_up(&lookup, [i % width, i / width])).collect()
}

/// Pixels with liquid that agree. A look-up that lies so near to the edge of a pixel of the host's may fall on either side.
fn compare(what: &str, shot: &Shot, want: &[Seen], tolerance: f32) -> usize {
    let (mut liquid, mut off, mut far, mut most, mut doubt) = (0, 0, 0, 0.0f32, 0);
    for (i, (found, want)) in shot.picture.iter().zip(want).enumerate() {
        let found = Vec3::from(*found);
        assert!(found.is_finite(), "{what}: pixel {i} is {found}");
        let Some(color) = want.color else { continue };
        if want.edge < 2e-3 {
            doubt += 1;
            continue;
        }
        // Of the light, and of a dark grey: drivers compute atan, acos and exp with errors of up to 1e-4, and from texel to
        // texel the sky changes by up to 0.5.
        let error = ((found - color).abs() / (color.abs() + 0.5)).max_element();
        off += usize::from(error > tolerance);
        most = most.max(error);
        liquid += usize::from(want.liquid);
        far += usize::from(error > 4.0 * tolerance);
    }
    println!(
        "{what}: {liquid} pixels of liquid, {most:.1e} off at most, {off} by more than {tolerance}, {far} far, {doubt} in doubt"
    );
    // Around the sun the sky changes by thousands.
    assert!(
        off * 100 <= liquid && far * 2000 <= liquid && doubt * 50 <= liquid,
        "{what}: {off}, {far} off, {doubt} in doubt"
    );
    liquid
}

/// To the border of the picture and beyond, and with the near plane among particles.
fn cases(settings: Settings) -> [(&'static str, Case); 2] {
    let particles = random_cloud(5, 0.12, Vec3::new(-1.4, -1.0, -0.6), Vec3::new(1.4, 1.0, 0.6), 40, 160);
    let mut cloud = splat::case(particles, camera(Vec3::new(0.3, 0.4, 2.4), Vec3::ZERO, SIZE), SIZE);
    let mut near = around_the_near_plane();
    (cloud.settings, near.settings) = (settings, settings);
    [("cloud", cloud), ("near plane", near)]
}

#[test]
fn look_ups_are_the_twins() {
    let sky = |dir| env_color(&SKY, dir);
    each_driver(|driver| {
        for (optics, values) in KINDS {
            for (name, case) in cases(settings(optics, values)) {
                let shot = driver.shoot(&case);
                let what = format!("{}: {optics} {values:?}, {name}", driver.name);
                let liquid = compare(&what, &shot, &twin(&case, &shot, None, &sky), 5e-3);
                assert!(liquid > 5000, "{what}: {liquid}");
            }
        }
    });
}

/// What of a host's scene the twin is told.
fn told<'a>(depth: &'a [f64], painted: &'a Painted, background: Background) -> Scene<'a> {
    Scene { depth, color: &painted.1, sky: background == Background::Host }
}

/// The same before blocks of a host's, and with its own sky.
#[test]
fn look_ups_before_a_scene_are_the_twins() {
    let sky = |dir| env_color(&SKY, dir);
    let blocks = |x: u32, y: u32| match (x / 20 + 2 * (y / 20)) % 5 {
        0 => 1.9 + 0.002 * f64::from(x),
        1 => 0.7,
        2 => 2.3,
        3 => 4.0,
        _ => f64::INFINITY,
    };
    let scene = painted(SIZE, blocks);
    each_driver(|driver| {
        for (optics, values) in KINDS {
            for (name, case) in cases(settings(optics, values)) {
                let images = HostScene::new(driver.gpu(), &case.camera, SIZE, &scene);
                for background in [Background::Environment, Background::Host] {
                    let shot = driver.shoot_before(&case, images.input(), background);
                    let depth: Vec<f64> = scene.0.iter().map(|d| d / shot.space.radius).collect();
                    let want = twin(&case, &shot, Some(told(&depth, &scene, background)), &sky);
                    let what = format!("{}: {optics} {values:?}, {name}, {background:?}", driver.name);
                    let liquid = compare(&what, &shot, &want, 5e-3);
                    assert!(liquid > 3000, "{what}: {liquid}");
                }
            }
        }
    });
}

/// With the host's background a pixel is written where liquid is seen, and nowhere else.
#[test]
fn the_hosts_picture_stays_beside_the_liquid() {
    const BEFORE: [f32; 4] = [0.25, 0.5, 0.75, 0.125];
    const FLOAT4: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
    let case = host::case(random_cloud(6, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 20, 300));
    // Strips: before all of the liquid, behind it, and nothing.
    let scene = painted(host::SIZE, |x, _| [1.5, 6.0, f64::INFINITY][(x / 4 % 3) as usize]);
    each_driver(|driver| {
        for optics in ["ssfr", "instant-liquids"] {
            let mut case = case.clone();
            case.settings = settings(optics, &[]);
            let images = HostScene::new(driver.gpu(), &case.camera, host::SIZE, &scene);
            let shot = driver.shoot_before(&case, images.input(), Background::Host);
            let depth: Vec<f64> = scene.0.iter().map(|d| d / shot.space.radius).collect();
            let want = twin(&case, &shot, Some(told(&depth, &scene, Background::Host)), &|_| Vec3::ZERO);
            with_renderer(driver, FLOAT4, 1, |gpu, renderer| {
                let images = HostScene::new(gpu, &case.camera, host::SIZE, &scene);
                renderer.set_particles(&case.particles).expect("particles");
                let output = Canvas::new(gpu, FLOAT4, 16, host::SIZE).expect("canvas");
                let before = BEFORE.repeat(want.len());
                output
                    .write(bytemuck::cast_slice(&before), vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                    .expect("written");
                let input = host::input(&case, 0, output.view).scene(images.input()).background(Background::Host);
                // SAFETY: `cmd` is recording outside rendering; the output was just brought into the stated layout.
                gpu.run(|cmd| Ok(unsafe { renderer.record(cmd, &input) }?)).expect("frame");
                let floats: Vec<f32> = bytemuck::pod_collect_to_vec(&output.read().expect("picture"));
                let mut covered = 0;
                for (i, (pixel, want)) in floats.chunks_exact(4).zip(&want).enumerate() {
                    assert_eq!(pixel == BEFORE, want.color.is_none(), "{}: {optics}: {i} is {pixel:?}", driver.name);
                    assert!(want.color.is_none() || pixel[3] == 1.0, "{}: {optics}: {i} is {pixel:?}", driver.name);
                    covered += usize::from(want.liquid);
                }
                assert!(covered > 500, "{}: {optics}: {covered}", driver.name);
            });
        }
    });
}

/// The same before a cube of the host's. Its light is a linear function of the direction, of which the map's interpolation
/// errs by 1.5e-3.
#[test]
fn look_ups_before_a_cube_are_the_twins() {
    const EDGE: u32 = 64;
    const READ: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
    let texels = linear_cube(EDGE);
    let sky = |dir: DVec3| Vec3::from(linear_light(dir.as_vec3()));
    each_driver(|driver| {
        let cube = Canvas::cube(driver.gpu(), vk::Format::R32G32B32A32_SFLOAT, 16, EDGE).expect("cube");
        cube.write(bytemuck::cast_slice(&texels), READ).expect("written");
        for (optics, values) in KINDS {
            for (name, case) in cases(settings(optics, values)) {
                let environment = EnvironmentInput::new(cube.view, READ, EnvironmentShape::Cube);
                let shot = driver.shoot_with(&case, &|input| input.environment(environment));
                let what = format!("{}: {optics} {values:?}, {name}, cube", driver.name);
                compare(&what, &shot, &twin(&case, &shot, None, &sky), 5e-3);
            }
        }
    });
}

/// Where a look-up falls whose light is the painted scene's, in closed form: for each pixel of a quadric the view ray in the
/// eye's space, the normal there, the chord in particle radii, and the light that was refracted (reflection taken off).
struct Bent {
    at: DVec2,
    ray: DVec3,
    normal: DVec3,
    chord: f64,
    color: Vec3,
}

/// Seen by an eye at (0, 0, 2.5) that looks along -z, before a painted plane.
fn bent(driver: &Driver, body: Ellipsoid, settings: &Settings) -> Vec<Bent> {
    let eye = Vec3::new(0.0, 0.0, 2.5);
    let particles = Particles { radius: 0.2, ellipsoids: vec![body], splash_count: 0 };
    let mut case = splat::case(particles, camera(eye, Vec3::ZERO, SIZE), SIZE);
    case.settings = *settings;
    let scene = painted(SIZE, |_, _| 8.0);
    let images = HostScene::new(driver.gpu(), &case.camera, SIZE, &scene);
    let shot = driver.shoot_before(&case, images.input(), Background::Host);
    let (q, p) = (Quadric::new(&body), case.camera.projection.as_dmat4());
    let exact = settings.method.optics.parameters().parameters().iter().any(|p| p.value == "exact");
    let mut all = Vec::new();
    for (i, color) in shot.picture.iter().enumerate() {
        let at = DVec2::new(f64::from(i as u32 % SIZE[0]), f64::from(i as u32 / SIZE[0])) + 0.5;
        let ndc = 2.0 * at / DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1])) - 1.0;
        let ray = DVec3::new(ndc.x / p.x_axis.x, ndc.y / p.y_axis.y, -1.0).normalize();
        let Some((near, far)) = q.crossings(eye.as_dvec3(), ray) else { continue };
        let normal = q.normal(eye.as_dvec3() + near * ray);
        // Towards the rim all light is reflected.
        if -ray.dot(normal) < 0.3 {
            continue;
        }
        let inside = snell(ray, normal, 1.0 / 1.333).expect("into water");
        let share = fresnel(-ray.dot(normal) as f32, -inside.dot(normal) as f32, 1.333, exact);
        let mirrored = ray - 2.0 * ray.dot(normal) * normal;
        // The eye's axes are the world's.
        let reflected = share * env_color(&SKY, mirrored);
        let color = (Vec3::from(*color) - reflected) / (1.0 - share);
        // A mirrored ray that goes away from the eye may meet the host's picture.
        if mirrored.z > 0.0 {
            all.push(Bent { at, ray, normal, chord: (far - near) / 0.2, color });
        }
    }
    assert!(all.len() > 500, "{}: {}", driver.name, all.len());
    all
}

/// The painted plane's colour at a position, which is that of the pixel it falls in; its red and green tell the position.
fn painted_at(at: DVec2) -> Vec3 {
    let size = DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1]));
    let pixel = at.clamp(DVec2::ZERO, size - 1.0).floor() + 0.5;
    (0.2 + 0.6 * pixel / size).extend(0.5).as_vec3()
}

/// Pixels whose light is as painted at a position, within a pixel's edge and the reflection's error, but for a few.
#[track_caller]
fn seen_where(driver: &Driver, what: &str, all: &[Bent], absorption: Vec3, position: impl Fn(&Bent) -> DVec2) {
    let off = |b: &Bent| (b.color - painted_at(position(b)) * (-absorption * b.chord as f32).exp()).abs().max_element();
    let bad: Vec<_> = all.iter().filter(|b| off(b) > 2e-3).map(|b| (b.at, off(b))).collect();
    println!("{}: {what}: {} of {} pixels off", driver.name, bad.len(), all.len());
    // Where the position falls on the edge of a pixel, the next one differs by 0.005.
    assert!(bad.len() * 50 <= all.len() && bad.iter().all(|b| b.1 < 8e-3), "{}: {what}: {bad:?}", driver.name);
}

fn slab() -> Ellipsoid {
    Ellipsoid { center: Vec3::ZERO, axes: Mat3::from_diagonal(Vec3::new(30.0, 30.0, 0.2)) }
}

/// A flat slab that faces the viewer has no offset, however strong: its normal has no part across the view.
#[test]
fn a_slab_that_faces_the_viewer_moves_nothing() {
    let mut settings = settings("ssfr", &[("strength", "3"), ("thickness_scale", "1e30")]);
    settings.liquid.absorption = Vec3::new(0.1, 0.4, 0.2);
    each_driver(|driver| {
        // 120 radii a unit of the world's, and 0.2 of it one radius.
        let seen = bent(driver, slab(), &settings);
        assert!(seen.len() as u32 > SIZE[0] * SIZE[1] * 9 / 10);
        seen_where(driver, "a slab", &seen, 0.2 * settings.liquid.absorption, |b| b.at);
    });
}

/// Ssfr on a ball: the normal's part across the view times T, in edges of the picture.
#[test]
fn a_ball_moves_the_look_up_by_its_normal() {
    let mut settings = settings("ssfr", &[("strength", "0.2"), ("thickness_scale", "0.7")]);
    settings.liquid.absorption = Vec3::ZERO;
    each_driver(|driver| {
        let size = DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1]));
        seen_where(driver, "a ball", &bent(driver, sphere(Vec3::ZERO, 0.7), &settings), Vec3::ZERO, |b| {
            let t = 1.0 - (-0.7 * b.chord).exp();
            b.at + 0.2 * t * b.normal.truncate() * size * DVec2::new(1.0, -1.0)
        });
    });
}

/// Im16: without thickness light goes on as it was; thick liquid shows what lies, infinitely far away, along the direction of
/// Snell's law.
#[test]
fn thickness_brings_the_index_in() {
    each_driver(|driver| {
        for scale in ["0", "1e30"] {
            let mut settings = settings("ssfr-index", &[("thickness_scale", scale)]);
            settings.liquid.absorption = Vec3::ZERO;
            let seen = bent(driver, sphere(Vec3::ZERO, 0.7), &settings);
            let focal = 0.5 * f64::from(SIZE[1]) / (22.5f64).to_radians().tan();
            seen_where(driver, &format!("scale {scale}"), &seen, Vec3::ZERO, |b| {
                let r = if scale == "0" { b.ray } else { snell(b.ray, b.normal, 1.0 / 1.333).expect("into water") };
                let middle = 0.5 * DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1]));
                middle + focal * DVec2::new(r.x, -r.y) / -r.z
            });
        }
    });
}

/// Cords08: the look-up is c_int (t_x, t_y) away, t by Snell's law; light from behind the surface is not mirrored.
#[test]
fn instant_liquids_move_the_look_up_by_the_bent_ray() {
    let dark = [("strength", "0.15"), ("light", "0,0,-1")];
    let mut settings = settings("instant-liquids", &dark);
    settings.liquid.absorption = Vec3::ZERO;
    each_driver(|driver| {
        let size = DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1]));
        seen_where(driver, "t", &bent(driver, sphere(Vec3::ZERO, 0.7), &settings), Vec3::ZERO, |b| {
            let t = snell(b.ray, b.normal, 1.0 / 1.333).expect("into water");
            b.at + 0.15 * t.truncate() * size * DVec2::new(1.0, -1.0)
        });
    });
}
