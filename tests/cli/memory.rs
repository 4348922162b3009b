//! Classes that hold over frames.

use crate::{Run, listing, sequence::GIVEN, text};
use std::fs;

/// Rows of particles that are pulled apart and pushed together, so that those within have .47 and .49 of a body's density in turns.
fn trembling(run: &Run, count: u32) {
    fs::create_dir_all(run.path("f")).expect("folder");
    for frame in 0..count {
        let spacing = if frame % 2 == 0 { 0.0985 } else { 0.1015 };
        let mut text = String::from("x,y,z\n");
        for (row, i) in (0..6).flat_map(|row| (0..8).map(move |i| (row, i))) {
            text += &format!("{},{},0.2\n", spacing * f64::from(i), 0.4 * f64::from(row));
        }
        run.file(&format!("f/p{frame}.csv"), text);
    }
}

fn made(run: &Run, output: &str, more: &[&str]) {
    let args = ["sequence", "f/*.csv", "--size", "64x48", "--method", "imai16", "-o", output];
    let all = [&args[..], GIVEN, more].concat();
    let result = run.command(&all);
    assert!(result.status.success(), "{all:?}: {}", text(&result));
}

/// A column of a table, by name.
fn column(run: &Run, table: &str, name: &str) -> Vec<String> {
    let text = fs::read_to_string(run.path(table)).expect("a table");
    let rows: Vec<Vec<_>> = text.lines().map(|l| l.split(',').map(str::to_owned).collect()).collect();
    let at = rows[0].iter().position(|n| n == name).expect("a column");
    rows[1..].iter().map(|r| r[at].clone()).collect()
}

fn same(run: &Run, a: &str, b: &str, names: &[&str]) {
    for name in names {
        let bytes = |folder: &str| fs::read(run.path(&format!("{folder}/{name}"))).expect("there");
        assert!(bytes(a) == bytes(b), "{a}/{name} is not {b}/{name}");
    }
}

#[test]
fn what_trembles_does_not_flicker() {
    let run = Run::new();
    trembling(&run, 7);
    made(&run, "alone/#.png", &["--stats", "alone.csv"]);
    made(&run, "held/#.png", &["--stats", "held.csv", "--memory", "3"]);
    // Six particles within each of six rows.
    let every = ["", "36", "36", "36", "36", "36", "36"];
    assert_eq!(column(&run, "alone.csv", "class_changes"), every);
    assert_eq!(column(&run, "alone.csv", "body"), ["36", "0", "36", "0", "36", "0", "36"]);
    // Once splash they stay so; only the first frame knows nothing of it.
    assert_eq!(column(&run, "held.csv", "class_changes"), ["", "36", "0", "0", "0", "0", "0"]);
    assert_eq!(column(&run, "held.csv", "body"), ["36", "0", "0", "0", "0", "0", "0"]);
    assert!(run.pixels("alone/1.png") == run.pixels("held/1.png"));
    assert!(run.pixels("alone/2.png") != run.pixels("held/2.png"));
    let change =
        |table: &str| column(&run, table, "change")[3..].iter().filter_map(|c| c.parse::<f64>().ok()).sum::<f64>();
    assert!(change("held.csv") < change("alone.csv"), "{} and {}", change("held.csv"), change("alone.csv"));
    // Densities above the upper threshold are body, whatever was.
    made(&run, "low/#.png", &["--stats", "low.csv", "--memory", "3", "--keep-class-below", "0.481"]);
    assert_eq!(column(&run, "low.csv", "class_changes"), every);
}

/// Splash of one frame is splash as long as the memory reaches it, and body again after.
#[test]
fn what_is_farther_back_is_forgotten() {
    let run = Run::new();
    trembling(&run, 6);
    for frame in 2..6 {
        fs::copy(run.path("f/p0.csv"), run.path(&format!("f/p{frame}.csv"))).expect("copied");
    }
    made(&run, "out/#.png", &["--stats", "s.csv", "--memory", "2"]);
    assert_eq!(column(&run, "s.csv", "body"), ["36", "0", "0", "0", "36", "36"]);
    assert_eq!(column(&run, "s.csv", "class_changes"), ["", "36", "0", "0", "36", "0"]);
}

/// Whichever are made, in whatever order, they are what they are in one go.
#[test]
fn in_parts_it_is_what_it_is_in_one_go() {
    let run = Run::new();
    trembling(&run, 6);
    let memory = ["--memory", "2", "--stats"];
    made(&run, "whole/#.png", &[&memory[..], &["whole.csv"]].concat());
    for part in ["5", "2-3", "0-", "4"] {
        made(&run, "parts/#.png", &[&memory[..], &["parts.csv", "--frames", part]].concat());
    }
    let names: Vec<_> = listing(&run.path("whole"));
    same(&run, "whole", "parts", &names.iter().map(String::as_str).collect::<Vec<_>>());
    fs::remove_file(run.path("whole/3.png")).expect("removed");
    let before = column(&run, "whole.csv", "class_changes");
    made(&run, "whole/#.png", &[&memory[..], &["whole.csv"]].concat());
    assert_eq!(column(&run, "whole.csv", "class_changes"), before);
    same(&run, "whole", "parts", &["3.png"]);
    // Another frame before is another picture, and so is another memory: of each that it reaches.
    trembling(&run, 1);
    run.file("f/p2.csv", fs::read_to_string(run.path("f/p2.csv")).expect("there") + "9,9,9\n");
    let result = run.command(
        &[
            &["sequence", "f/*.csv", "--size", "64x48", "--method", "imai16", "-o", "whole/#.png"],
            GIVEN,
            &["--memory", "2"],
        ]
        .concat(),
    );
    // 0, 1 and 2 reach the first, 2 to 4 the third.
    assert!(text(&result).contains("1 of which are there"), "{}", text(&result));
}

/// Where there are other particles it begins anew; on the device it is refused.
#[test]
fn memory_ends_with_other_particles() {
    let run = Run::new();
    trembling(&run, 5);
    run.file("f/p2.csv", fs::read_to_string(run.path("f/p2.csv")).expect("there") + "9,9,9\n");
    made(&run, "out/#.png", &["--stats", "s.csv", "--memory", "3"]);
    assert_eq!(column(&run, "s.csv", "body"), ["36", "0", "36", "0", "0"]);
    assert_eq!(column(&run, "s.csv", "class_changes"), ["", "36", "", "", "0"]);
    // One that cannot be read is none, if nobody wants its picture.
    run.file("f/p2.csv", "x,y,z\n1\n");
    made(&run, "part/#.png", &["--frames", "3-", "--memory", "3"]);
    assert!(["3.png", "4.png"].iter().all(|n| run.pixels(&format!("part/{n}")) == run.pixels(&format!("out/{n}"))));
    let gpu = ["sequence", "f/*.csv", "-o", "#.png", "--memory", "3", "--prepare", "gpu"];
    run.refused(1, &gpu, &["--memory", "--prepare cpu"]);
    run.refused(2, &["sequence", "f/*.csv", "-o", "#.png", "--keep-class-below", "0.5"], &["--memory"]);
}

/// Three rows that tremble, three that do not, of which one is of other particles in each frame, and six other splashes, which come
/// before all by their ids or after.
fn renewed(run: &Run, folder: &str, shuffled: bool) {
    fs::create_dir_all(run.path(folder)).expect("folder");
    for frame in 0..5_u32 {
        let mut rows = Vec::new();
        for (row, i) in (0..6).flat_map(|row| (0..8).map(move |i| (row, i))) {
            let spacing = if frame % 2 == 1 && row < 3 { 0.1015 } else { 0.0985 };
            let id = if row == 5 { 5000 + 8 * frame + i } else { 1000 + 8 * row + i };
            rows.push(format!("{id},{},{},0.2\n", spacing * f64::from(i), 0.4 * f64::from(row)));
        }
        for i in 0..6 {
            rows.push(format!("{},{},9,9\n", 2000 * (frame % 2) + 10 * frame + i, i));
        }
        if frame == 4 {
            rows.pop();
        }
        let count = rows.len();
        let at = |i: usize| if shuffled { (13 * i + 7 * frame as usize) % count } else { i };
        let text: String = (0..count).map(|i| rows[at(i)].as_str()).collect();
        run.file(&format!("{folder}/p{frame}.csv"), format!("id,x,y,z\n{text}"));
    }
}

/// Where files have ids it is by them that particles are followed: in whatever order they are written, and whoever comes and goes.
#[test]
fn particles_are_followed_by_their_ids() {
    let run = Run::new();
    for (folder, shuffled) in [("f", false), ("g", true)] {
        renewed(&run, folder, shuffled);
        let (pattern, output, table) = (format!("{folder}/*.csv"), format!("{folder}/#.png"), format!("{folder}.csv"));
        let args = ["sequence", &pattern, "--size", "64x48", "--method", "imai16", "-o", &output, "--stats", &table];
        let result = run.command(&[&args[..], GIVEN, &["--memory", "3"]].concat());
        assert!(result.status.success(), "{}", text(&result));
        // As it is without the others: what trembles is splash from the second frame on.
        assert_eq!(column(&run, &table, "body"), ["36", "18", "18", "18", "18"], "{folder}");
        assert_eq!(column(&run, &table, "class_changes"), ["", "18", "0", "0", "0"], "{folder}");
    }
    assert!((0..5).all(|i| run.pixels(&format!("f/{i}.png")) == run.pixels(&format!("g/{i}.png"))));
}
