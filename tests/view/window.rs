//! What the window shows, what it writes, and what keys and mouse do to it.

use crate::display::{self, Display, Window, keys};
use meniscus::host::Instance;
use std::{fs, path::Path, process::Command};

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().expect("a folder"))
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    /// Waits for a picture and its scene file, which are those that `render` makes of the scene: bit for bit. Returns the scene.
    fn is_what_render_writes(&self, window: &mut Window, device: &str) -> toml::Table {
        window.key(keys::F2);
        let names = window.waits_for("wrote ");
        let mut scene = toml::Table::new();
        for pair in names.split(", ").collect::<Vec<_>>().chunks(2) {
            let [picture, file] = pair else { panic!("not in pairs: {names}") };
            let mut render = Command::new(env!("CARGO_BIN_EXE_meniscus"));
            render.args(["render", "--scene", file, "-o", "rendered.png", "--device", device]).current_dir(self.path());
            let output = render.env("VK_ADD_DRIVER_FILES", display::drivers()).output().expect("meniscus starts");
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            let image = |name: &str| image::open(self.path().join(name)).expect("a picture").to_rgb8();
            let (seen, rendered) = (image(picture), image("rendered.png"));
            assert_eq!(seen.dimensions(), rendered.dimensions(), "{picture}");
            let other = seen.pixels().zip(rendered.pixels()).filter(|(a, b)| a != b).count();
            assert_eq!(other, 0, "{picture} has pixels that render does not write");
            assert!(seen.pixels().any(|p| p != seen.get_pixel(0, 0)), "{picture} is all one colour");
            scene = fs::read_to_string(self.path().join(file)).expect("a scene file").parse().expect("TOML");
        }
        scene
    }
}

/// What of a scene file is at the end of these keys.
fn at<'a>(scene: &'a toml::Table, keys: &str) -> &'a toml::Value {
    let (first, rest) = keys.split_once('.').unwrap_or((keys, ""));
    let first = scene.get(first).unwrap_or_else(|| panic!("no {keys} in {scene}"));
    rest.split('.').filter(|k| !k.is_empty()).fold(first, |value, key| value.get(key).expect("an entry"))
}

fn place(scene: &toml::Table, keys: &str) -> [f64; 3] {
    let place = at(scene, keys).as_array().expect("three numbers");
    [0, 1, 2].map(|i| place[i].as_float().expect("a number"))
}

fn eye(scene: &toml::Table) -> [f64; 3] {
    place(scene, "camera.eye")
}

fn target(scene: &toml::Table) -> [f64; 3] {
    place(scene, "camera.target")
}

fn moved(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// Keeps what is seen, to be looked at.
fn keep(window: &Window, name: &str) {
    let (size, pixels) = window.pixels();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/view");
    fs::create_dir_all(&folder).expect("target/view");
    let image = image::RgbImage::from_raw(size[0], size[1], pixels.concat()).expect("all pixels");
    image.save(folder.join(name)).expect("a picture");
}

/// Every driver that can present: the window's own pixels are those of the picture, but for rounding, and those `render`'s.
#[test]
fn every_driver_shows_what_render_writes() {
    let display = Display::new();
    let devices = Instance::new(false).expect("Vulkan").devices().expect("devices");
    let wanted = std::env::var("MENISCUS_DRIVERS").unwrap_or_default();
    let wanted: Vec<_> = wanted.split(',').filter(|w| !w.is_empty()).collect();
    let usable = devices.iter().filter(|d| d.refusal.is_none());
    let mut shown = 0;
    for device in usable.filter(|d| wanted.is_empty() || wanted.iter().any(|w| d.is_called(w))) {
        let folder = Folder::new();
        let label = device.label();
        let mut window = Window::open(&display, folder.path(), &["--size", "400x300", "--device", &label]);
        folder.is_what_render_writes(&mut window, &label);
        window.settle();
        assert_eq!(window.pixels().1[401], [20, 24, 30], "{label}: the panel's ground");
        window.types("p");
        window.settle();
        let (size, pixels) = window.pixels();
        assert_eq!(size, [400, 300], "{label}");
        let picture = image::open(folder.path().join("view-0001.png")).expect("a picture").to_rgb8();
        let off = pixels.iter().zip(picture.pixels()).map(|(a, b)| (0..3).map(|i| a[i].abs_diff(b.0[i])).max());
        assert!(off.flatten().max() <= Some(1), "{label}: the window has other pixels than the picture");
        window.key(keys::ESCAPE);
        window.ends();
        shown += 1;
    }
    assert!(shown > 0, "no device that is wanted can present");
}

#[test]
fn mouse_and_keys_move_the_eye() {
    let (display, folder) = (Display::new(), Folder::new());
    let mut window = Window::open(&display, folder.path(), &["--size", "640x360", "--device", "llvmpipe"]);
    let mut last = folder.is_what_render_writes(&mut window, "llvmpipe");
    let start = [eye(&last), target(&last)];
    // Whether the eye moves, and what it looks at.
    let mut goes = |window: &mut Window, what: &str, moves: [bool; 2]| {
        let now = folder.is_what_render_writes(window, "llvmpipe");
        for (of, (place, moves)) in ["eye", "target"].iter().zip([eye, target].into_iter().zip(moves)) {
            let by = moved(place(&now), place(&last));
            assert!(if moves { by > 1e-3 } else { by < 1e-9 }, "{what} moves the {of} by {by}");
        }
        last = now;
        [eye(&last), target(&last)]
    };
    window.drag(1, [500, 200], [560, 180]);
    goes(&mut window, "an orbit", [true, false]);
    window.drag(2, [500, 200], [520, 210]);
    goes(&mut window, "a pan", [true, true]);
    window.drag(3, [500, 200], [520, 210]);
    goes(&mut window, "a look around", [false, true]);
    window.wheel(true, [500, 200]);
    goes(&mut window, "the wheel", [true, false]);
    window.down(b'w'.into());
    std::thread::sleep(std::time::Duration::from_millis(500));
    window.up(b'w'.into());
    goes(&mut window, "W", [true, true]);
    keep(&window, "moved.png");
    window.types("r");
    let back = goes(&mut window, "R", [true, true]);
    assert!((0..2).all(|i| moved(back[i], start[i]) < 1e-9), "R does not go back: {back:?}, {start:?}");
    window.close();
    window.ends();
}

#[test]
fn keys_change_methods_and_parameters_and_split_the_window() {
    let (display, folder) = (Display::new(), Folder::new());
    let mut window = Window::open(&display, folder.path(), &["--size", "800x600", "--device", "llvmpipe"]);
    window.types("m");
    let scene = folder.is_what_render_writes(&mut window, "llvmpipe");
    assert_eq!(at(&scene, "settings.method.smooth.name").as_str(), Some("plane-fit"));
    keep(&window, "panel.png");
    // Down to the optics, and on to two of them.
    (0..3).for_each(|_| window.key(keys::DOWN));
    window.key(keys::RIGHT);
    window.key(keys::F3);
    let file = window.waits_for("wrote ");
    assert!(file.ends_with(".toml") && !file.contains(','), "{file}");
    let scene = folder.is_what_render_writes(&mut window, "llvmpipe");
    assert_eq!(at(&scene, "settings.method.optics.name").as_str(), Some("two"));
    // The first parameter of the layers or of the smoothing is typed: one below its range is refused, and changes nothing.
    window.key(keys::DOWN);
    window.key(keys::ENTER);
    window.types("-1");
    window.key(keys::ENTER);
    let same = folder.is_what_render_writes(&mut window, "llvmpipe");
    assert_eq!(at(&same, "settings"), at(&scene, "settings"));
    keep(&window, "refused.png");
    window.types("x");
    let scene = folder.is_what_render_writes(&mut window, "llvmpipe");
    assert_eq!(at(&scene, "size").as_array().map(|s| s[0].as_integer()), Some(Some(400)));
    keep(&window, "split.png");
    window.key(keys::TAB);
    window.types("h");
    folder.is_what_render_writes(&mut window, "llvmpipe");
    window.settle();
    keep(&window, "help.png");
    window.types("x");
    folder.is_what_render_writes(&mut window, "llvmpipe");
    // Layers that the others do not go with bring others.
    window.types("m");
    window.key(keys::DOWN);
    let mut layers = Vec::new();
    for _ in 0..4 {
        window.key(keys::RIGHT);
        window.key(keys::F3);
        let scene = fs::read_to_string(folder.path().join(window.waits_for("wrote "))).expect("a scene file");
        let name = at(&scene.parse().expect("TOML"), "settings.method.layers.name").to_string();
        assert!(!layers.contains(&name), "{name} again, after {layers:?}");
        layers.push(name);
    }
    window.key(keys::ESCAPE);
    window.ends();
}

#[test]
fn the_window_is_resized_minimised_and_closed() {
    let (display, folder) = (Display::new(), Folder::new());
    let mut window = Window::open(&display, folder.path(), &["--size", "320x240", "--device", "llvmpipe"]);
    for i in 0..20 {
        window.resize([200 + 17 * i, 300 - 11 * i]);
        std::thread::sleep(std::time::Duration::from_millis(30));
    }
    window.resize([1, 1]);
    window.settle();
    window.resize([333, 222]);
    window.settle();
    let scene = folder.is_what_render_writes(&mut window, "llvmpipe");
    assert_eq!(at(&scene, "size").to_string(), "[333, 222]");
    window.minimise();
    window.settle();
    window.resize([300, 200]);
    window.restore();
    let scene = folder.is_what_render_writes(&mut window, "llvmpipe");
    assert_eq!(at(&scene, "size").to_string(), "[300, 200]");
    window.close();
    window.ends();
}

/// Particles of frame number so-and-so: a block that grows.
fn block(frame: usize) -> String {
    let place = |i: usize| format!("{},{},{}\n", 0.1 * (i % 6) as f64, 0.1 * (i / 6 % 6) as f64, 0.1 * (i / 36) as f64);
    "x,y,z\n".to_owned() + &(0..36 * (frame + 2)).map(place).collect::<String>()
}

#[test]
fn a_sequence_is_played_and_scrubbed() {
    let (display, folder) = (Display::new(), Folder::new());
    let names: Vec<_> = (0..5).map(|i| format!("frame{i}.csv")).collect();
    for (i, name) in names.iter().enumerate() {
        fs::write(folder.path().join(name), if i == 3 { "no particles".into() } else { block(i) }).expect("written");
    }
    let mut args = vec!["--size", "400x300", "--device", "llvmpipe", "--fps", "2"];
    args.extend(names.iter().map(String::as_str));
    let mut window = Window::open(&display, folder.path(), &args);
    // As soon as it has been read.
    let shows = |window: &mut Window, wanted: &[&str]| {
        let mut seen = String::new();
        for _ in 0..50 {
            let scene = folder.is_what_render_writes(window, "llvmpipe");
            seen = at(&scene, "particles").as_str().expect("a file").to_owned();
            if wanted.contains(&seen.as_str()) {
                return seen;
            }
        }
        panic!("{seen} is shown, and not {wanted:?}");
    };
    shows(&mut window, &["frame0.csv"]);
    window.key(keys::END);
    shows(&mut window, &["frame4.csv"]);
    // By the bar, from the left to the middle.
    window.drag(1, [10, 292], [200, 292]);
    shows(&mut window, &["frame2.csv"]);
    keep(&window, "sequence.png");
    window.types(".");
    assert!(window.waits_for("meniscus: ").contains("frame3.csv"));
    shows(&mut window, &["frame2.csv"]);
    window.types(" ");
    shows(&mut window, &["frame4.csv", "frame0.csv", "frame1.csv"]);
    window.key(keys::ESCAPE);
    window.ends();
}

/// An eye in the liquid starts its rays there: `render` says so, and so does the window.
#[test]
fn the_wheel_goes_through_the_surface() {
    let (display, folder) = (Display::new(), Folder::new());
    fs::write(folder.path().join("block.csv"), block(8)).expect("written");
    let args = ["block.csv", "--size", "400x300", "--device", "llvmpipe", "--method", "imai16"];
    let mut window = Window::open(&display, folder.path(), &args);
    // The block's middle is (0.25, 0.25, 0.45), and its outermost particles are half its edges away.
    let middle = [0.25, 0.25, 0.45];
    let inside = |scene: &toml::Table| (0..3).all(|i| (eye(scene)[i] - middle[i]).abs() < middle[i] - 0.05);
    let goes_in = |window: &mut Window| {
        window.wheel(true, [380, 150]);
        window.key(keys::F3);
        let text = fs::read_to_string(folder.path().join(window.waits_for("wrote "))).expect("a scene file");
        inside(&text.parse().expect("TOML"))
    };
    assert!((0..30).any(|_| goes_in(&mut window)), "it never is inside");
    assert!(inside(&folder.is_what_render_writes(&mut window, "llvmpipe")));
    keep(&window, "inside.png");
    window.close();
    window.ends();
}

#[test]
fn without_a_display_it_is_said_what_is_missing() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meniscus"));
    command.arg("view").env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    let output = command.output().expect("meniscus starts");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    for word in ["no window", "DISPLAY", "libxkbcommon-x11-0", "meniscus render"] {
        assert!(text.contains(word), "{text}");
    }
    assert!(!text.contains("panicked") && !text.contains(".rs"), "{text}");
    command.env("DISPLAY", ":65000");
    let text = String::from_utf8_lossy(&command.output().expect("meniscus starts").stderr).into_owned();
    assert!(text.contains("no window") && !text.contains("panicked"), "{text}");
}
