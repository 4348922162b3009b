//! Sequences: the pictures that `render` makes, in order, each once.

use crate::{Run, between::moving, block, listing, text};
use std::{
    fs,
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

/// All that would otherwise be the first frame's.
pub const GIVEN: &[&str] =
    &["--radius", "0.05", "--eye", "1.5,1.2,-2", "--target", "0.4,0.3,0.2", "--absorption", "0.4,0.2,0.1"];
const SMALL: &[&str] = &["--size", "96x72"];

pub fn frames(run: &Run, count: u32) {
    fs::create_dir_all(run.path("f")).expect("folder");
    for i in 0..count {
        run.file(&format!("f/p{i}.csv"), block(0.07 * f64::from(i)));
    }
}

fn sequence<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["sequence", "f/*.csv", "-o", "out/###.png"], SMALL, GIVEN, more].concat()
}

pub fn made(run: &Run, args: &[&str]) -> String {
    let output = run.command(args);
    assert!(output.status.success(), "{args:?}: {}", text(&output));
    text(&output)
}

pub fn rows(run: &Run, name: &str) -> Vec<Vec<String>> {
    let content = fs::read_to_string(run.path(name)).expect("a table");
    content.lines().skip(1).map(|l| l.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn a_sequence_is_its_frames_rendered_one_by_one() {
    let run = Run::new();
    frames(&run, 12);
    let some = ["-o", "exr/#.exr", "--frames", "3-11:4", "--supersample", "2", "--validate", "--stats", "s.csv"];
    made(&run, &sequence(&some));
    assert_eq!(listing(&run.path("out")), ["003.png", "007.png", "011.png"]);
    assert_eq!(listing(&run.path("exr")), ["11.exr", "3.exr", "7.exr"]);
    let read = |name: &str| image::open(run.path(name)).expect("a picture").to_rgb32f().into_raw();
    for i in [3, 7, 11] {
        let file = format!("f/p{i}.csv");
        for (name, one) in [(format!("out/{i:03}.png"), "one.png"), (format!("exr/{i}.exr"), "one.exr")] {
            let args = [&["render", &file, "-o", one, "--supersample", "2"], SMALL, GIVEN].concat();
            assert!(run.command(&args).status.success());
            assert!(read(&name) == read(one), "{name} is another picture");
        }
    }
    let rows = rows(&run, "s.csv");
    let cells = |c: usize| rows.iter().map(|r| r[c].as_str()).collect::<Vec<_>>();
    assert_eq!(cells(0), ["3", "7", "11"]);
    assert_eq!(cells(1), ["f/p3.csv", "f/p7.csv", "f/p11.csv"]);
    assert_eq!((cells(2), cells(3)), (vec!["217"; 3], vec!["1"; 3]));
    // The block has moved: something has changed, from the second picture on.
    assert_eq!(rows[0][12], "");
    assert!(rows[1..].iter().all(|r| r[12].parse::<f64>().is_ok_and(|c| c > 1e-3)), "{rows:?}");
}

/// What the first frame decides where nothing is given holds for all, whichever are made.
#[test]
fn what_is_left_open_is_the_first_frames() {
    let run = Run::new();
    frames(&run, 4);
    let short = |more: &[&'static str]| [&["sequence", "f/*.csv"], SMALL, more].concat();
    made(&run, &short(&["-o", "all/#.png"]));
    made(&run, &short(&["-o", "part/#.png", "--frames", "2-"]));
    let scene = [&["render", "f/p0.csv", "-o", "0.png", "--save-scene", "s.toml"], SMALL].concat();
    assert!(run.command(&scene).status.success());
    assert!(run.command(&["render", "f/p3.csv", "--scene", "s.toml", "-o", "3.png"]).status.success());
    for (a, b) in [("all/0.png", "0.png"), ("all/3.png", "3.png"), ("all/2.png", "part/2.png")] {
        assert!(run.pixels(a) == run.pixels(b), "{a}, {b}");
    }
    assert!(run.pixels("all/0.png") != run.pixels("all/3.png"));
}

#[test]
fn what_is_there_is_not_made_again() {
    let run = Run::new();
    frames(&run, 5);
    let written = |i: u32| fs::metadata(run.path(&format!("out/00{i}.png"))).and_then(|m| m.modified()).expect("there");
    let all = || (0..5).map(written).collect::<Vec<_>>();
    let args = sequence(&["--stats", "s.csv"]);
    made(&run, &args);
    let (first, table) = (all(), rows(&run, "s.csv"));
    assert!(made(&run, &args).contains("nothing to do"));
    // One that is gone, one that is cut short, one of another frame, one whose input is another.
    let whole = fs::read(run.path("out/001.png")).expect("there");
    fs::remove_file(run.path("out/000.png")).expect("removed");
    fs::write(run.path("out/001.png"), &whole[..whole.len() - 300]).expect("written");
    fs::copy(run.path("out/004.png"), run.path("out/002.png")).expect("copied");
    run.file("f/p3.csv", block(5.0) + "0,2,0\n");
    let said = made(&run, &args);
    assert!(said.contains("1 of which are there") && said.contains("wrote 4 pictures"), "{said}");
    let again = all();
    assert_eq!((0..5).filter(|i| again[*i] == first[*i]).collect::<Vec<_>>(), [4]);
    assert!(fs::read(run.path("out/001.png")).expect("there") == whole);
    let now = rows(&run, "s.csv");
    assert_eq!(now.len(), 5);
    assert!(now[4] == table[4] && now[3][2] == "218" && now[2][12] == table[2][12], "{now:?}");
    // Other settings are other pictures; another device is none.
    assert!(made(&run, &sequence(&["--ior", "1.4"])).contains("wrote 5"));
}

/// Ended three times, however hard, it goes on to the same files.
#[cfg(unix)]
#[test]
fn ended_and_started_again_it_is_what_it_is_in_one_go() {
    let run = Run::new();
    frames(&run, 30);
    let args = sequence(&["--stats", "s.csv"]);
    let begin = Instant::now();
    made(&run, &args);
    let whole = begin.elapsed();
    fs::rename(run.path("out"), run.path("reference")).expect("moved");
    fs::remove_file(run.path("s.csv")).expect("removed");
    let mut left = 0;
    for (round, signal) in ["KILL", "TERM", "INT"].into_iter().enumerate() {
        let mut child = run.prepared(&args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("starts");
        // Not two of these moments are alike.
        let now = Instant::now().duration_since(begin).subsec_nanos();
        std::thread::sleep(whole * (2 + now % 3) / 10);
        let _ = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status();
        child.wait().expect("waited for");
        for name in listing(&run.path("out")) {
            if let Some(number) = name.strip_suffix(".png") {
                let bytes = |folder: &str| fs::read(run.path(&format!("{folder}/{name}"))).expect("there");
                assert!(bytes("out") == bytes("reference"), "round {round}: {number} is half a picture or another");
                left += usize::from(round == 0);
            } else {
                // Nobody cleans up after SIGKILL.
                assert!(signal == "KILL" && name.starts_with(".meniscus-"), "round {round}: {name}");
                fs::remove_file(run.path(&format!("out/{name}"))).expect("removed");
            }
        }
        for name in listing(run.folder.path()).iter().filter(|n| n.starts_with('.')) {
            assert_eq!(signal, "KILL", "{name}");
            fs::remove_file(run.path(name)).expect("removed");
        }
    }
    made(&run, &args);
    assert!(left < 30, "it was never ended before its end");
    assert_eq!(listing(&run.path("out")), listing(&run.path("reference")));
    for name in listing(&run.path("out")) {
        let bytes = |folder: &str| fs::read(run.path(&format!("{folder}/{name}"))).expect("there");
        assert!(bytes("out") == bytes("reference"), "{name}");
    }
    assert_eq!(
        rows(&run, "s.csv").iter().map(|r| r[0].parse().ok()).collect::<Vec<_>>(),
        (0..30).map(Some).collect::<Vec<Option<u32>>>()
    );
}

#[test]
fn frames_that_cannot_be_are_named() {
    let run = Run::new();
    frames(&run, 4);
    run.refused(1, &["sequence", "f/*.vtk", "-o", "#.png"], &["f/*.vtk", "no file has such a name"]);
    run.refused(1, &["sequence", "-o", "#.png"], &["no frames are named"]);
    run.refused(1, &["sequence", "f/p[.csv", "-o", "#.png"], &["f/p[.csv", "pattern"]);
    run.refused(1, &["sequence", "f/*.csv", "-o", "a.exr"], &["a.exr", "####"]);
    run.refused(1, &["sequence", "f/*.csv", "-o", "#.jpg"], &["#.jpg", ".exr"]);
    run.refused(1, &["sequence", "f/*.csv", "-o", "#.png", "-o", "#.png"], &["#.png", "another"]);
    run.refused(1, &["sequence", "f/*.csv", "-o", "#.png", "--frames", "7-9"], &["7-9", "0 to 3"]);
    run.refused(2, &["sequence", "f/*.csv", "-o", "#.png", "--frames", "9-7"], &["9-7"]);
    run.refused(1, &["sequence", "f/*.csv", "-o", "#.png", "--stats", "f/p1.csv"], &["f/p1.csv", "particle file"]);
    run.file("f/p01.csv", block(0.0));
    run.refused(1, &["sequence", "f/*.csv", "-o", "#.png"], &["f/p01.csv", "f/p1.csv", "picture 1"]);
    fs::remove_file(run.path("f/p01.csv")).expect("removed");
    run.file("f/other.csv", block(0.0));
    run.refused(1, &["sequence", "f/*.csv", "-o", "#.png"], &["differ in more than numbers", "other.csv"]);
    fs::remove_file(run.path("f/other.csv")).expect("removed");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("3.png", run.path("s.csv")).expect("link");
        run.file("3.png", "");
        run.refused(1, &["sequence", "f/*.csv", "-o", "#.png", "--stats", "s.csv"], &["s.csv", "--output", "--stats"]);
    }
}

#[test]
fn a_frame_that_cannot_be_read_ends_it_or_is_left_out() {
    let run = Run::new();
    frames(&run, 5);
    run.file("f/p2.csv", "x,y,z\n1,2\n");
    fs::remove_file(run.path("f/p3.csv")).expect("removed");
    let output = run.command(&sequence(&[]));
    let said = text(&output);
    assert!(output.status.code() == Some(1) && said.contains("f/p2.csv, line 2"), "{said}");
    assert!(said.contains("no frames between 2 and 4"), "{said}");
    assert_eq!(listing(&run.path("out")), ["000.png", "001.png"]);
    let output = run.command(&sequence(&["--keep-going"]));
    let said = text(&output);
    assert!(output.status.code() == Some(1), "{said}");
    assert!(said.contains("picture 2: f/p2.csv, line 2") && said.contains("1 of 4 pictures"), "{said}");
    assert_eq!(listing(&run.path("out")), ["000.png", "001.png", "004.png"]);
    run.file("f/p2.csv", block(0.0));
    assert!(made(&run, &sequence(&[])).contains("wrote 1 pictures"));
}

/// What a program says that ends within a time; one that does not is killed.
#[cfg(unix)]
fn ended(mut program: Command, within: Duration) -> Option<Output> {
    let mut child = program.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    let begin = Instant::now();
    while child.try_wait().expect("waited for").is_none() {
        if begin.elapsed() > within {
            child.kill().expect("killed");
            child.wait().expect("waited for");
            return None;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    Some(child.wait_with_output().expect("it has ended"))
}

/// What is left open is found in the first file, and the picture of it is then made of what was read: a pipe can be read once.
#[cfg(unix)]
#[test]
fn the_first_file_is_read_once() {
    let run = Run::new();
    fs::create_dir_all(run.path("f")).expect("folder");
    for i in 0..3 {
        run.file(&format!("f/p{i}.csv"), moving(f64::from(i)));
    }
    for (name, more) in [
        ("alone", &[][..]),
        ("counted", &["--stats", "s.csv"]),
        ("held", &["--memory", "2", "--stats", "h.csv"]),
        ("between", &["--step", "1", "--fps", "2"]),
    ] {
        let (plain, piped) = (format!("{name}/#.png"), format!("piped-{name}/#.png"));
        let args = |output| [&["sequence", "f/*.csv", "-o", output], SMALL, more].concat();
        made(&run, &args(&plain));
        let pipe = run.path("f/p0.csv");
        fs::remove_file(&pipe).expect("removed");
        assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
        let writer = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::write(pipe, moving(0.0)).expect("whoever reads it reads all of it")
        });
        let output = ended(run.prepared(&args(&piped)), Duration::from_secs(100));
        let output = output.unwrap_or_else(|| panic!("{name}: it is read again"));
        assert!(output.status.success(), "{name}: {}", text(&output));
        writer.join().expect("written");
        fs::remove_file(&pipe).expect("removed");
        run.file("f/p0.csv", moving(0.0));
        let names = listing(&run.path(name));
        assert!(names.len() >= 3 && names == listing(&run.path(&format!("piped-{name}"))), "{names:?}");
        for picture in names {
            let pixels = |folder: &str| run.pixels(&format!("{folder}/{picture}"));
            assert!(pixels(name) == pixels(&format!("piped-{name}")), "{name}/{picture}");
        }
    }
}

/// A file of zeros that nobody stores, with more particles than lavapipe binds: preparing them would take longer than anybody waits.
#[cfg(unix)]
#[test]
fn more_than_a_device_draws_is_refused_before_it_is_prepared() {
    let run = Run::new();
    let count = (128 << 20) / 16 + 1;
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({count}, 3), }}\n");
    let path =
        run.file("0.npy", [b"\x93NUMPY\x01\0", &(header.len() as u16).to_le_bytes()[..], header.as_bytes()].concat());
    let file = fs::File::options().append(true).open(&path).expect("there");
    file.set_len(10 + header.len() as u64 + 12 * count).expect("longer");
    let refused = |args: &[&str], words: &[&str]| {
        let all = [args, &["--device", "llvmpipe", "--size", "96x72"]].concat();
        let output =
            ended(run.prepared(&all), Duration::from_secs(60)).unwrap_or_else(|| panic!("{all:?}: it prepares"));
        let said = text(&output);
        assert!(output.status.code() == Some(1) && words.iter().all(|w| said.contains(w)), "{all:?}: {said}");
        assert_eq!(listing(run.folder.path()), ["0.npy"]);
    };
    let most = ["0.npy", "8388609", "8388608 at most"];
    refused(&["render", "0.npy", "-o", "a.png", "--radius", "0.1"], &most);
    refused(&["sequence", "0.npy", "-o", "#.png", "--radius", "0.1"], &most);
    refused(&[&["sequence", "0.npy", "-o", "#.png"], GIVEN].concat(), &most);
    let on_device = ["0.npy", "8388609", "this device binds 134217728 at most"];
    refused(&["render", "0.npy", "-o", "a.png", "--radius", "0.1", "--prepare", "gpu"], &on_device);
}

/// Files of at most 50 kB are like a disk that fills up.
#[cfg(unix)]
#[test]
fn a_full_disk_ends_it() {
    let run = Run::new();
    frames(&run, 8);
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' XFSZ; ulimit -f 100; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_meniscus"), "sequence"]);
    shell.args(["f/*.csv", "-o", "out/#.exr", "--size", "320x240"]).args(GIVEN);
    let output = shell.current_dir(run.folder.path()).env("TMPDIR", run.temporary.path()).output().expect("sh");
    let said = text(&output);
    assert!(output.status.code() == Some(1) && said.contains("out/0.exr") && said.contains("Make room"), "{said}");
    assert_eq!(listing(&run.path("out")), [""; 0]);
}

/// Memory is that of a few frames, however many there are.
#[cfg(target_os = "linux")]
#[test]
fn many_frames_take_no_more_memory_than_a_few() {
    let run = Run::new();
    fs::create_dir(run.path("f")).expect("folder");
    let points = (0..60_000u32).flat_map(|i| [i % 40, i / 40 % 40, i / 1600].map(|k| 0.1 * k as f32));
    run.file("f/p0.xyz", points.flat_map(f32::to_le_bytes).collect::<Vec<u8>>());
    for i in 1..40 {
        fs::hard_link(run.path("f/p0.xyz"), run.path(&format!("f/p{i}.xyz"))).expect("linked");
    }
    let args = ["sequence", "f/*.xyz", "--radius", "0.05", "--size", "320x240", "--prepare", "gpu"];
    // The most memory that so many frames take, in kB.
    let peak = |frames: &str, output: &str| {
        let args = [&args[..], &["--frames", frames, "-o", output]].concat();
        let child = run.prepared(&args).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("starts");
        let status = || fs::read_to_string(format!("/proc/{}/status", child.id())).ok();
        let mut most = 0;
        // A finished child that nobody has waited for has no memory, and no such line.
        while let Some(status) = status().filter(|s| s.contains("VmHWM:")) {
            let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).expect("it is there");
            most = line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number");
            std::thread::sleep(Duration::from_millis(10));
        }
        let output = child.wait_with_output().expect("ends");
        assert!(output.status.success(), "{}", text(&output));
        most
    };
    let (few, many) = (peak("0-3", "few/##.png"), peak("0-", "many/##.png"));
    assert_eq!((listing(&run.path("few")).len(), listing(&run.path("many")).len()), (4, 40));
    // 36 frames more, of some 5 MB each, which are read faster than drawn.
    assert!(few > 20_000 && many < few + 40_000, "{few} kB for 4 frames, {many} kB for 40");
}
