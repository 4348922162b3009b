//! The surface of particles, by splashsurf (Löschner et al. 2023, *Weighted Laplacian Smoothing for Surface Reconstruction of
//! Particle-based Fluids*): marching cubes of the particles' density, cleaned up, and smoothed where particles have many
//! neighbours. It is not deterministic: a mesh is made once, and named by its hash.

use super::mesh::Mesh;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use splashsurf_lib::{
    Parameters, nalgebra::Vector3, postprocessing as post, reconstruct_surface, sph_interpolation::SphInterpolator,
};
use std::{fmt, str::FromStr};

/// How far a particle's kernel reaches, in units of twice its radius.
pub const SMOOTHING_LENGTH: f32 = 2.0;
/// Edge of marching cubes in particle radii.
pub const CUBE_SIZE: f32 = 0.5;
/// Density at the surface over that at rest.
pub const THRESHOLD: f32 = 0.6;
/// Passes of smoothing of the mesh.
pub const SMOOTHING_PASSES: u32 = 25;
/// Passes of smoothing of its normals.
pub const NORMAL_PASSES: usize = 10;
/// Rounds of clean-up at most.
const CLEANUP_ROUNDS: usize = 5;
/// The weighted number of neighbours from which a vertex is smoothed in full.
const NEIGHBOURS: f32 = 13.0;
/// Particles' rest density; it cancels.
const REST_DENSITY: f32 = 1000.0;

/// Why particles have no surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReconstructError {
    /// Nothing to make a surface of.
    #[error("there are no particles to make a surface of: name a file that has some, or a mesh (--mesh)")]
    NoParticles,
    /// The reconstruction gave up.
    #[error("splashsurf cannot make a surface of these particles ({0}): check --radius, or name a mesh (--mesh)")]
    Failed(String),
    /// Particles so thin that no surface is anywhere.
    #[error("no surface: the density is below {THRESHOLD} of a filled body's everywhere. Use a larger --radius")]
    NoSurface,
}

/// How a surface is made of particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reconstruction {
    /// By splashsurf, smoothed so many times.
    Smoothed(u32),
    /// Marching cubes of our own density field ([`super::isosurface`]).
    Isosurface,
}

/// The word for it.
const ISOSURFACE: &str = "isosurface";

impl FromStr for Reconstruction {
    type Err = String;

    fn from_str(text: &str) -> Result<Reconstruction, String> {
        let passes = || text.parse().ok().filter(|n| *n <= 1000).map(Reconstruction::Smoothed);
        let known = if text == ISOSURFACE { Some(Reconstruction::Isosurface) } else { passes() };
        known.ok_or_else(|| format!("use smoothing passes, 0 to 1000, or {ISOSURFACE}"))
    }
}

impl fmt::Display for Reconstruction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reconstruction::Smoothed(passes) => write!(f, "{passes} smoothing passes"),
            Reconstruction::Isosurface => write!(f, "our field's isosurface"),
        }
    }
}

/// A mesh around particles; positions and radius in world units, `passes` of smoothing.
pub fn reconstruct(positions: &[Vec3], radius: f32, passes: u32) -> Result<Mesh, ReconstructError> {
    if positions.is_empty() {
        return Err(ReconstructError::NoParticles);
    }
    let failed = |e: &dyn std::fmt::Display| ReconstructError::Failed(e.to_string());
    // In particle radii, so that any scale gives the same mesh.
    let positions: Vec<_> = positions.iter().map(|p| Vector3::from((*p / radius).to_array())).collect();
    let mut parameters = Parameters::new(1.0, 2.0 * SMOOTHING_LENGTH, CUBE_SIZE);
    parameters.iso_surface_threshold = THRESHOLD;
    parameters.rest_density = REST_DENSITY;
    parameters.global_neighborhood_list = true;
    let made = reconstruct_surface::<i64, f32>(&positions, &parameters).map_err(|e| failed(&e))?;
    let (grid, mut mesh) = (made.grid, made.mesh);
    let densities = made.particle_densities.ok_or_else(|| failed(&"no densities"))?;
    let neighbours = made.particle_neighbors.ok_or_else(|| failed(&"no neighbours"))?;
    if mesh.triangles.is_empty() {
        return Err(ReconstructError::NoSurface);
    }
    let connected = post::marching_cubes_cleanup(&mut mesh, &grid, None, CLEANUP_ROUNDS, false);
    let support = parameters.compact_support_radius;
    let counts: Vec<f32> = neighbours
        .par_iter()
        .enumerate()
        .map(|(i, all)| {
            all.iter()
                .map(|j| 1.0 - ((positions[i] - positions[*j]).norm_squared() / (support * support)).clamp(0.0, 1.0))
                .sum()
        })
        .collect();
    let mass = 4.0 / 3.0 * std::f32::consts::PI * REST_DENSITY;
    let interpolator = SphInterpolator::new(&positions, &densities, mass, support);
    let weights: Vec<f32> = interpolator
        .interpolate_scalar_quantity(&counts, &mesh.vertices, true)
        .into_iter()
        .map(|n| {
            let x = (n / NEIGHBOURS).clamp(0.0, 1.0);
            x * x * x * (x * (6.0 * x - 15.0) + 10.0)
        })
        .collect();
    post::par_laplacian_smoothing_inplace(&mut mesh, &connected, passes as usize, 1.0, &weights);
    let mut normals: Vec<_> = mesh.par_vertex_normals().into_iter().map(|n| n.into_inner()).collect();
    post::par_laplacian_smoothing_normals_inplace(&mut normals, &connected, NORMAL_PASSES);
    Ok(Mesh {
        vertices: mesh
            .vertices
            .iter()
            .map(|v| DVec3::new(v.x.into(), v.y.into(), v.z.into()) * f64::from(radius))
            .collect(),
        triangles: mesh.triangles.iter().map(|t| t.map(|i| i as u32)).collect(),
        normals: Some(normals.iter().map(|n| Vec3::new(n.x, n.y, n.z)).collect()),
    })
}
