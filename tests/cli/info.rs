//! What is in particle files.

use crate::{Run, text};
use serde_json::Value;

#[test]
fn a_file_is_described_without_a_device() {
    let run = Run::new();
    let dump = "ITEM: TIME\n0.5\nITEM: TIMESTEP\n40\nITEM: NUMBER OF ATOMS\n4\nITEM: BOX BOUNDS pp pp pp\n0 1\n0 1\n0 1\nITEM: ATOMS id x y z vx vy vz\n\
                9 0 0 0 0 0 0\n7 0.5 0 0 0 3 4\n8 0 0.5 0 0 0 1\n6 10 0.5 4 0 0 0\n";
    let file = run.file("a.lammpstrj", dump);
    let described = |args: &[&str]| {
        // No driver's manifest is there.
        let output = run.prepared(args).env("VK_DRIVER_FILES", "/nowhere.json").output().expect("meniscus starts");
        assert!(output.status.success(), "{}", text(&output));
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let shown = described(&["info", &file]);
    for line in [
        "format     LAMMPS dump, text",
        "time       0.5",
        "step       40",
        "particles  4",
        "bounds     0 0 0 to 10 0.5 4",
        "spacing    0.5 (median",
        "radius     0.2777",
        "velocities up to 5",
        "ids        6 to 9, all different",
        "arrays     id: text x 1",
    ] {
        assert!(shown.contains(line), "{line}: {shown}");
    }
    let table = run.file("b.csv", "x,y,z,class,id,radius\n0,0,0,1,5,0.25\n1,0,0,0,5,0.25\n2,nan,0,1,6,0.25\n");
    let all: Value = serde_json::from_str(&described(&["info", "--json", &file, &table])).expect("JSON");
    assert_eq!((&all[0]["particles"], &all[0]["time"], &all[0]["ids"]), (&4.into(), &0.5.into(), &vec![6, 9].into()));
    let b = &all[1];
    assert_eq!((&b["particles"], &b["not_finite"], &b["radius"]), (&3.into(), &1.into(), &0.25.into()));
    assert_eq!((&b["radius_source"], &b["classes"], &b["ids"]), (&"file".into(), &vec![1, 1].into(), &Value::Null));
    assert_eq!((&b["arrays"][3]["name"], &b["arrays"][3]["type"]), (&"class".into(), &"text".into()));
    assert_eq!(b["bounds"], serde_json::json!([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]));
}

#[test]
fn a_file_that_cannot_be_read_is_named_beside_the_others() {
    let run = Run::new();
    let good = run.file("a.xyz", "0 0 0\n1 0 0\n");
    let output = run.command(&["info", "missing.vtk", &good]);
    let text = text(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("missing.vtk: no such file") && text.contains("particles  2"), "{text}");
    run.refused(2, &["info", "--json"], &["FILES"]);
}
