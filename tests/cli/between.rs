//! Pictures between the frames of a simulation.

use crate::{Run, block, sequence::GIVEN, text};
use std::fs;

/// Where a block is that is accelerated, at a second, and how fast it is.
fn place(time: f64) -> (f64, f64) {
    (0.1 * time * time, 0.2 * time)
}

pub fn moving(time: f64) -> String {
    let (offset, speed) = place(time);
    let rows = block(offset);
    let rows = rows.lines().skip(1).map(|row| format!("{row},{speed},0,0\n"));
    "x,y,z,vx,vy,vz\n".to_owned() + &rows.collect::<String>()
}

/// Frames of these seconds, numbered by tenths.
fn frames(run: &Run, times: &[u32]) {
    fs::create_dir_all(run.path("f")).expect("folder");
    for t in times {
        run.file(&format!("f/p{:03}.csv", 10 * t), moving(f64::from(*t)));
    }
}

fn made(run: &Run, more: &[&str]) -> String {
    let all = [&["sequence", "f/*.csv", "--step", "1", "--size", "96x72"], GIVEN, more].concat();
    let output = run.command(&all);
    assert!(output.status.success(), "{all:?}: {}", text(&output));
    text(&output)
}

pub fn linear(run: &Run, name: &str) -> Vec<f32> {
    image::open(run.path(name)).expect("a picture").to_rgb32f().into_raw()
}

/// The picture of the block at a second.
pub fn rendered(run: &Run, time: f64) -> Vec<f32> {
    run.file("now.csv", moving(time));
    let args = [&["render", "now.csv", "-o", "now.exr", "--size", "96x72"], GIVEN].concat();
    assert!(run.command(&args).status.success());
    linear(run, "now.exr")
}

/// How much of the values are apart by more than rounding leaves.
pub fn apart(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| (**a - **b).abs() > 0.01).count() as f64 / a.len() as f64
}

#[test]
fn particles_go_on_between_frames() {
    let run = Run::new();
    // Number 20 is missing: there are two seconds between the last two.
    frames(&run, &[0, 1, 3]);
    let said = made(&run, &["--fps", "2", "-o", "o/#.exr"]);
    assert!(said.contains("no frames between 10 and 30") && said.contains("wrote 7 pictures"), "{said}");
    let shown: Vec<_> = (0..7).map(|i| linear(&run, &format!("o/{i}.exr"))).collect();
    for (i, picture) in shown.iter().enumerate() {
        let off = apart(picture, &rendered(&run, 0.5 * i as f64));
        assert!(off < 0.005, "picture {i}: {off}");
    }
    // The tolerance tells pictures apart; and frames themselves are what they are.
    assert!(shown.windows(2).skip(1).all(|w| apart(&w[0], &w[1]) > 0.02));
    for (i, time) in [(0, 0.0), (2, 1.0), (6, 3.0)] {
        assert!(shown[i] == rendered(&run, time), "frame at {time}");
    }
    // Half as fast there are twice as many, with one more at the end; of some numbers only these.
    assert!(made(&run, &["--fps", "2", "--speed", "0.5", "-o", "s/#.exr", "--frames", "5-5"]).contains("wrote 1 "));
    assert!(apart(&linear(&run, "s/5.exr"), &rendered(&run, 1.25)) < 0.005);
    assert!(made(&run, &["--fps", "2", "-o", "o/#.exr"]).contains("nothing to do"));
    assert!(made(&run, &["--fps", "2", "-o", "o/#.exr", "--ior", "1.4"]).contains("wrote 7"));
}

/// As many particles, but not the same ones.
#[test]
fn others_are_not_on_their_way() {
    let run = Run::new();
    fs::create_dir_all(run.path("f")).expect("folder");
    let rows = |ids: [u32; 2]| ids.map(|id| format!("{id},{id},0,0,1,0,0\n")).concat();
    for (name, ids) in [("p0", [7, 3]), ("p1", [3, 7]), ("p2", [7, 4])] {
        run.file(&format!("f/{name}.csv"), format!("id,x,y,z,vx,vy,vz\n{}", rows(ids)));
    }
    assert!(made(&run, &["--fps", "2", "-o", "o/#.png", "--frames", "0-2"]).contains("wrote 3"));
    let args = ["sequence", "f/*.csv", "--step", "1", "--size", "96x72", "--fps", "2", "-o", "p/#.png"];
    let result = run.command(&[&args[..], GIVEN].concat());
    let said = text(&result);
    assert!(
        !result.status.success() && ["p1.csv", "p2.csv", "id 3", "--step"].iter().all(|w| said.contains(w)),
        "{said}"
    );
}

#[test]
fn motion_blur_is_the_mean_of_moments() {
    let run = Run::new();
    frames(&run, &[0, 1, 2]);
    made(&run, &["--fps", "1", "--subframes", "2", "--shutter", "0.8", "-o", "#.exr"]);
    let mean = |a: f64, b: f64| -> Vec<f32> {
        let (a, b) = (rendered(&run, a), rendered(&run, b));
        a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect()
    };
    // From 0.6 to 1.4 there are two halves; before the first frame there is nothing.
    let blurred = linear(&run, "1.exr");
    assert!(apart(&blurred, &mean(0.8, 1.2)) < 0.005);
    assert!(apart(&blurred, &rendered(&run, 1.0)) > 0.02);
    assert!(apart(&linear(&run, "0.exr"), &mean(0.0, 0.2)) < 0.005);
}

#[test]
fn what_cannot_be_followed_is_refused() {
    let run = Run::new();
    frames(&run, &[0, 1]);
    let args = ["sequence", "f/*.csv", "--step", "1", "-o", "#.png", "--size", "96x72", "--fps", "3"];
    let refused = |words: &[&str]| {
        let output = run.command(&args);
        let said = text(&output);
        assert!(output.status.code() == Some(1) && words.iter().all(|w| said.contains(w)), "{said}");
    };
    run.file("f/p010.csv", moving(1.0) + "0,2,0,0,0,0\n");
    refused(&["f/p000.csv has 217", "f/p010.csv has 218", "--step"]);
    run.file("f/p010.csv", block(1.0));
    refused(&["f/p010.csv: has no velocities"]);
    run.refused(2, &["sequence", "f/*.csv", "-o", "#.png", "--subframes", "4"], &["--step"]);
    run.refused(2, &["sequence", "f/*.csv", "-o", "#.png", "--step", "0"], &["--step"]);
}
