//! What rays meet that meet no more liquid: the host's opaque scene in, behind and before it, against closed forms and the
//! twin; the host's own picture and sky; environments in the host's own images.

use crate::{
    analytic::{Quadric, SIZE, case, pixels, settings, snell, view, within},
    host::{self, with_renderer},
    support::{Choose, Driver, SKY, each_driver, imai16, random_cloud, sphere},
    walk::degrees,
};
use ash::vk;
use glam::{DVec3, Mat3, Vec3};
use meniscus::{
    Background, Camera, Ellipsoid, EnvironmentInput, EnvironmentShape, FrameInput, Particles, SceneInput,
    host::{Canvas, Gpu},
    shader::{OUTCOME_HIT, OUTCOME_LEFT_VIEW, OUTCOME_NO_LIQUID, OUTCOME_SCENE, WETTING_GAP},
    twin::{background::env_color, optics::fresnel},
};

const FLOAT4: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const READ: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
const CLEARED: f32 = 1.0;

/// What a depth buffer holds: z = (P22 z_e + P23) / -z_e at z_e = -d.
pub fn z_at(camera: &Camera, d: f64) -> f32 {
    let p = camera.projection;
    if d.is_finite() { (p.w_axis.z - p.z_axis.z * d as f32) / d as f32 } else { CLEARED }
}

/// A scene as the host would have rendered it.
pub struct HostScene<'a> {
    color: Canvas<'a>,
    depth: Canvas<'a>,
}

/// Linear depth (infinite where nothing is) and colour of each pixel.
pub type Painted = (Vec<f64>, Vec<Vec3>);

impl<'a> HostScene<'a> {
    pub fn new(gpu: &'a Gpu<'a>, camera: &Camera, size: [u32; 2], (depth, color): &Painted) -> HostScene<'a> {
        let z = |d: &f64| z_at(camera, *d);
        HostScene::of_depths(gpu, size, &depth.iter().map(z).collect::<Vec<_>>(), color)
    }

    /// With depths as its depth buffer holds them.
    pub fn of_depths(gpu: &'a Gpu<'a>, size: [u32; 2], depths: &[f32], color: &[Vec3]) -> HostScene<'a> {
        let canvas = |format, texel| Canvas::new(gpu, format, texel, size).expect("canvas");
        let scene = HostScene { color: canvas(FLOAT4, 16), depth: canvas(vk::Format::R32_SFLOAT, 4) };
        let rgba: Vec<f32> = color.iter().flat_map(|c| [c.x, c.y, c.z, 1.0]).collect();
        scene.color.write(bytemuck::cast_slice(&rgba), READ).expect("colour");
        scene.depth.write(bytemuck::cast_slice(depths), READ).expect("depth");
        scene
    }

    pub fn input(&self) -> SceneInput {
        self.cleared_to(CLEARED)
    }

    pub fn cleared_to(&self, cleared: f32) -> SceneInput {
        SceneInput::new((self.color.view, READ), (self.depth.view, READ), cleared)
    }
}

/// A colour that tells where in the picture it is.
fn paint(x: f64, y: f64, size: [u32; 2]) -> Vec3 {
    Vec3::new(0.2 + 0.6 * (x / f64::from(size[0])) as f32, 0.2 + 0.6 * (y / f64::from(size[1])) as f32, 0.5)
}

/// A scene with such colours everywhere; depth by pixel.
pub fn painted(size: [u32; 2], depth: impl Fn(u32, u32) -> f64) -> Painted {
    let all = || (0..size[1]).flat_map(move |y| (0..size[0]).map(move |x| (x, y)));
    let color = |(x, y): (u32, u32)| paint(f64::from(x) + 0.5, f64::from(y) + 0.5, size);
    (all().map(|(x, y)| depth(x, y)).collect(), all().map(color).collect())
}

/// Colour that the plane of such a scene has at a point in the eye's space.
fn seen_at(camera: &Camera, x: DVec3) -> Vec3 {
    let p = camera.projection.as_dmat4();
    let ndc = |k: usize| p.col(k)[k] * x[k] / -x.z;
    let at = |k: usize| 0.5 * (ndc(k) + 1.0) * f64::from(SIZE[k]);
    paint(at(0), at(1), SIZE)
}

const IOR: f64 = 1.333;
const RADIUS: f32 = 0.01;

/// An opaque plane before, inside, touching, just behind and far behind a tilted slab.
#[test]
fn a_plane_in_and_behind_a_slab_is_met_where_the_closed_form_says() {
    let tilt = Mat3::from_rotation_y(0.3) * Mat3::from_rotation_x(0.2);
    let body = Ellipsoid { center: Vec3::ZERO, axes: tilt * Mat3::from_diagonal(Vec3::new(9.0, 9.0, 0.15)) };
    let q = Quadric::new(&body);
    let camera = view(Vec3::new(0.0, 0.0, 2.5), Vec3::ZERO, 20.0);
    let absorption = Vec3::new(1.0, 0.5, 2.0);
    let sky = &*SKY;
    for (refractions, plane) in [(1, 0.0), (4, 0.0), (2, 0.7), (2, -0.2), (4, -1.0), (1, -1.0)] {
        let settings = settings(refractions, 0).absorption(absorption);
        let case = case(RADIUS, &[], &[body], camera, settings);
        let painted = painted(SIZE, |_, _| 2.5 - plane);
        each_driver(|driver| {
            let scene = HostScene::new(driver.gpu(), &camera, SIZE, &painted);
            let shot = driver.shoot_before(&case, scene.input(), Background::Environment);
            let (mut inside, mut dry, mut through) = (Vec::new(), 0, Vec::new());
            let (mut colors, mut wetted, mut left) = (Vec::new(), 0, 0);
            for p in pixels(&case, &shot) {
                let near = q.crossings(p.eye, p.dir).expect("the slab fills the view").0;
                let hit = |x: DVec3, w: DVec3| (plane - x.z) / w.z;
                let label = || format!("{}: plane at {plane}, pixel {}", driver.name, p.index);
                let x = p.eye + near * p.dir;
                // The depth buffer's last bit is 4e-5 here.
                if (x.z - plane).abs() < 1e-3 {
                    continue;
                }
                if p.outcome == OUTCOME_LEFT_VIEW {
                    left += 1; // bent outwards at the picture's border
                    continue;
                }
                if x.z < plane {
                    assert_eq!(p.outcome, OUTCOME_NO_LIQUID, "{}", label());
                    assert_eq!(Vec3::from(shot.picture[p.index]), painted.1[p.index], "{}", label());
                    dry += 1;
                    continue;
                }
                let n = q.normal(x);
                let bent = snell(p.dir, n, 1.0 / IOR).expect("into water");
                let mirrored = p.dir - 2.0 * p.dir.dot(n) * n;
                let far = q.crossings(x, bent).expect("a ray inside leaves").1;
                let (to_plane, wall) = (hit(x, bent), q.normal(x + far * bent));
                let gap = (to_plane - far) * bent.dot(wall);
                let limit = f64::from(WETTING_GAP * RADIUS);
                // A ray that ends close to where the rule changes may go either way.
                if refractions > 1 && ((gap - limit).abs() < 0.1 * limit || (to_plane - far).abs() < 1e-3) {
                    continue;
                }
                // Out of the view there is no scene.
                let end = x + to_plane * bent - p.eye;
                let lateral = DVec3::new(end.x, end.y, 0.0) / -end.z;
                if !(0..2).all(|k| lateral[k].abs() * f64::from(camera.projection.col(k)[k]).abs() < 0.99) {
                    continue;
                }
                // The host's colours lie on its pixels, half a pixel off at most.
                let light = fresnel(-p.dir.dot(n) as f32, -bent.dot(n) as f32, IOR as f32, false);
                let mirror = light * env_color(sky, mirrored);
                let mut reflected_far = Vec3::ZERO;
                let brought = if refractions == 1 {
                    seen_at(&camera, x + to_plane * bent - p.eye)
                } else if gap < limit {
                    assert_eq!(p.outcome, OUTCOME_SCENE, "{}", label());
                    inside.push((p.length - to_plane).abs() / f64::from(RADIUS));
                    wetted += usize::from(gap > 0.0);
                    seen_at(&camera, x + to_plane * bent - p.eye) * (-absorption * to_plane as f32).exp()
                } else {
                    assert_eq!(p.outcome, OUTCOME_HIT, "{}", label());
                    let Some(out) = snell(bent, -wall, IOR) else { continue };
                    through.push(degrees(p.found, out));
                    let lost = fresnel(out.dot(wall) as f32, bent.dot(wall) as f32, IOR as f32, false);
                    let y = x + far * bent;
                    let absorbed = (-absorption * far as f32).exp();
                    reflected_far =
                        (1.0 - light) * lost * absorbed * env_color(sky, bent - 2.0 * bent.dot(wall) * wall);
                    (1.0 - lost) * absorbed * seen_at(&camera, y + hit(y, out) * out - p.eye)
                };
                let want = mirror + reflected_far + (1.0 - light) * brought;
                colors.push(f64::from((Vec3::from(shot.picture[p.index]) - want).abs().max_element()));
            }
            let label = format!("{refractions} refractions, plane at {plane}");
            println!("{label}: {dry} dry, {} in the liquid, {wetted} of them beyond it", inside.len());
            assert!(dry > 1000 || plane < 0.0, "{label}: {dry}");
            assert!(left < 3000, "{label}: {left} pixels left the view");
            // Half a pixel of the picture is 0.001 of colour.
            if plane < 0.5 {
                within(&format!("{label}: colour"), driver, colors, 10_000, 2e-3, 5e-3);
            } else {
                assert!(dry > 76_000, "{label}: {dry}");
            }
            if refractions > 1 && plane == 0.0 || plane == -0.2 {
                within(&format!("{label}: length to the plane, in radii"), driver, inside, 10_000, 1e-2, 2e-2);
            }
            if plane == -0.2 {
                assert!(wetted > 1000, "{label}: {wetted}");
            }
            if refractions > 1 && plane == -1.0 {
                within(&format!("{label}: direction, degrees"), driver, through, 10_000, 0.02, 0.06);
            }
        });
    }
}

/// A ball before a slab, and an opaque plane between them: the second volume is not reached, and the plane's colour comes
/// back. Behind the slab the plane is met after four refractions.
#[test]
fn a_plane_between_two_volumes_ends_the_ray() {
    let ball = sphere(Vec3::new(0.0, 0.0, 0.7), 0.3);
    let slab = Ellipsoid { center: Vec3::new(0.0, 0.0, -0.7), axes: Mat3::from_diagonal(Vec3::new(9.0, 9.0, 0.1)) };
    let camera = view(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 30.0);
    let case = case(RADIUS, &[ball], &[slab], camera, settings(4, 0));
    for (plane, hits, outcome) in [(0.0, 2.0, OUTCOME_SCENE), (-1.5, 4.0, OUTCOME_HIT)] {
        let painted = painted(SIZE, |_, _| 3.0 - plane);
        each_driver(|driver| {
            let scene = HostScene::new(driver.gpu(), &camera, SIZE, &painted);
            let shot = driver.shoot_before(&case, scene.input(), Background::Environment);
            let walk = shot.floats("walk (debug)", 0).expect("debug");
            let mut found = 0;
            for p in pixels(&case, &shot) {
                // Well inside: the ball sends these rays on to the middle of the view.
                if (ball.center.as_dvec3() - p.eye).cross(p.dir).length() > 0.2 {
                    continue;
                }
                found += 1;
                assert_eq!((p.outcome, walk[4 * p.index + 2]), (outcome, hits), "{}: {}", driver.name, p.index);
            }
            assert!(found > 1000, "{}: {found}", driver.name);
        });
    }
}

/// An eye in the liquid sees the scene straight ahead, as far as the liquid reaches.
#[test]
fn an_eye_inside_sees_the_scene_through_the_liquid() {
    let body = sphere(Vec3::ZERO, 2.0);
    let eye = Vec3::new(0.2, 0.1, 0.5);
    let camera = view(eye, eye - Vec3::Z, 60.0);
    let absorption = Vec3::new(0.4, 0.2, 0.9);
    for refractions in [1, 2, 4] {
        let mut case = case(RADIUS, &[], &[body], camera, settings(refractions, 0).absorption(absorption));
        case.eye_inside = true;
        let painted = painted(SIZE, |_, _| 1.2);
        each_driver(|driver| {
            let scene = HostScene::new(driver.gpu(), &camera, SIZE, &painted);
            let shot = driver.shoot_before(&case, scene.input(), Background::Environment);
            let (mut lengths, mut colors) = (Vec::new(), Vec::new());
            for p in pixels(&case, &shot) {
                // From the near plane; one refraction knows no length.
                let length = if refractions == 1 { 0.0 } else { 1.19 / p.slant };
                if refractions > 1 {
                    assert_eq!(p.outcome, OUTCOME_SCENE, "{}: pixel {}", driver.name, p.index);
                    lengths.push((p.length / length - 1.0).abs());
                }
                let want = painted.1[p.index] * (-absorption * length as f32).exp();
                colors.push(f64::from((Vec3::from(shot.picture[p.index]) - want).abs().max_element()));
            }
            within("eye inside, colour", driver, colors, 10_000, 1e-3, 1e-2);
            if refractions > 1 {
                within("eye inside, length", driver, lengths, 10_000, 1e-3, 2e-3);
            }
        });
    }
}

/// A floor just below the liquid, seen from within down to two degrees: wet, however flat the ray.
#[test]
fn a_floor_is_wet_at_flat_angles_too() {
    let slab = Ellipsoid { center: Vec3::ZERO, axes: Mat3::from_diagonal(Vec3::new(30.0, 0.1, 30.0)) };
    let eye = Vec3::new(0.0, 0.05, 2.0);
    let camera = view(eye, eye + Vec3::new(0.0, -0.08, -1.0), 15.0);
    let mut case = case(RADIUS, &[], &[slab], camera, settings(2, 0));
    case.eye_inside = true;
    let ray = |x: u32, y: u32| {
        let p = camera.projection.as_dmat4();
        let at = |v: u32, size: u32| (f64::from(v) + 0.5) / f64::from(size) * 2.0 - 1.0;
        DVec3::new(at(x, SIZE[0]) / p.x_axis.x, at(y, SIZE[1]) / p.y_axis.y, -1.0)
    };
    let to_world = Mat3::from_mat4(camera.view).as_dmat3().transpose();
    // Two radii below the lowest part of the liquid.
    let floor = -0.1 - 2.0 * f64::from(RADIUS);
    let depth_at = |x, y| {
        let down = (to_world * ray(x, y)).y;
        if down < 0.0 { (floor - 0.05) / down } else { f64::INFINITY }
    };
    let painted = painted(SIZE, depth_at);
    each_driver(|driver| {
        let scene = HostScene::new(driver.gpu(), &camera, SIZE, &painted);
        let shot = driver.shoot_before(&case, scene.input(), Background::Environment);
        let (mut seen, mut flat, mut dry) = (0, 0, 0);
        for p in pixels(&case, &shot) {
            // Two degrees and more, and where the slab is as thick as in its middle.
            if p.dir.y > -0.035 || (floor - 0.05) / p.dir.y > 4.5 {
                continue;
            }
            seen += 1;
            flat += usize::from(p.dir.y > -0.1);
            dry += usize::from(p.outcome != OUTCOME_SCENE);
        }
        println!("{}: {dry} of {seen} dry, {flat} flatter than 6 degrees", driver.name);
        assert!(flat > 5000 && dry * 100 <= seen, "{}: {dry} of {seen} dry, {flat} flat", driver.name);
    });
}

/// Boxes among, before and behind droplets and a body, some of them half in it, and the host's sky beside them.
#[test]
fn random_scenes_are_met_as_the_twin_meets_them() {
    let size = [240, 180];
    let tinted = Vec3::new(0.2, 1.5, 3.0);
    let blocks = |x: u32, y: u32| match (x / 30 + 2 * (y / 30)) % 5 {
        0 => 1.9 + 0.002 * f64::from(x), // slanted
        1 => 2.3,
        2 => 2.0 + 0.004 * f64::from(y),
        3 => 4.0,
        _ => f64::INFINITY,
    };
    for background in [Background::Environment, Background::Host] {
        for (seed, refractions) in [(1, 4), (2, 2), (3, 1)] {
            let particles = random_cloud(seed, 0.12, Vec3::new(-0.8, -0.6, -0.5), Vec3::new(0.8, 0.6, 0.5), 12, 40);
            let settings = imai16().refractions(refractions).absorption(tinted);
            let camera = crate::support::camera(Vec3::new(0.3, 0.4, 2.2), Vec3::ZERO, size);
            let case = crate::support::Case { particles, camera, settings, size, eye_inside: false };
            let painted = painted(size, blocks);
            each_driver(|driver| crate::walk::compare_before(driver, &case, &painted, background));
        }
    }
}

/// A wall far behind a ball at the left of a wide picture: rays through its rim cross more than a thousand columns before they meet it.
#[test]
fn a_scene_is_met_across_a_wide_picture() {
    let (size, half) = ([4000, 16], 0.0875f32);
    let aspect = size[0] as f32 / size[1] as f32;
    let camera =
        Camera::look_at(Vec3::new(0.0, 0.0, 20.0), Vec3::ZERO, Vec3::Y, 2.0 * (half / aspect).atan(), aspect, 0.01);
    let particles =
        Particles { radius: 0.2, ellipsoids: vec![sphere(Vec3::new(-1.5, 0.0, 0.0), 0.2)], splash_count: 0 };
    let case = crate::support::Case { particles, camera, settings: imai16().refractions(1), size, eye_inside: false };
    let painted = painted(size, |_, _| 28.0);
    each_driver(|driver| crate::walk::compare_before(driver, &case, &painted, Background::Environment));
}

/// Bytes of an output of one colour.
fn filled(rgba: [f32; 4]) -> Vec<u8> {
    bytemuck::cast_slice(&rgba.repeat((host::SIZE[0] * host::SIZE[1]) as usize)).to_vec()
}

/// Renders over an output that holds something already.
fn over(
    driver: &Driver,
    before: [f32; 4],
    change: impl Fn(FrameInput<'_>) -> FrameInput<'_>,
    empty: bool,
) -> Vec<[f32; 4]> {
    let mut pixels = Vec::new();
    with_renderer(driver, FLOAT4, 1, |gpu, renderer| {
        let case = host::case(host::ball());
        if !empty {
            renderer.set_particles(&case.particles).expect("particles");
        }
        let output = Canvas::new(gpu, FLOAT4, 16, host::SIZE).expect("canvas");
        output.write(&filled(before), vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL).expect("written");
        let input = change(host::input(&case, 0, output.view));
        // SAFETY: `cmd` is recording outside rendering; the output was just brought into the stated layout.
        gpu.run(|cmd| Ok(unsafe { renderer.record(cmd, &input) }?)).expect("frame");
        let floats: Vec<f32> = bytemuck::pod_collect_to_vec(&output.read().expect("picture"));
        pixels = floats.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
    });
    pixels
}

#[test]
fn the_hosts_picture_stays_where_there_is_no_liquid() {
    const BEFORE: [f32; 4] = [0.25, 0.5, 0.75, 0.0];
    each_driver(|driver| {
        let own = over(driver, BEFORE, |input| input, false);
        assert!(own.iter().all(|p| p[3] == 1.0), "{}: every pixel is written", driver.name);
        let kept = over(driver, BEFORE, |input| input.background(Background::Host), false);
        let covered = kept.iter().filter(|p| p[3] == 1.0).count();
        println!("{}: {covered} of {} pixels show liquid", driver.name, kept.len());
        assert!(covered > 200 && covered < kept.len() / 2, "{}: {covered}", driver.name);
        for (own, kept) in own.iter().zip(&kept) {
            assert_eq!(if kept[3] == 1.0 { own } else { &BEFORE }, kept, "{}", driver.name);
        }
        let empty = over(driver, BEFORE, |input| input.background(Background::Host), true);
        assert!(empty.iter().all(|p| *p == BEFORE), "{}: nothing is drawn without liquid", driver.name);
    });
}

/// An environment whose colour is a linear function of the direction.
pub fn linear_light(dir: Vec3) -> [f32; 3] {
    (0.5 + 0.4 * dir).to_array()
}

/// What every pixel without liquid shows of such an environment, and how far off it may be.
fn assert_linear(driver: &Driver, what: &str, picture: &[[f32; 4]], camera: &Camera, most: f32) {
    let to_world = Mat3::from_mat4(camera.view).transpose();
    let p = camera.projection;
    let mut worst = 0f32;
    for (i, pixel) in picture.iter().enumerate() {
        let at = |v: u32, size: u32| (v as f32 + 0.5) / size as f32 * 2.0 - 1.0;
        let (x, y) = (at(i as u32 % host::SIZE[0], host::SIZE[0]), at(i as u32 / host::SIZE[0], host::SIZE[1]));
        let dir = to_world * Vec3::new(x / p.x_axis.x, y / p.y_axis.y, -1.0).normalize();
        // Around its poles the map has no texels to interpolate between.
        if dir.y.abs() > 0.998 {
            continue;
        }
        let want = Vec3::from(linear_light(dir));
        worst = worst.max((Vec3::new(pixel[0], pixel[1], pixel[2]) - want).abs().max_element());
    }
    println!("{}: {what}: {worst} off at most", driver.name);
    assert!(worst <= most, "{}: {what}: {worst}", driver.name);
}

/// The same in a cube of so many texels along an edge.
pub fn linear_cube(edge: u32) -> Vec<f32> {
    // Vulkan's table (cube map face selection): major axis, and directions in which s and t grow.
    let faces = [
        (Vec3::X, Vec3::NEG_Z, Vec3::NEG_Y),
        (Vec3::NEG_X, Vec3::Z, Vec3::NEG_Y),
        (Vec3::Y, Vec3::X, Vec3::Z),
        (Vec3::NEG_Y, Vec3::X, Vec3::NEG_Z),
        (Vec3::Z, Vec3::X, Vec3::NEG_Y),
        (Vec3::NEG_Z, Vec3::NEG_X, Vec3::NEG_Y),
    ];
    let at = |i: u32| (i as f32 + 0.5) / edge as f32 * 2.0 - 1.0;
    faces
        .iter()
        .flat_map(|(major, s, t)| (0..edge * edge).map(move |i| *major + at(i % edge) * *s + at(i / edge) * *t))
        .flat_map(|dir| Vec3::from(linear_light(dir.normalize())).extend(1.0).to_array())
        .collect()
}

/// Seen in every direction, without liquid: the host's cube as Vulkan's table of faces lays it out, and its own
/// equirectangular map.
#[test]
fn environments_may_be_the_hosts_own_images() {
    let edge = 64u32;
    let texels = linear_cube(edge);
    let map: Vec<f32> = (0..64u32 * 128)
        .flat_map(|i| {
            let polar = ((i / 128) as f32 + 0.5) / 64.0 * std::f32::consts::PI;
            let around = ((i % 128) as f32 + 0.5) / 64.0 * std::f32::consts::PI - std::f32::consts::PI;
            let dir = Vec3::new(polar.sin() * around.cos(), polar.cos(), polar.sin() * around.sin());
            Vec3::from(linear_light(dir)).extend(1.0).to_array()
        })
        .collect();
    each_driver(|driver| {
        with_renderer(driver, FLOAT4, 1, |gpu, renderer| {
            let cube = Canvas::cube(gpu, FLOAT4, 16, edge).expect("cube");
            cube.write(bytemuck::cast_slice(&texels), READ).expect("written");
            let equirect = Canvas::new(gpu, FLOAT4, 16, [128, 64]).expect("map");
            equirect.write(bytemuck::cast_slice(&map), READ).expect("written");
            for (shape, view) in [(EnvironmentShape::Cube, cube.view), (EnvironmentShape::Equirect, equirect.view)] {
                for target in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z, Vec3::ONE] {
                    let up = if target.y.abs() == 1.0 { Vec3::Z } else { Vec3::Y };
                    let aspect = host::SIZE[0] as f32 / host::SIZE[1] as f32;
                    let mut camera = Camera::look_at(Vec3::ZERO, target, up, 2.0, aspect, 0.1);
                    camera.up = Vec3::Y;
                    let settings = imai16();
                    let output = Canvas::new(gpu, FLOAT4, 16, host::SIZE).expect("canvas");
                    output.write(&filled([0.0; 4]), vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL).expect("written");
                    let input = FrameInput::new(0, &camera, &settings, output.view)
                        .environment(EnvironmentInput::new(view, READ, shape));
                    // SAFETY: as in `over`; the environment was written and is in this layout.
                    gpu.run(|cmd| Ok(unsafe { renderer.record(cmd, &input) }?)).expect("frame");
                    let floats: Vec<f32> = bytemuck::pod_collect_to_vec(&output.read().expect("picture"));
                    let picture: Vec<_> = floats.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
                    // Interpolation between texels 1/32 apart (pi/64 for the map) on a sphere: the square of that over 8;
                    // towards a corner a texel of the next face lies beside where the plane would go on.
                    let most = if shape == EnvironmentShape::Cube { 1.5e-3 } else { 5e-4 };
                    assert_linear(driver, &format!("{shape:?} towards {target}"), &picture, &camera, most);
                }
            }
        });
    });
}
