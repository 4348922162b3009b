//! The bilateral filter over a square window, iterated (`glsl/smooth/bilateral.comp`; Imai14, as Imai16 §3.1 has it).

#[cfg(feature = "inspect")]
pub mod twin;

use super::{Filter, alternate, per_pixel};
use crate::{
    layers::Body,
    parameters::parameters,
    plan::{Call, Plan, Target},
    shader::BILATERAL_COMP,
};

/// The parameters of both bilateral filters.
macro_rules! bilateral_parameters {
    (
        $(#[doc = $about:literal])+
        pub struct $Name:ident, window to $widest:literal, $range:literal; iterations $iterations:literal, $often:literal
    ) => {
        parameters! {
            $(#[doc = $about])+
            pub struct $Name {
                /// Largest edge of the window; ours
                window: u32 = 55, "pixels", $range => |w| w % 2 == 1 && (3..=$widest).contains(w),
                    enlarged |all, times| crate::smooth::edge(all.window, times, all.projected.then_some($widest));
                /// Standard deviation of the weights across the image; ours, as wide as a particle (Truong18 compares with a
                /// third of a reach of 0.5 radii). Rendered at n times the size, pixels are n times as many
                sigma_space: f32 = 1.0, "particle radii" if projected else "pixels", "a finite value above 0"
                    => |s| s.is_finite() && *s > 0.0,
                    enlarged |all, times| if all.projected { all.sigma_space } else { all.sigma_space * times as f32 };
                /// Standard deviation of the weights in depth; as Truong18 compares with
                sigma_depth: f32 = 10.0 / 3.0, "particle radii", "a finite value above 0" => |s| s.is_finite() && *s > 0.0;
                /// Whether sigma_space is a length at the pixel's depth, and the window three of it to either side; ours
                projected: bool = true, "", "true or false" => |_| true;
                #[doc = $often]
                iterations: u32 = $iterations, "", "0 to 20" => |n| *n <= 20;
            }
        }
    };
}
pub(super) use bilateral_parameters;

bilateral_parameters! {
    /// The bilateral filter over a square window, iterated (Imai14). Imai16 §3.1 prints none of its numbers.
    pub struct Bilateral, window to 55, "an odd number from 3 to 55";
    iterations 3, "How often it is applied; as Truong18 compares with"
}

impl Filter for Bilateral {
    fn record(&self, plan: &mut Plan, body: &Body) -> Target {
        let reach = self.window / 2;
        // Four bytes an entry of the group's tile have to fit the guaranteed 16 KiB of shared memory.
        let edge = if reach <= 23 { 16 } else { 8 };
        alternate(plan, body, self.iterations, |plan, _, from, to| {
            let call = Call::compute(&BILATERAL_COMP)
                .read("depth_in", from)
                .write("depth_out", to)
                .counting(&["bilateral_kernel_clipped"])
                .constant("local_size_x", edge)
                .constant("local_size_y", edge)
                .constant("REACH", reach)
                .constant("PROJECTED", self.projected)
                .push("sigma_space", self.sigma_space)
                .push("sigma_depth", self.sigma_depth);
            let groups = per_pixel(plan, edge, body.sides);
            plan.dispatch("bilateral", call, groups);
        })
    }

    #[cfg(feature = "inspect")]
    fn steps(&self) -> u32 {
        self.iterations
    }

    #[cfg(feature = "inspect")]
    fn twin(&self, _: u32, input: &super::twin::Input) -> super::twin::Smoothed {
        let (frame, depth, p) = (input.frame, input.depth, self.into());
        super::twin::Smoothed::new(twin::bilateral(frame, depth, &p), twin::counted(frame, depth, &p))
    }
}
