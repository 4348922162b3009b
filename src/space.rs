//! The space that shaders work in: lengths in particle radii, measured from one of the particles. So the same liquid is
//! the same numbers at whatever scale and place, and no threshold, square or far-away value of a shader meets the ends of
//! float32.

use crate::{
    particles::{Ellipsoid, Particles},
    shader::Particle,
};
use glam::{DMat3, DVec3, Mat4, Vec3, Vec4};

/// Particle radii, in world units, that float32 positions have room around: coordinates to a millionth of such a radius and
/// to a million of them are normal numbers, which no device rounds to zero.
pub const RADII: std::ops::RangeInclusive<f32> = 1e-31..=1e31;

/// Where the liquid's own space lies in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    /// World position of its origin: a particle's, where the middle of the box could be far from all liquid, because of a
    /// single stray.
    pub origin: DVec3,
    /// World length of its unit: the particle radius r.
    pub radius: f64,
}

impl Space {
    /// Of a liquid with this particle radius, around a point in the world.
    pub fn new(radius: f32, origin: Vec3) -> Space {
        Space { origin: origin.as_dvec3(), radius: f64::from(radius) }
    }

    /// Around the particle in the middle of the body, or of the splashes where there is no body.
    pub fn of(particles: &Particles) -> Space {
        let body = particles.ellipsoids.get(particles.splash_count..).unwrap_or_default();
        let most = if body.is_empty() { &particles.ellipsoids } else { body };
        Space::new(particles.radius, most.get(most.len() / 2).map_or(Vec3::ZERO, |e| e.center))
    }

    #[cfg(feature = "inspect")]
    /// Of particles that the device prepared, from the words of the buffer "extent".
    pub fn prepared(radius: f32, extent: &[u32]) -> Space {
        let scale = f64::from(power_of_two(radius));
        let at = |axis: u32| f64::from(f32::from_bits(extent[(crate::shader::EXTENT_ORIGIN + axis) as usize])) / scale;
        Space { origin: DVec3::new(at(0), at(1), at(2)), radius: f64::from(radius) }
    }

    /// A world position, in this space.
    pub fn local(&self, position: Vec3) -> Vec3 {
        ((position.as_dvec3() - self.origin) / self.radius).as_vec3()
    }

    /// A position of this space, in the world.
    #[cfg(feature = "inspect")]
    pub fn world(&self, local: Vec3) -> Vec3 {
        (local.as_dvec3() * self.radius + self.origin).as_vec3()
    }

    /// World to eye, rewritten as this space to an eye space of the same unit.
    pub fn view(&self, view: Mat4) -> Mat4 {
        let (turn, shift) = (DMat3::from_mat4(view.as_dmat4()), view.w_axis.truncate().as_dvec3());
        let shift = (turn * self.origin + shift) / self.radius;
        Mat4 { w_axis: shift.as_vec3().extend(1.0), ..view }
    }

    /// A particle as shaders read it.
    pub fn pack(&self, e: &Ellipsoid) -> Particle {
        let axes = e.axes.as_dmat3() * self.radius.recip();
        let s = (axes * axes.transpose()).as_mat3();
        Particle {
            center: self.local(e.center).extend(0.0),
            shape_diagonal: Vec4::new(s.x_axis.x, s.y_axis.y, s.z_axis.z, 0.0),
            shape_mixed: Vec4::new(s.y_axis.x, s.z_axis.x, s.z_axis.y, 0.0),
        }
    }
}

/// The power of two that brings a radius into 1..2. Multiplying by it rounds nothing, so distances compare as they did.
pub(crate) fn power_of_two(radius: f32) -> f32 {
    f32::from_bits((254 - (radius.to_bits() >> 23)) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_come_to_lie_between_one_and_two() {
        for radius in [1.0, 1.999, 0.75, 3e-38, 1.2e-38, 1e-20, 1e20, 8e37, 0.01f32] {
            let scaled = radius * power_of_two(radius);
            assert!((1.0..2.0).contains(&scaled), "{radius}: {scaled}");
            assert_eq!(scaled / power_of_two(radius), radius);
        }
    }
}
