//! Particles whose number only the device knows: the same bits as where the host knows it, whatever lies behind them.

use crate::{
    field_walk, shape,
    support::{Case, Driver, Random, Shot, camera, each_driver, imai16},
    surface::{BEFORE, floats, image, refused},
};
use ash::vk::{self, Format, Handle, ImageLayout as Layout, ImageView};
use glam::Vec3;
use meniscus::{
    Before, DeviceVectors, FrameInput, Motion, MovingParticles, Settings, SurfaceOutput, SurfaceOutputs,
    host::Upload,
    layers::field::Field,
    prepare::{DeviceCount, DevicePositions, Options, Search},
};

const RADIUS: f32 = 0.05;
const SIZE: [u32; 2] = [96, 72];
/// Where the number lies in its buffer: no multiple of what buffers are bound at.
const OFFSET: u64 = 268;

fn case(settings: Settings) -> Case {
    let camera = camera(Vec3::new(0.5, 0.9, 2.2), Vec3::ZERO, SIZE);
    Case { settings, camera, size: SIZE, ..shape::empty(RADIUS) }
}

/// A block, more of it right before the eye, and what must not be looked at.
struct Strewn {
    positions: Vec<Vec3>,
    block: usize,
    all: usize,
}

fn strewn() -> Strewn {
    let mut random = Random(3);
    let mut scatter = |n, low, high| (0..n).map(|_| random.point(low, high)).collect::<Vec<_>>();
    let mut positions = scatter(2200, Vec3::splat(-0.5), Vec3::splat(0.5));
    let block = positions.len();
    positions.extend(scatter(500, Vec3::new(0.0, 0.0, 0.6), Vec3::new(0.6, 0.7, 1.6)));
    let all = positions.len();
    positions.extend([Vec3::splat(1e30), Vec3::splat(f32::NAN), Vec3::splat(-3e4), Vec3::INFINITY]);
    Strewn { positions, block, all }
}

/// A buffer with the number at `OFFSET`, and others beside it.
fn number<'a>(driver: &Driver<'a>, number: usize) -> Upload<'a> {
    let mut words = [7_777_777; OFFSET as usize / 4 + 2];
    words[OFFSET as usize / 4] = number as u32;
    Upload::new(driver.gpu(), bytemuck::cast_slice(&words)).expect("upload")
}

fn count(upload: &Upload) -> DeviceCount {
    DeviceCount::new(upload.buffer, OFFSET)
}

/// All that there is to see of a frame is the same.
fn same(label: &str, found: &Shot, want: &Shot) {
    assert_eq!(found.words("extent", 0), want.words("extent", 0), "{label}: what is known of all");
    assert_eq!(found.counters, want.counters, "{label}: what is counted");
    assert_eq!(bytemuck::bytes_of(&found.block), bytemuck::bytes_of(&want.block), "{label}: the frame's block");
    let off: Vec<_> = found.picture.iter().zip(&want.picture).enumerate().filter(|(_, (a, b))| a != b).collect();
    assert!(off.is_empty(), "{label}: the picture, in {} pixels, {:?}", off.len(), off.first());
}

#[test]
fn what_lies_behind_is_not_there() {
    let Strewn { positions, block, all } = strewn();
    let field = field_walk::case(Field::default(), 2, 1).settings;
    let runs = Options::default();
    let relation = Options { search: Search::Relation, ..runs };
    each_driver(|driver| {
        let upload = |all: &[Vec3]| Upload::new(driver.gpu(), bytemuck::cast_slice(all)).expect("upload");
        let (long, short) = (upload(&positions), upload(&positions[..block]));
        for (name, settings, options, keep) in [
            ("maps", imai16(), runs, None),
            ("maps, relation", imai16(), relation, Some(0.6)),
            ("field", field, runs, None),
            ("field, kept classes", field, runs, Some(0.6)),
        ] {
            let case = case(settings);
            let frame = |buffer: &Upload, most: usize, keep: Option<f32>, said: Option<usize>| {
                let said = said.map(|n| number(driver, n));
                let positions = DevicePositions::packed(buffer.buffer, most as u32, RADIUS)
                    .options(options)
                    .keep_class_below(keep)
                    .device_count(said.as_ref().map(count));
                driver.shoot_with(&case, &|i| i.positions(positions))
            };
            let label = |what: &str| format!("{}: {name}: {what}", driver.name);
            let bounded = frame(&long, all, keep, Some(u32::MAX as usize));
            driver.session.borrow_mut().renderer.abandon(0);
            same(&label("no more than there may be"), &bounded, &frame(&long, all, keep, None));
            for n in [block, block / 3, 1] {
                let want = frame(&short, n, keep, None);
                // What that leaves in all that is kept from frame to frame, but no classes.
                let more = frame(&long, positions.len(), None, Some(all));
                let found = frame(&long, positions.len(), keep, Some(n));
                same(&label(&format!("{n} particles")), &found, &want);
                assert!(found.picture != more.picture, "{}", label("nothing is behind"));
            }
            let none = frame(&long, positions.len(), keep, Some(0));
            assert!(none.picture == frame(&short, 0, keep, None).picture, "{}", label("none"));
            assert_eq!((none.counter("splash"), none.counter("body")), (0, 0), "{}", label("none"));
            // Points and quads of each list; nothing of what the frame before drew.
            for draws in none.words("indirect draws", 0).into_iter().flat_map(|words| words.chunks_exact(8)) {
                assert_eq!((draws[0], draws[5]), (0, 0), "{}", label("none drawn"));
            }
        }
    });
}

/// Surface moves with the nearest particle that is there.
#[test]
fn what_is_not_there_moves_nothing() {
    let Strewn { positions, block, .. } = strewn();
    let positions = &positions[..block];
    let case = case(imai16());
    // Behind them all lie the same places again, and fall.
    let now: Vec<Vec3> = positions.iter().chain(positions).copied().collect();
    let velocities: Vec<Vec3> = (0..now.len()).map(|i| if i < block { Vec3::X } else { -9.0 * Vec3::Y }).collect();
    each_driver(|driver| {
        let gpu = driver.gpu();
        let [now, velocities] = [&now, &velocities].map(|v| Upload::new(gpu, bytemuck::cast_slice(v)).expect("upload"));
        let [now, velocities] = [&now, &velocities].map(|u| DeviceVectors::packed(u.buffer));
        let vectors = |most: usize, said: Option<usize>| {
            let said = said.map(|n| number(driver, n));
            let layout = Layout::COLOR_ATTACHMENT_OPTIMAL;
            let canvas = image(gpu, Format::R32G32_SFLOAT, 8, case.size, layout);
            let moving = MovingParticles::new(most as u32, now, Before::Velocities(velocities, 0.01))
                .device_count(said.as_ref().map(count));
            let output = SurfaceOutput::new(canvas.view, Format::R32G32_SFLOAT, layout);
            let still = (case.camera.view, case.camera.projection);
            let motion = Motion::new(output, still, case.camera.projection).particles(moving);
            let drawn = DevicePositions::packed(now.buffer, block as u32, RADIUS);
            driver.shoot_with(&case, &|i| i.positions(drawn).surface(SurfaceOutputs::default().motion(motion)));
            floats(&canvas.read().expect("vectors"))
        };
        let (want, without) = (vectors(block, None), vectors(0, None));
        let untouched = f32::from_ne_bytes([BEFORE; 4]);
        assert!(want.iter().zip(&without).filter(|(a, b)| **a != untouched && a != b).count() > 400, "{}", driver.name);
        for (most, said, what) in [(2 * block, block, "some"), (block, 2 * block, "no more than there may be")] {
            assert!(vectors(most, Some(said)) == want, "{}: {what}", driver.name);
        }
        assert!(vectors(2 * block, Some(0)) == without, "{}: none", driver.name);
    });
}

#[test]
fn what_cannot_be_is_said() {
    let case = case(imai16());
    let somewhere = vk::Buffer::from_raw(1);
    let [null, crooked] = [(vk::Buffer::null(), 0), (somewhere, 6)].map(|(buffer, at)| DeviceCount::new(buffer, at));
    let output = SurfaceOutput::new(ImageView::from_raw(1), Format::R32G32_SFLOAT, Layout::GENERAL);
    let vectors = DeviceVectors::packed(somewhere);
    let moving = MovingParticles::new(9, vectors, Before::Positions(vectors));
    let still = (case.camera.view, case.camera.projection);
    let motion = Motion::new(output, still, case.camera.projection);
    each_driver(|driver| {
        for (count, said_of_positions, said_of_motion) in [
            (null, "buffer of the particle count is null", "buffer of the moving count is null"),
            (crooked, "offset of the particle count is 6", "offset of the moving count is 6"),
        ] {
            let positions = DevicePositions::packed(somewhere, 9, RADIUS).device_count(count);
            let input = FrameInput::new(0, &case.camera, &case.settings, ImageView::from_raw(1)).positions(positions);
            driver.session.borrow_mut().resize(case.size).expect("size");
            let said = driver.session.borrow_mut().frame(&input).expect_err("refused").to_string();
            assert!(said.contains(said_of_positions), "{said}");
            let said = refused(driver, &case, |s| s.motion(motion.particles(moving.device_count(count))));
            assert!(said.contains(said_of_motion), "{said}");
        }
    });
}
