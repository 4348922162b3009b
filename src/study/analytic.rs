//! Scenes of balls and planes, with exact intersections.

use super::surface::{Hit, Ray, Surface};
use glam::DVec3;

/// A shape's surface; liquid is on the side that normals point away from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Liquid within a sphere.
    Ball {
        /// Its middle.
        center: DVec3,
        /// In world units.
        radius: f64,
    },
    /// A plane, endless.
    Plane {
        /// A point of it.
        point: DVec3,
        /// Out of the liquid; of length 1.
        normal: DVec3,
    },
}

/// Shapes whose insides do not overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct Shapes(pub Vec<Shape>);

impl Shape {
    /// Distance and outward normal where a ray first meets it, after it left it where it starts if it does.
    fn meets(&self, ray: &Ray, leaves: bool) -> Option<(f64, DVec3)> {
        match *self {
            Shape::Ball { center, radius } => {
                let s = ray.origin - center;
                let half = -s.dot(ray.dir);
                let t = if leaves {
                    // On the sphere one root is where the ray starts.
                    2.0 * half
                } else {
                    // From the foot of the perpendicular: squares of long distances would cancel.
                    let reach = radius * radius - (s + half * ray.dir).length_squared();
                    let root = (reach >= 0.0).then(|| reach.sqrt())?;
                    if half - root >= 0.0 { half - root } else { half + root }
                };
                (t >= 0.0 && !(leaves && t == 0.0)).then(|| (t, (ray.at(t) - center).normalize()))
            }
            Shape::Plane { point, normal } => {
                let t = (point - ray.origin).dot(normal) / ray.dir.dot(normal);
                (!leaves && t >= 0.0 && t.is_finite()).then_some((t, normal))
            }
        }
    }
}

impl Surface for Shapes {
    fn hit(&self, ray: &Ray, leaves: Option<u32>) -> Option<Hit> {
        let met = (0..).zip(&self.0).filter_map(|(id, s)| Some((s.meets(ray, leaves == Some(id))?, id)));
        let ((t, normal), id) = met.min_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
        Some(Hit { t, geometric: normal, shading: normal, id })
    }
}

/// The named scenes, about a world unit large: what they are, and their shapes.
pub const SCENES: [(&str, &str); 5] = [
    ("ball", "a ball of radius 1 at the origin"),
    ("slab", "liquid between z = -0.5 and z = 0.5"),
    ("tilted-plane", "liquid below a plane through the origin, 30 degrees from level, without an end"),
    ("ball-before-slab", "a ball of radius 0.6 at z = 1.5 before the slab"),
    ("stack", "five interfaces in a row: two slabs 0.3 thick, from z = 1 and z = 0.4 down, and all below z = -0.2"),
];

/// The shapes of a named scene.
pub fn scene(name: &str) -> Option<Shapes> {
    let plane = |z: f64, up: f64| Shape::Plane { point: DVec3::new(0.0, 0.0, z), normal: DVec3::new(0.0, 0.0, up) };
    let slab = || vec![plane(0.5, 1.0), plane(-0.5, -1.0)];
    Some(Shapes(match name {
        "ball" => vec![Shape::Ball { center: DVec3::ZERO, radius: 1.0 }],
        "slab" => slab(),
        "tilted-plane" => {
            let (sin, cos) = 30f64.to_radians().sin_cos();
            vec![Shape::Plane { point: DVec3::ZERO, normal: DVec3::new(0.0, cos, sin) }]
        }
        "ball-before-slab" => {
            let ball = Shape::Ball { center: DVec3::new(0.0, 0.0, 1.5), radius: 0.6 };
            slab().into_iter().chain([ball]).collect()
        }
        "stack" => [(1.0, 1.0), (0.7, -1.0), (0.4, 1.0), (0.1, -1.0), (-0.2, 1.0)].map(|(z, up)| plane(z, up)).to_vec(),
        _ => return None,
    }))
}
