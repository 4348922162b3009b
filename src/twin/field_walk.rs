//! Twin of `glsl/optics/field_walk.frag`: the walk of one view ray through a density field and balls. The field is trilinear between
//! the nodes that the device has built; roots are found in small steps and by bisection.

use super::{
    background::env_color,
    first_surface::First,
    optics::{fresnel, reflect, refract},
    quadric::pixel_ray,
    walk::Walk,
    walls::{Maps, Ray, bisect},
};
use crate::{
    Equirect, Fresnel,
    layers::field::twin::{Brick, Place, byte, held, node_of, slope, slopes, weights, whole},
    optics::walk::Walk as Rays,
    shader::{
        BOX_MARGIN, CLASS_BODY, CLASS_SPLASH, FIELD_BRICK, FIELD_NUDGE, OUTCOME_HIT, OUTCOME_NO_LIQUID,
        OUTCOME_NO_WALL, OUTCOME_REFLECTION_LIMIT, OUTCOME_SCENE, PATTERN_NONE, PATTERN_SPLASH, PATTERN_SPLASH_SPLASH,
        REFLECTION_LEAST, REFLECTIONS_WAITING, SPLASH_RADIUS, WETTING_FLAT, WETTING_GAP,
    },
};
use glam::{DVec3, IVec3, Mat3, Vec3, Vec4Swizzles};
use std::collections::BTreeMap;

/// The field as the device has built it, and how it lies in the liquid's own space. Lengths below are spacings of its nodes,
/// places are counted from the base node.
pub struct Field<'a> {
    /// What there is of it.
    pub bricks: &'a BTreeMap<Place, Brick>,
    /// The node at or before the origin of the liquid's own space.
    pub base: Place,
    /// How far beyond it the origin lies, in spacings.
    pub part: DVec3,
    /// Distance of the nodes in particle radii.
    pub spacing: f64,
    /// Density of the surface.
    pub level: f64,
    balls: Vec<DVec3>,
}

/// Steps of the march, in spacings.
const STEP: f64 = 1.0 / 64.0;

impl<'a> Field<'a> {
    /// Of what the device has built.
    pub fn new(bricks: &'a BTreeMap<Place, Brick>, base: Place, part: DVec3, spacing: f64, level: f64) -> Field<'a> {
        let place = |(brick, ball): (&Place, &[f32; 3])| {
            let first = FIELD_BRICK as i32 * IVec3::from(*brick) - IVec3::from(base);
            first.as_dvec3() + Vec3::from(*ball).as_dvec3()
        };
        let balls = bricks.iter().flat_map(|(brick, b)| b.balls.iter().map(move |ball| (brick, ball))).map(place);
        Field { bricks, base, part, spacing, level, balls: balls.collect() }
    }

    fn sum(&self, node: IVec3) -> u32 {
        node_of(self.bricks, (node + IVec3::from(self.base)).to_array())
    }

    /// Trilinear between nodes of which each has some value.
    fn between(&self, x: DVec3, value: impl Fn(IVec3) -> DVec3) -> DVec3 {
        let corner = x.floor();
        weights(x - corner).map(|(step, weight)| weight * value(corner.as_ivec3() + step)).sum()
    }

    /// The field less its level, in 1/256 of twice the level.
    pub fn at(&self, x: DVec3) -> f64 {
        self.between(x, |node| DVec3::splat(held(byte(whole(self.level), self.sum(node))))).x
    }

    /// Its gradient, in no unit: trilinear between what nodes hold.
    pub fn gradient(&self, x: DVec3) -> DVec3 {
        self.between(x, |node| slope(slopes(|step| self.sum(node + step))))
    }

    fn ball_radius(&self) -> f64 {
        f64::from(SPLASH_RADIUS) / self.spacing
    }

    /// Where a ray enters and leaves a ball, if it meets it.
    fn crossings(&self, center: DVec3, x: DVec3, dir: DVec3) -> Option<[f64; 2]> {
        let q = x - center;
        let middle = -q.dot(dir);
        let square = self.ball_radius().powi(2) - (q + middle * dir).length_squared();
        (square > 0.0).then(|| [middle - square.sqrt(), middle + square.sqrt()])
    }

    /// The ball around a point that is not on its sphere.
    fn ball_around(&self, x: DVec3) -> Option<DVec3> {
        let inside = |c: &&DVec3| c.distance_squared(x) < self.ball_radius().powi(2) * 0.999;
        self.balls.iter().find(inside).copied()
    }

    /// The first t up to `end` at which the field falls (from inside) or rises through its level, once the ray has been on its
    /// side; 0 if it never is in the cell in which it starts.
    fn crossing(&self, x: DVec3, dir: DVec3, inside: bool, start: f64, end: f64) -> Option<f64> {
        let side = if inside { 1.0 } else { -1.0 };
        let h = |t: f64| side * self.at(x + t * dir);
        let cell = (x + start * dir).floor();
        let (mut own, mut last) = (h(start) > 0.0, start);
        while last < end {
            let t = (last + STEP).min(end);
            let value = h(t);
            if own && value < 0.0 {
                return Some(bisect(last, t, |t| h(t) < 0.0).1);
            }
            own |= value > 0.0;
            if !own && (x + t * dir).floor() != cell {
                return Some(start);
            }
            last = t;
        }
        None
    }
}

#[derive(Clone, Copy)]
enum Liquid {
    Body,
    Ball(DVec3),
}

impl Liquid {
    fn class(self) -> u32 {
        if let Liquid::Body = self { CLASS_BODY } else { CLASS_SPLASH }
    }
}

/// A reflected ray that waits to be followed.
#[derive(Clone, Copy)]
struct Reflection {
    x: DVec3,
    dir: DVec3,
    light: Vec3,
    within: Option<Liquid>,
}

struct Walker<'a> {
    field: &'a Field<'a>,
    /// The frame and the host's scene; of its maps none is looked at.
    view: &'a Maps<'a>,
    settings: &'a Rays,
    environment: &'a Equirect,
    x: DVec3,
    dir: DVec3,
    color: Vec3,
    light: Vec3,
    hits: u32,
    length: f64,
    bounces: u32,
    on_scene: Option<[usize; 2]>,
    /// The most important first.
    waiting: Vec<Reflection>,
}

impl Walker<'_> {
    fn rotation(&self) -> glam::DMat3 {
        Mat3::from_mat4(self.view.frame.view).as_dmat3()
    }

    fn eye(&self, x: DVec3) -> DVec3 {
        self.rotation() * ((x - self.field.part) * self.field.spacing) + self.view.frame.view.w_axis.xyz().as_dvec3()
    }

    /// From where to where a ray is in the box around the liquid.
    fn within_box(&self) -> [f64; 2] {
        let frame = self.view.frame;
        let to_field = |x: Vec3, more: f64| (x.as_dvec3() + more) / self.field.spacing + self.field.part;
        let margin = f64::from(BOX_MARGIN);
        let (low, high) = (to_field(frame.bounds_min, -margin), to_field(frame.bounds_max, margin));
        let (a, b) = ((low - self.x) / self.dir, (high - self.x) / self.dir);
        [a.min(b).max_element().max(0.0), a.max(b).min_element()]
    }

    fn normal(&self, liquid: Liquid) -> DVec3 {
        match liquid {
            Liquid::Ball(center) => (self.x - center).normalize(),
            Liquid::Body => -self.field.gradient(self.x).normalize_or(self.dir),
        }
    }

    fn in_view(&self, x: DVec3) -> bool {
        self.view.in_view(self.eye(x))
    }

    fn background(&self, x: DVec3, dir: DVec3) -> Vec3 {
        let dir = self.rotation() * dir;
        match self.in_view(x) {
            true => self.view.background(self.environment, self.eye(x), dir),
            false => env_color(self.environment, Mat3::from_mat4(self.view.frame.eye_to_env).as_dmat3() * dir),
        }
    }

    /// Where the host's scene is met before t.
    fn meets_scene(&self, t: f64) -> Option<(f64, [usize; 2])> {
        if !self.in_view(self.x) {
            return None;
        }
        let ray = Ray::new(self.view.frame, self.eye(self.x), self.rotation() * self.dir).up_to(t * self.field.spacing);
        self.view.meets_scene(&ray).map(|(t, pixel)| (t / self.field.spacing, pixel))
    }

    /// Has a reflected ray wait, if it matters enough; of too many the least important is not followed.
    fn reflects(&mut self, ray: Reflection) {
        let importance = |r: &Reflection| r.light.max_element();
        let mut rest = ray;
        if self.settings.trace_reflections > 0 && importance(&ray) >= REFLECTION_LEAST {
            let at = self.waiting.partition_point(|r| importance(r) >= importance(&ray));
            self.waiting.insert(at, ray);
            if self.waiting.len() <= REFLECTIONS_WAITING as usize {
                return;
            }
            rest = self.waiting.pop().expect("it has some");
        }
        self.color += rest.light * self.background(rest.x, rest.dir);
    }

    /// Meets a wall: whether the ray goes through.
    fn meet(&mut self, liquid: Liquid, entering: bool) -> bool {
        let ior = self.view.frame.ior;
        let normal = self.normal(liquid);
        // Towards where the ray comes from.
        let against = if self.dir.dot(normal) > 0.0 { -normal } else { normal };
        self.hits += 1;
        let mirrored = reflect(self.dir.as_vec3(), against.as_vec3()).as_dvec3().normalize();
        let eta = if entering { ior.recip() } else { ior };
        let Some(bent) = refract(self.dir.as_vec3(), against.as_vec3(), eta) else {
            self.dir = mirrored;
            self.x += f64::from(FIELD_NUDGE) * against;
            return false;
        };
        let bent = bent.as_dvec3().normalize();
        let (before, after) = (-self.dir.dot(against), -bent.dot(against));
        let (air, water) = if entering { (before, after) } else { (after, before) };
        let reflected = fresnel(air as f32, water as f32, ior, self.settings.fresnel == Fresnel::Exact);
        let x = self.x + f64::from(FIELD_NUDGE) * against;
        let within = (!entering).then_some(liquid);
        self.reflects(Reflection { x, dir: mirrored, light: self.light * reflected, within });
        self.light *= 1.0 - reflected;
        self.dir = bent;
        self.x -= f64::from(FIELD_NUDGE) * against;
        true
    }

    /// The first liquid that a ray outside of all meets, and where.
    fn enter(&self) -> Option<(Liquid, f64)> {
        let [start, end] = self.within_box();
        let enters =
            |c: &DVec3| self.field.crossings(*c, self.x, self.dir).map(|[t, _]| (*c, t)).filter(|c| c.1 > 1e-3);
        let ball = self.field.balls.iter().filter_map(enters).min_by(|a, b| a.1.total_cmp(&b.1));
        let limit = ball.map_or(end, |(_, t)| t.min(end));
        let body = self.field.crossing(self.x, self.dir, false, start, limit).map(|t| (Liquid::Body, t));
        body.or(ball.map(|(c, t)| (Liquid::Ball(c), t)))
    }

    /// From inside one volume until the ray is outside.
    fn through(&mut self, mut liquid: Liquid) -> Result<(), u32> {
        loop {
            let [_, end] = self.within_box();
            let leaves = match liquid {
                Liquid::Body => self.field.crossing(self.x, self.dir, true, 0.0, end),
                Liquid::Ball(c) => self.field.crossings(c, self.x, self.dir).map(|[_, t]| t.max(0.0)).or(Some(0.0)),
            };
            let mut t = leaves.unwrap_or(end.max(0.0));
            let from = self.x;
            self.x = from + t * self.dir;
            let gap = match leaves {
                Some(_) => {
                    f64::from(WETTING_GAP) / self.dir.dot(self.normal(liquid)).abs().max(f64::from(WETTING_FLAT))
                }
                None => 0.0,
            };
            self.x = from;
            let met = self.meets_scene(t + gap / self.field.spacing);
            t = met.map_or(t, |(t, _)| t);
            self.x = from + t * self.dir;
            self.length += t * self.field.spacing;
            self.light *= (-self.view.frame.absorption * (t * self.field.spacing) as f32).exp();
            if let Some((_, pixel)) = met {
                self.on_scene = Some(pixel);
                return Err(OUTCOME_SCENE);
            }
            if leaves.is_none() {
                return Err(OUTCOME_NO_WALL);
            }
            if let Liquid::Ball(_) = liquid
                && self.field.at(self.x) >= 0.0
            {
                liquid = Liquid::Body;
                continue;
            }
            if let Some(center) = self.field.ball_around(self.x) {
                liquid = Liquid::Ball(center);
                continue;
            }
            if self.meet(liquid, false) {
                return Ok(());
            }
            if self.bounces == self.settings.internal_reflections {
                return Err(OUTCOME_REFLECTION_LIMIT);
            }
            self.bounces += 1;
        }
    }

    /// From within a volume or from outside through all of them; the class of the second, and how the walk ends.
    fn volumes(&mut self, mut within: Option<Liquid>) -> (Option<u32>, u32) {
        let mut second = None;
        let mut volume = u32::from(within.is_some());
        loop {
            if let Some(liquid) = within
                && let Err(outcome) = self.through(liquid)
            {
                return (second, outcome);
            }
            if volume == self.settings.refractions / 2 {
                return (second, OUTCOME_HIT);
            }
            let Some((next, t)) = self.enter() else { return (second, OUTCOME_HIT) };
            if let Some((t, pixel)) = self.meets_scene(t) {
                self.x += t * self.dir;
                self.on_scene = Some(pixel);
                return (second, OUTCOME_SCENE);
            }
            self.x += t * self.dir;
            self.meet(next, true);
            volume += 1;
            second = second.or((volume == 2).then(|| next.class()));
            within = Some(next);
        }
    }

    /// What a ray brings back from where it ends.
    fn end(&mut self) {
        let light = match self.on_scene {
            Some(pixel) => self.view.scene_light(pixel),
            None => self.background(self.x, self.dir),
        };
        self.color += self.light * light;
    }

    /// Reflected rays, the most important first; those that are not followed bring back what is far away.
    fn reflections(&mut self) {
        for _ in 0..self.settings.trace_reflections {
            if self.waiting.is_empty() {
                return;
            }
            let Reflection { x, dir, light, within } = self.waiting.remove(0);
            (self.x, self.dir, self.light, self.bounces, self.on_scene) = (x, dir, light, 0, None);
            self.volumes(within);
            self.end();
        }
        for r in std::mem::take(&mut self.waiting) {
            self.color += r.light * self.background(r.x, r.dir);
        }
    }
}

impl<'a> Walker<'a> {
    /// On the view ray of a pixel, at the near plane.
    fn new(
        field: &'a Field,
        view: &'a Maps,
        settings: &'a Rays,
        environment: &'a Equirect,
        pixel: [usize; 2],
    ) -> Walker<'a> {
        let frame = view.frame;
        let v = pixel_ray(frame, pixel[0] as u32, pixel[1] as u32);
        let to_world = Mat3::from_mat4(frame.view).as_dmat3().transpose();
        let start = f64::from(frame.near) * v - frame.view.w_axis.xyz().as_dvec3();
        Walker {
            field,
            view,
            settings,
            environment,
            x: to_world * start / field.spacing + field.part,
            dir: to_world * v.normalize(),
            color: Vec3::ZERO,
            light: Vec3::ONE,
            hits: 0,
            length: 0.0,
            bounces: 0,
            on_scene: None,
            waiting: Vec::new(),
        }
    }

    /// Goes to the first liquid, unless the scene hides it; and whether the ray starts in it.
    fn start(&mut self, pixel: [usize; 2]) -> Option<(Liquid, bool)> {
        let around = match self.field.at(self.x) >= 0.0 {
            true => Some(Liquid::Body),
            false => self.field.ball_around(self.x).map(Liquid::Ball),
        };
        let (first, t) = around.map(|liquid| (liquid, 0.0)).or_else(|| self.enter())?;
        let x = self.x + t * self.dir;
        if -self.eye(x).z > self.view.scene_depth(pixel) {
            return None;
        }
        self.x = x;
        Some((first, around.is_some()))
    }
}

/// Walks the view ray of one pixel. `view` has the frame and the host's scene; its maps may be empty.
pub fn walk(field: &Field, view: &Maps, settings: &Rays, environment: &Equirect, pixel: [usize; 2]) -> Walk {
    let mut walker = Walker::new(field, view, settings, environment, pixel);
    let Some((first, inside)) = walker.start(pixel) else {
        let color = match view.scene_depth(pixel).is_finite() {
            true => view.scene_light(pixel),
            false => env_color(
                environment,
                Mat3::from_mat4(view.frame.eye_to_env).as_dmat3() * (walker.rotation() * walker.dir),
            ),
        };
        let (pattern, outcome) = (PATTERN_NONE, OUTCOME_NO_LIQUID);
        return Walk { pattern, outcome, hits: 0, length: 0.0, direction: walker.dir, color };
    };
    if !inside {
        walker.meet(first, true);
    }
    let (second, outcome) = if settings.refractions == 1 { (None, OUTCOME_HIT) } else { walker.volumes(Some(first)) };
    let first = first.class();
    let pattern = second.map_or(PATTERN_SPLASH + first, |second| PATTERN_SPLASH_SPLASH + 2 * first + second);
    let Walker { hits, length, dir: direction, .. } = walker;
    walker.end();
    walker.reflections();
    Walk { pattern, outcome, hits, length, direction, color: walker.color }
}

/// The first surface that a pixel shows, of a walk like that (`glsl/first_surface.frag`).
pub fn first_surface(
    field: &Field,
    view: &Maps,
    settings: &Rays,
    environment: &Equirect,
    pixel: [usize; 2],
) -> Option<First> {
    let mut walker = Walker::new(field, view, settings, environment, pixel);
    let (liquid, inside) = walker.start(pixel)?;
    let outward = if inside { -walker.dir } else { walker.normal(liquid) };
    let normal = if walker.dir.dot(outward) > 0.0 { -outward } else { outward };
    Some(First { normal, depth: -walker.eye(walker.x).z })
}
