//! What a method's optics make of the truth's own surface: how far a picture is off for its model of light alone.
//!
//! Optics that follow rays follow them to exact intersections, with as many refractions and reflections as they know, and what they
//! reflect sees nothing but the environment. Look-ups get the truth's depths, normals and thicknesses at each sample.

use super::{
    surface::Ray,
    tracer::{Tracer, interface},
};
use crate::{
    Camera, Fresnel, Settings,
    inspect::{self, Lookup, Walk, lookup},
    optics::Optics,
    shader::Frame,
    space::Space,
    twin::{background::env_color, normal::encode_normal, optics::fresnel},
};
use glam::{DVec2, DVec3, Mat3, Vec3};
use rayon::prelude::*;

/// Samples of a pixel each way that its area takes; with an odd number one of them is its centre's.
pub const EACH_WAY: u32 = 3;

/// Interfaces that any walk may meet; no optics follow so many.
const MOST: u32 = 256;

/// The picture, row by row, with so many samples of each pixel each way; nothing of optics that ask for more than a surface.
pub fn picture(tracer: &Tracer, camera: &Camera, settings: &Settings, radius: f32, each_way: u32) -> Option<Vec<Vec3>> {
    let size = tracer.view.size.map(|n| each_way * n);
    let [width, height] = size;
    let point = |i: u32| DVec2::new(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5) / f64::from(each_way);
    let optics = &settings.method.optics;
    let samples: Vec<Vec3> = match (Walk::of(optics), Lookup::of(optics)) {
        (Some(rays), _) => {
            let light = |i| walk(tracer, &rays, tracer.view.ray(point(i))).as_vec3();
            (0..width * height).into_par_iter().map(light).collect()
        }
        (None, Some(lookup)) if !wants_speeds(optics) => {
            let seen = |i| front(tracer, camera, tracer.view.ray(point(i)), radius);
            // Of the space only its unit counts.
            let (space, box_of_none) = (Space::new(radius, Vec3::ZERO), (Vec3::ZERO, Vec3::ZERO));
            let fronts: Vec<Front> = (0..width * height).into_par_iter().map(seen).collect();
            looked_up(
                tracer,
                settings,
                &lookup,
                &inspect::uniforms(camera, settings, size, &space, box_of_none),
                &fronts,
            )
        }
        _ => return None,
    };
    let each = |i: u32| {
        let (x, y) = (i % tracer.view.size[0], i / tracer.view.size[0]);
        let rows = (0..each_way).map(|dy| ((each_way * y + dy) * width + each_way * x) as usize);
        let sum: Vec3 = rows.flat_map(|first| &samples[first..][..each_way as usize]).sum();
        sum / (each_way * each_way) as f32
    };
    Some((0..tracer.view.size[0] * tracer.view.size[1]).map(each).collect())
}

fn wants_speeds(optics: &Optics) -> bool {
    matches!(optics, Optics::InstantLiquids(p) if p.spray > 0.0)
}

/// Light that the optics find along a ray (Imai16 eqs. 6 to 9): refracted wherever it can be, what is reflected outwards taken from the
/// environment, and beyond the critical angle followed inside.
fn walk(tracer: &Tracer, rays: &Walk, mut ray: Ray) -> DVec3 {
    let ior = tracer.ior();
    let sky = |dir| tracer.view.environment(dir);
    let (mut color, mut light) = (DVec3::ZERO, DVec3::ONE);
    let (mut volumes, mut bounces, mut leaves) = (0, 0, None);
    let most = (rays.refractions / 2).max(1);
    for met in 0..MOST {
        let Some(hit) = tracer.surface.hit(&ray, leaves) else { break };
        let inside = ray.dir.dot(hit.geometric) > 0.0;
        if inside && met == 0 {
            // The eye is in the liquid, where one refraction is none.
            volumes = 1;
            if rays.refractions == 1 {
                break;
            }
        }
        if inside {
            light *= tracer.transmitted(hit.t);
        }
        let normal = if (ray.dir.dot(hit.shading) > 0.0) == inside { hit.shading } else { -hit.shading };
        let (origin, at) = (ray.at(hit.t), interface(ray.dir, normal, ior));
        leaves = Some(hit.id);
        let Some(bent) = at.refracted else {
            ray = Ray { origin, dir: at.reflected };
            if bounces == rays.internal_reflections {
                break;
            }
            bounces += 1;
            continue;
        };
        let cosines = [ray.dir, bent].map(|dir| dir.dot(normal).abs() as f32);
        let [air, water] = if inside { [cosines[1], cosines[0]] } else { cosines };
        let reflected = f64::from(fresnel(air, water, ior as f32, rays.fresnel == Fresnel::Exact));
        color += light * reflected * sky(at.reflected);
        light *= 1.0 - reflected;
        ray = Ray { origin, dir: bent };
        volumes += u32::from(!inside);
        if rays.refractions == 1 || volumes > most || inside && volumes == most {
            break;
        }
    }
    color + light * sky(ray.dir)
}

/// What a look-up knows of a sample: depth and thickness in particle radii, and a packed normal.
type Front = (f32, u32, f32);

/// Along a ray that goes straight on.
fn front(tracer: &Tracer, camera: &Camera, ray: Ray, radius: f32) -> Front {
    let (mut at, mut leaves, mut inside, mut first) = (ray, None, 0.0, None);
    for _ in 0..MOST {
        let Some(hit) = tracer.surface.hit(&at, leaves) else { break };
        at.origin = at.at(hit.t);
        leaves = Some(hit.id);
        let within = ray.dir.dot(hit.geometric) > 0.0;
        if within {
            inside += hit.t;
        }
        first.get_or_insert_with(|| {
            let normal = Mat3::from_mat4(camera.view) * hit.shading.as_vec3();
            // From within there is no surface to bend at: the near plane lies in the liquid.
            let depth = if within { -f64::from(camera.near) } else { tracer.view.depth(at.origin) };
            ((depth / f64::from(radius)) as f32, encode_normal(normal.normalize()))
        });
    }
    let (depth, normal) = first.unwrap_or((0.0, 0));
    (depth, normal, (inside / f64::from(radius)) as f32)
}

fn looked_up(tracer: &Tracer, settings: &Settings, p: &Lookup, frame: &Frame, fronts: &[Front]) -> Vec<Vec3> {
    let depth: Vec<f32> = fronts.iter().map(|f| f.0).collect();
    let normal: Vec<u32> = fronts.iter().map(|f| f.1).collect();
    // Optics that do not ask for thickness absorb nothing.
    let thick = settings.method.optics.member().asks().thickness;
    let thickness: Vec<f32> = if thick { fronts.iter().map(|f| f.2).collect() } else { Vec::new() };
    let environment = |dir| env_color(tracer.view.map, dir);
    let input = lookup::Input {
        frame,
        depth: &depth,
        normal: &normal,
        thickness: &thickness,
        scene: None,
        environment: &environment,
    };
    let width = frame.size.x as usize;
    let seen = |i: usize| input.look_up(p, [i % width, i / width]).color.unwrap_or_default();
    (0..fronts.len()).into_par_iter().map(seen).collect()
}
