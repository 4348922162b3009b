//! Liquid behind liquid, and drops that come off.

use super::{
    Case, Measure, NO_NUMBER, Step, clouds, median,
    shot::{View, apart},
};
use crate::optics::many::Many;
use glam::{DVec3, Vec3};

/// Half the thickness of a slab, and from one slab's middle to the next's, in radii.
const SLAB: f64 = 4.0;
const PERIOD: f64 = 24.0;

/// Slabs in a row.
pub const INTERFACES: Case = Case {
    name: "interfaces",
    about: "slabs in a row, 8 radii thick and 16 apart; at odd numbers of interfaces the eye is in the first",
    x: "interfaces in a row",
    // Two volumes are all that screen-space maps know; what knows more is asked for more.
    promised: &["field"],
    measures: &[
        NO_NUMBER,
        Measure {
            name: "length in the liquid off, %",
            bound: 10.0,
            beyond: "absorption misses liquid, or finds some in air",
        },
    ],
    steps: |extent| extent.of(&[2.0, 4.0, 5.0], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
    run: |rig, settings, steps| {
        let mut found = Vec::new();
        for &x in steps {
            let slabs = (x as usize).div_ceil(2);
            let one = clouds::block([16, 16, SLAB as usize]);
            let at = |k: usize| Vec3::new(0.0, 0.0, -(PERIOD * k as f64) as f32);
            let cloud: Vec<Vec3> = (0..slabs).flat_map(|k| one.iter().map(move |p| *p + at(k))).collect();
            let inside = x as usize % 2 == 1;
            let eye = DVec3::new(0.5, 0.3, if inside { 0.0 } else { 60.0 });
            let mut view = View::new(eye, eye - DVec3::Z, DVec3::Y, if inside { 30.0 } else { 10.0 });
            view.eye_inside = inside;
            let mut many = *settings;
            many.method.optics = Many::default().volumes(slabs as u32).into();
            let settings = if slabs > 2 && many.method.validate().is_ok() { &many } else { settings };
            let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
            let ior = f64::from(settings.liquid.ior);
            let mut off = Vec::new();
            for i in 0..shot.picture.len() {
                let (_, dir) = shot.ray(i);
                // Around the middle of the view: every slab is there.
                if dir.z > -0.998 {
                    continue;
                }
                // Snell: all intervals within slabs run at one angle.
                let sin = (1.0 - dir.z * dir.z).sqrt() / if inside { 1.0 } else { ior };
                let across = 2.0 * SLAB * slabs as f64 - if inside { SLAB } else { 0.0 };
                let exact = across / (1.0 - sin * sin).sqrt();
                off.extend(shot.walk(i).map(|w| 100.0 * (f64::from(w[3]) / exact - 1.0).abs()));
            }
            found.push(Step { x, found: vec![Some(shot.no_number()), median(off)] });
        }
        Ok(found)
    },
};

/// How much the spacing grows from step to step.
const GROWTH: f64 = 0.01;

/// From body to splash.
pub const THRESHOLD: Case = Case {
    name: "threshold",
    about: "a clump of 64 particles grows apart by a hundredth of its spacing a frame, until all are splash",
    x: "spacing, of that at rest",
    promised: super::BOTH,
    measures: &[
        NO_NUMBER,
        Measure {
            name: "change of a pixel from frame to frame, of white",
            bound: 0.12,
            beyond: "particles pop from class to class",
        },
    ],
    steps: |extent| {
        let count = if extent == super::Extent::Small { 40 } else { 100 };
        (0..=count).map(|k| 1.0 + GROWTH * f64::from(k)).collect()
    },
    run: |rig, settings, steps| {
        let clump = clouds::block([4; 3]);
        let view = View::new(DVec3::new(10.0, 14.0, 30.0), DVec3::ZERO, DVec3::Y, 35.0);
        let mut before: Option<(Vec<Vec3>, Vec<bool>)> = None;
        let mut found = Vec::new();
        for &x in steps {
            let cloud: Vec<Vec3> = clump.iter().map(|p| x as f32 * *p).collect();
            let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
            let shown = shot.shown();
            let covered: Vec<bool> = (0..shown.len()).map(|i| shot.covered(i) == Some(true)).collect();
            let change = before.take().map(|(old, liquid)| {
                let either = |i: &usize| liquid[*i] || covered[*i];
                let all: Vec<f64> = (0..shown.len()).filter(either).map(|i| apart(shown[i], old[i])).collect();
                all.iter().sum::<f64>() / all.len().max(1) as f64
            });
            found.push(Step { x, found: vec![Some(shot.no_number()), change] });
            before = Some((shown, covered));
        }
        Ok(found)
    },
};
