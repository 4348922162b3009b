//! Whole frames, as a caller gets them, against pictures kept in tests/goldens. A pass has its twin; that all of them
//! together still make the same picture is looked at here. `MENISCUS_BLESS=1 MENISCUS_DRIVERS="Mesa 22" cargo test --test gpu
//! goldens` makes the pictures anew on one driver; look at them before you commit them.
#![cfg(feature = "io")]

use crate::{
    background::{HostScene, painted},
    support::{Case, Choose, Driver, camera, each_driver, imai16, lattice, random_cloud},
};
use glam::Vec3;
use meniscus::{
    Ellipsoid, FrameInput, Method, PRESETS, Particles,
    harness::{Goldens, Reference, Tolerance},
    host::Upload,
    inspect::Inspection,
    prepare::{DevicePositions, Search},
};
use std::path::{Path, PathBuf};

const SIZE: [u32; 2] = [96, 72];

/// What one refraction shows follows from the first surface alone.
const FIRST: Tolerance = Tolerance { mean: 6e-4, near: 0.02, share: 2e-3, far: 0.1 };
/// Rays that leave through walls, and the walls' edges. Lavapipe and SwiftShader are 3e-4 apart in the mean, and more than
/// `near` at one pixel in a thousand, by 0.16 at most.
const WALKED: Tolerance = Tolerance { mean: 6e-4, near: 0.02, share: 1e-2, far: 0.4 };

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/goldens")
}

/// Compares with the picture of this name, or makes it where MENISCUS_BLESS says so.
fn check(driver: &Driver, name: &str, picture: &[[f32; 3]], tolerance: Tolerance) {
    Goldens::new(folder()).check(&driver.name, name, SIZE, picture, tolerance);
}

/// The picture alone, from the programs that a caller's frames use: `shoot` draws with those that write targets, too.
fn render(driver: &Driver, case: &Case, change: &dyn for<'b> Fn(FrameInput<'b>) -> FrameInput<'b>) -> Vec<[f32; 3]> {
    render_moving(driver, case, &[], change)
}

/// The same of particles whose speeds are known, if there are any.
fn render_moving(
    driver: &Driver,
    case: &Case,
    speeds: &[f32],
    change: &dyn for<'b> Fn(FrameInput<'b>) -> FrameInput<'b>,
) -> Vec<[f32; 3]> {
    driver.give(case);
    let session = &mut *driver.session.borrow_mut();
    session.renderer.inspect(Inspection::default());
    if !speeds.is_empty() {
        session.renderer.set_speeds(speeds).expect("speeds");
    }
    session.resize(case.size).expect("size");
    let input = FrameInput::new(0, &case.camera, &case.settings, ash::vk::ImageView::null());
    session.frame(&change(input.eye_inside(case.eye_inside))).expect("frame");
    session.picture().expect("picture")
}

const TINTED: Vec3 = Vec3::new(2.0, 0.7, 0.3);

fn dam_break(refractions: u32, internal_reflections: u32) -> Case {
    let case = crate::splat::dam_break();
    let mut settings = imai16().refractions(refractions).reflections(internal_reflections).absorption(TINTED);
    settings.set("fresnel", "exact").expect("a parameter");
    Case { settings, size: SIZE, ..case.clone() }
}

#[test]
fn a_dam_break() {
    each_driver(|driver| {
        for (refractions, reflections, tolerance) in [(1, 0, FIRST), (2, 4, WALKED), (4, 4, WALKED)] {
            let picture = render(driver, &dam_break(refractions, reflections), &|input| input);
            check(driver, &format!("dam_break_{refractions}"), &picture, tolerance);
        }
    });
}

/// The same picture from positions on the device.
#[test]
fn a_dam_break_prepared_on_the_device() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/dam_break.bgeo");
    let file = meniscus::io::particles::read(path.as_ref()).expect("the frame reads");
    let positions: Vec<Vec3> = file.positions.iter().map(|p| p.as_vec3()).collect();
    each_driver(|driver| {
        let upload = Upload::new(driver.gpu(), bytemuck::cast_slice(&positions)).expect("upload");
        let packed = DevicePositions::packed(upload.buffer, positions.len() as u32, 0.025);
        for search in [Search::Runs, Search::Relation] {
            let options = meniscus::prepare::Options { search, ..Default::default() };
            let given = packed.options(options);
            let picture = render(driver, &dam_break(4, 4), &|input| input.positions(given));
            check(driver, "dam_break_4", &picture, WALKED);
        }
    });
}

/// Droplets of every size on the screen before, in and behind a block of liquid.
fn splash_and_body() -> Case {
    let mut particles = random_cloud(8, 0.06, Vec3::new(-0.8, -0.2, -0.7), Vec3::new(0.8, 0.7, 1.2), 30, 0);
    particles.ellipsoids.extend(lattice(Vec3::new(0.0, -0.4, 0.0), 0.06, [10, 4, 6]));
    let settings = imai16().absorption(TINTED);
    Case {
        particles,
        camera: camera(Vec3::new(0.4, 0.7, 2.4), Vec3::ZERO, SIZE),
        settings,
        size: SIZE,
        eye_inside: false,
    }
}

#[test]
fn droplets_and_a_body() {
    each_driver(|driver| check(driver, "splash_and_body", &render(driver, &splash_and_body(), &|input| input), WALKED));
}

/// Stripes of a host's behind, and one before.
#[test]
fn a_scene_of_the_hosts() {
    let case = splash_and_body();
    let depth = |x: u32, y: u32| match (x / 12 + y / 18) % 4 {
        0 => 2.2,
        1 => 3.4,
        2 => 5.0,
        _ => f64::INFINITY,
    };
    let scene = painted(SIZE, depth);
    each_driver(|driver| {
        let images = HostScene::new(driver.gpu(), &case.camera, SIZE, &scene);
        let picture = render(driver, &case, &|input| input.scene(images.input()));
        check(driver, "scene", &picture, WALKED);
    });
}

/// The methods beside Imai16's, which has all the other pictures.
#[test]
fn every_preset() {
    each_driver(|driver| {
        for preset in PRESETS.iter().filter(|p| p.name != "imai16") {
            let mut case = dam_break(1, 0);
            case.settings.method = preset.method();
            check(driver, preset.name, &render(driver, &case, &|input| input), WALKED);
        }
    });
}

/// Spray, upsampled: as fast as liquid is that falls from the top.
#[test]
fn spray_at_half_resolution() {
    let mut case = dam_break(1, 0);
    case.settings.method = Method::preset("cords08").expect("a preset");
    case.settings.set("half_resolution", "true").expect("a parameter");
    case.settings.set("spray", "0.8").expect("a parameter");
    let (low, high) = case.particles.bounds().expect("particles");
    let speed = |p: &Ellipsoid| (p.center.y - low.y) / (high.y - low.y);
    let speeds: Vec<f32> = case.particles.ellipsoids.iter().map(speed).collect();
    each_driver(|driver| check(driver, "spray", &render_moving(driver, &case, &speeds, &|input| input), WALKED));
}

#[test]
fn an_eye_inside() {
    let particles = Particles { radius: 0.1, ellipsoids: lattice(Vec3::ZERO, 0.1, [12, 8, 12]), splash_count: 0 };
    let camera = camera(Vec3::new(0.2, -0.1, 0.9), Vec3::new(-0.2, 0.3, -1.0), SIZE);
    let settings = imai16().absorption(0.3 * TINTED);
    let case = Case { particles, camera, settings, size: SIZE, eye_inside: true };
    each_driver(|driver| check(driver, "eye_inside", &render(driver, &case, &|input| input), WALKED));
}

/// The comparison sees what it is there for.
#[test]
fn wrong_pictures_are_told_from_right_ones() {
    let golden = Reference::open(&folder().join("dam_break_4.png")).expect("a golden");
    let right = golden.picture();
    let judge = |picture: &[[f32; 3]]| golden.compare(picture, WALKED);
    judge(&right).expect("itself");
    let wrong = |what: &str, change: &dyn Fn(usize, [f32; 3]) -> [f32; 3]| {
        let picture: Vec<_> = right.iter().enumerate().map(|(i, c)| change(i, *c)).collect();
        println!("{what}: {}", judge(&picture).expect_err(what));
    };
    let width = SIZE[0] as usize;
    wrong("one value that is no number", &|i, c| if i == 3000 { [c[0], f32::NAN, c[2]] } else { c });
    wrong("one value that is infinite", &|i, c| if i == 3000 { [f32::INFINITY; 3] } else { c });
    wrong("one that is below zero", &|i, c| if i == 3000 { [-0.1; 3] } else { c });
    wrong("black", &|_, _| [0.0; 3]);
    wrong("a tenth brighter", &|_, c| c.map(|v| 1.1 * v));
    wrong("red for blue", &|_, c| [c[2], c[1], c[0]]);
    wrong("a pixel to the side", &|i, _| right[(i + 1) % right.len()]);
    wrong("upside down", &|i, _| right[right.len() - 1 - i]);
    wrong("a corner missing", &|i, c| if i % width < 32 && i / width < 32 { [0.0; 3] } else { c });
    wrong("a brightest pixel where it is dark", &|i, c| if i == 0 { [1e9; 3] } else { c });
    assert!(judge(&right[1..]).is_err(), "a pixel short");
}
