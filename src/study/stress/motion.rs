//! Motion that is known: what remains of a picture's change after that is flicker.

use super::{
    Case, Measure, NO_NUMBER, Rig, Step, StressError, clouds, percent,
    shot::{Shot, View, apart},
};
use crate::{
    Equirect, Fresnel, Settings,
    optics::{Optics, four::Four},
    srgb::encode_srgb,
    study::{
        first, light_model,
        reconstruct::{SMOOTHING_PASSES, reconstruct},
        surface::MeshSurface,
        tracer::Tracer,
        view,
    },
};
use glam::{DVec2, DVec3, Vec3};
use std::collections::hash_map::Entry;

const MEASURES: &[Measure] = &[
    NO_NUMBER,
    Measure {
        name: "pixels that change by more than an eighth of white, %",
        bound: 15.0,
        beyond: "the picture flickers",
    },
    Measure { name: "of the truth's pixels, %", bound: f64::INFINITY, beyond: "" },
    Measure {
        name: "more than of the truth's, %",
        bound: 8.0,
        beyond: "the picture flickers more than the liquid itself does",
    },
];

/// What of a frame is compared with the next: what pixels show on a screen, and where on the surface.
#[derive(Clone)]
pub struct Moment {
    shown: Vec<Vec3>,
    at: Vec<Option<DVec3>>,
}

impl Moment {
    fn of(shot: &Shot) -> Moment {
        Moment { shown: shot.shown(), at: (0..shot.picture.len()).map(|i| shot.at(i)).collect() }
    }

    /// The same of the particles' mesh, traced through four surfaces to exact intersections: without any noise of sampling.
    fn of_truth(cloud: &[Vec3], view: &View) -> Result<Moment, StressError> {
        let sky = Equirect::procedural_sky();
        let surface = MeshSurface::new(&reconstruct(cloud, 1.0, SMOOTHING_PASSES)?);
        let rays = view::View::new(&view.camera, view.size, &sky);
        let mut settings = Settings::default();
        settings.method.optics = Optics::Four(Four::default().internal_reflections(16).fresnel(Fresnel::Exact));
        let tracer = Tracer::new(&surface, &rays, &settings.liquid);
        let light = light_model::picture(&tracer, &view.camera, &settings, 1.0, 1).unwrap_or_default();
        let width = u64::from(view.size[0]);
        let at = |(i, f): (u64, &first::First)| {
            let center = DVec2::new((i % width) as f64, (i / width) as f64) + 0.5;
            let ray = rays.ray(center);
            let per_depth = 1.0 / rays.depth(ray.at(1.0));
            (f.hits > 0).then(|| ray.at(f64::from(f.depth) * per_depth))
        };
        let shown = light.iter().map(|c| Vec3::from(c.to_array().map(encode_srgb))).collect();
        Ok(Moment { shown, at: (0..).zip(&first::maps(&tracer)).map(at).collect() })
    }

    /// Pixels of liquid whose place on the surface `before` showed too, and of these those that it showed in another colour by
    /// more than an eighth of white, in percent. `by` is how far the liquid has moved since then.
    fn changed(&self, before: &Moment, seen_before: impl Fn(DVec3) -> Option<usize>, by: DVec3) -> Option<f64> {
        let (mut seen, mut other) = (0, 0);
        for (color, at) in self.shown.iter().zip(&self.at) {
            let Some(then) = at.map(|at| at - by) else { continue };
            let is_it = |j: &usize| before.at[*j].is_some_and(|p| p.distance(then) < 0.5);
            let Some(j) = seen_before(then).filter(is_it) else { continue };
            seen += 1;
            other += usize::from(apart(*color, before.shown[j]) > 0.125);
        }
        percent(other, seen)
    }
}

/// Draws each step, and compares it with the one before.
fn sweep(
    rig: &mut Rig,
    settings: &Settings,
    steps: &[f64],
    by: DVec3,
    name: &str,
    view: impl Fn(f64) -> View,
) -> Result<Vec<Step>, StressError> {
    let mut before: Option<(Shot, [Moment; 2])> = None;
    let mut found = Vec::new();
    for &x in steps {
        let cloud: Vec<Vec3> = clouds::mixed().iter().map(|p| (p.as_dvec3() + x * by).as_vec3()).collect();
        let view = view(x);
        let shot = rig.shoot(&cloud, 1.0, &view, settings)?;
        let key = format!("{name} {x}");
        let truth = match rig.truths.entry(key) {
            Entry::Occupied(known) => known.get().clone(),
            Entry::Vacant(place) => place.insert(Moment::of_truth(&cloud, &view)?).clone(),
        };
        let now = [Moment::of(&shot), truth];
        let change = |k: usize| {
            before
                .as_ref()
                .and_then(|(shot, old): &(Shot, [Moment; 2])| now[k].changed(&old[k], |at| shot.pixel_of(at), by))
        };
        let [own, truths] = [change(0), change(1)];
        let more = own.zip(truths).map(|(own, truths)| (own - truths).max(0.0));
        found.push(Step { x, found: vec![Some(shot.no_number()), own, truths.filter(|_| own.is_some()), more] });
        before = Some((shot, now));
    }
    Ok(found)
}

/// Around liquid that rests.
pub const ORBIT: Case = Case {
    name: "orbit",
    about: "liquid that rests, and an eye that goes around it by a tenth of a degree a frame; change after warping by that, beside the truth's",
    x: "frame",
    promised: super::BOTH,
    measures: MEASURES,
    steps: |extent| (0..if extent == super::Extent::Small { 4 } else { 24 }).map(f64::from).collect(),
    run: |rig, settings, steps| {
        sweep(rig, settings, steps, DVec3::ZERO, "orbit", |x| {
            let (sin, cos) = (20.0 + 0.1 * x).to_radians().sin_cos();
            View::new(DVec3::new(60.0 * sin, 24.0, 60.0 * cos), DVec3::Y * 3.0, DVec3::Y, 35.0)
        })
    },
};

/// Past an eye that rests.
pub const DRIFT: Case = Case {
    name: "drift",
    about: "liquid that moves as a whole by a tenth of a radius a frame, and an eye that rests; change after warping by that, beside the \
            truth's",
    x: "frame",
    promised: super::BOTH,
    measures: MEASURES,
    steps: ORBIT.steps,
    run: |rig, settings, steps| {
        sweep(rig, settings, steps, DVec3::new(0.08, 0.04, 0.045), "drift", |_| {
            View::new(DVec3::new(20.0, 24.0, 60.0), DVec3::Y * 3.0, DVec3::Y, 35.0)
        })
    },
};
