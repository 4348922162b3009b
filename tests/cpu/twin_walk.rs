//! The twin of the refraction pass on maps made here: spheres ray-cast in the test, against closed forms. As splashes they are
//! balls, as body they are what their maps hold.

use glam::{DVec2, DVec3, Vec3};
use meniscus::{
    Camera, Equirect, Settings,
    inspect::{Walk as Rays, uniforms},
    optics::Optics,
    shader::{
        Frame, OUTCOME_HIT, OUTCOME_NO_LIQUID, OUTCOME_REFLECTION_LIMIT, OUTCOME_SIDE_WALL, PATTERN_BODY,
        PATTERN_BODY_SPLASH, PATTERN_NONE, PATTERN_SPLASH, PATTERN_SPLASH_SPLASH, SPLASH_RADIUS,
    },
    space::Space,
    twin::{
        background::env_color,
        normal::encode_normal,
        walk::{Walk, walk},
        walls::{Entry, Map, Maps, Ray},
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

/// A sphere: its centre and radius, in world units.
type Sphere = (DVec3, f64);

/// Maps of splashes: of the nearest at each pixel the depths of both its sides, and the normal of the nearer one.
fn splash_maps(frame: &Frame, spheres: &[Sphere]) -> [Layer; 2] {
    let mut maps: [Layer; 2] = [0, 1].map(|_| (vec![0.0; (SIZE[0] * SIZE[1]) as usize], Vec::new()));
    maps[0].1 = vec![0; maps[0].0.len()];
    for (center, radius) in spheres {
        let [front, back] = sphere_maps(frame, *center, *radius);
        for i in (0..front.0.len()).filter(|i| front.0[*i] > 0.0) {
            if maps[0].0[i] == 0.0 || front.0[i] < maps[0].0[i] {
                (maps[0].0[i], maps[0].1[i], maps[1].0[i]) = (front.0[i], front.1[i], back.0[i]);
            }
        }
    }
    maps
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

const NOTHING: [Map; 2] = [Map { depth: &[], normal: &[] }; 2];

#[test]
fn a_ball_is_left_as_the_closed_form_says() {
    let (settings, rays) = optics("two", 4);
    let (center, radius) = (DVec3::new(0.1, -0.05, -1.2), 0.3);
    let frame = frame(&settings, (Vec3::new(-0.2, -0.35, -1.5), Vec3::new(0.4, 0.25, -0.9)));
    let (body, splash) = (sphere_maps(&frame, center, radius), splash_maps(&frame, &[(center, radius)]));
    // A map of 55 pixels' radius resolves no back near the rim; of a ball all is known.
    let kinds = [
        (PATTERN_BODY, [NOTHING, as_maps(&body)], 0.9, 0.05, 1e-3, 3000),
        (PATTERN_SPLASH, [as_maps(&splash), NOTHING], 0.999, 0.05, 1e-3, 8000),
    ];
    for (pattern, maps, resolved, most_degrees, most_length, at_least) in kinds {
        let maps = Maps { frame: &frame, maps, scene: None };
        let mut compared = 0;
        for (i, found) in walk_all(&maps, &rays, &grey()).iter().enumerate() {
            let dir = view_ray(&frame, i).normalize();
            let Some((_, exit, length)) = through(DVec3::ZERO, dir, center, radius) else {
                assert_eq!((found.pattern, found.outcome), (PATTERN_NONE, OUTCOME_NO_LIQUID));
                assert!(degrees(found.direction, dir) < 1e-4);
                continue;
            };
            assert_eq!(found.pattern, pattern);
            // No light is lost: all of it comes from a grey that is the same everywhere.
            assert!((found.color - 0.5).abs().max_element() < 1e-5, "{}", found.color);
            if center.cross(dir).length() < resolved * radius {
                assert_eq!((found.outcome, found.hits), (OUTCOME_HIT, 2));
                // Normals have 16 bits.
                assert!(degrees(found.direction, exit) < most_degrees, "{i}: {}", degrees(found.direction, exit));
                assert!((found.length / length - 1.0).abs() < most_length, "{i}: {} {length}", found.length);
                compared += 1;
            }
        }
        assert!(compared > at_least, "{compared}");
    }
}

#[test]
fn absorption_follows_the_length_inside() {
    let absorption = Vec3::new(0.5, 1.0, 4.0);
    let (mut settings, rays) = optics("two", 4);
    settings.liquid.absorption = absorption;
    let (center, radius) = (DVec3::new(0.0, 0.0, -1.2), 0.3);
    let frame = frame(&settings, (Vec3::new(-0.3, -0.3, -1.5), Vec3::new(0.3, 0.3, -0.9)));
    let (body, splash) = (sphere_maps(&frame, center, radius), splash_maps(&frame, &[(center, radius)]));
    for maps in [[as_maps(&splash), NOTHING], [NOTHING, as_maps(&body)]] {
        let maps = Maps { frame: &frame, maps, scene: None };
        let found = walk(&maps, &rays, &grey(), [SIZE[0] as usize / 2, SIZE[1] as usize / 2]);
        // Straight through the middle: 0.6 inside; what is reflected before was not absorbed.
        let f = ((IOR - 1.0) / (IOR + 1.0)).powi(2) as f32;
        let expected = 0.5 * (f + (1.0 - f) * (-0.6 * absorption).exp());
        assert!((found.color - expected).abs().max_element() < 2e-4, "{} {expected}", found.color);
    }
}

#[test]
fn two_balls_in_a_row_bend_light_four_times() {
    let (settings, rays) = optics("four", 4);
    let frame = frame(&settings, (Vec3::new(-0.5, -0.5, -3.0), Vec3::new(0.5, 0.5, -0.9)));
    let (near, far) = ((DVec3::new(0.05, 0.02, -1.15), 0.2), (DVec3::new(0.0, 0.0, -2.3), 0.5));
    let (body, splash) = (sphere_maps(&frame, near.0, near.1), splash_maps(&frame, &[far]));
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

/// As a splash it is of a splash's size, and followed through a reflection; as body it ends at the first.
#[test]
fn an_eye_in_a_ball_meets_the_critical_angle() {
    let radius = RADIUS * f64::from(SPLASH_RADIUS);
    let center = DVec3::new(0.8 * radius, 0.0, 0.0);
    for (splash, reflections) in [(true, 0), (true, 1), (false, 0)] {
        let (settings, rays) = optics("two", reflections);
        let frame = frame(&settings, (center.as_vec3() - radius as f32, center.as_vec3() + radius as f32));
        let mut layers = sphere_maps(&frame, center, radius);
        // The front lies behind the near plane: as the ray cast writes it, with the normal of the other side.
        layers[0].0.fill((-0.01 / RADIUS) as f32);
        layers[0].1 = layers[1].1.clone();
        let maps = if splash { [as_maps(&layers), NOTHING] } else { [NOTHING, as_maps(&layers)] };
        let maps = Maps { frame: &frame, maps, scene: None };
        let mut counts = [0, 0];
        for (i, found) in walk_all(&maps, &rays, &grey()).iter().enumerate() {
            let v = view_ray(&frame, i);
            let (mut x, mut dir, mut length, mut left) = (0.01 * v, v.normalize(), 0.0, false);
            let mut close = false;
            for _ in 0..=reflections {
                let t = crossings(x, dir, center, radius).unwrap().1;
                (x, length) = (x + t * dir, length + t);
                let n = (x - center) / radius;
                close |= (IOR * dir.cross(n).length() - 1.0).abs() < 0.01;
                let bent = snell(dir, -n, IOR);
                left = bent.is_some();
                dir = bent.unwrap_or(dir - 2.0 * dir.dot(n) * n);
                if left {
                    break;
                }
            }
            if close {
                continue;
            }
            assert_eq!(found.outcome, if left { OUTCOME_HIT } else { OUTCOME_REFLECTION_LIMIT }, "{i}");
            assert!(degrees(found.direction, dir) < 0.05, "{i}: {}", degrees(found.direction, dir));
            assert!((found.length - length).abs() < 1e-3, "{i}: {} {length}", found.length);
            counts[usize::from(left)] += 1;
        }
        assert!(counts.into_iter().all(|n| n > 1000), "{counts:?}");
    }
}

/// From the middle of a ball of the body across the view, where its maps end.
#[test]
fn a_ball_of_the_body_is_left_through_its_limb() {
    let (settings, _) = optics("two", 0);
    let (center, radius) = (DVec3::new(0.0, 0.0, -1.2), 0.3);
    let frame = frame(&settings, (Vec3::splat(-2.0), Vec3::splat(2.0)));
    let layers = sphere_maps(&frame, center, radius);
    let maps = Maps { frame: &frame, maps: [NOTHING, as_maps(&layers)], scene: None };
    let mut side_walls = 0;
    for k in 0..360 {
        // The limb is where the sphere is seen edge on, a little nearer than its centre.
        let (across, nearer) = (f64::from(k).to_radians(), radius / 1.2);
        let dir = (DVec3::new(across.cos(), across.sin(), 0.0) * (1.0 - nearer * nearer).sqrt()).with_z(nearer);
        let ray = Ray::new(&frame, center / RADIUS, dir);
        let wall = maps.leave_body(&ray).expect("a wall");
        // A pixel is 0.02 radii.
        assert!((wall.inside * RADIUS - radius).abs() < 0.01, "{k}: {}", wall.inside * RADIUS);
        // Where the ball is thinner than twice what is accepted, its limb is its front or its back.
        let off = degrees(wall.normal, dir);
        assert!(off < if wall.side_wall { 1.0 } else { 3.5 }, "{k}: {off}");
        side_walls += usize::from(wall.side_wall);
    }
    assert!(side_walls > 250, "{side_walls}");
}

/// One ball hides the other's middle. Rays that go straight on never see the other; those bent outwards do, and enter it through
/// whatever part of it they meet.
#[test]
fn two_droplets_behind_each_other_are_not_fused() {
    let (settings, rays) = optics("four", 0);
    let frame = frame(&settings, (Vec3::new(-0.5, -0.5, -3.0), Vec3::new(0.5, 0.5, -0.9)));
    let (near, far) = ((DVec3::new(0.05, 0.02, -1.2), 0.15), (DVec3::new(0.0, 0.0, -2.3), 0.5));
    let splash = splash_maps(&frame, &[near, far]);
    let maps = Maps { frame: &frame, maps: [as_maps(&splash), NOTHING], scene: None };
    let mut counts = [0, 0];
    for (i, found) in walk_all(&maps, &rays, &grey()).iter().enumerate() {
        let dir = view_ray(&frame, i).normalize();
        if near.0.cross(dir).length() > 0.99 * near.1 {
            continue;
        }
        let (x, out, first) = through(DVec3::ZERO, dir, near.0, near.1).unwrap();
        let Some((_, exit, second)) = through(x, out, far.0, far.1).filter(|_| found.pattern != PATTERN_SPLASH) else {
            assert_eq!(found.hits, 2, "{i}");
            assert!(degrees(found.direction, out) < 0.05, "{i}: {}", degrees(found.direction, out));
            assert!((found.length / first - 1.0).abs() < 1e-3, "{i}");
            counts[0] += 1;
            continue;
        };
        assert_eq!((found.pattern, found.outcome, found.hits), (PATTERN_SPLASH_SPLASH, OUTCOME_HIT, 4), "{i}");
        assert!(degrees(found.direction, exit) < 0.5, "{i}: {}", degrees(found.direction, exit));
        assert!((found.length / (first + second) - 1.0).abs() < 5e-3, "{i}");
        counts[1] += 1;
    }
    assert!(counts.into_iter().all(|n| n > 100), "{counts:?}");
}

/// Sideways and from behind, through the rim or where a map of fronts has nothing.
#[test]
fn a_ball_is_met_from_every_side() {
    let (settings, _) = optics("four", 0);
    let (center, radius) = (DVec3::new(0.05, -0.03, -1.2), 0.15);
    let frame = frame(&settings, (Vec3::splat(-2.0), Vec3::splat(2.0)));
    let splash = splash_maps(&frame, &[(center, radius)]);
    let maps = Maps { frame: &frame, maps: [as_maps(&splash), NOTHING], scene: None };
    let turn = |angle: f64| DVec3::new(angle.cos(), angle.sin(), 0.0);
    let (mut met, mut behind) = (0, 0);
    for k in 0..60 {
        for polar in (5..180).step_by(10).map(|degrees| f64::from(degrees).to_radians()) {
            // From all around, past the centre by different distances.
            let from = turn(0.1 + 0.1 * f64::from(k)) * polar.sin() + DVec3::Z * polar.cos();
            let past = 0.97 * radius * f64::from(k % 10) / 10.0 * from.any_orthonormal_vector();
            let ray = Ray::new(&frame, (center + past + 0.3 * from) / RADIUS, -from);
            let (t, _) = crossings(ray.origin * RADIUS, ray.dir, center, radius).unwrap();
            let n = (ray.origin * RADIUS + t * ray.dir - center) / radius;
            let Ok(Entry::Ball(ball, at)) = maps.enter(&ray) else { panic!("{k} {polar}: not met") };
            assert!((at * RADIUS - t).abs() < 1e-3 * radius, "{k} {polar}: {} {t}", at * RADIUS);
            assert!(degrees(ball.normal(ray.at(at)), n) < 0.1, "{k} {polar}");
            met += 1;
            behind += usize::from(n.dot((center + radius * n).normalize()) > 0.0);
        }
    }
    assert!(behind > 300 && met - behind > 300, "{behind} of {met} from behind");
}

/// A droplet half in the body, before it or behind: what is between them bends nothing.
#[test]
fn a_ball_and_a_body_that_overlap_are_one_liquid() {
    let (settings, rays) = optics("four", 4);
    let frame = frame(&settings, (Vec3::new(-0.6, -0.6, -2.2), Vec3::new(0.6, 0.6, -0.9)));
    let body = (DVec3::new(0.0, 0.0, -1.6), 0.4);
    let maps_of_body = sphere_maps(&frame, body.0, body.1);
    for (ball, pattern) in
        [((DVec3::new(0.04, 0.03, -1.2), 0.12), PATTERN_SPLASH), ((DVec3::new(0.04, 0.03, -2.0), 0.12), PATTERN_BODY)]
    {
        let splash = splash_maps(&frame, &[ball]);
        let maps = Maps { frame: &frame, maps: [as_maps(&splash), as_maps(&maps_of_body)], scene: None };
        let (first, last) = if pattern == PATTERN_SPLASH { (ball, body) } else { (body, ball) };
        let mut compared = 0;
        for (i, found) in walk_all(&maps, &rays, &grey()).iter().enumerate() {
            let dir = view_ray(&frame, i).normalize();
            // Into the one, and out of the other if the ray is there by then.
            let Some((t, _)) = crossings(DVec3::ZERO, dir, first.0, first.1) else { continue };
            let x = t * dir;
            let inside = snell(dir, (x - first.0) / first.1, 1.0 / IOR).unwrap();
            let between = x + 2.0 * (first.0 - x).dot(inside) * inside;
            if between.distance(last.0) > 0.95 * last.1 || first.0.cross(dir).length() > 0.9 * first.1 {
                continue;
            }
            let length = crossings(x, inside, last.0, last.1).unwrap().1;
            let Some(exit) = snell(inside, (last.0 - x - length * inside) / last.1, IOR) else { continue };
            assert_eq!((found.pattern, found.outcome, found.hits), (pattern, OUTCOME_HIT, 2), "{i}");
            assert!(degrees(found.direction, exit) < 0.2, "{i}: {}", degrees(found.direction, exit));
            assert!((found.length / length - 1.0).abs() < 2e-3, "{i}: {} {length}", found.length);
            compared += 1;
        }
        assert!(compared > 200, "{compared}");
    }
}

#[test]
fn fronts_and_backs_that_cross_do_no_harm() {
    let (settings, rays) = optics("four", 4);
    let frame = frame(&settings, (Vec3::new(-0.2, -0.35, -1.5), Vec3::new(0.4, 0.25, -0.9)));
    let layers = sphere_maps(&frame, DVec3::new(0.1, -0.05, -1.2), 0.3);
    let mut crossed = layers.clone();
    let [front, back] = &mut crossed;
    for i in (0..front.0.len()).filter(|i| i % 3 == 0) {
        std::mem::swap(&mut front.0[i], &mut back.0[i]);
    }
    let [plain, crossed] = [layers, crossed].map(|layers| {
        walk_all(&Maps { frame: &frame, maps: [NOTHING, as_maps(&layers)], scene: None }, &rays, &grey())
    });
    assert!(plain == crossed);
}

/// A body of one pixel has walls all around it, the planes through the eye and the pixel's edges, which mirror a ray that comes in
/// through a tilted front: off one and the other, and out as it came in.
#[test]
fn a_lone_pixel_of_body_is_walked_through() {
    let (settings, rays) = optics("four", 4);
    let frame = frame(&settings, (Vec3::splat(-20.0), Vec3::splat(20.0)));
    let pixel = [SIZE[0] as usize / 2, SIZE[1] as usize / 2];
    let index = pixel[1] * SIZE[0] as usize + pixel[0];
    for tilt in [0.0, 0.8] {
        let n = DVec3::new(f64::sin(tilt), 0.0, f64::cos(tilt));
        let layers = [(40.0, n), (42.0, -n)].map(|(depth, n)| {
            let mut layer = (vec![0.0; (SIZE[0] * SIZE[1]) as usize], vec![0; (SIZE[0] * SIZE[1]) as usize]);
            (layer.0[index], layer.1[index]) = (depth, encode_normal(n.as_vec3()));
            layer
        });
        let maps = Maps { frame: &frame, maps: [NOTHING, as_maps(&layers)], scene: None };
        let found = walk(&maps, &rays, &grey(), pixel);
        let bent = snell(view_ray(&frame, index).normalize(), n, 1.0 / IOR).unwrap();
        let (outcome, hits) = if tilt == 0.0 { (OUTCOME_HIT, 2) } else { (OUTCOME_SIDE_WALL, 4) };
        assert_eq!((found.pattern, found.outcome, found.hits), (PATTERN_BODY, outcome, hits), "{found:?}");
        assert!((found.color - 0.5).abs().max_element() < 1e-5, "{found:?}");
        // The edges' planes are a pixel apart at the eye, 0.26 degrees: twice that inside, and half as much again outside.
        assert!((found.length * bent.z.abs() / 2.0 - 1.0).abs() < 0.01, "{found:?}");
        assert!(degrees(found.direction, view_ray(&frame, index)) < 1.0, "{found:?}");
    }
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
