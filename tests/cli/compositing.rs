//! Pictures for compositing: alpha, depth and normals.

use crate::{
    Run,
    sequence::{GIVEN, frames, made},
};
use exr::prelude::*;
use glam::DVec3;
use std::{collections::BTreeMap, fs};

const SIZE: [usize; 2] = [96, 72];
const SMALL: &[&str] = &["--size", "96x72"];

fn render(run: &Run, file: &str, output: &str, more: &[&str]) {
    made(run, &[&["render", file, "-o", output], SMALL, GIVEN, more].concat());
}

/// All channels of an .exr, by name.
fn channels(run: &Run, name: &str) -> BTreeMap<String, Vec<f32>> {
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    let image = reader.first_valid_layer().all_attributes().from_file(run.path(name)).expect("an image");
    let samples = |s: &FlatSamples| match s {
        FlatSamples::F32(values) => values.clone(),
        other => panic!("samples are not 32-bit floats: {other:?}"),
    };
    image.layer_data.channel_data.list.iter().map(|c| (c.name.to_string(), samples(&c.sample_data))).collect()
}

fn srgb(v: f64) -> f64 {
    255.0 * if v <= 0.0031308 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

fn linear(byte: u8) -> f64 {
    let v = f64::from(byte) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Over the environment alone it is the ordinary picture.
#[test]
fn over_the_environment_it_is_the_ordinary_picture() {
    let run = Run::new();
    frames(&run, 1);
    run.file("none.csv", "x,y,z\n");
    for method in ["field", "imai16", "green10"] {
        for (samples, tolerance) in [("1", 1e-6), ("3", 2e-2)] {
            let more = ["--method", method, "--supersample", samples];
            render(&run, "f/p0.csv", "whole.exr", &more);
            render(&run, "none.csv", "sky.exr", &more);
            let alone = [&more[..], &["--background", "none"]].concat();
            render(&run, "f/p0.csv", "alone.exr", &alone);
            render(&run, "f/p0.csv", "alone.png", &alone);
            render(&run, "none.csv", "empty.exr", &alone);
            let [whole, sky, alone, empty] =
                ["whole.exr", "sky.exr", "alone.exr", "empty.exr"].map(|n| channels(&run, n));
            let png = image::open(run.path("alone.png")).expect("a picture").to_rgba8().into_raw();
            assert!(!whole.contains_key("A") && empty.values().flatten().all(|v| *v == 0.0));
            let (mut covered, mut edge, mut seen) = (0, 0, 0);
            for i in 0..SIZE[0] * SIZE[1] {
                let alpha = f64::from(alone["A"][i]);
                assert!((0.0..=1.0).contains(&alpha));
                covered += usize::from(alpha == 1.0);
                edge += usize::from(alpha > 0.0 && alpha < 1.0);
                assert!((f64::from(png[4 * i + 3]) - 255.0 * alpha).abs() <= 0.5, "alpha of pixel {i}");
                for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
                    let [whole, sky, alone] = [&whole, &sky, &alone].map(|p| f64::from(p[name][i]));
                    let over = alone + (1.0 - alpha) * sky;
                    assert!(
                        (over - whole).abs() <= tolerance,
                        "{method}, {samples}: {name} of pixel {i}: {over}, not {whole}"
                    );
                    seen += usize::from(alpha > 0.0 && (whole - sky).abs() > 0.01);
                    // A byte may be half of one off, before it is multiplied.
                    let over = alpha * linear(png[4 * i + c]) + (1.0 - alpha) * sky;
                    // What is brighter than white a byte cannot hold.
                    if alone > alpha {
                        continue;
                    }
                    let off = srgb(over.clamp(0.0, 1.0)) - srgb(whole.clamp(0.0, 1.0));
                    assert!(
                        off.abs() <= 1.0 + 255.0 * tolerance,
                        "{method}, {samples}: {name} of pixel {i} of the .png: {off}"
                    );
                }
            }
            assert!(covered > 500 && seen > 500, "{covered} of liquid, {seen} seen");
            assert_eq!(edge > 50, samples == "3", "{edge} of {covered} partly covered");
        }
    }
}

/// Of a lone drop depths and normals have closed forms; bits are the same twice.
#[test]
fn depth_and_normals_are_the_surfaces() {
    let run = Run::new();
    run.file("drop.csv", "x,y,z\n0.5,0.3,0.1\n");
    let args = ["--radius", "0.2", "--eye", "1.5,1.2,-2", "--target", "0.4,0.3,0.2", "--absorption", "0,0,0"];
    let all = ["--channels", "depth,normal", "--background", "none"];
    let draw = |output: &str, more: &[&str]| {
        made(&run, &[&["render", "drop.csv", "-o", output], SMALL, &args[..], more].concat());
    };
    let (eye, center) = (DVec3::new(1.5, 1.2, -2.0), DVec3::new(0.5, 0.3, 0.1));
    let forward = (DVec3::new(0.4, 0.3, 0.2) - eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let (up, tan) = (right.cross(forward), 20f64.to_radians().tan());
    let radius = 1.24 * 0.2;
    for method in ["field", "imai16"] {
        draw("a.exr", &[&["--method", method], &all[..]].concat());
        draw("b.exr", &[&["--method", method], &all[..]].concat());
        assert!(fs::read(run.path("a.exr")).expect("there") == fs::read(run.path("b.exr")).expect("there"));
        let found = channels(&run, "a.exr");
        let names: Vec<_> = found.keys().map(String::as_str).collect();
        assert_eq!(names, ["A", "B", "G", "R", "Z", "normal.X", "normal.Y", "normal.Z"]);
        let mut seen = 0;
        for i in 0..SIZE[0] * SIZE[1] {
            let [x, y] = [i % SIZE[0], i / SIZE[0]].map(|v| v as f64 + 0.5);
            let ray = forward + tan * (right * (x - 48.0) + up * (36.0 - y)) / 36.0;
            let normal =
                DVec3::from([&found["normal.X"], &found["normal.Y"], &found["normal.Z"]].map(|n| f64::from(n[i])));
            if found["A"][i] == 0.0 {
                assert_eq!((found["Z"][i], normal), (1e10, DVec3::ZERO), "pixel {i}");
                continue;
            }
            let place = eye + f64::from(found["Z"][i]) * ray;
            assert!((place.distance(center) / radius - 1.0).abs() < 2e-3, "{method}: pixel {i} is at {place}");
            assert!(normal.distance((place - center) / radius) < 1e-2, "{method}: pixel {i} faces {normal}");
            assert!(normal.dot(ray) < 0.05, "{method}: pixel {i} faces away");
            seen += 1;
        }
        assert!(seen > 150, "{seen} pixels of a drop");
    }
    // Of several samples the nearest: no pixel lies between drop and background.
    draw("fine.exr", &["--channels", "depth", "--supersample", "3"]);
    let fine = channels(&run, "fine.exr");
    assert_eq!(fine.keys().collect::<Vec<_>>(), ["B", "G", "R", "Z"]);
    let coarse = channels(&run, "a.exr");
    let near = |z: &f32| (*z < 1e9).then_some(*z);
    assert!(fine["Z"].iter().all(|z| *z == 1e10 || *z < 4.0));
    let better = fine["Z"].iter().zip(&coarse["Z"]).filter_map(|(f, c)| Some((near(f)?, near(c)?)));
    assert!(better.clone().count() > 150 && better.clone().all(|(f, c)| f <= c + 1e-4));
    // Optics that look up have the surface of a map.
    draw("map.exr", &["--channels", "depth,normal", "--method", "green10"]);
    let map = channels(&run, "map.exr");
    let inside = (0..SIZE[0] * SIZE[1]).filter(|i| map["Z"][*i] < 1e9);
    let far = (eye.distance(center) - 2.0 * radius, eye.distance(center) + radius);
    assert!(
        inside.clone().count() > 100
            && inside.clone().all(|i| f64::from(map["Z"][i]) > far.0 && f64::from(map["Z"][i]) < far.1)
    );
    let facing = inside.clone().filter(|i| {
        let normal = DVec3::from([&map["normal.X"], &map["normal.Y"], &map["normal.Z"]].map(|n| f64::from(n[*i])));
        (normal.length() - 1.0).abs() < 1e-3 && normal.dot(forward) < 0.1
    });
    assert!(facing.count() * 10 > inside.count() * 9);
}

#[test]
fn sequences_are_transparent_too() {
    let run = Run::new();
    frames(&run, 3);
    let more = ["--background", "none", "--channels", "depth", "--supersample", "2"];
    let args = ["sequence", "f/*.csv", "-o", "out/#.png", "-o", "out/#.exr", "--stats", "s.csv"];
    let all = [&args[..], SMALL, GIVEN, &more].concat();
    made(&run, &all);
    let changes = || {
        let table = fs::read_to_string(run.path("s.csv")).expect("a table");
        table.lines().map(|l| l.split(',').skip(12).map(str::to_owned).collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    let before = changes();
    for i in 0..3 {
        render(&run, &format!("f/p{i}.csv"), "one.exr", &more);
        render(
            &run,
            &format!("f/p{i}.csv"),
            "one.png",
            &more[..2].iter().chain(&more[4..]).copied().collect::<Vec<_>>(),
        );
        assert!(channels(&run, "one.exr") == channels(&run, &format!("out/{i}.exr")), "picture {i}");
        let rgba = |name: &str| image::open(run.path(name)).expect("a picture").to_rgba8();
        assert!(rgba("one.png") == rgba(&format!("out/{i}.png")), "picture {i}");
    }
    // Made again it is the same, and so is what it is compared with.
    let bytes = |name: &str| fs::read(run.path(name)).expect("there");
    let (png, exr) = (bytes("out/1.png"), bytes("out/1.exr"));
    fs::remove_file(run.path("out/1.png")).expect("removed");
    assert!(made(&run, &all).contains("wrote 1 pictures"));
    assert!(bytes("out/1.png") == png && bytes("out/1.exr") == exr);
    assert_eq!(changes(), before);
    // Motion blur covers more, and less of it wholly.
    let blurred = ["--step", "0.2", "--fps", "5", "--subframes", "4", "--shutter", "1"];
    for i in 0..2 {
        run.file(
            &format!("v{i}.csv"),
            format!("x,y,z,vx,vy,vz\n{},0.3,0.2,2,0,0\n0.4,0.3,0.2,0,0,0\n", 0.4 * f64::from(i)),
        );
    }
    let film = ["sequence", "v0.csv", "v1.csv", "-o", "blur/#.exr", "--background", "none", "--channels", "depth"];
    made(&run, &[&film[..], SMALL, GIVEN, &blurred].concat());
    let blur = channels(&run, "blur/1.exr");
    let partly = blur["A"].iter().filter(|a| **a == 0.25 || **a == 0.5 || **a == 0.75).count();
    let between = (0..SIZE[0] * SIZE[1]).filter(|i| blur["A"][*i] > 0.0 && blur["Z"][*i] > 10.0).count();
    assert!(partly > 5 && between == 0, "{partly} partly covered, {between} without a depth");
}

#[test]
fn what_cannot_be_is_refused() {
    let run = Run::new();
    frames(&run, 2);
    let film = ["sequence", "f/*.csv", "-o", "#.png", "-o", "film.gif", "--background", "none"];
    run.refused(1, &film, &["film.gif", "transparency", "--background none"]);
    run.refused(1, &["render", "f/p0.csv", "-o", "a.png", "--channels", "depth"], &["--channels", ".exr"]);
    run.refused(2, &["render", "f/p0.csv", "-o", "a.exr", "--channels", "speed"], &["depth,normal"]);
    // A scene file says it too.
    run.file("s.toml", "background = \"none\"\nchannels = [\"normal\"]\nsize = [32, 24]\n");
    made(&run, &["render", "f/p0.csv", "--scene", "s.toml", "-o", "a.exr", "--save-scene", "t.toml"]);
    assert_eq!(channels(&run, "a.exr").len(), 7);
    let saved = fs::read_to_string(run.path("t.toml")).expect("saved");
    assert!(saved.contains("background = \"none\"") && saved.contains("channels = [\"normal\"]"), "{saved}");
}
