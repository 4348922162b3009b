//! Twin of `glsl/eye.comp`: the liquid's number density at the eye, by trying every particle.

use crate::{shader::Frame, space::Space};
use glam::{DMat3, DVec3, Vec3};

/// Weight of a particle so far away, in parts of the support: 1 at the centre.
fn weight(distance: f64) -> f64 {
    let cubed = |x: f64| x.max(0.0).powi(3);
    2.0 * cubed(1.0 - distance) - 8.0 * cubed(0.5 - distance)
}

/// Number density at the frame's eye, as a part of a filled body's; `support` in particle radii. Positions that are not finite count
/// for nothing.
pub fn density(frame: &Frame, space: &Space, positions: &[Vec3], support: f64) -> f64 {
    let (turn, shift) = (DMat3::from_mat4(frame.view.as_dmat4()), frame.view.w_axis.truncate().as_dvec3());
    let eye = -(turn.transpose() * shift);
    let here = positions.iter().filter(|p| p.is_finite()).map(|p| (p.as_dvec3() - space.origin) / space.radius - eye);
    let of = |offset: DVec3| weight(offset.length() / support);
    // A filled body at rest: the lattice of spacing 2, around one of its particles.
    let steps = (support / 2.0).ceil() as i32;
    let axis = || (-steps..=steps).map(|i| 2.0 * f64::from(i));
    let filled: f64 =
        axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| DVec3::new(x, y, z)))).map(of).sum();
    here.map(of).sum::<f64>() / filled
}
