//! Passes on every Vulkan driver there is, against their CPU twins, with core and synchronization validation on.

mod access;
mod analytic;
mod background;
mod behind;
mod compact;
mod cull;
mod drivers;
mod extent;
mod goldens;
mod half;
mod host;
mod normals;
mod occlude;
mod plane_fit;
mod refract;
mod shape;
mod smoke;
mod smooth;
mod sort;
mod space;
mod splat;
mod spray;
mod support;
mod tiles;
