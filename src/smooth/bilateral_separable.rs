//! The bilateral filter as if it were separable: rows, then columns (`glsl/smooth/bilateral_separable.comp`; Green10).

#[cfg(feature = "inspect")]
pub mod twin;

use super::{Filter, alternate, bilateral::bilateral_parameters, per_pixel};
use crate::{
    layers::Body,
    parameters::parameters,
    plan::{Call, Plan, Target},
    shader::{BILATERAL_SEPARABLE_COMP, IMAGE_GROUP},
};

bilateral_parameters! {
    /// The bilateral filter as if it were separable: rows, then columns (Green10, whose slides print no numbers: exp(-(x
    /// blurScale)^2) and exp(-(rise blurDepthFalloff)^2), so that sigma is 1 / sqrt(2) over either; Im16 names such a
    /// filter, and prints none either).
    pub struct BilateralSeparable, window to 129, "an odd number from 3 to 129";
    iterations 1, "How often rows and columns are filtered (Green10: once)"
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
