//! Rust from glsl/include/shared.glsl: `#define NAME number`, and structs that std140, std430 and Rust lay out alike.

use std::fmt::Write as _;

/// GLSL's type, Rust's, and GLSL's alignment and size in bytes. Rust's alignment divides GLSL's, so where no member leaves
/// a gap by GLSL's rules, none does by Rust's.
const TYPES: &[(&str, &str, usize, usize)] = &[
    ("float", "f32", 4, 4),
    ("uint", "u32", 4, 4),
    ("vec2", "glam::Vec2", 8, 8),
    ("vec3", "glam::Vec3", 16, 12),
    ("vec4", "glam::Vec4", 16, 16),
    ("uvec4", "glam::UVec4", 16, 16),
    ("mat4", "glam::Mat4", 16, 64),
];

/// A struct as far as it is read.
struct Layout {
    name: String,
    /// Where the next member goes.
    end: usize,
    /// The largest alignment of a member.
    alignment: usize,
    /// Rust that checks where members lie.
    checks: String,
}

impl Layout {
    /// A member's Rust.
    fn member(&mut self, kind: &str, name: &str, comment: &str) -> Result<String, String> {
        let Some((_, rust, alignment, size)) = TYPES.iter().find(|t| t.0 == kind) else {
            let names: Vec<&str> = TYPES.iter().map(|t| t.0).collect();
            return Err(format!("{kind} may be laid out in two ways; use one of {}", names.join(", ")));
        };
        if !self.end.is_multiple_of(*alignment) {
            return Err(format!(
                "{kind} {name} would begin at byte {} and leave a gap before it: {kind} is aligned to {alignment}",
                self.end.next_multiple_of(*alignment),
            ));
        }
        let owner = &self.name;
        writeln!(self.checks, "const _: () = assert!(std::mem::offset_of!({owner}, {name}) == {});", self.end).unwrap();
        self.end += size;
        self.alignment = self.alignment.max(*alignment);
        let doc = if comment.is_empty() { String::new() } else { format!("    /// {comment}\n") };
        Ok(format!("{doc}    pub {name}: {rust},\n"))
    }

    /// The rest of the struct: filled up to its alignment, as GLSL does.
    fn close(&mut self) -> String {
        let whole = self.end.next_multiple_of(self.alignment);
        let mut rust = String::new();
        if whole > self.end {
            rust = format!(
                "    /// Nothing: GLSL's rules end the struct here.\n    pub padding: [u32; {}],\n",
                (whole - self.end) / 4
            );
        }
        writeln!(self.checks, "const _: () = assert!(size_of::<{}>() == {whole});", self.name).unwrap();
        format!("{rust}}}\n{}", self.checks)
    }
}

/// The Rust source, or "line: what is wrong".
pub fn to_rust(glsl: &str) -> Result<String, String> {
    let mut rust = String::new();
    let mut open: Option<Layout> = None;
    for (number, line) in (1..).zip(glsl.lines()) {
        let (code, comment) = line.split_once("//").unwrap_or((line, ""));
        let words: Vec<&str> = code.trim().trim_end_matches(';').split_whitespace().collect();
        match (words.as_slice(), &mut open) {
            ([], _) => {}
            (["#define", name, value], None) => {
                let kind = if value.contains('.') { "f32" } else { "u32" };
                writeln!(rust, "#[allow(dead_code)]\npub const {name}: {kind} = {value};").unwrap();
            }
            (["struct", name, "{"], None) => {
                open = Some(Layout { name: (*name).into(), end: 0, alignment: 4, checks: String::new() });
                writeln!(rust, "/// glsl/include/shared.glsl:{number}\n#[repr(C)]").unwrap();
                writeln!(rust, "#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]").unwrap();
                writeln!(rust, "pub struct {name} {{").unwrap();
            }
            (["}"], Some(layout)) => {
                rust += &layout.close();
                open = None;
            }
            ([kind, name], Some(layout)) if name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') => {
                rust += &layout.member(kind, name, comment.trim()).map_err(|e| format!("{number}: error: {e}"))?;
            }
            _ => return Err(format!("{number}: error: build.rs does not understand this line")),
        }
    }
    Ok(rust)
}
