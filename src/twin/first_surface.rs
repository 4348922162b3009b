//! Twin of `glsl/first_surface.frag`: the first surface that each pixel shows, of maps. That of a density field is where the field is at
//! its level, which tests ask of [`super::field_walk::Field`].

use super::{quadric::pixel_ray, upsample::Upsampled, walk::first_surface, walls::Maps};
use crate::shader::Frame;
use glam::{DVec3, Mat3};

/// The first surface at a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct First {
    /// Unit normal in the world, towards the eye's side.
    pub normal: DVec3,
    /// Linear depth in particle radii.
    pub depth: f64,
}

impl First {
    /// Of a normal in eye space, of a surface that is seen from either side.
    fn new(frame: &Frame, dir: DVec3, normal: DVec3, depth: f64) -> First {
        let normal = if dir.dot(normal) > 0.0 { -normal } else { normal };
        First { normal: Mat3::from_mat4(frame.view).as_dmat3().transpose() * normal, depth }
    }
}

/// Where walks start; `single` of those with one refraction. None where the scene hides it.
pub fn of_walks(maps: &Maps, single: bool, pixel: [usize; 2]) -> Option<First> {
    let (normal, depth) = first_surface(maps, single, pixel).filter(|(_, depth)| *depth <= maps.scene_depth(pixel))?;
    let dir = pixel_ray(maps.frame, pixel[0] as u32, pixel[1] as u32).normalize();
    Some(First::new(maps.frame, dir, normal.unwrap_or(-dir), depth))
}

/// Of maps at half resolution, as they were upsampled, before the environment alone.
pub fn of_half(frame: &Frame, front: &Upsampled, pixel: [usize; 2]) -> Option<First> {
    let dir = pixel_ray(frame, pixel[0] as u32, pixel[1] as u32).normalize();
    match front.depth {
        _ if front.coverage < 0.5 => None,
        depth if depth > 0.0 => Some(First::new(frame, dir, front.normal, depth)),
        depth if depth < 0.0 => Some(First::new(frame, dir, -dir, frame.near.into())),
        _ => None,
    }
}
