//! `truth` and `compare`.

use super::{Run, block, listing, text};
use std::{fs, process::Command, thread, time::Duration};

/// A tetrahedron.
const SOLID: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

const OUTPUTS: [&str; 10] = [
    "cache",
    "depth.npy",
    "final_direction.npy",
    "hits.npy",
    "normal.npy",
    "path_length.npy",
    "picture.exr",
    "picture.png",
    "truth.json",
    "variance.npy",
];

fn record(run: &Run, name: &str) -> serde_json::Value {
    serde_json::from_slice(&fs::read(run.path(name)).expect("a file")).expect("JSON")
}

#[test]
fn a_scene_has_a_truth_and_its_mesh_is_kept() {
    let run = Run::new();
    let particles = run.file("p.csv", block(0.0));
    let truth = |more: &[&str]| {
        let all = [&["truth", &particles, "--radius", "0.05", "--size", "48x36", "--samples", "32"], more].concat();
        let output = run.command(&all);
        assert!(output.status.success(), "{all:?}: {}", text(&output));
    };
    truth(&["-o", "a"]);
    assert_eq!(listing(&run.path("a")), OUTPUTS);
    let first = record(&run, "a/truth.json");
    let hash = first["surface"]["mesh"].as_str().expect("a hash");
    assert!(run.path(&format!("a/cache/mesh-{hash}.npz")).is_file());
    assert!(first["noise"]["relative_mse"].as_f64().is_some_and(|n| n > 0.0 && n < 1.0), "{first}");
    // The same mesh, by way of the cache and by its file, is the same picture.
    truth(&["-o", "b", "--cache", "a/cache"]);
    assert_eq!(record(&run, "b/truth.json")["surface"]["mesh"], hash);
    truth(&["-o", "c", "--mesh", &format!("a/cache/mesh-{hash}.npz")]);
    let picture = |folder: &str| fs::read(run.path(folder).join("picture.exr")).expect("a picture");
    assert_eq!(picture("a"), picture("b"));
    assert_eq!(picture("a"), picture("c"));
    // Another surface is another picture.
    truth(&["-o", "d", "--smoothing-passes", "0", "--cache", "a/cache"]);
    assert_ne!(picture("a"), picture("d"));
    let liquid = fs::read(run.path("a/hits.npy")).expect("hits");
    let values: Vec<f32> =
        liquid[liquid.len() - 4 * 48 * 36..].as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let met = values.iter().filter(|h| **h >= 1.0).count();
    assert!(met > 200 && met < 48 * 36, "{met} pixels show liquid");

    // Compared with itself, and with the other surface over the liquid.
    let same = run.command(&["compare", "a/picture.exr", "b/picture.exr"]);
    assert!(same.status.success() && text(&same).contains("0.00000"), "{}", text(&same));
    let args =
        ["compare", "a/picture.exr", "d/picture.png", "--mask", "a/depth.npy", "-o", "maps", "--json", "figures.json"];
    let other = run.command(&args);
    assert!(other.status.success(), "{}", text(&other));
    assert_eq!(listing(&run.path("maps")), ["flip.png", "flip_hdr.png", "relative_mse.png", "ssim.png"]);
    let figures = record(&run, "figures.json");
    assert_eq!(figures["liquid"]["pixels"], met);
    let flip = |part: &str| figures[part]["flip"].as_f64().expect("a number");
    assert!(flip("liquid") > flip("picture") && flip("picture") > 0.0, "{figures}");
}

/// Killed between passes and started again it goes on, to the same bits.
#[test]
fn what_was_killed_goes_on() {
    let run = Run::new();
    let args = |folder: &'static str| {
        [
            "truth",
            "--analytic",
            "stack",
            "--size",
            "96x72",
            "--absorption",
            "1,0.5,0.2",
            "--samples",
            "320",
            "-o",
            folder,
        ]
    };
    let whole = run.command(&args("whole"));
    assert!(whole.status.success(), "{}", text(&whole));
    let mut child = run.prepared(&args("cut")).spawn().expect("meniscus starts");
    let cache = run.path("cut/cache");
    for _ in 0..6000 {
        if cache.is_dir() && listing(&cache).iter().any(|name| name.starts_with("film-")) {
            break;
        }
        thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("killed");
    child.wait().expect("gone");
    assert!(!run.path("cut/truth.json").exists(), "it was done before it was killed: use more samples");
    let again = run.prepared(&args("cut")).output().expect("meniscus starts");
    assert!(again.status.success() && text(&again).contains("going on from"), "{}", text(&again));
    for name in ["picture.exr", "variance.npy", "final_direction.npy"] {
        let read = |folder: &str| fs::read(run.path(folder).join(name)).expect("a file");
        assert!(read("whole") == read("cut"), "{name} differs");
    }
}

#[test]
fn bad_input_is_refused_with_advice() {
    let run = Run::new();
    let none = run.file("none.csv", "x,y,z\n");
    let open = run.file("open.obj", &SOLID[..SOLID.len() - 8]);
    let empty = run.file("empty.obj", "v 0 0 0\n");
    let nan = run.file("nan.obj", SOLID.replacen("v 1 0 0", "v nan 0 0", 1));
    let turned = run
        .file("turned.obj", SOLID.replace("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4", "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3"));
    for (args, words) in [
        (&["--mesh", &open][..], &["open.obj", "open", "close the mesh"][..]),
        (&["--mesh", &empty], &["no triangles"]),
        (&["--mesh", &nan], &["nan.obj", "vertex"]),
        (&["--mesh", &turned], &["inside out", "turn its triangles"]),
        (&["--mesh", "gone.npz"], &["gone.npz", "check the path"]),
        (&[&none], &["no particles", "--mesh"]),
        (&["--analytic", "ball", "--device", "x"], &["leave out --device"]),
    ] {
        let all = [&["truth", "--size", "8x8", "--samples", "32", "-o", "out"], args].concat();
        run.refused(1, &all, words);
    }
    run.refused(2, &["truth", "--analytic", "cube", "-o", "out"], &["ball", "stack"]);
    run.refused(2, &["truth", "--samples", "20", "-o", "out"], &["multiple of 16"]);
    let file = run.file("file", "");
    run.refused(1, &["truth", "--analytic", "ball", "-o", &format!("{file}/x")], &["file", "cannot be written"]);

    let (a, b) = ("a.png", "b.png");
    image::RgbImage::new(8, 8).save(run.path(a)).expect("saved");
    image::RgbImage::new(9, 8).save(run.path(b)).expect("saved");
    run.refused(1, &["compare", a, b], &["8x8", "9x8", "one size"]);
    run.refused(1, &["compare", a, a, "--mask", b], &["b.png", "9x8"]);
    run.refused(1, &["compare", a, a, "--mask", a], &["mask", "no pixel"]);
    run.refused(1, &["compare", a, "none.exr"], &["none.exr", "check the path"]);
    run.refused(1, &["compare", a, a, "--json", a], &["at once"]);
    let text = run.file("text.exr", "no picture");
    run.refused(1, &["compare", a, &text], &["text.exr"]);
}

/// Killed in the middle and started again, a chart has the same errors, and the times that were measured before.
#[test]
fn a_chart_goes_on_and_shows_everything() {
    let run = Run::new();
    let particles = run.file("p.csv", block(0.0));
    let args = [
        "chart",
        &particles,
        "-o",
        "out",
        "--radius",
        "0.05",
        "--size",
        "64x48",
        "--methods",
        "imai16,green10,field",
        "--samples",
        "32",
        "--truth-width",
        "0,isosurface",
        "--frames",
        "1",
        "--rounds",
        "10",
        "--device",
        "llvmpipe",
        "--vary",
        "window=5,13",
        "optics=one",
    ];
    let points = run.path("out/points");
    let records = || {
        let names = if points.is_dir() { listing(&points) } else { Vec::new() };
        names.into_iter().filter(|n| n.ends_with(".json")).collect::<Vec<_>>()
    };
    let mut child = run.prepared(&args).spawn().expect("meniscus starts");
    while records().len() < 3 && child.try_wait().expect("a child").is_none() {
        thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("killed");
    child.wait().expect("gone");
    assert!(!run.path("out/chart.csv").exists(), "it was done before it was killed");
    let visits = |name: &str| {
        let point: serde_json::Value =
            serde_json::from_slice(&fs::read(points.join(name)).expect("a point")).expect("JSON");
        point["visits"].as_array().expect("visits").clone()
    };
    let before: Vec<_> = records().into_iter().map(|name| (visits(&name), name)).collect();
    assert!(!before.is_empty());
    let finish = || {
        let output = run.prepared(&args).output().expect("meniscus starts");
        assert!(output.status.success(), "{}", text(&output));
        fs::read_to_string(run.path("out/chart.csv")).expect("a table")
    };
    let table = finish();
    for (kept, name) in before {
        let now = visits(&name);
        assert!(now.len() == 10 && now.starts_with(&kept), "{name}");
    }
    let lines: Vec<Vec<&str>> = table.lines().map(|l| l.split(',').collect()).collect();
    // Each method as it is, and with what it has of the variations and their combinations; green10's front layer has no other optics that fits.
    let ways: Vec<_> = lines.iter().skip(1).map(|l| [l[1], l[2], l[3]].join(" ")).collect();
    let wanted =
        ["imai16  ", "green10  ", "imai16 window 5", "imai16 window 13", "green10 window 5", "imai16 optics one"];
    for way in wanted.into_iter().chain(["imai16 optics window one 5", "imai16 optics window one 13"]) {
        assert!(ways.iter().any(|w| w == way), "no {way} in {ways:?}");
    }
    assert!(lines.iter().skip(1).all(|l| l[4].parse::<f64>().is_ok_and(|ms| ms > 0.0) && l[7] == "10"), "{table}");
    // Every one of these has a surface of its own, about where the truth's is.
    let near =
        |l: &[&str]| l[17].parse::<f64>().is_ok_and(|iou| iou > 0.7) && l[19].parse::<f64>().is_ok_and(|r| r < 1.5);
    assert!(lines.iter().skip(1).all(|l| near(l)), "{table}");
    assert!(lines.iter().any(|l| l[14] == "true"), "nothing is on the front: {table}");
    // Why: all have a model of light, but only walks a search, which misses little; more light is followed by four than by one.
    let of = |way: &str, column: usize| -> Option<f64> {
        let row = lines.iter().find(|l| [l[1], l[2], l[3]].join(" ") == way).expect("a way");
        row[column].parse().ok()
    };
    let light = ["imai16  ", "imai16 optics one", "green10  "].map(|way| of(way, 21).expect("a light model"));
    assert!(light[0] > 0.001 && light[0] < 0.7 * light[1] && light[0] < 0.7 * light[2], "{light:?}");
    assert_eq!(of("imai16 window 5", 21), Some(light[0]));
    assert!(
        of("imai16  ", 23).is_some_and(|missed| missed < 10.0) && of("imai16  ", 24).is_some_and(|a| a < 0.1),
        "{table}"
    );
    assert!(
        of("field  ", 23).is_some_and(|missed| missed < 10.0) && of("field  ", 24).is_some_and(|a| a < 0.1),
        "{table}"
    );
    assert_eq!([of("green10  ", 23), of("green10  ", 24)], [None; 2]);
    // All of it is there: nothing is measured again, so the table is the same.
    assert_eq!(finish(), table);
    assert_eq!(listing(&run.path("out")), ["cache", "chart.csv", "p.png", "p.svg", "points", "report.html"]);
    let page = fs::read_to_string(run.path("out/report.html")).expect("a page");
    assert!(page.matches("data:image/png;base64,").count() == 2 * ways.len() + 1 && !page.contains("src=\"http"));
    assert!(page.contains("equal time") && page.contains("equal error") && page.contains("class=\"front\""));
    // In a real browser, where there is one: the page's own script has run and put pictures into the slider.
    let file = format!("file://{}", run.path("out/report.html").display());
    let browser =
        Command::new("chromium").args(["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", &file]).output();
    if let Ok(seen) = browser {
        let page = String::from_utf8_lossy(&seen.stdout).into_owned();
        let shown = ["class=\"under\"", "class=\"over\""].map(|class| {
            let image = page.split(class).nth(1).and_then(|rest| rest.split('>').next()).unwrap_or_default();
            image.contains("src=\"data:image/png;base64,")
        });
        assert!(page.contains("data-ready=\"yes\"") && shown == [true; 2], "the page's script failed: {:.2000}", page);
    }
    let svg = fs::read_to_string(run.path("out/p.svg")).expect("a chart");
    assert!(svg.contains("imai16") && svg.contains("0 smoothing passes") && svg.contains("isosurface"), "{svg}");
    run.refused(1, &["chart", &particles, "-o", "x", "--vary", "colour=1"], &["colour", "kernel_radius"]);
    run.refused(2, &["chart", "-o", "x", "--vary", "window"], &["NAME=VALUE"]);
}
