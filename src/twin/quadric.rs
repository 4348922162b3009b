//! Twin of `glsl/include/quadric.glsl` and `frame.glsl`: what the particle passes share, in double precision.
//!
//! Ray casts are made where the ellipsoid is a unit sphere at the origin (Sigg06 §3), and bounds come from the planes
//! that touch it, n·S n = (n·c)² (Sigg06 §4, dual quadric). The shader works from the centre outwards instead.

use crate::shader::{Frame, Particle};
use glam::{DMat3, DVec2, DVec3};

/// What the shader widens a rectangle by, in pixels.
pub const PAD: f64 = 0.01;

/// A particle's ellipsoid in eye space.
#[derive(Clone, Copy, Debug)]
pub struct Quadric {
    /// Centre.
    pub center: DVec3,
    /// S = A Aᵀ, A's columns the semi-axes.
    pub shape: DMat3,
    /// Inverse of S's lower triangular root: brings the ellipsoid, seen from its centre, to the unit sphere.
    pub to_unit: DMat3,
}

/// Where a ray x = v d meets an ellipsoid.
#[derive(Clone, Copy, Debug)]
pub struct Cast {
    /// Depth at which it enters and leaves; not numbers if it misses.
    pub depths: [f64; 2],
    /// How near it comes to the centre, in the unit-sphere frame: 1 on the silhouette.
    pub approach: f64,
}

/// Direction (vx, vy, -1) of the ray through a pixel's centre.
pub fn pixel_ray(frame: &Frame, x: u32, y: u32) -> DVec3 {
    let (a, b) = scale_offset(frame);
    ((DVec2::new(f64::from(x), f64::from(y)) + 0.5 - b) / a).extend(-1.0)
}

/// Pixels per unit of x/d along each axis (signed), and the pixel where x/d = 0.
pub fn scale_offset(frame: &Frame) -> (DVec2, DVec2) {
    (frame.pixel_scale.as_dvec2(), frame.pixel_origin.as_dvec2())
}

/// Width and height in pixels, and the near plane.
pub fn viewport(frame: &Frame) -> (u32, u32, f64) {
    (frame.size.x as u32, frame.size.y as u32, f64::from(frame.near))
}

/// Inverse of the lower triangular L with L Lᵀ = S (Cholesky).
fn inverse_root(s: &DMat3) -> DMat3 {
    let l00 = s.x_axis.x.sqrt();
    let (l10, l20) = (s.x_axis.y / l00, s.x_axis.z / l00);
    let l11 = (s.y_axis.y - l10 * l10).sqrt();
    let l21 = (s.y_axis.z - l20 * l10) / l11;
    let l22 = (s.z_axis.z - l20 * l20 - l21 * l21).sqrt();
    DMat3::from_cols(DVec3::new(l00, l10, l20), DVec3::new(0.0, l11, l21), DVec3::new(0.0, 0.0, l22)).inverse()
}

impl Quadric {
    /// A particle as this frame's camera sees it.
    pub fn new(frame: &Frame, particle: &Particle) -> Quadric {
        let view = frame.view.as_dmat4();
        let rotation = DMat3::from_mat4(view);
        let (d, m) = (particle.shape_diagonal.as_dvec4(), particle.shape_mixed.as_dvec4());
        let s = DMat3::from_cols(DVec3::new(d.x, m.x, m.y), DVec3::new(m.x, d.y, m.z), DVec3::new(m.y, m.z, d.z));
        let shape = rotation * s * rotation.transpose();
        let center = view.transform_point3(particle.center.as_dvec4().truncate());
        Quadric { center, shape, to_unit: inverse_root(&shape) }
    }

    /// Nearest and farthest depth of the whole ellipsoid.
    pub fn reach(&self) -> [f64; 2] {
        let half = self.shape.z_axis.z.sqrt();
        [-self.center.z - half, -self.center.z + half]
    }

    /// Casts the ray x = `v` d: |o + d w|² = 1 in the unit-sphere frame, o the eye and w the ray there.
    pub fn cast(&self, v: DVec3) -> Cast {
        let (o, w) = (self.to_unit * -self.center, self.to_unit * v);
        let middle = -o.dot(w) / w.length_squared();
        let approach = (o + middle * w).length();
        let half = (1.0 - approach * approach).sqrt() / w.length();
        Cast { depths: [middle - half, middle + half], approach }
    }

    /// Depths at which the ray x = `v` d enters and leaves an ellipsoid whose discriminant is larger by `slack` times
    /// b² + a, of a s² + 2 b s + c = 0 for the depth s behind the centre's; not numbers if it misses even so.
    pub fn cast_with_slack(&self, v: DVec3, slack: f64) -> [f64; 2] {
        let depth = -self.center.z;
        let (w, u) = (self.to_unit * v, self.to_unit * (v * depth - self.center));
        let (a, b, c) = (w.length_squared(), u.dot(w), u.length_squared() - 1.0);
        let root = (b * b - a * c + slack * (b * b + a)).sqrt();
        [depth - (b + root) / a, depth + (root - b) / a]
    }

    /// Outward unit normal at a point of the surface: the gradient of |L⁻¹ (x - c)|².
    pub fn normal(&self, x: DVec3) -> DVec3 {
        (self.to_unit.transpose() * (self.to_unit * (x - self.center))).normalize()
    }

    /// Interval of x/d along one lateral axis between the two planes through the eye that touch the ellipsoid. With
    /// the plane's normal n = e + v e_z, (n·c)² = n·S n is quadratic in v.
    fn tangents(&self, axis: usize) -> [f64; 2] {
        let (c, z, s) = (self.center[axis], self.center.z, &self.shape);
        let a = z * z - s.z_axis.z;
        let b = c * z - s.z_axis[axis];
        let root = (b * b - a * (c * c - s.col(axis)[axis])).sqrt();
        [(-b - root) / a, (-b + root) / a]
    }

    /// Interval of x/d of the ellipsoid's bounding box beyond the near plane, for one that crosses that plane.
    fn crossing(&self, axis: usize, near: f64) -> [f64; 2] {
        let half = self.shape.col(axis)[axis].sqrt();
        let far = self.reach()[1];
        let corners = [-half, half].map(|h| [near, far].map(|d| (self.center[axis] + h) / d));
        [corners[0][0].min(corners[0][1]), corners[1][0].max(corners[1][1])]
    }

    /// Rectangle of pixel positions (lowest, highest corner) around what is seen, widened by `pad` and clipped to the
    /// viewport; `None` if nothing lies beyond the near plane. It may still be empty.
    pub fn rectangle(&self, frame: &Frame, pad: f64) -> Option<[DVec2; 2]> {
        let (width, height, near) = viewport(frame);
        let [nearest, farthest] = self.reach();
        if farthest <= near {
            return None;
        }
        let [x, y] = [0, 1].map(|axis| if nearest > near { self.tangents(axis) } else { self.crossing(axis, near) });
        let (a, b) = scale_offset(frame);
        let (p, q) = (a * DVec2::new(x[0], y[0]) + b, a * DVec2::new(x[1], y[1]) + b);
        let size = DVec2::new(f64::from(width), f64::from(height));
        Some([(p.min(q) - pad).max(DVec2::ZERO), (p.max(q) + pad).min(size)])
    }
}

/// First and last column and row whose pixel centres lie in a rectangle; `None` if there are none.
pub fn pixels_in(rectangle: [DVec2; 2]) -> Option<[[u32; 2]; 2]> {
    let (lo, hi) = ((rectangle[0] - 0.5).ceil(), (rectangle[1] - 0.5).floor());
    (lo.x <= hi.x && lo.y <= hi.y).then_some([[lo.x as u32, hi.x as u32], [lo.y as u32, hi.y as u32]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Camera, Ellipsoid, Settings, space::Space};
    use glam::{Mat3, Vec3};

    /// The rectangle holds every pixel that a ray cast finds, and a pixel less on any side would not.
    #[test]
    fn rectangles_hold_what_rays_meet_and_little_more() {
        let size = [96, 80];
        let camera = Camera::look_at(Vec3::new(0.2, 0.1, 2.0), Vec3::ZERO, Vec3::Y, 1.2, 1.2, 0.1);
        let space = Space::new(0.3, Vec3::ZERO);
        let frame = camera.uniforms(&Settings::default(), size, &space, (Vec3::splat(-1.0), Vec3::ONE));
        let mut tight = 0;
        for i in 0..60 {
            let t = i as f32;
            let thin = if i % 2 == 0 { 0.05 } else { 0.5 };
            let axes = Vec3::new(1.0, thin + 0.5 * (0.7 * t).sin().abs(), thin + 0.5 * (0.3 * t).cos().abs());
            let turn = Mat3::from_axis_angle(Vec3::new(t.sin(), t.cos(), 0.5).normalize(), 0.9 * t);
            let center = Vec3::new(1.3 * (1.1 * t).sin(), 1.1 * (2.3 * t).cos(), 0.9 * (1.7 * t).sin());
            let q =
                Quadric::new(&frame, &space.pack(&Ellipsoid { center, axes: turn * Mat3::from_diagonal(0.3 * axes) }));
            let hit = |x, y| {
                let cast = q.cast(pixel_ray(&frame, x, y));
                cast.depths[1] >= viewport(&frame).2
            };
            let seen: Vec<_> = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y])).collect();
            let seen: Vec<_> = seen.into_iter().filter(|p| hit(p[0], p[1])).collect();
            let Some(found) = q.rectangle(&frame, PAD).and_then(pixels_in) else {
                assert!(seen.is_empty(), "{i}");
                continue;
            };
            for p in &seen {
                assert!((0..2).all(|a| (found[a][0]..=found[a][1]).contains(&p[a])), "{i} {p:?} {found:?}");
            }
            // A touching plane leaves less than a pixel beside round ones; the tip of a thin one may hide between centres.
            let inside = found[0][0] > 0 && found[1][0] > 0 && found[0][1] < size[0] - 1 && found[1][1] < size[1] - 1;
            if inside && i % 2 == 1 {
                tight += 1;
                for a in 0..2 {
                    let (lo, hi) = (seen.iter().map(|p| p[a]).min(), seen.iter().map(|p| p[a]).max());
                    assert!(lo.unwrap() <= found[a][0] + 2 && hi.unwrap() + 2 >= found[a][1], "{i} {found:?}");
                }
            }
        }
        assert!(tight > 5, "{tight}");
    }
}
