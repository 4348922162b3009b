//! The bindings of set 0 in a SPIR-V module: just enough reflection to lay out descriptor sets from the shader itself.

use std::collections::HashMap;

pub struct Binding {
    pub index: u32,
    pub name: String,
    /// Variant of the library's `Kind`.
    pub kind: &'static str,
}

// SPIR-V 1.6, section 3: the instructions, decorations and storage classes that matter here.
const OP_NAME: u32 = 5;
const OP_MEMBER_NAME: u32 = 6;
const OP_TYPE_IMAGE: u32 = 25;
const OP_TYPE_SAMPLER: u32 = 26;
const OP_TYPE_POINTER: u32 = 32;
const OP_VARIABLE: u32 = 59;
const OP_DECORATE: u32 = 71;
const DECORATION_BINDING: u32 = 33;
const DECORATION_SET: u32 = 34;
const UNIFORM_CONSTANT: u32 = 0;
const UNIFORM: u32 = 2;
const STORAGE_BUFFER: u32 = 12;

pub fn bindings(words: &[u32]) -> Result<Vec<Binding>, String> {
    let mut names = HashMap::new();
    let mut first_members = HashMap::new();
    let mut binding_of = HashMap::new();
    let mut kind_of = HashMap::new();
    let mut pointee = HashMap::new();
    let mut variables = Vec::new();
    let mut at = 5; // past the header
    while at < words.len() {
        let (count, op) = ((words[at] >> 16) as usize, words[at] & 0xffff);
        let args = words.get(at + 1..at + count).ok_or("SPIR-V ends inside an instruction")?;
        match op {
            OP_NAME => {
                names.insert(args[0], text(&args[1..]));
            }
            OP_MEMBER_NAME if args[1] == 0 => {
                first_members.insert(args[0], text(&args[2..]));
            }
            OP_DECORATE if args[1] == DECORATION_BINDING => {
                binding_of.insert(args[0], args[2]);
            }
            OP_DECORATE if args[1] == DECORATION_SET && args[2] != 0 => {
                return Err(format!("descriptor set {}; passes use set 0 only", args[2]));
            }
            OP_TYPE_IMAGE => {
                kind_of.insert(args[0], if args[6] == 2 { "StorageImage" } else { "SampledImage" });
            }
            OP_TYPE_SAMPLER => {
                kind_of.insert(args[0], "Sampler");
            }
            OP_TYPE_POINTER => {
                pointee.insert(args[0], args[2]);
            }
            OP_VARIABLE => variables.push((args[0], args[1], args[2])),
            _ => {}
        }
        at += count.max(1);
    }
    let mut found = Vec::new();
    for (pointer, variable, storage) in variables {
        let Some(&index) = binding_of.get(&variable) else { continue };
        let kind = match storage {
            UNIFORM => "UniformBuffer",
            STORAGE_BUFFER => "StorageBuffer",
            UNIFORM_CONSTANT => {
                *kind_of.get(&pointee[&pointer]).ok_or(format!("binding {index} has a type no pass uses"))?
            }
            other => return Err(format!("binding {index} has storage class {other} no pass uses")),
        };
        // A block without a name of its own is known by its member.
        let name = names.get(&variable).filter(|n| !n.is_empty()).or(first_members.get(&pointee[&pointer]));
        let name = name.cloned().unwrap_or_default();
        found.push(Binding { index, name, kind });
    }
    found.sort_by_key(|b| b.index);
    Ok(found)
}

/// A literal string of SPIR-V.
fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|b| *b != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}
