//! What drivers' compilers make of the shaders: on a GPU that is not there, and where nothing is told.

use crate::{Run, text};
use serde_json::Value;
use std::{collections::BTreeSet, path::Path};

/// Shaders of which other waves than [`WAVES`] in flight are asked on the hardware below, the waves, and why.
const OTHER_WAVES: &str = include_str!("pipelines.txt");
const WAVES: u32 = 16;
const FAMILY: &str = "navi31";
/// Mesa 25's RADV, where setup.sh has found it; it compiles for hardware that is not there.
fn radv() -> Option<String> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/mesa25/radeon_icd.json");
    manifest.is_file().then(|| manifest.to_string_lossy().into_owned())
}

/// Compiles for it and gives what was written.
fn compiled(manifest: &str, args: &[&str]) -> Value {
    let run = Run::new();
    let all = [&["pipelines", "--device", "RADV", "-o", "out.json"], args].concat();
    let mut program = run.prepared(&all);
    program.env("RADV_FORCE_FAMILY", FAMILY).env("VK_DRIVER_FILES", manifest).env_remove("VK_ADD_DRIVER_FILES");
    let output = program.output().expect("meniscus starts");
    assert!(output.status.success(), "{args:?}: {}", text(&output));
    assert!(text(&output).contains("registers"), "{}", text(&output));
    serde_json::from_slice(&std::fs::read(run.path("out.json")).expect("figures")).expect("JSON")
}

/// Shader and stage, waves, and what was spilled, of each stage of each method once.
fn stages(figures: &Value) -> BTreeSet<(String, u32, u32)> {
    let methods = figures["methods"].as_array().expect("methods");
    let stages = methods.iter().flat_map(|m| m["stages"].as_array().expect("stages"));
    let one = |stage: &Value| {
        let figure = |name| stage["figures"][name].as_f64().unwrap_or_else(|| panic!("no {name} in {stage}")) as u32;
        let name = format!("{}, {}", stage["shader"].as_str().unwrap(), stage["stage"].as_str().unwrap());
        (name, figure("Subgroups per SIMD"), figure("Spilled VGPRs") + figure("Spilled SGPRs") + figure("Scratch size"))
    };
    stages.map(one).collect()
}

#[test]
fn a_gpu_that_is_not_there_is_kept_busy() {
    let Some(manifest) = radv() else { return println!("no RADV of Mesa 25: nothing is compiled") };
    let others: Vec<(&str, u32)> = OTHER_WAVES
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            let [shader, waves, why] = line.split(" ::: ").collect::<Vec<_>>()[..] else { panic!("{line}") };
            assert!(why.len() > 20, "no reason: {line}");
            (shader, waves.parse().expect("a number"))
        })
        .collect();
    let methods = meniscus::PRESETS.iter().map(|p| p.name).collect::<Vec<_>>().join(",");
    let mut found = BTreeSet::new();
    for prepare in ["cpu", "gpu", "gpu-relation"] {
        found.extend(stages(&compiled(&manifest, &["--methods", &methods, "--prepare", prepare])));
    }
    assert!(found.len() > 40, "{found:?}");
    for (name, waves, spilled) in &found {
        assert_eq!(*spilled, 0, "{name}: bytes or registers that are spilled");
        let least = others.iter().find(|(shader, _)| shader == name).map_or(WAVES, |(_, waves)| *waves);
        assert!(*waves >= least, "{name}: {waves} waves, {least} asked; tests/cli/pipelines.txt is for reasons");
    }
    for (shader, least) in others {
        let fewest = found.iter().filter(|(name, ..)| name == shader).map(|(_, waves, _)| *waves).min();
        assert_eq!(fewest, Some(least), "{shader}: the table says {least}");
    }
}

#[test]
fn what_is_compiled_follows_the_settings() {
    let Some(manifest) = radv() else { return println!("no RADV of Mesa 25: nothing is compiled") };
    let shaders = |args: &[&str]| -> BTreeSet<String> {
        let figures = compiled(&manifest, args);
        assert_eq!(figures["device"], "Null hardware (RADV NAVI31)", "{figures}");
        stages(&figures).into_iter().map(|(name, ..)| name).collect()
    };
    let [plain, nothing] = [&["--method", "imai16"][..], &["--method", "imai16", "--count", "0"]].map(shaders);
    for stage in ["smooth/plane_fit.comp, compute", "optics/tiles.vert, vertex", "optics/walk.frag, fragment"] {
        assert!(plain.contains(stage), "no {stage} in {plain:?}");
    }
    assert!(nothing.iter().all(|name| name.starts_with("optics/")) && !nothing.is_empty(), "{nothing:?}");
    let constants = |most: &str| {
        let figures = compiled(&manifest, &["--method", "imai16", "--internal-reflections", most]);
        let stages = figures["methods"][0]["stages"].as_array().expect("stages").clone();
        let walk = stages.into_iter().find(|s| s["shader"] == "optics/walk.frag" && s["stage"] == "fragment");
        walk.expect("a walk")["constants"].clone()
    };
    assert_ne!(constants("4"), constants("1"));
}

#[test]
fn a_driver_that_tells_nothing_is_refused() {
    let run = Run::new();
    let output = run.command(&["pipelines", "--device", "llvmpipe"]);
    let said = text(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("VK_KHR_pipeline_executable_properties") && said.contains("null hardware"), "{said}");
    let output = run.command(&["pipelines", "-o", "figures.csv"]);
    assert!(text(&output).contains(".json") && output.status.code() == Some(1), "{}", text(&output));
}
