//! Frames as a trace that Perfetto (ui.perfetto.dev) and Chrome's `about:tracing` show: the Trace Event Format, one process for
//! each scene and method, and in it frames, their parts and their passes, one in the other; where the device's clock is known on
//! the host's, also what the host did, beside them.

use super::{OnHost, Run};
use meniscus::profile::{FrameTimes, PassTime};
use serde_json::{Value, json};
use std::time::Instant;

/// Between frames whose clock does not say how far they are apart, in milliseconds.
const GAP: f64 = 1.0;

/// All of it as JSON, zones in the order of their begin and, of those that begin together, the longer first.
pub fn of(runs: &[Run], device: &str) -> Result<Vec<u8>, serde_json::Error> {
    let mut events = Vec::new();
    for (process, run) in runs.iter().enumerate() {
        let mut label = |what: &str, thread: u32, name: &str| {
            events.push(json!({"ph": "M", "name": what, "pid": process, "tid": thread, "args": {"name": name}}));
        };
        label("process_name", DEVICE, &format!("{}, {}", run.scene, run.method));
        label("thread_name", DEVICE, device);
        let known = run.on_host.len() == run.frames.len();
        let starts = if known { starts_on_host(&run.on_host) } else { starts(&run.frames) };
        let mut zones: Vec<_> = starts.into_iter().zip(&run.frames).flat_map(zones).collect();
        if known {
            label("thread_name", HOST, "host");
            zones.extend(host_zones(&run.on_host));
        }
        zones.sort_by(|a, b| a.begin.total_cmp(&b.begin).then(b.ms.total_cmp(&a.ms)));
        events.extend(zones.iter().map(|zone| zone.event(process)));
    }
    serde_json::to_vec(&json!({"displayTimeUnit": "ms", "traceEvents": events}))
}

/// When frames begin, in milliseconds after the first.
fn starts(frames: &[FrameTimes]) -> Vec<f64> {
    let (mut start, mut all) = (0.0, Vec::new());
    for (i, frame) in frames.iter().enumerate() {
        if let Some(before) = i.checked_sub(1).map(|k| &frames[k]) {
            let apart = (frame.begin_ns - before.begin_ns) * 1e-6;
            // A clock of few bits begins anew.
            start += if apart >= before.span_ms { apart } else { before.span_ms + GAP };
        }
        all.push(start);
    }
    all
}

const DEVICE: u32 = 0;
const HOST: u32 = 1;
/// Kind of the zones of that thread.
const ON_HOST: &str = "host";

fn ms(from: Instant, to: Instant) -> f64 {
    1e3 * to.duration_since(from).as_secs_f64()
}

/// When frames begin on the device, in milliseconds after the host began to record the first.
fn starts_on_host(frames: &[OnHost]) -> Vec<f64> {
    frames.iter().map(|f| ms(frames[0].stages.begin, f.stages.begin) + f.device_ms).collect()
}

/// What the host did for each frame.
fn host_zones(frames: &[OnHost]) -> Vec<Zone> {
    let zones = |f: &OnHost| {
        let s = f.stages;
        let zone = |name: &str, from, to| Zone {
            name: name.into(),
            kind: ON_HOST,
            begin: ms(frames[0].stages.begin, from),
            ms: ms(from, to),
        };
        [
            zone("record", s.begin, s.recorded),
            zone("submit", s.recorded, s.submitted),
            zone("wait", s.submitted, s.done),
        ]
    };
    frames.iter().flat_map(zones).collect()
}

struct Zone {
    name: String,
    kind: &'static str,
    begin: f64,
    ms: f64,
}

impl Zone {
    fn event(&self, process: usize) -> Value {
        let (ts, dur) = (1e3 * self.begin, 1e3 * self.ms);
        let thread = if self.kind == ON_HOST { HOST } else { DEVICE };
        json!({"ph": "X", "name": self.name, "cat": self.kind, "pid": process, "tid": thread, "ts": ts, "dur": dur})
    }
}

/// Of one frame: itself, runs of passes of one part, and passes.
fn zones((start, frame): (f64, &FrameTimes)) -> Vec<Zone> {
    let mut all = vec![Zone { name: "frame".into(), kind: "frame", begin: start, ms: frame.span_ms }];
    let end = |p: &PassTime| p.begin_ms + p.ms;
    for passes in frame.passes.chunk_by(|a, b| a.part == b.part) {
        let (begin, part) = (passes[0].begin_ms, passes[0].part);
        let last = passes.iter().map(end).fold(begin, f64::max);
        all.push(Zone { name: part.into(), kind: "part", begin: start + begin, ms: last - begin });
        all.extend(passes.iter().map(|p| Zone {
            name: p.name.clone(),
            kind: "pass",
            begin: start + p.begin_ms,
            ms: p.ms,
        }));
    }
    all
}
