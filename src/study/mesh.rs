//! Closed triangle meshes of a liquid's surface.

use glam::{DVec3, Vec3};

/// A mesh; corners of triangles run counter-clockwise as seen from outside the liquid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// World units.
    pub vertices: Vec<DVec3>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
    /// Of each vertex, out of the liquid. Light is bent by what is interpolated of them; without them, and at those that are not
    /// finite (splashsurf smooths a few to nothing), triangles are flat.
    pub normals: Option<Vec<Vec3>>,
}

/// Why no truth can be made of a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the fields are what the messages show")]
pub enum MeshError {
    /// No triangle.
    #[error("the mesh has no triangles: name one that has, or particles to make one of")]
    Empty,
    /// A vertex that is nowhere.
    #[error("vertex {vertex} of the mesh is at {position}: export the mesh again, with finite coordinates")]
    NotFinite { vertex: usize, position: DVec3 },
    /// Another number of normals than of vertices.
    #[error("the mesh has {normals} normals for {vertices} vertices: export one a vertex, or none")]
    NormalCount { normals: usize, vertices: usize },
    /// A corner that is no vertex.
    #[error("triangle {triangle} has a corner {corner}, and there are {vertices} vertices: export the mesh again")]
    Corner { triangle: usize, corner: u32, vertices: usize },
    /// Edges with a triangle on one side only.
    #[error(
        "the mesh is open: {edges} edges have no triangle on one side, the first between vertices {} and {}. Light cannot tell \
         inside from outside: close the mesh, and merge vertices at one place", first[0], first[1]
    )]
    Open { edges: usize, first: [u32; 2] },
    /// Nothing inside it.
    #[error("the mesh has no volume: name one that encloses some")]
    Flat,
    /// Triangles that run the wrong way round.
    #[error("the mesh is inside out (its volume is {volume:e}): turn its triangles round")]
    InsideOut { volume: f64 },
}

impl Mesh {
    /// Its box: smallest and largest corner.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let each = self.vertices.iter().map(|v| (*v, *v));
        each.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default()
    }

    /// Volume within, by the divergence theorem; negative if triangles run the wrong way round.
    pub fn volume(&self) -> f64 {
        let (low, high) = self.bounds();
        let middle = 0.5 * (low + high);
        let cone = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| self.vertices[i as usize] - middle);
            a.dot(b.cross(c)) / 6.0
        };
        self.triangles.iter().map(cone).sum()
    }

    /// The same mesh, moved.
    #[must_use]
    pub fn moved(mut self, by: DVec3) -> Mesh {
        self.vertices.iter_mut().for_each(|v| *v += by);
        self
    }

    /// Checks that rays can tell inside from outside: it is closed and finite, and its triangles run the right way round.
    pub fn check(&self) -> Result<(), MeshError> {
        if self.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        let vertices = self.vertices.len();
        if let Some((vertex, position)) = self.vertices.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(MeshError::NotFinite { vertex, position: *position });
        }
        if let Some(normals) = self.normals.as_ref().map(Vec::len).filter(|n| *n != vertices) {
            return Err(MeshError::NormalCount { normals, vertices });
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(corner) = corners.iter().copied().find(|c| *c as usize >= vertices) {
                return Err(MeshError::Corner { triangle, corner, vertices });
            }
        }
        if let Some((edges, first)) = self.open_edges() {
            return Err(MeshError::Open { edges, first });
        }
        match self.volume() {
            v if v > 0.0 => Ok(()),
            0.0 => Err(MeshError::Flat),
            volume => Err(MeshError::InsideOut { volume }),
        }
    }

    /// How many edges are passed more often one way than the other, and the first of them.
    fn open_edges(&self) -> Option<(usize, [u32; 2])> {
        let mut edges: Vec<(u32, u32, i32)> = Vec::with_capacity(3 * self.triangles.len());
        for [a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                edges.push(if from < to { (*from, *to, 1) } else { (*to, *from, -1) });
            }
        }
        edges.sort_unstable();
        let same = edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
        let mut open = same.filter(|e| e[0].0 != e[0].1 && e.iter().map(|e| e.2).sum::<i32>() != 0);
        let first = open.next()?;
        Some((1 + open.count(), [first[0].0, first[0].1]))
    }

    /// A hash of all it holds, in hexadecimal: the same for the same mesh, wherever it came from.
    pub fn hash(&self) -> String {
        let mut all = blake3::Hasher::new();
        let normals = self.normals.as_deref().unwrap_or_default();
        for length in [self.vertices.len(), self.triangles.len(), normals.len()] {
            all.update(&(length as u64).to_le_bytes());
        }
        let words = self.vertices.iter().flat_map(|v| v.to_array()).map(f64::to_le_bytes);
        all.update(&words.flatten().collect::<Vec<_>>());
        all.update(&self.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect::<Vec<_>>());
        all.update(&normals.iter().flat_map(|n| n.to_array()).flat_map(f32::to_le_bytes).collect::<Vec<_>>());
        all.finalize().to_hex()[..32].to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron of volume 1/6.
    fn tetrahedron() -> Mesh {
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        Mesh { vertices, triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], normals: None }
    }

    #[test]
    fn volumes_are_known() {
        let mesh = tetrahedron().moved(DVec3::splat(7.0));
        assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-14, "{}", mesh.volume());
        assert_eq!(mesh.bounds(), (DVec3::splat(7.0), DVec3::splat(8.0)));
    }

    #[test]
    fn what_rays_could_not_tell_is_refused() {
        let good = tetrahedron();
        assert_eq!(good.check(), Ok(()));
        let said = |change: &dyn Fn(&mut Mesh)| {
            let mut mesh = good.clone();
            change(&mut mesh);
            mesh.check().expect_err("refused")
        };
        assert_eq!(said(&|m| m.triangles.clear()), MeshError::Empty);
        assert!(matches!(said(&|m| m.vertices[2].y = f64::NAN), MeshError::NotFinite { vertex: 2, .. }));
        assert!(matches!(said(&|m| m.normals = Some(vec![])), MeshError::NormalCount { .. }));
        assert!(matches!(said(&|m| m.triangles[1][2] = 4), MeshError::Corner { triangle: 1, corner: 4, .. }));
        assert_eq!(said(&|m| _ = m.triangles.pop()), MeshError::Open { edges: 3, first: [1, 2] });
        assert!(matches!(said(&|m| m.triangles[0].swap(0, 1)), MeshError::Open { edges: 3, .. }));
        assert!(matches!(said(&|m| m.triangles.iter_mut().for_each(|t| t.swap(0, 1))), MeshError::InsideOut { .. }));
        assert_eq!(said(&|m| m.vertices[3] = DVec3::new(0.3, 0.3, 0.0)), MeshError::Flat);
    }

    #[test]
    fn a_hash_is_of_all_there_is() {
        let mesh = tetrahedron();
        let mut others = vec![mesh.clone(); 3];
        others[0].vertices[0].x = 1e-300;
        others[1].triangles[0].rotate_left(1);
        others[2].normals = Some(vec![Vec3::X; 4]);
        assert_eq!(mesh.hash(), tetrahedron().hash());
        assert!(others.iter().all(|o| o.hash() != mesh.hash()));
    }
}
