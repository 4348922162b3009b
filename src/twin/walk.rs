//! Twin of `glsl/optics/walk.frag`: the walk of one view ray through up to two volumes of liquid, and the light it brings
//! back (Imai16 §4.4, §4.5, eqs. 6 to 9), total internal reflection followed inside, up to the host's scene.

use super::{
    background::env_color,
    optics::{fresnel, reflect, refract},
    quadric::pixel_ray,
    search::{Maps, Ray},
};
use crate::{
    Equirect, Fresnel,
    optics::walk::Walk as Rays,
    shader::{
        CLASS_BODY, CLASS_SPLASH, OUTCOME_HIT, OUTCOME_LEFT_VIEW, OUTCOME_NO_LIQUID, OUTCOME_OPPOSITE_WALL,
        OUTCOME_REFLECTION_LIMIT, OUTCOME_SCENE, PATTERN_NONE, PATTERN_SPLASH, PATTERN_SPLASH_SPLASH, SIDE_BACK,
        SIDE_FRONT, WETTING_FLAT, WETTING_GAP,
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
    /// Surfaces met.
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

/// Walks the view ray of one pixel. Index and absorption are the frame's.
pub fn walk(maps: &Maps, settings: &Rays, environment: &Equirect, pixel: [usize; 2]) -> Walk {
    let frame = maps.frame;
    let to_world = Mat3::from_mat4(frame.view).as_dmat3().transpose();
    let background = |x: DVec3, dir: DVec3| maps.background(environment, x, dir);
    let ior = frame.ior;
    let exact = settings.fresnel == Fresnel::Exact;
    let v = pixel_ray(frame, pixel[0] as u32, pixel[1] as u32);
    let mut dir = v.normalize();

    let splash = maps.depth(CLASS_SPLASH, SIDE_FRONT, pixel);
    let body = maps.depth(CLASS_BODY, SIDE_FRONT, pixel);
    // Around the eye: the body if the host says so and there is a body at this pixel, or a particle across the near
    // plane (negative depth). The ray then starts inside, unbent, at the near plane.
    let single = settings.refractions == 1;
    let said = frame.eye_inside != 0.0 && (single || maps.depth(CLASS_BODY, SIDE_BACK, pixel) > 0.0);
    let around = match (said || body < 0.0, splash < 0.0) {
        (true, _) => Some(CLASS_BODY),
        (false, true) => Some(CLASS_SPLASH),
        _ => None,
    };
    // Step 1: the nearer of the two fronts.
    let start = match around {
        Some(class) => Some((class, f64::from(frame.near))),
        None if splash > 0.0 && (body <= 0.0 || splash <= body) => Some((CLASS_SPLASH, splash)),
        None if body > 0.0 => Some((CLASS_BODY, body)),
        None => None,
    };
    let scene_depth = maps.scene_depth(pixel);
    let Some((first, depth)) = start.filter(|(_, depth)| *depth <= scene_depth) else {
        let (pattern, outcome) = (PATTERN_NONE, OUTCOME_NO_LIQUID);
        let color = match scene_depth.is_finite() {
            true => maps.scene_light(pixel),
            false => env_color(environment, Mat3::from_mat4(frame.eye_to_env).as_dmat3() * dir),
        };
        return Walk { pattern, outcome, hits: 0, length: 0.0, direction: to_world * dir, color };
    };

    let (mut x, mut class, mut second) = (depth * v, first, None);
    let (mut color, mut light) = (Vec3::ZERO, Vec3::ONE);
    let (mut hits, mut length, mut bounces, mut opposite_wall) = (0, 0.0, 0, false);
    let (mut outcome, mut on_scene) = (OUTCOME_HIT, None);
    let volumes = if single { 1 } else { settings.refractions / 2 };
    'walk: for volume in 0..volumes {
        if volume > 0 || around.is_none() {
            // Enter, eq. (6): F b(r) stays outside, 1 - F goes on along t.
            let n = match volume {
                0 => maps.normal(class, SIDE_FRONT, pixel),
                _ => maps.sample_normal(class, SIDE_FRONT, maps.project(x)),
            };
            let n = if dir.dot(n) > 0.0 { -n } else { n };
            let bent = bend(dir, n, 1.0 / ior).expect("there is no critical angle into water");
            let reflected = fresnel(-dir.dot(n) as f32, -bent.dot(n) as f32, ior, exact);
            color += light * reflected * background(x, mirror(dir, n));
            light *= 1.0 - reflected;
            dir = bent;
            hits += 1;
        }
        if single {
            break;
        }
        let mut came_from = None;
        loop {
            let ray = Ray::new(frame, x, dir);
            let exit = maps.find_exit(&ray, class, came_from);
            let found = [OUTCOME_HIT, OUTCOME_OPPOSITE_WALL].contains(&exit.outcome);
            // Liquid that ends just before the scene touches it.
            let gap = match found {
                true => {
                    let n = maps.sample_normal(class, exit.side, maps.project(ray.at(exit.t)));
                    f64::from(WETTING_GAP) / dir.dot(n).abs().max(f64::from(WETTING_FLAT))
                }
                false => 0.0,
            };
            let met = maps.meets_scene(&ray.up_to(exit.t + gap));
            let t = met.map_or(exit.t, |(t, _)| t);
            x += t * dir;
            length += t;
            // Eq. (9), for this interval.
            light *= (-frame.absorption * t as f32).exp();
            if let Some((_, pixel)) = met {
                on_scene = Some(pixel);
                break 'walk;
            }
            match exit.outcome {
                OUTCOME_HIT => {}
                OUTCOME_OPPOSITE_WALL => opposite_wall = true,
                ended => {
                    outcome = ended;
                    break 'walk;
                }
            }
            hits += 1;
            let n = maps.sample_normal(class, exit.side, maps.project(x));
            let n = if dir.dot(n) < 0.0 { -n } else { n };
            let mirrored = mirror(dir, n);
            if let Some(bent) = bend(dir, -n, ior) {
                // Leave, eqs. (7) and (8).
                let reflected = fresnel(bent.dot(n) as f32, dir.dot(n) as f32, ior, exact);
                color += light * reflected * background(x, mirrored);
                light *= 1.0 - reflected;
                dir = bent;
                break;
            }
            // Beyond the critical angle F = 1: all of it stays inside.
            dir = mirrored;
            came_from = Some(exit.side);
            if bounces == settings.internal_reflections {
                outcome = OUTCOME_REFLECTION_LIMIT;
                break 'walk;
            }
            bounces += 1;
        }
        if volume + 1 == volumes {
            break;
        }
        match maps.find_entry(&Ray::new(frame, x, dir)) {
            Ok((met, t)) => {
                if let Some((_, pixel)) = maps.meets_scene(&Ray::new(frame, x, dir).up_to(t)) {
                    on_scene = Some(pixel);
                    break;
                }
                x += t * dir;
                class = met;
                second = Some(met);
            }
            Err(left_view) => {
                if left_view {
                    outcome = OUTCOME_LEFT_VIEW;
                }
                break;
            }
        }
    }
    color += light * on_scene.map_or_else(|| background(x, dir), |pixel| maps.scene_light(pixel));
    if on_scene.is_some() {
        outcome = OUTCOME_SCENE;
    }
    let pattern = second.map_or(PATTERN_SPLASH + first, |second| PATTERN_SPLASH_SPLASH + 2 * first + second);
    let outcome = if outcome == OUTCOME_HIT && opposite_wall { OUTCOME_OPPOSITE_WALL } else { outcome };
    Walk { pattern, outcome, hits, length, direction: to_world * dir, color }
}
