//! Binomial smoothing, rows then columns, with a silhouette map (`glsl/smooth/binomial.comp`; Cords08 §2.2, §3).

#[cfg(feature = "inspect")]
pub mod twin;

use super::{Filter, alternate, edge, per_pixel};
use crate::{
    layers::Body,
    parameters::parameters,
    plan::{Call, Plan, Target},
    shader::{BINOMIAL_ACROSS_COMP, BINOMIAL_DOWN_COMP, IMAGE_GROUP},
};
use ash::vk::Format;

/// Largest window.
const WIDEST: u32 = 121;

parameters! {
    /// Binomial smoothing, rows then columns, drawn only where the smoothed silhouette is whole (Cords08). A border as wide as
    /// the kernel is cut off, and with it every droplet that is no larger.
    pub struct Binomial {
        /// Pixels to either side: the splat's radius to begin with, to be varied by the user (Cords08 section 2.2)
        kernel: f32 = 1.0, "projected particle radii", "a finite value of at least 0"
            => |k| k.is_finite() && *k >= 0.0;
        /// Largest edge of the window; ours: the paper has no limit, and the weights of wider ones leave float32
        window: u32 = WIDEST, "pixels", "an odd number from 3 to 121" => |w| w % 2 == 1 && (3..=WIDEST).contains(w),
            enlarged |all, times| edge(all.window, times, Some(WIDEST));
        /// Whether only pixels are drawn at which the smoothed silhouette is still 1, after the last iteration
        silhouette_map: bool = true, "", "true or false" => |_| true;
        /// How often rows and columns are filtered (Cords08: once)
        iterations: u32 = 1, "", "0 to 20" => |n| *n <= 20;
    }
}

/// What the row pass leaves beside the depths.
const MISSING: &str = "missing silhouette";

impl Filter for Binomial {
    fn record(&self, plan: &mut Plan, body: &Body) -> Target {
        let steps = 2 * self.iterations;
        let mut missing = None;
        alternate(plan, body, steps, |plan, step, from, to| {
            let missing = *missing.get_or_insert_with(|| plan.map(MISSING, Format::R32_SFLOAT, body.sides));
            let call = if step % 2 == 0 {
                Call::compute(&BINOMIAL_ACROSS_COMP).write("missing_out", missing)
            } else {
                // Once is enough: the last time.
                let cut = self.silhouette_map && step + 1 == steps;
                Call::compute(&BINOMIAL_DOWN_COMP).read("missing_in", missing).constant("SILHOUETTE_MAP", cut)
            };
            let call = call
                .read("depth_in", from)
                .write("depth_out", to)
                .counting(&["binomial_kernel_clipped"])
                .constant("REACH", self.window / 2)
                .push("kernel", self.kernel);
            let groups = per_pixel(plan, IMAGE_GROUP, body.sides);
            plan.dispatch("binomial", call, groups);
        })
    }

    #[cfg(feature = "inspect")]
    fn steps(&self) -> u32 {
        2 * self.iterations
    }

    #[cfg(feature = "inspect")]
    fn beside(&self, step: u32) -> Option<&'static str> {
        (step % 2 == 1).then_some(MISSING)
    }

    #[cfg(feature = "inspect")]
    fn twin(&self, step: u32, input: &super::twin::Input) -> super::twin::Smoothed {
        let mut p = twin::Parameters::from(self);
        p.silhouette_map &= step + 1 == self.steps();
        let (pixels, beside) = match step % 2 {
            0 => twin::across(input.frame, input.depth, &p),
            _ => (twin::down(input.frame, input.depth, input.beside, &p), Vec::new()),
        };
        let clipped = super::twin::clipped(input.frame, input.depth, p.kernel, p.reach);
        super::twin::Smoothed { pixels, counted: vec![("binomial_kernel_clipped", clipped)], beside }
    }
}
