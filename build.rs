//! Compiles glsl/ to SPIR-V, and makes Rust of what both sides share: block layouts and constants from
//! glsl/include/shared.glsl, and each shader's bindings and constants as reflected from its SPIR-V.

use std::{
    env,
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

#[path = "build/reflect.rs"]
mod reflect;
#[path = "build/shared.rs"]
mod shared;

fn main() {
    println!("cargo:rerun-if-changed=glsl");
    println!("cargo:rerun-if-changed=build");
    commit();
    let mut rust = String::new();
    let shared = fs::read_to_string("glsl/include/shared.glsl").expect("glsl/include/shared.glsl");
    rust += &shared::to_rust(&shared).unwrap_or_else(|e| fail(&format!("glsl/include/shared.glsl:{e}")));

    let compiler = shaderc::Compiler::new().expect("libshaderc starts");
    let mut files = Vec::new();
    shaders(Path::new("glsl"), &mut files);
    files.sort();
    for file in files {
        let source = fs::read_to_string(&file).unwrap_or_else(|e| fail(&format!("{}: {e}", file.display())));
        let file = file.strip_prefix("glsl").expect("found below it").to_string_lossy().into_owned();
        rust += &statics(&compiler, &file, &source);
    }
    let out = Path::new(&env::var("OUT_DIR").expect("cargo sets OUT_DIR")).join("shaders.rs");
    fs::write(out, rust).expect("OUT_DIR is writable");
}

/// Every shader below a folder.
fn shaders(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| fail(&format!("{}: {e}", folder.display())));
    for path in entries.map(|e| e.expect("a readable folder").path()) {
        if path.is_dir() {
            shaders(&path, found);
        } else if path.extension().is_some_and(|e| e == "comp" || e == "vert" || e == "frag") {
            found.push(path);
        }
    }
}

/// The Rust statics of one file: NAME_STAGE; or, of a file with a line `// Compiled with one of: A, B`, NAME_A_STAGE and
/// NAME_B_STAGE; or, of one with `// Compiled with any of: A, B`, an array by A + 2 B.
fn statics(compiler: &shaderc::Compiler, file: &str, source: &str) -> String {
    let listed = |what: &str| {
        let list = source.lines().find_map(|l| l.strip_prefix(&format!("// Compiled with {what} of: ")))?;
        Some(list.split(',').map(|m| m.trim().to_owned()).collect::<Vec<_>>())
    };
    let (stem, stage) = Path::new(file).file_name().and_then(|n| n.to_str()).and_then(|n| n.split_once('.')).unwrap();
    let (stem, stage) = (stem.to_uppercase(), stage.to_uppercase());
    let mut rust = String::new();
    if let Some(macros) = listed("one") {
        for m in macros {
            let shader = shader(compiler, file, source, &[&m]);
            writeln!(rust, "/// glsl/{file} with {m}\npub static {stem}_{m}_{stage}: Shader = {shader};").unwrap();
        }
    } else if let Some(macros) = listed("any") {
        let some =
            |set: usize| macros.iter().enumerate().filter(move |(i, _)| set >> i & 1 == 1).map(|(_, m)| m.as_str());
        let all: Vec<_> =
            (0..1 << macros.len()).map(|set| shader(compiler, file, source, &some(set).collect::<Vec<_>>())).collect();
        writeln!(rust, "/// glsl/{file} by {}", macros.join(", ")).unwrap();
        writeln!(rust, "pub static {stem}_{stage}: [Shader; {}] = [{}];", all.len(), all.join(", ")).unwrap();
    } else {
        let shader = shader(compiler, file, source, &[]);
        writeln!(rust, "/// glsl/{file}\npub static {stem}_{stage}: Shader = {shader};").unwrap();
    }
    rust
}

/// One compiled shader as a Rust expression.
fn shader(compiler: &shaderc::Compiler, file: &str, source: &str, macros: &[&str]) -> String {
    let words = compile(compiler, file, source, macros);
    let found = reflect::interface(&words).unwrap_or_else(|e| fail(&format!("glsl/{file}: {e}")));
    let binding =
        |b: &reflect::Binding| format!("Binding {{ index: {}, name: {:?}, kind: Kind::{} }}", b.index, b.name, b.kind);
    let bindings: Vec<_> = found.bindings.iter().map(binding).collect();
    let name = if macros.is_empty() { file.to_owned() } else { format!("{file} ({})", macros.join(", ")) };
    let scalar = |of: &str| if of.is_empty() { "None".to_owned() } else { format!("Some(Scalar::{of})") };
    let list = |all: Vec<String>| format!("&[{}]", all.join(", "));
    let constant = |(id, name, of): &(u32, String, &str)| format!("({id}, {name:?}, {})", scalar(of));
    let member = |(name, offset, of): &(String, u32, &str)| format!("({name:?}, {offset}, {})", scalar(of));
    format!(
        "Shader {{ name: {name:?}, spirv: &{words:?}, bindings: &[{}], constants: {}, push: {}, push_bytes: {}, \
         outputs: {} }}",
        bindings.join(", "),
        list(found.constants.iter().map(constant).collect()),
        list(found.push.iter().map(member).collect()),
        found.push_bytes,
        list(found.outputs.iter().map(|(location, of)| format!("({location}, {})", scalar(of))).collect()),
    )
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
fn compile(compiler: &shaderc::Compiler, file: &str, source: &str, macros: &[&str]) -> Vec<u32> {
    let path = format!("glsl/{file}");
    let kind = match file.rsplit('.').next() {
        Some("comp") => shaderc::ShaderKind::Compute,
        Some("vert") => shaderc::ShaderKind::Vertex,
        _ => shaderc::ShaderKind::Fragment,
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
    match compiler.compile_into_spirv(source, kind, &path, "main", Some(&options)) {
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
