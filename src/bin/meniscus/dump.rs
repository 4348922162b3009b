//! `--dump`: the frame's maps as .npy, so that what smooths them, walks in them and shades can be recomputed from the dump
//! alone.

use crate::{choices, codes, dump_field, options, outputs::Dump, render::Job};
use glam::{DMat4, DVec3, Mat4, Vec3};
use meniscus::{
    host::Session,
    inspect::{self, Spec, Walk},
    shader::{ACCEPTED, ACCEPTED_PIXELS, JUMP, SIDE_BACK, SIDE_FRONT, STEEP},
    space::Space,
    twin::normal::decode_normal,
};
use npyz::WriterBuilder;
use serde_json::{Value, json};
use std::{collections::BTreeMap, error::Error, path::Path};

/// Depths and normals of the body before they are smoothed.
pub const RAY_CAST: [&str; 2] = ["body depth (ray-cast)", "body normal (ray-cast)"];

type Result<T> = std::result::Result<T, Box<dyn Error>>;

pub fn write(folder: &Path, job: &Job, session: &mut Session) -> Result<()> {
    let mut out = Folder { dump: Dump::new(folder)?, size: job.size, radius: job.scene.particles.radius };
    let (surfaces, radius) = (session.renderer.surfaces(), out.radius);
    let [depth, normal] = RAY_CAST.map(Some);
    // Steps of a filter write one of two targets in turns: the one without the result has what the last step read.
    let mut smoothed = session.renderer.targets().into_iter().filter(|name| name.starts_with("body depth (smoothed"));
    let before = smoothed.find(|name| Some(*name) != surfaces.body_depth);
    let targets = [
        ("splash", "_raw", surfaces.splash_depth, surfaces.splash_normal),
        ("body", "_raw", depth, normal),
        ("body", "_last_step", before, None),
        ("body", "", surfaces.body_depth, surfaces.body_normal),
    ];
    for (class, step, depth, normal) in targets {
        for (side, layer) in [("front", SIDE_FRONT), ("back", SIDE_BACK)] {
            let mut words = |name: Option<&'static str>| name.map_or(Ok(None), |name| session.words(name, layer));
            let (Some(depths), normals) = (words(depth)?, words(normal)?) else { continue };
            let size = depth.map_or(job.size, |name| size_of_map(session, name));
            out.maps(&format!("{class}_{side}"), step, size, &depths, normals.as_deref())?;
        }
    }
    for (side, layer) in [("front", SIDE_FRONT), ("back", SIDE_BACK)] {
        if let Some(words) = session.words("missing silhouette", layer)? {
            let size = size_of_map(session, "missing silhouette");
            out.array_of(&format!("body_{side}_missing_silhouette"), size, 1, floats(words).into_iter())?;
        }
    }
    if let Some(words) = session.words("nearest and farthest depth", 0)? {
        out.array("nearest_and_farthest", 2, words.into_iter().map(|w| f32::from_bits(w) * radius))?;
    }
    // Of pixels, and below those of tiles.
    if let Some(words) = session.words("walls", 0)? {
        let texels = 4 * out.size[0] as usize * out.size[1] as usize;
        out.array("walls", 4, words.into_iter().take(texels).map(|w| f32::from_bits(w) * radius))?;
    }
    if let Some(words) = session.words("thickness", 0)? {
        out.array("thickness", 1, words.into_iter().map(|w| f32::from_bits(w) * radius))?;
    }
    if let Some(words) = session.words("speed", 0)? {
        out.array_of("speed", size_of_map(session, "speed"), 1, words.into_iter().map(f32::from_bits))?;
    }
    // Not all optics walk.
    if let Some(words) = session.words("walk (debug)", 0)? {
        let walk = floats(words);
        for (k, name) in ["pattern", "outcome", "hits", "path_length"].into_iter().enumerate() {
            let unit = if name == "path_length" { radius } else { 1.0 };
            out.array(name, 1, walk.chunks_exact(4).map(|w| w[k] * unit))?;
        }
    }
    if let Some(words) = session.words("final direction (debug)", 0)? {
        out.array("final_direction", 3, floats(words).chunks_exact(4).flat_map(|d| [d[0], d[1], d[2]]))?;
    }
    out.array("color_linear", 3, session.picture()?.into_iter().flatten())?;
    out.dump.write("particles.npz", &particles(job)?)?;
    dump_field::write(job, session, |name, bytes| Ok(out.dump.write(name, &bytes)?))?;
    if job.args.dump_neighbours {
        out.dump.write("neighbours.npz", &neighbours(job, session)?)?;
    }
    Ok(out.dump.finish(frame(job))?)
}

/// Maps of optics that upsample are smaller than the picture.
fn size_of_map(session: &Session, name: &str) -> [u32; 2] {
    match session.renderer.spec(name) {
        Some(Spec::Image(spec)) => spec.size,
        _ => [0, 0],
    }
}

fn floats(words: Vec<u32>) -> Vec<f32> {
    words.into_iter().map(f32::from_bits).collect()
}

struct Folder<'a> {
    dump: Dump<'a>,
    size: [u32; 2],
    /// Shaders measure lengths in it, dumps in world units.
    radius: f32,
}

impl Folder<'_> {
    /// float32, H x W or H x W x `channels`, row 0 at the top.
    fn array(&mut self, name: &str, channels: u64, data: impl Iterator<Item = f32>) -> Result<()> {
        self.array_of(name, self.size, channels, data)
    }

    fn array_of(&mut self, name: &str, size: [u32; 2], channels: u64, data: impl Iterator<Item = f32>) -> Result<()> {
        let [w, h] = size.map(u64::from);
        let shape: &[u64] = if channels == 1 { &[h, w] } else { &[h, w, channels] };
        Ok(self.dump.write(&format!("{name}.npy"), &npy(shape, data)?)?)
    }

    fn maps(
        &mut self,
        surface: &str,
        step: &str,
        size: [u32; 2],
        depths: &[u32],
        normals: Option<&[u32]>,
    ) -> Result<()> {
        let radius = self.radius;
        let depth = |w: &u32| Some(radius * f32::from_bits(*w)).filter(|d| *d != 0.0).unwrap_or(f32::NAN);
        self.array_of(&format!("{surface}_depth{step}"), size, 1, depths.iter().map(depth))?;
        let Some(normals) = normals else { return Ok(()) };
        // Where the near plane cuts the liquid there is no surface to have one.
        let normal = depths.iter().zip(normals).flat_map(|(d, n)| match depth(d) > 0.0 {
            true => decode_normal(*n).to_array(),
            false => [f32::NAN; 3],
        });
        self.array_of(&format!("{surface}_normal{step}"), size, 3, normal)
    }
}

pub fn npy<T: npyz::AutoSerialize>(shape: &[u64], data: impl Iterator<Item = T>) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut writer = npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut bytes).begin_nd()?;
    writer.extend(data)?;
    writer.finish()?;
    Ok(bytes)
}

fn particles(job: &Job) -> Result<Vec<u8>> {
    let (p, origin) = (job.particles(), job.scene.origin);
    let n = p.ellipsoids.len() as u64;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut npz = npyz::npz::NpzWriter::new(&mut bytes);
    let mut add = |name: &str, shape: &[u64], data: Vec<f64>| -> Result<()> {
        let mut w = npz.array(name, Default::default())?.default_dtype().shape(shape).begin_nd()?;
        w.extend(data)?;
        w.finish()?;
        Ok(())
    };
    add("center", &[n, 3], p.ellipsoids.iter().flat_map(|e| (e.center.as_dvec3() + origin).to_array()).collect())?;
    // Columns one after the other: each row of the array is one semi-axis vector.
    add("axes", &[n, 3, 3], p.ellipsoids.iter().flat_map(|e| e.axes.as_dmat3().to_cols_array()).collect())?;
    let mut w = npz.array("class", Default::default())?.default_dtype().shape(&[n]).begin_nd()?;
    w.extend((0..p.ellipsoids.len()).map(|i| u8::from(i >= p.splash_count)))?;
    w.finish()?;
    if let Some(prepared) = &job.prepared {
        let mut w = npz.array("index", Default::default())?.default_dtype().shape(&[n]).begin_nd()?;
        w.extend(prepared.index.iter().copied())?;
        w.finish()?;
    }
    drop(npz); // writes the archive's directory
    Ok(bytes.into_inner())
}

/// `offsets` (one more than particles) into `indices`, by index in the file.
fn neighbours(job: &Job, session: &mut Session) -> Result<Vec<u8>> {
    let (offsets, indices) = crate::prepared::neighbours(session, job.scene.positions.len())?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut npz = npyz::npz::NpzWriter::new(&mut bytes);
    let mut w = npz.array("offsets", Default::default())?.default_dtype().shape(&[offsets.len() as u64]).begin_nd()?;
    w.extend(offsets)?;
    w.finish()?;
    let mut w = npz.array("indices", Default::default())?.default_dtype().shape(&[indices.len() as u64]).begin_nd()?;
    w.extend(indices)?;
    w.finish()?;
    drop(npz); // writes the archive's directory
    Ok(bytes.into_inner())
}

/// 4 x 4, row-major, for column vectors.
fn rows(m: DMat4) -> [[f64; 4]; 4] {
    m.transpose().to_cols_array_2d()
}

/// The world-to-eye matrix in the file's coordinates.
fn world_view(view: Mat4, origin: DVec3) -> DMat4 {
    view.as_dmat4() * DMat4::from_translation(-origin)
}

/// All that is needed to recompute the dump.
pub fn frame(job: &Job) -> Value {
    let (s, radius) = (&job.settings, job.scene.particles.radius);
    let codes =
        |table: &[(u32, &'static str)]| table.iter().map(|(c, t)| (c.to_string(), *t)).collect::<BTreeMap<_, _>>();
    let bounds = job.scene.particles.bounds().unwrap_or_default();
    // In radii, whatever the origin.
    let block = inspect::uniforms(&job.camera, s, job.size, &Space::new(radius, Vec3::ZERO), bounds);
    // What a pixel covers at depth 1.
    let pixel = block.pixel_scale.abs().max_element().recip();
    let walk = Walk::of(&s.method.optics);
    let mut frame = json!({
        "width": job.size[0],
        "height": job.size[1],
        "view": rows(world_view(job.camera.view, job.scene.origin)),
        "projection": rows(job.camera.projection.as_dmat4()),
        "near": job.camera.near,
        "eye": (job.eye.as_dvec3() + job.scene.origin).to_array(),
        "eye_inside": job.scene.inside(job.eye),
        "origin": job.scene.origin.to_array(),
        "radius": radius,
        "environment_rotation": job.camera.environment_rotation,
        "settings": choices::record(s),
        "units": choices::units(s),
        "asked": job.picture.record(),
        "refractions": walk.map(|w| w.refractions),
        "sampling": {
            "jump": radius * JUMP,
            "jump_by_depth": pixel * STEEP,
            "accepted": radius * ACCEPTED,
            "accepted_by_depth": pixel * ACCEPTED_PIXELS,
            "meaning": "the body's maps are sampled bilinearly, normals with them, where all four pixels have a front and a back \
                        and the depths spread by at most `jump`, else at the pixel itself; a wall is a surface where the ray's \
                        depth is the map's within `accepted`; either is that, or its `_by_depth` times the ray's depth, if more",
        },
        "pattern_codes": codes(codes::PATTERNS),
        "outcome_codes": codes(codes::OUTCOMES),
        "hits": "surfaces met on the walk, internal reflections included",
        "path_length": "length inside the liquid, all intervals, world units",
        "depths": "along the view axis, world units; NaN: no surface; -near: the near plane lies inside a particle",
        "smoothing": "`_raw`: before; `_last_step`: what the last step read; missing_silhouette: how much the row pass of the \
                      last iteration missed",
        "nearest_and_farthest": "before they are parted: the nearest front, negative (-inf: none), and the farthest back",
        "walls": "depths at which the pixel's ray enters and leaves the body, then those of the splash in front, world units; \
                  where there is none the first is beyond the second",
        "normals": "eye space, outward: fronts towards the viewer, backs away from it",
        "particle_classes": {"0": "splash", "1": "body"},
        "command": options::command(),
    });
    // Each parameter by its name too; instead of lengths in particle radii those in world units.
    let lengths = choices::lengths(s, radius);
    let plain = choices::record(s).into_iter().filter(|(name, _)| !lengths.contains_key(&choices::in_world(name)));
    if let Some(fields) = frame.as_object_mut() {
        if let Some(guards) = s.method.smooth.guards() {
            let limits = guards
                .limits
                .into_iter()
                .map(|(name, limit, in_radii)| (name.to_owned(), json!(if in_radii { limit * radius } else { limit })));
            let all = limits.chain([("meaning".to_owned(), json!(guards.meaning))]).collect();
            fields.insert(format!("{}_guards", s.method.smooth.name().replace('-', "_")), Value::Object(all));
        }
        plain.chain(lengths.clone()).for_each(|(name, value)| {
            fields.entry(name).or_insert(value);
        });
    }
    frame
}
