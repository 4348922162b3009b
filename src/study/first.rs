//! What is met at pixel centres: the surface's maps, and the walk that `render` goes, exactly.

use super::{
    surface::Ray,
    tracer::{ROULETTE, Tracer, interface},
};
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// At one pixel's centre.
#[derive(Clone, Copy, Debug)]
pub struct First {
    /// Depth along the view axis of the first interface, in world units; NaN where there is none.
    pub depth: f32,
    /// World normal there that light is bent by, out of the liquid.
    pub normal: Vec3,
    /// World direction in which light leaves that is refracted wherever it can be, and reflected only beyond the critical angle.
    pub final_direction: Vec3,
    /// Length of that path inside the liquid, in world units.
    pub path_length: f32,
    /// Interfaces of that path; it ends after [`ROULETTE`] of them.
    pub hits: u32,
}

/// Row by row.
pub fn maps(tracer: &Tracer) -> Vec<First> {
    maps_at(tracer, DVec2::splat(0.5))
}

/// The same at another place within each pixel, from its upper left corner.
pub fn maps_at(tracer: &Tracer, within: DVec2) -> Vec<First> {
    let [width, height] = tracer.view.size;
    let corner = |i: u64| DVec2::new((i % u64::from(width)) as f64, (i / u64::from(width)) as f64);
    (0..u64::from(width) * u64::from(height)).into_par_iter().map(|i| first(tracer, corner(i) + within)).collect()
}

fn first(tracer: &Tracer, point: DVec2) -> First {
    let mut ray = tracer.view.ray(point);
    let nothing = Vec3::NAN;
    let mut seen =
        First { depth: f32::NAN, normal: nothing, final_direction: ray.dir.as_vec3(), path_length: 0.0, hits: 0 };
    let (mut leaves, mut inside) = (None, 0.0);
    while seen.hits < ROULETTE {
        let Some(hit) = tracer.surface.hit(&ray, leaves) else { break };
        let origin: DVec3 = ray.at(hit.t);
        if seen.hits == 0 {
            (seen.depth, seen.normal) = (tracer.view.depth(origin) as f32, hit.shading.as_vec3());
        }
        if ray.dir.dot(hit.geometric) > 0.0 {
            inside += hit.t;
        }
        let at = interface(ray.dir, hit.shading, tracer.ior());
        ray = Ray { origin, dir: at.refracted.unwrap_or(at.reflected) };
        leaves = Some(hit.id);
        seen.hits += 1;
    }
    First { final_direction: ray.dir.as_vec3(), path_length: inside as f32, ..seen }
}
