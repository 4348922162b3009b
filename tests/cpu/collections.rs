//! Collections of VTK files: what they name is joined, and what cannot be is said.

use glam::DVec3;
use meniscus::io::Budget;
use meniscus::io::particles::{ReadError, describe, read, read_within, time_step, time_steps};
use std::{fs, path::Path};

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().expect("a folder"))
    }

    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> std::path::PathBuf {
        let path = self.0.path().join(name);
        fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        fs::write(&path, content).expect("written");
        path
    }

    /// Points along x from `first`, with velocities if `moving`.
    fn points(&self, name: &str, first: usize, count: usize, more: &str) {
        let places: String = (first..first + count).map(|x| format!("{x} 0 0 ")).collect();
        self.file(
            name,
            format!(
                "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"{count}\"><PointData>{more}</PointData>\
                 <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">{places}</DataArray></Points></Piece>\
                 </UnstructuredGrid></VTKFile>"
            ),
        );
    }

    fn refused(&self, path: &Path, words: &[&str]) {
        let error = read(path).expect_err("refused");
        let message = error.to_string();
        assert!(message.starts_with(&path.display().to_string()) && message.contains("; "), "{message}");
        assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
    }
}

fn pvd(entries: &[(&str, &str)]) -> String {
    let sets: String = entries
        .iter()
        .map(|(time, file)| format!("<DataSet timestep=\"{time}\" group=\"\" part=\"0\" file=\"{file}\"/>"))
        .collect();
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\"><Collection>{sets}</Collection></VTKFile>\n"
    )
}

fn pieces(kind: &str, files: &[&str]) -> String {
    let pieces: String = files.iter().map(|file| format!("<Piece Source=\"{file}\"/>")).collect();
    format!("<VTKFile type=\"P{kind}\"><P{kind} GhostLevel=\"1\"><PPoints/>{pieces}</P{kind}></VTKFile>")
}

fn xs(positions: &[DVec3]) -> Vec<f64> {
    positions.iter().map(|p| p.x).collect()
}

const VELOCITY: &str =
    "<DataArray type=\"Float32\" Name=\"v\" NumberOfComponents=\"3\" format=\"ascii\">1 2 3</DataArray>";

/// By VTK 9.7: a block of five points, an empty one, one of seven.
#[test]
fn blocks_by_vtk() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/vtk_blocks.vtm");
    let (file, contents) = describe(&path, &Budget::default()).expect("blocks");
    assert_eq!((file.positions.len(), contents.files), (12, 2));
    assert_eq!(file.ids, Some(vec![4, 3, 2, 1, 0, 6, 5, 4, 3, 2, 1, 0]));
    assert_eq!(file.positions[5], DVec3::new(87.4375, 156.125, -244.4375));
    assert_eq!((file.velocities.map(|v| v.len()), file.classes.map(|c| c.len())), (Some(12), Some(12)));
}

#[test]
fn pieces_are_joined_without_their_ghosts() {
    let folder = Folder::new();
    let ghosts = "<DataArray type=\"UInt8\" Name=\"vtkGhostType\" format=\"ascii\">0 0 1 32</DataArray>\
                  <DataArray type=\"Int32\" Name=\"id\" format=\"ascii\">10 11 12 13</DataArray>";
    let ids = "<DataArray type=\"Int32\" Name=\"id\" format=\"ascii\">12 15</DataArray>";
    folder.points("run/p_0.vtu", 0, 4, ghosts);
    folder.points("run/p_1.vtu", 2, 2, ids);
    // Of a process without particles.
    folder.points("run/p_2.vtu", 0, 0, "");
    let path = folder.file("run.pvtu", pieces("UnstructuredGrid", &["run/p_2.vtu", "run/p_0.vtu", "run/p_1.vtu"]));
    let read = read(&path).expect("pieces");
    // A point of another piece is left out, one of the edge of a hidden cell (32) stays.
    assert_eq!((xs(&read.positions), read.ids), (vec![0.0, 1.0, 3.0, 2.0, 3.0], Some(vec![10, 11, 13, 12, 15])));
}

#[test]
fn one_time_is_joined_and_several_are_a_sequence() {
    let folder = Folder::new();
    for (i, first) in [0, 10, 20].into_iter().enumerate() {
        folder.points(&format!("out/a_{i}.vtu"), first, 2, "");
    }
    folder.file("inner.pvd", pvd(&[("0", "out/a_2.vtu")]));
    let one = folder.file("one.pvd", pvd(&[("1.5", "out/a_0.vtu"), ("1.5", "inner.pvd")]));
    let (file, contents) = describe(&one, &Budget::default()).expect("one time");
    assert_eq!(xs(&file.positions), [0.0, 1.0, 20.0, 21.0]);
    assert_eq!((contents.time, contents.files), (Some(1.5), 3));
    let steps = time_steps(&one, &Budget::default()).expect("steps");
    assert_eq!((steps.len(), steps[0].time, steps[0].files.len()), (1, 1.5, 2));
    let joined = steps[0].describe(&Budget::default()).expect("both");
    assert_eq!(joined, (file, contents));
    let all = folder.file("all.pvd", pvd(&[("0.5", "out/a_1.vtu"), ("0", "out/a_0.vtu"), ("1e0", "out/a_2.vtu")]));
    folder.refused(&all, &["3 time steps, from 0 to 1", "meniscus sequence"]);
    let steps = time_steps(&all, &Budget::default()).expect("steps");
    let names: Vec<_> =
        steps.iter().map(|step| (step.time, step.files[0].strip_prefix(folder.0.path()).expect("inside"))).collect();
    assert_eq!(
        names,
        [(0.0, "out/a_0.vtu"), (0.5, "out/a_1.vtu"), (1.0, "out/a_2.vtu")].map(|(t, f)| (t, Path::new(f)))
    );
}

#[test]
fn a_time_has_one_step() {
    let folder = Folder::new();
    for i in 0..3 {
        folder.points(&format!("a{i}.vtu"), 10 * i, 1, "");
    }
    let all = [("0", "a1.vtu"), ("0.30000001", "a0.vtu"), ("0.9", "a2.vtu"), ("0.9", "a0.vtu")];
    let path = folder.file("all.PVD", pvd(&all));
    let at = |time| time_step(&path, time, &Budget::default());
    let first = |time| xs(&at(time).expect("a step").read(&Budget::default()).expect("read").positions)[0];
    for (time, x) in
        [(0.0, 10.0), (-0.002, 10.0), (0.296, 10.0), (0.3, 0.0), (0.89, 0.0), (0.8999, 20.0), (0.902, 20.0)]
    {
        assert_eq!(first(time), x, "{time}");
    }
    for outside in [-0.004, 0.904, f64::NAN, f64::INFINITY] {
        let error = at(outside).expect_err("outside");
        assert!(matches!(error, ReadError::NoTime { first: 0.0, last: 0.9, .. }), "{error}");
    }
    // Of one time it is that time alone.
    let path = folder.file("one.pvd", pvd(&[("1e3", "a1.vtu")]));
    assert_eq!(time_step(&path, 1000.0005, &Budget::default()).expect("near").time, 1000.0);
    assert!(time_step(&path, 1000.002, &Budget::default()).is_err());
    let path = folder.file("none.pvd", "<VTKFile type=\"Collection\"><DataSet file=\"a0.vtu\"/></VTKFile>");
    let message = time_step(&path, 0.0, &Budget::default()).expect_err("no times").to_string();
    assert!(message.contains("none of its files has a time"), "{message}");
}

#[test]
fn what_cannot_be_joined_is_said() {
    let folder = Folder::new();
    folder.points("a.vtu", 0, 1, "");
    folder.points("b.vtu", 1, 1, VELOCITY);
    let missing = folder.file("missing.pvd", pvd(&[("0", "a.vtu"), ("0", "gone/c.vtu")]));
    folder.refused(&missing, &["gone/c.vtu: no such file"]);
    let unlike = folder.file("unlike.pvtu", pieces("UnstructuredGrid", &["a.vtu", "b.vtu"]));
    folder.refused(&unlike, &["b.vtu", "`velocity` it has one", "others have none"]);
    let unlike = folder.file("unlike.pvtu", pieces("UnstructuredGrid", &["b.vtu", "a.vtu"]));
    folder.refused(&unlike, &["a.vtu", "`velocity` others have one"]);
    let twice = folder.file("twice.vtm", pvd(&[("0", "a.vtu"), ("0", "./a.vtu")]));
    folder.refused(&twice, &["names", "twice"]);
    let itself = folder.file("itself.pvd", pvd(&[("0", "itself.pvd")]));
    folder.refused(&itself, &["which names it"]);
    folder.file("round/two.vtm", pvd(&[("0", "../one.pvd")]));
    let round = folder.file("one.pvd", pvd(&[("0", "round/two.vtm")]));
    folder.refused(&round, &["one.pvd", "which names it"]);
    for i in 0..6 {
        folder.file(&format!("deep{i}.pvd"), pvd(&[("0", &format!("deep{}.pvd", i + 1))]));
    }
    folder.refused(&folder.0.path().join("deep0.pvd"), &["more than 4 deep"]);
    folder.refused(&folder.file("a.pvd", pvd(&[("soon", "a.vtu")])), &["`soon`", "no time"]);
    folder.refused(&folder.file("a.pvd", pvd(&[])), &["holds no positions"]);
    folder.refused(&folder.file("a.pvd", pvd(&[("0", &"x".repeat(1000))])), &["more than 250 letters"]);
    folder.refused(&folder.file("a.pvd", pvd(&[("0", "picture.vti")])), &["picture.vti: no such file"]);
    folder.refused(&folder.file("a.pvd", &pvd(&[("0", "a.vtu")])[..100]), &["</VTKFile>"]);
}

#[test]
fn together_they_stay_within_the_budget() {
    let folder = Folder::new();
    let names: Vec<String> = (0..8).map(|i| format!("p{i}.xyz")).collect();
    for name in &names {
        folder.file(name, vec![0_u8; 12 * 10_000]);
    }
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let path = folder.file("all.pvtp", pieces("PolyData", &names));
    // Each takes .36 MB, all together 1.9.
    let error = read_within(&path, &Budget::new(1 << 20)).expect_err("too large");
    assert!(matches!(&error, ReadError::TooLarge { .. }) && error.to_string().contains("together"), "{error}");
    assert_eq!(read_within(&path, &Budget::new(2 << 20)).expect("room").positions.len(), 80_000);
}
