//! Where rays start, and what is infinitely far away: the conventions of `render`, in double precision.

use super::surface::Ray;
use crate::{Camera, Equirect, twin::background::env_color};
use glam::{DMat3, DMat4, DQuat, DVec2, DVec3};

/// A camera of a picture's size, and the environment around it.
pub struct View<'a> {
    /// Width and height in pixels.
    pub size: [u32; 2],
    eye: DVec3,
    /// Eye space to world.
    turn: DMat3,
    scale: DVec2,
    origin: DVec2,
    to_environment: DMat3,
    pub(super) map: &'a Equirect,
}

impl<'a> View<'a> {
    /// Of a camera that is valid ([`Camera::validate`]); `size` in pixels.
    pub fn new(camera: &Camera, size: [u32; 2], map: &'a Equirect) -> View<'a> {
        let view: DMat4 = camera.view.as_dmat4();
        // The inverse of a rotation (with or without a mirror) is its transpose, but single precision leaves it only nearly one.
        let turn = DMat3::from_mat4(view).inverse();
        let p = camera.projection.as_dmat4();
        let half = DVec2::new(f64::from(size[0]), f64::from(size[1])) * 0.5;
        let up = camera.up.as_dvec3().normalize();
        let to_up = DMat3::from_quat(DQuat::from_rotation_arc(up, DVec3::Y));
        // Where the map is turned one way, directions are looked up turned the other.
        let turned = DMat3::from_rotation_y(-f64::from(camera.environment_rotation));
        View {
            size,
            eye: -(turn * view.w_axis.truncate()),
            turn,
            // pixel = (ndc + 1) / 2 * size and ndc = P v - P02 for v = (x/d, y/d, -1)
            scale: DVec2::new(p.x_axis.x, p.y_axis.y) * half,
            origin: DVec2::new(1.0 - p.z_axis.x, 1.0 - p.z_axis.y) * half,
            to_environment: turned * to_up,
            map,
        }
    }

    /// The ray through a point of the picture: pixels from its upper left corner, pixel centres at +0.5.
    pub fn ray(&self, point: DVec2) -> Ray {
        let v = ((point - self.origin) / self.scale).extend(-1.0);
        Ray { origin: self.eye, dir: (self.turn * v).normalize() }
    }

    /// Depth along the view axis of a point in the world.
    pub fn depth(&self, point: DVec3) -> f64 {
        -(self.turn.inverse() * (point - self.eye)).z
    }

    /// Linear light from a world direction, of a map rounded as the renderer's is: what the two see differ in is not the map.
    pub fn environment(&self, dir: DVec3) -> DVec3 {
        env_color(self.map, self.to_environment * dir).as_dvec3()
    }
}
