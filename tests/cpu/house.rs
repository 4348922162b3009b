//! The house's own rules: a pass has its files, no file grows past what can be read, licences are permissive.

use std::{fs, path::Path};
use yaml_rust2::YamlLoader;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn a_pass_has_one_home() {
    let mut found = 0;
    for entry in fs::read_dir(root().join("src/passes")).expect("src/passes") {
        let path = entry.expect("readable").path();
        let stem = path.file_stem().expect("a file").to_string_lossy().into_owned();
        if stem == "mod" {
            continue;
        }
        found += 1;
        let shader = ["comp", "frag"].iter().any(|e| root().join(format!("glsl/{stem}.{e}")).exists());
        assert!(shader, "pass {stem} has no shader glsl/{stem}.*");
        for other in [format!("src/twin/{stem}.rs"), format!("tests/gpu/{stem}.rs")] {
            assert!(root().join(&other).exists(), "pass {stem} has no {other}");
        }
    }
    assert!(found >= 6, "only {found} passes");
}

/// A filter is its shader, its Rust file and its twin; `tests/gpu/smooth.rs` compares them all.
#[test]
fn a_filter_has_one_home() {
    let mut found = 0;
    for entry in fs::read_dir(root().join("src/smooth")).expect("src/smooth") {
        let path = entry.expect("readable").path();
        let stem = path.file_stem().expect("a file").to_string_lossy().into_owned();
        // What all share, and the one that does nothing.
        if path.is_dir() || ["mod", "twin", "none"].contains(&stem.as_str()) {
            continue;
        }
        found += 1;
        for other in [format!("glsl/smooth/{stem}.comp"), format!("src/smooth/{stem}/twin.rs")] {
            assert!(root().join(&other).exists(), "filter {stem} has no {other}");
        }
    }
    assert!(found >= 7, "only {found} filters");
}

/// The addition that CONTRIBUTING.md shows is the one that is here.
#[test]
fn the_example_of_a_member_is_the_source() {
    let text = fs::read_to_string(root().join("CONTRIBUTING.md")).expect("CONTRIBUTING.md");
    let file = "src/smooth/curvature_flow.rs";
    let shown = text.split(&format!("+++ b/{file}")).nth(1).expect("a diff of the file");
    let lines: Vec<_> = shown.lines().skip(1).map_while(|l| l.strip_prefix('+')).collect();
    let source = fs::read_to_string(root().join(file)).expect("the file");
    assert_eq!(lines, source.lines().collect::<Vec<_>>(), "CONTRIBUTING.md and {file}");
    let family = fs::read_to_string(root().join("src/smooth/mod.rs")).expect("the family");
    let added = text.split("--- /dev/null").next().expect("a diff").lines().filter_map(|l| l.strip_prefix('+'));
    let added: Vec<_> = added.filter(|l| !l.starts_with("++")).collect();
    assert_eq!(added.len(), 2, "lines elsewhere: {added:?}");
    assert!(added.iter().all(|l| family.lines().any(|own| own == *l)), "{added:?}");
}

fn walk(folder: &Path, check: &mut dyn FnMut(&Path)) {
    for entry in fs::read_dir(folder).expect("readable folder") {
        let path = entry.expect("readable").path();
        if path.is_dir() { walk(&path, check) } else { check(&path) }
    }
}

#[test]
fn no_file_is_too_long() {
    let bevy = ["hosts/bevy/src", "hosts/bevy/examples", "hosts/bevy/tests"];
    for folder in ["src", "glsl", "tests", "build", "examples", "capi", "hosts/wgpu"].into_iter().chain(bevy) {
        walk(&root().join(folder), &mut |path| {
            // Made of the sources, for programs.
            if path.ends_with("capi/include/meniscus.h") {
                return;
            }
            let lines = fs::read_to_string(path).map_or(0, |s| s.lines().count());
            assert!(lines <= 500, "{} has {lines} lines", path.display());
        });
    }
}

/// The lists of planted mistakes fit the code: each text is there once, and each test exists.
#[test]
fn planted_mistakes_can_be_planted() {
    // All that tests/mutants.sh plants.
    let mut lists = String::new();
    walk(&root().join("tests/mutants"), &mut |path| lists += &fs::read_to_string(path).expect("a list"));
    let mut found = 0;
    for line in lists.lines().filter(|l| !l.is_empty() && !l.starts_with('#')) {
        let [file, text, _, test] = line.split(" ::: ").collect::<Vec<_>>()[..] else {
            panic!("not four columns: {line}");
        };
        let code = fs::read_to_string(root().join(file)).expect("a file of the repository");
        assert_eq!(code.matches(text).count(), 1, "{file}: {text}");
        let (module, name) = test.rsplit_once("::").expect("module::test");
        let folder = match module.split("::").next() {
            Some("cpu" | "cli" | "view" | "endurance" | "memory" | "tracy") => "tests",
            Some("capi") => "capi/tests",
            Some("wgpu") => "hosts/wgpu/tests/host",
            Some("wgpulib") => "hosts/wgpu/src",
            Some("lib" | "tracylib") => "src",
            Some("capilib") => "capi/src",
            _ => "tests/gpu",
        };
        let outside = ["lib::", "capilib::", "wgpu::", "wgpulib::", "tracylib::"];
        let module = outside.iter().find_map(|o| module.strip_prefix(o)).unwrap_or(module).replace("::", "/");
        // Unit tests may be a module within the file of what they test.
        let within = module.strip_suffix("/tests").unwrap_or(&module);
        let files =
            [format!("{module}.rs"), format!("{module}/mod.rs"), format!("{within}.rs"), format!("{within}/mod.rs")];
        let is_test = |file: &String| {
            let tests = fs::read_to_string(root().join(folder).join(file)).unwrap_or_default();
            // Attributes stand before it without an empty line between.
            let before = tests.split_once(&format!("fn {name}()")).map(|(before, _)| before);
            before.and_then(|b| b.rsplit("\n\n").next()).is_some_and(|b| b.contains("#[test]"))
        };
        assert!(files.iter().any(is_test), "there is no test {test}");
        found += 1;
    }
    assert!(found > 50, "only {found}");
}

/// The container is CI's own image with what setup.sh installs, and names no package itself.
#[test]
fn the_container_is_what_setup_installs() {
    let read = |name: &str| fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let text = read("Dockerfile");
    let lines = text.lines().filter(|l| !l.is_empty() && !l.starts_with('#'));
    let steps: Vec<_> = lines.map(|l| l.split_once(' ').expect("an instruction and what it is told")).collect();
    let of = |name: &str| steps.iter().filter(|s| s.0 == name).map(|s| s.1.trim()).collect::<Vec<_>>();
    let known = ["FROM", "RUN", "WORKDIR", "COPY", "CMD"];
    assert!(steps.iter().all(|s| known.contains(&s.0)) && steps[0].0 == "FROM", "{steps:?}");
    assert!(read(".github/workflows/ci.yml").contains(&format!("image: [\"{}\"", of("FROM")[0])), "CI's image");
    assert_eq!(of("RUN").last(), Some(&"./setup.sh"));
    assert!(!of("RUN").iter().any(|run| ["apt", "dpkg"].iter().any(|word| run.contains(word))), "{steps:?}");
    // Nothing else of the checkout is sent to whoever builds the image.
    let sent = read(".dockerignore");
    for copied in of("COPY") {
        let (file, _) = copied.split_once(' ').expect("from and to");
        assert!(root().join(file).exists() && sent.lines().any(|l| l.strip_prefix('!') == Some(file)), "{file}");
    }
    assert!(!of("COPY").is_empty() && sent.starts_with("*\n"), "{sent}");
}

/// The workflow for others is one: it installs some of what setup.sh does, and runs tests on a driver that it names.
#[test]
fn the_workflow_for_others_can_be_copied() {
    let read = |name: &str| fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let all = YamlLoader::load_from_str(&read("docs/ci/lavapipe.yml")).expect("YAML");
    let [file] = &all[..] else { panic!("{} documents", all.len()) };
    assert!(file["name"].as_str().is_some() && file["on"].as_vec().is_some_and(|on| !on.is_empty()));
    let jobs: Vec<_> = file["jobs"].as_hash().expect("jobs").values().collect();
    let [job] = jobs[..] else { panic!("{} jobs", jobs.len()) };
    assert!(job["runs-on"].as_str().is_some_and(|on| on.starts_with("ubuntu-")));
    let driver = job["env"]["MENISCUS_DRIVERS"].as_str().expect("a driver");
    assert!(read(".ci/run").contains(&format!("drivers=({driver})")), "{driver} is not what CI runs on");
    assert!(read("src/harness/drivers.rs").contains("\"MENISCUS_DRIVERS\""), "nobody reads it");
    let steps = job["steps"].as_vec().expect("steps");
    assert!(steps.iter().all(|s| s["run"].as_str().is_some() != s["uses"].as_str().is_some()), "{steps:?}");
    let runs: Vec<_> = steps.iter().filter_map(|s| s["run"].as_str()).collect();
    assert!(runs.contains(&"cargo test"), "{runs:?}");
    let setup = read("setup.sh");
    let needed = setup.split("packages=(").nth(1).and_then(|s| s.split(')').next()).expect("a list");
    let install = runs.iter().find_map(|r| r.split("--no-install-recommends").nth(1)).expect("packages");
    let packages: Vec<_> = install.split_whitespace().collect();
    assert!(packages.len() >= 3, "{packages:?}");
    assert!(packages.iter().all(|p| needed.split_whitespace().any(|n| n == *p)), "{packages:?}");
}

/// Macros that panic where what they write cannot be written: the library says nothing, and the command says what it has
/// to say through src/bin/meniscus/terminal.rs.
#[test]
fn nothing_is_printed_past_the_terminal() {
    walk(&root().join("src"), &mut |path| {
        // It runs in tests, which show what a macro prints with the test that failed.
        if path.starts_with(root().join("src/harness")) {
            return;
        }
        let text = fs::read_to_string(path).expect("UTF-8");
        for word in ["print!(", "println!(", "dbg!("] {
            assert!(!text.contains(word), "{} has {word}", path.display());
        }
        let streams = text.contains("io::stdout()") || text.contains("io::stderr()");
        let allowed = ["terminal.rs", "outputs.rs"].iter().any(|name| path.ends_with(name));
        assert!(!streams || allowed, "{} writes to the terminal by itself", path.display());
    });
}

/// Every crate in the lock file can be had under one of these.
const PERMISSIVE: &[&str] = &[
    "MIT",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "ISC",
    "Zlib",
    "Unlicense",
    "Unicode-3.0",
    "0BSD",
    "CC0-1.0",
    "BSL-1.0",
];

/// What runs in tests alone, under another licence: nothing of it is in what is built.
const TOOLS: &[(&str, &str)] = &[("cbindgen", "MPL-2.0")];

/// An SPDX expression: `OR` (and the old `/`) offer, `AND` demands.
fn permissive(expression: &str) -> bool {
    let plain = expression.replace(['(', ')'], "");
    plain
        .split(" AND ")
        .all(|part| part.split(" OR ").flat_map(|p| p.split('/')).any(|l| PERMISSIVE.contains(&l.trim())))
}

#[cfg(feature = "cli")]
#[test]
fn dependencies_are_permissively_licensed() {
    assert!(
        permissive("MIT OR GPL-3.0")
            && permissive("(MIT OR Apache-2.0) AND Unicode-3.0")
            && permissive("MIT/Apache-2.0")
    );
    assert!(!permissive("GPL-3.0") && !permissive("MIT AND LGPL-2.1"));
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let output = std::process::Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--locked", "--all-features"])
        .current_dir(root())
        .output()
        .expect("cargo metadata");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    assert!(packages.len() > 50, "only {} packages", packages.len());
    let nodes = metadata["resolve"]["nodes"].as_array().expect("who depends on whom");
    let depended = || nodes.iter().flat_map(|n| n["deps"].as_array().expect("dependencies"));
    for (tool, _) in TOOLS {
        let uses: Vec<_> = depended().filter(|d| d["name"] == *tool).map(|d| &d["dep_kinds"]).collect();
        let only_in_tests =
            |kinds: &serde_json::Value| kinds.as_array().is_some_and(|k| k.iter().all(|k| k["kind"] == "dev"));
        assert!(!uses.is_empty() && uses.iter().all(|kinds| only_in_tests(kinds)), "{tool}: {uses:?}");
    }
    for p in packages {
        let licence = p["license"].as_str().unwrap_or("none stated");
        if TOOLS.iter().any(|(name, of)| p["name"] == *name && licence == *of) {
            continue;
        }
        assert!(permissive(licence), "{} {}: licence {licence}", p["name"], p["version"]);
    }
}
