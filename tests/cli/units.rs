//! Sweeps in units: listed, done apart, joined.

use crate::{Run, block, listing, sequence::made};
use std::{collections::BTreeMap, fs, process::Stdio, time::SystemTime};

/// Of a search these methods, which have none, have no figures: they have to be absent after a join, too.
const SWEEP: &[&str] = &["stress", "--small", "--only", "search,shuffled", "--methods", "cords08,green10"];

/// Two programs at once on units of their own, and a join, are what one program makes in one go.
#[test]
fn a_sweep_in_units_is_the_sweep_in_one_go() {
    let run = Run::new();
    let sweep = |more: &[&'static str]| [SWEEP, more].concat();
    let listed = made(&run, &sweep(&["-o", "out", "--list-units"]));
    let names = ["1 search/cords08", "2 search/green10", "3 shuffled/cords08", "4 shuffled/green10"];
    let mut found: Vec<_> = listed.lines().map(|l| l.split_once(' ').expect("a number").1.to_owned()).collect();
    found.sort();
    assert_eq!(found, names.map(|n| n[2..].to_owned()), "{listed}");
    assert!(!run.path("out").exists(), "a list makes nothing");

    made(&run, &sweep(&["-o", "whole"]));
    let two = ["1-2", "3-4"].map(|units| {
        let args = sweep(&["-o", "parts", "--units", units]);
        run.prepared(&args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("starts")
    });
    for mut child in two {
        assert!(child.wait().expect("waited for").success());
    }
    assert_eq!((listing(&run.path("parts")), listing(&run.path("parts/units")).len()), (vec!["units".to_owned()], 4));
    made(&run, &sweep(&["-o", "parts"]));
    for file in ["stress.csv", "stress.md"] {
        let bytes = |folder: &str| fs::read(run.path(&format!("{folder}/{file}"))).expect("there");
        assert!(bytes("whole") == bytes("parts"), "{file}");
    }

    let absent = fs::read_to_string(run.path("parts/stress.csv")).expect("there").matches(",,").count();
    assert_eq!(absent, 6, "three figures of each method are absent");

    // What is there is not run again, but what is not whole is, and what another program found.
    let units = listing(&run.path("parts/units"));
    let path = run.path(&format!("parts/units/{}", units[0]));
    let record = fs::read_to_string(&path).expect("there");
    let changed = record.replacen("\"x\": \"", "\"x\": \"77", 1);
    fs::write(&path, changed).expect("written");
    fs::write(run.path(&format!("parts/units/{}", units[1])), &record[..record.len() / 2]).expect("written");
    made(&run, &sweep(&["-o", "parts"]));
    let lines = |folder: &str| {
        let text = fs::read_to_string(run.path(&format!("{folder}/stress.csv"))).expect("there");
        text.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let other = lines("parts").iter().zip(&lines("whole")).filter(|(a, b)| a != b).count();
    assert!(other > 0 && other < lines("whole").len() / 2, "{other} lines differ");
    made(&run, &sweep(&["-o", "one", "--units", "shuffled/green10"]));
    assert_eq!(listing(&run.path("one/units")).len(), 1);
    run.refused(1, &sweep(&["-o", "one", "--units", "5-9"]), &["5-9", "4 units", "--list-units"]);
    run.refused(1, &sweep(&["-o", "one", "--units", "search"]), &["search", "--list-units"]);
}

/// Scenes that were charted apart are joined without being measured again.
#[test]
fn charts_of_scenes_are_joined() {
    let run = Run::new();
    run.file("a.csv", block(0.0));
    run.file("b.csv", block(0.3));
    let chart = |more: &[&'static str]| {
        let args = ["chart", "a.csv", "b.csv", "-o", "out", "--radius", "0.05", "--size", "32x24", "--samples", "32"];
        let short = ["--truth-width", "0", "--frames", "1", "--rounds", "1", "--methods", "green10"];
        [&args[..], &short, more].concat()
    };
    assert_eq!(made(&run, &chart(&["--list-units"])).trim(), "1 a\n2 b");
    let records = || -> BTreeMap<String, SystemTime> {
        let json = listing(&run.path("out/points")).into_iter().filter(|n| n.ends_with(".json"));
        json.map(|n| {
            let written = fs::metadata(run.path(&format!("out/points/{n}"))).and_then(|m| m.modified()).expect("there");
            (n, written)
        })
        .collect()
    };
    made(&run, &chart(&["--units", "2"]));
    assert!(records().len() == 1 && !run.path("out/chart.csv").exists());
    made(&run, &chart(&["--units", "a"]));
    let apart = records();
    assert_eq!(apart.len(), 2);
    made(&run, &chart(&[]));
    assert!(records() == apart, "the join measured again");
    let table = fs::read_to_string(run.path("out/chart.csv")).expect("the table");
    assert_eq!(table.lines().skip(1).map(|l| &l[..1]).collect::<Vec<_>>(), ["a", "b"], "{table}");
    assert!(run.path("out/report.html").exists() && run.path("out/a.svg").exists());
}
