//! The C interface of meniscus: `include/meniscus.h` is made of these files, and of nothing else.
//!
//! * Every function is a `guard` around safe code: it reads what C gave, checks it, and turns errors and panics into a
//!   status and a message. Nothing unwinds into C.
//! * Structs that C fills begin with their size (`versioned`): later ones are longer, and both directions work.
//! * Choices that C gives are numbers with names, not Rust enums: any number may come.
#![deny(unsafe_op_in_unsafe_fn)]
#![warn(missing_docs, clippy::undocumented_unsafe_blocks, clippy::missing_safety_doc)]

#[cfg(panic = "abort")]
compile_error!("meniscus-capi turns panics into a status: build it with panic = \"unwind\"");

mod allocator;
mod auto;
mod camera;
mod frame;
mod host;
mod list;
mod prepare;
mod record;
mod renderer;
mod report;
mod settings;
mod status;
mod text;
mod versioned;

/// Version of this interface. It changes when a program would have to be compiled anew; structs that grow do not change it.
pub const MENISCUS_ABI_VERSION: u32 = 1;
