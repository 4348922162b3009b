//! `bench`: figures that say what they were measured with.

use crate::{Run, block, text};
use std::{fs, process::Command};

#[test]
fn bench_writes_figures_and_refuses_validation() {
    let run = Run::new();
    let csv = run.file("cloud.csv", block(0.0));
    let small = ["--size", "64x48", "--frames", "2", "--warmup", "1"];
    let bench = |more: &[&str]| run.command(&[&["bench"], &small[..], more].concat());
    let done = bench(&[&csv, "--method", "imai16", "--scaling", "--max-particles", "10000", "-o", "bench.json"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let figures: serde_json::Value =
        serde_json::from_slice(&fs::read(run.path("bench.json")).expect("written")).expect("JSON");
    assert_eq!(figures["runs"].as_array().map(Vec::len), Some(3), "the file and two blocks");
    for r in figures["runs"].as_array().expect("runs") {
        let ms = |what: &str, q: &str| r[what][q].as_f64().expect("a number");
        assert!(ms("frame_span", "p5_ms") > 0.0 && ms("frame_span", "p5_ms") <= ms("frame_span", "p95_ms"));
        assert!(ms("sum_of_passes", "median_ms") <= 1.01 * ms("frame_span", "median_ms"));
        assert!(ms("preparation", "median_ms") > 0.0);
    }
    assert!(figures["runs"][2]["bytes_per_particle"].as_f64().expect("a number") <= 96.0);
    assert!(figures["growth"]["exponent"].as_f64().is_some());
    for key in ["device", "protocol", "commit", "command"] {
        assert!(!figures[key].is_null(), "{key}");
    }
    assert!(bench(&[&csv, "-o", "bench.csv"]).status.success());
    let table = fs::read_to_string(run.path("bench.csv")).expect("written");
    assert!(table.starts_with("scene,method,particles,pass,median_ms") && table.contains(",shape,"), "{table}");
    let widths: Vec<_> =
        csv::Reader::from_reader(table.as_bytes()).records().map(|r| r.expect("a row").len()).collect();
    assert!(widths.len() > 8 && widths.iter().all(|w| *w > 25), "{widths:?}");

    run.refused(1, &["bench", &csv, "-o", "bench.txt"], &["bench.txt", ".json"]);
    run.refused(1, &["bench", "missing.vtk"], &["missing.vtk"]);
    run.refused(2, &["bench", "--frames", "0"], &["frames"]);
    run.refused(1, &["bench", "--scaling", "--max-particles", "10"], &["--max-particles 10", "1000"]);
    run.refused(1, &["render", &csv, "-o", "out.png", "--dump", "d", "--dump-neighbours"], &["--prepare gpu"]);
    let output = Command::new(env!("CARGO_BIN_EXE_meniscus"))
        .args(["bench", &csv])
        .env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation")
        .output()
        .expect("meniscus starts");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && text.contains("validation is on"), "{text}");
}

/// What a message advises can be done, and what was asked for is recorded.
#[test]
fn bench_has_the_options_that_decide_a_picture() {
    let run = Run::new();
    let one = run.file("one.csv", "x,y,z\n0,0,0\n");
    let nan = run.file("nan.csv", "x,y,z\n0,0,0\nnan,1,1\n0.1,0,0\n");
    run.refused(1, &["bench", &one], &["one.csv", "--radius"]);
    run.refused(1, &["bench", &nan], &["nan.csv", "--drop-invalid"]);
    run.refused(1, &["bench", &one, "--radius", "-1"], &["one.csv", "radius"]);
    image::RgbImage::from_pixel(4, 2, image::Rgb([9, 9, 9])).save(run.path("sky.png")).expect("saved");
    let asked = "--radius 0.05 --drop-invalid --splash-threshold 0.3 --env sky.png --eye 0,0,5 --target 0,0,0 --up 1,0,0 \
                 --fov-y 20 --ior 1.5 --fresnel exact --sigma 4 --weighting euclidean --absorption 1,2,3 --window 7 \
                 --iterations 1 --optics two --internal-reflections 1 --occlusion-culling false --prepare cpu \
                 --env-rotate 30 \
                 --size 64x48 --frames 1 --warmup 1 -o b.json";
    let args: Vec<_> = ["bench", &one, &nan].into_iter().chain(asked.split_whitespace()).collect();
    run.succeeds(&args, &["b.json", "nan.csv", "one.csv", "sky.png"]);
    let figures: serde_json::Value =
        serde_json::from_slice(&fs::read(run.path("b.json")).expect("written")).expect("JSON");
    let run = &figures["runs"][1];
    assert_eq!(run["particles"], 2);
    let numbers = [("ior", 1.5), ("sigma", 4.0), ("window", 7.0), ("iterations", 1.0), ("internal_reflections", 1.0)];
    for (name, value) in numbers {
        assert_eq!(run["settings"][name].as_f64(), Some(value), "{name}");
    }
    assert_eq!(run["settings"]["absorption"], serde_json::json!([1, 2, 3]));
    assert_eq!((&run["settings"]["fresnel"], &run["settings"]["weighting"]), (&"exact".into(), &"euclidean".into()));
    assert_eq!(run["settings"]["occlusion_culling"], false);
    assert_eq!((&run["settings"]["optics"], &run["units"]["sigma"]), (&"two".into(), &"particle radii".into()));
    let asked = &figures["protocol"]["asked"];
    assert_eq!(asked["camera"]["eye"], serde_json::json!([0.0, 0.0, 5.0]));
    assert_eq!(asked["environment"], serde_json::json!({"file": "sky.png", "rotation": 30.0}));
    assert_eq!(asked["camera"]["fov_y"].as_f64(), Some(20.0));
    assert_eq!(figures["protocol"]["prepare"], "cpu");
}

/// Methods side by side: in one table, and each row and run with its name.
#[test]
fn bench_compares_methods() {
    let run = Run::new();
    let cloud = run.file("cloud.csv", block(0.0));
    let names: Vec<_> = meniscus::PRESETS.iter().map(|p| p.name).collect();
    let methods = names.join(",");
    let bench = |more: &[&str]| {
        let all = ["bench", &cloud, "--size", "64x48", "--frames", "2", "--warmup", "1", "--radius", "0.05"];
        let output = run.command(&[&all[..], more].concat());
        assert!(output.status.success(), "{more:?}: {}", text(&output));
        text(&output)
    };
    let said = bench(&["--methods", &methods, "-o", "b.json"]);
    let table: Vec<_> = said.lines().skip_while(|l| !l.contains("methods compared")).collect();
    for head in ["frame", "particles", "layers", "smooth", "optics", "MB"] {
        assert!(table[1].split_whitespace().any(|w| w == head), "no {head} in {said}");
    }
    for (row, name) in table[2..].iter().zip(&names) {
        assert!(row.starts_with(name) && row.split_whitespace().count() >= 7, "{row}");
    }
    let figures: serde_json::Value =
        serde_json::from_slice(&fs::read(run.path("b.json")).expect("written")).expect("JSON");
    let runs = figures["runs"].as_array().expect("runs");
    assert!(runs.iter().map(|r| r["method"].as_str()).eq(names.iter().map(|n| Some(*n))), "{runs:?}");
    for r in runs {
        let parts = r["parts"].as_object().expect("parts").values();
        let sum: f64 = parts.map(|p| p["median_ms"].as_f64().expect("a number")).sum();
        assert!(sum > 0.0, "{r}");
    }
    bench(&["--methods", &methods, "-o", "b.csv"]);
    let mut table = csv::Reader::from_path(run.path("b.csv")).expect("a table");
    let column = table.headers().expect("heads").iter().position(|h| h == "method").expect("a column");
    let rows: Vec<_> = table.records().map(|r| r.expect("a row")[column].to_owned()).collect();
    assert!(names.iter().all(|n| rows.iter().any(|r| r == n)), "{rows:?}");
    assert!(!bench(&["-o", "b.json"]).contains("methods compared"));
    run.refused(2, &["bench", "--methods", "imai16,nobody"], &["nobody", "imai16"]);
    run.refused(2, &["bench", "--methods", "imai16", "--method", "imai16"], &["--methods", "--method"]);
    run.refused(1, &["bench", "--methods", "imai16", "--smooth", "none", "--window", "7"], &["imai16", "window is 7"]);
}
