//! Surfaces between liquid and air that rays can meet.

use super::mesh::Mesh;
use glam::{DVec3, Vec3A};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    cwbvh::{CwBvh, builder::build_cwbvh},
    ray::{Ray as BoxRay, RayHit},
};
use std::{collections::HashSet, time::Duration};

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
    corners: [DVec3; 3],
    normal: DVec3,
    /// At the corners.
    normals: Option<[DVec3; 3]>,
}

/// Half the largest edge of the mesh's box, in the space of the boxes.
const REACH: f64 = 512.0;
/// How much wider boxes are on each side, in that space: 32 units in the last place of single precision at [`REACH`], and
/// twenty times the distance along a ray up to which the hierarchy passes over boxes.
const MARGIN: f32 = 2e-3;

/// A ray as triangles are met by it: seen along it, from where it starts (Woop et al. 2013, *Watertight Ray/Triangle Intersection*).
struct Sight {
    origin: DVec3,
    /// The other axes, and the one that the ray runs along most.
    axes: [usize; 3],
    /// How far it goes along the other axes for each unit along that one.
    shear: [f64; 2],
    /// Its length for each unit along that one.
    stretch: f64,
}

impl Sight {
    fn new(ray: &Ray) -> Sight {
        let most = ray.dir.abs().max_position();
        let axes = [(most + 1) % 3, (most + 2) % 3, most];
        let [x, y, z] = axes.map(|axis| ray.dir[axis]);
        Sight { origin: ray.origin, axes, shear: [x / z, y / z], stretch: 1.0 / z }
    }

    /// How far beside the ray a point lies on either side, and how far along it.
    fn of(&self, point: DVec3) -> [f64; 3] {
        let [x, y, z] = self.axes.map(|axis| point[axis] - self.origin[axis]);
        [x - self.shear[0] * z, y - self.shear[1] * z, self.stretch * z]
    }
}

impl Triangle {
    /// The same for the same triangle, whichever corner comes first.
    fn place(&self) -> [[u64; 3]; 3] {
        let mut corners = self.corners.map(|c| c.to_array().map(f64::to_bits));
        let least = (0..3).min_by_key(|i| corners[*i]).unwrap_or(0);
        corners.rotate_left(least);
        corners
    }

    /// Distance along a ray, and the weights of the second and third corner. Two triangles round the same about the edge that they
    /// share, so that no ray gets through between them.
    fn meets(&self, sight: &Sight) -> Option<(f64, f64, f64)> {
        let [a, b, c] = self.corners.map(|corner| sight.of(corner));
        let weights = [c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]];
        if weights.iter().any(|w| *w < 0.0) && weights.iter().any(|w| *w > 0.0) {
            return None;
        }
        // A ray within the triangle's plane sees it as a line: it has no weights, and is not met.
        let [u, v, w] = weights.map(|w| w / weights.iter().sum::<f64>());
        let t = u * a[2] + v * b[2] + w * c[2];
        (t >= 0.0 && t.is_finite()).then_some((t, v, w))
    }
}

impl MeshSurface {
    /// From a mesh that [`Mesh::check`] accepts. Triangles without area are left out: no ray meets them. So is what is there again:
    /// boxes at one place make the hierarchy as deep as there are many, and it goes no deeper than 32.
    pub fn new(mesh: &Mesh) -> MeshSurface {
        let (low, high) = mesh.bounds();
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let scale = REACH / half.max_element();
        let mut known = HashSet::with_capacity(mesh.triangles.len());
        let all = mesh.triangles.iter().filter_map(|t| triangle(mesh, *t));
        let mut triangles: Vec<Triangle> = all.filter(|t| known.insert(t.place())).collect();
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|t| {
                let corners = t.corners.map(|c| Vec3A::from(((c - middle) * scale).as_vec3()));
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
    let normals = mesh.normals.as_ref().map(|n| corners.map(|i| n[i as usize].as_dvec3()));
    let corners = corners.map(|i| mesh.vertices[i as usize]);
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a).try_normalize()?;
    Some(Triangle { corners, normal, normals })
}

impl Surface for MeshSurface {
    fn hit(&self, ray: &Ray, leaves: Option<u32>) -> Option<Hit> {
        // Far from the mesh single precision would be too coarse: rays start where they come into its box.
        let entry = self.entry(ray);
        let origin = (ray.at(entry) - self.middle) * self.scale;
        // The hierarchy takes -0 for a way up whose inverse points down, and would find no box there.
        let dir = Vec3A::from(ray.dir.as_vec3()) + Vec3A::ZERO;
        let boxes = BoxRay::new_inf(Vec3A::from(origin.as_vec3()), dir);
        let sight = Sight::new(ray);
        let mut nearest: Option<(f64, f64, f64, u32)> = None;
        self.bvh.ray_traverse(boxes, &mut RayHit::none(), |_, slot| {
            let id = slot as u32;
            if leaves == Some(id) {
                return f32::INFINITY;
            }
            if let Some((t, u, v)) =
                self.triangles[slot].meets(&sight).filter(|(t, ..)| nearest.is_none_or(|n| *t < n.0))
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
