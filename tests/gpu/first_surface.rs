//! The first surface that each pixel shows, against its twins: of maps in the GPU's own maps, of a field in the field that the device
//! has built.

use crate::{
    background::{HostScene, Painted, painted},
    field::words,
    field_walk, half,
    support::{Case, Choose, Driver, SKY, Shot, camera, each_driver, imai16, random_cloud},
    surface::asking,
    walk::{OwnMaps, degrees},
};
use glam::{DVec2, DVec3, Vec3};
use meniscus::{
    Background, Particles, inspect,
    layers::{Layers, field::Field},
    optics::instant_liquids::InstantLiquids,
    twin::{
        background::Scene,
        field_walk as twin,
        first_surface::{First, of_half, of_walks},
        upsample::upsample,
        walls::{Map, Maps},
    },
};

const SIZE: [u32; 2] = [120, 90];

/// A frame that says something of it, before a scene or the environment.
fn shoot(driver: &Driver, case: &Case, scene: Option<&HostScene>) -> Shot {
    let asked = asking(driver.gpu(), case.size);
    driver.shoot_with(case, &|input| input.surface(asked.outputs()).scene(scene.map(HostScene::input)))
}

/// As the GPU has found it.
fn found(shot: &Shot) -> Vec<Option<First>> {
    let words = shot.floats("first surface", 0).expect("asked for");
    let first = |w: &[f32]| First { normal: Vec3::new(w[0], w[1], w[2]).as_dvec3(), depth: w[3].into() };
    words.chunks_exact(4).map(|w| (w[3] != 0.0).then(|| first(w))).collect()
}

/// They are the twin's on all but so many of a thousand pixels, where rounding decides. `shown` at least show liquid.
fn same(
    driver: &Driver,
    what: &str,
    shot: &Shot,
    but: usize,
    shown: usize,
    twin: impl Fn([usize; 2]) -> Option<First>,
) {
    let width = shot.size[0] as usize;
    let (found, mut off, mut liquid, mut all) = (found(shot), Vec::new(), 0, 0);
    // One pixel of five: the twins' marches are slow.
    for (i, found) in found.iter().enumerate().filter(|(i, _)| (i % width + 2 * (i / width)).is_multiple_of(5)) {
        all += 1;
        let wanted = twin([i % width, i / width]);
        liquid += usize::from(wanted.is_some());
        let near = |a: &First, b: &First| {
            let unit = (a.normal.length() - 1.0).abs() < 1e-4;
            unit && (a.depth - b.depth).abs() <= 1e-3 * b.depth.max(1.0) && degrees(a.normal, b.normal) <= 0.1
        };
        let same = match (found, &wanted) {
            (Some(a), Some(b)) => near(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        if !same {
            off.push((i, *found, wanted));
        }
    }
    println!("{}: {what}: {} of {all} off, {liquid} show liquid", driver.name, off.len());
    assert!(liquid > shown, "{}: {what}: {liquid}", driver.name);
    assert!(off.len() * 1000 <= but * all, "{}: {what}: {}: {:?}", driver.name, off.len(), off.first());
}

fn linear(shot: &Shot, painted: &Painted) -> Vec<f64> {
    painted.0.iter().map(|d| d / shot.space.radius).collect()
}

/// A body with splashes around it.
fn cloud() -> Particles {
    random_cloud(7, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 30, 300)
}

/// Splashes and a smoothed body, far and around the eye, before the environment and before a plane in the middle of them.
#[test]
fn walks_start_where_the_twins_start() {
    let outside = camera(Vec3::new(0.4, 0.3, 2.4), Vec3::ZERO, SIZE);
    // A mirrored world: normals are those of the world.
    let mut mirrored = outside;
    mirrored.view *= glam::Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let within = camera(Vec3::new(0.05, 0.0, 0.1), Vec3::new(0.0, 0.2, -1.0), SIZE);
    let painted = painted(SIZE, |x, _| if x % 40 < 30 { 2.3 } else { f64::INFINITY });
    each_driver(|driver| {
        for (camera, eye_inside, refractions) in
            [(outside, false, 4), (mirrored, false, 1), (within, true, 4), (within, true, 1), (within, false, 4)]
        {
            let settings = imai16().refractions(refractions).iterations(2);
            let case = Case { particles: cloud(), camera, settings, size: SIZE, eye_inside };
            let images = HostScene::new(driver.gpu(), &camera, SIZE, &painted);
            for scene in [None, Some(&images)] {
                let shot = shoot(driver, &case, scene);
                let (own, depth) = (OwnMaps::of(&case, &shot), linear(&shot, &painted));
                let scene = scene.map(|_| Scene { depth: &depth, color: &painted.1, sky: false });
                let maps = Maps { scene, ..own.twin(&shot) };
                let what = format!("{refractions} refractions, inside {eye_inside}, scene {}", maps.scene.is_some());
                same(driver, &what, &shot, 2, 100, |pixel| of_walks(&maps, refractions == 1, pixel));
            }
        }
    });
}

/// At half resolution: what is upsampled, where it covers half of the pixel.
#[test]
fn half_resolution_is_upsampled_as_the_twin_does() {
    each_driver(|driver| {
        let optics = InstantLiquids::default().half_resolution(true);
        let case = half::case(half::liquid(), [75, 53], half::settings(optics, None));
        let shot = shoot(driver, &case, None);
        let ((depth, normal), half) = (half::maps(driver, &shot), inspect::half(&shot.frame));
        same(driver, "half resolution", &shot, 5, 60, |[x, y]| {
            let front = upsample(&half, &depth, &normal, &[], DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
            of_half(&shot.frame, &front, [x, y])
        });
    });
}

/// A field and balls: the surface that the walk meets first, behind what the scene leaves of it.
#[test]
fn a_fields_first_wall_is_the_twins() {
    each_driver(|driver| {
        let outside = field_walk::case(Field::default(), 4, 4);
        let eye = Vec3::new(-0.2, -0.3, 0.0);
        let within = Case { camera: camera(eye, eye - Vec3::Z, outside.size), ..outside.clone() };
        let painted = painted(outside.size, |x, y| if (x / 20 + y / 20) % 3 == 0 { 2.1 } else { f64::INFINITY });
        for case in [outside, within] {
            let Layers::Field(own) = case.settings.method.layers else { unreachable!("a field") };
            let images = HostScene::new(driver.gpu(), &case.camera, case.size, &painted);
            for scene in [None, Some(&images)] {
                let shot = shoot(driver, &case, scene);
                let bricks = words(&shot).bricks();
                let field = field_walk::twin_field(&shot, &bricks, own, case.particles.radius);
                let (none, depth) = (Map { depth: &[], normal: &[] }, linear(&shot, &painted));
                let scene = scene.map(|_| Scene { depth: &depth, color: &painted.1, sky: false });
                let view = Maps { frame: &shot.frame, maps: [[none; 2]; 2], scene };
                let settings = case.settings.walk();
                same(driver, &format!("field, scene {}", scene.is_some()), &shot, 4, 280, |pixel| {
                    twin::first_surface(&field, &view, &settings, &SKY, pixel)
                });
            }
        }
    });
}

/// Over the host's picture as before the environment; and a pixel shows liquid here where it does in the picture.
#[test]
fn it_is_where_the_picture_has_liquid() {
    each_driver(|driver| {
        let case = field_walk::case(Field::default(), 2, 0);
        let asked = asking(driver.gpu(), case.size);
        let over = driver.shoot_with(&case, &|i| i.surface(asked.outputs()).background(Background::Host));
        let plain = shoot(driver, &case, None);
        assert_eq!(over.words("first surface", 0), plain.words("first surface", 0), "{}", driver.name);
        // What the picture does not show stayed as it was cleared.
        for (i, (first, color)) in found(&over).iter().zip(&over.picture).enumerate() {
            assert_eq!(first.is_some(), *color != [0.0; 3], "{}: pixel {i}", driver.name);
        }
        let towards = |f: &First| f.normal.dot(DVec3::new(0.5, 0.9, 2.2)) > -2.0;
        assert!(found(&over).iter().flatten().all(towards), "{}", driver.name);
    });
}
