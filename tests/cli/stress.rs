//! `meniscus stress`: what it writes, and that it sees methods fail.

use crate::{Run, listing, text};
use serde_json::Value;
use std::fs;

#[test]
fn the_default_keeps_its_promises_beside_rivals() {
    let run = Run::new();
    let output = run.command(&["stress", "-o", "out", "--small", "--methods", "field,imai16,green10"]);
    assert!(output.status.success(), "{}", text(&output));
    let record: Value = serde_json::from_slice(&fs::read(run.path("out/stress.json")).expect("figures")).expect("JSON");
    let runs = record["runs"].as_array().expect("runs");
    let names = |method: &str| -> Vec<&str> {
        runs.iter().filter(|r| r["method"] == method).filter_map(|r| r["case"].as_str()).collect()
    };
    assert_eq!(names("imai16"), names("green10"));
    assert_eq!(names("imai16"), names("field"));
    assert!(names("imai16").len() >= 16, "{:?}", names("imai16"));
    for r in runs.iter().filter(|r| r["method"] != "green10") {
        assert_eq!(r["pass"], r["why"] == "", "{r:#}");
        assert!(r["pass"] == true || r["promised"] == false, "{r:#}");
        // Every case measured something.
        let found =
            r["figures"].as_array().expect("figures").iter().filter(|f| f["measure"] != "pixels that are no number");
        let figures =
            found.flat_map(|f| f["found"].as_array().expect("a figure a step")).filter(|v| v.is_number()).count();
        assert!(figures > 0, "{r:#}");
    }
    // What two volumes of screen-space maps cannot know.
    let interfaces = runs.iter().find(|r| r["method"] == "imai16" && r["case"] == "interfaces").expect("the case");
    assert_eq!(interfaces["pass"], false);
    assert!(interfaces["why"].as_str().is_some_and(|w| w.contains("absorption")), "{interfaces:#}");
    let files = listing(&run.path("out"));
    assert!(["stress.csv", "stress.json", "stress.md"].iter().all(|f| files.iter().any(|g| g == f)), "{files:?}");
    assert!(files.iter().filter(|f| f.ends_with(".svg")).count() > 10, "{files:?}");
    let table = fs::read_to_string(run.path("out/stress.md")).expect("the table");
    assert!(table.contains("| field  | imai16 | green10 |") && table.contains("- interfaces, imai16: "), "{table}");
}

#[test]
fn some_cases_of_a_method() {
    let run = Run::new();
    let output = run.command(&["stress", "-o", "out", "--small", "--methods", "ssfr", "--only", "sheet,shuffled"]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    let output = run.command(&["stress", "-o", "out", "--small", "--methods", "cords08", "--only", "sheet,shuffled"]);
    assert!(output.status.success(), "{}", text(&output));
    let csv = fs::read_to_string(run.path("out/stress.csv")).expect("figures");
    assert!(
        csv.lines().skip(1).all(|l| l.starts_with("sheet,cords08,") || l.starts_with("shuffled,cords08,")),
        "{csv}"
    );
    run.refused(1, &["stress", "-o", "/proc/here", "--only", "sheet"], &["/proc/here", "cannot be written"]);
}
