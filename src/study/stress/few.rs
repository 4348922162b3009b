//! Few particles, thin liquid, and radii that are not half the spacing.

use super::{Case, Measure, NO_NUMBER, Step, clouds, exact::Shape, median, percent, shot::View};
use glam::{DVec3, Vec3};

const HOLES: Measure =
    Measure { name: "holes, % of what must be liquid", bound: 0.1, beyond: "a covered region has holes" };

/// Neighbourhoods that have no ellipsoid of their own.
pub const NEIGHBOURS: Case = Case {
    name: "neighbours",
    about: "0: no particle, 1: one, 2: two, 3: a row of seven, 4: a sheet of 25, 5: forty at one place, 6: all of these",
    x: "scene",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        HOLES,
        Measure { name: "liquid where there must be none, %", bound: 0.0, beyond: "an ellipsoid is a needle" },
    ],
    steps: |_| (0..=6).map(f64::from).collect(),
    run: |rig, settings, steps| {
        let row = |n: i32, to: &dyn Fn(f32) -> Vec3| (0..n).map(|k| to(2.0 * k as f32)).collect::<Vec<_>>();
        let sheet = (0..25).map(|k| Vec3::new(2.0 * (k % 5) as f32, 0.0, 2.0 * (k / 5) as f32)).collect();
        let scenes: Vec<Vec<Vec3>> = vec![
            Vec::new(),
            vec![Vec3::ZERO],
            row(2, &|x| Vec3::new(x, 0.0, 0.0)),
            row(7, &|x| Vec3::new(0.8 * x, 0.6 * x, 0.0)),
            sheet,
            vec![Vec3::ZERO; 40],
        ];
        let apart =
            |(k, s): (usize, &Vec<Vec3>)| s.iter().map(move |p| *p + 14.0 * k as f32 * Vec3::X).collect::<Vec<_>>();
        let all = scenes.iter().enumerate().flat_map(apart).collect();
        let mut found = Vec::new();
        for &x in steps {
            let cloud = scenes.get(x as usize).unwrap_or(&all);
            let middle = cloud.iter().sum::<Vec3>().as_dvec3() / cloud.len().max(1) as f64;
            let distance = 20.0 + cloud.iter().map(|p| (p.as_dvec3() - middle).length()).fold(0.0, f64::max) * 3.0;
            let view = View::new(middle + DVec3::new(0.3, 0.5, 1.0) * distance, middle, DVec3::Y, 30.0);
            let shot = rig.shoot(cloud, 1.0, &view, settings)?;
            let (mut must, mut holes, mut must_not, mut grown) = (0, 0, 0, 0);
            for i in 0..shot.picture.len() {
                let (eye, dir) = shot.ray(i);
                let Some(covered) = shot.covered(i) else { continue };
                let nearest =
                    cloud.iter().map(|p| (p.as_dvec3() - eye).cross(dir).length()).fold(f64::INFINITY, f64::min);
                if nearest < 0.6 {
                    must += 1;
                    holes += usize::from(!covered);
                } else if nearest > 2.0 {
                    must_not += 1;
                    grown += usize::from(covered);
                }
            }
            found.push(Step { x, found: vec![Some(shot.no_number()), percent(holes, must), percent(grown, must_not)] });
        }
        Ok(found)
    },
};

/// One particle thin.
pub const SHEET: Case = Case {
    name: "sheet",
    about: "a sheet of jittered particles, one particle thin, seen at ever flatter angles",
    x: "degrees from its normal",
    promised: super::BOTH,
    measures: &[NO_NUMBER, HOLES],
    steps: |extent| extent.of(&[0.0, 60.0], &[0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 82.0, 86.0]),
    run: |rig, settings, steps| {
        let cloud = clouds::block([28, 1, 28]);
        let inner = Shape::Block(DVec3::new(24.0, 0.3, 24.0));
        let mut found = Vec::new();
        for &x in steps {
            let (sin, cos) = x.to_radians().sin_cos();
            let view = View::new(90.0 * DVec3::new(0.0, cos, sin), DVec3::ZERO, DVec3::NEG_Z, 20.0);
            let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
            let (mut must, mut holes) = (0, 0);
            for i in 0..shot.picture.len() {
                let (eye, dir) = shot.ray(i);
                if let Some(covered) = shot.covered(i).filter(|_| inner.crossings(eye, dir).is_some()) {
                    must += 1;
                    holes += usize::from(!covered);
                }
            }
            found.push(Step { x, found: vec![Some(shot.no_number()), percent(holes, must)] });
        }
        Ok(found)
    },
};

/// Radii that are not half the spacing.
pub const RADIUS: Case = Case {
    name: "radius",
    about: "a block whose particles are said to be larger or smaller than half their spacing",
    x: "radius, of half the spacing",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        HOLES,
        Measure {
            name: "distance from the surface, radii",
            bound: 1.0,
            beyond: "the surface is not where the liquid's is",
        },
    ],
    steps: |extent| extent.of(&[0.8, 1.2], &[0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2]),
    run: |rig, settings, steps| {
        let half = DVec3::new(18.0, 8.0, 18.0);
        let cloud = clouds::block([18, 8, 18]);
        let face = Shape::Block(half - DVec3::new(4.0, 0.0, 4.0));
        let mut found = Vec::new();
        for &x in steps {
            let view = View::new(DVec3::new(0.0, 70.0, 20.0), DVec3::ZERO, DVec3::Y, 30.0);
            let shot = rig.shoot(&cloud, x as f32, &view, settings)?;
            let (mut must, mut holes, mut distances) = (0, 0, Vec::new());
            for i in 0..shot.picture.len() {
                let (eye, dir) = shot.ray(i);
                if face.crossings(eye, dir).is_none_or(|[(_, normal), _]| normal.y < 0.5) {
                    continue;
                }
                if let Some(covered) = shot.covered(i) {
                    must += 1;
                    holes += usize::from(!covered);
                }
                // A particle's radius above the outermost centres.
                distances.extend(shot.at(i).map(|at| (at.y - (half.y - 1.0 + x)).abs() / x));
            }
            found.push(Step { x, found: vec![Some(shot.no_number()), percent(holes, must), median(distances)] });
        }
        Ok(found)
    },
};
