//! Surfaces between liquid and air that rays can meet.

use super::mesh::Mesh;
use glam::{DVec3, Vec3A};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    cwbvh::{CwBvh, builder::build_cwbvh},
    ray::{Ray as BoxRay, RayHit},
};
use std::time::Duration;

/// A half-line.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Where it goes; of length 1.
    pub dir: DVec3,
}

impl Ray {
    /// The point at a distance from its start.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.dir
    }
}

/// Where a ray meets the surface.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance from the ray's start, at least 0.
    pub t: f64,
    /// Normal of the surface itself, out of the liquid; of length 1.
    pub geometric: DVec3,
    /// Normal that light is bent by, of length 1: interpolated where a mesh has normals at its vertices.
    pub shading: DVec3,
    /// Which triangle or shape it is.
    pub id: u32,
}

/// What rays can meet.
pub trait Surface: Sync {
    /// The nearest hit of a ray. A ray that starts on the surface names the triangle or shape that it leaves: no triangle or
    /// plane is met twice in a row, and no distance has to be chosen within which hits are passed over.
    fn hit(&self, ray: &Ray, leaves: Option<u32>) -> Option<Hit>;
}

/// A mesh whose triangles are found by a bounding volume hierarchy of boxes in single precision. Triangles are met in double
/// precision; boxes are wider than they are by more than single precision rounds.
pub struct MeshSurface {
    bvh: CwBvh,
    /// In the order of the hierarchy.
    triangles: Vec<Triangle>,
    /// World to the space of the boxes: the mesh's own box has its middle at 0 and reaches to [`REACH`].
    middle: DVec3,
    scale: f64,
    /// Half the mesh's box, in world units.
    half: DVec3,
}

struct Triangle {
    corner: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
    /// At the corners.
    normals: Option<[DVec3; 3]>,
}

/// Half the largest edge of the mesh's box, in the space of the boxes.
const REACH: f64 = 512.0;
/// How much wider boxes are on each side, in that space: 32 units in the last place of single precision at [`REACH`], and
/// twenty times the distance along a ray up to which the hierarchy passes over boxes.
const MARGIN: f32 = 2e-3;

impl Triangle {
    /// Distance along a ray, and the weights of the second and third corner (Möller and Trumbore 1997).
    fn meets(&self, ray: &Ray) -> Option<(f64, f64, f64)> {
        let [a, b] = self.edges;
        let p = ray.dir.cross(b);
        let det = a.dot(p);
        let s = ray.origin - self.corner;
        let q = s.cross(a);
        let (u, v, t) = (s.dot(p) / det, ray.dir.dot(q) / det, b.dot(q) / det);
        // A ray within the triangle's plane gives infinities or no numbers, and meets nothing.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 && t.is_finite()).then_some((t, u, v))
    }
}

impl MeshSurface {
    /// From a mesh that [`Mesh::check`] accepts. Triangles without area are left out: no ray meets them.
    pub fn new(mesh: &Mesh) -> MeshSurface {
        let (low, high) = mesh.bounds();
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let scale = REACH / half.max_element();
        let mut triangles: Vec<Triangle> = mesh.triangles.iter().filter_map(|t| triangle(mesh, *t)).collect();
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|t| {
                let corners = [t.corner, t.corner + t.edges[0], t.corner + t.edges[1]];
                let corners = corners.map(|c| Vec3A::from(((c - middle) * scale).as_vec3()));
                let tight = Aabb::from_points(&corners);
                Aabb::new(tight.min - MARGIN, tight.max + MARGIN)
            })
            .collect();
        let bvh = build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let mut slots: Vec<_> = triangles.drain(..).map(Some).collect();
        triangles.extend(bvh.primitive_indices.iter().filter_map(|i| slots[*i as usize].take()));
        MeshSurface { bvh, triangles, middle, scale, half }
    }

    /// Where a ray comes into the mesh's box, a little widened; 0 if it starts there.
    fn entry(&self, ray: &Ray) -> f64 {
        let reach = self.half + DVec3::splat(0.01 * self.half.max_element());
        let near = (-reach * ray.dir.signum() - (ray.origin - self.middle)) / ray.dir;
        // Along a zero of the direction this is infinite or no number, and tells nothing.
        near.to_array().into_iter().filter(|t| t.is_finite()).fold(0.0, f64::max)
    }
}

fn triangle(mesh: &Mesh, corners: [u32; 3]) -> Option<Triangle> {
    let [a, b, c] = corners.map(|i| mesh.vertices[i as usize]);
    let edges = [b - a, c - a];
    let normal = edges[0].cross(edges[1]).try_normalize()?;
    let normals = mesh.normals.as_ref().map(|n| corners.map(|i| n[i as usize].as_dvec3()));
    Some(Triangle { corner: a, edges, normal, normals })
}

impl Surface for MeshSurface {
    fn hit(&self, ray: &Ray, leaves: Option<u32>) -> Option<Hit> {
        // Far from the mesh single precision would be too coarse: rays start where they come into its box.
        let entry = self.entry(ray);
        let origin = (ray.at(entry) - self.middle) * self.scale;
        let boxes = BoxRay::new_inf(Vec3A::from(origin.as_vec3()), Vec3A::from(ray.dir.as_vec3()));
        let mut nearest: Option<(f64, f64, f64, u32)> = None;
        self.bvh.ray_traverse(boxes, &mut RayHit::none(), |_, slot| {
            let id = slot as u32;
            if leaves == Some(id) {
                return f32::INFINITY;
            }
            if let Some((t, u, v)) = self.triangles[slot].meets(ray).filter(|(t, ..)| nearest.is_none_or(|n| *t < n.0))
            {
                nearest = Some((t, u, v, id));
                // Boxes that begin within the margin behind this hit are still looked into.
                return ((t - entry) * self.scale) as f32 + MARGIN;
            }
            f32::INFINITY
        });
        let (t, u, v, id) = nearest?;
        let triangle = &self.triangles[id as usize];
        let shading = triangle.normals.and_then(|[a, b, c]| ((1.0 - u - v) * a + u * b + v * c).try_normalize());
        Some(Hit { t, geometric: triangle.normal, shading: shading.unwrap_or(triangle.normal), id })
    }
}
