//! `meniscus tune`: what it promises holds for the scene file that it writes.

use crate::{Run, text};
use std::fs;

/// FLIP over the liquid of the scene file's own picture, measured anew.
fn error(run: &Run, scene: &str) -> f64 {
    for args in [
        &["truth", "--scene", scene, "-o", "truth", "--samples", "64"][..],
        &["render", "--scene", scene, "-o", "again.exr"],
        &["compare", "truth/picture.exr", "again.exr", "--mask", "truth/depth.npy", "--json", "error.json"],
    ] {
        let output = run.command(args);
        assert!(output.status.success(), "{args:?}: {}", text(&output));
    }
    let record: serde_json::Value =
        serde_json::from_slice(&fs::read(run.path("error.json")).expect("figures")).expect("JSON");
    record["liquid"]["flip"].as_f64().expect("an error")
}

fn tune(run: &Run, goal: [&str; 2]) -> std::process::Output {
    let small = ["--size", "96x72", "--frames", "1", "--rounds", "1", "--most", "16", "--samples", "64"];
    run.command(&[&["tune", "-o", "tuned.toml"], &goal[..], &small].concat())
}

#[test]
fn the_error_is_kept() {
    let run = Run::new();
    let output = tune(&run, ["--max-error", "0.28"]);
    assert!(output.status.success(), "{}", text(&output));
    let said = text(&output);
    let found: f64 = said.rsplit("FLIP ").next().and_then(|t| t.split(',').next()?.parse().ok()).expect("an error");
    let again = error(&run, "tuned.toml");
    assert!(found <= 0.28 && (again - found).abs() < 1e-3, "{said}: {again}");
    // What was measured is not measured again.
    let scene = fs::read(run.path("tuned.toml")).expect("a scene");
    let output = tune(&run, ["--max-error", "0.28"]);
    assert!(output.status.success(), "{}", text(&output));
    assert_eq!(fs::read(run.path("tuned.toml")).expect("a scene"), scene);
    fs::remove_file(run.path("tuned.toml")).expect("there");
    run.refused(
        1,
        &[
            "tune",
            "-o",
            "tuned.toml",
            "--max-error",
            "0.0001",
            "--size",
            "96x72",
            "--frames",
            "1",
            "--rounds",
            "1",
            "--most",
            "16",
            "--samples",
            "64",
        ],
        &["nothing that was measured is within an error of 0.0001", "comes closest"],
    );
}

#[test]
fn the_budget_is_kept_and_goals_are_asked_for() {
    let run = Run::new();
    let output = tune(&run, ["--budget-ms", "100000"]);
    assert!(output.status.success(), "{}", text(&output));
    // Of all that were shown it has the least error.
    let said = text(&output);
    let rows: Vec<(bool, f64)> = said
        .lines()
        .skip_while(|l| !l.contains("95 %"))
        .skip(1)
        .take_while(|l| l.starts_with(['*', ' ']))
        .filter_map(|l| Some((l.starts_with('*'), l.split_whitespace().filter(|w| *w != "*").nth(2)?.parse().ok()?)))
        .collect();
    let chosen = rows.iter().find(|r| r.0).expect("a choice").1;
    assert!(rows.iter().all(|r| r.1 >= chosen), "{said}");
    for (args, words) in
        [(vec![], "--max-error"), (vec!["--max-error", "1", "--budget-ms", "1"], "cannot be used with")]
    {
        run.refused(2, &[&["tune", "-o", "x.toml"], &args[..]].concat(), &[words]);
    }
    run.refused(2, &["tune", "-o", "x.toml", "--max-error", "0"], &["above 0"]);
}
