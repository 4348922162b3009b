//! Rust from glsl/include/shared.glsl: `#define NAME number` and structs of mat4, vec4 and uvec4.

use std::fmt::Write as _;

/// The Rust source, or "line: what is wrong".
pub fn to_rust(glsl: &str) -> Result<String, String> {
    let mut rust = String::new();
    let mut inside = false;
    for (number, line) in glsl.lines().enumerate() {
        let number = number + 1;
        let (code, comment) = line.split_once("//").unwrap_or((line, ""));
        let words: Vec<&str> = code.trim().trim_end_matches(';').split_whitespace().collect();
        match words.as_slice() {
            [] => {}
            ["#define", name, value] => {
                let kind = if value.contains('.') { "f32" } else { "u32" };
                writeln!(rust, "#[allow(dead_code)]\npub const {name}: {kind} = {value};").unwrap();
            }
            ["struct", name, "{"] => {
                inside = true;
                writeln!(rust, "/// glsl/include/shared.glsl:{number}\n#[repr(C)]").unwrap();
                writeln!(rust, "#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]").unwrap();
                writeln!(rust, "pub struct {name} {{").unwrap();
            }
            ["}"] if inside => {
                inside = false;
                rust += "}\n";
            }
            [kind, name] if inside => {
                let kind = match *kind {
                    "mat4" => "glam::Mat4",
                    "vec4" => "glam::Vec4",
                    "uvec4" => "glam::UVec4",
                    other => return Err(format!("{number}: error: {other} would not be laid out alike in Rust")),
                };
                if !comment.is_empty() {
                    writeln!(rust, "    /// {}", comment.trim()).unwrap();
                }
                writeln!(rust, "    pub {name}: {kind},").unwrap();
            }
            _ => return Err(format!("{number}: error: build.rs does not understand this line")),
        }
    }
    Ok(rust)
}
