//! Camera files, against closed forms of what they say.

use super::*;

/// A camera at (1, 2, 3) of a world with z up that looks along +y.
const AHEAD: &str = r#""matrix": [[1, 0, 0, 1], [0, 0, -1, 2], [0, 1, 0, 3], [0, 0, 0, 1]]"#;

fn read(text: &str) -> Result<CameraFile, String> {
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), text).expect("written");
    CameraFile::read(file.path()).map_err(|e| e.to_string())
}

fn seen(text: &str, up: DVec3, frame: Option<f64>, size: [u32; 2]) -> View {
    let mut view = View { up, ..View::default() };
    read(text).and_then(|f| f.apply(&mut view, frame, size).map_err(|e| e.to_string())).expect(text);
    view
}

fn json(camera: &str, rest: &str) -> String {
    format!("{{\"format\": \"meniscus camera 1\", \"camera\": {{{camera}}}{rest}}}")
}

fn ahead(view: &View) -> DVec3 {
    (view.target.expect("a target") - view.eye.expect("an eye")).normalize()
}

#[test]
fn axes_follow_from_what_is_up() {
    let text = json(&format!("{AHEAD}, \"lens\": 50"), ", \"up\": \"z\"");
    let same = seen(&text, DVec3::Z, None, [200, 100]);
    assert_eq!(same.eye, Some(DVec3::new(1.0, 2.0, 3.0)));
    assert!(ahead(&same).abs_diff_eq(DVec3::Y, 1e-12) && same.upright.expect("up").abs_diff_eq(DVec3::Z, 1e-12));
    let turned = seen(&text, DVec3::Y, None, [200, 100]);
    assert_eq!(turned.eye, Some(DVec3::new(1.0, 3.0, -2.0)));
    assert!(ahead(&turned).abs_diff_eq(DVec3::NEG_Z, 1e-12), "{turned:?}");
    assert!(turned.upright.expect("up").abs_diff_eq(DVec3::Y, 1e-12));
    // And back, from a world with y up; without a word the axes are the particles'.
    let back = seen(&text.replace("\"z\"", "\"y\""), DVec3::Z, None, [200, 100]);
    assert_eq!(back.eye, Some(DVec3::new(1.0, -3.0, 2.0)));
    let own = seen(&json(&format!("{AHEAD}, \"lens\": 50"), ""), DVec3::X, None, [200, 100]);
    assert_eq!(own.eye, Some(DVec3::new(1.0, 2.0, 3.0)));
    let mut view = View { up: DVec3::X, ..View::default() };
    let refused = read(&text).expect("a camera").apply(&mut view, None, [1, 1]).expect_err("no such axes");
    assert!(refused.to_string().contains("--up 0,0,1"), "{refused}");
}

#[test]
fn a_lens_fits_the_picture() {
    let view = |more: &str, size| seen(&json(&format!("{AHEAD}, {more}"), ""), DVec3::Y, None, size);
    let tan = |view: &View| (0.5 * f64::from(view.fov_y)).to_radians().tan();
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} and {b}");
    // 36 mm are the longer side, whichever that is, or the one that is said.
    near(tan(&view("\"lens\": 36", [200, 100])), 0.25);
    near(tan(&view("\"lens\": 36", [100, 200])), 0.5);
    near(tan(&view("\"lens\": 36, \"fit\": \"horizontal\"", [100, 200])), 1.0);
    near(tan(&view("\"lens\": 36, \"sensor\": 18, \"fit\": \"vertical\"", [200, 100])), 0.25);
    near(f64::from(view("\"fov_y\": 33", [200, 100]).fov_y), 33.0);
    // So is a shift's unit: a tenth of the longer side is a fifth of the shorter.
    let shifted = view("\"lens\": 36, \"shift\": [0.1, -0.1], \"clip\": [0.25, 9]", [200, 100]);
    assert_eq!((shifted.shift, shifted.near), (DVec2::new(0.1, -0.2), Some(0.25)));
    let shifted = view("\"lens\": 36, \"fit\": \"vertical\", \"shift\": [0.1, -0.1]", [200, 100]);
    assert_eq!(shifted.shift, DVec2::new(0.05, -0.1));
}

#[test]
fn frames_are_keys() {
    let place = |x: f64| format!("\"matrix\": [[1, 0, 0, {x}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]");
    let frames = format!(
        ", \"frames\": [{{\"frame\": 10, {}}}, {{\"frame\": 20, {}, \"lens\": 70}}]",
        place(1.0),
        // A quarter turn about up, and twice as large.
        "\"matrix\": [[0, 0, 2, 3], [0, 2, 0, 0], [-2, 0, 0, 0], [0, 0, 0, 1]]"
    );
    let text = json("\"lens\": 50, \"sensor\": 20, \"fit\": \"vertical\"", &frames);
    let x = |frame| seen(&text, DVec3::Y, frame, [10, 10]).eye.expect("an eye").x;
    assert_eq!(
        [None, Some(-5.0), Some(10.0), Some(15.0), Some(20.0), Some(99.0)].map(x),
        [1.0, 1.0, 1.0, 2.0, 3.0, 3.0]
    );
    let between = seen(&text, DVec3::Y, Some(15.0), [10, 10]);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!(ahead(&between).abs_diff_eq(DVec3::new(-half, 0.0, -half), 1e-12), "{between:?}");
    assert!((f64::from(between.fov_y) - 2.0 * (10.0f64 / 60.0).atan().to_degrees()).abs() < 1e-5);
    // A camera that is somewhere without frames is there.
    let still = json(&format!("{}, \"lens\": 50", place(7.0)), &frames);
    assert_eq!(seen(&still, DVec3::Y, None, [10, 10]).eye.expect("an eye").x, 7.0);
}

#[test]
fn paraviews_cameras_are_read() {
    let property = |name: &str, values: &[f64]| {
        let all: String =
            values.iter().enumerate().map(|(i, v)| format!("<Element index=\"{i}\" value=\"{v}\"/>")).collect();
        format!("<Property name=\"{name}\" id=\"7.{name}\" number_of_elements=\"{}\">{all}</Property>", values.len())
    };
    let file = |eye: &[f64], angle: f64, parallel: f64| {
        let [eye, target, up] =
            [("CameraPosition", eye), ("CameraFocalPoint", &[1.0, 0.0, 0.0]), ("CameraViewUp", &[0.0, 0.6, 0.8])]
                .map(|(n, v)| property(n, v));
        let [angle, parallel] =
            [("CameraViewAngle", angle), ("CameraParallelProjection", parallel)].map(|(n, v)| property(n, &[v]));
        format!(
            "<?xml version=\"1.0\"?>\n<PVCameraConfiguration description=\"ParaView camera configuration\" version=\"1.0\">\n\
             <Proxy group=\"views\" type=\"RenderView\" id=\"7\" servers=\"21\">{eye}{target}{up}{angle}{parallel}</Proxy>\n\
             </PVCameraConfiguration>"
        )
    };
    let view = seen(&file(&[5.0, 0.0, 0.0], 25.0, 0.0), DVec3::Z, None, [10, 10]);
    assert_eq!((view.eye, view.fov_y, view.up), (Some(DVec3::new(5.0, 0.0, 0.0)), 25.0, DVec3::Z));
    assert!(ahead(&view).abs_diff_eq(DVec3::NEG_X, 1e-12));
    assert!(view.upright.expect("up").abs_diff_eq(DVec3::new(0.0, 0.6, 0.8), 1e-12), "{view:?}");
    let refused = |text: String| read(&text).expect_err("no camera");
    assert!(refused(file(&[5.0, 0.0, 0.0], 25.0, 1.0)).contains("parallel"));
    assert!(refused(file(&[5.0, 0.0], 25.0, 0.0)).contains("CameraPosition"));
    assert!(refused(file(&[1.0, 0.0, 0.0], 25.0, 0.0)).contains("one line"));
    assert!(refused("<a>".into()).contains("CameraPosition") && refused("<a><b></a>".into()).contains("XML"));
}

#[test]
fn bad_files_are_named() {
    let camera = |more: &str| json(&format!("{AHEAD}, {more}"), "");
    for (text, words) in [
        ("{".into(), &["line 1"][..]),
        ("{\"format\": \"2\"}".into(), &["format", "meniscus camera 1"]),
        (json("\"lens\": 50", ""), &["matrix", "missing"]),
        (camera("\"sensor\": 36"), &["lens", "fov_y"]),
        (camera("\"lens\": 50, \"fov_y\": 30"), &["lens"]),
        (camera("\"lens\": 0"), &["lens", "above 0"]),
        (camera("\"fov_y\": 180"), &["below 170"]),
        (camera("\"lens\": 50, \"shift\": [1e9, 0]"), &["shift"]),
        (camera("\"lens\": 50, \"clip\": [2, 1]"), &["clip"]),
        (camera("\"lens\": 50, \"focus\": 1"), &["focus"]),
        (camera("\"lens\": 50").replace("[1, 0, 0, 1]", "[-1, 0, 0, 1]"), &["matrix", "mirror"]),
        (camera("\"lens\": 50").replace("[1, 0, 0, 1]", "[1, 1, 0, 1]"), &["matrix", "shear"]),
        (camera("\"lens\": 50").replace("[1, 0, 0, 1]", "[0, 0, 0, 1]"), &["matrix"]),
        (json("\"lens\": 5", &format!(", \"frames\": [{{{AHEAD}}}]")), &["frames[0].frame"]),
        (
            json("\"lens\": 5", &format!(", \"frames\": [{{\"frame\": 1, {AHEAD}}}, {{\"frame\": 1, {AHEAD}}}]")),
            &["frames[1].frame", "higher"],
        ),
        (json("\"lens\": 5", ", \"size\": [0, 1]"), &["size"]),
    ] {
        let said = read(&text).expect_err(&text);
        assert!(words.iter().all(|w| said.contains(w)), "{text}: {said}");
    }
    // As wide as that no picture is.
    let mut view = View::default();
    let wide = read(&camera("\"lens\": 1, \"sensor\": 30")).expect("a camera");
    assert!(wide.apply(&mut view, None, [100, 100]).expect_err("too wide").to_string().contains("170"));
}
