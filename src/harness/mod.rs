//! What this crate's own tests are made of, for tests of projects that draw with it, or that use Vulkan otherwise:
//!
//! ```toml
//! [dev-dependencies]
//! meniscus = { version = "0.1", features = ["harness"] }
//! ```
//!
//! * [`each_driver`] runs a test on every Vulkan driver there is, with core and synchronization validation: any message fails the
//!   test in which it came, what is left undestroyed fails the run, and so does finding no driver. `MENISCUS_DRIVERS` says which.
//! * A [`Driver`] lends its device ([`Driver::gpu`]: [`Gpu::run`](crate::host::Gpu::run) and
//!   [`Gpu::read_back`](crate::host::Gpu::read_back) for commands of your own) and a renderer that lives through all tests;
//!   [`Driver::shoot`] draws a [`Case`] and reads everything back that the frame left: targets, buffers, counters, the picture.
//! * [`twin`](crate::twin) has every pass as plain functions on slices, to be fed with what a [`Shot`] read back.
//! * [`Reference::compare`] bounds the difference of two pictures in the mean and at the worst pixel, and says which that is;
//!   [`Goldens`] keep references in files, `MENISCUS_BLESS=1` makes them anew, and a missing one fails.
//! * [`run_tests`] is for negative controls: tests that are wrong on purpose, which another one sees fail.
//!
//! `docs/ci/lavapipe.rs` is a test of such a project, `docs/ci/lavapipe.yml` a GitHub workflow to copy: neither needs a GPU.

mod controls;
mod driver;
mod drivers;
mod golden;

pub use controls::run_tests;
pub use driver::{Case, Cloud, Driver, Shot};
pub use drivers::{SKY, each_driver, labels};
pub use golden::{Difference, Goldens, Mismatch, Reference, Tolerance};
