//! The command line as a user meets it: what it writes, what it refuses, and how it says so.

mod bench;
mod between;
mod camera;
mod compositing;
mod drivers;
mod films;
mod info;
mod installed;
mod keys;
mod memory;
mod outputs;
mod pipelines;
mod profiling;
mod refusals;
mod render;
mod scenes;
mod sequence;
mod settings;
mod signals;
#[cfg(feature = "study")]
mod stress;
#[cfg(feature = "study")]
mod study;
mod submit;
mod terminal;
mod time_steps;
#[cfg(feature = "study")]
mod tune;
#[cfg(feature = "study")]
mod units;
mod workload;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

struct Run {
    folder: tempfile::TempDir,
    /// For temporary files, of which none may remain.
    temporary: tempfile::TempDir,
}

impl Run {
    fn new() -> Run {
        let folder = || tempfile::tempdir().expect("temporary folder");
        Run { folder: folder(), temporary: folder() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        fs::write(self.path(name), content).expect("written");
        self.path(name).to_string_lossy().into_owned()
    }

    fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&fs::read(self.path(name)).expect("written")).expect("JSON")
    }

    /// The program, not started yet.
    fn prepared(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_meniscus"));
        command.args(args).current_dir(self.folder.path()).env("TMPDIR", self.temporary.path());
        // Drivers named from the package are there for a program that runs elsewhere, too.
        if let Some(drivers) = std::env::var_os("VK_ADD_DRIVER_FILES") {
            let package = Path::new(env!("CARGO_MANIFEST_DIR"));
            let named: Vec<_> = std::env::split_paths(&drivers).map(|file| package.join(file)).collect();
            command.env("VK_ADD_DRIVER_FILES", std::env::join_paths(named).expect("they were joined before"));
        }
        command
    }

    fn command(&self, args: &[&str]) -> Output {
        let output = self.prepared(args).output().expect("meniscus starts");
        self.nothing_temporary();
        output
    }

    fn nothing_temporary(&self) {
        assert_eq!(listing(self.temporary.path()), [""; 0], "temporary files");
        let left = listing(self.folder.path()).into_iter().find(|name| name.starts_with('.'));
        assert_eq!(left, None, "temporary files");
    }

    /// Renders small, with validation, and expects success.
    fn render(&self, args: &[&str]) -> String {
        let mut all = vec!["render", "-o", "out.png", "--size", "96x72", "--validate"];
        all.extend(args);
        let output = self.command(&all);
        assert!(output.status.success(), "{all:?}: {}", text(&output));
        text(&output)
    }

    /// Expects success, and no file but those that are named.
    fn succeeds(&self, args: &[&str], files: &[&str]) -> Output {
        let output = self.command(args);
        assert!(output.status.success(), "{args:?}: {}", text(&output));
        assert_eq!(listing(self.folder.path()), files, "{args:?}");
        output
    }

    /// Expects a refusal with this exit code, whose message holds all of `words`, and that leaves no file behind.
    fn refused(&self, code: i32, args: &[&str], words: &[&str]) {
        let before = listing(self.folder.path());
        let output = self.command(args);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {text}");
        assert!(!text.contains("panicked"), "{args:?}: {text}");
        for w in words {
            assert!(text.contains(w), "{args:?}: no \"{w}\" in: {text}");
        }
        assert_eq!(listing(self.folder.path()), before, "{args:?} left something behind");
    }

    fn pixels(&self, name: &str) -> Vec<u8> {
        image::open(self.path(name)).expect("a picture").to_rgb8().into_raw()
    }
}

/// What was said, on standard output and then on standard error.
fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

fn listing(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .expect("folder")
        .map(|e| e.expect("entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// A little block of particles at spacing 0.1, and one droplet above it; text columns.
fn block(offset: f64) -> String {
    let mut text = String::from("x,y,z\n");
    for i in 0..6 * 6 * 6 {
        let (x, y, z) = (i % 6, i / 6 % 6, i / 36);
        text += &format!("{},{},{}\n", offset + 0.1 * f64::from(x), 0.1 * f64::from(y), 0.1 * f64::from(z));
    }
    text + &format!("{},1.0,0.25\n", offset + 0.25)
}
