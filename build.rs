//! Makes Rust of the shaders: compiled from glsl/, or as they come prebuilt in a published package.

use std::{env, fs, path::Path};

#[cfg(feature = "glsl")]
#[path = "build/glsl.rs"]
mod glsl;

fn main() {
    println!("cargo:rerun-if-changed=glsl");
    println!("cargo:rerun-if-changed=build");
    commit();
    let rust = shaders();
    let out = Path::new(&env::var("OUT_DIR").expect("cargo sets OUT_DIR")).join("shaders.rs");
    fs::write(out, rust).expect("OUT_DIR is writable");
}

/// Rust of all shaders and of what both sides share.
#[cfg(feature = "glsl")]
fn shaders() -> String {
    glsl::compiled()
}

/// The same as `tests/package.sh` has put it into the package.
#[cfg(not(feature = "glsl"))]
fn shaders() -> String {
    println!("cargo:rerun-if-changed=prebuilt");
    fs::read_to_string("prebuilt/shaders.rs").unwrap_or_else(|e| {
        fail(&format!(
            "prebuilt/shaders.rs: {e}: only published packages have their shaders prebuilt. Add the feature `glsl`, which compiles \
             glsl/ and needs shaderc (./setup.sh)"
        ))
    })
}

/// The commit this is built from, for figures that say what they were measured with.
fn commit() {
    let git = std::process::Command::new("git").args(["rev-parse", "--short=12", "HEAD"]).output();
    let hash = git.ok().filter(|o| o.status.success()).map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned());
    println!("cargo:rustc-env=MENISCUS_COMMIT={}", hash.unwrap_or_else(|| "unknown".into()));
    // A file that is not there would make every build run this anew.
    if Path::new(".git/logs/HEAD").exists() {
        println!("cargo:rerun-if-changed=.git/logs/HEAD");
    }
}

fn fail(message: &str) -> ! {
    // `file:line: error: ...` lines, as editors look for them.
    eprintln!("{message}");
    for line in message.lines() {
        println!("cargo:warning={line}");
    }
    std::process::exit(1);
}
