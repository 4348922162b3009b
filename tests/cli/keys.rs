//! Keys of a scene file: camera, settings and methods over the time of a film.

use crate::{
    Run,
    sequence::{GIVEN, frames},
    text,
};

const FILM: &str = r#"
size = [96, 72]
radius = 0.05
[camera]
eye = [1.5, 1.2, -2.0]
target = [0.4, 0.3, 0.2]
[settings.liquid]
absorption = [0.4, 0.2, 0.1]
[settings.method.optics]
name = "four"
internal_reflections = 3
[[keys]]
time = 0
camera.orbit = 0
[[keys]]
time = 0.2
ease = "smooth"
camera.orbit = 60
settings.liquid.ior = 1.2
[[keys]]
time = 0.3
camera.target = [0.4, 0.3, 0.2]
[keys.settings.method]
layers.name = "split"
smooth.name = "plane-fit"
smooth.window = 7
optics.name = "two"
[[keys]]
time = 0.5
camera.target = [0.6, 0.3, 0.2]
settings.liquid.ior = 1.5
settings.method.smooth.window = 11
"#;

#[test]
fn every_picture_is_the_moment_of_its_scene() {
    let run = Run::new();
    frames(&run, 6);
    run.file("film.toml", FILM);
    let args = ["sequence", "f/*.csv", "-o", "#.png", "--scene", "film.toml", "--fps", "10"];
    let output = run.command(&args);
    assert!(output.status.success(), "{}", text(&output));
    for i in 0..6 {
        let (file, time) = (format!("f/p{i}.csv"), format!("0.{i}"));
        let saved = ["--save-scene", "now.toml"];
        let args = [&["render", &file, "-o", "one.png", "--scene", "film.toml", "--time", &time], &saved[..]].concat();
        let output = run.command(&args);
        assert!(output.status.success(), "{}", text(&output));
        assert!(run.pixels("one.png") == run.pixels(&format!("{i}.png")), "picture {i}");
        let scene = std::fs::read_to_string(run.path("now.toml")).expect("there");
        // Where nothing else is said the refractive index is the default's; afterwards it goes from key to key.
        let ior = ["1.33", "1.33", "1.2", "1.3", "1.4", "1.5"][i];
        assert!(scene.contains(&format!("ior = {ior}")), "{i}: {scene}");
        assert_eq!(scene.contains("name = \"two\""), i >= 3, "{i}: {scene}");
        assert_eq!(scene.contains("internal_reflections = 3"), i < 3, "another member keeps this: {scene}");
        assert!(i < 3 || scene.contains(["window = 7", "window = 7", "window = 11"][i - 3]), "{i}: {scene}");
    }
    // What the command line says holds for all.
    let output = run.command(&[&args[..], &["--ior", "1.4", "--stats", "s.csv"]].concat());
    assert!(output.status.success() && text(&output).contains("wrote 5 pictures"), "{}", text(&output));
}

#[test]
fn the_eye_goes_around() {
    let run = Run::new();
    frames(&run, 8);
    let args = [&["sequence", "f/*.csv", "-o", "#.png", "--turn", "-360", "--size", "96x72", "--frames", "2"], GIVEN];
    assert!(run.command(&args.concat()).status.success());
    let pixels = |more: &[&str]| {
        run.render(&[&["f/p2.csv"], GIVEN, more].concat());
        run.pixels("out.png")
    };
    let there = run.pixels("2.png");
    assert!(there == pixels(&["--orbit", "-90"]) && there != pixels(&[]));
    // Counter-clockwise as seen from above: from +x it goes to -z. The last one given counts.
    let far = |a: &[u8], b: &[u8]| a.iter().zip(b).filter(|(a, b)| a.abs_diff(**b) > 8).count();
    let eye = |eye, orbit| {
        let place = ["--radius", "0.05", "--target", "0.4,0.3,0.2", "--absorption", "0.4,0.2,0.1", "--eye", eye];
        run.render(&[&["f/p2.csv", "--orbit", orbit], &place[..]].concat());
        run.pixels("out.png")
    };
    let (turned, moved) = (eye("2.4,0.8,0.2", "90"), eye("0.4,0.8,-1.8", "0"));
    assert!(far(&turned, &moved) * 100 < moved.len(), "{} of {}", far(&turned, &moved), moved.len());
    assert!(far(&turned, &eye("2.4,0.8,0.2", "0")) * 10 > moved.len());
}

#[test]
fn keys_that_cannot_be_are_refused() {
    let run = Run::new();
    frames(&run, 2);
    let refused = |keys: &str, words: &[&str]| {
        run.file("s.toml", keys);
        run.refused(1, &["sequence", "f/*.csv", "-o", "#.png", "--scene", "s.toml"], &[&["s.toml"], words].concat());
        run.refused(1, &["render", "-o", "a.png", "--scene", "s.toml"], &[&["s.toml"], words].concat());
    };
    refused("[[keys]]\ntime = 1\nsize = [4, 4]", &["keys[0].size", "the same in all of a film"]);
    refused("[[keys]]\ntime = 1\ncamera.eye = [1, 2]", &["camera.eye", "at 1 seconds"]);
    refused("[[keys]]\ntime = 1\nsettings.liquid.colour = 1", &["settings.liquid.colour"]);
    refused("[[keys]]\ntime = 0\n[[keys]]\ntime = 2\nsettings.liquid.ior = 0.5", &["ior", "above 1"]);
    refused("[[keys]]\ntime = 2\n[[keys]]\ntime = 1", &["keys[1].time", "later"]);
    run.file("s.toml", "");
    run.refused(1, &["sequence", "f/*.csv", "-o", "#.png", "--scene", "s.toml", "--time", "1"], &["--time"]);
}
