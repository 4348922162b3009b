//! `--stats`: timings, memory, counts, and everything needed to repeat the run.

use crate::{codes, dump, outputs, render::Job};
use meniscus::{LedgerEntry, host::Session, profile::FrameTimes};
use serde_json::{Map, Value, json};
use std::{error::Error, path::Path};

pub fn write(
    path: &Path,
    job: &Job,
    session: &mut Session,
    times: Option<&FrameTimes>,
    memory: &[LedgerEntry],
) -> Result<(), Box<dyn Error>> {
    let walk = session.words("walk (debug)", 0)?.unwrap_or_default();
    let share = |table: &[(u32, &str)], channel: usize| {
        let mut counts = vec![0u64; table.len()];
        for w in walk.chunks_exact(4) {
            counts[f32::from_bits(w[channel]) as usize] += 1;
        }
        table.iter().map(|(code, name)| ((*name).to_owned(), json!(counts[*code as usize]))).collect::<Map<_, _>>()
    };
    let mut guards = Map::new();
    // Those of particles are in the report, wherever they were prepared.
    let counted = session.counters()?.into_iter().filter(|(name, _)| !["splash", "body"].contains(name));
    guards.extend(counted.map(|(name, count)| (name.to_owned(), json!(count))));
    let direction = session.words("final direction (debug)", 0)?.unwrap_or_default();
    let flipped: f64 = direction.chunks_exact(4).map(|d| f64::from(f32::from_bits(d[3]))).sum();
    guards.insert("walk_normal_faced_the_wrong_way".into(), json!(flipped));
    let r = job.report();
    guards.insert("ellipsoid_few_neighbours".into(), json!(r.few_neighbours));
    guards.insert("ellipsoid_degenerate".into(), json!(r.degenerate));
    guards.insert("ellipsoid_clamped_long".into(), json!(r.clamped_long));
    guards.insert("ellipsoid_clamped_ratio".into(), json!(r.clamped_ratio));

    let gpu = times.map_or(Value::Null, |t| {
        let passes: Vec<_> = t.passes.iter().map(|p| json!({"pass": p.name, "part": p.part, "ms": p.ms})).collect();
        json!({"passes": passes, "sum_ms": t.passes.iter().map(|p| p.ms).sum::<f64>(), "span_ms": t.span_ms})
    });
    let info = &session.gpu.info;
    let stats = json!({
        "meniscus": env!("CARGO_PKG_VERSION"),
        "device": {"name": info.name, "driver": info.driver, "kind": info.kind, "vulkan": info.api},
        "particles": {"splash": r.splash, "body": r.body, "dropped": job.scene.dropped, "radius_source": job.scene.radius_source},
        "prepare": job.picture.place().name(),
        "prepare_cpu_ms": job.scene.prepare_ms,
        "gpu": gpu,
        "gpu_protocol": "second frame after start, by timestamps; validation makes times meaningless",
        "validation": job.args.validate,
        "memory": memory.iter().map(|e| json!({"resource": e.name, "bytes": e.bytes})).collect::<Vec<_>>(),
        "memory_total": memory.iter().map(|e| e.bytes).sum::<u64>(),
        "patterns": share(codes::PATTERNS, 0),
        "outcomes": share(codes::OUTCOMES, 1),
        "guards": guards,
        "barriers": session.renderer.plan().iter().filter(|b| b.pass != "copy").map(|b| b.to_string()).collect::<Vec<_>>(),
        "frame": dump::frame(job),
    });
    outputs::write(path, serde_json::to_string_pretty(&stats)?.as_bytes())?;
    Ok(())
}
