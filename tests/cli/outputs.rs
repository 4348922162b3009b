//! Outputs appear whole or not at all, and in nobody else's place.

use crate::{Run, block, listing, text};
use std::{fs, path::Path};

const SMALL: [&str; 4] = ["--size", "64x48", "--radius", "0.05"];

/// `render FILE` with these options.
fn render<'a>(file: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["render", file], &SMALL[..], more].concat()
}

#[test]
fn two_outputs_never_have_one_name() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let clash = |more: &[&str], words: &[&str]| run.refused(1, &render(&block, more), words);
    clash(&["-o", "a.png", "--stats", "a.png"], &["a.png", "--stats", "--output"]);
    clash(&["-o", "a.png", "--stats", "./a.png"], &["a.png"]);
    fs::create_dir(run.path("sub")).expect("folder");
    clash(&["-o", "a.png", "--stats", "sub/../a.png"], &["a.png"]);
    let absolute = run.path("a.png");
    clash(&["-o", "a.png", "--stats", &absolute.to_string_lossy()], &["a.png"]);
    clash(&["-o", "sub/a.png", "--dump", "sub"], &["sub/a.png", "--dump"]);
    clash(&["-o", "a.png", "--stats", "sub/s.json", "--dump", "sub"], &["sub/s.json", "--dump"]);
    clash(&["-o", "a.png", "--dump", "a.png"], &["a.png", "--dump"]);
    clash(&["-o", "a.png", "--dump", "."], &["--dump"]);
    clash(&["-o", "a.png", "--dump", "sub/.."], &["--dump"]);
    // Inputs are not written over.
    clash(&["-o", "a.png", "--stats", "block.csv"], &["block.csv", "particle file"]);
    clash(&["-o", "a.png", "--stats", &block], &["block.csv"]);
    image::RgbImage::new(4, 2).save(run.path("sky.png")).expect("saved");
    clash(&["-o", "sky.png", "--env", "./sky.png"], &["sky.png", "--env"]);
    run.refused(1, &["bench", "block.csv", "-o", "./block.csv"], &["block.csv"]);
    assert!(fs::read_to_string(&block).expect("there").starts_with("x,y,z"));
}

#[cfg(unix)]
#[test]
fn links_do_not_hide_that_names_are_one() {
    use std::os::unix::fs::symlink;
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    run.file("a.png", "old");
    symlink("a.png", run.path("soft.json")).expect("link");
    fs::hard_link(run.path("a.png"), run.path("hard.json")).expect("link");
    symlink("nothing.json", run.path("dead.json")).expect("link");
    symlink("block.csv", run.path("block.json")).expect("link");
    symlink(".", run.path("here")).expect("link");
    for (stats, word) in [
        ("soft.json", "--output"),
        ("hard.json", "--output"),
        ("here/a.png", "--output"),
        ("dead.json", "link to nothing"),
        ("block.json", "particle file"),
    ] {
        run.refused(1, &render(&block, &["-o", "a.png", "--stats", stats]), &[stats, word]);
    }
    run.refused(1, &render(&block, &["-o", "a.png", "--dump", "here"]), &["here", "--dump"]);
    // A link is followed, and stays one.
    let done = run.command(&render(&block, &["-o", "b.png", "--stats", "soft.json"]));
    assert!(done.status.success(), "{}", text(&done));
    assert!(run.path("soft.json").is_symlink());
    assert!(fs::read_to_string(run.path("a.png")).expect("written").starts_with('{'));
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_written_to_and_stay() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    symlink("/dev/null", run.path("null.png")).expect("link");
    run.succeeds(&render(&block, &["-o", "null.png", "--stats", "/dev/null"]), &["block.csv", "null.png"]);
    assert!(run.path("null.png").is_symlink());
    assert!(Path::new("/dev/null").metadata().expect("there").file_type().is_char_device());
    // Standard output as a pipe and as a file: the statistics, and nothing else.
    let args = render(&block, &["-o", "null.png", "--stats", "/dev/stdout"]);
    let piped = run.command(&args);
    assert!(serde_json::from_slice::<serde_json::Value>(&piped.stdout).is_ok(), "{}", text(&piped));
    for name in ["/dev/stdout", "s.json"] {
        let args = render(&block, &["-o", "null.png", "--stats", name]);
        let file = fs::File::create(run.path("s.json")).expect("created");
        let output = run.prepared(&args).stdout(file).output().expect("meniscus starts");
        assert!(output.status.success(), "{}", text(&output));
        let written = fs::read(run.path("s.json")).expect("there");
        assert!(serde_json::from_slice::<serde_json::Value>(&written).is_ok(), "--stats {name}");
    }
}

#[test]
fn a_dump_replaces_a_dump_and_nothing_else() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let all = ["block.csv", "d", "out.png"];
    fn imai16<'a>(block: &'a str, more: &[&'a str]) -> Vec<&'a str> {
        render(block, &[&["--method", "imai16"], more].concat())
    }
    run.succeeds(&imai16(&block, &["-o", "out.png", "--dump", "d"]), &all);
    let first = listing(&run.path("d"));
    assert!(first.contains(&"body_back_depth.npy".to_owned()));
    run.succeeds(&imai16(&block, &["-o", "out.png", "--dump", "d/", "--optics", "one"]), &all);
    let second = listing(&run.path("d"));
    assert!(!second.iter().any(|n| n.contains("back")), "maps of the older dump: {second:?}");
    // Parents that are missing are made; an empty folder is as good as none.
    run.succeeds(&imai16(&block, &["-o", "out.png", "--dump", "e/f/g"]), &["block.csv", "d", "e", "out.png"]);
    assert_eq!(listing(&run.path("e/f/g")), first);
    fs::create_dir(run.path("empty")).expect("folder");
    let done = run.command(&imai16(&block, &["-o", "out.png", "--dump", "empty"]));
    assert!(done.status.success() && listing(&run.path("empty")) == first, "{}", text(&done));
    // What a dump does not hold stays where it is.
    let particles = run.path("e/f/g/particles.npz");
    let refused = render(particles.to_str().expect("UTF-8"), &["-o", "out.png", "--dump", "e/f/g"]);
    run.refused(1, &refused, &["e/f/g", "particle file"]);
    let args = render(&block, &["-o", "out.png", "--dump", "d"]);
    fs::write(run.path("d/keep.txt"), "mine").expect("written");
    run.refused(1, &args, &["keep.txt", "new folder"]);
    fs::remove_file(run.path("d/keep.txt")).expect("removed");
    fs::create_dir(run.path("d/hits.npy.d")).expect("folder");
    run.refused(1, &args, &["hits.npy.d"]);
    fs::remove_dir(run.path("d/hits.npy.d")).expect("removed");
    fs::write(run.path("d/frame.json"), "{\"mine\": true}").expect("written");
    run.refused(1, &args, &["frame.json"]);
    assert_eq!(listing(&run.path("d")), second);
    run.file("file", "mine");
    run.refused(1, &render(&block, &["-o", "out.png", "--dump", "file"]), &["file", "cannot be written"]);
}

/// Files of at most some 50 or 100 kB are like a disk that fills up in the middle.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_neither_half_a_dump_nor_temporary_files() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let limited = |more: &[&str]| {
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", "trap '' XFSZ; ulimit -f 100; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_meniscus")]);
        shell.args(["render", &block, "--radius", "0.05", "--size", "160x120"]).args(more);
        let output = shell.current_dir(run.folder.path()).env("TMPDIR", run.temporary.path()).output().expect("sh");
        run.nothing_temporary();
        assert_eq!(output.status.code(), Some(1), "{more:?}: {}", text(&output));
        text(&output)
    };
    let said = limited(&["-o", "out.png", "--dump", "d"]);
    assert!(said.contains("d/") && said.contains("Make room there"), "{said}");
    assert_eq!(listing(run.folder.path()), ["block.csv", "out.png"]);
    let said = limited(&["-o", "out.exr"]);
    assert!(said.contains("out.exr"), "{said}");
    assert_eq!(listing(run.folder.path()), ["block.csv", "out.png"]);
    // An older dump stays as it was.
    run.succeeds(&render(&block, &["-o", "out.png", "--dump", "d"]), &["block.csv", "d", "out.png"]);
    let before = fs::read(run.path("d/frame.json")).expect("there");
    limited(&["-o", "out.png", "--dump", "d"]);
    assert_eq!(fs::read(run.path("d/frame.json")).expect("there"), before);
}
