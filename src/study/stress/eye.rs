//! The eye on its way into the liquid and out again.

use super::{
    Case, Measure, NO_NUMBER, Step, clouds,
    exact::Shape,
    percent,
    shot::{Shot, View},
};
use glam::DVec3;

const COVER: Measure =
    Measure { name: "holes, % of what must be liquid", bound: 0.1, beyond: "a covered region has holes" };
const GROWN: Measure =
    Measure { name: "liquid where there must be none, %", bound: 0.1, beyond: "sprites cover what they should not" };

/// Through a ball.
pub const DOLLY_BALL: Case = Case {
    name: "dolly through a ball",
    about: "the eye goes straight through a ball of liquid of 12 radii: huge sprites, the near plane, the eye inside",
    x: "distance of the eye before the middle, ball radii",
    promised: super::BOTH,
    measures: &[NO_NUMBER, COVER, GROWN],
    steps: |extent| {
        extent.of(&[4.0, 1.15, 0.5], &[4.0, 3.0, 2.0, 1.5, 1.3, 1.15, 0.8, 0.5, 0.2, 0.0, -0.3, -0.6, -0.85, -1.2])
    },
    run: |rig, settings, steps| {
        let radius = 12.0;
        let cloud = clouds::ball(radius);
        let mut found = Vec::new();
        for &x in steps {
            let eye = DVec3::new(0.3, 0.2, x * radius);
            let mut view = View::new(eye, eye - DVec3::Z, DVec3::Y, 60.0);
            view.eye_inside = eye.length() < radius - 1.0;
            let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
            found.push(cover(x, &shot, |eye, dir, grown| meets(Shape::Ball(radius + grown), eye, dir)));
        }
        Ok(found)
    },
};

/// Down through a flat surface.
pub const DOLLY_SURFACE: Case = Case {
    name: "dolly through a surface",
    about: "the eye sinks through a flat surface, looking along it",
    x: "height of the eye, radii",
    promised: super::BOTH,
    measures: &[NO_NUMBER, COVER, GROWN],
    steps: |extent| extent.of(&[6.0, -3.0], &[12.0, 6.0, 4.0, 3.0, 2.0, 1.5, -1.5, -2.0, -3.0, -5.0, -8.0]),
    run: |rig, settings, steps| {
        let half = DVec3::new(24.0, 10.0, 24.0);
        let cloud = clouds::block([24, 10, 24]);
        let mut found = Vec::new();
        for &x in steps {
            let eye = DVec3::new(0.4, half.y + x, 0.3);
            let mut view = View::new(eye, eye + DVec3::new(0.2, -0.4, -1.0), DVec3::Y, 60.0);
            view.eye_inside = x < 0.0;
            let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
            found.push(cover(x, &shot, |eye, dir, grown| meets(Shape::Block(half + grown), eye, dir)));
        }
        Ok(found)
    },
};

fn meets(shape: Shape, eye: DVec3, dir: DVec3) -> bool {
    shape.crossings(eye, dir).is_some_and(|[_, (leave, _)]| leave > 0.0)
}

/// Pixels that a shape must cover are those that it covers with a radius and a half taken from it; those that it must not cover,
/// with as much added.
fn cover(x: f64, shot: &Shot, covers: impl Fn(DVec3, DVec3, f64) -> bool) -> Step {
    let (mut must, mut holes, mut must_not, mut grown) = (0, 0, 0, 0);
    for i in 0..shot.picture.len() {
        let (eye, dir) = shot.ray(i);
        let Some(covered) = shot.covered(i) else { continue };
        if covers(eye, dir, -1.5) {
            must += 1;
            holes += usize::from(!covered);
        } else if !covers(eye, dir, 1.5) {
            must_not += 1;
            grown += usize::from(covered);
        }
    }
    Step { x, found: vec![Some(shot.no_number()), percent(holes, must), percent(grown, must_not)] }
}
