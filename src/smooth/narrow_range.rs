//! The narrow-range filter (`glsl/smooth/narrow_range.comp`; Truong18): over a square window, or by rows and columns, with a
//! small clean-up at the end.

#[cfg(feature = "inspect")]
pub mod twin;

#[cfg(feature = "inspect")]
use super::twin::Axis;
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
        /// Rows and columns in turn, and in place of the last iteration a small square that cleans up after them.
        #[default]
        Separable = "separable",
        /// The whole square.
        Square = "square",
    }
}

/// Largest window.
const WIDEST: u32 = 201;

parameters! {
    /// The narrow-range filter (Truong18). Where the paper leaves something open, the schedule and the kernel (5 times 0.1 r)
    /// are those of its authors' demo program; that no surface counts for nothing is our choice.
    pub struct NarrowRange {
        /// What the window is
        shape: Shape = Shape::Separable, "", "separable (rows and columns, at last a clean-up) or square" => |_| true;
        /// Pixels to either side; the authors' demo program has a filter size of 5, by 0.1
        kernel: f32 = 0.5, "projected particle radii", "a finite value of at least 0"
            => |k| k.is_finite() && *k >= 0.0;
        /// Largest edge of the window
        window: u32 = WIDEST, "pixels", "an odd number from 3 to 201" => |w| w % 2 == 1 && (3..=WIDEST).contains(w),
            enlarged |all, times| edge(all.window, times, Some(WIDEST));
        /// How far beyond what is already in range a depth may lie; the authors' program has 10.5
        threshold: f32 = 10.0, "particle radii", "a finite value above 0" => |t| t.is_finite() && *t > 0.0;
        /// How far behind the pixel what is too far counts (Truong18: mu = r)
        clamp: f32 = 1.0, "particle radii", "a finite value of at least 0" => |c| c.is_finite() && *c >= 0.0;
        /// Whether no surface counts as too far (so Truong18), or not at all (ours: silhouettes are not pulled back)
        empty_far: bool = false, "", "true or false" => |_| true;
        /// How often it is applied; if separable, the clean-up is the last one
        iterations: u32 = 3, "", "0 to 20" => |n| *n <= 20;
    }
}

/// Pixels to either side of the clean-up.
const CLEAN_UP: u32 = 4;

/// What one of the times does that depths go through a shader.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Step {
    Rows,
    Columns,
    CleanUp,
    Square,
}

impl NarrowRange {
    /// One after the other: iterations but the last are rows and columns, the last is the clean-up.
    fn schedule(&self) -> Vec<Step> {
        let iterations = self.iterations as usize;
        match self.shape {
            Shape::Square => vec![Step::Square; iterations],
            Shape::Separable if iterations == 0 => Vec::new(),
            Shape::Separable => {
                let mut steps = [Step::Rows, Step::Columns].repeat(iterations - 1);
                steps.push(Step::CleanUp);
                steps
            }
        }
    }
}

impl Filter for NarrowRange {
    fn record(&self, plan: &mut Plan, body: &Body) -> Target {
        let schedule = self.schedule();
        alternate(plan, body, schedule.len() as u32, |plan, i, from, to| {
            let step = schedule[i as usize];
            let clean_up = step == Step::CleanUp;
            let call = match step {
                Step::Rows => Call::compute(&NARROW_RANGE_ALONG_COMP).constant("AXIS", 0u32),
                Step::Columns => Call::compute(&NARROW_RANGE_ALONG_COMP).constant("AXIS", 1u32),
                Step::CleanUp | Step::Square => Call::compute(&NARROW_RANGE_FULL_COMP),
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
        self.schedule().len() as u32
    }

    #[cfg(feature = "inspect")]
    fn twin(&self, step: u32, input: &super::twin::Input) -> super::twin::Smoothed {
        let (frame, depth, p) = (input.frame, input.depth, twin::Parameters::from(self));
        let mut clipped = super::twin::clipped(frame, depth, p.kernel, p.reach);
        let pixels = match self.schedule()[step as usize] {
            Step::Rows => twin::narrow_range_along(frame, depth, &p, Axis::X),
            Step::Columns => twin::narrow_range_along(frame, depth, &p, Axis::Y),
            Step::CleanUp => {
                clipped = super::twin::Count::default();
                twin::narrow_range(frame, depth, &p.clean_up())
            }
            Step::Square => twin::narrow_range(frame, depth, &p),
        };
        super::twin::Smoothed::new(pixels, vec![("narrow_range_kernel_clipped", clipped)])
    }
}

#[cfg(test)]
mod tests {
    use super::{NarrowRange, Shape, Step::*};

    /// As the authors' program: rows and columns for all iterations but the last, which is the clean-up.
    #[test]
    fn the_clean_up_is_the_last_iteration() {
        let steps = |shape, n| NarrowRange::default().shape(shape).iterations(n).schedule();
        assert!(steps(Shape::Separable, 3) == [Rows, Columns, Rows, Columns, CleanUp]);
        assert!(steps(Shape::Separable, 1) == [CleanUp]);
        assert!(steps(Shape::Separable, 0).is_empty());
        assert!(steps(Shape::Square, 2) == [Square, Square]);
    }
}
