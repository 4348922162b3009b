//! The narrow-range filter (`glsl/smooth/narrow_range.comp`; Truong18): over a square window, or rows, columns and a small
//! clean-up.

#[cfg(feature = "inspect")]
pub mod twin;

use super::{Filter, alternate, edge, per_pixel};
use crate::{
    layers::Body,
    parameters::{choices, parameters},
    plan::{Call, Plan, Target},
    shader::{IMAGE_GROUP, NARROW_RANGE_ALONG_COMP, NARROW_RANGE_FULL_COMP},
};

choices! {
    /// What the window is.
    pub enum Shape {
        /// Rows, columns, and a small square that cleans up after them.
        #[default]
        Separable = "separable",
        /// The whole square.
        Square = "square",
    }
}

/// Largest window.
const WIDEST: u32 = 201;

parameters! {
    /// The narrow-range filter (Truong18); what the paper leaves open is as in its authors' own program.
    pub struct NarrowRange {
        /// What the window is
        shape: Shape = Shape::Separable, "", "separable (rows, columns, clean-up) or square" => |_| true;
        /// Pixels to either side; the authors' program has a filter size of 5, by 0.1
        kernel: f32 = 0.5, "projected particle radii", "a finite value of at least 0"
            => |k| k.is_finite() && *k >= 0.0;
        /// Largest edge of the window
        window: u32 = WIDEST, "pixels", "an odd number from 3 to 201" => |w| w % 2 == 1 && (3..=WIDEST).contains(w),
            enlarged |all, times| edge(all.window, times, Some(WIDEST));
        /// How far beyond what is already in range a depth may lie; the authors' program has 10.5
        threshold: f32 = 10.0, "particle radii", "a finite value above 0" => |t| t.is_finite() && *t > 0.0;
        /// How far behind the pixel what is too far counts (Truong18: mu = r)
        clamp: f32 = 1.0, "particle radii", "a finite value of at least 0" => |c| c.is_finite() && *c >= 0.0;
        /// Whether no surface counts as too far (so Truong18), or not at all (ours)
        empty_far: bool = false, "", "true or false" => |_| true;
        /// How often it is applied
        iterations: u32 = 3, "", "0 to 20" => |n| *n <= 20;
    }
}

/// Pixels to either side of the clean-up.
const CLEAN_UP: u32 = 4;

impl NarrowRange {
    /// Times that depths go through a shader in one iteration: rows, columns, clean-up; or the square.
    fn steps_each(&self) -> u32 {
        if self.shape == Shape::Separable { 3 } else { 1 }
    }
}

impl Filter for NarrowRange {
    fn record(&self, plan: &mut Plan, body: &Body) -> Target {
        let each = self.steps_each();
        alternate(plan, body, each * self.iterations, |plan, step, from, to| {
            let phase = step % each;
            let clean_up = phase == 2;
            let call = if each == 3 && !clean_up {
                Call::compute(&NARROW_RANGE_ALONG_COMP).constant("AXIS", phase)
            } else {
                Call::compute(&NARROW_RANGE_FULL_COMP)
            };
            let call = call
                .read("depth_in", from)
                .write("depth_out", to)
                .counting(&["narrow_range_kernel_clipped"])
                .constant("REACH", if clean_up { CLEAN_UP } else { self.window / 2 })
                .constant("FIXED", clean_up)
                .constant("EMPTY_FAR", self.empty_far)
                .push("kernel", self.kernel)
                .push("threshold", self.threshold)
                .push("clamp", self.clamp);
            let groups = per_pixel(plan, IMAGE_GROUP, body.sides);
            plan.dispatch("narrow range", call, groups);
        })
    }

    #[cfg(feature = "inspect")]
    fn steps(&self) -> u32 {
        self.steps_each() * self.iterations
    }

    #[cfg(feature = "inspect")]
    fn twin(&self, step: u32, input: &super::twin::Input) -> Vec<super::twin::Pixel> {
        let p = twin::Parameters::from(self);
        match (self.steps_each(), step % 3) {
            (3, 2) => twin::narrow_range(input.frame, input.depth, &p.clean_up()),
            (3, axis) => twin::narrow_range_along(input.frame, input.depth, &p, super::twin::Axis::of(axis)),
            _ => twin::narrow_range(input.frame, input.depth, &p),
        }
    }
}
