//! Whole frames, as a caller gets them, against pictures kept in tests/goldens. A pass has its twin; that all of them
//! together still make the same picture is looked at here. `MENISCUS_BLESS=1 MENISCUS_DRIVERS="Mesa 22" cargo test --test gpu
//! goldens` makes the pictures anew on one driver; look at them before you commit them.
#![cfg(feature = "io")]

use crate::{
    background::{HostScene, painted},
    drivers,
    support::{Case, Choose, Driver, camera, each_driver, imai16, lattice, random_cloud},
};
use glam::Vec3;
use image::{ImageBuffer, Rgb};
use meniscus::{
    Ellipsoid, FrameInput, Method, PRESETS, Particles,
    host::Upload,
    inspect::Inspection,
    prepare::{DevicePositions, Search},
};
use std::path::{Path, PathBuf};

const SIZE: [u32; 2] = [96, 72];

/// A picture of 16 bits a channel: c = sqrt(v / (1 + v)) of linear light v, which any viewer shows well enough, and in which
/// the sun weighs no more than what is seen by its light. Linear light is c^2 / (1 - c^2), to about a ten-thousandth; floats
/// would say the same at several times the size, and the tolerances, which have to bound both the sun and what is dark, would
/// be in this code all the same.
type Golden = ImageBuffer<Rgb<u16>, Vec<u16>>;

fn encode(v: f32) -> f32 {
    (v / (1.0 + v)).sqrt()
}

/// How far two pictures may be apart, in units of white (1 is infinitely bright). Drivers round otherwise, and a rounding
/// error that decides which way a ray goes changes its pixel altogether: so a share of the pixels may differ by more than
/// `near`, and none by more than `far`; the mean includes them all.
#[derive(Clone, Copy)]
struct Tolerance {
    mean: f32,
    near: f32,
    share: f32,
    far: f32,
}

/// What one refraction shows follows from the first surface alone.
const FIRST: Tolerance = Tolerance { mean: 6e-4, near: 0.02, share: 2e-3, far: 0.1 };
/// Rays that leave through walls, and the walls' edges. Lavapipe and SwiftShader are 3e-4 apart in the mean, and more than
/// `near` at one pixel in a thousand, by 0.16 at most.
const WALKED: Tolerance = Tolerance { mean: 6e-4, near: 0.02, share: 1e-2, far: 0.4 };

/// What is too far off in a picture, if anything.
fn compare(golden: &Golden, picture: &[[f32; 3]], tolerance: Tolerance) -> Result<String, String> {
    if golden.dimensions() != (SIZE[0], SIZE[1]) || picture.len() != (SIZE[0] * SIZE[1]) as usize {
        return Err(format!("{:?} pixels, and {}", golden.dimensions(), picture.len()));
    }
    // Comparisons with what is no number are false, and means of it are none.
    if let Some(i) = picture.iter().position(|c| !c.iter().all(|v| v.is_finite() && *v >= 0.0)) {
        return Err(format!("pixel {i} is {:?}", picture[i]));
    }
    let off = |(want, got): (&Rgb<u16>, &[f32; 3])| {
        (0..3).map(|k| (f32::from(want[k]) / 65535.0 - encode(got[k])).abs()).fold(0.0, f32::max)
    };
    let off: Vec<f32> = golden.pixels().zip(picture).map(off).collect();
    let count = off.len() as f32;
    let mean = off.iter().sum::<f32>() / count;
    let share = off.iter().filter(|d| **d > tolerance.near).count() as f32 / count;
    let most = off.iter().copied().fold(0.0, f32::max);
    let said = format!(
        "off by {mean:.5} in the mean, {most:.3} at most; {:.2} % by more than {}",
        100.0 * share,
        tolerance.near
    );
    let fine = mean <= tolerance.mean && share <= tolerance.share && most <= tolerance.far;
    if fine { Ok(said) } else { Err(said) }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/goldens")
}

/// Compares with the picture of this name, or makes it where MENISCUS_BLESS says so.
fn check(driver: &Driver, name: &str, picture: &[[f32; 3]], tolerance: Tolerance) {
    let path = folder().join(format!("{name}.png"));
    if std::env::var_os("MENISCUS_BLESS").is_some_and(|v| v == "1") {
        assert_eq!(drivers::count(), 1, "one driver makes the pictures: say which with MENISCUS_DRIVERS");
        let codes = picture.iter().flatten().map(|v| (65535.0 * encode(*v)).round() as u16).collect();
        Golden::from_raw(SIZE[0], SIZE[1], codes).expect("three codes a pixel").save(&path).expect("written");
        std::fs::write(path.with_extension("txt"), format!("{}\n", driver.name)).expect("written");
    }
    let golden = image::open(&path).unwrap_or_else(|e| panic!("{name}: {e}: look at tests/gpu/goldens.rs"));
    let maker = std::fs::read_to_string(path.with_extension("txt")).expect("the driver that made it");
    match compare(&golden.into_rgb16(), picture, tolerance) {
        Ok(said) => println!("{}: {name}: {said}", driver.name),
        Err(said) => panic!("{}: {name} (made by {}): {said}", driver.name, maker.trim()),
    }
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
    let golden = image::open(folder().join("dam_break_4.png")).expect("a golden").into_rgb16();
    let decode = |c: u16| (f32::from(c) / 65535.0).powi(2) / (1.0 - (f32::from(c) / 65535.0).powi(2));
    let right: Vec<[f32; 3]> = golden.pixels().map(|p| p.0.map(decode)).collect();
    let judge = |picture: &[[f32; 3]]| compare(&golden, picture, WALKED);
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
