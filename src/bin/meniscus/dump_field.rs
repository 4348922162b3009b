//! The density field of a dump: its points, bricks, nodes, directory and balls.

use crate::{dump::npy, prepared, render::Job};
use glam::{DVec3, IVec3};
use meniscus::{
    host::Session,
    layers::field::twin::{Lattice, Words},
    shader::{
        FIELD_BEYOND, FIELD_CROWD, FIELD_DENSEST, FIELD_ENOUGH, FIELD_ONE, FIELD_RAISED, FIELD_RIM, FIELD_SLOT,
        FIELD_SURE, FIELD_THIN, FIELD_THINNED, FIELD_TIP,
    },
};
use serde_json::{Value, json};
use std::error::Error;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Writes it by `write`, file by file, where the frame has one.
pub fn write(job: &Job, session: &mut Session, mut write: impl FnMut(&str, Vec<u8>) -> Result<()>) -> Result<()> {
    let radius = job.scene.particles.radius;
    let Some(field) = job.settings.method.layers.field() else { return Ok(()) };
    let Some(buffers) = session.all_words(Words::BUFFERS)? else { return Ok(()) };
    let all = Words::new(buffers.each_ref().map(Vec::as_slice));
    let (directory, bricks) = (all.directory, all.bricks());
    let n = bricks.len() as u64;
    let slots = directory.len() as u64 / u64::from(FIELD_SLOT);
    write("field_directory.npy", npy(&[slots, u64::from(FIELD_SLOT)], directory.iter().copied())?)?;
    write("field_bricks.npy", npy(&[n, 3], bricks.keys().flatten().copied())?)?;
    write("field_numbers.npy", npy(&[n], bricks.values().map(|b| b.number))?)?;
    write("field_flags.npy", npy(&[n], bricks.values().map(|b| u8::from(b.surface) | u8::from(b.has_balls) << 1))?)?;
    write("field_cells.npy", npy(&[n], bricks.values().map(|b| b.cells))?)?;
    let values = bricks.values().flat_map(|b| b.nodes.iter().map(|v| f64::from(*v) / f64::from(FIELD_ONE)));
    let corners: Vec<_> = bricks.values().flat_map(|b| b.corners.as_flattened()).collect();
    let cells = corners.len() as u64 / 8;
    write("field_held.npy", npy(&[cells, 2, 2, 2], corners.iter().map(|c| c.0))?)?;
    write("field_gradients.npy", npy(&[cells, 2, 2, 2, 3], corners.iter().flat_map(|c| c.1))?)?;
    write("field_nodes.npy", npy(&[n, 4, 4, 4], values)?)?;
    // Balls reach into several bricks.
    let lattice = Lattice::new(&field, radius);
    let spacing = f64::from(field.spacing * radius);
    let in_bricks = bricks.iter().flat_map(|(place, b)| b.balls.iter().map(move |c| (place, c)));
    let centers: Vec<[f64; 3]> = in_bricks
        .map(|(place, c)| {
            let nodes = 4.0 * IVec3::from(*place).as_dvec3() + DVec3::from(c.map(f64::from));
            (nodes * spacing + job.scene.origin).to_array()
        })
        .collect();
    write("field_balls.npy", npy(&[centers.len() as u64, 3], centers.into_iter().flatten())?)?;
    let points = match prepared::points(session, radius, job.picture.preparation.splash_threshold)? {
        Some(points) => points,
        None => job.scene.points()?,
    };
    let point = points.iter().flat_map(|p| {
        let x = p.position.as_dvec3() + job.scene.origin;
        [x.x, x.y, x.z, f64::from(p.signed_density())]
    });
    write("field_points.npy", npy(&[points.len() as u64, 4], point)?)?;
    write("field.json", serde_json::to_vec_pretty(&about(spacing, &lattice, job))?)
}

/// What is needed to read and recompute it.
fn about(spacing: f64, lattice: &Lattice, job: &Job) -> Value {
    json!({
        "spacing": spacing,
        "origin": job.scene.origin.to_array(),
        "support": lattice.support / lattice.spacing * spacing,
        "filled_weights": lattice.rest,
        "level": lattice.level,
        "ball_radius": lattice.ball / lattice.spacing * spacing,
        "nodes": "node (i, j, k) lies at origin + (i, j, k) spacing; brick (x, y, z) has those from 4 (x, y, z) on; field_nodes: brick, z, y, x",
        "flags": "1: some cells hold the surface (field_cells, bit x + 4 y + 16 z); 2: balls reach into it",
        "held": "of each cell that holds the surface, in the order of bricks and bits, a byte at its corners z, y, x: the density times 128 / level, rounded down, 255 at most; field_gradients: z, y, x, axis, central differences of the density, weighted by 3 : 10 : 3 on either other axis, times spacing times 127 / 0.75, scaled to 127 at most",
        "directory": "a block of 4 x 4 x 4 bricks a slot, the last slot empty: its key, 0 where the slot is free; the number of its first brick (field_numbers), after which its others follow; bits of its bricks, x + 4 y + 16 z, two words each: those that there are, that hold the surface, into which balls reach; its place, by which brick coordinates are 4 times that",
        "points": "x, y, z, number density as a part of a filled body's, negative for balls, 0 where nothing is",
        "field": format!("sum over points of positive density r of s W(distance / support), s = 1 / (filled_weights max(min(r, e, {FIELD_DENSEST}), {FIELD_CROWD} r)), W(q) = max(1 - q^2, 0)^2, e = max({FIELD_RIM} - {FIELD_THINNED} ({FIELD_RIM} - r), {FIELD_THIN})"),
        "raised": format!("and once more over those of r < {FIELD_SURE}, with min({FIELD_RAISED} ({:.4} level - f) / w, s) in place of s, where that is positive: f is the sum at the point, trilinear between nodes, for r < {FIELD_TIP} less {FIELD_BEYOND} radii times the length of its gradient there; w is W so", 1.0 + FIELD_ENOUGH),
        "balls": "points of negative density, and those raised ones at which f, of the field that it is then, is less than the level",
    })
}
