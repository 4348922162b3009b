//! Whether the eye is inside the body, where the device finds out: what the CPU says, and then the same picture as where the host says so.

use crate::{
    field_walk, shape,
    support::{Case, Choose, Driver, Random, Shot, camera, each_driver, imai16},
    surface::asking,
};
use ash::vk::ImageView;
use glam::Vec3;
use meniscus::{
    EyeInside, FrameInput, Settings,
    host::Upload,
    layers::{Layers, dense_grid::DenseGrid, field::Field},
    prepare::{DensityField, DeviceCount, DevicePositions, Fit, Input, Options, Search, prepare},
    shader::EYE_INSIDE,
    twin::eye::density,
};

const RADIUS: f32 = 0.05;
const SIZE: [u32; 2] = [64, 48];
/// Densities nearer to the surface's than that may be on either side of it: float32 sums of a few hundred weights, 6e-8 each, and
/// the eye, known to a thousandth of a radius a few thousand radii away from where the liquid's own space begins.
const ROUNDING: f64 = 1e-3;

/// Positions that the host has uploaded, as a frame takes them.
fn given(upload: &Upload, count: usize, radius: f32, options: Options) -> DevicePositions {
    DevicePositions::packed(upload.buffer, count as u32, radius).options(options)
}

/// What the device decided.
fn decided(shot: &Shot) -> bool {
    assert!([0.0, 1.0].contains(&shot.block.eye_inside), "{}", shot.block.eye_inside);
    shot.block.eye_inside == 1.0
}

/// In the gap of [`block`]; the near plane lies in none of its particles, as they are drawn.
const MIDDLE: Vec3 = Vec3::new(0.003, 0.002, -0.004);

/// Seven particles each way without the one in the middle, and a droplet of one beside them.
fn block() -> Vec<Vec3> {
    let at = |i: i32| Vec3::new((i % 7) as f32, (i / 7 % 7) as f32, (i / 49) as f32) - 3.0;
    let block = (0..343).filter(|i| *i != 171).map(|i| 2.0 * RADIUS * at(i));
    block.chain([Vec3::new(1.0, 0.2, 0.0)]).collect()
}

/// Eyes in and around a cloud, and where they look: within what single precision knows of far places, along an axis.
fn eyes(random: &mut Random, positions: &[Vec3], radius: f32) -> Vec<(Vec3, Vec3)> {
    let mut eyes: Vec<Vec3> = (0..7)
        .map(|i| {
            let near = positions[(i * 397) % positions.len()];
            near + radius * random.point(Vec3::splat(-3.0), Vec3::splat(3.0))
        })
        .collect();
    // On a particle; and beside all cells.
    eyes.extend([positions[positions.len() / 2], positions[0] + Vec3::new(0.0, 1e4 * radius, 0.0)]);
    let far = |eye: Vec3| eye.abs().max_element() > 1e3;
    eyes.into_iter().map(|eye| (eye, if far(eye) { eye - Vec3::Z } else { eye + Vec3::new(0.3, -0.2, -0.9) })).collect()
}

#[test]
fn the_device_decides_as_the_cpu() {
    let mut clouds = shape::clouds();
    // With a stray, for which cells take more bits than a word has.
    let strewn = block().into_iter().chain([Vec3::splat(450.0)]).collect();
    clouds.extend([("a block", RADIUS, block()), ("a block and a stray", RADIUS, strewn)]);
    each_driver(|driver| {
        let (mut random, mut seen, mut near, mut unknown) = (Random(31), [0, 0], 0, 0);
        for (name, radius, positions) in &clouds {
            let strays = [Vec3::NAN, Vec3::INFINITY, Vec3::new(0.0, f32::NEG_INFINITY, 0.0)];
            let all: Vec<Vec3> = positions.iter().chain(&strays).copied().collect();
            let upload = Upload::new(driver.gpu(), bytemuck::cast_slice(&all)).expect("upload");
            for (search, ellipsoids) in [(Search::Runs, Fit::InPlace), (Search::Relation, Fit::YuTurk)] {
                let options = Options { search, ellipsoids, ..Options::default() };
                let field = DensityField::new(positions, *radius, &options).expect("sorted");
                for (eye, target) in eyes(&mut random, positions, *radius) {
                    let case = Case { camera: camera(eye, target, [16, 16]), ..shape::empty(*radius) };
                    let positions_there = given(&upload, all.len(), *radius, options);
                    let shot =
                        driver.shoot_with(&case, &|i| i.positions(positions_there).eye_inside(EyeInside::OnDevice));
                    let (cpu, twin) =
                        (f64::from(field.relative_density(eye)), density(&shot.block, &shot.space, &all, 4.0));
                    let label = format!("{}: {name}: {search:?}, {ellipsoids:?}, eye {eye}: {cpu}", driver.name);
                    // A picture knows its eye to so many digits, counted from the origin of the liquid's own space.
                    if (eye.as_dvec3() - shot.space.origin).length() > 1e4 * f64::from(*radius) {
                        unknown += 1;
                        continue;
                    }
                    assert!((cpu - twin).abs() < ROUNDING * cpu.max(1.0), "{label}, the twin's is {twin}");
                    if (twin - f64::from(EYE_INSIDE)).abs() < ROUNDING {
                        near += 1;
                        continue;
                    }
                    assert_eq!(decided(&shot), twin > f64::from(EYE_INSIDE), "{label}");
                    assert_eq!(decided(&shot), cpu >= f64::from(EYE_INSIDE), "{label}");
                    seen[usize::from(decided(&shot))] += 1;
                }
            }
        }
        println!("{}: {seen:?} eyes outside and inside, {near} at the surface, {unknown} too far", driver.name);
        assert!(seen[0] > 80 && seen[1] > 80 && near < 5, "{}: {seen:?}, {near}", driver.name);
        assert!(unknown < 60, "{}: {unknown}", driver.name);
    });
}

/// Through a flat surface, in steps of a twentieth of a radius: the decision changes once, where the CPU's does.
#[test]
fn it_changes_at_the_surface() {
    let positions = block();
    let field = DensityField::new(&positions, RADIUS, &Options::default()).expect("sorted");
    each_driver(|driver| {
        let upload = Upload::new(driver.gpu(), bytemuck::cast_slice(&positions)).expect("upload");
        let mut changes = 0;
        let mut last = true;
        for i in 0..50 {
            let eye = Vec3::new(0.013, RADIUS * (5.0 + 0.05 * i as f32), -0.021);
            let case = Case { camera: camera(eye, eye + Vec3::X, [16, 16]), ..shape::empty(RADIUS) };
            let shot = driver.shoot_with(&case, &|input| {
                let positions = given(&upload, positions.len(), RADIUS, Options::default());
                input.positions(positions).eye_inside(EyeInside::OnDevice)
            });
            let cpu = field.relative_density(eye);
            if f64::from(cpu - EYE_INSIDE).abs() > ROUNDING {
                assert_eq!(decided(&shot), cpu > EYE_INSIDE, "{}: {eye}: {cpu}", driver.name);
            }
            changes += u32::from(decided(&shot) != last);
            last = decided(&shot);
        }
        assert!(changes == 1 && !last, "{}: {changes} changes", driver.name);
    });
}

/// Of a crowd evenly chosen ones stand for all, as on the CPU.
#[test]
fn a_crowd_counts_whole() {
    let positions = vec![Vec3::new(0.01, 0.02, 0.03); 4000];
    let field = DensityField::new(&positions, RADIUS, &Options::default()).expect("sorted");
    each_driver(|driver| {
        let upload = Upload::new(driver.gpu(), bytemuck::cast_slice(&positions)).expect("upload");
        let mut inside = 0;
        for i in 0..30 {
            let eye = positions[0] + Vec3::X * RADIUS * (3.4 + 0.02 * i as f32);
            let case = Case { camera: camera(eye, eye + Vec3::X, [16, 16]), ..shape::empty(RADIUS) };
            let here = given(&upload, positions.len(), RADIUS, Options::default());
            let shot = driver.shoot_with(&case, &|input| input.positions(here).eye_inside(EyeInside::OnDevice));
            let cpu = field.relative_density(eye);
            if f64::from(cpu - EYE_INSIDE).abs() > ROUNDING {
                assert_eq!(decided(&shot), cpu > EYE_INSIDE, "{}: {eye}: {cpu}", driver.name);
            }
            inside += u32::from(decided(&shot));
        }
        assert!((5..25).contains(&inside), "{}: {inside}", driver.name);
    });
}

/// All that is to be seen of a frame is what it is where the host says the same.
fn same(label: &str, found: &Shot, want: &Shot) {
    assert_eq!(bytemuck::bytes_of(&found.block), bytemuck::bytes_of(&want.block), "{label}: the frame's block");
    for name in ["walk (debug)", "final direction (debug)", "first surface"] {
        assert!(want.words(name, 0).is_some() && found.words(name, 0) == want.words(name, 0), "{label}: {name}");
    }
    assert!(found.picture == want.picture, "{label}: the picture");
}

#[test]
fn the_picture_is_that_of_the_right_word() {
    let positions = block();
    let far: Vec<Vec3> = positions.iter().map(|p| *p + Vec3::new(40.0, -3.0, 70.0)).collect();
    each_driver(|driver| {
        let [upload, elsewhere] =
            [&positions, &far].map(|all| Upload::new(driver.gpu(), bytemuck::cast_slice(all)).expect("upload"));
        let number = |n: u32| Upload::new(driver.gpu(), bytemuck::bytes_of(&n)).expect("upload");
        let (all, none) = (number(positions.len() as u32), number(0));
        let here = given(&upload, positions.len(), RADIUS, Options::default());
        let counted = |n: &Upload| here.device_count(DeviceCount::new(n.buffer, 0));
        let moved = Vec3::new(40.0, -3.0, 70.0);
        for (name, positions, eye, inside) in [
            ("the middle", here, MIDDLE, true),
            ("near the surface", here, Vec3::new(0.0, RADIUS * 6.7, 0.0), true),
            ("before it", here, Vec3::new(0.0, RADIUS * 7.6, 0.0), false),
            ("in a droplet", here, Vec3::new(1.01, 0.2, 0.01), false),
            ("far away", here, Vec3::new(0.3, 0.4, 300.0), false),
            ("elsewhere", given(&elsewhere, far.len(), RADIUS, Options::default()), moved + MIDDLE, true),
            ("as many as the device says", counted(&all), MIDDLE, true),
            ("none, as the device says", counted(&none), MIDDLE, false),
            ("none", given(&upload, 0, RADIUS, Options::default()), MIDDLE, false),
        ] {
            for refractions in [1, 2, 4] {
                let settings = imai16().refractions(refractions);
                let camera = camera(eye, eye + Vec3::new(0.5, 0.3, -1.0), SIZE);
                let case = Case { settings, camera, size: SIZE, ..shape::empty(RADIUS) };
                let asked = asking(driver.gpu(), SIZE);
                let shoot = |said: EyeInside| {
                    driver.shoot_with(&case, &|i| i.positions(positions).surface(asked.outputs()).eye_inside(said))
                };
                let [found, want, wrong] = [EyeInside::OnDevice, inside.into(), (!inside).into()].map(shoot);
                let label = format!("{}: {name}, {refractions} refractions", driver.name);
                if name == "none" {
                    assert!(!decided(&found) && found.picture == want.picture, "{label}");
                    continue;
                }
                same(&label, &found, &want);
                if inside && name != "near the surface" {
                    assert!(wrong.picture != want.picture, "{label}: it makes no difference");
                }
            }
        }
    });
}

/// The passes of a frame, the decision and the picture.
fn frame(driver: &Driver, input: &FrameInput) -> (Vec<String>, f32, Vec<[f32; 3]>) {
    let session = &mut *driver.session.borrow_mut();
    let times = session.frame(input).expect("frame").expect("timestamps");
    let passes = times.passes.iter().map(|p| p.name.clone()).collect();
    (passes, session.block().expect("block").eye_inside, session.picture().expect("picture"))
}

/// Of particles that stay where they are nothing is sorted anew, wherever the eye goes and whoever decides.
#[test]
fn an_eye_goes_through_particles_that_stay() {
    let positions = block();
    let case = shape::empty(RADIUS);
    each_driver(|driver| {
        let upload = Upload::new(driver.gpu(), bytemuck::cast_slice(&positions)).expect("upload");
        let here = given(&upload, positions.len(), RADIUS, Options::default());
        driver.session.borrow_mut().resize(case.size).expect("size");
        for (i, (y, said)) in [0.0, 6.0, 9.0, 3.0, 12.0, 0.0, 0.0]
            .into_iter()
            .zip([EyeInside::OnDevice; 5].into_iter().chain([EyeInside::Inside, EyeInside::OnDevice]))
            .enumerate()
        {
            let eye = Vec3::new(0.01, y * RADIUS, 0.02);
            let camera = camera(eye, eye + Vec3::new(0.2, 0.3, -1.0), case.size);
            let input = FrameInput::new(0, &camera, &case.settings, ImageView::null()).positions(here);
            let (passes, inside, picture) = frame(driver, &input.eye_inside(said).still(true));
            let label = format!("{}: frame {i}: {passes:?}", driver.name);
            assert_eq!(passes.iter().any(|p| p == "sort"), i == 0, "{label}");
            assert_eq!(passes.iter().any(|p| p == "eye"), said == EyeInside::OnDevice, "{label}");
            assert_eq!(inside, f32::from(y < 7.0), "{label}");
            // As the frame that the host tells.
            let want = frame(driver, &input.eye_inside(y < 7.0).still(true));
            assert!(want.2 == picture, "{label}: the picture");
        }
    });
}

/// Nothing is done where nothing comes of it: a density field knows by itself, and look-ups do not ask.
#[test]
fn who_does_not_ask_is_not_told() {
    let positions = block();
    let preset = |name: &str| Settings::from(meniscus::Method::preset(name).expect("a preset"));
    let field = field_walk::case(Field::default(), 4, 1).settings;
    let mut grid = field;
    grid.method.layers = Layers::DenseGrid(DenseGrid::default());
    let input = Input::new(&positions, RADIUS);
    let (prepared, _) = prepare(&input, &Options::default()).expect("valid");
    each_driver(|driver| {
        let upload = Upload::new(driver.gpu(), bytemuck::cast_slice(&positions)).expect("upload");
        let here = given(&upload, positions.len(), RADIUS, Options::default());
        let eye = MIDDLE;
        for (name, settings, asks) in [
            ("field", field, false),
            ("dense grid", grid, false),
            ("green10", preset("green10"), false),
            ("im16", preset("im16"), false),
            ("imai14", preset("imai14"), true),
            ("imai16", imai16(), true),
        ] {
            let camera = camera(eye, eye + Vec3::X, SIZE);
            let case = Case { settings, camera, size: SIZE, ..shape::empty(RADIUS) };
            driver.session.borrow_mut().resize(SIZE).expect("size");
            let shoot = |said| {
                let input = FrameInput::new(0, &case.camera, &case.settings, ImageView::null());
                frame(driver, &input.positions(here).eye_inside(said))
            };
            let [found, inside, outside] = [EyeInside::OnDevice, EyeInside::Inside, EyeInside::Outside].map(shoot);
            let label = format!("{}: {name}", driver.name);
            assert_eq!(found.0.iter().any(|p| p == "eye"), asks, "{label}: {:?}", found.0);
            assert!(!inside.0.iter().chain(&outside.0).any(|p| p == "eye"), "{label}");
            assert!(found.2 == inside.2, "{label}: the picture");
            assert_eq!(inside.2 != outside.2, asks, "{label}: what comes of it");
            // Particles of the host's.
            let given = Case { particles: prepared.clone(), ..case.clone() };
            driver.give(&given);
            let input = FrameInput::new(0, &case.camera, &case.settings, ImageView::null());
            let drawn = driver.session.borrow_mut().frame(&input.eye_inside(EyeInside::OnDevice));
            match drawn {
                Ok(_) => assert!(!asks, "{label}: it cannot be known"),
                Err(e) => {
                    let said = e.to_string();
                    assert!(asks && said.contains("eye inside is left to the device"), "{label}: {said}");
                    assert!(said.contains("prepare::DensityField (C: meniscus_density_at)"), "{label}: {said}");
                }
            }
        }
    });
}

/// What was compiled ahead is all that is needed.
#[test]
fn it_is_compiled_ahead() {
    let positions = block();
    let case = shape::empty(RADIUS);
    each_driver(|driver| {
        let upload = Upload::new(driver.gpu(), bytemuck::cast_slice(&positions)).expect("upload");
        let renderer = &mut driver.session.borrow_mut().renderer;
        renderer.resize(case.size).expect("size");
        renderer.warm_up(&case.settings).expect("compiled");
        for search in [Search::Runs, Search::Relation] {
            let here = given(&upload, positions.len(), RADIUS, Options { search, ..Options::default() });
            let input = FrameInput::new(0, &case.camera, &case.settings, ImageView::null()).positions(here);
            let missing = renderer.warm_up_like(&input.eye_inside(EyeInside::OnDevice)).expect("compiled");
            assert_eq!(missing, 0, "{}: {search:?}", driver.name);
        }
    });
}
