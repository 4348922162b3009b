//! Twin of `glsl/include/search.glsl`, `exit.glsl` and `entry.glsl`: walls along a ray x(t) = x0 + t w in the four maps
//! (docs/methods.md, "Searches along a ray"). In place of the secant method, a dense march: slow, but the first wall it
//! meets is the first wall there is.

use super::{background::Scene, normal::decode_normal};
use crate::shader::{
    ACCEPTED, ACCEPTED_PIXELS, CLASS_BODY, CLASS_SPLASH, CONVERGED, CONVERGED_DEPTH, Frame, JUMP, OUTCOME_HIT,
    OUTCOME_HOLE, OUTCOME_LEFT_VIEW, OUTCOME_OPPOSITE_WALL, SIDE_BACK, SIDE_FRONT, STEEP,
};
use glam::{DVec2, DVec3, Mat3, Vec4Swizzles};

/// One map: linear depth (at most 0: no surface, or the eye inside it) and packed normals, row by row. Both empty
/// where the frame has no such map.
#[derive(Clone, Copy, Debug, Default)]
pub struct Map<'a> {
    /// Linear depth.
    pub depth: &'a [f32],
    /// Outward normals in eye space, as `encode_normal` packs them.
    pub normal: &'a [u32],
}

/// The four maps of a frame and how they lie in eye space.
#[derive(Clone, Copy, Debug)]
pub struct Maps<'a> {
    /// Parameters of the frame.
    pub frame: &'a Frame,
    /// By class, then side.
    pub maps: [[Map<'a>; 2]; 2],
    /// The host's, if there is one.
    pub scene: Option<Scene<'a>>,
}

/// How exactly walls have to be met, from the box around what is drawn. In float32, as the shader has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// |f| of a root.
    pub converged: f32,
    /// |f| of a hit, at most.
    pub accepted: f32,
    /// Depths of a footprint that differ by more are a jump.
    pub jump: f32,
}

impl Tolerance {
    /// Of a frame.
    pub fn of(frame: &Frame) -> Tolerance {
        let (low, high) = (frame.bounds_min, frame.bounds_max);
        let middle = frame.view.transform_point3(0.5 * (low + high)).length();
        let farthest = middle + 0.5 * (high - low).length();
        let converged = CONVERGED.max(CONVERGED_DEPTH * farthest);
        // What a pixel covers in the middle of the liquid.
        let pixel = middle / frame.pixel_scale.abs().max_element();
        let accepted = ACCEPTED.max(ACCEPTED_PIXELS * pixel).max(converged);
        Tolerance { converged, accepted, jump: JUMP.max(STEEP * pixel) }
    }
}

/// Pixels that one step of the march may cover.
const STEP_PIXELS: f64 = 0.125;
/// Depth that one step of the march may cover, in particle radii.
const STEP_DEPTH: f64 = 0.125;

/// Where a search ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exit {
    /// One of the `OUTCOME_` codes.
    pub outcome: u32,
    /// Where on the ray: the hit, or the last point inside.
    pub t: f64,
    /// Which map was hit.
    pub side: u32,
}

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

    /// The four pixels around a position with their bilinear weights, if their depths may be interpolated: all four
    /// have a surface, and no jump lies between them.
    fn footprint(&self, class: u32, side: u32, position: DVec2) -> Option<[([usize; 2], f64); 4]> {
        let corner = (position - 0.5).floor();
        let f = position - 0.5 - corner;
        let at = |dx: f64, dy: f64| self.clamped(corner + DVec2::new(dx, dy));
        let four = [
            (at(0.0, 0.0), (1.0 - f.x) * (1.0 - f.y)),
            (at(1.0, 0.0), f.x * (1.0 - f.y)),
            (at(0.0, 1.0), (1.0 - f.x) * f.y),
            (at(1.0, 1.0), f.x * f.y),
        ];
        let depths = four.map(|(pixel, _)| self.depth(class, side, pixel));
        let low = depths.into_iter().fold(f64::INFINITY, f64::min);
        let high = depths.into_iter().fold(f64::NEG_INFINITY, f64::max);
        (low > 0.0 && high - low <= f64::from(Tolerance::of(self.frame).jump)).then_some(four)
    }

    /// Depth at a position: bilinear where the footprint is whole, else the pixel's own; `None` without a surface.
    pub fn sample_depth(&self, class: u32, side: u32, position: DVec2) -> Option<f64> {
        let depth = match self.footprint(class, side, position) {
            Some(four) => four.iter().map(|(pixel, weight)| weight * self.depth(class, side, *pixel)).sum(),
            None => self.depth(class, side, self.clamped(position)),
        };
        (depth > 0.0).then_some(depth)
    }

    /// Normal at a position, with the weights of the depth there.
    pub fn sample_normal(&self, class: u32, side: u32, position: DVec2) -> DVec3 {
        match self.footprint(class, side, position) {
            Some(four) => {
                let sum: DVec3 = four.iter().map(|(pixel, weight)| *weight * self.normal(class, side, *pixel)).sum();
                sum.normalize()
            }
            None => self.normal(class, side, self.clamped(position)),
        }
    }

    /// d - D at t: negative in front of the map's surface, `None` where it has none.
    fn beyond(&self, ray: &Ray, class: u32, side: u32, t: f64) -> Option<f64> {
        let x = ray.at(t);
        self.sample_depth(class, side, self.project(x)).map(|depth| -x.z - depth)
    }

    /// Narrows a bracket by halving: f(a) < 0, and at b f is positive or the map has a hole. The hit is at whichever end
    /// |f| is small at last: at both where the map is continuous, at the lower one where it ends right behind the wall,
    /// at neither where it jumps, and then there is no wall.
    fn bisect(&self, mut a: f64, mut b: f64, f: impl Fn(f64) -> Option<f64>) -> Option<f64> {
        for _ in 0..60 {
            let t = 0.5 * (a + b);
            if f(t).is_none_or(|f| f >= 0.0) { b = t } else { a = t }
        }
        let accepted = f64::from(Tolerance::of(self.frame).accepted);
        [b, a].into_iter().find(|t| f(*t).is_some_and(|f| f.abs() <= accepted))
    }

    /// Where a ray inside a volume leaves it: the first crossing of the wall ahead, which is the back map for a ray
    /// that goes away from the eye and the front map for one that comes back, or of the opposite wall, if that lies
    /// across the ray.
    /// `came_from`: the map off which the ray was just reflected; it starts on that one, not inside of it.
    pub fn find_exit(&self, ray: &Ray, class: u32, came_from: Option<u32>) -> Exit {
        let (ahead, sense) = if ray.dir.z <= 0.0 { (SIDE_BACK, 1.0) } else { (SIDE_FRONT, -1.0) };
        let accepted = f64::from(Tolerance::of(self.frame).accepted);
        let f_ahead = |t| self.beyond(ray, class, ahead, t).map(|f| sense * f);
        let f_opposite = |t| self.beyond(ray, class, 1 - ahead, t).map(|f| -sense * f);
        let hit = |found: Option<f64>, last, side, outcome| match found {
            Some(t) => Exit { outcome, t, side },
            None => Exit { outcome: OUTCOME_HOLE, t: last, side },
        };
        let start = self.project(ray.origin);
        let mut inside = came_from != Some(ahead);
        let mut last = 0.0;
        while let Some(t) = self.step(ray, last) {
            if f_opposite(t).is_some_and(|f| f > accepted) {
                // Where the opposite map has no surface, no wall of it is met.
                let across = self.bisect(last, t, |t| Some(f_opposite(t).unwrap_or(-1.0)));
                return hit(across, last, 1 - ahead, OUTCOME_OPPOSITE_WALL);
            }
            // A hole counts as outside: if the map holds the wall before it, the bracket narrows down to that.
            if f_ahead(t).is_some_and(|f| f < 0.0) {
                inside = true;
            } else if inside {
                return hit(self.bisect(last, t, f_ahead), last, ahead, OUTCOME_HIT);
            } else if self.project(ray.at(t)).distance(start) > 2.0 {
                // Off a wall, and still not inside of it: there is no inside here.
                return Exit { outcome: OUTCOME_HOLE, t: 0.0, side: ahead };
            }
            last = t;
        }
        let outcome = if self.leaves_view(ray, last) { OUTCOME_LEFT_VIEW } else { OUTCOME_HOLE };
        Exit { outcome, t: last, side: ahead }
    }

    /// The nearest front surface of either class that a ray outside meets, from in front to behind: class and t, or
    /// whether the ray left the view before it left the liquid's box.
    pub fn find_entry(&self, ray: &Ray) -> Result<(u32, f64), bool> {
        let front = |class, t| self.beyond(ray, class, SIDE_FRONT, t);
        let mut before = [CLASS_SPLASH, CLASS_BODY].map(|class| front(class, 0.0));
        let mut last = 0.0;
        while let Some(t) = self.step(ray, last) {
            let mut first: Option<(u32, f64)> = None;
            for class in [CLASS_SPLASH, CLASS_BODY] {
                let now = front(class, t);
                let crossed = before[class as usize].is_some_and(|f| f < 0.0) && now.is_some_and(|f| f >= 0.0);
                before[class as usize] = now;
                if crossed {
                    // A map that jumps is passed behind, not entered.
                    let met = self.bisect(last, t, |t| front(class, t));
                    if let Some(at) = met.filter(|at| first.is_none_or(|(_, earlier)| *at < earlier)) {
                        first = Some((class, at));
                    }
                }
            }
            if let Some(met) = first {
                return Ok(met);
            }
            last = t;
        }
        Err(self.leaves_view(ray, last))
    }

    /// t of the next sample of the march.
    fn next(&self, ray: &Ray, t: f64) -> f64 {
        let by_depth = STEP_DEPTH / ray.dir.z.abs().max(1e-12);
        self.next_on_screen(ray, t).min(t + by_depth)
    }

    /// An eighth of a pixel on, or the ray's end.
    pub(super) fn next_on_screen(&self, ray: &Ray, t: f64) -> f64 {
        let d = -ray.at(t).z;
        let lateral = ray.dir.truncate() * -ray.origin.z + ray.origin.truncate() * ray.dir.z;
        // |d pixel / dt| = |a lateral| / d²
        let speed = (lateral * self.frame.pixel_scale.as_dvec2()).length() / (d * d);
        ray.box_end.min(t + STEP_PIXELS / speed.max(1e-12))
    }

    /// The next sample; `None` once the ray has left the view, the near plane or the box.
    fn step(&self, ray: &Ray, t: f64) -> Option<f64> {
        let next = self.next(ray, t);
        (t < ray.box_end && self.in_view(ray.at(next))).then_some(next)
    }

    pub(super) fn in_view(&self, x: DVec3) -> bool {
        let size = self.frame.size.as_dvec2();
        let p = self.project(x);
        -x.z >= f64::from(self.frame.near) && p.cmpge(DVec2::ZERO).all() && p.cmplt(size).all()
    }

    /// Whether what ended a march at t was the border of the view.
    fn leaves_view(&self, ray: &Ray, t: f64) -> bool {
        t < ray.box_end && -ray.at(self.next(ray, t)).z >= f64::from(self.frame.near)
    }
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
    /// A ray, and where it leaves the box around the liquid.
    pub fn new(frame: &Frame, origin: DVec3, dir: DVec3) -> Ray {
        let to_world = Mat3::from_mat4(frame.view).as_dmat3().transpose();
        let o = to_world * (origin - frame.view.w_axis.xyz().as_dvec3());
        let w = to_world * dir;
        let (low, high) = (frame.bounds_min.as_dvec3(), frame.bounds_max.as_dvec3());
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
