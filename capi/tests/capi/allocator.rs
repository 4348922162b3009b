//! A program in C that brings an allocator of its own, on every driver.

use crate::{
    drivers,
    install::{Link, compile, root, run},
};
use std::process::Command;

#[test]
fn a_program_brings_its_allocator() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let program = compile(&root().join("capi/tests/c/allocator.c"), folder.path(), Link::Shared);
    for driver in drivers::all() {
        println!("driver: {driver}");
        let said = run(Command::new(&program).current_dir(root()).arg(&driver));
        assert!(said.contains(" checks, 0 failed; asked ") && said.contains("validation: 0 messages"), "{said}");
    }
}
