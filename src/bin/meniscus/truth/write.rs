//! What `meniscus truth` leaves behind.

use super::Subject;
use crate::{dump::npy, outputs};
use glam::DVec3;
use meniscus::{
    io::images,
    study::{film::Film, first::First, measures},
};
use serde_json::Value;
use std::{error::Error, path::Path};

/// Writes everything, the record last; gives the noise as a relative mean squared error.
pub fn all(
    folder: &Path,
    subject: &Subject,
    film: &Film,
    maps: &[First],
    record: impl FnOnce(f64) -> Value,
) -> Result<f64, Box<dyn Error>> {
    let size = subject.picture.size;
    let (picture, variance) = (film.picture(), film.variance());
    let noise = measures::relative_noise(&picture, &variance);
    let floats = |all: &[DVec3]| all.iter().map(|v| v.as_vec3().to_array()).collect::<Vec<_>>();
    for name in ["picture.exr", "picture.png"] {
        let path = folder.join(name);
        outputs::write(&path, &images::encode_picture(&path, size, &floats(&picture))?)?;
    }
    let [w, h] = size.map(u64::from);
    let array = |name: &str, channels: u64, data: Vec<f32>| -> Result<(), Box<dyn Error>> {
        let shape: &[u64] = if channels == 1 { &[h, w] } else { &[h, w, channels] };
        Ok(outputs::write(&folder.join(name), &npy(shape, data.into_iter())?)?)
    };
    array("variance.npy", 3, floats(&variance).concat())?;
    array("depth.npy", 1, maps.iter().map(|m| m.depth).collect())?;
    array("normal.npy", 3, maps.iter().flat_map(|m| m.normal.to_array()).collect())?;
    array("final_direction.npy", 3, maps.iter().flat_map(|m| m.final_direction.to_array()).collect())?;
    array("path_length.npy", 1, maps.iter().map(|m| m.path_length).collect())?;
    array("hits.npy", 1, maps.iter().map(|m| m.hits as f32).collect())?;
    outputs::write(&folder.join("truth.json"), format!("{:#}\n", record(noise)).as_bytes())?;
    Ok(noise)
}
