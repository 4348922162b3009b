//! Particles that do not move: what follows from them alone is kept from frame to frame, and nothing shows it.

use crate::{
    field,
    shape::empty,
    support::{Case, Driver, Random, camera, each_driver, imai16},
};
use ash::vk;
use glam::Vec3;
use meniscus::{
    FrameInput, Settings,
    host::Upload,
    layers::field::Field,
    prepare::{DevicePositions, Input, Options, points},
};

const RADIUS: f32 = 0.05;

/// A block with spray around it.
fn cloud() -> Vec<Vec3> {
    let mut random = Random(21);
    let at = |i: i32| Vec3::new((i % 8) as f32, (i / 8 % 8) as f32, (i / 64) as f32) - 3.5;
    let block = (0..512).map(|i| 2.0 * RADIUS * at(i)).collect::<Vec<_>>();
    let spray = (0..40).map(|_| random.point(Vec3::splat(-0.8), Vec3::splat(0.8)));
    block.into_iter().chain(spray).collect()
}

/// Passes that work for the particles, and the picture.
type Seen = (Vec<String>, Vec<[f32; 3]>);

/// A frame of the particles as they are, in slot 0.
fn frame(driver: &Driver, input: &FrameInput) -> Seen {
    let session = &mut *driver.session.borrow_mut();
    let times = session.frame(input).expect("frame").expect("timestamps");
    let prepares = times.passes.iter().filter(|p| p.prepares).map(|p| p.name.clone()).collect();
    (prepares, session.picture().expect("picture"))
}

/// An orbit of 24 frames around particles that do not move, on the device or given by the host, of maps and of a field: the
/// same pictures, without the particles' passes from the third frame on (the second starts no classes anew).
#[test]
fn an_orbit_around_particles_that_stay_where_they_are() {
    let positions = cloud();
    let maps = imai16();
    let case = empty(RADIUS);
    each_driver(|driver| {
        let upload = Upload::new(driver.gpu(), bytemuck::cast_slice(&positions)).expect("upload");
        let on_device = DevicePositions::packed(upload.buffer, positions.len() as u32, RADIUS).keep_class_below(0.6);
        for (name, settings) in [("maps", maps), ("a field", field::settings(Field::default(), "four"))] {
            for given in [None, Some(on_device)] {
                let label = format!("{}: {name}, on the device: {}", driver.name, given.is_some());
                if given.is_none() {
                    let found = points(&Input::new(&positions, RADIUS), &Options::default()).expect("valid");
                    let case = Case { settings, ..field::prepared(&positions, &case) };
                    driver.give(&case);
                    driver.session.borrow_mut().renderer.set_points(&found).expect("points");
                }
                driver.session.borrow_mut().resize(case.size).expect("size");
                for i in 0..24 {
                    let (sin, cos) = (i as f32 * std::f32::consts::TAU / 24.0).sin_cos();
                    let camera = camera(Vec3::new(1.6 * sin, 0.5, 1.6 * cos), Vec3::ZERO, case.size);
                    let input = FrameInput::new(0, &camera, &settings, vk::ImageView::null()).positions(given);
                    let still = frame(driver, &input.still(true));
                    assert!(i < 2 || still.0.is_empty(), "{label}: {:?} in frame {i}", still.0);
                    // Compared with frames that do everything, some of the time: those start what is kept anew.
                    if i % 8 == 7 {
                        let whole = frame(driver, &input);
                        assert!(given.is_none() && name == "maps" || !whole.0.is_empty(), "{label}");
                        assert!(whole.1 == still.1, "{label}: the picture of frame {i} is another");
                    }
                }
            }
        }
    });
}

/// Nothing is kept of other particles, of other settings or of a frame that never ran, whatever the host says.
#[test]
fn what_has_changed_is_done_anew() {
    let positions = cloud();
    let moved: Vec<Vec3> = positions.iter().map(|p| *p + Vec3::new(0.1, 0.0, 0.0)).collect();
    let settings = field::settings(Field::default(), "two");
    let coarse = field::settings(Field::default().spacing(3.0), "two");
    let case = empty(RADIUS);
    let view = camera(Vec3::new(0.3, 0.4, 1.7), Vec3::ZERO, case.size);
    each_driver(|driver| {
        let uploads =
            [&positions, &moved].map(|all| Upload::new(driver.gpu(), bytemuck::cast_slice(all)).expect("upload"));
        let [first, second] =
            uploads.each_ref().map(|u| DevicePositions::packed(u.buffer, positions.len() as u32, RADIUS));
        driver.session.borrow_mut().resize(case.size).expect("size");
        let shoot = |settings: &Settings, positions, still: bool| {
            let input = FrameInput::new(0, &view, settings, vk::ImageView::null()).positions(positions);
            frame(driver, &input.still(still))
        };
        let wanted = [(&settings, first), (&settings, second), (&coarse, second)].map(|(s, p)| shoot(s, p, false).1);
        assert!(wanted[0] != wanted[1] && wanted[1] != wanted[2], "{}", driver.name);
        for (k, (settings, positions)) in
            [(&settings, first), (&settings, second), (&coarse, second)].iter().enumerate()
        {
            let (passes, picture) = shoot(settings, *positions, true);
            assert!(!passes.is_empty() && picture == wanted[k], "{}: change {k}", driver.name);
            let (passes, picture) = shoot(settings, *positions, true);
            assert!(passes.is_empty() && picture == wanted[k], "{}: after change {k}: {passes:?}", driver.name);
        }
        driver.session.borrow_mut().renderer.abandon(0);
        let (passes, picture) = shoot(&coarse, second, true);
        assert!(!passes.is_empty() && picture == wanted[2], "{}: after a frame that never ran", driver.name);
        // Particles of the host's, given once more.
        let give = |all: &[Vec3]| {
            driver.give(&field::prepared(all, &Case { settings, ..case.clone() }));
            let input = FrameInput::new(0, &view, &settings, vk::ImageView::null());
            frame(driver, &input.still(true))
        };
        let pictures = [give(&positions), give(&moved), give(&positions)];
        assert!(pictures.iter().all(|(passes, _)| !passes.is_empty()), "{}", driver.name);
        assert!(pictures[0].1 == pictures[2].1 && pictures[0].1 != pictures[1].1, "{}", driver.name);
    });
}
