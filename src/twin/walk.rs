//! Twin of `glsl/optics/walk.frag`: the walk of one view ray through up to two volumes of liquid, and the light it brings
//! back (Imai16 §4.4, §4.5, eqs. 6 to 9), total internal reflection followed inside, up to the host's scene.

use super::{
    background::env_color,
    optics::{fresnel, reflect, refract},
    quadric::pixel_ray,
    walls::{Ball, End, Entry, Maps, Ray, Wall},
};
use crate::{
    Equirect, Fresnel,
    optics::walk::Walk as Rays,
    shader::{
        CLASS_BODY, CLASS_SPLASH, OUTCOME_HIT, OUTCOME_LEFT_VIEW, OUTCOME_NO_LIQUID, OUTCOME_NO_WALL,
        OUTCOME_REFLECTION_LIMIT, OUTCOME_SCENE, OUTCOME_SIDE_WALL, PATTERN_NONE, PATTERN_SPLASH,
        PATTERN_SPLASH_SPLASH, SIDE_FRONT, WETTING_FLAT, WETTING_GAP,
    },
};
use glam::{DVec3, Mat3, Vec3};

/// What the walk of one pixel met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk {
    /// One of the `PATTERN_` codes.
    pub pattern: u32,
    /// One of the `OUTCOME_` codes.
    pub outcome: u32,
    /// Walls met.
    pub hits: u32,
    /// Length inside the liquid.
    pub length: f64,
    /// Final direction, world space.
    pub direction: DVec3,
    /// Linear light.
    pub color: Vec3,
}

fn bend(dir: DVec3, against: DVec3, eta: f32) -> Option<DVec3> {
    refract(dir.as_vec3(), against.as_vec3(), eta).map(|bent| bent.as_dvec3().normalize())
}

fn mirror(dir: DVec3, n: DVec3) -> DVec3 {
    reflect(dir.as_vec3(), n.as_vec3()).as_dvec3().normalize()
}

/// In which liquid a ray is.
#[derive(Clone, Copy)]
enum Liquid {
    Body,
    Ball(Ball),
}

impl Liquid {
    fn class(self) -> u32 {
        match self {
            Liquid::Body => CLASS_BODY,
            Liquid::Ball(_) => CLASS_SPLASH,
        }
    }

    /// Where a ray inside meets its wall.
    fn leave(self, maps: &Maps, ray: &Ray) -> Result<Wall, End> {
        match self {
            Liquid::Body => maps.leave_body(ray),
            Liquid::Ball(ball) => Ok(ball.wall(ray, ball.leave(ray))),
        }
    }

    /// The liquid in which a ray goes on that leaves this one at a point.
    fn handed_over(self, maps: &Maps, x: DVec3) -> Option<Liquid> {
        match self {
            Liquid::Body => maps.ball_around(x).map(Liquid::Ball),
            Liquid::Ball(_) => maps.in_body(x).then_some(Liquid::Body),
        }
    }
}

/// A walk under way.
struct Walker<'a> {
    maps: &'a Maps<'a>,
    settings: &'a Rays,
    environment: &'a Equirect,
    x: DVec3,
    dir: DVec3,
    color: Vec3,
    light: Vec3,
    hits: u32,
    length: f64,
    bounces: u32,
    /// Whether one of the walls was a side wall.
    side_wall: bool,
    /// The pixel of the scene's on which it ends.
    on_scene: Option<[usize; 2]>,
}

/// Why a walk goes no further; `None`: it is complete.
type Stopped = Option<u32>;

impl Walker<'_> {
    /// Light F b(reflected) of a wall, of which 1 - F goes on.
    fn split(&mut self, air: f64, water: f64, mirrored: DVec3) {
        let exact = self.settings.fresnel == Fresnel::Exact;
        let reflected = fresnel(air as f32, water as f32, self.maps.frame.ior, exact);
        self.color += self.light * reflected * self.maps.background(self.environment, self.x, mirrored);
        self.light *= 1.0 - reflected;
    }

    /// Enters, eq. (6): F b(r) stays outside, 1 - F goes on along t.
    fn enter(&mut self, normal: DVec3, side_wall: bool) {
        let n = match (self.dir.dot(normal) > 0.0, side_wall) {
            (false, _) => normal,
            (true, false) => -normal,
            (true, true) => -self.dir,
        };
        let bent = bend(self.dir, n, 1.0 / self.maps.frame.ior).expect("there is no critical angle into water");
        self.split(-self.dir.dot(n), -bent.dot(n), mirror(self.dir, n));
        self.dir = bent;
        self.hits += 1;
        self.side_wall |= side_wall;
    }

    /// Meets a wall from inside: whether the ray leaves, or is reflected.
    fn leave(&mut self, normal: DVec3, side_wall: bool) -> bool {
        let n = match (self.dir.dot(normal) < 0.0, side_wall) {
            (false, _) => normal,
            (true, false) => -normal,
            (true, true) => self.dir,
        };
        self.hits += 1;
        self.side_wall |= side_wall;
        let mirrored = mirror(self.dir, n);
        if let Some(bent) = bend(self.dir, -n, self.maps.frame.ior) {
            // Eqs. (7) and (8).
            self.split(bent.dot(n), self.dir.dot(n), mirrored);
            self.dir = bent;
            return true;
        }
        // Beyond the critical angle F = 1: all of it stays inside.
        self.dir = mirrored;
        false
    }

    /// From inside one volume until the ray is outside.
    fn through(&mut self, mut liquid: Liquid) -> Result<(), Stopped> {
        let maps = self.maps;
        loop {
            let ray = Ray::new(maps.frame, self.x, self.dir);
            let found = liquid.leave(maps, &ray);
            let handed = found.ok().and_then(|wall| liquid.handed_over(maps, ray.at(wall.t)));
            let end = found.map_or_else(|end| end.t, |wall| wall.t);
            // Liquid that ends just before the scene touches it.
            let gap = match found {
                Ok(wall) if handed.is_none() => {
                    f64::from(WETTING_GAP) / self.dir.dot(wall.normal).abs().max(f64::from(WETTING_FLAT))
                }
                _ => 0.0,
            };
            let met = maps.meets_scene(&ray.up_to(end + gap));
            let t = met.map_or(end, |(t, _)| t);
            self.x = ray.at(t);
            self.length += t;
            // Eq. (9), for this interval.
            self.light *= (-maps.frame.absorption * t as f32).exp();
            if let Some((_, pixel)) = met {
                self.on_scene = Some(pixel);
                return Err(Some(OUTCOME_SCENE));
            }
            let wall = found.map_err(|end| Some(if end.view { OUTCOME_LEFT_VIEW } else { OUTCOME_NO_WALL }))?;
            if let Some(other) = handed {
                liquid = other;
                continue;
            }
            if self.leave(wall.normal, wall.side_wall) {
                self.x = ray.at(wall.outside);
                return Ok(());
            }
            self.x = ray.at(wall.inside);
            if self.bounces == self.settings.internal_reflections {
                return Err(Some(OUTCOME_REFLECTION_LIMIT));
            }
            self.bounces += 1;
        }
    }

    /// From outside to the next volume, and into it.
    fn next_volume(&mut self) -> Result<Liquid, Stopped> {
        let maps = self.maps;
        let ray = Ray::new(maps.frame, self.x, self.dir);
        let entry = maps.enter(&ray).map_err(|end| end.view.then_some(OUTCOME_LEFT_VIEW))?;
        let (liquid, wall) = match entry {
            Entry::Body(wall) => (Liquid::Body, wall),
            Entry::Ball(ball, t) => (Liquid::Ball(ball), ball.wall(&ray, t)),
        };
        if let Some((_, pixel)) = maps.meets_scene(&ray.up_to(wall.t)) {
            self.on_scene = Some(pixel);
            return Err(Some(OUTCOME_SCENE));
        }
        // What is reflected starts on the wall.
        self.x = ray.at(wall.t);
        self.enter(wall.normal, wall.side_wall);
        self.x = ray.at(wall.inside);
        Ok(liquid)
    }

    /// All volumes; the class of the second, and why no more was met.
    fn volumes(&mut self, first: Liquid) -> (Option<u32>, Stopped) {
        let (mut liquid, mut second) = (first, None);
        for volume in 1..=self.settings.refractions / 2 {
            if let Err(stopped) = self.through(liquid) {
                return (second, stopped);
            }
            if volume < self.settings.refractions / 2 {
                liquid = match self.next_volume() {
                    Ok(next) => next,
                    Err(stopped) => return (second, stopped),
                };
                second = Some(liquid.class());
            }
        }
        (second, None)
    }
}

/// Where the view ray of a pixel gets into the liquid: into which, at which depth, and whether it is bent there. Around the eye
/// is the body if the host says so and there is a body at this pixel, or what has the near plane inside it (negative depth):
/// there the ray starts inside, unbent, at the near plane. Otherwise it is the nearer of the two fronts.
fn first_volume(maps: &Maps, single: bool, pixel: [usize; 2]) -> Option<(Liquid, f64, bool)> {
    let [splash, body] = [CLASS_SPLASH, CLASS_BODY].map(|class| maps.depth(class, SIDE_FRONT, pixel));
    // With one refraction there are no backs, and nothing is searched.
    let no_ball = Ball { center: DVec3::ZERO, radius: 0.0 };
    let ball = if single { (splash != 0.0).then_some(no_ball) } else { maps.ball(pixel) };
    let interval = if single { (body > 0.0).then_some([body; 2]) } else { maps.interval(pixel) };
    let near = f64::from(maps.frame.near);
    let said = maps.frame.eye_inside != 0.0 && (single || interval.is_some());
    if said || body < 0.0 {
        return Some((Liquid::Body, near, false));
    }
    match (ball, interval) {
        (Some(ball), _) if splash < 0.0 => Some((Liquid::Ball(ball), near, false)),
        (Some(ball), interval) if interval.is_none_or(|[front, _]| splash <= front) => {
            Some((Liquid::Ball(ball), splash, true))
        }
        (_, Some([front, _])) => Some((Liquid::Body, front, true)),
        _ => None,
    }
}

/// The same as a surface: its depth, and its outward normal in eye space where the ray does not start inside.
pub(super) fn first_surface(maps: &Maps, single: bool, pixel: [usize; 2]) -> Option<(Option<DVec3>, f64)> {
    let (liquid, depth, bent) = first_volume(maps, single, pixel)?;
    Some((bent.then(|| maps.normal(liquid.class(), SIDE_FRONT, pixel)), depth))
}

/// Walks the view ray of one pixel. Index and absorption are the frame's.
pub fn walk(maps: &Maps, settings: &Rays, environment: &Equirect, pixel: [usize; 2]) -> Walk {
    let frame = maps.frame;
    let to_world = Mat3::from_mat4(frame.view).as_dmat3().transpose();
    let v = pixel_ray(frame, pixel[0] as u32, pixel[1] as u32);
    let dir = v.normalize();
    let single = settings.refractions == 1;
    let scene_depth = maps.scene_depth(pixel);
    let start = first_volume(maps, single, pixel).filter(|(_, depth, _)| *depth <= scene_depth);
    let Some((first, depth, bent)) = start else {
        let (pattern, outcome) = (PATTERN_NONE, OUTCOME_NO_LIQUID);
        let color = match scene_depth.is_finite() {
            true => maps.scene_light(pixel),
            false => env_color(environment, Mat3::from_mat4(frame.eye_to_env).as_dmat3() * dir),
        };
        return Walk { pattern, outcome, hits: 0, length: 0.0, direction: to_world * dir, color };
    };
    let mut walker = Walker {
        maps,
        settings,
        environment,
        x: depth * v,
        dir,
        color: Vec3::ZERO,
        light: Vec3::ONE,
        hits: 0,
        length: 0.0,
        bounces: 0,
        side_wall: false,
        on_scene: None,
    };
    if bent {
        walker.enter(maps.normal(first.class(), SIDE_FRONT, pixel), false);
    }
    let (second, stopped) = if single { (None, None) } else { walker.volumes(first) };
    let Walker { x, dir, color, light, hits, length, side_wall, on_scene, .. } = walker;
    let behind = on_scene.map_or_else(|| maps.background(environment, x, dir), |pixel| maps.scene_light(pixel));
    let first = first.class();
    let pattern = second.map_or(PATTERN_SPLASH + first, |second| PATTERN_SPLASH_SPLASH + 2 * first + second);
    let outcome = stopped.unwrap_or(if side_wall { OUTCOME_SIDE_WALL } else { OUTCOME_HIT });
    Walk { pattern, outcome, hits, length, direction: to_world * dir, color: color + light * behind }
}
