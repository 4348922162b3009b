//! Surfaces seen at an angle.

use super::{
    Case, Measure, NO_NUMBER, Rig, Step, StressError, clouds,
    exact::Shape,
    median, percent,
    shot::{Shot, View, degrees},
};
use crate::{Settings, inspect::Walk};
use glam::DVec3;

/// Total internal reflections that the optics follow.
fn reflections(settings: &Settings) -> u32 {
    Walk::of(&settings.method.optics).map_or(0, |w| w.internal_reflections)
}

/// Pixels of which a median is taken, at least.
const ENOUGH: usize = 50;

/// How far directions are from a closed form, in degrees and in the median. Of what the form has `None` for, or comes within a
/// twentieth of the critical angle's sine, nothing is asked.
fn directions(shot: &Shot, pixels: &[usize], exact: impl Fn(usize) -> Option<(DVec3, f64)>) -> Option<f64> {
    let mut off = Vec::new();
    for &i in pixels {
        if let Some((dir, _)) = exact(i).filter(|(_, margin)| *margin > 0.05) {
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
    promised: true,
    measures: &[
        NO_NUMBER,
        Measure { name: "holes, % of its pixels", bound: 0.0, beyond: "a covered region has holes" },
        Measure {
            name: "distance from the surface, radii",
            bound: 0.3,
            beyond: "the surface is not where the liquid's is",
        },
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
        let depths = pixels.iter().filter_map(|i| Some((shot.at(*i)?.y - half.y).abs())).collect();
        let normals = pixels.iter().filter_map(|i| Some(degrees(shot.normal(*i)?, DVec3::Y))).collect();
        let turned = directions(&shot, &pixels, |i| {
            let (eye, dir) = shot.ray(i);
            Shape::Block(half).through(eye, dir, ior, reflections(settings))
        });
        let covers = shot.covered(0).and(percent(holes, pixels.len()));
        found.push(Step { x, found: vec![Some(shot.no_number()), covers, median(depths), median(normals), turned] });
    }
    Ok(found)
}

/// Light that leaves the liquid around the critical angle.
pub const CRITICAL: Case = Case {
    name: "critical angle",
    about: "an eye in a block looks at its face; beyond 48.6 degrees light is reflected there",
    x: "degrees from the face's normal",
    promised: true,
    measures: &[
        NO_NUMBER,
        Measure { name: "directions of what leaves off, degrees", bound: 10.0, beyond: "light goes elsewhere" },
        Measure {
            name: "on the wrong side of the critical angle, %",
            bound: 5.0,
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
            let Some(walk) = shot.walk(i) else { continue };
            // Reflected light has met a wall, and goes on inside, or ends somewhere there.
            let out = walk[2] == 1.0 && shot.direction(i).is_some();
            asked += 1;
            wrong += usize::from(out != leaves.is_some());
            if let (Some((exact, margin)), Some(found)) = (leaves, shot.direction(i)) {
                left.extend((out && margin > 0.05).then(|| degrees(found, exact)));
            }
        }
        let off = (left.len() >= ENOUGH).then(|| median(left)).flatten();
        found.push(Step { x, found: vec![Some(shot.no_number()), off, percent(wrong, asked)] });
    }
    Ok(found)
}
