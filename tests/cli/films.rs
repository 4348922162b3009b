//! Films of a sequence: as many frames as there are pictures, of what they show.

use crate::{
    Run, block, listing,
    sequence::{GIVEN, frames},
    text,
};
use std::{
    fs::{self, File},
    io::BufReader,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

const SIZE: [usize; 2] = [97, 73];

fn film<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["sequence", "f/*.csv", "--size", "97x73", "--fps", "12.5"], GIVEN, more].concat()
}

fn made(run: &Run, args: &[&str]) {
    let output = run.command(args);
    assert!(output.status.success(), "{args:?}: {}", text(&output));
}

fn apng(run: &Run, name: &str) -> Vec<Vec<u8>> {
    let file = BufReader::new(File::open(run.path(name)).expect("a film"));
    let mut reader = png::Decoder::new(file).read_info().expect("a film");
    let control = reader.info().frame_control().copied().expect("it is animated");
    assert_eq!(f64::from(control.delay_num) / f64::from(control.delay_den), 1.0 / 12.5);
    let count = reader.info().animation_control().expect("it is animated").num_frames;
    let mut frame = || {
        let mut bytes = vec![0; 3 * SIZE[0] * SIZE[1]];
        reader.next_frame(&mut bytes).expect("a frame");
        bytes
    };
    (0..count).map(|_| frame()).collect()
}

fn gif(run: &Run, name: &str) -> (Vec<Vec<u8>>, Vec<u16>) {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut reader = options.read_info(File::open(run.path(name)).expect("a film")).expect("a film");
    let (mut all, mut delays) = (Vec::new(), Vec::new());
    while let Some(frame) = reader.read_next_frame().expect("a frame") {
        assert_eq!([frame.width, frame.height].map(usize::from), SIZE);
        all.push(frame.buffer.chunks_exact(4).flat_map(|c| c[..3].to_vec()).collect());
        delays.push(frame.delay);
    }
    (all, delays)
}

fn apart(a: &[u8], b: &[u8]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / a.len() as f64
}

/// Whether a frame shows this one of the pictures, as well as its film can, and no other.
fn is_nearest(frame: &[u8], pictures: &[Vec<u8>], index: usize, name: &str) {
    let off: Vec<_> = pictures.iter().map(|p| apart(frame, p)).collect();
    assert!(off[index] < 6.0, "{name}, frame {index}: {off:?} of 255 off");
    assert!(off.iter().enumerate().all(|(i, v)| i == index || *v > off[index]), "{name}, frame {index}: {off:?} off");
}

fn has_ffmpeg() -> bool {
    Command::new("ffmpeg").arg("-version").output().is_ok_and(|o| o.status.success())
}

#[test]
fn films_are_their_pictures() {
    let run = Run::new();
    frames(&run, 5);
    let outputs = ["-o", "out/#.png", "-o", "a.png", "-o", "a.gif"];
    made(&run, &film(&[&outputs[..], &["--frames", "1-"]].concat()));
    let pictures: Vec<_> = (1..5).map(|i| run.pixels(&format!("out/{i}.png"))).collect();
    assert!(apng(&run, "a.png") == pictures);
    let (shown, delays) = gif(&run, "a.gif");
    assert_eq!(delays, [8; 4]);
    assert_eq!(shown.len(), 4);
    shown.iter().enumerate().for_each(|(i, frame)| is_nearest(frame, &pictures, i, "a.gif"));
    // Made anew of pictures that are there, and of some that are not: the same.
    let bytes = |name: &str| fs::read(run.path(name)).expect("there");
    let before = (bytes("a.png"), bytes("a.gif"));
    for gone in [None, Some("out/2.png")] {
        gone.into_iter().for_each(|name| fs::remove_file(run.path(name)).expect("removed"));
        made(&run, &film(&[&outputs[..], &["--frames", "1-"]].concat()));
        assert!((bytes("a.png"), bytes("a.gif")) == before, "{gone:?}");
    }
    // Without pictures beside it, too.
    made(&run, &film(&["-o", "b.png", "--frames", "1-"]));
    assert!(bytes("b.png") == before.0);
}

#[test]
fn ffmpeg_makes_films_or_is_missed() {
    let run = Run::new();
    frames(&run, 3);
    let output = run.prepared(&film(&["-o", "a.mp4"])).env("PATH", "/nowhere").output().expect("starts");
    let said = text(&output);
    assert!(output.status.code() == Some(1) && said.contains("a.mp4"), "{said}");
    assert!(said.contains("apt-get install ffmpeg") && listing(run.folder.path()) == ["f"], "{said}");
    if !has_ffmpeg() {
        return; // the message is all there is to see
    }
    made(&run, &film(&["-o", "a.mp4", "-o", "a.mkv", "-o", "a.webm", "-o", "#.png"]));
    let pictures: Vec<_> = (0..3).map(|i| run.pixels(&format!("{i}.png"))).collect();
    for name in ["a.mp4", "a.mkv", "a.webm"] {
        let path = run.path(name);
        let args = ["-v", "error", "-i", path.to_str().expect("UTF-8"), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"];
        let output = Command::new("ffmpeg").args(args).output().expect("ffmpeg");
        // An odd edge has one pixel more.
        let size = [SIZE[0] + 1, SIZE[1] + 1];
        assert_eq!(output.stdout.len(), 3 * 3 * size[0] * size[1], "{name}: {}", text(&output));
        for (i, frame) in output.stdout.chunks_exact(3 * size[0] * size[1]).enumerate() {
            let rows = frame.chunks_exact(3 * size[0]).take(SIZE[1]);
            let shown: Vec<u8> = rows.flat_map(|row| row[..3 * SIZE[0]].to_vec()).collect();
            is_nearest(&shown, &pictures, i, name);
        }
    }
    // What it says is passed on: here of an encoder that it has not.
    let folder = run.path("bin");
    fs::create_dir(&folder).expect("folder");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::write(folder.join("ffmpeg"), "#!/bin/sh\necho Unknown encoder >&2\nexit 1\n").expect("written");
        fs::set_permissions(folder.join("ffmpeg"), fs::Permissions::from_mode(0o755)).expect("set");
        let path = format!("{}:/bin:/usr/bin", folder.display());
        let output = run.prepared(&film(&["-o", "b.mp4"])).env("PATH", path).output().expect("starts");
        let said = text(&output);
        assert!(output.status.code() == Some(1) && said.contains("Unknown encoder"), "{said}");
        assert!(!run.path("b.mp4").exists());
        run.nothing_temporary();
    }
}

#[test]
fn a_film_is_whole_or_not_there() {
    let run = Run::new();
    frames(&run, 4);
    run.file("f/p0.csv", "x,y,z\n1,2\n");
    run.file("f/p2.csv", "x,y,z\n1,2\n");
    let args = film(&["-o", "a.png"]);
    run.refused(1, &args, &["f/p0.csv", "line 2"]);
    // Frames that are left out are shown by what is before them, or else after them.
    let output = run.command(&[&args[..], &["--keep-going"]].concat());
    assert!(output.status.code() == Some(1) && text(&output).contains("2 of 4"), "{}", text(&output));
    let shown = apng(&run, "a.png");
    assert!(shown.len() == 4 && shown[0] == shown[1] && shown[1] == shown[2] && shown[2] != shown[3]);
    fs::remove_file(run.path("a.png")).expect("removed");
    run.refused(1, &["sequence", "f/*.csv", "-o", "no/a.gif"], &["no/a.gif", "create it"]);
    run.refused(2, &["sequence", "f/*.csv", "-o", "a.gif", "--fps", "0"], &["--fps", "0.1 to 100"]);
}

#[cfg(unix)]
#[test]
fn a_film_that_is_ended_leaves_nothing() {
    let run = Run::new();
    frames(&run, 40);
    let mut names = vec!["-o", "a.gif", "-o", "#.exr"];
    if has_ffmpeg() {
        names.extend(["-o", "a.mp4"]);
    }
    for (round, signal) in ["INT", "TERM", "TERM"].iter().enumerate() {
        let mut child =
            run.prepared(&film(&names)).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("starts");
        let begin = Instant::now();
        let (first, kept) = (run.path(&format!("{}.exr", 3 * round)), Duration::from_secs(60));
        while !first.exists() && begin.elapsed() < kept && child.try_wait().expect("asked").is_none() {
            std::thread::sleep(Duration::from_millis(2));
        }
        let _ = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status();
        assert!(!child.wait().expect("waited for").success(), "it was never ended");
        // ffmpeg ends a moment later.
        std::thread::sleep(Duration::from_millis(300));
        run.nothing_temporary();
        assert!(!run.path("a.gif").exists() && !run.path("a.mp4").exists());
    }
}

/// A block that is not there is a picture without liquid, and that is said.
#[test]
fn pictures_without_liquid_are_said() {
    let run = Run::new();
    frames(&run, 2);
    run.file("f/p2.csv", block(500.0));
    let output = run.command(&film(&["-o", "a.gif"]));
    let said = text(&output);
    assert!(output.status.success() && said.contains("picture 2: no liquid in the picture"), "{said}");
    assert!(!said.contains("picture 1:"), "{said}");
}
