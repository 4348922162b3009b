//! Scene files, and environments that turn.

use crate::{Run, block, text};
use std::fs;

/// A map in which no two columns are alike, turned by so many of its 64 columns.
fn map(turned: u32) -> image::RgbImage {
    image::RgbImage::from_fn(64, 32, |x, y| {
        let x = (x + turned) % 64;
        image::Rgb([(x * 4) as u8, (128 + 60 * (x / 8 % 2) + y) as u8, (255 - x * 3) as u8])
    })
}

/// What was saved is the whole picture, to the last bit, wherever it is read.
#[test]
fn saved_scenes_render_the_same_picture() {
    let run = Run::new();
    let near = run.file("near.csv", block(0.0));
    fs::create_dir(run.path("sub")).expect("folder");
    run.file("sub/far.csv", block(1e6) + "nan,1,1\n");
    map(0).save(run.path("sub/sky.png")).expect("saved");
    let all = "sub/far.csv --env sub/sky.png --env-rotate 33.3 --radius 0.05 --optics two --fresnel exact --window 7 \
               --supersample 2 --drop-invalid --splash-threshold 0.3 --up 0.1,1,0 --fov-y 33 --sigma 4.7 --ior 1.31 \
               --max-memory 1G --prepare gpu --smoothing 0.5 --max-semi-axis 1.1";
    let some = "sub/far.csv --drop-invalid --smooth none --target 1000000.1,0,0 --absorption 0.3,0.2,0.1";
    for args in ["", &format!("{near} --optics one"), all, some] {
        let first: Vec<_> = args.split_whitespace().chain(["--save-scene", "sub/s.toml", "--dump", "a"]).collect();
        run.render(&first);
        fs::rename(run.path("out.png"), run.path("first.png")).expect("moved");
        let saved = fs::read_to_string(run.path("sub/s.toml")).expect("written");
        assert!(!args.contains("far.csv") || saved.contains("particles = \"far.csv\""), "{saved}");
        // Of the size of `Run::render`'s, which is saved too.
        let output = run.command(&["render", "--scene", "sub/s.toml", "-o", "out.png", "--dump", "b"]);
        assert!(output.status.success(), "{args}: {}", text(&output));
        let again = run.command(&["render", "--scene", "sub/s.toml", "-o", "c.png", "--save-scene", "sub/again.toml"]);
        assert!(again.status.success(), "{args}: {}", text(&again));
        assert_eq!(fs::read_to_string(run.path("sub/again.toml")).expect("written"), saved, "{args}");
        let bytes = |name: &str| fs::read(run.path(name)).expect("there");
        assert!(bytes("first.png") == bytes("out.png"), "{args}: another picture");
        let maps = args.contains("--window").then_some("body_front_depth");
        for name in ["color_linear", "final_direction"].into_iter().chain(maps) {
            assert!(bytes(&format!("a/{name}.npy")) == bytes(&format!("b/{name}.npy")), "{args}: another {name}");
        }
    }
}

#[test]
fn bench_measures_a_scene_file() {
    let run = Run::new();
    run.file("cloud.csv", block(0.0));
    run.file(
        "s.toml",
        "particles = \"cloud.csv\"\nradius = 0.05\nsize = [32, 24]\nsupersample = 2\n[settings.method]\nsmooth.name = \"plane-fit\"\noptics.name = \"one\"\n",
    );
    let short = ["--frames", "1", "--warmup", "1"];
    let output = run.command(&[&["bench", "--scene", "s.toml", "-o", "b.json"], &short[..]].concat());
    assert!(output.status.success() && text(&output).contains("cloud.csv"), "{}", text(&output));
    let figures: serde_json::Value =
        serde_json::from_slice(&fs::read(run.path("b.json")).expect("written")).expect("JSON");
    assert_eq!(figures["runs"][0]["settings"]["optics"], "one");
    assert_eq!(figures["protocol"]["size"], serde_json::json!([32, 24]));
    // As it is drawn: at twice the size, with windows that cover the same part of it.
    assert_eq!(
        (&figures["protocol"]["supersample"], &figures["runs"][0]["settings"]["window"]),
        (&2.into(), &17.into())
    );
}

#[test]
fn bad_scene_files_are_refused() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let refuse = |content: &[u8], words: &[&str]| {
        run.file("s.toml", content);
        let words = [&["s.toml"], words].concat();
        run.refused(1, &["bench", "--scene", "s.toml", "-o", "out.json"], &words);
        run.refused(1, &["render", "--scene", "s.toml", "-o", "out.png"], &words);
    };
    refuse(b"windw = 7", &["windw", "unknown field"]);
    refuse(b"[settings.method.smooth]\nname = \"plane-fit\"\nwindow = 8", &["window is 8", "odd"]);
    refuse(b"[settings.method.smooth]\nname = \"none\"\nwindow = 7", &["settings.method.smooth.window"]);
    refuse(b"[settings.liquid]\nior = \"water\"", &["settings.liquid.ior", "invalid type"]);
    refuse(b"size = [1", &["line 1"]);
    refuse(b"a\x1b[2J = 1", &["line 1"]);
    refuse(&[0xff, 0xfe, 0x00], &["no text"]);
    refuse(&vec![b'#'; 2 << 20], &["larger than"]);
    refuse(b"[camera]\nup = [0, 0, 0]", &["up"]);
    refuse(b"[preparation]\nsmoothing = 2.0", &["smoothing is 2", "0 to 1"]);
    refuse(b"[preparation]\nsupport = true", &["preparation.support", "invalid type"]);
    run.refused(1, &["render", "--scene", "missing.toml", "-o", "out.png"], &["missing.toml", "--save-scene"]);
    run.file("lost.toml", "particles = \"missing.vtk\"");
    run.refused(1, &["render", "--scene", "lost.toml", "-o", "out.png"], &["missing.vtk", "no such file"]);
    run.refused(1, &["render", "--scene", ".", "-o", "out.png"], &["cannot be read"]);
    // Nothing is written over.
    run.file("s.toml", "particles = \"block.csv\"");
    run.refused(1, &["render", "--scene", "s.toml", "-o", "a.png", "--save-scene", "s.toml"], &["s.toml", "--scene"]);
    run.refused(1, &["render", "--scene", "s.toml", "-o", "a.png", "--save-scene", "block.csv"], &["particle file"]);
    run.refused(1, &["render", &block, "-o", "a.png", "--save-scene", "a.png"], &["a.png", "--output"]);
    run.refused(1, &["render", &block, "-o", "a.png", "--save-scene", "no/s.toml"], &["no/s.toml"]);
}

/// A map turned by a quarter, and a quarter of its columns moved: the same picture, but for rounding.
#[test]
fn a_turned_environment_is_a_map_with_its_columns_moved() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    map(0).save(run.path("map.png")).expect("saved");
    let render = |more: &[&str]| {
        run.render(&[&[&block, "--radius", "0.05", "--up", "0.2,1,0.1"], more].concat());
        run.pixels("out.png")
    };
    let far = |a: &[u8], b: &[u8]| a.iter().zip(b).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    let plain = render(&["--env", "map.png"]);
    for (degrees, columns) in [("90", 16), ("-45", 56), ("360", 0), ("3330", 16)] {
        map(columns).save(run.path("moved.png")).expect("saved");
        let moved = render(&["--env", "moved.png"]);
        let turned = render(&["--env", "map.png", "--env-rotate", degrees]);
        let differ = far(&moved, &turned);
        assert!(differ * 1000 < moved.len(), "{degrees}: {differ} of {} values differ", moved.len());
        assert!(columns == 0 || far(&plain, &turned) * 4 > plain.len(), "{degrees}: as if nothing had turned");
    }
    // Counter-clockwise as seen from above: what was in the middle of the map, +x, is then at -z.
    let dot = image::RgbImage::from_fn(64, 32, |x, _| image::Rgb([if (31..=32).contains(&x) { 255 } else { 0 }, 0, 0]));
    dot.save(run.path("dot.png")).expect("saved");
    let none = run.file("none.csv", "x,y,z\n");
    run.render(&[&none, "--env", "dot.png", "--env-rotate", "90", "--eye", "0,0,0", "--target", "0,0,-1"]);
    let middle = |pixels: Vec<u8>| pixels[3 * (36 * 96 + 48)];
    assert_eq!(middle(run.pixels("out.png")), 255);
    run.render(&[&none, "--env", "dot.png", "--eye", "0,0,0", "--target", "1,0,0"]);
    assert_eq!(middle(run.pixels("out.png")), 255);
}
