//! SIGINT and SIGTERM, at whatever moment: no half of an output, nothing temporary.
#![cfg(unix)]

use crate::{Run, listing};
use std::{
    fs,
    os::unix::process::ExitStatusExt,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

const SIGNALS: [(&str, i32); 2] = [("INT", 130), ("TERM", 143)];
const OUTPUTS: [&str; 9] = ["render", "-o", "out.png", "--stats", "s.json", "--dump", "d", "--size", "320x240"];

fn start(run: &Run) -> Child {
    run.prepared(&OUTPUTS).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("meniscus starts")
}

fn kill(child: &Child, signal: &str) {
    let id = child.id().to_string();
    // It may have ended already.
    let _ = Command::new("kill").args(["-s", signal, &id]).stderr(Stdio::null()).status().expect("kill");
}

/// Ends the program and looks at what is left; says whether the signal came before its end.
fn ended(run: &Run, mut child: Child, (signal, code): (&str, i32), dump: &[String]) -> bool {
    kill(&child, signal);
    let status = child.wait().expect("waited for");
    // Before its first line the system ends it, which shells count alike.
    let by_system = status.signal().map(|s| 128 + s);
    assert!(status.success() || status.code().or(by_system) == Some(code), "SIG{signal}: {status}");
    run.nothing_temporary();
    for name in listing(run.folder.path()) {
        let path = run.path(&name);
        match name.as_str() {
            "out.png" => assert!(image::open(path).is_ok(), "half a picture"),
            "s.json" => {
                let bytes = fs::read(path).expect("read");
                assert!(serde_json::from_slice::<serde_json::Value>(&bytes).is_ok(), "half the statistics");
            }
            "d" => assert_eq!(listing(&path), dump, "half a dump"),
            other => panic!("SIG{signal} left {other}"),
        }
    }
    !status.success()
}

#[test]
fn signals_leave_nothing_half_done() {
    let run = Run::new();
    let begin = Instant::now();
    assert!(start(&run).wait().expect("waited for").success());
    let whole = begin.elapsed();
    let dump = listing(&run.path("d"));
    assert!(dump.len() > 10);
    let mut stopped = 0;
    for moment in 0..12u32 {
        for name in ["out.png", "s.json"] {
            let _ = fs::remove_file(run.path(name));
        }
        // Now and then there is an older dump.
        if moment % 3 > 0 {
            let _ = fs::remove_dir_all(run.path("d"));
        }
        let child = start(&run);
        std::thread::sleep(whole * moment / 12);
        stopped += u32::from(ended(&run, child, SIGNALS[moment as usize % 2], &dump));
    }
    assert!(stopped > 0, "no signal came in time");
}

/// The moments that matter: something has its temporary name.
#[test]
fn signals_remove_what_is_temporary() {
    let run = Run::new();
    assert!(start(&run).wait().expect("waited for").success());
    let dump = listing(&run.path("d"));
    let mut seen = 0;
    for round in 0..6 {
        let mut child = start(&run);
        let begin = Instant::now();
        let temporary = || listing(run.folder.path()).iter().any(|n| n.starts_with(".meniscus-"));
        while child.try_wait().expect("asked").is_none() && begin.elapsed() < Duration::from_secs(60) {
            if temporary() {
                seen += 1;
                break;
            }
        }
        ended(&run, child, SIGNALS[round % 2], &dump);
    }
    assert!(seen > 0, "nothing temporary was ever seen");
}
