//! Shaders as build.rs made them, and the block layouts they share with the host (generated from
//! `glsl/include/shared.glsl`).

/// A compiled shader and what it asks of its pipeline, reflected from its SPIR-V.
#[derive(Debug)]
pub struct Shader {
    /// Source file in `glsl/`, and the macros it was compiled with.
    pub name: &'static str,
    /// SPIR-V words.
    pub spirv: &'static [u32],
    /// Bindings of set 0, by index.
    pub bindings: &'static [Binding],
    /// Id, name and type of each specialisation constant, four bytes all.
    pub constants: &'static [(u32, &'static str, Option<Scalar>)],
    /// Name, byte offset and type of each member of the push-constant block; `None` for what is no scalar.
    pub push: &'static [(&'static str, u32, Option<Scalar>)],
    /// Bytes of that block.
    pub push_bytes: u32,
    /// Location and type of what a fragment shader writes to each colour attachment.
    pub outputs: &'static [(u32, Option<Scalar>)],
}

/// Types of four bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // they are GLSL's
pub enum Scalar {
    Float,
    Int,
    Uint,
    Bool,
}

/// One binding of a shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Binding {
    /// Index in set 0.
    pub index: u32,
    /// Name in the shader.
    pub name: &'static str,
    /// What is bound there.
    pub kind: Kind,
}

/// Kinds of descriptors that passes use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// `texture…` without a sampler.
    SampledImage(Texels),
    /// `image…`, and the format that the shader says.
    StorageImage(Texels, ash::vk::Format),
    /// `uniform … {}` of so many bytes.
    UniformBuffer(u32),
    /// `buffer … {}`.
    StorageBuffer,
    /// `utextureBuffer`: four words a texel.
    TexelBuffer,
    /// `sampler`, always the same: nearest, clamped.
    Sampler,
}

/// What an image holds and how it is addressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Texels {
    /// Unsigned integers, not floats.
    pub uint: bool,
    /// Has layers.
    pub array: bool,
    /// A cube map.
    pub cube: bool,
}

impl Kind {
    pub(crate) fn descriptor_type(self) -> ash::vk::DescriptorType {
        use ash::vk::DescriptorType as T;
        match self {
            Kind::SampledImage(_) => T::SAMPLED_IMAGE,
            Kind::StorageImage(..) => T::STORAGE_IMAGE,
            Kind::UniformBuffer(_) => T::UNIFORM_BUFFER,
            Kind::StorageBuffer => T::STORAGE_BUFFER,
            Kind::TexelBuffer => T::UNIFORM_TEXEL_BUFFER,
            Kind::Sampler => T::SAMPLER,
        }
    }
}

/// Generated code; the constants are documented where they are written, in `glsl/include/shared.glsl`.
#[allow(missing_docs, clippy::unreadable_literal, clippy::excessive_precision)]
mod generated {
    use super::{Binding, Kind, Scalar, Shader, Texels};
    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}
pub use generated::*;

// By address: every shader is one static.
impl PartialEq for Shader {
    fn eq(&self, other: &Shader) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Eq for Shader {}

impl std::hash::Hash for Shader {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        std::ptr::from_ref(self).hash(state);
    }
}
