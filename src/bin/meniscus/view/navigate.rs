//! Moving the eye: around the target, along the picture, nearer, and freely.

use crate::camera::View;
use glam::{DQuat, DVec2, DVec3};

/// How near straight up or down an orbit goes.
const STEEPEST: f64 = 0.01;
/// What a notch of the wheel leaves of the distance to the target.
const NOTCH: f64 = 0.85;

/// Eye and target of a view with nothing left open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Navigator {
    pub eye: DVec3,
    pub target: DVec3,
    /// Of length 1.
    up: DVec3,
    fov_y: f64,
    /// The eye comes no nearer to its target by the wheel: then the target goes on before it.
    nearest: f64,
}

impl Navigator {
    /// `view` says eye and target; `radius` is the particles'.
    pub fn new(view: &View, radius: f64) -> Navigator {
        let target = view.target.unwrap_or_default();
        let eye = view.eye.unwrap_or(target + DVec3::Z);
        Navigator {
            eye,
            target,
            up: view.up.normalize(),
            fov_y: f64::from(view.fov_y).to_radians(),
            nearest: 4.0 * radius,
        }
    }

    /// The view that it came from, from here.
    pub fn apply(&self, view: &mut View) {
        if (view.eye, view.target) != (Some(self.eye), Some(self.target)) {
            view.upright = None; // where another camera was
        }
        (view.eye, view.target) = (Some(self.eye), Some(self.target));
    }

    fn distance(&self) -> f64 {
        (self.target - self.eye).length()
    }

    fn forward(&self) -> DVec3 {
        (self.target - self.eye).normalize_or(DVec3::NEG_Z)
    }

    fn right(&self) -> DVec3 {
        let right = self.forward().cross(self.up);
        if right.length() < 1e-3 { self.forward().any_orthonormal_vector() } else { right.normalize() }
    }

    /// A direction turned by a drag of so many radians; never over the poles.
    fn turned(&self, direction: DVec3, drag: DVec2) -> DVec3 {
        let right = self.right();
        let polar = direction.angle_between(self.up);
        // Positive turns go from right × direction towards it: up, if right and direction are the camera's.
        let (least, most) = (STEEPEST, std::f64::consts::PI - STEEPEST);
        let tilt = polar - (polar - drag.y).clamp(least, most);
        let axis = if self.forward().dot(direction) > 0.0 { right } else { -right };
        DQuat::from_axis_angle(self.up, -drag.x) * (DQuat::from_axis_angle(axis, tilt) * direction)
    }

    /// Around the target, by a drag in heights of the picture (right and down): what is in front follows it.
    pub fn orbit(&mut self, drag: DVec2) {
        let away = self.turned(-self.forward(), std::f64::consts::PI * drag);
        self.eye = self.target + self.distance() * away;
    }

    /// Looks elsewhere from the same place: the picture follows the drag.
    pub fn look(&mut self, drag: DVec2) {
        let forward = self.turned(self.forward(), self.fov_y * DVec2::new(-drag.x, drag.y));
        self.target = self.eye + self.distance() * forward;
    }

    /// Eye and target along the picture: what is at the target's distance follows the drag.
    pub fn pan(&mut self, drag: DVec2) {
        let height = 2.0 * self.distance() * (0.5 * self.fov_y).tan();
        let right = self.right();
        let shift = height * (drag.y * right.cross(self.forward()) - drag.x * right);
        self.eye += shift;
        self.target += shift;
    }

    /// Nearer by notches of the wheel, or farther. Near its target the eye takes it along, so that it flies through surfaces.
    pub fn zoom(&mut self, notches: f64) {
        let (forward, distance) = (self.forward(), self.distance());
        let left = distance * NOTCH.powf(notches);
        self.eye += forward
            * if notches > 0.0 { (distance - left).max(0.25 * self.nearest * notches) } else { distance - left };
        if (self.target - self.eye).dot(forward) < self.nearest {
            self.target = self.eye + forward * self.nearest;
        }
    }

    /// Eye and target together: right, up and forward, in distances to the target.
    pub fn fly(&mut self, by: DVec3) {
        let (right, forward) = (self.right(), self.forward());
        let step = self.distance().max(self.nearest) * (by.x * right + by.y * self.up + by.z * forward);
        self.eye += step;
        self.target += step;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start() -> Navigator {
        let view = View { eye: Some(DVec3::new(0.0, 0.0, 5.0)), target: Some(DVec3::ZERO), ..View::default() };
        Navigator::new(&view, 0.1)
    }

    /// A point in the coordinates of the picture: right, up, depth.
    fn seen(n: &Navigator, p: DVec3) -> DVec3 {
        let p = p - n.eye;
        let right = n.right();
        DVec3::new(p.dot(right), p.dot(right.cross(n.forward())), p.dot(n.forward()))
    }

    #[test]
    fn an_orbit_keeps_distance_and_target_and_moves_what_is_in_front_with_the_drag() {
        let (before, mut n) = (start(), start());
        n.orbit(DVec2::new(0.1, 0.05));
        assert_eq!(n.target, before.target);
        assert!((n.distance() - 5.0).abs() < 1e-9);
        let front = DVec3::new(0.0, 0.0, 1.0);
        let moved = seen(&n, front) - seen(&before, front);
        assert!(moved.x > 0.1 && moved.y < -0.05, "{moved}");
        // Straight above is never reached.
        n.orbit(DVec2::new(0.0, 10.0));
        assert!((n.right() - before.right()).length() < 1.0 && n.eye.y > 4.9, "{n:?}");
    }

    #[test]
    fn looking_turns_the_picture_with_the_drag() {
        let (before, mut n) = (start(), start());
        n.look(DVec2::new(0.1, 0.1));
        assert_eq!(n.eye, before.eye);
        let moved = seen(&n, DVec3::ZERO);
        let height = 2.0 * 5.0 * (0.5 * n.fov_y).tan();
        assert!((moved.x / height - 0.1).abs() < 0.01 && (moved.y / height + 0.1).abs() < 0.01, "{moved}");
    }

    #[test]
    fn panning_keeps_what_is_grabbed_under_the_mouse() {
        let mut n = start();
        n.pan(DVec2::new(0.25, -0.5));
        let height = 2.0 * 5.0 * (0.5 * n.fov_y).tan();
        let moved = seen(&n, DVec3::ZERO);
        assert!((moved - DVec3::new(0.25 * height, 0.5 * height, 5.0)).length() < 1e-9, "{moved}");
    }

    #[test]
    fn the_wheel_goes_nearer_and_on_through() {
        let mut n = start();
        n.zoom(1.0);
        assert!((n.distance() - 5.0 * NOTCH).abs() < 1e-9 && n.target == DVec3::ZERO);
        n.zoom(-1.0);
        assert!((n.distance() - 5.0).abs() < 1e-9);
        (0..200).for_each(|_| n.zoom(1.0));
        assert!(n.eye.z < -1.0 && n.target.z < n.eye.z, "{n:?}");
    }

    #[test]
    fn flying_moves_all_alike() {
        let mut n = start();
        n.fly(DVec3::new(0.1, 0.2, 0.3));
        assert!((n.eye - DVec3::new(0.5, 1.0, 3.5)).length() < 1e-9, "{n:?}");
        assert!((n.target - DVec3::new(0.5, 1.0, -1.5)).length() < 1e-9, "{n:?}");
    }
}
