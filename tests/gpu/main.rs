//! Passes on every Vulkan driver there is, against their CPU twins, with core and synchronization validation on.

mod host;
mod smoke;
mod support;
