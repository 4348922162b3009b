//! Collections of time steps (`.pvd`): their own times decide, whatever their files are called.

use crate::{
    Run,
    between::{apart, linear, moving, rendered},
    block, listing,
    sequence::{GIVEN, made, rows},
    text,
};
use std::fs;

const SMALL: &[&str] = &["--size", "96x72"];

fn collection(run: &Run, name: &str, steps: &[(&str, &str)]) {
    let set = |(time, file): &(&str, &str)| format!("<DataSet timestep=\"{time}\" part=\"0\" file=\"{file}\"/>");
    let sets: String = steps.iter().map(set).collect();
    run.file(name, format!("<VTKFile type=\"Collection\"><Collection>{sets}</Collection></VTKFile>"));
}

/// Three steps whose names fall as time goes on; the one in the middle is in two pieces.
fn falling(run: &Run) {
    fs::create_dir_all(run.path("f")).expect("folder");
    for (name, offset) in [("p1", 1.4), ("p5", 0.5), ("p9", 0.0)] {
        run.file(&format!("f/{name}.csv"), block(offset));
    }
    run.file("f/q.csv", "x,y,z\n0.1,0.9,0.2\n");
    let steps = [("7.5", "f/p1.csv"), ("6", "f/p5.csv"), ("5", "f/p9.csv"), ("6.0", "f/q.csv")];
    collection(run, "all.pvd", &steps);
    collection(run, "middle.pvd", &[("6", "f/p5.csv"), ("6", "f/q.csv")]);
}

fn picture(run: &Run, file: &str, more: &[&str]) -> Vec<u8> {
    made(run, &[&["render", file, "-o", "one.png"], SMALL, GIVEN, more].concat());
    run.pixels("one.png")
}

#[test]
fn steps_come_in_order_of_time() {
    let run = Run::new();
    falling(&run);
    let sequence = [&["sequence", "all.pvd", "-o", "out/#.png", "--stats", "s.csv"], SMALL, GIVEN].concat();
    let said = made(&run, &sequence);
    assert!(said.contains("1 to 1.5 apart") && said.contains("--step own"), "{said}");
    assert_eq!(listing(&run.path("out")), ["0.png", "1.png", "2.png"]);
    for (i, file) in ["f/p9.csv", "middle.pvd", "f/p1.csv"].into_iter().enumerate() {
        assert!(run.pixels(&format!("out/{i}.png")) == picture(&run, file, &[]), "picture {i}");
    }
    let column = |c: usize| rows(&run, "s.csv").iter().map(|r| r[c].clone()).collect::<Vec<_>>();
    assert_eq!(column(1), ["f/p9.csv", "all.pvd", "f/p1.csv"]);
    assert_eq!(column(2), ["217", "218", "217"]);
    // Each piece decides the picture.
    assert!(made(&run, &sequence).contains("nothing to do"));
    run.file("f/q.csv", "x,y,z\n0.1,0.9,0.2\n0.3,0.9,0.2\n");
    assert!(made(&run, &sequence).contains("wrote 1 pictures"));
    run.refused(1, &["sequence", "all.pvd", "f/p1.csv", "-o", "#.png"], &["all.pvd has time steps", "f/p1.csv"]);
}

#[test]
fn a_time_takes_its_step_or_the_last_before() {
    let run = Run::new();
    falling(&run);
    for (time, file, said) in [
        ("5", "f/p9.csv", "time step: 5"),
        ("7.4", "middle.pvd", "time step: 6, the one for 7.4"),
        // Rounded it is that time all the same.
        ("7.4999", "f/p1.csv", "time step: 7.5, the one for 7.4999"),
    ] {
        let shown = picture(&run, file, &[]);
        let args = [&["render", "all.pvd", "-o", "one.png", "--time", time], SMALL, GIVEN].concat();
        let output = made(&run, &args);
        assert!(output.lines().any(|line| line == said), "{output}");
        assert!(run.pixels("one.png") == shown, "{time}");
    }
    // A scene file has it; another file in its place does not.
    picture(&run, "all.pvd", &["--time", "6.5", "--save-scene", "s.toml"]);
    let shown = run.pixels("one.png");
    made(&run, &["render", "--scene", "s.toml", "-o", "again.png"]);
    assert!(run.pixels("again.png") == shown);
    assert!(picture(&run, "f/p1.csv", &["--scene", "s.toml"]) == picture(&run, "f/p1.csv", &[]));
    // A film's second is the step's time, too.
    run.file(
        "keys.toml",
        "particles = \"all.pvd\"\n[[keys]]\ntime = 4\ncamera.fov_y = 20\n[[keys]]\ntime = 8\ncamera.fov_y = 40\n",
    );
    made(&run, &[&["render", "--scene", "keys.toml", "--time", "7", "-o", "keys.png"], SMALL, GIVEN].concat());
    assert!(run.pixels("keys.png") == picture(&run, "middle.pvd", &["--fov-y", "35"]));

    let shown = made(&run, &["info", "all.pvd", "--time", "6.2"]);
    assert!(shown.contains("time       6\n") && shown.contains("particles  218"), "{shown}");
    let render = |file: &'static str, time: &'static str| ["render", file, "-o", "a.png", "--time", time];
    run.refused(1, &render("all.pvd", "4.9"), &["all.pvd", "no time step for 4.9", "from 5 to 7.5"]);
    run.refused(1, &render("all.pvd", "7.6"), &["no time step for 7.6", "from 5 to 7.5"]);
    run.refused(1, &render("all.pvd", "-1"), &["no time step for -1"]);
    run.refused(1, &render("f/p1.csv", "1"), &["f/p1.csv", "no collection", "without a time"]);
    run.refused(1, &["render", "-o", "a.png", "--time", "1"], &["no collection"]);
    run.refused(1, &["info", "f/p1.csv", "--time", "1"], &["f/p1.csv", "no collection"]);
    run.refused(1, &["render", "all.pvd", "-o", "a.png"], &["3 time steps, from 5 to 7.5", "--time"]);
    run.refused(2, &render("all.pvd", "inf"), &["inf", "finite"]);
}

/// Pictures between steps are where the steps' own times put them.
#[test]
fn steps_are_as_far_apart_as_their_times() {
    let run = Run::new();
    fs::create_dir_all(run.path("f")).expect("folder");
    for (name, time) in [("c", 0.0), ("b", 1.0), ("a", 3.0)] {
        run.file(&format!("f/{name}.csv"), moving(time));
    }
    collection(&run, "all.pvd", &[("10", "f/c.csv"), ("11", "f/b.csv"), ("13", "f/a.csv")]);
    let sequence = |more: &[&str]| {
        let args = [&["sequence", "all.pvd", "--fps", "2"], SMALL, GIVEN, more].concat();
        let output = run.command(&args);
        assert!(output.status.success(), "{args:?}: {}", text(&output));
        text(&output)
    };
    let said = sequence(&["--step", "own", "-o", "o/#.exr"]);
    assert!(said.contains("wrote 7 pictures") && !said.contains("note:"), "{said}");
    for i in 0..7 {
        let off = apart(&linear(&run, &format!("o/{i}.exr")), &rendered(&run, 0.5 * f64::from(i)));
        assert!(off < 0.005, "picture {i}: {off}");
    }
    // At half the pace there are twice as many.
    assert!(sequence(&["--step", "own", "--speed", "0.5", "-o", "s/##.exr", "--frames", "12-12"]).contains("wrote 1 "));
    assert!(linear(&run, "s/12.exr") == rendered(&run, 3.0));
    // Seconds that are given hold, and that they are others is said.
    let said = sequence(&["--step", "0.5", "-o", "h/#.png"]);
    assert!(said.contains("1 to 2 apart") && said.contains("0.5 apart") && said.contains("wrote 3"), "{said}");
    fs::create_dir_all(run.path("g")).expect("folder");
    fs::copy(run.path("f/a.csv"), run.path("g/1.csv")).expect("copied");
    run.refused(1, &["sequence", "g/1.csv", "-o", "#.png", "--step", "own"], &["--step own", ".pvd"]);
    run.refused(2, &["sequence", "all.pvd", "-o", "#.png", "--step", "mine"], &["mine", "1e-9"]);
    collection(&run, "long.pvd", &[("0", "f/c.csv"), ("1e9", "f/a.csv")]);
    run.refused(1, &["sequence", "long.pvd", "-o", "#.png", "--step", "own"], &["25000000001 pictures", "--speed"]);
}
