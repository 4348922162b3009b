//! What is in particle files.

use super::Args;
use crate::{
    scene::{local, told_radius},
    terminal::{complain, line},
};
use glam::DVec3;
use meniscus::{
    io::{
        particles::{Contents, Invalid, ParticleFile, ReadError, check_finite, describe, time_step},
        quote,
    },
    prepare,
};
use serde::Serialize;
use std::{error::Error, path::Path, process::ExitCode};

/// Describes each file; one that cannot be read is named, and the others are described all the same.
pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let (mut all, mut failed) = (Vec::new(), false);
    for path in &args.files {
        match of(path, args) {
            Ok(found) if args.json => all.push(serde_json::to_value(found)?),
            Ok(found) => show(&found)?,
            Err(error) => {
                complain(format!("meniscus: {error}"));
                failed = true;
            }
        }
    }
    if args.json {
        serde_json::to_string_pretty(&all)?.lines().try_for_each(line)?;
    }
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

#[derive(Serialize)]
struct Found {
    file: String,
    format: String,
    compression: Option<String>,
    /// Files that it names.
    files: u64,
    time: Option<f64>,
    step: Option<u64>,
    steps: Option<u64>,
    particles: usize,
    /// Particles of which a position or velocity is not finite; what follows is without them.
    not_finite: usize,
    bounds: Option<[[f64; 3]; 2]>,
    /// Median distance to the nearest other particle.
    spacing: Option<f32>,
    radius: Option<f64>,
    radius_source: Option<&'static str>,
    support: Option<f64>,
    /// The fastest particle's.
    speed: Option<f64>,
    ids: Option<[u64; 2]>,
    /// Of the body, and splashes.
    classes: Option<[usize; 2]>,
    ellipsoids: bool,
    arrays: Vec<Array>,
}

#[derive(Serialize)]
struct Array {
    name: String,
    #[serde(rename = "type")]
    kind: String,
    components: u64,
}

fn of(path: &Path, args: &Args) -> Result<Found, ReadError> {
    let (mut file, contents) = match args.time {
        Some(time) => time_step(path, time, &args.max_memory)?.describe(&args.max_memory)?,
        None => describe(path, &args.max_memory)?,
    };
    let not_finite = check_finite(&mut file, Invalid::Drop, path)?;
    let positions = std::mem::take(&mut file.positions);
    let count = positions.len();
    let bounds = positions.first().map(|first| {
        let (low, high) = positions.iter().fold((*first, *first), |(low, high), p| (low.min(*p), high.max(*p)));
        [low, high].map(|corner| corner.to_array())
    });
    let (_, relative) = local(&positions);
    drop(positions); // twice as large as what was made of them
    let spacing = prepare::spacing(&relative);
    let radius = told_radius(file.radius, || spacing).filter(|_| !relative.is_empty());
    let Contents { format, compression, time, step, steps, files, arrays } = contents;
    Ok(Found {
        file: quote::path(path),
        particles: count + not_finite,
        not_finite,
        bounds,
        spacing,
        radius: radius.map(|(r, _)| r),
        radius_source: radius.map(|(_, source)| source),
        support: file.support,
        speed: file.velocities.as_ref().and_then(|all| all.iter().copied().map(DVec3::length).reduce(f64::max)),
        ids: ids(&mut file),
        classes: file.classes.as_ref().map(|all| {
            let body = all.iter().filter(|class| **class == 1).count();
            [body, all.len() - body]
        }),
        ellipsoids: file.axes.is_some(),
        arrays: arrays
            .into_iter()
            .map(|array| Array { name: array.name, kind: array.kind, components: array.components })
            .collect(),
        format,
        compression,
        files,
        time,
        step,
        steps,
    })
}

/// The least and the greatest id, if all differ: by others no particle can be followed.
fn ids(file: &mut ParticleFile) -> Option<[u64; 2]> {
    if let Some(ids) = &mut file.ids {
        ids.sort_unstable();
    }
    let ids = file.ids.as_deref().unwrap_or_default();
    let different = ids.windows(2).all(|two| two[0] < two[1]);
    if file.ids.is_some() && different {
        return Some([*ids.first()?, *ids.last()?]);
    }
    None
}

fn show(found: &Found) -> Result<(), Box<dyn Error>> {
    let mut rows: Vec<(&str, String)> = Vec::new();
    let compression = found.compression.as_ref().map_or(String::new(), |name| format!("; {name}"));
    rows.push(("format", format!("{}{compression}", found.format)));
    if found.files > 0 {
        rows.push(("files", format!("{} that it names", found.files)));
    }
    rows.extend(found.time.map(|time| ("time", time.to_string())));
    let of = found.steps.filter(|steps| *steps > 1).map_or(String::new(), |steps| format!(", the last of {steps}"));
    rows.extend(found.step.map(|step| ("step", format!("{step}{of}"))));
    rows.push(("particles", found.particles.to_string()));
    if found.not_finite > 0 {
        rows.push(("not finite", format!("{} of them", found.not_finite)));
    }
    let corner = |[x, y, z]: [f64; 3]| format!("{x} {y} {z}");
    rows.extend(found.bounds.map(|[low, high]| ("bounds", format!("{} to {}", corner(low), corner(high)))));
    rows.extend(found.spacing.map(|d| ("spacing", format!("{d} (median distance to the nearest particle)"))));
    rows.extend(found.radius.zip(found.radius_source).map(|(r, source)| ("radius", format!("{r} ({source})"))));
    rows.extend(found.support.map(|support| ("support", support.to_string())));
    rows.extend(found.speed.map(|speed| ("velocities", format!("up to {speed}"))));
    rows.extend(found.ids.map(|[low, high]| ("ids", format!("{low} to {high}, all different"))));
    rows.extend(found.classes.map(|[body, splash]| ("classes", format!("{body} body, {splash} splash"))));
    if found.ellipsoids {
        rows.push(("ellipsoids", "of its own".into()));
    }
    line(&found.file)?;
    for (name, value) in rows {
        line(format!("  {name:<10} {value}"))?;
    }
    for (i, array) in found.arrays.iter().enumerate() {
        let name = if i == 0 { "arrays" } else { "" };
        line(format!("  {name:<10} {}: {} x {}", array.name, array.kind, array.components))?;
    }
    Ok(())
}
