//! Shaders as build.rs made them, and the block layouts they share with the host (generated from
//! `glsl/include/shared.glsl`).

/// A compiled shader and the bindings it has in descriptor set 0, reflected from its SPIR-V.
#[derive(Debug)]
pub struct Shader {
    /// Source file in `glsl/`.
    pub name: &'static str,
    /// SPIR-V words.
    pub spirv: &'static [u32],
    /// Bindings of set 0, by index.
    pub bindings: &'static [Binding],
}

/// One binding of a shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Index in set 0.
    pub index: u32,
    /// Name in the shader.
    pub name: &'static str,
    /// What is bound there.
    pub kind: Kind,
}

/// Kinds of descriptors that passes use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `texture…` without a sampler.
    SampledImage,
    /// `image…`.
    StorageImage,
    /// `uniform … {}`.
    UniformBuffer,
    /// `buffer … {}`.
    StorageBuffer,
    /// `sampler`, always the same: nearest, clamped.
    Sampler,
}

impl Kind {
    pub(crate) fn descriptor_type(self) -> ash::vk::DescriptorType {
        use ash::vk::DescriptorType as T;
        match self {
            Kind::SampledImage => T::SAMPLED_IMAGE,
            Kind::StorageImage => T::STORAGE_IMAGE,
            Kind::UniformBuffer => T::UNIFORM_BUFFER,
            Kind::StorageBuffer => T::STORAGE_BUFFER,
            Kind::Sampler => T::SAMPLER,
        }
    }
}

/// Generated code; the constants are documented where they are written, in `glsl/include/shared.glsl`.
#[allow(missing_docs, clippy::unreadable_literal, clippy::excessive_precision)]
mod generated {
    use super::{Binding, Kind, Shader};
    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}
pub use generated::*;
