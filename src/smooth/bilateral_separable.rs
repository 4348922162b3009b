//! The bilateral filter as if it were separable: rows, then columns (`glsl/smooth/bilateral_separable.comp`; Green10).

#[cfg(feature = "inspect")]
pub mod twin;

use super::{Filter, alternate, per_pixel};
use crate::{
    layers::Body,
    parameters::parameters,
    plan::{Call, Plan, Target},
    shader::{BILATERAL_SEPARABLE_COMP, IMAGE_GROUP},
};

parameters! {
    /// The bilateral filter as if it were separable: rows, then columns (Green10, whose slides print no
    /// numbers: these are the other bilateral filter's).
    pub struct BilateralSeparable {
        /// Largest edge of the window
        window: u32 = 55, "pixels", "an odd number from 3 to 129" => |w| w % 2 == 1 && (3..=129).contains(w);
        /// Standard deviation of the weights across the image
        sigma_space: f32 = 1.0, "particle radii, or pixels", "a finite value above 0"
            => |s| s.is_finite() && *s > 0.0;
        /// Standard deviation of the weights in depth
        sigma_depth: f32 = 10.0 / 3.0, "particle radii", "a finite value above 0" => |s| s.is_finite() && *s > 0.0;
        /// Whether sigma_space is a length at the pixel's depth, and the window three of it to either side
        projected: bool = true, "", "true or false" => |_| true;
        /// How often rows and columns are filtered
        iterations: u32 = 1, "", "0 to 20" => |n| *n <= 20;
    }
}

impl Filter for BilateralSeparable {
    fn record(&self, plan: &mut Plan, body: &Body) -> Target {
        alternate(plan, body, 2 * self.iterations, |plan, step, from, to| {
            let call = Call::compute(&BILATERAL_SEPARABLE_COMP)
                .read("depth_in", from)
                .write("depth_out", to)
                .counting(&["bilateral_kernel_clipped"])
                .constant("REACH", self.window / 2)
                .constant("PROJECTED", self.projected)
                .constant("AXIS", step % 2)
                .push("sigma_space", self.sigma_space)
                .push("sigma_depth", self.sigma_depth);
            let groups = per_pixel(plan, IMAGE_GROUP, body.sides);
            plan.dispatch("bilateral", call, groups);
        })
    }

    #[cfg(feature = "inspect")]
    fn steps(&self) -> u32 {
        2 * self.iterations
    }

    #[cfg(feature = "inspect")]
    fn twin(&self, step: u32, input: &super::twin::Input) -> super::twin::Smoothed {
        let (frame, depth, p) = (input.frame, input.depth, self.into());
        let pixels = twin::bilateral_separable(frame, depth, &p, super::twin::Axis::of(step % 2));
        super::twin::Smoothed::new(pixels, super::bilateral::twin::counted(frame, depth, &p))
    }
}
