//! The interface as C programs see it: its header, its library installed, an engine on every driver.

mod allocator;
mod drivers;
mod engine;
mod header;
mod install;
mod misuse;
