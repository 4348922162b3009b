//! Particle files and images.
pub mod budget;
pub(crate) mod guard;
pub mod images;
pub mod particles;
pub mod quote;

pub use budget::Budget;
