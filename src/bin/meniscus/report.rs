//! The figures of `meniscus bench`: on the terminal, as JSON, as CSV.

use crate::{
    bench::{Args, Run, SEED},
    options, outputs,
    terminal::NotWritten,
};
use meniscus::{Settings, host::DeviceInfo};
use serde_json::{Map, Value, json};
use std::{error::Error, path::Path};

/// Commit this was built from.
pub const COMMIT: &str = env!("MENISCUS_COMMIT");

fn extension(path: &Path) -> Option<&str> {
    path.extension().and_then(|e| e.to_str())
}

/// Refuses to write figures in a format that is not there.
pub fn check_extension(path: &Path) -> Result<(), String> {
    match extension(path) {
        Some("json" | "csv") => Ok(()),
        _ => Err(format!("{}: name a file that ends in .json or .csv", path.display())),
    }
}

/// Value below which a share of the sorted times lies, by linear interpolation.
fn quantile(times: &[f64], share: f64) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = share * (sorted.len() - 1) as f64;
    let (low, high) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    low + (high - low) * at.fract()
}

fn median(times: &[f64]) -> f64 {
    quantile(times, 0.5)
}

/// Everything timed of a run: name and its milliseconds, frame by frame.
fn rows(run: &Run) -> Vec<(String, Vec<f64>)> {
    let mut rows = run.passes.clone();
    if run.preparation().iter().any(|t| *t > 0.0) {
        rows.push(("= preparation".into(), run.preparation()));
    }
    rows.push(("= sum of passes".into(), run.sum.clone()));
    rows.push(("= frame, first to last timestamp".into(), run.span.clone()));
    rows
}

pub fn print(run: &Run, args: &Args) -> Result<(), NotWritten> {
    let on_device = args.prepare().on_device();
    args.show("")?;
    args.show(&format!(
        "{}: {} particles, {:.1} bytes of device memory each, {:.1} MB in all",
        run.scene,
        run.particles,
        run.bytes_per_particle(on_device),
        run.memory.iter().map(|e| e.bytes).sum::<u64>() as f64 * 1e-6
    ))?;
    args.show(&format!("{:<34} {:>10} {:>10} {:>10}  ms", "pass", "median", "p5", "p95"))?;
    for (name, times) in rows(run) {
        let ms = [0.5, 0.05, 0.95].map(|share| quantile(&times, share));
        args.show(&format!("{name:<34} {:>10.3} {:>10.3} {:>10.3}", ms[0], ms[1], ms[2]))?;
    }
    if !on_device {
        args.show(&format!("{:<34} {:>10.3}", "preparation on the CPU, once", run.prepare_cpu_ms))?;
    }
    Ok(())
}

/// Exponent of the preparation's median time against the number of particles, fitted to runs of 100,000 and more, where
/// there are two, else to all; and the least number of particles among them.
pub fn growth(runs: &[Run]) -> Option<(f64, usize)> {
    let points = |least: usize| {
        let fits = runs.iter().filter(|r| r.particles >= least && median(&r.preparation()) > 0.0);
        fits.map(|r| ((r.particles as f64).ln(), median(&r.preparation()).ln())).collect::<Vec<_>>()
    };
    let (points, from) = Some((points(100_000), 100_000)).filter(|(p, _)| p.len() >= 2).unwrap_or((points(1), 1));
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / spread;
    slope.is_finite().then_some((slope, from))
}

fn figures(times: &[f64]) -> Value {
    json!({"median_ms": median(times), "p5_ms": quantile(times, 0.05), "p95_ms": quantile(times, 0.95)})
}

pub fn write(path: &Path, args: &Args, device: &DeviceInfo, runs: &[Run]) -> Result<(), Box<dyn Error>> {
    let bytes = if extension(path) == Some("csv") { table(args, device, runs)? } else { tree(args, device, runs)? };
    Ok(outputs::write(path, &bytes)?)
}

/// What the camera and the scene were asked for, by name.
fn asked(args: &Args) -> Vec<(&'static str, Value)> {
    let o = &args.options;
    vec![
        ("eye", json!(o.eye.map(|v| v.to_array()))),
        ("target", json!(o.target.map(|v| v.to_array()))),
        ("up", json!(o.up.to_array())),
        ("fov_y_degrees", json!(o.fov_y)),
        ("environment", json!(o.env.as_ref().map(|p| p.to_string_lossy()))),
        ("radius_given", json!(o.radius)),
        ("splash_threshold", json!(o.splash_threshold)),
        ("drop_invalid", json!(o.drop_invalid)),
        ("max_memory", json!(o.max_memory.bytes())),
    ]
}

/// CSV: a row for each pass of each run, with everything that it was measured with.
fn table(args: &Args, device: &DeviceInfo, runs: &[Run]) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    let measured = ["scene", "particles", "pass", "median_ms", "p5_ms", "p95_ms", "bytes_per_particle"];
    let constant = ["frames", "warmup", "size", "prepare", "device", "driver", "commit", "seed"];
    let names = asked(args).into_iter().chain(options::record(&Settings::default())).map(|(name, _)| name);
    csv.write_record(measured.into_iter().chain(constant).chain(names))?;
    // A cell is empty where nothing was given.
    let cell = |value: Value| match value {
        Value::Null => String::new(),
        Value::String(text) => text,
        other => other.to_string(),
    };
    for run in runs {
        for (name, times) in rows(run) {
            let ms = |share| format!("{:.6}", quantile(&times, share));
            let row = [
                run.scene.clone(),
                run.particles.to_string(),
                name.trim_start_matches("= ").to_owned(),
                ms(0.5),
                ms(0.05),
                ms(0.95),
                format!("{:.3}", run.bytes_per_particle(args.prepare().on_device())),
                args.frames.to_string(),
                args.warmup.to_string(),
                format!("{}x{}", args.options.size[0], args.options.size[1]),
                args.prepare().name(),
                device.name.clone(),
                device.driver.clone(),
                COMMIT.to_owned(),
                SEED.to_string(),
            ];
            let settings = asked(args).into_iter().chain(options::record(&run.settings)).map(|(_, value)| cell(value));
            csv.write_record(row.into_iter().chain(settings))?;
        }
    }
    Ok(csv.into_inner()?)
}

/// JSON: everything.
fn tree(args: &Args, device: &DeviceInfo, runs: &[Run]) -> Result<Vec<u8>, Box<dyn Error>> {
    let on_device = args.prepare().on_device();
    let object = |fields: Vec<(&str, Value)>| fields.into_iter().map(|(k, v)| (k.to_owned(), v)).collect::<Map<_, _>>();
    let each: Vec<_> = runs
        .iter()
        .map(|run| {
            json!({
                "scene": run.scene,
                "particles": run.particles,
                "radius": run.radius,
                "settings": object(options::record(&run.settings)),
                "passes": run.passes.iter().map(|(name, t)| json!({"pass": name, "ms": figures(t)})).collect::<Vec<_>>(),
                "preparation": figures(&run.preparation()),
                "preparation_cpu_ms": if on_device { Value::Null } else { json!(run.prepare_cpu_ms) },
                "sum_of_passes": figures(&run.sum),
                "frame_span": figures(&run.span),
                "bytes_per_particle": run.bytes_per_particle(on_device),
                "memory": run.memory.iter().map(|e| json!({"resource": e.name, "bytes": e.bytes})).collect::<Vec<_>>(),
            })
        })
        .collect();
    let all = json!({
        "meniscus": env!("CARGO_PKG_VERSION"),
        "commit": COMMIT,
        "command": options::command(),
        "device": {"name": device.name, "driver": device.driver, "kind": device.kind, "vulkan": device.api},
        "protocol": {
            "times": "GPU timestamps around each pass; passes of one name summed; every frame waited for",
            "frames": args.frames,
            "warmup": args.warmup,
            "size": args.options.size,
            "seed": SEED,
            "prepare": args.prepare().name(),
            "asked": object(asked(args)),
            "not_asked": "eye and target that are null frame the liquid; radius that is null is the file's or estimated",
            "validation": false,
        },
        "runs": each,
        "growth": args.scaling.then(|| growth(runs)).flatten().map(|(exponent, from)| json!({"exponent": exponent, "from_particles": from, "of": "median preparation"})),
    });
    Ok(serde_json::to_vec_pretty(&all)?)
}
