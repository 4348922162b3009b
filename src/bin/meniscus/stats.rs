//! `--stats`: timings, memory, counts, and everything needed to repeat the run.

use crate::{codes, dump, outputs, render::Job};
use meniscus::{LedgerEntry, host::Session, inspect, profile::FrameTimes};
use serde_json::{Map, Value, json};
use std::{error::Error, path::Path};

pub fn write(
    path: &Path,
    job: &Job,
    session: &mut Session,
    times: Option<&FrameTimes>,
    memory: &[LedgerEntry],
) -> Result<(), Box<dyn Error>> {
    // Not all optics walk.
    let walk = session.words("walk (debug)", 0)?;
    let pixels = |table: &[(u32, &str)], channel: usize| {
        let mut counts = vec![0u64; table.len()];
        for w in walk.as_deref()?.chunks_exact(4) {
            counts[f32::from_bits(w[channel]) as usize] += 1;
        }
        Some(
            table.iter().map(|(code, name)| ((*name).to_owned(), json!(counts[*code as usize]))).collect::<Map<_, _>>(),
        )
    };
    // Those of particles are in the report, wherever they were prepared; classes are no guards.
    let particles = inspect::counted(job.report());
    let [splash, body, guarded @ ..] = particles;
    let counters = session.counters()?.into_iter().filter(|(name, _)| particles.iter().all(|c| c.0 != *name));
    let mut guards: Map<_, _> = counters.map(|(name, count)| (name.to_owned(), json!(count))).collect();
    guards.extend(guarded.map(|(name, count)| (name.to_owned(), json!(count))));
    if let Some(direction) = session.words("final direction (debug)", 0)? {
        let flipped: f64 = direction.chunks_exact(4).map(|d| f64::from(f32::from_bits(d[3]))).sum();
        guards.insert("walk_normal_faced_the_wrong_way".into(), json!(flipped));
    }

    let gpu = times.map_or(Value::Null, |t| {
        let passes: Vec<_> = t.passes.iter().map(|p| json!({"pass": p.name, "part": p.part, "ms": p.ms})).collect();
        json!({"passes": passes, "sum_ms": t.passes.iter().map(|p| p.ms).sum::<f64>(), "span_ms": t.span_ms})
    });
    let info = &session.gpu.info;
    let stats = json!({
        "meniscus": env!("CARGO_PKG_VERSION"),
        "device": {"name": info.name, "driver": info.driver, "kind": info.kind, "vulkan": info.api},
        "particles": {
            splash.0: splash.1,
            body.0: body.1,
            "splash_axes_ignored": job.report().splash_axes_ignored,
            "dropped": job.scene.dropped,
            "radius_source": job.scene.radius_source,
        },
        "prepare": job.picture.preparer().name(),
        "prepare_cpu_ms": job.scene.prepare_ms,
        "gpu": gpu,
        "gpu_protocol": "second frame after start, by timestamps; validation makes times meaningless",
        "validation": job.args.validate,
        "memory": memory.iter().map(|e| json!({"resource": e.name, "bytes": e.bytes})).collect::<Vec<_>>(),
        "memory_total": memory.iter().map(|e| e.bytes).sum::<u64>(),
        "patterns": pixels(codes::PATTERNS, 0),
        "outcomes": pixels(codes::OUTCOMES, 1),
        "guards": guards,
        "barriers": session.renderer.plan().iter().filter(|b| b.pass != "copy").map(|b| b.to_string()).collect::<Vec<_>>(),
        "frame": dump::frame(job),
    });
    outputs::write(path, serde_json::to_string_pretty(&stats)?.as_bytes())?;
    Ok(())
}
