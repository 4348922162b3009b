//! Motion vectors of the first surface and the reactive mask, against twins and closed forms.

use crate::{
    field_walk,
    host::SIZE,
    support::{Case, Driver, camera, each_driver, imai16, random_cloud},
    surface::{BEFORE, firsts, floats, image, position, refused},
};
use ash::vk::{self, Format, Handle, ImageLayout as Layout};
use glam::{DVec2, DVec3, Mat4, Vec3, Vec4};
use meniscus::{
    Before, DeviceVectors, Motion, MovingParticles, SurfaceOutput, SurfaceOutputs,
    host::Upload,
    layers::field::Field,
    twin::motion::{nearest, vector},
};

const ATTACHED: Layout = Layout::COLOR_ATTACHMENT_OPTIMAL;

/// Motion vectors of a frame, of each pixel that shows liquid with where in the world that is, in world units.
type Vectors = Vec<Option<(DVec3, DVec2)>>;

fn shoot(driver: &Driver, case: &Case, motion: &Motion) -> Vectors {
    let canvas = image(driver.gpu(), Format::R32G32_SFLOAT, 8, case.size, ATTACHED);
    let mut motion = *motion;
    motion.output = SurfaceOutput::new(canvas.view, Format::R32G32_SFLOAT, ATTACHED);
    let shot = driver.shoot_with(case, &|i| i.surface(SurfaceOutputs::default().motion(motion)));
    let found = floats(&canvas.read().expect("vectors"));
    let untouched = f32::from_ne_bytes([BEFORE; 4]);
    let vectors = firsts(&shot).into_iter().zip(found.chunks_exact(2)).enumerate().map(|(i, (first, v))| {
        if first.is_none() {
            assert_eq!(v, [untouched; 2], "{}: pixel {i} shows no liquid", driver.name);
        }
        let (_, depth) = first?;
        Some((position(&case.camera, case.size, i, depth), DVec2::new(v[0].into(), v[1].into())))
    });
    vectors.collect()
}

/// All are the twin's, in pixels.
fn compare(driver: &Driver, what: &str, case: &Case, motion: &Motion, particles: &[(DVec3, DVec3)]) {
    let radius = f64::from(case.particles.radius);
    let in_radii: Vec<_> = particles.iter().map(|(x, moved)| (*x / radius, *moved)).collect();
    let (mut shown, mut undecided, mut off, mut moving) = (0, 0, Vec::new(), 0);
    for (x, found) in shoot(driver, case, motion).into_iter().flatten() {
        shown += 1;
        let (moved, lead) = nearest(&in_radii, x / radius);
        // Of two that are as near either may be the one, and so near the reach one or none.
        if lead < 1e-3 {
            undecided += 1;
            continue;
        }
        moving += usize::from(moved != DVec3::ZERO);
        let error =
            (found - vector(motion, case.camera.view, x, moved)) * DVec2::new(case.size[0].into(), case.size[1].into());
        if error.length() > 0.02 || !found.is_finite() {
            off.push((x, found, error));
        }
    }
    println!("{}: {what}: {shown} shown, {moving} move, {undecided} undecided, {} off", driver.name, off.len());
    assert!(shown > 400 && undecided * 20 < shown, "{}: {what}: {shown}, {undecided}", driver.name);
    assert!(off.len() * 500 <= shown, "{}: {what}: {}: {:?}", driver.name, off.len(), off.first());
    assert!(particles.is_empty() || moving * 10 > shown * 9, "{}: {what}: {moving} of {shown}", driver.name);
}

fn cases() -> [(&'static str, Case); 2] {
    let particles = random_cloud(7, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 30, 300);
    let eye = camera(Vec3::new(0.4, 0.3, 2.4), Vec3::ZERO, SIZE);
    let maps = Case { particles, camera: eye, settings: imai16(), size: SIZE, eye_inside: false };
    [("maps", maps), ("field", field_walk::case(Field::default(), 4, 4))]
}

/// The camera of the frame before, and this frame's projection before it was jittered.
fn before(case: &Case) -> Motion {
    let previous = camera(Vec3::new(0.5, 0.7, 2.3), Vec3::new(0.05, 0.0, 0.0), case.size);
    let output = SurfaceOutput::new(vk::ImageView::null(), Format::R32G32_SFLOAT, ATTACHED);
    Motion::new(output, (previous.view, previous.projection), case.camera.projection)
}

/// The camera moves, and this frame is jittered by most of a pixel: vectors are of projections without it.
#[test]
fn the_camera_moves_and_jitter_does_not() {
    for (name, case) in cases() {
        let motion = before(&case);
        let mut jittered = case.clone();
        let p = case.camera.projection;
        let jitter = Vec4::new(1.7 / case.size[0] as f32, -1.3 / case.size[1] as f32, 0.0, 0.0);
        jittered.camera.projection = Mat4::from_cols(p.x_axis, p.y_axis, p.z_axis + jitter, p.w_axis);
        each_driver(|driver| {
            compare(driver, &format!("{name}, jittered"), &jittered, &motion, &[]);
            // Nothing moves: not at all.
            let still = Motion::new(motion.output, (case.camera.view, p), p);
            let vectors = shoot(driver, &case, &still);
            let most = vectors.iter().flatten().map(|(_, v)| v.abs().max_element()).fold(0.0, f64::max);
            assert!(most < 1e-6, "{}: {name}: {most}", driver.name);
        });
    }
}

/// Each piece of surface moves with the particle nearest to it: by velocities, or by where that was; in buffers with room between.
#[test]
fn the_surface_moves_with_the_nearest_particle() {
    for (name, case) in cases() {
        let now: Vec<Vec3> = case.particles.ellipsoids.iter().map(|e| e.center).collect();
        // It turns around y, and some fall.
        let velocity = |p: &Vec3| 0.8 * Vec3::Y.cross(*p) + Vec3::new(0.3, if p.x > 0.2 { -1.0 } else { 0.2 }, 0.0);
        let seconds = 0.05;
        let velocities: Vec<Vec3> = now.iter().map(velocity).collect();
        let then: Vec<Vec3> = now.iter().zip(&velocities).map(|(p, v)| *p - seconds * *v).collect();
        let moved = |i: usize| (now[i].as_dvec3(), f64::from(seconds) * velocities[i].as_dvec3());
        let particles: Vec<_> = (0..now.len()).map(moved).collect();
        // One more in each buffer that is no number.
        let strewn = |all: &[Vec3], first: usize| {
            let mut words = vec![f32::NAN; first + 5 * (all.len() + 1)];
            for (i, p) in all.iter().enumerate() {
                words[first + 5 * i..][..3].copy_from_slice(&p.to_array());
            }
            words
        };
        each_driver(|driver| {
            let upload = |words: &[f32]| Upload::new(driver.gpu(), bytemuck::cast_slice(words)).expect("upload");
            let [positions, speeds, places] =
                [strewn(&now, 70), strewn(&velocities, 3), strewn(&then, 0)].map(|w| upload(&w));
            let at = |buffer: &Upload, first: u64| DeviceVectors::packed(buffer.buffer).laid_out(4 * first, 20);
            for (what, before_it) in [
                ("velocities", Before::Velocities(at(&speeds, 3), seconds)),
                ("positions", Before::Positions(at(&places, 0))),
            ] {
                let moving = MovingParticles::new(now.len() as u32 + 1, at(&positions, 70), before_it);
                let motion = before(&case).particles(moving);
                compare(driver, &format!("{name}, {what}"), &case, &motion, &particles);
            }
            // None of them near: what is left is the camera's.
            let far = upload(&[9.0, 9.0, 9.0, 1.0, 1.0, 1.0]);
            let vectors = |first| DeviceVectors::packed(far.buffer).laid_out(first, 12);
            let motion =
                before(&case).particles(MovingParticles::new(1, vectors(0), Before::Velocities(vectors(12), 1.0)));
            compare(driver, &format!("{name}, far"), &case, &motion, &[]);
        });
    }
}

/// A point that was behind the eye of the frame before was nowhere in its picture.
#[test]
fn what_was_behind_the_eye_has_no_motion() {
    let (_, case) = cases().into_iter().next().expect("two");
    let mut motion = before(&case);
    motion.previous_view = camera(Vec3::new(0.0, 0.0, -3.0), Vec3::new(0.0, 0.0, -9.0), SIZE).view;
    each_driver(|driver| {
        let vectors = shoot(driver, &case, &motion);
        assert!(vectors.iter().flatten().all(|(_, v)| *v == DVec2::ZERO), "{}", driver.name);
        assert!(vectors.iter().flatten().count() > 400, "{}", driver.name);
    });
}

/// The mask is what the host says where liquid shows, in each of its formats.
#[test]
fn the_mask_is_where_liquid_shows() {
    let (_, case) = cases().into_iter().next().expect("two");
    each_driver(|driver| {
        for (format, texel) in [(Format::R8_UNORM, 1), (Format::R16_SFLOAT, 2), (Format::R32_SFLOAT, 4)] {
            for layout in [ATTACHED, Layout::GENERAL, Layout::ATTACHMENT_OPTIMAL] {
                let label = format!("{}: {format:?} in {layout:?}", driver.name);
                let mask = image(driver.gpu(), format, texel, case.size, layout);
                let output = SurfaceOutput::new(mask.view, format, layout);
                let shot = driver.shoot_with(&case, &|i| i.surface(SurfaceOutputs::default().reactive(output, 0.75)));
                let bytes = mask.read_in(layout).expect("a mask");
                let wanted: &[u8] = match texel {
                    1 => &[191],
                    2 => &0x3a00u16.to_ne_bytes(),
                    _ => &0.75f32.to_ne_bytes(),
                };
                let mut shown = 0;
                for (at, first) in bytes.chunks_exact(texel as usize).zip(firsts(&shot)) {
                    let right = if first.is_some() { at == wanted } else { at.iter().all(|b| *b == BEFORE) };
                    assert!(right, "{label}: {at:?}");
                    shown += usize::from(first.is_some());
                }
                assert!(shown > 400, "{label}: {shown}");
            }
        }
    });
}

/// Each wrong word by itself.
#[test]
fn what_cannot_be_is_said() {
    let (_, case) = cases().into_iter().next().expect("two");
    let view = vk::ImageView::from_raw(1);
    let somewhere = DeviceVectors::packed(vk::Buffer::from_raw(1));
    let nowhere = DeviceVectors::packed(vk::Buffer::null());
    let output = |format| SurfaceOutput::new(view, format, ATTACHED);
    let mut good = before(&case);
    good.output = output(Format::R16G16_SFLOAT);
    let moving = |p, b| good.particles(MovingParticles::new(9, p, b));
    let mut crooked = good;
    crooked.previous_projection.x_axis.x = f32::NAN;
    let mut other = good;
    other.output = output(Format::R8G8_UNORM);
    each_driver(|driver| {
        for (motion, word) in [
            (crooked, "previous projection"),
            (other, "format of the motion vectors is R8G8_UNORM"),
            (moving(nowhere, Before::Positions(somewhere)), "buffer of moving positions is null"),
            (moving(somewhere, Before::Positions(nowhere)), "buffer of motions is null"),
            (moving(somewhere.laid_out(2, 12), Before::Positions(somewhere)), "offset of moving positions is 2"),
            (moving(somewhere, Before::Positions(somewhere.laid_out(0, 8))), "stride of motions is 8"),
            (moving(somewhere, Before::Velocities(somewhere, f32::NAN)), "seconds of velocities is NaN"),
        ] {
            let said = refused(driver, &case, |s| s.motion(motion));
            assert!(said.contains(word), "{said}");
        }
        let said = refused(driver, &case, |s| s.reactive(output(Format::R8_UNORM), 1.5));
        assert!(said.contains("reactive value is 1.5"), "{said}");
        let said = refused(driver, &case, |s| s.reactive(output(Format::R8_UINT), 0.5));
        assert!(said.contains("format of the reactive mask is R8_UINT"), "{said}");
    });
}
