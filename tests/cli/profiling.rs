//! Figures for profilers: traces of frames, and what changed between two measurements.

use crate::{Run, block, text, workload::devices};
use meniscus::host::{Gpu, Instance};
use serde_json::{Value, json};
use std::{collections::BTreeSet, fs};

const SMALL: [&str; 6] = ["--size", "64x48", "--frames", "3", "--warmup", "1"];

/// Zones are in order, and each lies within the one it is nested in: frame, part, pass.
#[test]
fn a_trace_nests_passes_in_parts_in_frames() {
    let run = Run::new();
    let cloud = run.file("cloud.csv", block(0.0));
    let args =
        [&["bench", &cloud, "--methods", "field,imai16", "--trace", "trace.json", "-o", "b.json"], &SMALL[..]].concat();
    run.succeeds(&args, &["b.json", "cloud.csv", "trace.json"]);
    let (trace, figures) = (run.json("trace.json"), run.json("b.json"));
    let events = trace["traceEvents"].as_array().expect("events");
    let number = |e: &Value, key: &str| e[key].as_f64().unwrap_or_else(|| panic!("no {key} in {e}"));
    for (process, measured) in figures["runs"].as_array().expect("runs").iter().enumerate() {
        let own: Vec<_> = events.iter().filter(|e| e["pid"] == process).collect();
        let name = own.iter().find(|e| e["name"] == "process_name").expect("a name");
        assert!(name["args"]["name"].as_str().expect("text").ends_with(measured["method"].as_str().expect("text")));
        let zones: Vec<_> = own.iter().filter(|e| e["ph"] == "X").collect();
        assert!(zones.windows(2).all(|z| number(z[0], "ts") <= number(z[1], "ts")), "{zones:?}");
        let frames: Vec<_> = zones.iter().filter(|z| z["cat"] == "frame").collect();
        assert_eq!(frames.len(), 3);
        let end = |z: &Value| number(z, "ts") + number(z, "dur") + 1e-3;
        assert!(frames.windows(2).all(|f| end(f[0]) - 2e-3 < number(f[1], "ts")), "frames overlap: {frames:?}");
        let within = |z: &Value, cat: &str| {
            zones
                .iter()
                .any(|o| o["cat"] == cat && number(o, "ts") <= number(z, "ts") + 1e-3 && end(z) <= end(o) + 1e-3)
        };
        for zone in &zones {
            match zone["cat"].as_str() {
                Some("pass") => assert!(within(zone, "part"), "{zone} is in no part"),
                Some("part") => assert!(within(zone, "frame"), "{zone} is in no frame"),
                _ => {}
            }
        }
        // One after the other, as the device did them.
        let passes: Vec<_> = zones.iter().filter(|z| z["cat"] == "pass").collect();
        assert!(passes.windows(2).all(|p| end(p[0]) <= number(p[1], "ts") + 2e-3), "passes overlap: {passes:?}");
        // Passes are those of the figures, and as long.
        for pass in measured["passes"].as_array().expect("passes") {
            let of: Vec<_> = zones.iter().filter(|z| z["cat"] == "pass" && z["name"] == pass["pass"]).collect();
            let sum: f64 = of.iter().map(|z| number(z, "dur") * 1e-3).sum();
            let ms = |q: &str| pass["ms"][q].as_f64().expect("a number");
            // Of three frames two take the median or more, and the longest no more than this.
            let (median, longest) = (ms("median_ms"), ms("median_ms") + (ms("p95_ms") - ms("median_ms")) / 0.9);
            assert!(sum >= 1.999 * median && sum <= 2.0 * median + longest + 1e-3, "{pass}: {sum}");
        }
    }
    run.refused(1, &["bench", &cloud, "--trace", "trace.txt"], &["trace.txt", ".json"]);
    run.refused(1, &["bench", &cloud, "--trace", "a.json", "-o", "a.json"], &["a.json", "--trace"]);
}

/// On every driver that tells the time: each frame of the device's lies between its submission and the end of waiting for it.
#[test]
fn the_hosts_work_and_the_devices_are_on_one_axis() {
    let run = Run::new();
    let cloud = run.file("cloud.csv", block(0.0));
    let mut told = 0;
    for device in devices() {
        let instance = Instance::new(false).expect("an instance");
        let gpu = Gpu::profiled(&instance, instance.pick(Some(&device)).expect("it is there")).expect("a device");
        let tells = gpu.calibrate().expect("the time").is_some();
        println!("{device}: tells the time: {tells}; marks frames: {}", gpu.marks_frames());
        let output = run.command(&[&["bench", &cloud, "--device", &device, "--trace", "t.json"], &SMALL[..]].concat());
        assert!(output.status.success(), "{device}: {}", text(&output));
        let trace = run.json("t.json");
        let zones = trace["traceEvents"].as_array().expect("events").iter().filter(|e| e["ph"] == "X");
        let (host, own): (Vec<&Value>, Vec<_>) = zones.partition(|z| z["cat"] == "host");
        let number = |z: &Value, key: &str| z[key].as_f64().expect("a number");
        let end = |z: &Value| number(z, "ts") + number(z, "dur");
        assert_eq!(host.len(), if tells { 9 } else { 0 }, "{device}: record, submit, wait of three frames");
        let frames = own.iter().filter(|z| z["cat"] == "frame");
        for (stages, frame) in host.chunks(3).zip(frames) {
            let [record, submit, wait] = stages else { panic!("{stages:?}") };
            assert_eq!([record, submit, wait].map(|z| z["name"].as_str()), ["record", "submit", "wait"].map(Some));
            assert!(number(record, "ts") >= 0.0 && end(record) <= number(submit, "ts") + 1e-3, "{stages:?}");
            // The two clocks are compared to a few microseconds, unless somebody else had the processor just then.
            let (early, late) = (number(submit, "ts") - number(frame, "ts"), end(frame) - end(wait));
            assert!(early < 1000.0 && late < 1000.0, "{device}: {frame} is not between {submit} and {wait}");
            told += 1;
        }
        assert!(host.iter().all(|z| z["tid"] != own[0]["tid"]), "{device}");
    }
    assert!(told > 0 || !devices().iter().any(|d| d.contains("Mesa 25")), "Mesa 25 tells the time");
}

/// What a device counts is of the pass that it is printed for; one that counts nothing says so.
#[test]
fn passes_are_counted_by_the_device() {
    let run = Run::new();
    let cloud = run.file("cloud.csv", block(0.0));
    let mut counted = 0;
    for device in devices() {
        let args = ["bench", &cloud, "--statistics", "--size", "64x48", "--method", "imai16", "--device", &device];
        let output = run.command(&args);
        let said = text(&output);
        if !output.status.success() {
            assert!(output.status.code() == Some(1) && said.contains("pipelineStatisticsQuery"), "{device}: {said}");
            continue;
        }
        let counts = |pass: &str| -> Vec<u64> {
            let row = said.lines().find_map(|l| l.strip_prefix(&format!("{pass:<24}")));
            let row = row.unwrap_or_else(|| panic!("{device}: no {pass} in {said}"));
            row.split_whitespace().map(|n| n.parse().expect("a number")).collect()
        };
        let [vertices, vertex, before, after, fragments, compute] = counts("walk")[..] else { panic!("{said}") };
        // Each tile of the picture is a point, or two triangles, of tiles with liquid or of those without.
        assert!(vertices > 0 && (before == vertices || before == vertices / 3), "{device}: {said}");
        assert!(vertex > 0 && after <= before && after > 0, "{device}: {said}");
        assert!((64 * 48..2 * 64 * 48 + 8 * vertices).contains(&fragments) && compute == 0, "{device}: {fragments}");
        for pass in ["extent", "sort", "shape", "cull"] {
            let [.., fragments, compute] = counts(pass)[..] else { panic!("{said}") };
            // 217 particles, an invocation each or for four of them.
            assert!(fragments == 0 && compute >= 217 / 4, "{device}: {pass}: {compute}");
        }
        assert!(!said.contains("median"), "{device}: times of what was counted");
        counted += 1;
    }
    assert!(counted > 0, "no driver counts: lavapipe does");
    run.refused(2, &["bench", &cloud, "--statistics", "-o", "a.json"], &["--statistics", "--output"]);
}

/// A change within the noise is none; one beyond it is named, as is whatever was measured with something else.
#[test]
fn what_changed_is_told_from_noise() {
    let run = Run::new();
    let times = |median: f64| json!({"median_ms": median, "p5_ms": 0.9 * median, "p95_ms": 1.1 * median});
    let figures = |walk: f64, sort: f64, more: &str, device: &str| {
        let passes = [("sort", sort), ("walk", walk), (more, 1.0)];
        let passes = passes.map(|(name, ms)| json!({"pass": name, "ms": times(ms)}));
        let one = json!({"scene": "dam", "method": "field", "particles": 9, "settings": {"ior": 1.33}, "passes": passes,
            "preparation": times(sort), "frame_span": times(walk + sort + 1.0), "bytes_per_particle": 85.0});
        json!({"commit": "abc", "device": {"name": device}, "protocol": {"frames": 3}, "runs": [one]}).to_string()
    };
    let before = run.file("a.json", figures(10.0, 5.0, "old", "one"));
    let compare = |now: &str| {
        let output = run.command(&["bench", "--compare", &before, now]);
        assert!(output.status.success(), "{}", text(&output));
        text(&output)
    };
    let same = compare(&run.file("same.json", figures(11.0, 4.6, "old", "one")));
    assert!(!["slower", "faster", "NOT THE SAME", "new", "gone"].iter().any(|word| same.contains(word)), "{same}");
    let other = compare(&run.file("other.json", figures(20.0, 2.0, "fresh", "two")));
    let row =
        |name: &str| other.lines().find(|l| l.starts_with(name)).unwrap_or_else(|| panic!("no {name} in {other}"));
    for (name, end) in
        [("walk", "2.000  slower"), ("sort", "0.400  faster"), ("= frame", "slower"), ("fresh", "new"), ("old", "gone")]
    {
        assert!(row(name).ends_with(end), "{}", row(name));
    }
    assert!(row("NOT THE SAME device").contains("\"one\"") && other.contains("is \"two\""), "{other}");

    let broken = run.file("broken.json", "{}");
    run.refused(1, &["bench", "--compare", &before, &broken], &["broken.json", "commit", "bench -o"]);
    run.refused(1, &["bench", "--compare", &before, "missing.json"], &["missing.json"]);
    run.refused(2, &["bench", "--compare", &before], &["--compare"]);
    run.refused(2, &["bench", "--compare", &before, &before, "--frames", "3"], &["--compare"]);
}

/// docs/figures.md names every field, and none that is not there.
#[test]
fn fields_of_figures_are_documented() {
    fn names(value: &Value, open: &[&str], all: &mut BTreeSet<String>) {
        match value {
            Value::Array(values) => values.iter().for_each(|v| names(v, open, all)),
            Value::Object(fields) => {
                for (name, value) in fields {
                    all.insert(name.clone());
                    // What is in these has names of its own: of parts of a frame, of parameters, of scene files.
                    if !open.contains(&name.as_str()) {
                        names(value, open, all);
                    }
                }
            }
            _ => {}
        }
    }
    let run = Run::new();
    let cloud = run.file("cloud.csv", block(0.0));
    let args = [&["bench", &cloud, "--scaling", "--max-particles", "10000", "-o"], &["b.json"][..], &SMALL].concat();
    assert!(run.command(&args).status.success());
    let mut found = BTreeSet::new();
    names(&run.json("b.json"), &["parts", "settings", "units", "asked", "variables"], &mut found);
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/figures.md")).expect("docs/figures.md");
    let table = text.split("## JSON").nth(1).and_then(|t| t.split("## ").next()).expect("a section");
    let rows = table.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next());
    let documented: BTreeSet<_> =
        rows.flat_map(|path| path.rsplit('.').next()).map(|n| n.trim_end_matches("[]").to_owned()).collect();
    assert_eq!(documented, found);
    let args = [&["bench", &cloud, "-o", "b.csv"], &SMALL[..]].concat();
    assert!(run.command(&args).status.success());
    let mut csv = csv::Reader::from_path(run.path("b.csv")).expect("a table");
    let heads = csv.headers().expect("heads").clone();
    let columns = text.split("## CSV").nth(1).expect("a section");
    for head in heads.iter().take(15) {
        assert!(columns.contains(&format!("`{head}`")), "{head} is not in docs/figures.md");
    }
}

/// What `bench` writes can be compared.
#[test]
fn figures_that_were_written_are_compared() {
    let run = Run::new();
    let cloud = run.file("cloud.csv", block(0.0));
    let bench = |name: &str| run.command(&[&["bench", &cloud, "-o", name], &SMALL[..]].concat());
    assert!(bench("a.json").status.success() && bench("b.json").status.success());
    let output = run.command(&["bench", "--compare", "a.json", "b.json"]);
    let said = text(&output);
    assert!(output.status.success() && said.contains("= frame") && !said.contains("NOT THE SAME"), "{said}");
}
