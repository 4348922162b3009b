//! Surfaces seen at an angle.

use super::{
    Case, Measure, NO_NUMBER, Rig, Step, StressError, clouds, degrees,
    exact::Shape,
    median, percent, quantile,
    shot::{Shot, View},
};
use crate::{Settings, inspect::Walk};
use glam::DVec3;

/// Total internal reflections that the optics follow.
fn reflections(settings: &Settings) -> u32 {
    Walk::of(&settings.method.optics).map_or(0, |w| w.internal_reflections)
}

/// Pixels of which a median is taken, at least.
const ENOUGH: usize = 50;

/// Within this of the critical angle's sine a normal that is three degrees off decides.
const CLOSE: f64 = 0.05;

fn is_close(dir: DVec3, normal: DVec3, ior: f64) -> bool {
    (ior * dir.cross(normal).length() - 1.0).abs() <= CLOSE
}

/// How far directions are from a closed form, in degrees and in the median. Of what the form has `None` for, or comes
/// [`CLOSE`] to the critical angle, nothing is asked.
fn directions(shot: &Shot, pixels: &[usize], exact: impl Fn(usize) -> Option<(DVec3, f64)>) -> Option<f64> {
    let mut off = Vec::new();
    for &i in pixels {
        if let Some((dir, _)) = exact(i).filter(|(_, margin)| *margin > CLOSE) {
            off.extend(shot.walk(i).map(|_| shot.direction(i).map_or(180.0, |d| degrees(d, dir))));
        }
    }
    (off.len() >= ENOUGH).then(|| median(off)).flatten()
}

/// A flat surface, from straight on to along it.
pub const GRAZING: Case = Case {
    name: "grazing",
    about: "a flat surface of jittered particles, seen at ever flatter angles",
    x: "degrees from its normal",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        Measure { name: "holes, % of its pixels", bound: 0.0, beyond: "a covered region has holes" },
        Measure {
            name: "distance from the surface, radii",
            bound: 0.3,
            beyond: "the surface is not where the liquid's is",
        },
        Measure { name: "the same, of 99 % of pixels", bound: 0.6, beyond: "some of the surface is torn off" },
        Measure { name: "normals off, degrees", bound: 15.0, beyond: "the surface is not flat" },
        Measure { name: "directions off, degrees", bound: 10.0, beyond: "light goes elsewhere" },
    ],
    steps: |extent| {
        extent.of(&[0.0, 60.0, 85.0], &[0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 83.0, 85.0, 87.0, 89.0])
    },
    run: grazing,
};

fn grazing(rig: &mut Rig, settings: &Settings, steps: &[f64]) -> Result<Vec<Step>, StressError> {
    let half = DVec3::new(24.0, 8.0, 24.0);
    let cloud = clouds::block([24, 8, 24]);
    let ior = f64::from(settings.liquid.ior);
    let mut found = Vec::new();
    for &x in steps {
        let (sin, cos) = x.to_radians().sin_cos();
        let middle = DVec3::new(0.0, half.y, 0.0);
        let view = View::new(middle + 100.0 * DVec3::new(0.0, cos, sin), middle, DVec3::NEG_Z, 16.0);
        let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
        // The top face, four radii from its rim and more.
        let on_face = |i: usize| {
            let (eye, dir) = shot.ray(i);
            let [(t, normal), _] = Shape::Block(half).crossings(eye, dir)?;
            let at = eye + t * dir;
            (normal.y > 0.5 && at.x.abs() < half.x - 4.0 && at.z.abs() < half.z - 4.0).then_some(i)
        };
        let pixels: Vec<usize> = (0..shot.picture.len()).filter_map(on_face).collect();
        let holes = pixels.iter().filter(|i| shot.covered(**i) == Some(false)).count();
        let depths: Vec<f64> = pixels.iter().filter_map(|i| Some((shot.at(*i)?.y - half.y).abs())).collect();
        let normals = pixels.iter().filter_map(|i| Some(degrees(shot.normal(*i)?, DVec3::Y))).collect();
        let turned = directions(&shot, &pixels, |i| {
            let (eye, dir) = shot.ray(i);
            Shape::Block(half).through(eye, dir, ior, reflections(settings))
        });
        // Where a pixel covers more than this of the surface, light of all kinds comes through it.
        let turned = turned.filter(|_| 16f64.to_radians() / 120.0 * 100.0 / cos < 8.0);
        let covers = shot.covered(0).and(percent(holes, pixels.len()));
        found.push(Step {
            x,
            found: vec![
                Some(shot.no_number()),
                covers,
                median(depths.clone()),
                quantile(depths, 0.99),
                median(normals),
                turned,
            ],
        });
    }
    Ok(found)
}

/// Light that leaves the liquid around the critical angle.
pub const CRITICAL: Case = Case {
    name: "critical angle",
    about: "an eye in a block looks at its face; beyond 48.6 degrees light is reflected there",
    x: "degrees from the face's normal",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        Measure { name: "directions of what leaves off, degrees", bound: 10.0, beyond: "light goes elsewhere" },
        Measure {
            name: "on the wrong side of the critical angle, %",
            bound: 20.0,
            beyond: "light leaves that must be reflected, or the other way round",
        },
    ],
    steps: |extent| {
        extent.of(&[20.0, 60.0], &[0.0, 10.0, 20.0, 30.0, 35.0, 40.0, 44.0, 46.0, 51.0, 53.0, 57.0, 60.0, 65.0, 70.0])
    },
    run: critical,
};

fn critical(rig: &mut Rig, settings: &Settings, steps: &[f64]) -> Result<Vec<Step>, StressError> {
    let half = DVec3::splat(18.0);
    let cloud = clouds::block([18; 3]);
    let ior = f64::from(settings.liquid.ior);
    let mut found = Vec::new();
    for &x in steps {
        let (sin, cos) = x.to_radians().sin_cos();
        let eye = DVec3::new(-10.0, 4.0, -10.0);
        let ahead = DVec3::new(sin, 0.0, -cos);
        let mut view = View::new(eye, eye + ahead, DVec3::Y, 70.0);
        view.eye_inside = true;
        let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
        let (mut left, mut asked, mut wrong) = (Vec::new(), 0, 0);
        for i in (0..shot.picture.len()).filter(|i| degrees(shot.ray(*i).1, ahead) < 3.0) {
            let (eye, dir) = shot.ray(i);
            let leaves = Shape::Block(half).out(eye, dir, ior, 0);
            let close = Shape::Block(half).crossings(eye, dir).is_none_or(|[_, (_, n)]| is_close(dir, n, ior));
            let Some(walk) = shot.walk(i).filter(|_| !close) else { continue };
            // Reflected light has met a wall, and goes on inside, or ends somewhere there.
            let out = walk[2] == 1.0 && shot.direction(i).is_some();
            asked += 1;
            wrong += usize::from(out != leaves.is_some());
            if let (Some((exact, _)), Some(found)) = (leaves, shot.direction(i)) {
                left.extend(out.then(|| degrees(found, exact)));
            }
        }
        let off = (left.len() >= ENOUGH).then(|| median(left)).flatten();
        found.push(Step { x, found: vec![Some(shot.no_number()), off, percent(wrong, asked)] });
    }
    Ok(found)
}

/// By how much edges may be rounded, in radii: what is left of a corner is a particle's own.
const ROUNDED: f64 = 2.0;

/// A body's rims, where surfaces end and turn away.
pub const RIMS: Case = Case {
    name: "rims",
    about: "a block of jittered particles from around a corner: edges, which may be rounded by two radii, silhouettes, depth jumps",
    x: "degrees around it",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        Measure { name: "holes, % of what must be liquid", bound: 0.1, beyond: "a covered region has holes" },
        Measure {
            name: "distance from the surface, radii, of 99 % of pixels",
            bound: 1.2,
            beyond: "some of the surface is torn off",
        },
        Measure { name: "normals off, degrees, of 90 % of pixels", bound: 35.0, beyond: "the surface is torn" },
    ],
    steps: |extent| extent.of(&[25.0], &[5.0, 15.0, 25.0, 35.0, 45.0]),
    run: rims,
};

fn rims(rig: &mut Rig, settings: &Settings, steps: &[f64]) -> Result<Vec<Step>, StressError> {
    let half = DVec3::new(10.0, 6.0, 10.0);
    let mut cloud = clouds::block([10, 6, 10]);
    // Something far behind it: nothing may be averaged over the jump.
    let far = 40.0 * DVec3::NEG_Z;
    cloud.extend(clouds::block([24, 18, 2]).into_iter().map(|p| p + far.as_vec3()));
    let behind = Shape::Block(DVec3::new(24.0, 18.0, 2.0));
    // How far a point is outside of the block with its edges rounded.
    let rounded = |at: DVec3| {
        let q = at.abs() - (half - ROUNDED);
        q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - ROUNDED
    };
    let mut found = Vec::new();
    for &x in steps {
        let (sin, cos) = x.to_radians().sin_cos();
        let view = View::new(DVec3::new(60.0 * sin, 30.0, 60.0 * cos), DVec3::ZERO, DVec3::Y, 30.0);
        let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
        let (mut must, mut holes, mut distances, mut normals) = (0, 0, Vec::new(), Vec::new());
        for i in 0..shot.picture.len() {
            let (eye, dir) = shot.ray(i);
            let grown = |by: f64| Shape::Block(half + by).crossings(eye, dir);
            let inside = |[(enter, _), (leave, _)]: [(f64, DVec3); 2]| {
                (0..=100).any(|k| rounded(eye + (enter + (leave - enter) * f64::from(k) / 100.0) * dir) < -0.7)
            };
            // Between the two either may be met.
            let inner = grown(0.0).is_some_and(inside);
            let met = match (inner, grown(0.7)) {
                (true, _) => grown(0.0),
                (false, None) => behind.crossings(eye - far, dir),
                _ => None,
            };
            let Some([(t, normal), _]) = met else { continue };
            if let Some(covered) = shot.covered(i).filter(|_| inner) {
                must += 1;
                holes += usize::from(!covered);
            }
            let off = |at: DVec3| if inner { rounded(at) } else { (at - (eye + t * dir)).dot(normal) };
            distances.extend(shot.at(i).map(|at| off(at).abs()));
            normals.extend(shot.normal(i).map(|n| degrees(n, normal)));
        }
        let off = [quantile(distances, 0.99), quantile(normals, 0.9)];
        found.push(Step { x, found: vec![Some(shot.no_number()), percent(holes, must), off[0], off[1]] });
    }
    Ok(found)
}
