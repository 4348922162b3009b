//! Compiles glsl/ to SPIR-V, and makes Rust of what both sides share: block layouts and constants from
//! glsl/include/shared.glsl, and each shader's bindings as reflected from its SPIR-V.

use std::{env, fmt::Write as _, fs, path::Path};

#[path = "build/reflect.rs"]
mod reflect;
#[path = "build/shared.rs"]
mod shared;

/// Rust constant, source file, macros it is compiled with.
const SHADERS: &[(&str, &str, &[&str])] = &[
    ("EXTENT_REDUCE_COMP", "extent.comp", &["REDUCE"]),
    ("EXTENT_PLAN_COMP", "extent.comp", &["PLAN"]),
    ("SORT_COUNT_COMP", "sort.comp", &["COUNT"]),
    ("SORT_SCAN_COMP", "sort.comp", &["SCAN"]),
    ("SORT_SCATTER_COMP", "sort.comp", &["SCATTER"]),
    ("SORT_GATHER_COMP", "sort.comp", &["GATHER"]),
    ("SHAPE_COMP", "shape.comp", &[]),
    ("SHAPE_NEIGHBOURS_COMP", "shape.comp", &["NEIGHBOURS"]),
    ("OCCLUDE_COMP", "occlude.comp", &[]),
    ("CULL_COMP", "cull.comp", &[]),
    ("COMPACT_COUNT_COMP", "compact.comp", &["COUNT"]),
    ("COMPACT_SCAN_COMP", "compact.comp", &["SCAN"]),
    ("COMPACT_SCATTER_COMP", "compact.comp", &["SCATTER"]),
    ("SPLAT_POINTS_VERT", "splat.vert", &[]),
    ("SPLAT_QUADS_VERT", "splat.vert", &["QUADS"]),
    ("SPLAT_FRAG", "splat.frag", &[]),
    ("PLANE_FIT_COMP", "plane_fit.comp", &[]),
    ("NORMALS_COMP", "normals.comp", &[]),
    ("BILATERAL_COMP", "smooth/bilateral.comp", &[]),
    ("BILATERAL_SEPARABLE_COMP", "smooth/bilateral_separable.comp", &[]),
    ("BINOMIAL_ACROSS_COMP", "smooth/binomial.comp", &["ACROSS"]),
    ("BINOMIAL_DOWN_COMP", "smooth/binomial.comp", &["DOWN"]),
    ("CURVATURE_FLOW_COMP", "smooth/curvature_flow.comp", &[]),
    ("NARROW_RANGE_FULL_COMP", "smooth/narrow_range.comp", &["FULL"]),
    ("NARROW_RANGE_ALONG_COMP", "smooth/narrow_range.comp", &["ALONG"]),
    ("TILES_COMP", "tiles.comp", &[]),
    ("REFRACT_VERT", "refract.vert", &[]),
    ("REFRACT_FRAG", "refract.frag", &[]),
    ("REFRACT_CUBE_FRAG", "refract.frag", &["CUBE"]),
    ("REFRACT_SCENE_FRAG", "refract.frag", &["SCENE"]),
    ("REFRACT_SCENE_CUBE_FRAG", "refract.frag", &["SCENE", "CUBE"]),
    ("REFRACT_DEBUG_FRAG", "refract.frag", &["DEBUG"]),
    ("REFRACT_DEBUG_CUBE_FRAG", "refract.frag", &["DEBUG", "CUBE"]),
    ("REFRACT_DEBUG_SCENE_FRAG", "refract.frag", &["DEBUG", "SCENE"]),
    ("REFRACT_DEBUG_SCENE_CUBE_FRAG", "refract.frag", &["DEBUG", "SCENE", "CUBE"]),
];

fn main() {
    println!("cargo:rerun-if-changed=glsl");
    println!("cargo:rerun-if-changed=build");
    commit();
    let mut rust = String::new();
    let shared = fs::read_to_string("glsl/include/shared.glsl").expect("glsl/include/shared.glsl");
    rust += &shared::to_rust(&shared).unwrap_or_else(|e| fail(&format!("glsl/include/shared.glsl:{e}")));

    let compiler = shaderc::Compiler::new().expect("libshaderc starts");
    for (name, file, macros) in SHADERS {
        let words = compile(&compiler, file, macros);
        let bindings = reflect::bindings(&words).unwrap_or_else(|e| fail(&format!("glsl/{file}: {e}")));
        writeln!(rust, "/// glsl/{file} {macros:?}\npub static {name}: Shader = Shader {{").unwrap();
        writeln!(rust, "    name: \"{file}\",\n    spirv: &{words:?},\n    bindings: &[").unwrap();
        for b in bindings {
            writeln!(rust, "        Binding {{ index: {}, name: \"{}\", kind: Kind::{} }},", b.index, b.name, b.kind)
                .unwrap();
        }
        writeln!(rust, "    ],\n}};").unwrap();
    }
    let out = Path::new(&env::var("OUT_DIR").expect("cargo sets OUT_DIR")).join("shaders.rs");
    fs::write(out, rust).expect("OUT_DIR is writable");
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

/// SPIR-V of one shader, or a failed build that names file and line.
fn compile(compiler: &shaderc::Compiler, file: &str, macros: &[&str]) -> Vec<u32> {
    let path = format!("glsl/{file}");
    let source = fs::read_to_string(&path).unwrap_or_else(|e| fail(&format!("{path}: {e}")));
    let kind = match file.rsplit('.').next() {
        Some("comp") => shaderc::ShaderKind::Compute,
        Some("vert") => shaderc::ShaderKind::Vertex,
        Some("frag") => shaderc::ShaderKind::Fragment,
        other => fail(&format!("{path}: no shader stage has the extension {other:?}")),
    };
    let mut options = shaderc::CompileOptions::new().expect("libshaderc starts");
    // SPIR-V 1.5: what 1.6 makes of group sizes (LocalSizeId) would need the feature maintenance4.
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    options.set_optimization_level(shaderc::OptimizationLevel::Performance);
    options.set_generate_debug_info(); // keeps names: reflection and validation messages use them
    options.set_warnings_as_errors();
    for m in macros {
        options.add_macro_definition(m, Some("1"));
    }
    options.set_include_callback(|name, _, _, _| {
        let path = format!("glsl/include/{name}");
        let content = fs::read_to_string(&path).map_err(|e| format!("{path}: {e}"))?;
        Ok(shaderc::ResolvedInclude { resolved_name: path, content })
    });
    match compiler.compile_into_spirv(&source, kind, &path, "main", Some(&options)) {
        Ok(artifact) => artifact.as_binary().to_vec(),
        Err(e) => fail(&e.to_string()),
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
