//! The example engine in C draws what the one in Rust draws, bit for bit, on every driver, and validation has nothing to say.

use crate::{
    drivers,
    install::{Link, compile, root, run},
};
use std::{fs, path::Path, process::Command};

/// The picture that examples/embed.rs draws.
fn rust_picture(file: &Path, driver: &str) -> Vec<u8> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let mut embed = Command::new(cargo);
    let features = ["--no-default-features", "--features", "gpu-allocator"];
    embed.current_dir(root()).args(["run", "--quiet", "--locked"]).args(features).args(["--example", "embed", "--"]);
    run(embed.arg(file).arg(driver));
    fs::read(file).expect("a picture")
}

/// How many colours a picture has.
fn colours(picture: &[u8]) -> usize {
    picture.chunks_exact(3).collect::<std::collections::HashSet<_>>().len()
}

#[test]
fn an_engine_in_c_draws_the_same_bits() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let source = root().join("capi/examples/engine.c");
    let [shared, linked] = [Link::Shared, Link::Static].map(|link| compile(&source, folder.path(), link));
    for (i, driver) in drivers::all().into_iter().enumerate() {
        println!("driver: {driver}");
        let wanted = rust_picture(&folder.path().join("rust.ppm"), &driver);
        assert!(wanted.len() == 640 * 480 * 3 + 15 && colours(&wanted) > 1000, "{} bytes", wanted.len());
        // The static library is the same code: one driver will do.
        for program in [Some(&shared), (i == 0).then_some(&linked)].into_iter().flatten() {
            let file = folder.path().join("c.ppm");
            // Drivers are looked for from the repository.
            let said = run(Command::new(program).current_dir(root()).arg(&file).arg(&driver).arg("--validate"));
            assert!(said.contains(&driver) && said.contains("validation: 0 messages"), "{said}");
            assert!(said.contains("1 splash") && said.contains("memory: ") && said.contains(" passes from "), "{said}");
            let drawn = fs::read(&file).expect("a picture");
            let differ = drawn.iter().zip(&wanted).filter(|(a, b)| a != b).count();
            assert!(drawn == wanted, "{driver}: {differ} of {} bytes differ in {}", wanted.len(), program.display());
            fs::remove_file(&file).expect("it was there");
        }
    }
}
