//! The command line as a user meets it: what it writes, what it refuses, and how it says so.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

struct Run {
    folder: tempfile::TempDir,
}

impl Run {
    fn new() -> Run {
        Run { folder: tempfile::tempdir().expect("temporary folder") }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        fs::write(self.path(name), content).expect("written");
        self.path(name).to_string_lossy().into_owned()
    }

    fn command(&self, args: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_meniscus"))
            .args(args)
            .current_dir(self.folder.path())
            .output()
            .expect("meniscus starts")
    }

    /// Renders small, with validation, and expects success.
    fn render(&self, args: &[&str]) -> String {
        let mut all = vec!["render", "-o", "out.png", "--size", "96x72", "--validate"];
        all.extend(args);
        let output = self.command(&all);
        let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{all:?}: {text}");
        text
    }

    /// Expects a refusal with this exit code, whose message holds all of `words`, and that leaves no file behind.
    fn refused(&self, code: i32, args: &[&str], words: &[&str]) {
        let before = listing(self.folder.path());
        let output = self.command(args);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {text}");
        assert!(!text.contains("panicked"), "{args:?}: {text}");
        for w in words {
            assert!(text.contains(w), "{args:?}: no \"{w}\" in: {text}");
        }
        assert_eq!(listing(self.folder.path()), before, "{args:?} left something behind");
    }

    fn pixels(&self, name: &str) -> Vec<u8> {
        image::open(self.path(name)).expect("a picture").to_rgb8().into_raw()
    }
}

fn listing(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .expect("folder")
        .map(|e| e.expect("entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// A little block of particles at spacing 0.1, and one droplet above it; text columns.
fn block(offset: f64) -> String {
    let mut text = String::from("x,y,z\n");
    for i in 0..6 * 6 * 6 {
        let (x, y, z) = (i % 6, i / 6 % 6, i / 36);
        text += &format!("{},{},{}\n", offset + 0.1 * f64::from(x), 0.1 * f64::from(y), 0.1 * f64::from(z));
    }
    text + &format!("{},1.0,0.25\n", offset + 0.25)
}

#[test]
fn the_embedded_scene_renders() {
    let run = Run::new();
    let text = run.render(&[]);
    assert!(text.contains("device:") && text.contains("embedded scene"), "{text}");
    let pixels = run.pixels("out.png");
    assert_eq!(pixels.len(), 96 * 72 * 3);
    assert!(pixels.iter().any(|p| *p > 128) && pixels.iter().any(|p| *p < 128), "a picture has light and dark");
    assert_eq!(listing(run.folder.path()), ["out.png"]);
}

#[test]
fn stats_and_dump_are_complete() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    run.render(&[&block, "--stats", "stats.json", "--dump", "dump", "--radius", "0.05"]);
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(run.path("stats.json")).unwrap()).unwrap();
    for key in ["device", "particles", "gpu", "memory", "patterns", "outcomes", "guards", "frame"] {
        assert!(!stats[key].is_null(), "stats have no {key}");
    }
    assert_eq!(stats["particles"]["splash"], 1);
    let pixels: u64 = stats["patterns"].as_object().unwrap().values().map(|v| v.as_u64().unwrap()).sum();
    assert_eq!(pixels, 96 * 72);
    for name in ["splash", "body"].iter().flat_map(|c| ["front", "back"].map(|s| format!("{c}_{s}"))) {
        assert!(run.path(&format!("dump/{name}_depth_raw.npy")).exists(), "{name}");
        assert!(run.path(&format!("dump/{name}_normal_raw.npy")).exists(), "{name}");
    }
    for name in [
        "body_front_depth",
        "body_back_normal",
        "pattern",
        "outcome",
        "hits",
        "path_length",
        "final_direction",
        "color_linear",
    ] {
        assert!(run.path(&format!("dump/{name}.npy")).exists(), "{name}");
    }
    let frame: serde_json::Value = serde_json::from_slice(&fs::read(run.path("dump/frame.json")).unwrap()).unwrap();
    assert_eq!(frame["width"], 96);
    // What was drawn can be drawn again: the dumped particles give the same picture.
    let first = run.pixels("out.png");
    run.render(&["dump/particles.npz", "--radius", "0.05"]);
    let second = run.pixels("out.png");
    let differ = first.iter().zip(&second).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert!(differ * 100 < first.len(), "{differ} of {} values differ", first.len());
}

#[test]
fn particles_are_prepared_on_the_device_as_on_the_cpu() {
    let run = Run::new();
    let particles = |prepare: &str| {
        run.render(&["--prepare", prepare, "--stats", "stats.json", "--dump", prepare]);
        let stats: serde_json::Value =
            serde_json::from_slice(&fs::read(run.path("stats.json")).expect("stats")).expect("JSON");
        assert!(run.path(prepare).join("particles.npz").exists());
        let guards = ["few_neighbours", "degenerate"].map(|g| stats["guards"][format!("ellipsoid_{g}")].clone());
        let passes = stats["gpu"]["passes"].as_array().expect("passes").iter();
        let on_device = passes.filter(|p| ["extent", "sort", "shape"].map(Some).contains(&p["pass"].as_str())).count();
        (stats["particles"]["splash"].clone(), stats["particles"]["body"].clone(), guards, on_device)
    };
    let (cpu, gpu, relation) = (particles("cpu"), particles("gpu"), particles("gpu-relation"));
    assert!(cpu.1.as_u64() > Some(20_000) && cpu.3 == 0 && gpu.3 == 3 && relation.3 == 3);
    assert_eq!((&cpu.0, &cpu.1, &cpu.2), (&gpu.0, &gpu.1, &gpu.2));
    assert_eq!((&cpu.0, &cpu.1, &cpu.2), (&relation.0, &relation.1, &relation.2));
}

/// However many neighbours there are, all of them are listed.
#[test]
fn neighbours_are_dumped() {
    let run = Run::new();
    let spot = run.file("spot.csv", "x,y,z\n".to_string() + &"0.1,0.2,0.3\n".repeat(400));
    run.render(&[&spot, "--radius", "0.05", "--prepare", "gpu", "--dump", "d", "--dump-neighbours"]);
    let mut npz = npyz::npz::NpzArchive::open(run.path("d/neighbours.npz")).expect("archive");
    let offsets: Vec<u64> = npz.by_name("offsets").expect("read").expect("there").into_vec().expect("u64");
    let indices: Vec<u32> = npz.by_name("indices").expect("read").expect("there").into_vec().expect("u32");
    assert!(offsets.iter().enumerate().all(|(i, o)| *o == 400 * i as u64) && offsets.len() == 401, "{offsets:?}");
    assert!(indices.chunks(400).all(|list| list.iter().copied().eq(0..400)));
}

#[test]
fn bench_writes_figures_and_refuses_validation() {
    let run = Run::new();
    let csv = run.file("cloud.csv", block(0.0));
    let small = ["--size", "64x48", "--frames", "2", "--warmup", "1"];
    let bench = |more: &[&str]| run.command(&[&["bench"], &small[..], more].concat());
    let done = bench(&[&csv, "--scaling", "--max-particles", "10000", "-o", "bench.json"]);
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
    assert!(table.starts_with("scene,particles,pass,median_ms") && table.contains(",shape,"), "{table}");

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

#[test]
fn only_what_a_scene_needs_is_there() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let memory = |args: &[&str]| {
        let mut all = vec![block.as_str(), "--radius", "0.05", "--stats", "stats.json"];
        all.extend(args);
        run.render(&all);
        let stats: serde_json::Value = serde_json::from_slice(&fs::read(run.path("stats.json")).unwrap()).unwrap();
        let names: Vec<String> =
            stats["memory"].as_array().unwrap().iter().map(|e| e["resource"].as_str().unwrap().into()).collect();
        let passes: Vec<String> =
            stats["gpu"]["passes"].as_array().unwrap().iter().map(|e| e["pass"].as_str().unwrap().into()).collect();
        (names, passes, stats["memory_total"].as_u64().unwrap())
    };
    let (all, passes, total) = memory(&[]);
    assert!(all.iter().any(|n| n == "splash depth") && passes.iter().any(|p| p == "splash back"));
    let (names, passes, less) = memory(&["--splash-threshold", "0"]);
    assert!(!names.iter().chain(&passes).any(|n| n.contains("splash")), "{names:?} {passes:?}");
    assert!(less < total);
    let (_, passes, front_only) = memory(&["--refractions", "1"]);
    assert!(!passes.iter().any(|p| p.contains("back")), "{passes:?}");
    assert!(front_only < total);
}

#[test]
fn pictures_do_not_depend_on_the_order_of_particles() {
    let run = Run::new();
    let ordered = block(0.0);
    let mut lines: Vec<_> = ordered.lines().skip(1).collect();
    let a = run.file("a.csv", &ordered);
    run.render(&[&a, "--radius", "0.05"]);
    let first = run.pixels("out.png");
    lines.reverse();
    lines.swap(3, 40);
    let b = run.file("b.csv", format!("x,y,z\n{}\n", lines.join("\n")));
    run.render(&[&b, "--radius", "0.05"]);
    assert!(first == run.pixels("out.png"), "shuffled particles give another picture");
}

#[test]
fn far_coordinates_are_as_good_as_near_ones() {
    let run = Run::new();
    let near = run.file("near.csv", block(0.0));
    let far = run.file("far.csv", block(1e6));
    run.render(&[&near, "--radius", "0.05"]);
    let first = run.pixels("out.png");
    run.render(&[&far, "--radius", "0.05"]);
    let second = run.pixels("out.png");
    let differ = first.iter().zip(&second).filter(|(a, b)| a.abs_diff(**b) > 8).count();
    assert!(differ * 50 < first.len(), "{differ} of {} values differ", first.len());
}

#[test]
fn a_camera_inside_the_liquid_sees_out() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    run.render(&[
        &block,
        "--radius",
        "0.05",
        "--eye",
        "0.25,0.25,0.25",
        "--target",
        "0.25,0.3,1",
        "--stats",
        "s.json",
        "--dump",
        "d",
    ]);
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(run.path("s.json")).unwrap()).unwrap();
    assert_eq!(stats["frame"]["eye_inside"], true);
    // Between particles at the block's far side a ray may meet no back at all.
    assert!(stats["patterns"]["no liquid"].as_u64().unwrap() < 96 * 72 / 100, "{}", stats["patterns"]);
}

#[test]
fn no_particles_give_the_background_and_say_so() {
    let run = Run::new();
    let empty = run.file("none.csv", "x,y,z\n");
    let text = run.render(&[&empty, "--stats", "s.json", "--dump", "d"]);
    assert!(text.contains("only the background"), "{text}");
}

#[test]
fn exr_and_supersampling_work() {
    let run = Run::new();
    let output =
        run.command(&["render", "-o", "out.exr", "--size", "64x48", "--supersample", "3", "--refractions", "2"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let picture = image::open(run.path("out.exr")).expect("an EXR").to_rgb32f();
    assert_eq!(picture.dimensions(), (64, 48));
    assert!(picture.as_raw().iter().all(|v| v.is_finite() && *v >= 0.0));
}

#[test]
fn an_environment_map_is_seen() {
    let run = Run::new();
    // Red above, green below.
    let map =
        image::RgbImage::from_fn(64, 32, |_, y| if y < 16 { image::Rgb([255, 0, 0]) } else { image::Rgb([0, 255, 0]) });
    map.save(run.path("env.png")).unwrap();
    let none = run.file("none.csv", "x,y,z\n");
    run.render(&[&none, "--env", "env.png", "--eye", "0,0,5", "--target", "0,0,0"]);
    let pixels = run.pixels("out.png");
    assert_eq!(&pixels[..3], &[255, 0, 0], "up is up");
    assert_eq!(&pixels[pixels.len() - 3..], &[0, 255, 0], "down is down");
}

#[test]
fn bad_files_are_refused() {
    let run = Run::new();
    let empty = run.file("empty.vtk", "");
    let text = run.file("text.vtk", "this is no particle file\n");
    let torn = run.file("torn.csv", "x,y,z\n1,2\n");
    let nan = run.file("nan.csv", "x,y,z\n0,0,0\nnan,1,1\n0.1,0,0\n");
    let words = run.file("words.csv", "x,y,z\na,b,c\n");
    let env = run.file("env.hdr", "#?RADIANCE\n");
    let out = ["render", "-o", "out.png", "--size", "64x48"];
    let with = |extra: &[&str]| -> Vec<String> { out.iter().chain(extra).map(|s| (*s).to_owned()).collect() };
    let check = |extra: &[&str], words: &[&str]| {
        let all = with(extra);
        run.refused(1, &all.iter().map(String::as_str).collect::<Vec<_>>(), words);
    };
    check(&["missing.vtk"], &["missing.vtk", "no such file"]);
    check(&[&empty], &["empty.vtk"]);
    check(&[&text], &["text.vtk"]);
    check(&[&torn], &["torn.csv", "line 2"]);
    check(&[&words], &["words.csv", "line 2"]);
    check(&[&nan], &["nan.csv", "--drop-invalid"]);
    check(&["particles.xyzzy"], &["xyzzy"]);
    check(&[run.folder.path().to_str().unwrap()], &["directory"]);
    check(&["--env", &env], &["env.hdr"]);
    check(&["--env", "no.exr"], &["no.exr"]);
    run.render(&[&nan, "--drop-invalid", "--radius", "0.05"]);
}

#[test]
fn bad_parameters_are_refused() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let refuse = |code: i32, extra: &[&str], words: &[&str]| {
        let mut all = vec!["render", block.as_str(), "-o", "out.png"];
        all.extend(extra);
        run.refused(code, &all, words);
    };
    refuse(1, &["--radius", "0"], &["radius"]);
    refuse(1, &["--radius", "-1"], &["radius"]);
    refuse(1, &["--radius", "nan"], &["radius"]);
    refuse(1, &["--size", "0x48"], &["size", "1 to"]);
    refuse(1, &["--size", "64x999999"], &["size", "1 to"]);
    refuse(2, &["--size", "64"], &["WIDTHxHEIGHT"]);
    refuse(2, &["--eye", "1,2"], &["three finite numbers"]);
    refuse(2, &["--supersample", "4"], &["supersample"]);
    refuse(1, &["--refractions", "3"], &["refractions", "1, 2 or 4"]);
    refuse(1, &["--window", "8"], &["window", "odd"]);
    refuse(1, &["--window", "27"], &["window", "25"]);
    refuse(1, &["--sigma", "0"], &["sigma"]);
    refuse(1, &["--ior", "1"], &["index of refraction"]);
    refuse(1, &["--absorption", "-1,0,0"], &["absorption"]);
    refuse(1, &["--fov-y", "180"], &["fov-y"]);
    refuse(1, &["--up", "0,0,0"], &["up"]);
    refuse(1, &["--eye", "0,0,0", "--target", "0,0,0"], &["eye and target"]);
    refuse(3, &["--device", "no such device"], &["no such device", "meniscus info"]);
    run.refused(1, &["render", "-o", "out.gif"], &["out.gif", ".png"]);
    run.refused(1, &["render", "-o", "nowhere/out.png", "--size", "64x48"], &["nowhere/out.png"]);
    run.refused(2, &["render"], &["--output"]);
}

#[test]
fn without_a_device_it_says_so() {
    let run = Run::new();
    for command in [&["render", "-o", "out.png"][..], &["info"]] {
        let output = Command::new(env!("CARGO_BIN_EXE_meniscus"))
            .args(command)
            .current_dir(run.folder.path())
            .env("VK_DRIVER_FILES", "/nonexistent.json")
            .env("VK_ICD_FILENAMES", "/nonexistent.json")
            .env_remove("VK_ADD_DRIVER_FILES")
            .output()
            .expect("meniscus starts");
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{command:?}: {text}");
        assert!(text.contains("mesa-vulkan-drivers"), "{command:?}: {text}");
    }
    assert!(listing(run.folder.path()).is_empty());
}

#[test]
fn info_lists_devices_and_formats() {
    let output = Run::new().command(&["info"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains(".bgeo") && text.contains("usable: yes"), "{text}");
}
