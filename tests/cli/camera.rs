//! Cameras of other programs.

use crate::{Run, sequence::frames, text};
use std::{fs, process::Command};

const GUIDE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/blender.md");

/// As much of Blender as the script asks for: a camera that goes along x and turns about z, on something scaled; particles with
/// y up are seen from (1.5 + frame/10, 0.7, -2).
const BPY: &str = r#"
from types import SimpleNamespace as Some
from math import cos, sin

class Scene:
    frame_start, frame_end, frame_step, frame_current = 0, 4, 1, 2
    render = Some(resolution_x=192, resolution_y=144, resolution_percentage=50, pixel_aspect_x=1.0, pixel_aspect_y=1.0)
    def frame_set(self, frame):
        self.now = frame
    @property
    def camera(self):
        return Some(evaluated_get=self.evaluated)
    def evaluated(self, graph):
        assert graph == "graph"
        a = 2.6 + 0.05 * self.now
        # Right, up and backwards, the latter two swapped by a quarter turn about x.
        rows = ((2 * cos(a), 0, 2 * sin(a), 1.5 + 0.1 * self.now), (2 * sin(a), 0, -2 * cos(a), 2.0), (0, 2, 0, 0.7), (0, 0, 0, 1))
        lens = Some(type="PERSP", sensor_fit="VERTICAL", sensor_width=36.0, sensor_height=24.0, lens=30.0 + self.now,
                    shift_x=0.05, shift_y=-0.1, clip_start=0.1, clip_end=100.0)
        return Some(matrix_world=rows, data=lens)

context = Some(scene=Scene(), evaluated_depsgraph_get=lambda: "graph")
data = Some(filepath="scene.blend")
"#;

/// Runs the script that docs/blender.md shows, in a Blender that is made up.
fn export(run: &Run) {
    let guide = fs::read_to_string(GUIDE).expect("the guide");
    let script = guide.split("```python\n").nth(1).and_then(|t| t.split("```").next()).expect("a script");
    run.file("export_camera.py", script);
    run.file("bpy.py", BPY);
    let mut python = Command::new("python3");
    python.args(["-B", "export_camera.py", "--", "camera.json"]).current_dir(run.folder.path());
    let output = python.output().expect("python3, which setup.sh installs");
    assert!(output.status.success() && text(&output).contains("5 frames"), "{}", text(&output));
}

fn succeeds(run: &Run, args: &[&str]) {
    let output = run.command(args);
    assert!(output.status.success(), "{args:?}: {}", text(&output));
}

/// What the camera above is, said without a file.
fn scene(frame: f64) -> String {
    let a = 2.6 + 0.05 * frame;
    let eye = [1.5 + 0.1 * frame, 0.7, -2.0];
    // Ahead is -(sin, -cos) in Blender's x and y.
    let target = [eye[0] - a.sin(), eye[1], eye[2] - a.cos()];
    let fov_y = 2.0 * (12.0 / (30.0 + frame)).atan().to_degrees();
    format!(
        "size = [96, 72]\nradius = 0.05\n[camera]\neye = {eye:?}\ntarget = {target:?}\nfov_y = {fov_y}\nshift = [{}, -0.1]\n\
         near = 0.1\n[settings.liquid]\nabsorption = [0.4, 0.2, 0.1]\n",
        0.05 * 72.0 / 96.0
    )
}

/// Pictures are the same but for what rounding moves: of few bytes, and not far.
fn same(run: &Run, a: &str, b: &str) {
    let (a_pixels, b_pixels) = (run.pixels(a), run.pixels(b));
    assert_eq!(a_pixels.len(), b_pixels.len(), "{a}, {b}");
    let off = a_pixels.iter().zip(&b_pixels).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert!(off * 100 < a_pixels.len(), "{a}, {b}: {off} of {}", a_pixels.len());
}

#[test]
fn what_blender_exports_is_what_is_seen() {
    let run = Run::new();
    export(&run);
    frames(&run, 4);
    let given = ["--radius", "0.05", "--absorption", "0.4,0.2,0.1", "--camera", "camera.json"];
    succeeds(&run, &[&["sequence", "f/*.csv", "-o", "#.png"], &given[..]].concat());
    for frame in 0..4 {
        let file = format!("f/p{frame}.csv");
        run.file("said.toml", scene(f64::from(frame)));
        succeeds(&run, &["render", &file, "--scene", "said.toml", "-o", "said.png"]);
        same(&run, &format!("{frame}.png"), "said.png");
    }
    // The picture is of liquid: most of it changes without any.
    run.file("none.csv", "x,y,z\n");
    succeeds(&run, &["render", "none.csv", "--scene", "said.toml", "-o", "none.png"]);
    let (with, without) = (run.pixels("said.png"), run.pixels("none.png"));
    assert!(with.iter().zip(&without).filter(|(a, b)| a != b).count() > with.len() / 20);

    // The frame that Blender was at, one between two, and all of it in a scene file.
    let one = |more: &[&str]| succeeds(&run, &[&["render", "f/p2.csv", "-o", "one.png"], &given[..], more].concat());
    one(&[]);
    same(&run, "one.png", "2.png");
    one(&["--camera-frame", "2.5", "--save-scene", "saved.toml"]);
    run.file("said.toml", scene(2.5));
    succeeds(&run, &["render", "f/p2.csv", "--scene", "said.toml", "-o", "said.png"]);
    same(&run, "one.png", "said.png");
    succeeds(&run, &["render", "f/p2.csv", "--scene", "saved.toml", "-o", "again.png"]);
    assert!(run.pixels("again.png") == run.pixels("one.png"), "the saved scene is another");
    run.file(
        "named.toml",
        "camera = \"camera.json\"\nradius = 0.05\n[settings.liquid]\nabsorption = [0.4, 0.2, 0.1]\n",
    );
    succeeds(&run, &["render", "f/p2.csv", "--scene", "named.toml", "--camera-frame", "2.5", "-o", "again.png"]);
    assert!(run.pixels("again.png") == run.pixels("one.png"), "named in a scene file it is another");
}

/// The view goes right and up by parts of the picture, so what it shows goes left and down, by so many pixels.
#[test]
fn a_shift_is_as_far_as_it_says() {
    let run = Run::new();
    run.file("one.csv", "x,y,z\n0,0,0\n");
    let middle = |shift: [f64; 2]| -> [f64; 2] {
        let scene = format!(
            "size = [96, 72]\nradius = 0.2\nbackground = \"none\"\n[camera]\neye = [0.0, 0.0, 4.0]\ntarget = [0.0, 0.0, 0.0]\n\
             shift = {shift:?}\n"
        );
        run.file("shifted.toml", scene);
        succeeds(&run, &["render", "one.csv", "--scene", "shifted.toml", "-o", "shifted.png"]);
        let picture = image::open(run.path("shifted.png")).expect("a picture").to_rgba8();
        let covered: Vec<_> = picture.enumerate_pixels().filter(|(_, _, p)| p.0[3] > 127).collect();
        assert!(covered.len() > 20, "{shift:?}: {}", covered.len());
        let mean = |of: fn(&(u32, u32, &image::Rgba<u8>)) -> u32| {
            covered.iter().map(|p| f64::from(of(p)) + 0.5).sum::<f64>() / covered.len() as f64
        };
        [mean(|p| p.0), mean(|p| p.1)]
    };
    for (shift, wanted) in [([0.0, 0.0], [48.0, 36.0]), ([0.25, 0.125], [24.0, 45.0]), ([-0.125, -0.25], [60.0, 18.0])]
    {
        let found = middle(shift);
        assert!((0..2).all(|i| (found[i] - wanted[i]).abs() < 1.0), "{shift:?}: {found:?}, not {wanted:?}");
    }
}

/// Between simulated frames the camera is between its own.
#[test]
fn the_camera_moves_between_frames() {
    let run = Run::new();
    export(&run);
    for (i, x) in [(1, 0.0), (3, 0.2)] {
        run.file(&format!("p{i}.csv"), format!("x,y,z,vx,vy,vz\n{x},0.3,0.2,1,0,0\n{},0.3,0.2,1,0,0\n", x + 0.1));
    }
    let args = ["sequence", "p1.csv", "p3.csv", "-o", "#.png", "--step", "0.2", "--fps", "10", "--radius", "0.05"];
    let camera = ["--absorption", "0,0,0", "--camera", "camera.json"];
    succeeds(&run, &[&args[..], &camera].concat());
    // The second of three is as if there were a file 2.
    run.file("p2.csv", "x,y,z\n0.1,0.3,0.2\n0.2,0.3,0.2\n");
    let args = ["render", "p2.csv", "-o", "one.png", "--radius", "0.05", "--camera-frame", "2"];
    succeeds(&run, &[&args[..], &camera].concat());
    same(&run, "1.png", "one.png");
}

#[test]
fn what_cannot_be_is_refused() {
    let run = Run::new();
    export(&run);
    frames(&run, 2);
    let camera = ["--camera", "camera.json"];
    let render = |more: &[&'static str]| [&["render", "-o", "a.png"], &camera[..], more].concat();
    run.refused(2, &render(&["--eye", "1,2,3"]), &["--camera", "--eye"]);
    run.refused(2, &[&["sequence", "f/*.csv", "-o", "#.png", "--turn", "9"], &camera[..]].concat(), &["--turn"]);
    run.refused(1, &["sequence", "f/*.csv", "-o", "#.png", "--camera-frame", "2"], &["--camera-frame"]);
    run.refused(1, &["render", "-o", "a.png", "--camera-frame", "2"], &["--camera"]);
    run.refused(1, &["render", "-o", "a.png", "--camera", "none.json"], &["none.json", "docs/blender.md"]);
    run.refused(1, &render(&["--up", "1,0,0"]), &["camera.json", "--up 0,0,1", "--up 0,1,0"]);
    run.file("s.toml", "[camera]\nfile = \"camera.json\"\nfov_y = 30.0\n");
    run.refused(1, &["render", "-o", "a.png", "--scene", "s.toml"], &["camera.fov_y", "leave one of them out"]);
    run.file("s.toml", "camera = \"camera.json\"\n");
    let turned = ["sequence", "f/*.csv", "-o", "#.png", "--scene", "s.toml", "--turn", "9"];
    run.refused(1, &turned, &["--turn", "leave one of them out"]);
}
