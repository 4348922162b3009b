//! The walk through a density field against its twin, which walks in the field that the device has built.

use crate::{
    analytic::{self, Pixel, pixels, snell},
    background::{HostScene, painted},
    field::{prepared, settings, words},
    support::{Case, Choose, Cloud, Driver, Random, SKY, Shot, camera, each_driver, lattice},
    walk::degrees,
};
use glam::{DVec3, Vec3};
use meniscus::{
    Background, Class, Point,
    layers::field::Field,
    prepare::{Input, Options, Search, points},
    shader::{
        Frame, OUTCOME_HIT, OUTCOME_NO_LIQUID, OUTCOME_NO_WALL, OUTCOME_NOT_CONVERGED, OUTCOME_REFLECTION_LIMIT,
        OUTCOME_SCENE, PATTERN_BODY, PATTERN_BODY_BODY, PATTERN_NONE, PATTERN_SPLASH, REFLECTION_LEAST, SPLASH_RADIUS,
    },
    twin::{
        background::{Scene, env_color},
        field_walk::{Field as Twin, walk},
        walk::Walk,
        walls::{Map, Maps},
    },
};
use rayon::prelude::*;

const SIZE: [u32; 2] = [160, 120];

/// A block, a smaller one above it, and spray; positions.
fn scene() -> Vec<Vec3> {
    let mut random = Random(12);
    let mut all = Vec::new();
    for (n, corner) in [([14, 5, 10], Vec3::new(-0.7, -0.5, -0.5)), ([4, 4, 4], Vec3::new(-0.1, 0.35, -0.2))] {
        for i in 0..n[0] * n[1] * n[2] {
            let at = Vec3::new((i % n[0]) as f32, (i / n[0] % n[1]) as f32, (i / n[0] / n[1]) as f32);
            all.push(corner + 0.05 * (2.0 * at + random.point(Vec3::splat(-0.4), Vec3::splat(0.4))));
        }
    }
    all.extend((0..40).map(|_| random.point(Vec3::new(-0.9, -0.5, -0.7), Vec3::new(0.9, 0.8, 0.7))));
    all
}

pub fn case(field: Field, refractions: u32, reflections: u32) -> Case {
    let settings = settings(field, "four").refractions(refractions).reflections(reflections);
    let camera = camera(Vec3::new(0.5, 0.9, 2.2), Vec3::ZERO, SIZE);
    let empty = crate::shape::empty(0.05);
    prepared(&scene(), &Case { settings, camera, size: SIZE, ..empty })
}

fn shoot(driver: &Driver, case: &Case) -> Shot {
    let (shot, _) = crate::field::shoot(driver, &scene(), case);
    shot
}

/// Each pixel as the GPU has walked it: pattern, outcome, hits, length, direction, colour.
fn walked(shot: &Shot) -> Vec<Walk> {
    let (walks, directions) =
        (shot.floats("walk (debug)", 0).unwrap(), shot.floats("final direction (debug)", 0).unwrap());
    let numbers = walks.iter().chain(&directions).chain(shot.picture.as_flattened());
    assert!(numbers.into_iter().all(|v| v.is_finite()), "not finite");
    let walk = |i: usize| {
        let (w, d) = (&walks[4 * i..][..4], &directions[4 * i..][..4]);
        Walk {
            pattern: w[0] as u32,
            outcome: w[1] as u32,
            hits: w[2] as u32,
            length: f64::from(w[3]),
            direction: DVec3::new(d[0].into(), d[1].into(), d[2].into()),
            color: Vec3::from(shot.picture[i]),
        }
    };
    (0..shot.picture.len()).map(walk).collect()
}

fn twin_of(shot: &Shot, case: &Case, frame: &Frame, pixel: usize) -> Walk {
    let own = case.settings.method.layers.field().expect("a field");
    let bricks = words(shot).bricks();
    walk_in(shot, &bricks, own, case, frame, None, pixel)
}

/// The field that the device has built, as the twin walks in it.
pub fn twin_field<'a>(
    shot: &Shot,
    bricks: &'a std::collections::BTreeMap<[i32; 3], meniscus::layers::field::twin::Brick>,
    own: Field,
    radius: f32,
) -> Twin<'a> {
    let lattice = meniscus::layers::field::twin::Lattice::new(&own, radius);
    // Where the liquid's own space begins, on the lattice.
    let unit = lattice.ball / (1.24 * f64::from(radius));
    let origin = shot.space.origin * unit / lattice.spacing;
    // Places count from the first node of the block there.
    let base = 16 * (origin / 16.0).floor().as_ivec3();
    Twin::new(bricks, base.to_array(), origin - base.as_dvec3(), f64::from(own.spacing), f64::from(own.level))
}

fn walk_in(
    shot: &Shot,
    bricks: &std::collections::BTreeMap<[i32; 3], meniscus::layers::field::twin::Brick>,
    own: Field,
    case: &Case,
    frame: &Frame,
    scene: Option<Scene>,
    pixel: usize,
) -> Walk {
    let field = twin_field(shot, bricks, own, case.particles.radius);
    let none = Map { depth: &[], normal: &[] };
    let view = Maps { frame, maps: [[none; 2]; 2], scene };
    let width = SIZE[0] as usize;
    walk(&field, &view, &case.settings.walk(), &SKY, [pixel % width, pixel / width])
}

/// A pixel as the GPU has walked it, and as the twin has.
type Pair = (usize, Walk, Walk);

/// The share of them that are good is at least so much.
#[track_caller]
fn at_least(what: &str, driver: &Driver, all: &[&Pair], share: f64, good: impl Fn(&Walk, &Walk) -> bool) {
    let bad: Vec<_> = all.iter().filter(|(_, a, b)| !good(a, b)).collect();
    let found = 1.0 - bad.len() as f64 / all.len().max(1) as f64;
    println!("    {what}: {:.2} % of {}", 100.0 * found, all.len());
    assert!(found >= share, "{}: {what} on {:.2} %: {:?}", driver.name, 100.0 * found, bad.first());
}

fn same(a: &Walk, b: &Walk) -> bool {
    (a.pattern, a.outcome, a.hits) == (b.pattern, b.outcome, b.hits) && degrees(a.direction, b.direction) <= 0.2
}

fn compare(driver: &Driver, case: &Case, every: usize) -> Vec<Walk> {
    compare_shot(driver, case, &shoot(driver, case), every)
}

fn compare_shot(driver: &Driver, case: &Case, shot: &Shot, every: usize) -> Vec<Walk> {
    let found = walked(shot);
    let bricks = words(shot).bricks();
    let own = case.settings.method.layers.field().expect("a field");
    let shifted = [-1e-4, 1e-4].map(|off| Frame { ior: shot.frame.ior * (1.0 + off), ..shot.frame });
    let pair = |i: usize| {
        let twin = |frame: &Frame| walk_in(shot, &bricks, own, case, frame, None, i);
        let wanted = twin(&shot.frame);
        // Where the twin itself goes another way with an index that is a little off, rounding decides.
        let decided = same(&found[i], &wanted) || shifted.iter().all(|frame| same(&twin(frame), &wanted));
        (decided, (i, found[i], wanted))
    };
    let all: Vec<_> = (0..found.len()).into_par_iter().filter(|i| i % every == 0).map(pair).collect();
    let decided: Vec<_> = all.iter().filter(|p| p.0).map(|p| &p.1).collect();
    let s = case.settings.walk();
    println!(
        "  refractions {}, reflections {}: {} of {} decided",
        s.refractions,
        s.internal_reflections,
        decided.len(),
        all.len()
    );
    assert!(decided.len() * 100 >= all.len() * 97, "{}: {} of {}", driver.name, decided.len(), all.len());
    at_least("the first volume", driver, &decided, 0.999, |a, b| {
        (a.pattern == PATTERN_NONE) == (b.pattern == PATTERN_NONE)
    });
    let (none, liquid): (Vec<_>, Vec<_>) = decided.into_iter().partition(|(_, _, twin)| twin.pattern == PATTERN_NONE);
    assert!(none.len() > 200 && liquid.len() > 200, "{}: {} and {}", driver.name, none.len(), liquid.len());
    at_least("outcome", driver, &liquid, 0.985, |a, b| a.outcome == b.outcome);
    at_least("pattern and hits", driver, &liquid, 0.985, |a, b| (a.pattern, a.hits) == (b.pattern, b.hits));
    at_least("direction", driver, &liquid, 0.98, |a, b| degrees(a.direction, b.direction) <= 0.2);
    let agree: Vec<_> = liquid.into_iter().filter(|(_, a, b)| same(a, b)).collect();
    at_least("length", driver, &agree, 0.99, |a, b| (a.length - b.length).abs() <= 0.01 * b.length + 0.01);
    let close = |a: &Walk, b: &Walk| (a.color - b.color).abs().cmple(0.01 * (b.color + 0.5)).all();
    at_least("colour", driver, &agree, 0.98, close);
    at_least("colour beside liquid", driver, &none, 0.999, close);
    found
}

#[test]
fn rays_are_walked_as_the_twin_walks_them() {
    each_driver(|driver| {
        let mut all = Vec::new();
        for (field, refractions, reflections) in [
            (Field::default(), 4, 4),
            (Field::default().spacing(1.5).kernel_radius(4.0), 2, 1),
            (Field::default(), 4, 0),
            (Field::default(), 12, 4),
            (Field::default(), 1, 0),
        ] {
            let mut case = case(field, refractions, reflections);
            if reflections != 1 {
                case.settings = case.settings.absorption(Vec3::new(0.2, 1.5, 3.0));
            }
            all.extend(compare(driver, &case, if refractions == 1 { 7 } else { 19 }));
        }
        // Each kind of way has been walked; and none ends in the liquid's box without a wall.
        let count = |of: &dyn Fn(&Walk) -> bool| all.iter().filter(|w| of(w)).count();
        assert!(
            count(&|w| w.outcome == OUTCOME_REFLECTION_LIMIT) > 100 && count(&|w| w.hits > 4) > 100,
            "{}",
            driver.name
        );
        assert!(
            count(&|w| w.pattern > PATTERN_BODY) > 100 && count(&|w| w.pattern == PATTERN_SPLASH) > 50,
            "{}",
            driver.name
        );
        assert_eq!(count(&|w| [OUTCOME_NO_WALL, OUTCOME_NOT_CONVERGED].contains(&w.outcome)), 0, "{}", driver.name);
    });
}

/// A plate, and a larger one some empty blocks of the directory behind it, which rays cross up and down each axis.
#[test]
fn empty_blocks_are_crossed() {
    let plate = |middle, n| lattice(middle, 0.05, n).into_iter().map(|particle| particle.center);
    let along = Vec3::new(0.4, 0.3, 1.0).normalize();
    for way in [1.0f32, -1.0] {
        let behind = 6.0 * way * along;
        let positions: Vec<Vec3> = plate(Vec3::ZERO, [12, 12, 3]).chain(plate(behind, [40, 36, 3])).collect();
        let camera = camera(-2.5 * way * along, Vec3::ZERO, SIZE);
        let settings = settings(Field::default(), "four").reflections(0);
        let case = prepared(&positions, &Case { settings, camera, size: SIZE, ..crate::shape::empty(0.05) });
        each_driver(|driver| {
            let (shot, _) = crate::field::shoot(driver, &positions, &case);
            let all = compare_shot(driver, &case, &shot, 7);
            let both = all.iter().filter(|w| w.pattern == PATTERN_BODY_BODY).count();
            assert!(both > 1000, "{}: {both} rays meet both", driver.name);
        });
    }
}

/// Followed reflections are the twin's, be there few of them or more than wait; the view ray's own walk stays what it was.
#[test]
fn reflections_are_followed_as_the_twin_follows_them() {
    each_driver(|driver| {
        let plain = case(Field::default(), 4, 4);
        let plain = Case { settings: plain.settings.absorption(Vec3::new(0.2, 1.5, 3.0)), ..plain };
        let before = walked(&shoot(driver, &plain));
        for count in [1, 16] {
            let case = Case { settings: plain.settings.tracing(count), ..plain.clone() };
            let after = compare(driver, &case, 19);
            let own = |w: &Walk| Walk { color: Vec3::ZERO, ..*w };
            assert!(before.iter().map(own).eq(after.iter().map(own)), "{}: another walk", driver.name);
            let changed = before.iter().zip(&after).filter(|(a, b)| (a.color - b.color).abs().max_element() > 0.02);
            let changed = changed.count();
            println!("  {count} followed: {changed} pixels changed");
            assert!(changed > 500, "{}: {count} followed change {changed} pixels", driver.name);
        }
    });
}

/// Balls that stand in the body's face hand rays over to it: between liquid and liquid there is no wall.
#[test]
fn balls_in_the_bodys_face_hand_rays_over() {
    let case = case(Field::default(), 4, 4);
    let mut all = points(&Input::new(&scene(), case.particles.radius), &Options::default()).expect("valid");
    let face = |p: &Point| (-0.15..-0.05).contains(&p.position.y) && p.class == Class::Body;
    all.iter_mut().filter(|p| face(p)).step_by(3).for_each(|p| p.class = Class::Splash);
    each_driver(|driver| {
        let found = compare_shot(driver, &case, &driver.shoot_points(&case, &all), 11);
        let from_ball = found.iter().filter(|w| w.pattern >= PATTERN_SPLASH && w.outcome == OUTCOME_HIT).count();
        assert!(from_ball > 1000, "{}: {from_ball}", driver.name);
    });
}

/// Balls that overlap are walked through alike in whatever order the device has listed them.
#[test]
fn the_order_of_balls_changes_no_bit() {
    let mut random = Random(5);
    let positions: Vec<_> = (0..600).map(|_| random.point(Vec3::splat(-0.3), Vec3::splat(0.3))).collect();
    let case = prepared(&positions, &case(Field::default(), 4, 4));
    let mut all = points(&Input::new(&positions, case.particles.radius), &Options::default()).expect("valid");
    all.iter_mut().for_each(|p| p.class = Class::Splash);
    each_driver(|driver| {
        let first = driver.shoot_points(&case, &all);
        assert!(walked(&first).iter().filter(|w| w.pattern != PATTERN_NONE).count() > 2000, "{}", driver.name);
        for i in 1..4 {
            let mut other = all.clone();
            other.rotate_left(150 * i);
            other[..300].reverse();
            assert!(driver.shoot_points(&case, &other).picture == first.picture, "{}: {i}", driver.name);
        }
    });
}

/// The same through the device's own points; and with an eye in the liquid, whose rays start there.
#[test]
fn an_eye_in_the_liquid_sees_from_within() {
    let mut case = case(Field::default(), 4, 4);
    case.camera = camera(Vec3::new(-0.2, -0.3, 0.0), Vec3::new(2.0, 0.4, 0.3), SIZE);
    each_driver(|driver| {
        let shot = shoot(driver, &case);
        let found = walked(&shot);
        let inside = found.iter().filter(|w| w.pattern >= PATTERN_BODY && w.outcome != OUTCOME_NO_LIQUID).count();
        assert_eq!(inside, found.len(), "{}: every ray starts in the body", driver.name);
        for i in (0..found.len()).step_by(997) {
            let twin = twin_of(&shot, &case, &shot.frame, i);
            let near = same(&found[i], &twin) || found[i].hits > 2;
            assert!(near, "{}: pixel {i}: {:?} instead of {twin:?}", driver.name, found[i]);
        }
    });
}

/// Points and quads draw the same tiles, whatever the size of the picture.
/// Liquid so wide that floats cannot tell one cell from the next: frames end, and what they show is light.
#[test]
fn walks_end_where_cells_cannot_be_told_apart() {
    each_driver(|driver| {
        let all = crate::shape::clouds();
        let (_, radius, positions) = all.iter().find(|(name, ..)| *name == "two millions wide").expect("a cloud");
        let case = Case { settings: Default::default(), ..crate::shape::empty(*radius) };
        let shot = driver.shoot_cloud_unlisted(&case, &Cloud::new(positions, Search::Runs));
        assert!(shot.picture.iter().flatten().all(|v| v.is_finite() && *v >= 0.0), "{}", driver.name);
    });
}

#[test]
fn points_and_quads_draw_the_same() {
    let mut odd = case(Field::default(), 4, 4);
    odd.size = [157, 83];
    odd.camera = camera(Vec3::new(0.3, 0.4, 0.9), Vec3::ZERO, odd.size);
    let mut quads = odd.clone();
    quads.settings = quads.settings.quads_only(true);
    each_driver(|driver| {
        let [a, b] = [&odd, &quads].map(|case| shoot(driver, case));
        assert!(walked(&a).iter().filter(|w| w.outcome == OUTCOME_HIT).count() > 500, "{}", driver.name);
        assert!(a.picture == b.picture, "{}", driver.name);
    });
}

/// Rays end on the host's scene, in the liquid too, and it hides liquid and is seen past it; off the screen nothing is known of it.
#[test]
fn the_hosts_scene_is_met() {
    let blocks = |x: u32, y: u32| match (x / 20 + 2 * (y / 20)) % 5 {
        0 => 2.0 + 0.002 * f64::from(x),
        1 => 2.4,
        2 => 2.1 + 0.004 * f64::from(y),
        3 => 4.0,
        _ => f64::INFINITY,
    };
    let case = case(Field::default(), 4, 4);
    let painted = painted(SIZE, blocks);
    let own = case.settings.method.layers.field().expect("a field");
    each_driver(|driver| {
        for (background, tracing) in
            [(Background::Environment, 0), (Background::Host, 0), (Background::Environment, 3), (Background::Host, 3)]
        {
            let case = Case { settings: case.settings.tracing(tracing), ..case.clone() };
            let images = HostScene::new(driver.gpu(), &case.camera, SIZE, &painted);
            let shot = driver.shoot_before(&case, images.input(), background);
            let depth: Vec<f64> = painted.0.iter().map(|d| d / shot.space.radius).collect();
            let scene = Scene { depth: &depth, color: &painted.1, sky: background == Background::Host };
            let (found, bricks) = (walked(&shot), words(&shot).bricks());
            let chosen = (0..found.len()).into_par_iter().filter(|i| i % 31 == 0);
            let pair = |i| (i, found[i], walk_in(&shot, &bricks, own, &case, &shot.frame, Some(scene), i));
            let all: Vec<_> = chosen.map(pair).collect();
            let all: Vec<&Pair> = all.iter().collect();
            println!("  {background:?}, {tracing} reflections followed:");
            let none = |w: &Walk| w.pattern == PATTERN_NONE;
            at_least("what is hidden", driver, &all, 0.998, |a, b| none(a) == none(b));
            let (beside, liquid): (Vec<&Pair>, Vec<&Pair>) = all.into_iter().partition(|(_, _, twin)| none(twin));
            let met = liquid.iter().filter(|(_, a, _)| a.outcome == OUTCOME_SCENE).count();
            assert!(met > 20 && beside.len() > 250, "{}: {met} meet the scene", driver.name);
            at_least("outcome", driver, &liquid, 0.96, |a, b| a.outcome == b.outcome);
            let agree: Vec<&Pair> = liquid.into_iter().filter(|(_, a, b)| same(a, b)).collect();
            at_least("length", driver, &agree, 0.98, |a, b| (a.length - b.length).abs() <= 0.01 * b.length + 0.02);
            let close = |a: &Walk, b: &Walk| (a.color - b.color).abs().cmple(0.02 * (b.color + 0.5)).all();
            at_least("colour", driver, &agree, 0.96, close);
            if background == Background::Environment {
                at_least("colour beside liquid", driver, &beside, 0.998, close);
            }
        }
    });
}

const RADIUS: f64 = 0.05;
const IOR: f64 = 1.333;

/// Where a ray that begins outside a ball meets it, if it does; the normal there.
fn meets(center: DVec3, x: DVec3, dir: DVec3) -> Option<(f64, DVec3)> {
    let (q, radius) = (x - center, f64::from(SPLASH_RADIUS) * RADIUS);
    let square = q.dot(dir).powi(2) - q.length_squared() + radius * radius;
    let t = -q.dot(dir) - square.sqrt();
    (square > 0.0 && t > 1e-6).then(|| (t, (q + t * dir) / radius))
}

/// Fresnel's equations for a ray from the air, both polarisations alike; and the ray in the water.
fn reflectance(dir: DVec3, n: DVec3) -> (f32, DVec3) {
    let bent = snell(dir, n, 1.0 / IOR).expect("there is no critical angle into water");
    let (air, water) = (-dir.dot(n), -bent.dot(n));
    let [s, p] = [(air, water), (water, air)].map(|(a, b)| ((a - IOR * b) / (a + IOR * b)).powi(2));
    (0.5 * (s + p) as f32, bent)
}

fn sky(shot: &Shot, dir: DVec3) -> Vec3 {
    let [to_env, view] = [shot.frame.eye_to_env, shot.frame.view].map(|m| glam::Mat3::from_mat4(m).as_dmat3());
    env_color(&SKY, to_env * view * dir)
}

/// Lone balls, drawn with so many reflections followed.
fn balls(driver: &Driver, centers: &[Vec3], tracing: u32, absorption: Vec3) -> (Shot, Vec<Pixel>) {
    let mut settings = settings(Field::default(), "four").tracing(tracing).absorption(absorption);
    settings.method.set("fresnel", "exact").expect("a parameter");
    let camera = analytic::view(Vec3::new(0.1, 0.2, 0.6), Vec3::new(0.05, 0.0, 0.0), 30.0);
    let empty = crate::shape::empty(RADIUS as f32);
    let case = Case { settings, camera, size: analytic::SIZE, ..empty };
    let case = prepared(centers, &case);
    let (shot, _) = crate::field::shoot(driver, centers, &case);
    let pixels = pixels(&case, &shot);
    (shot, pixels)
}

/// On balls that let nothing through: the product of what they reflect, from ball to ball as often as is asked for.
#[test]
fn black_balls_are_seen_in_each_other() {
    let centers = [Vec3::ZERO, Vec3::new(0.15, 0.0, 0.0), Vec3::new(0.05, -0.05, 0.125)];
    each_driver(|driver| {
        for tracing in [0, 1, 2, 5] {
            let (shot, pixels) = balls(driver, &centers, tracing, Vec3::splat(2000.0));
            let (mut bad, mut seen) = (Vec::new(), [0; 8]);
            for p in pixels {
                let (mut x, mut dir, mut light, mut met) = (p.eye, p.dir, 1.0, 0);
                while met <= tracing && light >= REFLECTION_LEAST {
                    let all = centers.iter().filter_map(|c| meets(c.as_dvec3(), x, dir));
                    let Some((t, n)) = all.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
                    light *= reflectance(dir, n).0;
                    (x, dir) = (x + t * dir, dir - 2.0 * dir.dot(n) * n);
                    met += 1;
                }
                seen[met as usize] += 1;
                let (found, wanted) = (Vec3::from(shot.picture[p.index]), light * sky(&shot, dir));
                if met > 0 && (found - wanted).abs().max_element() > 0.005 + 0.02 * wanted.max_element() {
                    bad.push((p.index, met, found, wanted));
                }
            }
            println!("  {tracing} followed: pixels by balls met {seen:?}, {} bad: {:?}", bad.len(), bad.first());
            let liquid: usize = seen[1..].iter().sum();
            assert!(liquid > 5000 && bad.len() * 100 <= liquid, "{}: {} of {liquid}", driver.name, bad.len());
            let again = seen[2..].iter().sum::<usize>() > 300;
            assert_eq!(again, tracing > 0, "{}: {seen:?}", driver.name);
        }
    });
}

/// In a clear ball light goes round and round, and some leaves it each time: what that adds to a picture without.
#[test]
fn light_goes_round_in_a_clear_ball() {
    let absorption = Vec3::new(0.5, 1.0, 4.0);
    let radius = f64::from(SPLASH_RADIUS);
    each_driver(|driver| {
        let (plain, _) = balls(driver, &[Vec3::ZERO], 0, absorption);
        // The first that is followed is what the ball's outside reflects, and meets nothing.
        for tracing in [1, 2, 4] {
            let (shot, pixels) = balls(driver, &[Vec3::ZERO], tracing, absorption);
            let (mut bad, mut by_rounds) = (Vec::new(), [0; 8]);
            for p in pixels {
                let Some((_, mut n)) = meets(DVec3::ZERO, p.eye, p.dir) else { continue };
                let (reflected, mut dir) = reflectance(p.dir, n);
                let chord = -2.0 * dir.dot(n) * radius;
                let through = (-shot.frame.absorption * chord as f32).exp();
                let (mut light, mut rounds, mut more) = (Vec3::splat(1.0 - reflected), 0, Vec3::ZERO);
                loop {
                    n += chord * dir / radius;
                    light *= through * reflected;
                    dir -= 2.0 * dir.dot(n) * n;
                    if rounds + 1 >= tracing || light.max_element() < REFLECTION_LEAST {
                        break;
                    }
                    // Instead of what this direction brings, what comes in at the chord's other end and what is reflected there.
                    let end = n + chord * dir / radius;
                    let out = snell(dir, -end, IOR).expect("what came in gets out");
                    let next = dir - 2.0 * dir.dot(end) * end;
                    let there = (1.0 - reflected) * sky(&shot, out) + reflected * sky(&shot, next);
                    more += light * (through * there - sky(&shot, dir));
                    rounds += 1;
                }
                by_rounds[rounds as usize] += 1;
                let found = Vec3::from(shot.picture[p.index]) - Vec3::from(plain.picture[p.index]);
                // Rays go on from 0.003 of a radius beside their walls, and at an edge of the sky that is seen.
                if (found - more).abs().max_element() > 0.002 + 0.1 * more.abs().max_element() {
                    bad.push((p.index, rounds, found, more));
                }
            }
            println!("  {tracing} followed: pixels by rounds {by_rounds:?}, {} bad: {:?}", bad.len(), bad.first());
            let liquid: usize = by_rounds.iter().sum();
            assert!(liquid > 2000 && bad.len() * 10 <= liquid, "{}: {} of {liquid}", driver.name, bad.len());
            let round = by_rounds.iter().rposition(|n| *n > 20);
            assert_eq!(round, Some(tracing as usize - 1), "{}: {by_rounds:?}", driver.name);
        }
    });
}
