//! What a SPIR-V module asks of its pipeline: bindings of set 0, specialisation constants and push constants, all by name,
//! and what it writes to colour attachments.

use std::collections::{HashMap, HashSet};

pub struct Binding {
    pub index: u32,
    pub name: String,
    /// Variant of the library's `Kind`, with what it holds.
    pub kind: String,
}

#[derive(Default)]
pub struct Interface {
    pub bindings: Vec<Binding>,
    /// Id, name and type (variant of the library's `Scalar`) of each specialisation constant.
    pub constants: Vec<(u32, String, &'static str)>,
    /// Name, byte offset and type of each member of the push-constant block; the type of what is no scalar is empty.
    pub push: Vec<(String, u32, &'static str)>,
    /// Location and type of each output of a fragment shader.
    pub outputs: Vec<(u32, &'static str)>,
    /// Size of that block in bytes.
    pub push_bytes: u32,
}

// SPIR-V 1.6, section 3: the instructions, decorations and storage classes that matter here.
const OP_NAME: u32 = 5;
const OP_MEMBER_NAME: u32 = 6;
const OP_ENTRY_POINT: u32 = 15;
const OP_TYPE_BOOL: u32 = 20;
const OP_TYPE_INT: u32 = 21;
const OP_TYPE_FLOAT: u32 = 22;
const OP_TYPE_VECTOR: u32 = 23;
const OP_TYPE_MATRIX: u32 = 24;
const OP_TYPE_IMAGE: u32 = 25;
const OP_TYPE_SAMPLER: u32 = 26;
const OP_TYPE_STRUCT: u32 = 30;
const OP_TYPE_POINTER: u32 = 32;
const OP_SPEC_CONSTANT_TRUE: u32 = 48;
const OP_SPEC_CONSTANT_FALSE: u32 = 49;
const OP_SPEC_CONSTANT: u32 = 50;
const OP_SPEC_CONSTANT_COMPOSITE: u32 = 51;
const OP_VARIABLE: u32 = 59;
const OP_DECORATE: u32 = 71;
const OP_MEMBER_DECORATE: u32 = 72;
const DECORATION_SPEC_ID: u32 = 1;
const DECORATION_BUILT_IN: u32 = 11;
const DECORATION_NON_WRITABLE: u32 = 24;
const DECORATION_LOCATION: u32 = 30;
const DECORATION_BINDING: u32 = 33;
const DECORATION_SET: u32 = 34;
const DECORATION_OFFSET: u32 = 35;
const BUILT_IN_WORKGROUP_SIZE: u32 = 25;
const UNIFORM_CONSTANT: u32 = 0;
const UNIFORM: u32 = 2;
const OUTPUT: u32 = 3;
const PUSH_CONSTANT: u32 = 9;
const STORAGE_BUFFER: u32 = 12;
const DIM_CUBE: u32 = 3;
const DIM_BUFFER: u32 = 5;
const FRAGMENT: u32 = 4;

/// Image formats of storage images that passes use.
const FORMATS: [(u32, &str); 4] =
    [(1, "R32G32B32A32_SFLOAT"), (3, "R32_SFLOAT"), (6, "R32G32_SFLOAT"), (33, "R32_UINT")];

enum Type {
    /// Bytes of a float or a signed integer.
    Float(u32),
    Int,
    Uint,
    Bool,
    /// Component type or column type, and how many.
    Vector(u32, u32),
    Image(String),
    Sampler,
    Struct(Vec<u32>),
    Pointer(u32),
}

#[derive(Default)]
struct Module {
    names: HashMap<u32, String>,
    member_names: HashMap<(u32, u32), String>,
    member_offsets: HashMap<(u32, u32), u32>,
    types: HashMap<u32, Type>,
}

pub fn interface(words: &[u32]) -> Result<Interface, String> {
    let mut m = Module::default();
    let (mut binding_of, mut spec_of, mut location_of) = (HashMap::new(), HashMap::new(), HashMap::new());
    let (mut typed, mut fragment, mut readonly) = (HashMap::new(), false, HashSet::new());
    let (mut variables, mut group_size, mut composites) = (Vec::new(), None, HashMap::new());
    let mut at = 5; // past the header
    while at < words.len() {
        let (count, op) = ((words[at] >> 16) as usize, words[at] & 0xffff);
        let args = words.get(at + 1..at + count).ok_or("SPIR-V ends inside an instruction")?;
        match op {
            OP_NAME => drop(m.names.insert(args[0], text(&args[1..]))),
            OP_MEMBER_NAME => drop(m.member_names.insert((args[0], args[1]), text(&args[2..]))),
            OP_ENTRY_POINT => fragment = args[0] == FRAGMENT,
            OP_DECORATE if args[1] == DECORATION_LOCATION => drop(location_of.insert(args[0], args[2])),
            OP_DECORATE if args[1] == DECORATION_NON_WRITABLE => {
                readonly.insert(args[0]);
            }
            OP_DECORATE if args[1] == DECORATION_BINDING => drop(binding_of.insert(args[0], args[2])),
            OP_DECORATE if args[1] == DECORATION_SPEC_ID => drop(spec_of.insert(args[0], args[2])),
            OP_DECORATE if args[1] == DECORATION_BUILT_IN && args[2] == BUILT_IN_WORKGROUP_SIZE => {
                group_size = Some(args[0]);
            }
            OP_DECORATE if args[1] == DECORATION_SET && args[2] != 0 => {
                return Err(format!("descriptor set {}; passes use set 0 only", args[2]));
            }
            OP_MEMBER_DECORATE if args[2] == DECORATION_OFFSET => {
                m.member_offsets.insert((args[0], args[1]), args[3]);
            }
            OP_TYPE_BOOL => drop(m.types.insert(args[0], Type::Bool)),
            OP_TYPE_INT => drop(m.types.insert(args[0], if args[2] == 0 { Type::Uint } else { Type::Int })),
            OP_TYPE_FLOAT => drop(m.types.insert(args[0], Type::Float(args[1] / 8))),
            OP_TYPE_VECTOR | OP_TYPE_MATRIX => drop(m.types.insert(args[0], Type::Vector(args[1], args[2]))),
            OP_TYPE_IMAGE if args[2] == DIM_BUFFER => {
                let known = args[6] != 2 && matches!(m.types.get(&args[1]), Some(Type::Uint));
                m.types.insert(args[0], Type::Image(if known { "TexelBuffer" } else { "" }.into()));
            }
            OP_TYPE_IMAGE => {
                let uint = matches!(m.types.get(&args[1]), Some(Type::Uint));
                let (kind, cube) = (if args[6] == 2 { "StorageImage" } else { "SampledImage" }, args[2] == DIM_CUBE);
                let texels = format!("Texels {{ uint: {uint}, array: {}, cube: {cube} }}", args[4] == 1);
                let format = match FORMATS.iter().find(|f| f.0 == args[7]) {
                    Some((_, name)) => format!(", ash::vk::Format::{name}"),
                    None if kind == "StorageImage" => {
                        return Err(format!("storage images of format {} are not known", args[7]));
                    }
                    None => String::new(),
                };
                m.types.insert(args[0], Type::Image(format!("{kind}({texels}{format})")));
            }
            OP_TYPE_SAMPLER => drop(m.types.insert(args[0], Type::Sampler)),
            OP_TYPE_STRUCT => drop(m.types.insert(args[0], Type::Struct(args[1..].to_vec()))),
            OP_TYPE_POINTER => drop(m.types.insert(args[0], Type::Pointer(args[2]))),
            OP_SPEC_CONSTANT_TRUE | OP_SPEC_CONSTANT_FALSE | OP_SPEC_CONSTANT => drop(typed.insert(args[1], args[0])),
            OP_SPEC_CONSTANT_COMPOSITE => drop(composites.insert(args[1], args[2..].to_vec())),
            OP_VARIABLE => variables.push((args[0], args[1], args[2])),
            _ => {}
        }
        at += count.max(1);
    }
    // Edges of work groups are constants without a name.
    let edges = group_size.and_then(|id| composites.get(&id)).into_iter().flatten();
    for (id, axis) in edges.zip(["x", "y", "z"]) {
        let unnamed = m.names.get(id).is_none_or(String::is_empty);
        if unnamed && spec_of.contains_key(id) {
            m.names.insert(*id, format!("local_size_{axis}"));
        }
    }
    let mut found = Interface::default();
    for (id, spec) in spec_of {
        let of = typed.get(&id).map_or("", |of| m.scalar(*of));
        found.constants.push((spec, m.names.get(&id).cloned().unwrap_or_default(), of));
    }
    for (pointer, variable, storage) in variables {
        let Some(Type::Pointer(pointee)) = m.types.get(&pointer) else { continue };
        if storage == PUSH_CONSTANT {
            found.push_bytes = m.bytes(*pointee);
            found.push = m.members(*pointee);
        }
        if let Some(location) = location_of.get(&variable).filter(|_| fragment && storage == OUTPUT) {
            found.outputs.push((*location, m.component(*pointee)));
        }
        let Some(&index) = binding_of.get(&variable) else { continue };
        let kind = match (storage, m.types.get(pointee)) {
            (UNIFORM, _) => format!("UniformBuffer({})", m.bytes(*pointee)),
            (STORAGE_BUFFER, _) => "StorageBuffer".into(),
            (UNIFORM_CONSTANT, Some(Type::Image(kind))) => {
                if kind.is_empty() {
                    return Err(format!("binding {index}: of texel buffers only utextureBuffer is known"));
                }
                if fragment && kind.starts_with("StorageImage") && !readonly.contains(&variable) {
                    return Err(format!("binding {index}: a fragment shader's storage images are readonly"));
                }
                kind.clone()
            }
            (UNIFORM_CONSTANT, Some(Type::Sampler)) => "Sampler".into(),
            _ => return Err(format!("binding {index} has a type or a storage class that no pass uses")),
        };
        // A block without a name of its own goes by its only member's.
        let name = m.names.get(&variable).filter(|n| !n.is_empty()).cloned();
        let name = name.or_else(|| m.member_names.get(&(*pointee, 0)).cloned()).unwrap_or_default();
        found.bindings.push(Binding { index, name, kind });
    }
    found.bindings.sort_by_key(|b| b.index);
    found.constants.sort();
    found.outputs.sort();
    Ok(found)
}

fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|b| *b != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

impl Module {
    /// Size of a type as far as it is fixed, std140 and std430 alike.
    fn bytes(&self, id: u32) -> u32 {
        match self.types.get(&id) {
            Some(Type::Float(bytes)) => *bytes,
            Some(Type::Int | Type::Uint) => 4,
            // Columns of a matrix are four floats here.
            Some(Type::Vector(of, count)) => count * self.bytes(*of),
            Some(Type::Struct(members)) => {
                let ends = (0u32..).zip(members);
                ends.map(|(i, of)| self.member_offsets.get(&(id, i)).unwrap_or(&0) + self.bytes(*of)).max().unwrap_or(0)
            }
            _ => 0,
        }
    }

    fn members(&self, id: u32) -> Vec<(String, u32, &'static str)> {
        let Some(Type::Struct(members)) = self.types.get(&id) else { return Vec::new() };
        let name = |i| self.member_names.get(&(id, i)).cloned().unwrap_or_default();
        let offset = |i| self.member_offsets.get(&(id, i)).copied().unwrap_or(0);
        (0u32..).zip(members).map(|(i, of)| (name(i), offset(i), self.scalar(*of))).collect()
    }

    /// The library's name of a scalar type; empty for any other.
    fn scalar(&self, id: u32) -> &'static str {
        match self.types.get(&id) {
            Some(Type::Float(4)) => "Float",
            Some(Type::Int) => "Int",
            Some(Type::Uint) => "Uint",
            Some(Type::Bool) => "Bool",
            _ => "",
        }
    }

    /// The same of a vector's components.
    fn component(&self, id: u32) -> &'static str {
        match self.types.get(&id) {
            Some(Type::Vector(of, _)) => self.scalar(*of),
            _ => self.scalar(id),
        }
    }
}
