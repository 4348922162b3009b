//! Motion that is known: what remains of a picture's change after that is flicker.

use super::{
    Case, Measure, NO_NUMBER, Step, clouds, percent,
    shot::{Shot, View, apart},
};
use glam::{DVec3, Vec3};

const CHANGED: Measure = Measure {
    name: "pixels that change by more than an eighth of white, %",
    bound: 15.0,
    beyond: "the picture flickers",
};

/// Pixels of liquid whose place on the surface `before` showed too, and of these those that it showed in another colour by more
/// than an eighth of white, in percent. `by` is how far the liquid has moved since then.
fn changed(before: &Shot, now: &Shot, by: DVec3) -> Option<f64> {
    let (old, new) = (before.shown(), now.shown());
    let (mut seen, mut other) = (0, 0);
    for (i, color) in new.iter().enumerate() {
        let Some(then) = now.at(i).map(|at| at - by) else { continue };
        let Some(j) = before.pixel_of(then).filter(|j| before.at(*j).is_some_and(|p| p.distance(then) < 0.5)) else {
            continue;
        };
        seen += 1;
        other += usize::from(apart(*color, old[j]) > 0.125);
    }
    percent(other, seen)
}

/// Around liquid that rests.
pub const ORBIT: Case = Case {
    name: "orbit",
    about: "liquid that rests, and an eye that goes around it by a tenth of a degree a frame; change after warping by that",
    x: "frame",
    promised: true,
    measures: &[NO_NUMBER, CHANGED],
    steps: |extent| (0..if extent == super::Extent::Small { 4 } else { 24 }).map(f64::from).collect(),
    run: |rig, settings, steps| {
        let cloud = clouds::mixed();
        let mut before: Option<Shot> = None;
        let mut found = Vec::new();
        for &x in steps {
            let (sin, cos) = (20.0 + 0.1 * x).to_radians().sin_cos();
            let view = View::new(DVec3::new(60.0 * sin, 24.0, 60.0 * cos), DVec3::Y * 3.0, DVec3::Y, 35.0);
            let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
            let change = before.as_ref().and_then(|b| changed(b, &shot, DVec3::ZERO));
            found.push(Step { x, found: vec![Some(shot.no_number()), change] });
            before = Some(shot);
        }
        Ok(found)
    },
};

/// Past an eye that rests.
pub const DRIFT: Case = Case {
    name: "drift",
    about: "liquid that moves as a whole by a tenth of a radius a frame, and an eye that rests; change after warping by that",
    x: "frame",
    promised: true,
    measures: &[NO_NUMBER, CHANGED],
    steps: ORBIT.steps,
    run: |rig, settings, steps| {
        let view = View::new(DVec3::new(20.0, 24.0, 60.0), DVec3::Y * 3.0, DVec3::Y, 35.0);
        let by = DVec3::new(0.08, 0.04, 0.045);
        let mut before: Option<Shot> = None;
        let mut found = Vec::new();
        for &x in steps {
            let cloud: Vec<Vec3> = clouds::mixed().iter().map(|p| (p.as_dvec3() + x * by).as_vec3()).collect();
            let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
            let change = before.as_ref().and_then(|b| changed(b, &shot, by));
            found.push(Step { x, found: vec![Some(shot.no_number()), change] });
            before = Some(shot);
        }
        Ok(found)
    },
};
