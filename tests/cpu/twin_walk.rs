//! The twin of the refraction pass on maps made here: spheres ray-cast in the test, against closed forms.

use glam::{DVec2, DVec3, Vec3};
use meniscus::{
    Camera, Equirect, Settings,
    inspect::{Walk as Rays, uniforms},
    optics::Optics,
    shader::{
        Frame, OUTCOME_HIT, OUTCOME_NO_LIQUID, OUTCOME_REFLECTION_LIMIT, PATTERN_BODY_SPLASH, PATTERN_NONE,
        PATTERN_SPLASH,
    },
    space::Space,
    twin::{
        background::env_color,
        normal::encode_normal,
        search::{Map, Maps},
        walk::{Walk, walk},
    },
};

const SIZE: [u32; 2] = [200, 160];
const IOR: f64 = 1.333;
/// Of a particle: the unit of maps and walks.
const RADIUS: f64 = 0.3;

/// A camera in the origin that looks down -z, so that eye and world space are one.
fn frame(settings: &Settings, bounds: (Vec3, Vec3)) -> Frame {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let camera = Camera::look_at(Vec3::ZERO, -Vec3::Z, Vec3::Y, 40f32.to_radians(), aspect, 0.01);
    uniforms(&camera, settings, SIZE, &Space::new(RADIUS as f32, Vec3::ZERO), bounds)
}

fn view_ray(frame: &Frame, pixel: usize) -> DVec3 {
    let pixel = DVec2::new((pixel % SIZE[0] as usize) as f64, (pixel / SIZE[0] as usize) as f64) + 0.5;
    ((pixel - frame.pixel_origin.as_dvec2()) / frame.pixel_scale.as_dvec2()).extend(-1.0)
}

/// Both crossings of a ray with a sphere.
fn crossings(o: DVec3, w: DVec3, center: DVec3, radius: f64) -> Option<(f64, f64)> {
    let middle = (center - o).dot(w);
    let square = radius * radius - (center - o - middle * w).length_squared();
    (square > 0.0).then(|| (middle - square.sqrt(), middle + square.sqrt()))
}

type Layer = (Vec<f32>, Vec<u32>);

/// Front and back maps of a sphere, given in world units.
fn sphere_maps(frame: &Frame, center: DVec3, radius: f64) -> [Layer; 2] {
    let pixels = 0..(SIZE[0] * SIZE[1]) as usize;
    [false, true].map(|back| {
        let texel = |pixel: usize| {
            let dir = view_ray(frame, pixel).normalize();
            let Some((near, far)) = crossings(DVec3::ZERO, dir, center, radius) else {
                return (0.0, 0);
            };
            let x = if back { far } else { near } * dir;
            ((-x.z / RADIUS) as f32, encode_normal((x - center).as_vec3()))
        };
        pixels.clone().map(texel).unzip()
    })
}

fn as_maps(layers: &[Layer; 2]) -> [Map<'_>; 2] {
    layers.each_ref().map(|(depth, normal)| Map { depth, normal })
}

fn snell(w: DVec3, n: DVec3, eta: f64) -> Option<DVec3> {
    let along = w - w.dot(n) * n;
    let sine = eta * along.length();
    (sine <= 1.0).then(|| eta * along - (1.0 - sine * sine).sqrt() * n)
}

/// Through a ball: where the ray leaves, which way, and how long it was inside.
fn through(o: DVec3, w: DVec3, center: DVec3, radius: f64) -> Option<(DVec3, DVec3, f64)> {
    let x = o + crossings(o, w, center, radius)?.0 * w;
    let w = snell(w, (x - center) / radius, 1.0 / IOR)?;
    let length = 2.0 * (center - x).dot(w);
    let x = x + length * w;
    Some((x, snell(w, (center - x) / radius, IOR)?, length))
}

fn degrees(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// Two refractions, or four, with so many reflections inside; and what the walk is told of them.
fn optics(name: &str, reflections: u32) -> (Settings, Rays) {
    let mut settings = Settings::default();
    settings.method.optics = Optics::named(name).expect("optics");
    settings.set("internal_reflections", &reflections.to_string()).expect("a parameter");
    (settings, Rays::of(&settings.method.optics).expect("they walk"))
}

fn walk_all(maps: &Maps, settings: &Rays, sky: &Equirect) -> Vec<Walk> {
    let width = SIZE[0] as usize;
    let world = |w: Walk| Walk { length: w.length * RADIUS, ..w };
    (0..width * SIZE[1] as usize).map(|i| world(walk(maps, settings, sky, [i % width, i / width]))).collect()
}

fn grey() -> Equirect {
    Equirect::new(2, 1, &[[0.5; 3], [0.5; 3]]).unwrap()
}

#[test]
fn a_ball_is_left_as_the_closed_form_says() {
    let (settings, rays) = optics("two", 4);
    let (center, radius) = (DVec3::new(0.1, -0.05, -1.2), 0.3);
    let frame = frame(&settings, (Vec3::new(-0.2, -0.35, -1.5), Vec3::new(0.4, 0.25, -0.9)));
    let layers = sphere_maps(&frame, center, radius);
    let maps = Maps { frame: &frame, maps: [as_maps(&layers), [Map::default(); 2]], scene: None };
    let mut compared = 0;
    for (i, found) in walk_all(&maps, &rays, &grey()).iter().enumerate() {
        let dir = view_ray(&frame, i).normalize();
        let Some((_, exit, length)) = through(DVec3::ZERO, dir, center, radius) else {
            assert_eq!((found.pattern, found.outcome), (PATTERN_NONE, OUTCOME_NO_LIQUID));
            assert!(degrees(found.direction, dir) < 1e-4);
            continue;
        };
        assert_eq!(found.pattern, PATTERN_SPLASH);
        // No light is lost: all of it comes from a grey that is the same everywhere.
        assert!((found.color - 0.5).abs().max_element() < 1e-5, "{}", found.color);
        if center.cross(dir).length() < 0.9 * radius {
            assert_eq!((found.outcome, found.hits), (OUTCOME_HIT, 2));
            // Bilinear maps of a ball of 55 pixels' radius, normals of 16 bits.
            assert!(degrees(found.direction, exit) < 0.05, "{i}: {}", degrees(found.direction, exit));
            assert!((found.length / length - 1.0).abs() < 1e-3, "{i}: {} {length}", found.length);
            compared += 1;
        }
    }
    assert!(compared > 3000, "{compared}");
}

#[test]
fn absorption_follows_the_length_inside() {
    let absorption = Vec3::new(0.5, 1.0, 4.0);
    let (mut settings, rays) = optics("two", 4);
    settings.liquid.absorption = absorption;
    let (center, radius) = (DVec3::new(0.0, 0.0, -1.2), 0.3);
    let frame = frame(&settings, (Vec3::new(-0.3, -0.3, -1.5), Vec3::new(0.3, 0.3, -0.9)));
    let layers = sphere_maps(&frame, center, radius);
    let maps = Maps { frame: &frame, maps: [as_maps(&layers), [Map::default(); 2]], scene: None };
    let found = walk(&maps, &rays, &grey(), [SIZE[0] as usize / 2, SIZE[1] as usize / 2]);
    // Straight through the middle: 0.6 inside; what is reflected before was not absorbed.
    let f = ((IOR - 1.0) / (IOR + 1.0)).powi(2) as f32;
    let expected = 0.5 * (f + (1.0 - f) * (-0.6 * absorption).exp());
    assert!((found.color - expected).abs().max_element() < 2e-4, "{} {expected}", found.color);
}

#[test]
fn two_balls_in_a_row_bend_light_four_times() {
    let (settings, rays) = optics("four", 4);
    let frame = frame(&settings, (Vec3::new(-0.5, -0.5, -3.0), Vec3::new(0.5, 0.5, -0.9)));
    let (near, far) = ((DVec3::new(0.05, 0.02, -1.15), 0.2), (DVec3::new(0.0, 0.0, -2.3), 0.5));
    let (body, splash) = (sphere_maps(&frame, near.0, near.1), sphere_maps(&frame, far.0, far.1));
    let maps = Maps { frame: &frame, maps: [as_maps(&splash), as_maps(&body)], scene: None };
    let mut compared = 0;
    for (i, found) in walk_all(&maps, &rays, &grey()).iter().enumerate() {
        let dir = view_ray(&frame, i).normalize();
        if near.0.cross(dir).length() > 0.6 * near.1 {
            continue;
        }
        let (x, out, first) = through(DVec3::ZERO, dir, near.0, near.1).unwrap();
        let Some((_, exit, second)) = through(x, out, far.0, far.1) else {
            continue;
        };
        assert_eq!((found.pattern, found.outcome, found.hits), (PATTERN_BODY_SPLASH, OUTCOME_HIT, 4), "{i}");
        assert!(degrees(found.direction, exit) < 0.2, "{i}: {}", degrees(found.direction, exit));
        assert!((found.length / (first + second) - 1.0).abs() < 2e-3, "{i}");
        compared += 1;
    }
    assert!(compared > 500, "{compared}");
}

#[test]
fn an_eye_in_a_ball_meets_the_critical_angle() {
    let (settings, rays) = optics("two", 0);
    let (center, radius) = (DVec3::new(0.8, 0.0, 0.0), 1.0);
    let frame = frame(&settings, (Vec3::new(-0.2, -1.0, -1.0), Vec3::new(1.8, 1.0, 1.0)));
    let mut layers = sphere_maps(&frame, center, radius);
    // The front lies behind the near plane: as the ray cast writes it.
    layers[0].0.fill((-0.01 / RADIUS) as f32);
    let maps = Maps { frame: &frame, maps: [as_maps(&layers), [Map::default(); 2]], scene: None };
    let mut counts = [0, 0];
    for (i, found) in walk_all(&maps, &rays, &grey()).iter().enumerate() {
        let v = view_ray(&frame, i);
        let (start, dir) = (0.01 * v, v.normalize());
        let far = crossings(start, dir, center, radius).unwrap().1;
        let n = (start + far * dir - center) / radius;
        if (IOR * dir.cross(n).length() - 1.0).abs() < 0.01 {
            continue;
        }
        let (outcome, exit) = match snell(dir, -n, IOR) {
            Some(bent) => (OUTCOME_HIT, bent),
            None => (OUTCOME_REFLECTION_LIMIT, dir - 2.0 * dir.dot(n) * n),
        };
        assert_eq!(found.outcome, outcome, "{i}");
        assert!(degrees(found.direction, exit) < 0.05, "{i}: {}", degrees(found.direction, exit));
        assert!((found.length - far).abs() < 1e-3);
        counts[usize::from(outcome == OUTCOME_HIT)] += 1;
    }
    assert!(counts.into_iter().all(|n| n > 1000), "{counts:?}");
}

#[test]
fn the_environment_turns_around_and_down() {
    // Two rows of four columns: red counts columns from atan2(z, x) = -pi, green rows from the top.
    let texel = |i: usize| [(i % 4) as f32, (i / 4) as f32, 0.0];
    let map = Equirect::new(4, 2, &(0..8).map(texel).collect::<Vec<_>>()).unwrap();
    let at = |x: f64, y: f64, z: f64| env_color(&map, DVec3::new(x, y, z).normalize());
    assert!((at(-1.0, 1.0, -1.0).x - 0.0).abs() < 1e-6, "the middle of column 0");
    assert!((at(1.0, 1.0, -1.0).x - 1.0).abs() < 1e-6);
    assert!((at(1.0, 1.0, 1.0).x - 2.0).abs() < 1e-6);
    assert!((at(-1.0, 1.0, 1.0).x - 3.0).abs() < 1e-6);
    // Between the last column and the first lies their mean: the map wraps around.
    assert!((at(-1.0, 0.0, 0.0).x - 1.5).abs() < 1e-6);
    assert_eq!((at(0.0, 1.0, 0.0).y, at(0.0, -1.0, 0.0).y), (0.0, 1.0), "the poles");
    assert!((at(1.0, 0.0, 1.0).y - 0.5).abs() < 1e-6, "the horizon");
}
