//! The refraction pass against its twin, which walks in the GPU's own four maps.

use crate::{
    background::{HostScene, Painted},
    support::{Case, Choose, Driver, SKY, Shot, camera, each_driver, imai16, random_cloud, sphere},
};
use glam::{DVec3, Vec3};
use meniscus::{
    Background, Equirect, Fresnel, Particles, Settings,
    shader::{
        Frame, OUTCOME_HIT, OUTCOME_LEFT_VIEW, OUTCOME_NOT_CONVERGED, OUTCOME_REFLECTION_LIMIT, OUTCOME_SCENE,
        OUTCOME_SIDE_WALL, PATTERN_BODY_SPLASH, PATTERN_NONE, PATTERN_SPLASH_SPLASH, SPLASH_RADIUS,
    },
    twin::{
        background::Scene,
        walk::{Walk, walk},
        walls::{Map, Maps},
    },
};
use rayon::prelude::*;

const SIZE: [u32; 2] = [240, 180];

/// Part of the index of refraction by which the twin's is off where it tells whether rounding decides.
const NEARLY: f32 = 1e-4;

/// The maps that the refraction pass has read.
pub struct OwnMaps([[(Vec<f32>, Vec<u32>); 2]; 2]);

impl OwnMaps {
    pub fn of(case: &Case, shot: &Shot) -> OwnMaps {
        let body = match case.settings.fit().iterations {
            0 => ("body depth (ray-cast)", "body normal (ray-cast)"),
            n if n % 2 == 1 => ("body depth (smoothed, odd)", "body normal (smoothed)"),
            _ => ("body depth (smoothed, even)", "body normal (smoothed)"),
        };
        OwnMaps([("splash depth", "splash normal"), body].map(|(depth, normal)| {
            [0, 1].map(|side| {
                let words = shot.words(normal, side).unwrap_or_default().to_vec();
                (shot.floats(depth, side).unwrap_or_default(), words)
            })
        }))
    }

    pub fn twin<'a>(&'a self, shot: &'a Shot) -> Maps<'a> {
        let maps = self.0.each_ref().map(|class| class.each_ref().map(|(depth, normal)| Map { depth, normal }));
        Maps { frame: &shot.frame, maps, scene: None }
    }
}

/// The volume a pattern starts with: 0 none, 1 splash, 2 body.
fn first_volume(pattern: u32) -> u32 {
    match pattern {
        PATTERN_NONE => 0,
        p if p < PATTERN_SPLASH_SPLASH => p,
        p => 1 + u32::from(p >= PATTERN_BODY_SPLASH),
    }
}

/// Angle between two directions.
pub fn degrees(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// One pixel as the GPU has walked it, and as the twin has.
struct Pair {
    index: usize,
    pattern: u32,
    outcome: u32,
    length: f64,
    angle: f64,
    color: Vec3,
    twin: Walk,
    /// Whether the twin itself goes another way with an index of refraction that is a little off: then rounding decides.
    undecided: bool,
}

impl Pair {
    fn length_off(&self) -> f64 {
        (self.length - self.twin.length).abs()
    }
}

/// Every pixel of a frame, or every fourth: the twin's march is slow.
fn pairs(driver: &Driver, case: &Case, shot: &Shot, scene: Option<Scene>, sky: &Equirect) -> Vec<Pair> {
    let (walks, directions) =
        (shot.floats("walk (debug)", 0).unwrap(), shot.floats("final direction (debug)", 0).unwrap());
    let numbers = walks.iter().chain(&directions).chain(shot.picture.as_flattened());
    assert!(numbers.into_iter().all(|v| v.is_finite()), "{}: not finite", driver.name);
    let own = OwnMaps::of(case, shot);
    let maps = Maps { scene, ..own.twin(shot) };
    let shifted = [-NEARLY, NEARLY].map(|off| Frame { ior: maps.frame.ior * (1.0 + off), ..*maps.frame });
    let width = case.size[0] as usize;
    let chosen = |i: &usize| case.settings.walk().refractions == 1 || (i % width + i / width * 2).is_multiple_of(4);
    let pixels: Vec<usize> = (0..walks.len() / 4).filter(chosen).collect();
    let pair = |index: usize| {
        let twin = walk(&maps, &case.settings.walk(), sky, [index % width, index / width]);
        let (w, d) = (&walks[4 * index..], &directions[4 * index..]);
        let angle = degrees(DVec3::new(f64::from(d[0]), f64::from(d[1]), f64::from(d[2])), twin.direction);
        let color = Vec3::from(shot.picture[index]);
        let (pattern, outcome) = (w[0] as u32, w[1] as u32);
        let same = |w: &Walk, angle: f64| (w.pattern, w.outcome) == (pattern, outcome) && angle <= 0.2;
        let off = |maps: &Maps| {
            let other = walk(maps, &case.settings.walk(), sky, [index % width, index / width]);
            (other.pattern, other.outcome) != (twin.pattern, twin.outcome)
                || degrees(other.direction, twin.direction) > 0.1
        };
        let undecided = !same(&twin, angle) && shifted.iter().any(|frame| off(&Maps { frame, ..maps }));
        Pair { index, pattern, outcome, length: f64::from(w[3]), angle, color, twin, undecided }
    };
    pixels.into_par_iter().map(pair).collect()
}

/// Drivers compute atan, acos and exp with errors of up to 1e-4 and the sky's steps between texels are up to 0.5,
/// so this much of the light plus as much of a dark grey.
fn same_color(pair: &Pair, tolerance: f32) -> bool {
    let limit = tolerance * (pair.twin.color + 0.5);
    (pair.color - pair.twin.color).abs().cmple(limit).all()
}

#[track_caller]
fn at_least(what: &str, driver: &Driver, pairs: &[&Pair], share: f64, good: impl Fn(&Pair) -> bool) {
    let bad: Vec<_> = pairs.iter().filter(|p| !good(p)).collect();
    let found = 1.0 - bad.len() as f64 / pairs.len().max(1) as f64;
    println!("    {what}: {:.2} % of {}", 100.0 * found, pairs.len());
    let example = bad.first().map(|p| (p.index, p.angle, p.pattern, p.outcome, p.length, p.color, p.twin));
    assert!(found >= share, "{}: {what} on {:.2} %: {example:?}", driver.name, 100.0 * found);
}

/// How often GPU and twin have to agree where a walk ends in one way: of the pixels of which either says so, that both do; of
/// those of which the GPU does, on the pattern, the final direction (within so many degrees) and the length (1 %, or some
/// radii); and of those with the twin's direction, on the colour.
struct Agreement {
    outcome: u32,
    both: f64,
    pattern: f64,
    direction: (f64, f64),
    length: (f64, f64),
    color: f64,
}

/// Of pixels that rounding does not decide. What is left are slivers of liquid or air thinner than a pixel's step, which only the
/// twin's finer march sees; most walks that meet side walls come by some. A ray that ends without a wall ends where float32
/// puts the border.
const AGREEMENTS: [Agreement; 4] = [
    Agreement {
        outcome: OUTCOME_HIT,
        both: 0.985,
        pattern: 0.99,
        direction: (0.985, 0.2),
        length: (0.985, 0.0),
        color: 0.99,
    },
    Agreement {
        outcome: OUTCOME_SIDE_WALL,
        both: 0.86,
        pattern: 0.95,
        direction: (0.82, 2.0),
        length: (0.84, 0.1),
        color: 0.95,
    },
    Agreement {
        outcome: OUTCOME_LEFT_VIEW,
        both: 0.94,
        pattern: 0.97,
        direction: (0.95, 0.2),
        length: (0.95, 0.25),
        color: 0.99,
    },
    Agreement {
        outcome: OUTCOME_REFLECTION_LIMIT,
        both: 0.95,
        pattern: 0.98,
        direction: (0.95, 0.2),
        length: (0.95, 0.0),
        color: 0.99,
    },
];

/// Pixels of all of a test's frames with more than one refraction, by how their walks ended. Each of these ways is to be among
/// them often enough to tell.
fn compare_outcomes(driver: &Driver, pairs: &[Pair], outcomes: &[u32]) {
    for a in AGREEMENTS.into_iter().filter(|a| outcomes.contains(&a.outcome)) {
        let what = format!("outcome {}", a.outcome);
        let either: Vec<_> = pairs.iter().filter(|p| p.outcome == a.outcome || p.twin.outcome == a.outcome).collect();
        at_least(&format!("{what}: both say so"), driver, &either, a.both, |p| p.outcome == p.twin.outcome);
        let all: Vec<_> = pairs.iter().filter(|p| p.outcome == a.outcome).collect();
        assert!(all.len() >= 100, "{}: {what}: only {} pixels", driver.name, all.len());
        at_least(&format!("{what}: pattern"), driver, &all, a.pattern, |p| p.pattern == p.twin.pattern);
        let (share, degrees) = a.direction;
        at_least(&format!("{what}: direction"), driver, &all, share, |p| p.angle <= degrees);
        let (share, radii) = a.length;
        at_least(&format!("{what}: length"), driver, &all, share, |p| {
            p.length_off() <= radii.max(0.01 * p.twin.length)
        });
        let same: Vec<_> = all.into_iter().filter(|p| p.angle <= 0.2).collect();
        at_least(&format!("{what}: colour"), driver, &same, a.color, |p| same_color(p, 0.01));
    }
    let all: Vec<_> = pairs.iter().collect();
    at_least("converged", driver, &all, 0.995, |p| p.outcome != OUTCOME_NOT_CONVERGED);
}

/// One frame; the pixels that walks with a length come from.
fn compare(driver: &Driver, case: &Case) -> Vec<Pair> {
    let s = &case.settings.walk();
    println!("  refractions {}, reflections {}, {:?}:", s.refractions, s.internal_reflections, s.fresnel);
    let pairs = pairs(driver, case, &driver.shoot(case), None, &SKY);
    for pair in &pairs {
        let (gpu, twin) = (first_volume(pair.pattern), first_volume(pair.twin.pattern));
        assert_eq!(gpu, twin, "{}: first volume of pixel {}", driver.name, pair.index);
    }
    let liquid: Vec<_> = pairs.iter().filter(|p| p.pattern != PATTERN_NONE).collect();
    let other: Vec<_> = pairs.iter().filter(|p| p.pattern == PATTERN_NONE).collect();
    assert!(liquid.len() > 500, "{}: only {} pixels of liquid", driver.name, liquid.len());
    at_least("straight through", driver, &other, 1.0, |p| p.angle <= 0.02 && same_color(p, 0.01));
    if s.refractions == 1 {
        // No search: the bent direction up to single precision. Its colour crosses the sun's edge now and then.
        at_least("direction within 0.02 degrees", driver, &liquid, 1.0, |p| p.angle <= 0.02);
        at_least("colour", driver, &liquid, 0.999, |p| same_color(p, 0.01));
        at_least("pattern", driver, &liquid, 1.0, |p| p.pattern == p.twin.pattern);
        return Vec::new();
    }
    for outcome in 1..=7 {
        let count =
            |hit: &dyn Fn(&&&Pair) -> bool| 100.0 * liquid.iter().filter(hit).count() as f64 / liquid.len() as f64;
        let (gpu, twin) = (count(&|p| p.outcome == outcome), count(&|p| p.twin.outcome == outcome));
        println!("    outcome {outcome}: {gpu:.1} % (twin {twin:.1} %)");
    }
    at_least("decided", driver, &liquid, 0.985, |p| !p.undecided);
    let hit: Vec<_> = liquid.iter().copied().filter(|p| p.outcome == OUTCOME_HIT && !p.undecided).collect();
    at_least("pixels that hit", driver, &liquid, 0.2, |p| p.outcome == OUTCOME_HIT);
    at_least("direction within 0.2 degrees", driver, &hit, 0.985, |p| p.angle <= 0.2);
    at_least("length within 1 %", driver, &hit, 0.985, |p| p.length_off() <= 0.01 * p.twin.length);
    at_least("pattern", driver, &hit, 0.99, |p| p.pattern == p.twin.pattern);
    let agree: Vec<_> = hit.into_iter().filter(|p| p.angle <= 0.2).collect();
    at_least("colour", driver, &agree, 0.99, |p| same_color(p, 0.01));
    pairs.into_iter().filter(|p| p.pattern != PATTERN_NONE && !p.undecided).collect()
}

/// Before a scene of the host's: where it is met, and what is seen there.
pub fn compare_before(driver: &Driver, case: &Case, painted: &Painted, background: Background) {
    let images = HostScene::new(driver.gpu(), &case.camera, case.size, painted);
    let shot = driver.shoot_before(case, images.input(), background);
    let depth: Vec<f64> = painted.0.iter().map(|d| d / shot.space.radius).collect();
    let scene = Scene { depth: &depth, color: &painted.1, sky: background == Background::Host };
    let pairs = pairs(driver, case, &shot, Some(scene), &SKY);
    let (liquid, other): (Vec<_>, Vec<_>) = pairs.iter().partition(|p| p.pattern != PATTERN_NONE);
    println!("  {background:?}, refractions {}: {} pixels of liquid", case.settings.walk().refractions, liquid.len());
    assert!(liquid.len() > 500, "{}: only {} pixels of liquid", driver.name, liquid.len());
    at_least("first volume", driver, &liquid, 0.999, |p| first_volume(p.pattern) == first_volume(p.twin.pattern));
    at_least("no liquid", driver, &other, 0.999, |p| p.twin.pattern == PATTERN_NONE);
    if background == Background::Environment {
        at_least("straight through", driver, &other, 0.999, |p| p.angle <= 0.02 && same_color(p, 0.01));
    }
    if case.settings.walk().refractions > 1 {
        let met: Vec<_> = liquid.iter().copied().filter(|p| p.outcome == OUTCOME_SCENE).collect();
        assert!(met.len() > 300, "{}: only {} pixels meet the scene", driver.name, met.len());
        at_least("the scene is met", driver, &met, 0.97, |p| p.twin.outcome == OUTCOME_SCENE);
        let both: Vec<_> = met.into_iter().filter(|p| p.twin.outcome == OUTCOME_SCENE && p.angle <= 0.2).collect();
        at_least("direction", driver, &both, 0.99, |p| p.angle <= 0.2);
        at_least("length within 1 %", driver, &both, 0.98, |p| p.length_off() <= 0.01 * p.twin.length);
        at_least("pattern", driver, &both, 0.99, |p| p.pattern == p.twin.pattern);
    }
    // A ray half a hundredth of a degree off may meet the next block.
    let agree: Vec<_> = liquid.into_iter().filter(|p| p.angle <= 0.05 && p.outcome == p.twin.outcome).collect();
    at_least("colour", driver, &agree, 0.97, |p| same_color(p, 0.02));
}

fn optics(refractions: u32, internal_reflections: u32, fresnel: Fresnel, absorption: Vec3) -> Settings {
    {
        let mut settings = imai16().refractions(refractions).reflections(internal_reflections).absorption(absorption);
        settings.set("fresnel", if fresnel == Fresnel::Exact { "exact" } else { "schlick" }).expect("a parameter");
        settings
    }
}

const CLEAR: Vec3 = Vec3::ZERO;

#[cfg(feature = "io")]
#[test]
fn a_dam_break_is_walked_as_its_twin_walks_it() {
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/dam_break.bgeo"));
    let file = meniscus::io::particles::read(path).expect("the asset");
    let middle = file.positions.iter().sum::<DVec3>() / file.positions.len() as f64;
    let positions: Vec<Vec3> = file.positions.iter().map(|p| (*p - middle).as_vec3()).collect();
    let input = meniscus::prepare::Input::new(&positions, 0.025);
    let (particles, _) = meniscus::prepare::prepare(&input, &meniscus::prepare::Options::default()).expect("prepared");
    let (low, high) = particles.bounds().unwrap();
    let eye = 0.5 * (low + high) + 0.8 * (high - low).length() * Vec3::new(0.5, 0.45, 0.75).normalize();
    let camera = camera(eye, 0.5 * (low + high), SIZE);
    let tinted = Vec3::new(2.0, 0.7, 0.3);
    each_driver(|driver| {
        let mut all = Vec::new();
        for settings in [
            optics(4, 4, Fresnel::Schlick, CLEAR),
            optics(4, 0, Fresnel::Exact, tinted),
            optics(2, 4, Fresnel::Exact, tinted),
            optics(2, 0, Fresnel::Schlick, CLEAR),
            optics(1, 0, Fresnel::Schlick, tinted),
            optics(1, 4, Fresnel::Exact, CLEAR),
        ] {
            let case = Case { particles: particles.clone(), camera, settings, size: SIZE, eye_inside: false };
            all.extend(compare(driver, &case));
        }
        let outcomes = [OUTCOME_HIT, OUTCOME_SIDE_WALL, OUTCOME_LEFT_VIEW, OUTCOME_REFLECTION_LIMIT];
        compare_outcomes(driver, &all, &outcomes);
    });
}

#[test]
fn random_clouds_are_walked_as_their_twin_walks_them() {
    let tinted = Vec3::new(0.2, 1.5, 3.0);
    let cloud = |seed, splash, body| -> Particles {
        random_cloud(seed, 0.12, Vec3::new(-0.8, -0.6, -0.5), Vec3::new(0.8, 0.6, 0.5), splash, body)
    };
    each_driver(|driver| {
        let mut all = Vec::new();
        for (particles, settings) in [
            (cloud(1, 12, 40), optics(4, 4, Fresnel::Exact, tinted)),
            (cloud(2, 12, 40), optics(4, 0, Fresnel::Schlick, CLEAR)),
            (cloud(3, 12, 40), optics(1, 4, Fresnel::Schlick, tinted)),
            (cloud(4, 12, 0), optics(4, 4, Fresnel::Schlick, tinted)),
            (cloud(5, 0, 40), optics(2, 4, Fresnel::Exact, CLEAR)),
        ] {
            let camera = camera(Vec3::new(0.3, 0.4, 2.2), Vec3::ZERO, SIZE);
            all.extend(compare(driver, &Case { particles, camera, settings, size: SIZE, eye_inside: false }));
        }
        // Nothing reaches to the picture's edge.
        compare_outcomes(driver, &all, &[OUTCOME_HIT, OUTCOME_SIDE_WALL, OUTCOME_REFLECTION_LIMIT]);
    });
}

/// A stray droplet far behind the liquid moves no threshold of the search, as it did where they went by the distance of the liquid's box:
/// all that changes is where along longer rays the same walls are looked for.
#[cfg(feature = "io")]
#[test]
fn a_stray_droplet_changes_little() {
    let rest = Case { settings: optics(4, 4, Fresnel::Schlick, CLEAR), ..crate::splat::dam_break().clone() };
    let mut stray = rest.clone();
    let (low, high) = rest.particles.bounds().expect("particles");
    let to_middle = 0.5 * (low + high) - rest.camera.view.inverse().w_axis.truncate();
    let far = 0.5 * (low + high) + 4.0 * to_middle;
    stray.particles.ellipsoids.insert(0, sphere(far, SPLASH_RADIUS * rest.particles.radius));
    stray.particles.splash_count += 1;
    each_driver(|driver| {
        let [a, b] = [&rest, &stray].map(|case| driver.shoot(case));
        let changed =
            |(a, b): &(&[f32; 3], &[f32; 3])| (Vec3::from(**a) - Vec3::from(**b)).abs().max_element() > 8.0 / 255.0;
        let liquid =
            a.floats("walk (debug)", 0).unwrap().chunks_exact(4).filter(|w| w[0] as u32 != PATTERN_NONE).count();
        let changed = a.picture.iter().zip(&b.picture).filter(changed).count();
        println!("{}: {changed} of {liquid} pixels", driver.name);
        assert!(liquid > 10_000 && 200 * changed <= liquid, "{}: {changed} of {liquid} pixels", driver.name);
    });
}

/// Liquid too dark to see through: black, and no pixel that is no number, even where a wall lies at hand.
#[cfg(feature = "io")]
#[test]
fn what_absorbs_everything_is_black() {
    let size = [1024, 768];
    let dam_break = crate::splat::dam_break();
    let mut settings = imai16().absorption(Vec3::new(1e30, 3e38, 0.0));
    settings.set("sigma", "180").expect("a parameter");
    let aspect = size[0] as f32 / size[1] as f32;
    let mut camera = dam_break.camera;
    camera.projection = glam::camera::rh::proj::vulkan::perspective_infinite(45f32.to_radians(), aspect, 0.01);
    let case = Case { settings, size, camera, ..dam_break.clone() };
    each_driver(|driver| {
        let shot = driver.shoot(&case);
        let bad = shot.picture.iter().flatten().filter(|v| !v.is_finite()).count();
        assert_eq!(bad, 0, "{}: values that are no numbers", driver.name);
    });
}
