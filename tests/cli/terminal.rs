//! What reaches the terminal, and terminals that nothing reaches.

use crate::{Run, block, listing, text};
use std::{fs, io, process::Output};

const SMALL: [&str; 2] = ["--size", "64x48"];
const SHORT: [&str; 4] = ["--frames", "2", "--warmup", "1"];

/// Runs with standard output on a pipe that nobody reads.
fn unread(run: &Run, args: &[&str]) -> Output {
    let (reader, writer) = io::pipe().expect("pipe");
    drop(reader);
    let output = run.prepared(args).stdout(writer).output().expect("meniscus starts");
    run.nothing_temporary();
    output
}

#[test]
fn closed_pipes_end_quietly() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let quiet = |output: Output, what: &str| {
        assert!(output.status.success(), "{what}: {}", text(&output));
        assert_eq!(text(&output), "", "{what}");
    };
    quiet(unread(&run, &["info"]), "info");
    quiet(unread(&run, &["--help"]), "help");
    quiet(unread(&run, &["--version"]), "version");
    let render = [&["render", &block, "-o", "out.png", "--stats", "s.json", "--dump", "d"], &SMALL[..]].concat();
    quiet(unread(&run, &render), "render");
    assert_eq!(listing(run.folder.path()), ["block.csv", "d", "out.png", "s.json"]);
    let bench = [&["bench", &block], &SMALL[..], &SHORT].concat();
    quiet(unread(&run, &bench), "bench");
    quiet(unread(&run, &[&bench[..], &["-o", "b.json"]].concat()), "bench -o");
    assert!(run.path("b.json").exists());
    // Nor is it a failure where the pipe was to have the statistics.
    let stats = unread(&run, &[&["render", &block, "-o", "out.png", "--stats", "/dev/stdout"], &SMALL[..]].concat());
    assert!(stats.status.success(), "{}", text(&stats));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_the_terminal_is_no_panic() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let full = || fs::OpenOptions::new().write(true).open("/dev/full").expect("/dev/full");
    let to_full = |args: &[&str]| run.prepared(args).stdout(full()).output().expect("meniscus starts");
    let render = [&["render", &block, "-o", "out.png"], &SMALL[..]].concat();
    let bench = [&["bench", &block], &SMALL[..], &SHORT].concat();
    // Text beside the work may be lost.
    assert!(to_full(&render).status.success() && run.path("out.png").exists());
    assert!(to_full(&[&bench[..], &["-o", "b.csv"]].concat()).status.success() && run.path("b.csv").exists());
    let both = run.prepared(&render).stdout(full()).stderr(full()).status().expect("meniscus starts");
    assert!(both.success());
    // Text that is the work may not.
    for args in [&["info"][..], &["--help"], &bench] {
        let output = to_full(args);
        assert_eq!(output.status.code(), Some(1), "{args:?}: {}", text(&output));
        assert!(text(&output).contains("standard output"), "{args:?}: {}", text(&output));
    }
    let unheard = run.prepared(&["render", "-o", "out.gif"]).stderr(full()).status().expect("meniscus starts");
    assert_eq!(unheard.code(), Some(1));
}

#[test]
fn nothing_reaches_the_terminal_unescaped_or_unbounded() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let evil = "a\u{1b}[2Jb\u{7}\u{202e}c\nd";
    let shown = r"a\u{1b}[2Jb\u{7}\u{202e}c\nd";
    let clean = |output: Output| {
        let text = text(&output);
        assert!(!text.contains(|c: char| c == '\u{202e}' || (c.is_control() && c != '\n')), "{text:?}");
        assert!(text.lines().all(|l| l.chars().count() < 2100), "{text}");
        text
    };
    let long = "z".repeat(100_000);
    let header = format!("{long},{evil}\n1,2\n");
    let file = run.file("header.csv", header);
    let folder = format!("{evil}/out.png");
    let name = format!("{evil}.vtk");
    for args in [
        &["render", &name, "-o", "out.png"][..],
        &["render", "-o", &folder],
        &["render", "-o", evil],
        &["render", "-o", "out.png", "--device", evil],
        &["render", "-o", "out.png", "--iterations", evil],
        &["render", "-o", "out.png", "--size", evil],
        &["render", "-o", "out.png", "--eye", evil],
        &["render", "-o", "out.png", "--fresnel", evil],
        &["render", "-o", "out.png", "--absorption", evil],
        &["render", "-o", "out.png", "--method", evil],
        &["render", "-o", "out.png", "--scene", evil],
        &[evil],
    ] {
        let output = run.command(args);
        assert!(!output.status.success());
        let text = clean(output);
        assert!(text.contains(shown), "{args:?}: {text}");
    }
    for args in [
        &["render", &file, "-o", "out.png"][..],
        &["render", "-o", &long],
        &["render", "-o", "out.png", "--device", &long],
        &["render", "-o", "out.png", "--size", &long],
    ] {
        let output = run.command(args);
        assert!(!output.status.success());
        clean(output);
    }
    // What is done well is said with the same care.
    let picture = format!("{}.png", evil.replace('\n', ""));
    let said = clean(run.command(&[&["render", &block, "-o", &picture], &SMALL[..]].concat()));
    assert!(said.contains("wrote a\\u{1b}"), "{said}");
}

#[test]
fn a_picture_without_the_liquid_is_said() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let render = |more: &[&str]| {
        let all = [&["render", &block, "-o", "out.png", "--radius", "0.05"], &SMALL[..], more].concat();
        let output = run.command(&all);
        assert!(output.status.success(), "{}", text(&output));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    assert_eq!(render(&[]), "");
    assert_eq!(render(&["--prepare", "gpu", "--optics", "one"]), "");
    for prepare in ["cpu", "gpu"] {
        let said = |more: &[&str]| render(&[more, &["--prepare", prepare]].concat());
        let behind = said(&["--eye", "0,0,5", "--target", "0,0,9"]);
        assert!(behind.contains("no liquid in the picture") && behind.contains("behind the eye"), "{behind}");
        let beside = said(&["--eye", "0,0,5", "--target", "9,0,4"]);
        assert!(beside.contains("outside the view"), "{beside}");
        let tiny = said(&["--eye", "0,0,9e4", "--target", "0,0,0", "--optics", "one"]);
        assert!(tiny.contains("of a pixel wide"), "{tiny}");
    }
}
