//! A program in C that does everything wrong once, on every driver: typed errors, no crash, nothing for validation to say; and that
//! draws positions on the device.

use crate::{
    drivers,
    install::{Link, compile, root, run},
};
use std::process::Command;

#[test]
fn what_cannot_be_right_is_an_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let program = compile(&root().join("capi/tests/c/misuse.c"), folder.path(), Link::Shared);
    for driver in drivers::all() {
        println!("driver: {driver}");
        let said = run(Command::new(&program).current_dir(root()).arg(&driver));
        let checks = said.lines().find_map(|l| l.strip_suffix(" checks, 0 failed")).and_then(|n| n.parse::<u32>().ok());
        assert!(checks.is_some_and(|n| n > 100) && said.contains("validation: 0 messages"), "{said}");
    }
}
