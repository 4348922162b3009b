//! Scenes with closed-form answers, no twin: balls, flat and tilted slabs, an eye inside. Everything expected is
//! computed here in double precision from the ellipsoids themselves.

use crate::{
    support::{Case, Choose, Driver, Shot, each_driver, imai16, sphere},
    walk::degrees,
};
use glam::{DMat3, DVec3, Mat3, Vec3};
use meniscus::{
    Camera, Ellipsoid, Particles, Settings,
    shader::{
        OUTCOME_HIT, OUTCOME_LEFT_VIEW, OUTCOME_REFLECTION_LIMIT, PATTERN_BODY, PATTERN_SPLASH, PATTERN_SPLASH_BODY,
        SPLASH_RADIUS,
    },
    twin::normal::decode_normal,
};

const IOR: f64 = 1.333;

/// (x - c)ᵀ M (x - c) = 1.
pub struct Quadric {
    c: DVec3,
    m: DMat3,
}

impl Quadric {
    pub fn new(e: &Ellipsoid) -> Quadric {
        let a = e.axes.as_dmat3();
        Quadric { c: e.center.as_dvec3(), m: (a * a.transpose()).inverse() }
    }

    /// Both crossings of a line.
    pub fn crossings(&self, o: DVec3, w: DVec3) -> Option<(f64, f64)> {
        let q = o - self.c;
        let (a, b, c) = (w.dot(self.m * w), w.dot(self.m * q), q.dot(self.m * q) - 1.0);
        let root = b * b - a * c;
        (root > 0.0).then(|| ((-b - root.sqrt()) / a, (-b + root.sqrt()) / a))
    }

    pub fn normal(&self, x: DVec3) -> DVec3 {
        (self.m * (x - self.c)).normalize()
    }
}

/// Snell's law; `n` against the ray. `None` beyond the critical angle.
pub fn snell(w: DVec3, n: DVec3, eta: f64) -> Option<DVec3> {
    let along = w - w.dot(n) * n; // the part along the surface grows by eta
    let sine = eta * along.length();
    (sine <= 1.0).then(|| eta * along - (1.0 - sine * sine).sqrt() * n)
}

/// A ray inside a quadric until it leaves it, or has been reflected more than `limit` times.
pub struct Passage {
    pub at: DVec3,
    pub dir: DVec3,
    pub length: f64,
    reflections: u32,
    pub limited: bool,
    /// Smallest |sin i / sin critical - 1| on the way: near 0 a rounding error decides.
    pub margin: f64,
    /// Smallest |cosine| between surface and view at the walls: near 0 lies the silhouette, where the maps end.
    rim: f64,
}

fn inside(q: &Quadric, eye: DVec3, mut at: DVec3, mut dir: DVec3, limit: u32) -> Passage {
    let (mut length, mut reflections, mut margin, mut rim) = (0.0, 0, f64::INFINITY, 1.0);
    loop {
        let t = q.crossings(at, dir).expect("a ray inside leaves").1;
        at += t * dir;
        length += t;
        let n = q.normal(at);
        margin = f64::min(margin, (IOR * dir.cross(n).length() - 1.0).abs());
        rim = f64::min(rim, n.dot((at - eye).normalize()).abs());
        match snell(dir, -n, IOR) {
            Some(bent) => return Passage { at, dir: bent, length, reflections, limited: false, margin, rim },
            None => {
                dir -= 2.0 * dir.dot(n) * n;
                if reflections == limit {
                    return Passage { at, dir, length, reflections, limited: true, margin, rim };
                }
                reflections += 1;
            }
        }
    }
}

/// Into a quadric from outside and out again; also the cosine at which the ray enters.
pub fn through(q: &Quadric, o: DVec3, w: DVec3, limit: u32) -> Option<(Passage, f64)> {
    let near = q.crossings(o, w)?.0;
    let at = o + near * w;
    let n = q.normal(at);
    let bent = snell(w, n, 1.0 / IOR).expect("there is no critical angle into water");
    Some((inside(q, o, at, bent, limit), -w.dot(n)))
}

pub const SIZE: [u32; 2] = [320, 240];

pub fn view(eye: Vec3, target: Vec3, fov_degrees: f32) -> Camera {
    Camera::look_at(eye, target, Vec3::Y, fov_degrees.to_radians(), SIZE[0] as f32 / SIZE[1] as f32, 0.01)
}

pub fn case(radius: f32, splash: &[Ellipsoid], body: &[Ellipsoid], camera: Camera, settings: Settings) -> Case {
    let particles = Particles { radius, ellipsoids: [splash, body].concat(), splash_count: splash.len() };
    Case { particles, camera, settings, size: SIZE, eye_inside: false }
}

pub fn settings(refractions: u32, internal_reflections: u32) -> Settings {
    imai16().refractions(refractions).reflections(internal_reflections).iterations(0)
}

/// One pixel: where its ray starts and runs in the world (from the camera's matrices alone), and what the GPU found.
pub struct Pixel {
    pub index: usize,
    pub eye: DVec3,
    pub dir: DVec3,
    /// Cosine between the ray and the view axis: depth per length.
    pub slant: f64,
    pub pattern: u32,
    pub outcome: u32,
    pub length: f64,
    pub found: DVec3,
}

pub fn pixels(case: &Case, shot: &Shot) -> Vec<Pixel> {
    let (walk, direction) =
        (shot.floats("walk (debug)", 0).unwrap(), shot.floats("final direction (debug)", 0).unwrap());
    let numbers = walk.iter().chain(&direction).chain(shot.picture.as_flattened());
    assert!(numbers.into_iter().all(|v| v.is_finite()), "not finite");
    let to_world = case.camera.view.as_dmat4().inverse();
    let p = case.camera.projection.as_dmat4();
    let ndc = |v: u32, size: u32| (f64::from(v) + 0.5) / f64::from(size) * 2.0 - 1.0;
    let ray = |index: usize| {
        let (x, y) = (ndc(index as u32 % SIZE[0], SIZE[0]), ndc(index as u32 / SIZE[0], SIZE[1]));
        let v = DVec3::new(x / p.x_axis.x, y / p.y_axis.y, -1.0);
        let (w, d) = (&walk[4 * index..], &direction[4 * index..]);
        Pixel {
            index,
            eye: to_world.transform_point3(DVec3::ZERO),
            dir: to_world.transform_vector3(v.normalize()),
            slant: 1.0 / v.length(),
            pattern: w[0] as u32,
            outcome: w[1] as u32,
            length: f64::from(w[3]) * shot.space.radius,
            found: DVec3::new(f64::from(d[0]), f64::from(d[1]), f64::from(d[2])),
        }
    };
    (0..(SIZE[0] * SIZE[1]) as usize).map(ray).collect()
}

/// That many errors, of which 99 % and all stay within their limits.
#[track_caller]
pub fn within(what: &str, driver: &Driver, mut errors: Vec<f64>, at_least: usize, most: f64, all: f64) {
    errors.sort_by(f64::total_cmp);
    assert!(errors.len() >= at_least, "{what}: only {} pixels to compare", errors.len());
    let (p99, max) = (errors[(errors.len() - 1) * 99 / 100], errors[errors.len() - 1]);
    println!("{what}: {} pixels, median {:.2e}, 99 % {p99:.2e}, max {max:.2e}", errors.len(), errors[errors.len() / 2]);
    assert!(p99 <= most && max <= all, "{what} on {}: 99 % within {p99:e}, all within {max:e}", driver.name);
}

/// Silhouette, exit direction (two refractions) and path length of a ball, in the middle of the view and off its axis.
#[test]
fn a_ball_bends_light_twice() {
    for center in [Vec3::ZERO, Vec3::new(0.75, 0.5, -0.2)] {
        let ball = sphere(center, 0.4);
        let case = case(0.4, &[ball], &[], view(Vec3::new(0.0, 0.0, 2.5), Vec3::ZERO, 45.0), settings(2, 0));
        let q = Quadric::new(&ball);
        each_driver(|driver| {
            let (mut angles, mut lengths) = (Vec::new(), Vec::new());
            for p in pixels(&case, &driver.shoot(&case)) {
                // Within 1e-5 of the silhouette rounding may decide.
                let distance = (q.c - p.eye).cross(p.dir).length() / 0.4;
                if (distance - 1.0).abs() > 1e-5 {
                    assert_eq!(p.pattern == PATTERN_SPLASH, distance < 1.0, "{}: pixel {}", driver.name, p.index);
                }
                // Nearer the rim a map of 45 pixels' radius no longer resolves the back.
                if distance < 0.93 {
                    let (exact, _) = through(&q, p.eye, p.dir, 0).unwrap();
                    assert_eq!(p.outcome, OUTCOME_HIT, "{}: pixel {}", driver.name, p.index);
                    angles.push(degrees(p.found, exact.dir));
                    lengths.push((p.length / exact.length - 1.0).abs());
                }
            }
            // Bilinear normals err by (pixel / radius)^2 / 8, 0.003 degrees, and more towards the rim; packing adds
            // as much. Lengths: the search stops within a five-thousandth of a radius and takes one step more.
            within("ball, exit direction, degrees", driver, angles, 4000, 0.03, 0.06);
            within("ball, path length, relative", driver, lengths, 4000, 3e-4, 1e-3);
        });
    }
}

/// A slab (an ellipsoid 60 times as wide as thick) leaves directions as they were; its own slight curvature is in
/// the closed form. A rounder ellipsoid does bend.
#[test]
fn slabs_and_ellipsoids_bend_light_twice() {
    let tilt = Mat3::from_rotation_x(0.7) * Mat3::from_rotation_y(0.4);
    let (wide, round) = (Vec3::new(9.0, 9.0, 0.15), Vec3::new(0.8, 0.5, 0.3));
    for (axes, tilt, slab) in [(wide, Mat3::from_rotation_y(0.5), true), (round, tilt, false)] {
        let body = Ellipsoid { center: Vec3::new(0.1, 0.0, 0.0), axes: tilt * Mat3::from_diagonal(axes) };
        let case = case(0.1, &[], &[body], view(Vec3::new(0.0, 0.0, 2.5), Vec3::ZERO, 30.0), settings(2, 0));
        let q = Quadric::new(&body);
        each_driver(|driver| {
            let (mut angles, mut lengths, mut kept) = (Vec::new(), Vec::new(), Vec::new());
            for p in pixels(&case, &driver.shoot(&case)) {
                let usable = |(e, cos): &(Passage, f64)| *cos >= 0.3 && !e.limited && e.margin >= 0.05;
                let Some((exact, _)) = through(&q, p.eye, p.dir, 0).filter(usable) else {
                    continue;
                };
                // The slab is wider than the view.
                if p.outcome != OUTCOME_LEFT_VIEW {
                    assert_eq!((p.pattern, p.outcome), (PATTERN_BODY, OUTCOME_HIT), "{}: {}", driver.name, p.index);
                    angles.push(degrees(p.found, exact.dir));
                    lengths.push((p.length / exact.length - 1.0).abs());
                    kept.push(degrees(p.found, p.dir));
                }
            }
            within("ellipsoid, exit direction, degrees", driver, angles, 20_000, 0.02, 0.06);
            within("ellipsoid, path length, relative", driver, lengths, 20_000, 2e-4, 1e-3);
            if slab {
                within("slab, exit against entry, degrees", driver, kept, 50_000, 0.3, 0.5);
            }
        });
    }
}

/// Depth and normal of a plane (an ellipsoid 75 times as wide as thick, near its centre) from 0 to 89 degrees, as
/// ray-cast and as smoothed, and the first refracted direction.
#[test]
fn tilted_planes_keep_depth_and_normal() {
    for tilt in [0.0f32, 30.0, 60.0, 75.0, 85.0, 89.0] {
        let axes = Mat3::from_rotation_x(-tilt.to_radians()) * Mat3::from_diagonal(Vec3::new(3.0, 3.0, 0.04));
        let body = Ellipsoid { center: Vec3::ZERO, axes };
        let optics = imai16().refractions(1);
        let case = case(0.05, &[], &[body], view(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 8.0), optics);
        let q = Quadric::new(&body);
        each_driver(|driver| {
            let shot = driver.shoot(&case);
            let depths = ["body depth (ray-cast)", "body depth (smoothed, even)"].map(|id| shot.depths(id, 0).unwrap());
            let normals = ["body normal (ray-cast)", "body normal (smoothed)"].map(|id| shot.words(id, 0).unwrap());
            let rotation = Mat3::from_mat4(case.camera.view).as_dmat3().transpose();
            let (mut off, mut turned, mut bent) = ([vec![], vec![]], [vec![], vec![]], Vec::new());
            for p in pixels(&case, &shot) {
                let central = |(near, _): &(f64, f64)| (p.eye + near * p.dir).length() <= 0.75;
                let Some((near, _)) = q.crossings(p.eye, p.dir).filter(central) else {
                    continue;
                };
                let at = p.eye + near * p.dir;
                let n = q.normal(at);
                for stage in 0..2 {
                    // Distance from the plane, in particle radii.
                    let along = f64::from(depths[stage][p.index]) / p.slant - near;
                    off[stage].push((along * p.dir.dot(n)).abs() / 0.05);
                    let found = rotation * decode_normal(normals[stage][p.index]).as_dvec3();
                    turned[stage].push(degrees(found, n));
                }
                bent.push(degrees(p.found, snell(p.dir, n, 1.0 / IOR).unwrap()));
            }
            // Packed normals err by 0.004 degrees. At 89 degrees a pixel is 5 radii deep: the window's few weights that
            // are left average over the ellipsoid's own curvature, and one-sided differences see half a pixel of it.
            let (depth, normal) = if tilt > 87.0 { (1e-2, 0.15) } else { (2e-3, 0.015) };
            for (stage, name, depth, normal) in [(0, "ray-cast", 2e-4, 0.005), (1, "smoothed", depth, normal)] {
                let what = |of| format!("plane at {tilt}, {name}, {of}");
                within(&what("depth in radii"), driver, off[stage].clone(), 1000, depth, 2.0 * depth);
                within(&what("normal in degrees"), driver, turned[stage].clone(), 1000, normal, 2.0 * normal);
            }
            within(&format!("plane at {tilt}, refracted, degrees"), driver, bent, 1000, normal, 2.0 * normal);
        });
    }
}

/// Imai16 Problem 1: a ball before a body, and another behind it on the same pixels, which are no one volume. The ray leaves the ball
/// by the ball's own back, then meets the body: four refractions.
#[test]
fn a_ball_before_a_slab_is_left_by_its_own_back() {
    let ball = sphere(Vec3::new(0.1, 0.05, 0.7), 0.3);
    let behind = sphere(Vec3::new(0.1, 0.05, -1.6), 0.3);
    let axes = Mat3::from_rotation_y(0.2) * Mat3::from_diagonal(Vec3::new(2.0, 2.0, 0.3));
    let body = Ellipsoid { center: Vec3::new(0.0, 0.0, -0.7), axes };
    let case = case(0.3, &[ball, behind], &[body], view(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 45.0), settings(4, 0));
    let (first, second) = (Quadric::new(&ball), Quadric::new(&body));
    each_driver(|driver| {
        let (mut angles, mut lengths) = (Vec::new(), Vec::new());
        for p in pixels(&case, &driver.shoot(&case)) {
            // Well inside: towards its rim a ball magnifies every error.
            let Some((ball, _)) = through(&first, p.eye, p.dir, 0).filter(|(_, cos)| *cos >= 0.6) else {
                continue;
            };
            let (body, _) = through(&second, ball.at, ball.dir, 0).expect("the body is wide");
            if body.limited || body.margin < 0.05 {
                continue;
            }
            assert_eq!(p.pattern, PATTERN_SPLASH_BODY, "{}: pixel {}", driver.name, p.index);
            assert_eq!(p.outcome, OUTCOME_HIT, "{}: pixel {}", driver.name, p.index);
            angles.push(degrees(p.found, body.dir));
            lengths.push((p.length / (ball.length + body.length) - 1.0).abs());
        }
        within("ball and slab, final direction, degrees", driver, angles, 2000, 0.02, 0.05);
        // In the middle a ray stays within one pixel on its way to the slab: there the entry is off by a thirtieth of a radius.
        within("ball and slab, path length, relative", driver, lengths, 2000, 2e-4, 1e-2);
    });
}

/// Imai16 Problem 2: a ball over a body's edge. Smoothing the body neither moves nor grows the ball, nor the ball the
/// body.
#[test]
fn a_ball_on_an_edge_is_not_smoothed() {
    let ball = sphere(Vec3::new(0.5, 0.0, 0.3), 0.15);
    let body = Ellipsoid { center: Vec3::ZERO, axes: Mat3::from_diagonal(Vec3::new(0.5, 0.6, 0.2)) };
    let smooth = imai16().iterations(5);
    let camera = view(Vec3::new(0.2, 0.3, 2.5), Vec3::ZERO, 45.0);
    let cases: [(&[_], &[_]); 3] = [(&[ball], &[body]), (&[ball], &[]), (&[], &[body])];
    let cases = cases.map(|(splash, body)| case(0.15, splash, body, camera, smooth));
    each_driver(|driver| {
        let [both, ball, body] = cases.each_ref().map(|case| driver.shoot(case));
        for layer in 0..2 {
            // Without the body the ball itself is the origin: its last bits are others.
            let of = |shot: &Shot| shot.floats("splash depth", layer).unwrap();
            let off = |(a, b): &(f32, f32)| (a - b).abs() > 2e-4;
            let off = of(&both).into_iter().zip(of(&ball)).filter(off).count();
            assert!(off <= 2, "{}: {off} pixels of the ball moved", driver.name);
            for id in ["body depth (smoothed, odd)", "body normal (smoothed)"] {
                assert!(both.words(id, layer) == body.words(id, layer), "{}: {id:?} {layer}", driver.name);
            }
        }
        let drawn = |shot: &Shot| shot.floats("splash depth", 0).unwrap().iter().filter(|d| **d > 0.0).count();
        assert!(drawn(&both) > 800, "{}: {}", driver.name, drawn(&both));
    });
}

/// The eye in the body, or the near plane in a ball: the ray starts inside, unbent, and leaves by the back, or is
/// reflected there beyond the critical angle.
#[test]
fn an_eye_inside_looks_out() {
    let tilt = Mat3::from_rotation_z(0.3) * Mat3::from_rotation_x(0.5);
    let body = Ellipsoid { center: Vec3::ZERO, axes: tilt * Mat3::from_diagonal(Vec3::new(3.0, 1.2, 1.0)) };
    let ball = sphere(Vec3::ZERO, SPLASH_RADIUS);
    let (in_body, in_ball) = (tilt * Vec3::new(-2.2, 0.2, 0.1), SPLASH_RADIUS * Vec3::new(0.1, 0.85, 0.1));
    // A ball is known whole: a ray that is reflected in it is followed to where it leaves.
    for (splash, shape, eye, reflections) in [(false, body, in_body, 0), (true, ball, in_ball, 1)] {
        let (splashes, bodies): (&[_], &[_]) = if splash { (&[shape], &[]) } else { (&[], &[shape]) };
        let camera = view(eye, eye + tilt * Vec3::new(1.0, 0.1, -0.1), 100.0);
        let mut case = case(1.0, splashes, bodies, camera, settings(2, reflections));
        case.eye_inside = !splash;
        let q = Quadric::new(&shape);
        each_driver(|driver| {
            let (mut angles, mut lengths, mut limited) = (Vec::new(), Vec::new(), 0);
            for p in pixels(&case, &driver.shoot(&case)) {
                let start = 0.01 / p.slant; // the near plane
                let exact = inside(&q, p.eye, p.eye + start * p.dir, p.dir, reflections);
                if exact.margin < 0.02 {
                    continue;
                }
                let expected = if exact.limited { OUTCOME_REFLECTION_LIMIT } else { OUTCOME_HIT };
                assert_eq!(p.outcome, expected, "{}: pixel {}", driver.name, p.index);
                assert_eq!(p.pattern, if splash { PATTERN_SPLASH } else { PATTERN_BODY });
                limited += usize::from(exact.limited);
                angles.push(degrees(p.found, exact.dir));
                lengths.push((p.length / exact.length - 1.0).abs());
            }
            assert!(limited > 1000, "{}: only {limited} beyond the critical angle", driver.name);
            within("eye inside, direction, degrees", driver, angles, 60_000, 0.02, 0.05);
            // Of some radii a root's 2e-4.
            within("eye inside, path length, relative", driver, lengths, 60_000, 2e-4, 4e-4);
        });
    }
}

/// Total internal reflection in a tilted lens: followed up to the limit, and said so beyond.
#[test]
fn internal_reflections_are_counted() {
    let tilt = Mat3::from_rotation_y(0.9) * Mat3::from_rotation_x(0.2);
    let body = Ellipsoid { center: Vec3::ZERO, axes: tilt * Mat3::from_diagonal(Vec3::new(0.9, 0.8, 0.35)) };
    let q = Quadric::new(&body);
    let camera = view(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 40.0);
    for limit in [0, 1, 4] {
        let case = case(0.1, &[], &[body], camera, settings(2, limit));
        each_driver(|driver| {
            let (mut angles, mut lengths, mut reflected, mut limited, mut wrong) = (Vec::new(), Vec::new(), 0, 0, 0);
            for p in pixels(&case, &driver.shoot(&case)) {
                // Within some pixels of the silhouette the maps do not hold the walls.
                let usable = |(e, cos): &(Passage, f64)| *cos >= 0.3 && e.margin >= 0.05 && e.rim >= 0.2;
                let Some((exact, _)) = through(&q, p.eye, p.dir, limit).filter(usable) else {
                    continue;
                };
                reflected += usize::from(exact.reflections > 0 && !exact.limited);
                limited += usize::from(exact.limited);
                let right = p.outcome == if exact.limited { OUTCOME_REFLECTION_LIMIT } else { OUTCOME_HIT };
                if right {
                    angles.push(degrees(p.found, exact.dir));
                    lengths.push((p.length / exact.length - 1.0).abs());
                } else {
                    wrong += 1;
                }
            }
            assert!(if limit == 0 { limited > 500 } else { reflected > 500 }, "{}: too few", driver.name);
            // Where a ray grazes the seam between the two maps, it may meet a side wall.
            assert!(wrong * 100 <= angles.len(), "{}: {wrong} outcomes differ", driver.name);
            // A ray guided along the rim leaves where the maps are steep.
            within("lens, direction, degrees", driver, angles, 10_000, 0.3, 2.0);
            within("lens, path length, relative", driver, lengths, 10_000, 1e-3, 1e-2);
        });
    }
}
