//! Particles as they are drawn.

use crate::shader::FIELD_JOINS;
use glam::{DVec3, Mat3, Vec3};

/// Which of the two kinds of liquid a particle belongs to (Imai16 §4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Class {
    /// An isolated droplet, never smoothed: [`crate::prepare`] makes it a ball of 1.24 particle radii, whose volume is that of
    /// a particle, (2 r)³.
    Splash = 0,
    /// Part of the liquid body: drawn as an ellipsoid, its surface smoothed.
    Body = 1,
}

/// A particle as drawn, in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Centre.
    pub center: Vec3,
    /// The three semi-axis vectors, as columns.
    pub axes: Mat3,
}

/// A particle as a density field takes it ([`crate::layers::field`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Where it is, in world units.
    pub position: Vec3,
    /// Its number density, as a part of a filled body's.
    pub density: f32,
    /// A splash of less than 0.35 of a filled body's density is a ball beside the field ([`Point::is_ball`]).
    pub class: Class,
}

impl Point {
    /// Whether it is a ball beside the field, and adds nothing to it.
    pub fn is_ball(&self) -> bool {
        self.class == Class::Splash && self.density < FIELD_JOINS
    }

    /// Its density as the device has it: negative for a ball.
    pub fn signed_density(&self) -> f32 {
        if self.is_ball() { -self.density } else { self.density }
    }
}

/// Everything a frame draws: splash particles first, then the body's, each in canonical order
/// ([`crate::prepare::prepare`] makes it so), which makes the image independent of the order of the input.
#[derive(Clone, Debug, PartialEq)]
pub struct Particles {
    /// Particle radius r: half the rest spacing.
    pub radius: f32,
    /// Splash, then body.
    ///
    /// A splash may be any ellipsoid. Its outline, its front and, straight on along the view ray, its back are drawn as given; but
    /// a ray bent at a pixel goes on in a ball: the one that has the front's normal there and the view ray's chord. Of a ball
    /// that is the ball itself. Where the near plane cuts a splash, only its back is known, and the ball that is taken has
    /// 1.24 particle radii, whatever was given.
    pub ellipsoids: Vec<Ellipsoid>,
    /// How many of them are splash.
    pub splash_count: usize,
}

impl Particles {
    /// How many belong to the body.
    pub fn body_count(&self) -> usize {
        self.ellipsoids.len().saturating_sub(self.splash_count)
    }

    /// World-space box around every ellipsoid: (smallest, largest) corner; `None` without particles.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.ellipsoids
            .iter()
            .map(|e| {
                // The support of A u over |u| = 1 along each axis is the length of A's row.
                let t = e.axes.as_dmat3().transpose();
                let reach = DVec3::new(t.x_axis.length(), t.y_axis.length(), t.z_axis.length()).as_vec3();
                (e.center - reach, e.center + reach)
            })
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }
}
