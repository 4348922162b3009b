//! Twin of `glsl/include/walls.glsl`: walls along a ray x(t) = x0 + t w, of the body in its maps and of the balls that splashes
//! are (docs/methods.md, "Walls along a ray"). In place of cells, a dense march: slow, but the first wall it meets is the first
//! wall there is.

use super::{background::Scene, normal::decode_normal, quadric::pixel_ray, watch::Watch};
use crate::shader::{
    ACCEPTED, ACCEPTED_PIXELS, BOX_MARGIN, CLASS_BODY, CLASS_SPLASH, Frame, JUMP, SIDE_BACK, SIDE_FRONT, SIDE_NUDGE,
    SPLASH_RADIUS, STEEP,
};
use glam::{DVec2, DVec3, Mat3, Vec4Swizzles};

/// One map: linear depth (at most 0: no surface, or the near plane inside it) and packed normals, row by row. Both empty
/// where the frame has no such map.
#[derive(Clone, Copy, Debug, Default)]
pub struct Map<'a> {
    /// Linear depth.
    pub depth: &'a [f32],
    /// Outward normals in eye space, as `encode_normal` packs them.
    pub normal: &'a [u32],
}

/// The maps of a frame and how they lie in eye space.
#[derive(Clone, Copy, Debug)]
pub struct Maps<'a> {
    /// Parameters of the frame.
    pub frame: &'a Frame,
    /// By class, then side. Of splashes the back is where the pixel's ray leaves the splash that it shows in front, and has no
    /// normals; the normal of the front is that of the back where the near plane lies in the splash.
    pub maps: [[Map<'a>; 2]; 2],
    /// The host's, if there is one.
    pub scene: Option<Scene<'a>>,
}

/// What depends on how much a pixel covers, at one depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// |g| at a surface, at most.
    pub accepted: f64,
    /// g on the other side that is overlooked just after a ray's start on a wall, at most.
    pub start: f64,
    /// Depths of a footprint that differ by more are a jump.
    pub jump: f64,
}

impl Tolerance {
    /// At a depth.
    pub fn at(frame: &Frame, depth: f64) -> Tolerance {
        let pixel = depth / f64::from(frame.pixel_scale.abs().max_element());
        Tolerance {
            accepted: f64::from(ACCEPTED).max(f64::from(ACCEPTED_PIXELS) * pixel),
            start: f64::from(ACCEPTED).max(pixel),
            jump: f64::from(JUMP).max(f64::from(STEEP) * pixel),
        }
    }
}

/// Pixels that one step of the march may cover.
const STEP_PIXELS: f64 = 0.125;
/// Depth that one step of the march may cover, in particle radii.
const STEP_DEPTH: f64 = 0.125;

/// Where a ray passes from one side of the body's wall to the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// The wall on the ray.
    pub t: f64,
    /// Where a ray goes on that stays inside, or comes in.
    pub inside: f64,
    /// Where a ray goes on that stays outside, or goes out.
    pub outside: f64,
    /// Of unit length, outward.
    pub normal: DVec3,
    /// Whether a map ends or jumps there.
    pub side_wall: bool,
}

/// What ends a ray that meets no wall, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// Where on the ray.
    pub t: f64,
    /// Whether it was the border of the view or the near plane; otherwise the liquid's box.
    pub view: bool,
}

/// What a ray outside meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Entry {
    /// The body.
    Body(Wall),
    /// A splash, at t.
    Ball(Ball, f64),
}

/// A splash, in eye space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its centre.
    pub center: DVec3,
    /// Its radius.
    pub radius: f64,
}

impl Ball {
    /// Both t at which a ray's line meets the sphere.
    fn crossings(&self, ray: &Ray) -> Option<(f64, f64)> {
        let to_center = self.center - ray.origin;
        let middle = to_center.dot(ray.dir);
        let square = self.radius * self.radius - (to_center - middle * ray.dir).length_squared();
        (square >= 0.0).then(|| (middle - square.sqrt(), middle + square.sqrt()))
    }

    /// Where a ray inside leaves it.
    pub fn leave(&self, ray: &Ray) -> f64 {
        // Rounding may put a start just off the sphere.
        self.crossings(ray).map_or(0.0, |(_, t)| t.max(0.0))
    }

    /// Whether a point lies inside.
    pub fn holds(&self, x: DVec3) -> bool {
        x.distance(self.center) < self.radius
    }

    /// The sphere as a ray meets it at t.
    pub(super) fn wall(&self, ray: &Ray, t: f64) -> Wall {
        Wall { t, inside: t, outside: t, normal: self.normal(ray.at(t)), side_wall: false }
    }

    /// Outward normal at a point of the sphere.
    pub fn normal(&self, x: DVec3) -> DVec3 {
        (x - self.center).normalize()
    }
}

/// The four pixels around a position with their bilinear weights.
type Footprint = [([usize; 2], f64); 4];

/// g at a point, as its two terms: F − d and d − B, of which the larger is g.
type Terms = [f64; 2];

impl Maps<'_> {
    /// Depth stored at a pixel; 0 where there is no such map.
    pub fn depth(&self, class: u32, side: u32, pixel: [usize; 2]) -> f64 {
        let width = self.frame.size.x as usize;
        let map = self.maps[class as usize][side as usize].depth;
        map.get(pixel[1] * width + pixel[0]).map_or(0.0, |d| f64::from(*d))
    }

    /// Normal stored at a pixel.
    pub fn normal(&self, class: u32, side: u32, pixel: [usize; 2]) -> DVec3 {
        let width = self.frame.size.x as usize;
        decode_normal(self.maps[class as usize][side as usize].normal[pixel[1] * width + pixel[0]]).as_dvec3()
    }

    /// Pixel position on which an eye-space point with d > 0 lies; pixel centres at +0.5.
    pub fn project(&self, x: DVec3) -> DVec2 {
        let (scale, origin) = (self.frame.pixel_scale.as_dvec2(), self.frame.pixel_origin.as_dvec2());
        scale * x.truncate() / -x.z + origin
    }

    /// The pixel that holds a position, clamped into the image.
    pub(super) fn clamped(&self, position: DVec2) -> [usize; 2] {
        let size = self.frame.size.as_dvec2();
        let p = position.floor().clamp(DVec2::ZERO, size - 1.0);
        [p.x as usize, p.y as usize]
    }

    /// The pixel onto which a point falls.
    fn pixel_of(&self, x: DVec3) -> [usize; 2] {
        self.clamped(self.project(x))
    }

    /// [F, B] of the body at a pixel. Where the host says that the eye is in the body, that begins at the near plane.
    pub fn interval(&self, pixel: [usize; 2]) -> Option<[f64; 2]> {
        let [front, back] = [SIDE_FRONT, SIDE_BACK].map(|side| self.depth(CLASS_BODY, side, pixel));
        if front == 0.0 || back <= 0.0 {
            return None;
        }
        let front = if front < 0.0 || self.frame.eye_inside != 0.0 { f64::from(self.frame.near) } else { front };
        Some([front.min(back), front.max(back)])
    }

    fn footprint(&self, position: DVec2) -> Footprint {
        let corner = (position - 0.5).floor();
        let f = position - 0.5 - corner;
        let at = |dx: f64, dy: f64| self.clamped(corner + DVec2::new(dx, dy));
        [
            (at(0.0, 0.0), (1.0 - f.x) * (1.0 - f.y)),
            (at(1.0, 0.0), f.x * (1.0 - f.y)),
            (at(0.0, 1.0), (1.0 - f.x) * f.y),
            (at(1.0, 1.0), f.x * f.y),
        ]
    }

    /// F (or B) of each pixel of a footprint, if it may be interpolated at a depth.
    fn smooth(&self, footprint: &Footprint, side: u32, depth: f64) -> Option<[f64; 4]> {
        let mut values = [0.0; 4];
        for (value, (pixel, _)) in values.iter_mut().zip(footprint) {
            *value = self.interval(*pixel)?[side as usize];
        }
        let low = values.into_iter().fold(f64::INFINITY, f64::min);
        let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
        (high - low <= Tolerance::at(self.frame, depth).jump).then_some(values)
    }

    /// The two terms of g at a point; `None` where there is no interval, and g is anything above 0.
    fn terms(&self, x: DVec3) -> Option<Terms> {
        let (position, d) = (self.project(x), -x.z);
        let own = self.interval(self.clamped(position))?;
        let footprint = self.footprint(position);
        let [front, back] = [SIDE_FRONT, SIDE_BACK].map(|side| match self.smooth(&footprint, side, d) {
            Some(values) => values.iter().zip(&footprint).map(|(value, (_, weight))| weight * value).sum(),
            None => own[side as usize],
        });
        Some([front - d, d - back])
    }

    /// g at a point.
    pub(super) fn g(&self, x: DVec3) -> f64 {
        self.terms(x).map_or(f64::INFINITY, |[front, back]| front.max(back))
    }

    /// Whose term of g is the larger at a point.
    pub(super) fn side(&self, x: DVec3) -> u32 {
        self.terms(x).map_or(SIDE_BACK, |[front, back]| if front > back { SIDE_FRONT } else { SIDE_BACK })
    }

    /// Whether a point lies in the body.
    pub fn in_body(&self, x: DVec3) -> bool {
        self.in_view(x) && self.g(x) < 0.0
    }

    /// The map's normal at a point of a surface, with the weights of the depth there.
    fn surface_normal(&self, side: u32, x: DVec3) -> DVec3 {
        let footprint = self.footprint(self.project(x));
        if self.smooth(&footprint, side, -x.z).is_none() {
            return self.normal(CLASS_BODY, side, self.pixel_of(x));
        }
        let sum: DVec3 = footprint.iter().map(|(pixel, weight)| *weight * self.normal(CLASS_BODY, side, *pixel)).sum();
        sum.normalize()
    }

    /// Where on the screen the body ends around a pixel at a depth; the way `along` where that says little.
    fn ends_around(&self, pixel: [usize; 2], depth: f64, along: DVec2) -> DVec2 {
        let center = DVec2::new(pixel[0] as f64, pixel[1] as f64);
        let steps = (-1..=1).flat_map(|y| (-1..=1).map(move |x| DVec2::new(f64::from(x), f64::from(y))));
        let without = steps.filter(|step| *step != DVec2::ZERO).filter(|step| {
            let interval = self.interval(self.clamped(center + *step));
            interval.is_none_or(|[front, back]| depth < front || depth > back)
        });
        let sum: DVec2 = without.map(|step| step / step.length_squared()).sum();
        if sum.length() > 0.5 { sum } else { along }
    }

    /// Normal of a side wall, from the points on either side of it; `outwards` is the way of the ray there on the screen.
    fn side_normal(&self, inside: DVec3, outside: DVec3, outwards: DVec2) -> DVec3 {
        let pixel = self.pixel_of(inside);
        let [front, back] = [SIDE_FRONT, SIDE_BACK].map(|side| self.normal(CLASS_BODY, side, pixel));
        // The plane through the eye along the edge.
        let c = self.ends_around(pixel, -inside.z, outwards) * self.frame.pixel_scale.as_dvec2();
        let edge = c.extend(c.dot(inside.truncate()) / -inside.z).normalize();
        let sight = inside.normalize();
        let limb = match self.terms(outside) {
            None => 0.5 * (front + back),
            Some([before, behind]) if before > behind => front,
            Some(_) => back,
        };
        let limb = limb - limb.dot(sight) * sight;
        let known = if limb.dot(edge) > 0.0 { limb.length_squared().min(1.0) } else { 0.0 };
        edge.lerp(limb, known).normalize()
    }

    /// The wall between the ends of a bracket, one of them inside and one outside; `accepted`: |g| at a surface at a depth.
    pub(super) fn wall(&self, ray: &Ray, inside: f64, outside: f64, accepted: impl Fn(Tolerance) -> f64) -> Wall {
        for t in [inside, outside] {
            let x = ray.at(t);
            if let Some([front, back]) = self.terms(x)
                && front.max(back).abs() <= accepted(Tolerance::at(self.frame, -x.z))
            {
                let normal = self.surface_normal(if front > back { SIDE_FRONT } else { SIDE_BACK }, x);
                return Wall { t: inside, inside, outside, normal, side_wall: false };
            }
        }
        let leaves = (outside - inside).signum();
        let normal = self.side_normal(ray.at(inside), ray.at(outside), leaves * self.on_screen(ray, inside));
        // Off the border between two pixels.
        let nudge = leaves * f64::from(SIDE_NUDGE) / self.on_screen(ray, inside).length().max(1e-12);
        let beside = |t: f64| t.clamp(0.0, self.end(ray).t);
        Wall { t: inside, inside: beside(inside - nudge), outside: beside(outside + nudge), normal, side_wall: true }
    }

    /// Where a ray that starts in the body leaves it.
    pub fn leave_body(&self, ray: &Ray) -> Result<Wall, End> {
        let (end, mut watch) = (self.end(ray), Watch::new(ray, true));
        if let Some(wall) = watch.passes(self, 0.0) {
            return Ok(wall);
        }
        let mut t = 0.0;
        while t < end.t {
            t = self.next(ray, t).min(end.t);
            if let Some(wall) = watch.passes(self, t) {
                return Ok(wall);
            }
        }
        watch.passed(self, t).ok_or(end)
    }

    /// The first wall of either class that a ray outside meets.
    pub fn enter(&self, ray: &Ray) -> Result<Entry, End> {
        let (end, mut watch) = (self.end(ray), Watch::new(ray, false));
        let mut ball: Option<(Ball, f64)> = None;
        // Up to the end, or as far as a body might still stand before the ball.
        let limit = |ball: Option<(Ball, f64)>| ball.map_or(end.t, |(_, t)| t.min(end.t));
        let (mut last, mut t) = (0.0, 0.0);
        loop {
            if ball.is_none() {
                ball = self.ball_met(ray, last, t);
            }
            if let Some(wall) = watch.passes(self, t) {
                return Ok(match ball {
                    Some((ball, at)) if at < wall.t => Entry::Ball(ball, at),
                    _ => Entry::Body(wall),
                });
            }
            if t >= limit(ball) {
                let body = || watch.passed(self, t).map(Entry::Body);
                return ball.map(|(ball, t)| Entry::Ball(ball, t)).or_else(body).ok_or(end);
            }
            (last, t) = (t, self.next(ray, t).min(end.t));
        }
    }

    /// The splash that a pixel shows in front.
    pub fn ball(&self, pixel: [usize; 2]) -> Option<Ball> {
        let [front, back] = self.splash(pixel)?;
        let v = pixel_ray(self.frame, pixel[0] as u32, pixel[1] as u32);
        let n = self.normal(CLASS_SPLASH, SIDE_FRONT, pixel);
        let particle = f64::from(SPLASH_RADIUS);
        if self.depth(CLASS_SPLASH, SIDE_FRONT, pixel) < 0.0 {
            // All that is known is where the ray leaves it.
            return Some(Ball { center: back * v - particle * n, radius: particle });
        }
        let radius = (back - front) * v.dot(v) / (-2.0 * n.dot(v));
        // At the limb a packed normal may face away.
        let radius = if radius > 0.0 && radius.is_finite() { radius } else { particle };
        Some(Ball { center: front * v - radius * n, radius })
    }

    /// The ball of the pixel onto which a point falls, if the point lies inside it.
    pub fn ball_around(&self, x: DVec3) -> Option<Ball> {
        self.ball(self.pixel_of(x)).filter(|ball| ball.holds(x))
    }

    /// S and S' at a pixel.
    fn splash(&self, pixel: [usize; 2]) -> Option<[f64; 2]> {
        let [front, back] = [SIDE_FRONT, SIDE_BACK].map(|side| self.depth(CLASS_SPLASH, side, pixel));
        let front = if front < 0.0 { f64::from(self.frame.near) } else { front };
        (front > 0.0 && back >= front).then_some([front, back])
    }

    /// The ball of a pixel in which the ray is between two samples of a march, if it comes between S and S' there; and
    /// where the ray enters it.
    fn ball_met(&self, ray: &Ray, last: f64, t: f64) -> Option<(Ball, f64)> {
        let depths = [last, t].map(|t| -ray.at(t).z);
        [last, t].into_iter().find_map(|at| {
            let pixel = self.pixel_of(ray.at(at));
            let [front, back] = self.splash(pixel)?;
            if depths[0].max(depths[1]) < front || depths[0].min(depths[1]) > back {
                return None;
            }
            let ball = self.ball(pixel)?;
            let (enters, _) = ball.crossings(ray)?;
            (enters > 0.0).then_some((ball, enters))
        })
    }

    /// t of the next sample of the march.
    fn next(&self, ray: &Ray, t: f64) -> f64 {
        let by_depth = STEP_DEPTH / ray.dir.z.abs().max(1e-12);
        self.next_on_screen(ray, t).min(t + by_depth)
    }

    /// An eighth of a pixel on, or the ray's end.
    pub(super) fn next_on_screen(&self, ray: &Ray, t: f64) -> f64 {
        ray.box_end.min(t + STEP_PIXELS / self.on_screen(ray, t).length().max(1e-12))
    }

    /// d pixel / dt at a point of a ray.
    fn on_screen(&self, ray: &Ray, t: f64) -> DVec2 {
        let d = -ray.at(t).z;
        let lateral = ray.dir.truncate() * -ray.origin.z + ray.origin.truncate() * ray.dir.z;
        lateral * self.frame.pixel_scale.as_dvec2() / (d * d)
    }

    pub(super) fn in_view(&self, x: DVec3) -> bool {
        let size = self.frame.size.as_dvec2();
        let p = self.project(x);
        -x.z >= f64::from(self.frame.near) && p.cmpge(DVec2::ZERO).all() && p.cmplt(size).all()
    }

    /// Where a ray ends that meets nothing.
    fn end(&self, ray: &Ray) -> End {
        let (scale, origin) = (self.frame.pixel_scale.as_dvec2(), self.frame.pixel_origin.as_dvec2());
        let size = self.frame.size.as_dvec2();
        // Planes that bound the view, positive inside: d - near, p d and (size - p) d along either axis.
        let near = -f64::from(self.frame.near);
        let planes = [
            (DVec3::NEG_Z, near),
            (DVec3::new(scale.x, 0.0, -origin.x), 0.0),
            (DVec3::new(-scale.x, 0.0, origin.x - size.x), 0.0),
            (DVec3::new(0.0, scale.y, -origin.y), 0.0),
            (DVec3::new(0.0, -scale.y, origin.y - size.y), 0.0),
        ];
        let leaves = |(normal, shift): (DVec3, f64)| match normal.dot(ray.dir) {
            slope if slope < 0.0 => (normal.dot(ray.origin) + shift).max(0.0) / -slope,
            _ => f64::INFINITY,
        };
        let view = planes.map(leaves).into_iter().fold(f64::INFINITY, f64::min);
        End { t: view.min(ray.box_end), view: view < ray.box_end }
    }
}

/// Narrows the bracket from a to b in which something becomes true.
pub(super) fn bisect(mut a: f64, mut b: f64, yet: impl Fn(f64) -> bool) -> (f64, f64) {
    for _ in 0..60 {
        let t = 0.5 * (a + b);
        if yet(t) { b = t } else { a = t }
    }
    (a, b)
}

/// A ray in eye space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start.
    pub origin: DVec3,
    /// Unit direction.
    pub dir: DVec3,
    /// t at which it leaves the liquid's box for good, or is looked at no more.
    pub(super) box_end: f64,
}

impl Ray {
    /// A ray, and where it leaves the box around the liquid, beyond which smoothing may move surfaces a little.
    pub fn new(frame: &Frame, origin: DVec3, dir: DVec3) -> Ray {
        let to_world = Mat3::from_mat4(frame.view).as_dmat3().transpose();
        let o = to_world * (origin - frame.view.w_axis.xyz().as_dvec3());
        let w = to_world * dir;
        let margin = f64::from(BOX_MARGIN);
        let (low, high) = (frame.bounds_min.as_dvec3() - margin, frame.bounds_max.as_dvec3() + margin);
        let ends = (0..3).filter(|k| w[*k] != 0.0).map(|k| (if w[k] > 0.0 { high[k] } else { low[k] } - o[k]) / w[k]);
        Ray { origin, dir, box_end: ends.fold(f64::INFINITY, f64::min).max(0.0) }
    }

    /// The same ray, for as long as it runs, box or no box.
    pub fn up_to(self, end: f64) -> Ray {
        Ray { box_end: end, ..self }
    }

    /// Point at t.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.dir
    }
}
