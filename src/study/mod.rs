//! The truth of a scene, made off-line on the CPU, and measures of how far a picture is from it.
//!
//! * [`Surface`](surface::Surface)s: a closed [`mesh`] in a bounding volume hierarchy, such as [`reconstruct`] or
//!   [`isosurface`] make of particles, or [`analytic`] shapes with exact intersections.
//! * [`tracer`]: all the light that comes back along a ray, by exact Fresnel reflectance, total internal reflection and
//!   Beer–Lambert absorption. [`film`]: pictures of it, pass by pass, with their noise. [`first`]: what is met at pixel centres.
//! * [`measures`]: how far apart two pictures are. Where that comes from: [`light_model`], [`measures::surface`] and [`search`].
//!
//! Lengths are in world units and positions in the coordinates of the camera's view. Everything is computed in double
//! precision; light is linear.

pub mod analytic;
pub mod built_field;
pub mod film;
pub mod first;
pub mod front;
pub mod isosurface;
pub mod light_model;
pub mod measures;
pub mod mesh;
pub mod mesh_file;
pub mod random;
pub mod reconstruct;
pub mod search;
pub mod stress;
pub mod surface;
pub mod tracer;
pub mod view;
