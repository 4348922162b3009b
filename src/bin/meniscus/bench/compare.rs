//! What changed from one file of figures to another, beyond the noise of both.

use crate::terminal::{NotWritten, line};
use serde::Deserialize;
use serde_json::{Map, Value};
use std::{error::Error, fs, path::Path};

/// What `bench -o FILE.json` has written, as far as it is compared.
#[derive(Deserialize)]
struct Figures {
    commit: String,
    device: Map<String, Value>,
    protocol: Map<String, Value>,
    /// Older figures have none.
    #[serde(default)]
    environment: Map<String, Value>,
    runs: Vec<Run>,
}

#[derive(Deserialize)]
struct Run {
    scene: String,
    method: String,
    particles: u64,
    settings: Map<String, Value>,
    passes: Vec<Pass>,
    preparation: Times,
    frame_span: Times,
    bytes_per_particle: f64,
}

#[derive(Deserialize)]
struct Pass {
    pass: String,
    ms: Times,
}

#[derive(Clone, Copy, Deserialize)]
struct Times {
    median_ms: f64,
    p5_ms: f64,
    p95_ms: f64,
}

impl Times {
    /// What became of it: nothing, as long as 90 % of the one's frames and of the other's overlap.
    fn verdict(self, now: Times) -> &'static str {
        match () {
            () if now.p5_ms > self.p95_ms => "slower",
            () if now.p95_ms < self.p5_ms => "faster",
            () => "",
        }
    }
}

fn read(path: &Path) -> Result<Figures, Box<dyn Error>> {
    let wrong =
        |e: &dyn std::fmt::Display| format!("{}: {e}. Name figures that `bench -o FILE.json` wrote", path.display());
    let text = fs::read(path).map_err(|e| wrong(&e))?;
    Ok(serde_json::from_slice(&text).map_err(|e| wrong(&e))?)
}

/// Says it, on the terminal.
pub fn run(before: &Path, now: &Path) -> Result<(), Box<dyn Error>> {
    let [a, b] = [read(before)?, read(now)?];
    line(format!("before: {} (commit {}); now: {} (commit {})", before.display(), a.commit, now.display(), b.commit))?;
    said("device", &a.device, &b.device)?;
    said("protocol", &a.protocol, &b.protocol)?;
    said("environment", &a.environment, &b.environment)?;
    let mut pairs = 0;
    for run in &b.runs {
        let same = |old: &&Run| (&old.scene, &old.method) == (&run.scene, &run.method);
        let Some(old) = a.runs.iter().find(same) else {
            line(format!("\n{}, {}: not measured before", run.scene, run.method))?;
            continue;
        };
        compare(old, run)?;
        pairs += 1;
    }
    if pairs == 0 {
        return Err("these figures have no scene and method in common: measure the same ones".into());
    }
    Ok(())
}

/// What was measured with something else, which times would be compared across.
fn said(what: &str, before: &Map<String, Value>, now: &Map<String, Value>) -> Result<(), NotWritten> {
    let names: std::collections::BTreeSet<_> = before.keys().chain(now.keys()).collect();
    for name in names.into_iter().filter(|name| before.get(*name) != now.get(*name)) {
        let [old, new] = [before, now].map(|map| map.get(name).map_or("nothing".to_owned(), Value::to_string));
        line(format!("NOT THE SAME {what}: {name} was {old}, is {new}"))?;
    }
    Ok(())
}

fn compare(before: &Run, now: &Run) -> Result<(), NotWritten> {
    line(format!("\n{}, {}: {} particles", now.scene, now.method, now.particles))?;
    if before.particles != now.particles {
        line(format!("NOT THE SAME scene: it had {} particles", before.particles))?;
    }
    said("settings", &before.settings, &now.settings)?;
    line(format!("{:<34} {:>10} {:>10} {:>7}  beyond the noise", "pass, medians in ms", "before", "now", "ratio"))?;
    let row = |name: &str, times: [Option<Times>; 2]| {
        let cells = times.map(|t| t.map_or("-".to_owned(), |t| format!("{:.3}", t.median_ms)));
        let (ratio, verdict) = match times {
            [Some(a), Some(b)] => (format!("{:.3}", b.median_ms / a.median_ms), a.verdict(b)),
            [None, _] => ("-".into(), "new"),
            [_, None] => ("-".into(), "gone"),
        };
        line(format!("{name:<34} {:>10} {:>10} {ratio:>7}  {verdict}", cells[0], cells[1]).trim_end())
    };
    let of = |run: &Run, pass: &str| run.passes.iter().find(|p| p.pass == pass).map(|p| p.ms);
    for pass in &now.passes {
        row(&pass.pass, [of(before, &pass.pass), Some(pass.ms)])?;
    }
    for pass in before.passes.iter().filter(|p| of(now, &p.pass).is_none()) {
        row(&pass.pass, [Some(pass.ms), None])?;
    }
    if before.preparation.median_ms + now.preparation.median_ms > 0.0 {
        row("= preparation", [Some(before.preparation), Some(now.preparation)])?;
    }
    row("= frame, first to last timestamp", [Some(before.frame_span), Some(now.frame_span)])?;
    if before.bytes_per_particle != now.bytes_per_particle {
        line(format!("bytes a particle: {:.1}, now {:.1}", before.bytes_per_particle, now.bytes_per_particle))?;
    }
    Ok(())
}
