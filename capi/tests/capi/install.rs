//! The library as `capi/install.sh` puts it somewhere, and programs compiled against that.

use std::{
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::LazyLock,
};
use tempfile::TempDir;

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the repository")
}

/// Where it was installed; once for all tests.
pub static INSTALLED: LazyLock<TempDir> = LazyLock::new(|| {
    let prefix = tempfile::tempdir().expect("a temporary folder");
    let profile = if cfg!(debug_assertions) { "dev" } else { "release" };
    let mut install = Command::new(root().join("capi/install.sh"));
    install.args(["--prefix".as_ref(), prefix.path().as_os_str(), "--profile".as_ref(), profile.as_ref()]);
    run(&mut install);
    prefix
});

/// What a command prints; one that fails, or is not there, fails the test.
pub fn run(command: &mut Command) -> String {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command.output().unwrap_or_else(|e| panic!("{program}: {e}: install it (./setup.sh does)"));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let complained = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {}\n{said}{complained}", output.status);
    said
}

fn pkg_config(arguments: &[&str]) -> Vec<String> {
    let mut command = Command::new("pkg-config");
    command.env("PKG_CONFIG_PATH", INSTALLED.path().join("lib/pkgconfig")).args(arguments).arg("meniscus");
    run(&mut command).split_whitespace().map(str::to_owned).collect()
}

/// How a program finds the library.
#[derive(Clone, Copy, PartialEq)]
pub enum Link {
    Shared,
    Static,
}

const STRICT: &[&str] = &["-pedantic", "-Wall", "-Wextra", "-Werror"];

/// Compiles a program of C99, by what pkg-config says; where it is.
pub fn compile(source: &Path, to: &Path, link: Link) -> PathBuf {
    let name = source.file_stem().expect("a name").to_string_lossy();
    let program = to.join(format!("{name}-{}", if link == Link::Shared { "shared" } else { "static" }));
    let mut cc = Command::new("cc");
    cc.args(["-std=c99", "-O1", "-g"]).args(STRICT).args(pkg_config(&["--cflags"])).arg(source);
    match link {
        Link::Shared => {
            let lib = INSTALLED.path().join("lib");
            cc.args(pkg_config(&["--libs"])).arg(format!("-Wl,-rpath,{}", lib.display()));
        }
        Link::Static => {
            let libs = pkg_config(&["--libs", "--static"]);
            cc.args(libs.iter().map(|l| if l == "-lmeniscus" { "-l:libmeniscus.a" } else { l }));
        }
    }
    run(cc.args(["-lvulkan", "-lm", "-o"]).arg(&program));
    program
}

/// A header that is included alone, twice, is complete in each language.
#[test]
fn the_header_compiles_as_c99_and_as_cpp() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (compiler, standard, file) in
        [("cc", "c99", "alone.c"), ("cc", "c17", "alone.c"), ("c++", "c++11", "alone.cpp")]
    {
        let source = folder.path().join(file);
        fs::write(
            &source,
            "#include <meniscus.h>\n#include <meniscus.h>\nint main(void) { return MENISCUS_STATUS_OK; }\n",
        )
        .expect("writable");
        let mut command = Command::new(compiler);
        command.arg(format!("-std={standard}")).args(STRICT).args(pkg_config(&["--cflags"]));
        run(command.arg("-c").arg(&source).arg("-o").arg(folder.path().join("alone.o")));
    }
}

/// The library has its functions, and nothing else of its own, under the name that programs were linked with.
#[test]
fn the_library_exports_what_the_header_has() {
    let library = INSTALLED.path().join("lib/libmeniscus.so");
    let symbols = run(Command::new("nm").args(["-D", "--defined-only", "--format=posix"]).arg(&library));
    let header = fs::read_to_string(root().join("capi/include/meniscus.h")).expect("the header");
    let exported: Vec<_> = symbols.lines().filter_map(|l| l.split(' ').next()).collect();
    for name in &exported {
        assert!(header.contains(&format!(" {name}(")) || header.contains(&format!("*{name}(")), "{name} is exported");
    }
    assert!(exported.len() > 40, "{exported:?}");
    let dynamic = run(Command::new("readelf").arg("-d").arg(&library));
    assert!(dynamic.contains("[libmeniscus.so.1]"), "{dynamic}");
}

/// A project that says find_package(meniscus) builds with both libraries.
#[test]
fn cmake_finds_the_package() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("writable");
    write(
        "CMakeLists.txt",
        "cmake_minimum_required(VERSION 3.16)\n\
         project(guest C)\n\
         find_package(meniscus 0.1 REQUIRED CONFIG)\n\
         add_executable(shared guest.c)\n\
         target_link_libraries(shared PRIVATE meniscus::meniscus)\n\
         add_executable(static guest.c)\n\
         target_link_libraries(static PRIVATE meniscus::meniscus_static)\n",
    );
    write(
        "guest.c",
        "#include <meniscus.h>\n#include <stdio.h>\n\
         int main(void) { printf(\"%s %u\\n\", meniscus_version(), (unsigned)meniscus_abi_version());\n\
         return meniscus_abi_version() != MENISCUS_ABI_VERSION; }\n",
    );
    let build = folder.path().join("build");
    let prefix = format!("-DCMAKE_PREFIX_PATH={}", INSTALLED.path().display());
    let at: [&OsStr; 4] = ["-S".as_ref(), folder.path().as_os_str(), "-B".as_ref(), build.as_os_str()];
    run(Command::new("cmake").args(at).arg(prefix));
    run(Command::new("cmake").arg("--build").arg(&build));
    let needs = |program: &str| run(Command::new("readelf").arg("-d").arg(build.join(program)));
    assert!(needs("shared").contains("libmeniscus.so.1") && !needs("static").contains("libmeniscus"));
    for program in ["shared", "static"] {
        assert_eq!(run(&mut Command::new(build.join(program))), "0.1.0 1\n", "{program}");
    }
    // What asks for another version than this does not get it.
    let text = fs::read_to_string(folder.path().join("CMakeLists.txt")).expect("it was written");
    for version in ["0.0", "0.1.9", "1"] {
        write("CMakeLists.txt", &text.replace("meniscus 0.1 ", &format!("meniscus {version} ")));
        let refused = Command::new("cmake").args(at).output().expect("it ran before");
        let said = String::from_utf8_lossy(&refused.stderr);
        assert!(!refused.status.success() && said.contains("version: 0.1.0"), "{version}: {said}");
    }
}
