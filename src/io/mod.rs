//! Particle files and images.
pub mod images;
pub mod particles;
