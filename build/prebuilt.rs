//! The build script of a published package: its shaders come as Rust that build.rs made of them in the checkout. tests/package.sh
//! puts it in the place of build.rs.

use std::{env, fs, path::Path};

fn main() {
    println!("cargo:rerun-if-changed=prebuilt");
    let commit = fs::read_to_string("prebuilt/commit").expect("prebuilt/commit is in the package");
    println!("cargo:rustc-env=MENISCUS_COMMIT={}", commit.trim());
    let out = Path::new(&env::var("OUT_DIR").expect("cargo sets OUT_DIR")).join("shaders.rs");
    fs::copy("prebuilt/shaders.rs", out).expect("prebuilt/shaders.rs is in the package, and OUT_DIR is writable");
}
