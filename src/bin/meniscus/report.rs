//! The figures of `meniscus bench`: on the terminal, as JSON, as CSV.

use crate::{
    bench::{Args, Run, SEED},
    choices, options, outputs,
    picture::Picture,
    terminal::NotWritten,
};
use meniscus::host::DeviceInfo;
use serde_json::{Map, Value, json};
use std::{error::Error, path::Path};

/// Commit this was built from.
pub const COMMIT: &str = env!("MENISCUS_COMMIT");

/// What figures are of: device, driver, and what was built from which commit.
pub fn measured_on(device: &DeviceInfo) -> String {
    format!("device: {} ({}); meniscus {} {COMMIT}", device.name, device.driver, env!("CARGO_PKG_VERSION"))
}

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

/// Refuses to write `what` in another format than JSON.
pub fn check_json(path: &Path, what: &str) -> Result<(), String> {
    match extension(path) {
        Some("json") => Ok(()),
        _ => Err(format!("{}: name a {what} that ends in .json", path.display())),
    }
}

/// Refuses to measure where validation is on.
pub fn refuse_validation(device: &DeviceInfo) -> Result<(), String> {
    // Older layers do not say that they are there, but the loader was told.
    let asked = ["VK_INSTANCE_LAYERS", "VK_LOADER_LAYERS_ENABLE"]
        .into_iter()
        .find(|name| std::env::var(name).is_ok_and(|layers| layers.to_lowercase().contains("validation")));
    match device.slowed_by.first().map(String::as_str).or(asked) {
        Some(tool) => {
            Err(format!("validation is on ({tool}): times would mean nothing. Unset VK_INSTANCE_LAYERS and the like"))
        }
        None => Ok(()),
    }
}

/// Value below which a fraction of the sorted times lies, by linear interpolation.
pub fn quantile(times: &[f64], fraction: f64) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = fraction * (sorted.len() - 1) as f64;
    let (low, high) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    low + (high - low) * at.fract()
}

fn median(times: &[f64]) -> f64 {
    quantile(times, 0.5)
}

/// Everything timed of a run: name and its milliseconds, frame by frame.
fn rows(run: &Run) -> Vec<(String, Vec<f64>)> {
    let mut rows = run.passes.clone();
    if run.preparation.iter().any(|t| *t > 0.0) {
        rows.push(("= preparation".into(), run.preparation.clone()));
    }
    rows.push(("= sum of passes".into(), run.sum.clone()));
    rows.push(("= frame, first to last timestamp".into(), run.span.clone()));
    rows
}

pub fn print(run: &Run, args: &Args, picture: &Picture) -> Result<(), NotWritten> {
    let on_device = picture.preparer().on_device();
    args.show("")?;
    args.show(&format!(
        "{}, {}: {} particles, {:.1} bytes of device memory each, {:.1} MB in all",
        run.scene,
        run.method,
        run.particles,
        run.bytes_per_particle(on_device),
        run.bytes() as f64 * 1e-6
    ))?;
    args.show(&format!("{:<34} {:>10} {:>10} {:>10}  ms", "pass", "median", "p5", "p95"))?;
    for (name, times) in rows(run) {
        let ms = [0.5, 0.05, 0.95].map(|fraction| quantile(&times, fraction));
        args.show(&format!("{name:<34} {:>10.3} {:>10.3} {:>10.3}", ms[0], ms[1], ms[2]))?;
    }
    if !on_device {
        args.show(&format!("{:<34} {:>10.3}", "preparation on the CPU, once", run.prepare_cpu_ms))?;
    }
    Ok(())
}

/// A table of methods that drew one scene: medians, and what they need.
pub fn compare(runs: &[Run], args: &Args) -> Result<(), NotWritten> {
    if args.methods.is_empty() || runs.is_empty() {
        return Ok(());
    }
    let mut parts: Vec<&str> = Vec::new();
    for (part, _) in runs.iter().flat_map(|r| &r.parts) {
        if !parts.contains(&part.as_str()) {
            parts.push(part);
        }
    }
    let line = |name: &str, cells: Vec<String>| {
        let cells: String = cells.iter().map(|c| format!(" {c:>10}")).collect();
        args.show(&format!("{name:<20}{cells}"))
    };
    args.show("")?;
    args.show(&format!("{}: methods compared, medians in ms", runs[0].scene))?;
    let heads = ["frame"].into_iter().chain(parts.iter().copied()).chain(["MB"]);
    line("method", heads.map(str::to_owned).collect())?;
    for run in runs {
        let of = |part: &str| run.parts.iter().find(|(name, _)| name == part).map(|(_, times)| median(times));
        let ms = |time: Option<f64>| time.map_or("-".to_owned(), |ms| format!("{ms:.3}"));
        let times = [Some(median(&run.span))].into_iter().chain(parts.iter().map(|p| of(p)));
        line(&run.method, times.map(ms).chain([format!("{:.1}", run.bytes() as f64 * 1e-6)]).collect())?;
    }
    Ok(())
}

/// Exponent of the preparation's median time against the number of particles, fitted to runs of 100,000 and more, where
/// there are two, else to all; and the least number of particles among them. Of the first method.
pub fn growth(runs: &[Run]) -> Option<(f64, usize)> {
    let points = |least: usize| {
        let first = runs.iter().filter(|r| r.method == runs[0].method);
        let fits = first.filter(|r| r.particles >= least && median(&r.preparation) > 0.0);
        fits.map(|r| ((r.particles as f64).ln(), median(&r.preparation).ln())).collect::<Vec<_>>()
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

pub fn write(
    path: &Path,
    args: &Args,
    picture: &Picture,
    device: &DeviceInfo,
    runs: &[Run],
) -> Result<(), Box<dyn Error>> {
    let csv = extension(path) == Some("csv");
    let bytes = if csv { table(args, picture, device, runs)? } else { tree(args, picture, device, runs)? };
    Ok(outputs::write(path, &bytes)?)
}

/// Fields of fields by their names with dots between them.
fn flat(name: &str, value: Value) -> Vec<(String, Value)> {
    match value {
        Value::Object(fields) => fields.into_iter().flat_map(|(k, v)| flat(&format!("{name}.{k}"), v)).collect(),
        value => vec![(name.to_owned(), value)],
    }
}

/// What is in a cell; nothing where nothing was given.
fn cell(value: Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text,
        other => other.to_string(),
    }
}

/// Every parameter of any run, and its unit.
fn parameters(runs: &[Run]) -> Vec<(String, String)> {
    let mut all: Vec<(String, String)> = Vec::new();
    for run in runs {
        let units = choices::units(&run.settings);
        for name in choices::record(&run.settings).into_iter().map(|(name, _)| name) {
            if !all.iter().any(|(n, _)| *n == name) {
                let unit = units.get(&name).and_then(Value::as_str).unwrap_or_default().to_owned();
                all.push((name, unit));
            }
        }
    }
    all
}

/// CSV: a row for each pass of each run, with everything that it was measured with.
fn table(args: &Args, picture: &Picture, device: &DeviceInfo, runs: &[Run]) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    let measured = ["scene", "method", "particles", "pass", "median_ms", "p5_ms", "p95_ms", "bytes_per_particle"];
    let constant = ["frames", "warmup", "still", "device", "driver", "commit", "seed"];
    let asked: Vec<_> = picture.record_rest().into_iter().flat_map(|(name, value)| flat(&name, value)).collect();
    let parameters = parameters(runs);
    let units = |(name, unit): &(String, String)| match unit.as_str() {
        "" => name.clone(),
        unit => format!("{name} [{unit}]"),
    };
    let heads = measured.into_iter().chain(constant).map(str::to_owned);
    csv.write_record(heads.chain(asked.iter().map(|(name, _)| name.clone())).chain(parameters.iter().map(units)))?;
    for run in runs {
        for (name, times) in rows(run) {
            let ms = |fraction| format!("{:.6}", quantile(&times, fraction));
            let row = [
                run.scene.clone(),
                run.method.clone(),
                run.particles.to_string(),
                name.trim_start_matches("= ").to_owned(),
                ms(0.5),
                ms(0.05),
                ms(0.95),
                format!("{:.3}", run.bytes_per_particle(picture.preparer().on_device())),
                args.frames.to_string(),
                args.warmup.to_string(),
                args.still.to_string(),
                device.name.clone(),
                device.driver.clone(),
                COMMIT.to_owned(),
                SEED.to_string(),
            ];
            let mut record = choices::record(&run.settings);
            let settings = parameters.iter().map(|(name, _)| record.remove(name).map(cell).unwrap_or_default());
            let asked = asked.iter().map(|(_, value)| cell(value.clone()));
            csv.write_record(row.into_iter().chain(asked).chain(settings))?;
        }
    }
    Ok(csv.into_inner()?)
}

/// What else times may hang on: the machine, and variables that drivers, their loader and its layers read.
fn environment() -> Value {
    let processor = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|l| l.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    let read = ["VK_", "MESA_", "GALLIUM_", "LP_", "RADV_", "ACO_", "ANV_", "INTEL_", "NVK_"];
    let text = |s: std::ffi::OsString| s.to_string_lossy().into_owned();
    let all = std::env::vars_os().map(|(name, value)| (text(name), json!(text(value))));
    json!({
        "system": std::env::consts::OS,
        "architecture": std::env::consts::ARCH,
        "processor": processor,
        "threads": std::thread::available_parallelism().ok().map(std::num::NonZero::get),
        "variables": all.filter(|(name, _)| read.iter().any(|r| name.starts_with(r))).collect::<Map<_, _>>(),
    })
}

/// JSON: everything.
fn tree(args: &Args, picture: &Picture, device: &DeviceInfo, runs: &[Run]) -> Result<Vec<u8>, Box<dyn Error>> {
    let on_device = picture.preparer().on_device();
    let medians = |of: &[(String, Vec<f64>)]| of.iter().map(|(n, t)| (n.clone(), figures(t))).collect::<Map<_, _>>();
    let each: Vec<_> = runs
        .iter()
        .map(|run| {
            json!({
                "scene": run.scene,
                "method": run.method,
                "particles": run.particles,
                "radius": run.radius,
                "settings": choices::record(&run.settings),
                "units": choices::units(&run.settings),
                "passes": run.passes.iter().map(|(name, t)| json!({"pass": name, "ms": figures(t)})).collect::<Vec<_>>(),
                "parts": medians(&run.parts),
                "preparation": figures(&run.preparation),
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
        "environment": environment(),
        "protocol": {
            "times": "GPU timestamps around each pass; passes of one name summed; every frame waited for",
            "frames": args.frames,
            "warmup": args.warmup,
            "still": args.still,
            "size": picture.size,
            "supersample": picture.supersample,
            "seed": SEED,
            "prepare": picture.preparer().name(),
            "asked": picture.record_rest(),
            "not_asked": "eye and target that are null frame the liquid; radius that is null is the file's or estimated",
            "validation": false,
        },
        "runs": each,
        "growth": args.scaling.then(|| growth(runs)).flatten().map(|(exponent, from)| json!({"exponent": exponent, "from_particles": from, "of": "median preparation"})),
    });
    Ok(serde_json::to_vec_pretty(&all)?)
}
