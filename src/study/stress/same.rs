//! The same liquid, said in another way: nothing should change.

use super::{
    Case, Measure, NO_NUMBER, Step, clouds, degrees,
    exact::Shape,
    median,
    shot::{Shot, View, apart},
};
use crate::{srgb::encode_srgb, study::random::Random};
use glam::{DVec3, Vec3};

/// Where the mixed cloud is seen from.
fn view_of_mixed(size: [u32; 2]) -> View {
    View::sized(size, DVec3::new(20.0, 24.0, 60.0), DVec3::new(0.0, 3.0, 0.0), DVec3::Y, 35.0)
}

/// A picture averaged over squares of `times` pixels, as a screen shows it.
fn averaged(shot: &Shot, times: usize) -> Vec<Vec3> {
    let (width, height) = (shot.width() / times, shot.picture.len() / shot.width() / times);
    let mut sums = vec![Vec3::ZERO; width * height];
    for (i, color) in shot.picture.iter().enumerate() {
        let (x, y) = (i % shot.width() / times, i / shot.width() / times);
        sums[y * width + x] += Vec3::from(*color);
    }
    let shown = |sum: Vec3| Vec3::from((sum / (times * times) as f32).to_array().map(encode_srgb));
    sums.into_iter().map(shown).collect()
}

fn mean_apart(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| apart(*a, *b)).sum::<f64>() / a.len() as f64
}

/// More pixels.
pub const RESOLUTION: Case = Case {
    name: "resolution",
    about: "a body, a ball and drops in more and more pixels, averaged to 80 x 60, beside 640 x 480 of them",
    x: "pixels across, of 80",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        Measure { name: "mean difference, of white", bound: 0.06, beyond: "the liquid looks another at another size" },
    ],
    steps: |extent| extent.of(&[1.0, 2.0], &[1.0, 2.0, 4.0]),
    run: |rig, settings, steps| {
        let cloud = clouds::mixed();
        let size = |times: f64| [80 * times as u32, 60 * times as u32];
        let finest = averaged(&rig.shoot(&cloud, 1.0, &view_of_mixed(size(8.0)), settings)?, 8);
        let mut found = Vec::new();
        for &x in steps {
            let shot = rig.shoot(&cloud, 1.0, &view_of_mixed(size(x)), settings)?;
            let off = mean_apart(&averaged(&shot, x as usize), &finest);
            found.push(Step { x, found: vec![Some(shot.no_number()), Some(off)] });
        }
        Ok(found)
    },
};

/// Farther away.
pub const DISTANCE: Case = Case {
    name: "distance",
    about: "a ball of 12 radii from nearer and farther away",
    x: "distance of the eye, ball radii",
    // The paper's window is of so many pixels, however many radii they cover; `projected` ones keep the shape.
    promised: &["field"],
    measures: &[
        NO_NUMBER,
        Measure {
            name: "distance from the surface, radii",
            bound: 0.5,
            beyond: "the surface is not where the liquid's is",
        },
        Measure { name: "normals off, degrees", bound: 20.0, beyond: "the surface is not smooth" },
    ],
    steps: |extent| extent.of(&[4.0, 16.0], &[2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
    run: |rig, settings, steps| {
        let radius = 12.0;
        let (cloud, ball) = (clouds::ball(radius), Shape::Ball(radius));
        let mut found = Vec::new();
        for &x in steps {
            let shot =
                rig.shoot(&cloud, 1.0, &View::new(DVec3::Z * x * radius, DVec3::ZERO, DVec3::Y, 40.0), settings)?;
            let (mut distances, mut normals) = (Vec::new(), Vec::new());
            for i in 0..shot.picture.len() {
                let (eye, dir) = shot.ray(i);
                // Not at the rim, where a small error is a long way along the ray.
                let Some([(t, normal), _]) = ball.crossings(eye, dir).filter(|[(_, n), _]| -n.dot(dir) > 0.4) else {
                    continue;
                };
                distances.extend(shot.at(i).map(|at| ((at - eye).length() - t).abs() * -normal.dot(dir)));
                normals.extend(shot.normal(i).map(|n| degrees(n, normal)));
            }
            found.push(Step { x, found: vec![Some(shot.no_number()), median(distances), median(normals)] });
        }
        Ok(found)
    },
};

/// Farther from the origin of coordinates.
pub const OFFSET: Case = Case {
    name: "offset",
    about: "the same particles and camera, as far from the origin as single precision still tells their places apart",
    x: "radii from the origin",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        Measure {
            name: "mean difference, of white",
            bound: 0.015,
            beyond: "the picture depends on where the origin is",
        },
    ],
    steps: |extent| extent.of(&[1e3, 1e6], &[1e1, 1e2, 1e3, 1e4, 1e5, 1e6]),
    run: |rig, settings, steps| {
        // Eighths of a radius are exact up to 2^21; a camera that looks along an axis is too.
        let cloud: Vec<Vec3> = clouds::mixed().into_iter().map(|p| (8.0 * p).round() / 8.0).collect();
        let seen =
            |by: DVec3| View::new(by + DVec3::new(1.0, 4.0, 60.0), by + DVec3::new(1.0, 4.0, 0.0), DVec3::Y, 35.0);
        let own = rig.shoot(&cloud, 1.0, &seen(DVec3::ZERO), settings)?.shown();
        let mut found = Vec::new();
        for &x in steps {
            let by = DVec3::new(x, -x, x);
            let moved: Vec<Vec3> = cloud.iter().map(|p| (p.as_dvec3() + by).as_vec3()).collect();
            let shot = rig.shoot(&moved, 1.0, &seen(by), settings)?;
            let off = mean_apart(&shot.shown(), &own);
            found.push(Step { x, found: vec![Some(shot.no_number()), Some(off)] });
        }
        Ok(found)
    },
};

/// In another order.
pub const SHUFFLED: Case = Case {
    name: "shuffled",
    about: "the same particles, shuffled from frame to frame",
    x: "shuffles",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        Measure { name: "pixels that differ", bound: 0.0, beyond: "the picture depends on the order of particles" },
    ],
    steps: |extent| extent.of(&[1.0, 2.0], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
    run: |rig, settings, steps| {
        let mut cloud = clouds::mixed();
        let view = view_of_mixed([160, 120]);
        let own = rig.shoot(&cloud, 1.0, &view, settings)?.picture;
        let mut found = Vec::new();
        for &x in steps {
            let mut random = Random::of(x as u64, 11);
            for i in (1..cloud.len()).rev() {
                cloud.swap(i, (random.unit() * (i + 1) as f64) as usize);
            }
            let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
            let bits = |c: &[f32; 3]| c.map(f32::to_bits);
            let other = shot.picture.iter().zip(&own).filter(|(a, b)| bits(a) != bits(b)).count();
            found.push(Step { x, found: vec![Some(shot.no_number()), Some(other as f64)] });
        }
        Ok(found)
    },
};
