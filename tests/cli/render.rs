//! Pictures, statistics and dumps.

use crate::{Run, block, listing};
use std::fs;

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
    run.render(&[&block, "--method", "imai16", "--stats", "stats.json", "--dump", "dump", "--radius", "0.05"]);
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(run.path("stats.json")).unwrap()).unwrap();
    for key in ["device", "particles", "gpu", "memory", "patterns", "outcomes", "guards", "frame"] {
        assert!(!stats[key].is_null(), "stats have no {key}");
    }
    assert_eq!(stats["particles"]["splash"], 1);
    let pixels: u64 = stats["patterns"].as_object().unwrap().values().map(|v| v.as_u64().unwrap()).sum();
    assert_eq!(pixels, 96 * 72);
    for name in ["splash", "body"].iter().flat_map(|c| ["front", "back"].map(|s| format!("{c}_{s}"))) {
        assert!(run.path(&format!("dump/{name}_depth_raw.npy")).exists(), "{name}");
        // Where a ray leaves a splash is known of the splash.
        let normal = run.path(&format!("dump/{name}_normal_raw.npy"));
        assert_eq!(normal.exists(), name != "splash_back", "{name}");
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
    let said = run.render(&["dump/particles.npz", "--method", "imai16", "--radius", "0.05"]);
    assert!(!said.contains("note:"), "{said}");
    let second = run.pixels("out.png");
    let differ = first.iter().zip(&second).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert!(differ * 100 < first.len(), "{differ} of {} values differ", first.len());
    // Of another radius its splash is another ball than the one it brings.
    let args = ["dump/particles.npz", "--radius", "0.04", "--stats", "stats.json"];
    let output = run.command(&[&["render", "-o", "out.png", "--size", "96x72"], &args[..]].concat());
    assert!(output.status.success(), "{}", crate::text(&output));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("note: 1 splash particles have axes of their own in dump/particles.npz"), "{said}");
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(run.path("stats.json")).unwrap()).unwrap();
    assert_eq!(stats["particles"]["splash_axes_ignored"], 1);
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
fn only_what_a_scene_needs_is_there() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let memory = |args: &[&str]| {
        let mut all = vec![block.as_str(), "--method", "imai16", "--radius", "0.05", "--stats", "stats.json"];
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
    assert!(all.iter().any(|n| n == "splash depth") && passes.iter().any(|p| p == "splash front"));
    let (names, passes, less) = memory(&["--splash-threshold", "0"]);
    assert!(!names.iter().chain(&passes).any(|n| n.contains("splash")), "{names:?} {passes:?}");
    assert!(less < total);
    let (_, passes, front_only) = memory(&["--optics", "one"]);
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

/// Whether the eye is in the liquid is found out where particles are prepared, by maps, which have to be told.
#[test]
fn the_eye_is_looked_for_where_particles_are_prepared() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let eye = ["--eye", "0.25,0.25,0.25", "--target", "0.25,0.3,1", "--stats", "s.json"];
    for (prepare, method, on_device) in
        [("cpu", "imai16", false), ("gpu", "imai16", true), ("gpu-relation", "imai16", true), ("gpu", "field", false)]
    {
        let args = [&block, "--radius", "0.05", "--prepare", prepare, "--method", method];
        run.render(&[&args[..], &eye].concat());
        let stats: serde_json::Value = serde_json::from_slice(&fs::read(run.path("s.json")).unwrap()).unwrap();
        let mut passes = stats["gpu"]["passes"].as_array().expect("passes").iter();
        assert_eq!(passes.any(|p| p["pass"] == "eye"), on_device, "{prepare}, {method}");
    }
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
    let output = run.command(&["render", "-o", "out.exr", "--size", "64x48", "--supersample", "3", "--optics", "two"]);
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

/// What dumps hold stands in no list that a new target could be missing from: all that is written replaces an older dump.
#[test]
fn every_method_is_dumped() {
    let run = Run::new();
    let row: String = (0..40).map(|i| format!("{},0.1,0,{},0,0\n", 0.05 * f64::from(i), i)).collect();
    let moving = run.file("moving.csv", format!("x,y,z,vx,vy,vz\n{row}"));
    for (args, names) in [
        (&["--method", "cords08", "--spray", "0.8"][..], &["speed", "body_front_missing_silhouette"][..]),
        (&["--method", "imai14"], &["nearest_and_farthest", "body_back_depth_last_step"]),
        (&["--method", "green10"], &["thickness", "body_front_depth_last_step"]),
        (&["--method", "imai16"], &["walls", "body_front_depth_last_step", "body_back_depth"]),
        (&[], &["field_bricks", "field_held", "final_direction"]),
    ] {
        run.render(&[&[&moving, "--radius", "0.05", "--dump", "d"], args].concat());
        let mut files = listing(&run.path("d"));
        assert!(names.iter().all(|n| files.contains(&format!("{n}.npy"))), "{args:?}: {files:?}");
        let frame: serde_json::Value = serde_json::from_slice(&fs::read(run.path("d/frame.json")).unwrap()).unwrap();
        let said = frame["files_of_this_dump"].as_array().expect("names");
        files.sort_by_key(|name| said.iter().position(|s| s == name));
        assert!(said.iter().eq(&files), "{said:?} {files:?}");
    }
}

/// What is counted in pixels grows with the picture, and no published choice outgrows its range.
#[test]
fn every_preset_can_be_supersampled() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    for preset in meniscus::PRESETS {
        let args =
            ["--method", preset.name, "--size", "16x12", "--supersample", "3", "--radius", "0.05", "-o", "a.png"];
        let output = run.command(&[&["render", &block], &args[..]].concat());
        assert!(output.status.success(), "{}: {}", preset.name, crate::text(&output));
    }
}

/// Where the near plane lies inside particles a dump says so, and does not take it for no liquid.
#[test]
fn dumps_keep_where_the_near_plane_cuts() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    run.render(
        &[
            &[&block, "--method", "imai16", "--radius", "0.05", "--dump", "d", "--optics", "one"][..],
            &["--eye", "0.2,0.2,0.2", "--target", "0.2,0.25,1"],
        ]
        .concat(),
    );
    let bytes = fs::read(run.path("d/body_front_depth_raw.npy")).expect("there");
    let depths: Vec<f32> = npyz::NpyFile::new(&bytes[..]).expect("a map").into_vec().expect("floats");
    let frame: serde_json::Value = serde_json::from_slice(&fs::read(run.path("d/frame.json")).unwrap()).unwrap();
    let near = frame["near"].as_f64().expect("a length") as f32;
    assert!(depths.iter().any(|d| *d < 0.0), "the eye is inside a particle");
    assert!(depths.iter().all(|d| d.is_nan() || *d > 0.0 || (*d + near).abs() < 1e-6 * near), "-near");
}

/// A filter that leaves nothing is named; statistics of walks are none where optics do not walk.
#[test]
fn droplets_that_a_filter_cuts_away_are_told_from_none() {
    let run = Run::new();
    let three = run.file("three.csv", "x,y,z\n0,0,0\n1,0,0\n0.5,1,0\n");
    let said = run.render(&[&three, "--radius", "0.05", "--method", "cords08", "--stats", "s.json"]);
    assert!(said.contains("no liquid") && said.contains("filter binomial") && !said.contains("--radius"), "{said}");
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(run.path("s.json")).unwrap()).unwrap();
    assert!(stats["patterns"].is_null() && stats["outcomes"].is_null(), "{stats}");
    let guards = stats["guards"].as_object().expect("guards");
    assert!(guards.contains_key("ellipsoid_degenerate") && !guards.contains_key("splash"), "{guards:?}");
    assert!(!guards.contains_key("walk_normal_faced_the_wrong_way"), "{guards:?}");
    let said = run.render(&[&three, "--radius", "0.05", "--method", "cords08", "--silhouette-map", "false"]);
    assert!(!said.contains("no liquid"), "{said}");
}
