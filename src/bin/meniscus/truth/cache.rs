//! What is kept from one run to the next: meshes by their hashes, which mesh was made of which particles, films.

use super::Subject;
use crate::{
    outputs::{self, OutputError},
    scene::{Scene, spinner},
    terminal,
};
use meniscus::{
    Equirect,
    io::{Budget, quote},
    prepare::PrepareError,
    study::{
        film::Film,
        isosurface::isosurface,
        mesh::Mesh,
        mesh_file,
        reconstruct::{self, ReconstructError, Reconstruction},
    },
};
use std::{
    fs,
    path::{Path, PathBuf},
};

pub struct Cache {
    place: PathBuf,
}

/// Part of every film's name: another number where the tracer draws other samples.
const TRACER: u32 = 2;
/// Part of every surface's name: another number where another mesh would be made.
const SURFACE: u32 = 1;

#[derive(Debug, thiserror::Error)]
pub enum CacheError {
    #[error(transparent)]
    Reconstruct(#[from] ReconstructError),
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{}: the mesh cannot be packed ({source}); use fewer particles", path.display())]
    Pack { path: PathBuf, source: std::io::Error },
}

impl Cache {
    pub fn open(place: &Path) -> Result<Cache, OutputError> {
        outputs::folder(place)?;
        Ok(Cache { place: place.into() })
    }

    fn mesh_path(&self, hash: &str) -> PathBuf {
        self.place.join(format!("mesh-{hash}.npz"))
    }

    /// The mesh around particles, in the file's coordinates: the one that was made of them before, if it is still there.
    pub fn mesh_of(&self, scene: &Scene, how: Reconstruction) -> Result<Mesh, CacheError> {
        let radius = scene.particles.radius;
        let points = match how {
            Reconstruction::Smoothed(_) => Vec::new(),
            Reconstruction::Isosurface => scene.points()?,
        };
        let mut key = blake3::Hasher::new();
        key.update(&SURFACE.to_le_bytes());
        key.update(bytemuck::cast_slice(&scene.positions));
        key.update(&radius.to_le_bytes());
        match how {
            Reconstruction::Smoothed(passes) => key.update(&passes.to_le_bytes()),
            // Of classes, too, and of how densities are counted.
            Reconstruction::Isosurface => key.update(format!("{how} {:?} {:?}", scene.options, points).as_bytes()),
        };
        scene.origin.to_array().iter().for_each(|v| _ = key.update(&v.to_le_bytes()));
        let note = self.place.join(format!("surface-{}.txt", &key.finalize().to_hex()[..32]));
        if let Some(mesh) = self.noted(&note) {
            return Ok(mesh);
        }
        let bar = spinner("surface of the particles");
        let mesh = match how {
            Reconstruction::Smoothed(passes) => reconstruct::reconstruct(&scene.positions, radius, passes)?,
            Reconstruction::Isosurface => isosurface(&points, radius)?,
        };
        let mesh = mesh.moved(scene.origin);
        bar.finish_and_clear();
        let hash = mesh.hash();
        let path = self.mesh_path(&hash);
        let packed = mesh_file::to_npz(&mesh).map_err(|source| CacheError::Pack { path: path.clone(), source })?;
        outputs::write(&path, &packed)?;
        // Last: what is noted is there.
        outputs::write(&note, hash.as_bytes())?;
        Ok(mesh)
    }

    /// The mesh that a note names, if both are whole.
    fn noted(&self, note: &Path) -> Option<Mesh> {
        let hash = fs::read_to_string(note).ok()?;
        let path = self.mesh_path(hash.trim());
        match mesh_file::read(&path, &Budget::new(u64::MAX)) {
            Ok(mesh) if mesh.hash() == hash.trim() => Some(mesh),
            _ => {
                terminal::complain(format!("note: {} is damaged or gone, and is made anew", quote::path(&path)));
                None
            }
        }
    }

    fn film_path(&self, key: &str) -> PathBuf {
        self.place.join(format!("film-{key}.bin"))
    }

    /// The film of this key as far as it got, if there is one.
    pub fn film(&self, key: &str, size: [u32; 2]) -> Option<Film> {
        let path = self.film_path(key);
        let film = Film::from_bytes(size, &fs::read(&path).ok()?);
        film.map_err(|e| terminal::complain(format!("note: {}: {e}, and is made anew", quote::path(&path)))).ok()
    }

    pub fn keep_film(&self, key: &str, film: &Film) -> Result<(), OutputError> {
        outputs::write(&self.film_path(key), &film.bytes())
    }
}

/// Names a film by all that decides its samples.
pub(super) fn film_key(subject: &Subject, environment: &Equirect, samples: u32) -> String {
    let (camera, liquid) = (&subject.camera, &subject.liquid);
    let mut key = blake3::Hasher::new();
    key.update(&TRACER.to_le_bytes());
    key.update(&(subject.name.len() as u64).to_le_bytes());
    key.update(subject.name.as_bytes());
    let floats = [camera.view.to_cols_array(), camera.projection.to_cols_array()].concat();
    key.update(bytemuck::cast_slice(&floats));
    key.update(bytemuck::cast_slice(&camera.up.to_array()));
    key.update(bytemuck::cast_slice(&[camera.environment_rotation, liquid.ior]));
    key.update(bytemuck::cast_slice(&liquid.absorption.to_array()));
    key.update(bytemuck::cast_slice(&subject.origin.to_array()));
    key.update(bytemuck::cast_slice(&subject.picture.size));
    key.update(bytemuck::cast_slice(&environment.size()));
    key.update(bytemuck::cast_slice(environment.texels()));
    key.update(&samples.to_le_bytes());
    key.finalize().to_hex()[..32].to_owned()
}
