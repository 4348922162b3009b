//! Smoothing by mean curvature flow, in explicit steps (`glsl/smooth/curvature_flow.comp`; vdLaan09).

#[cfg(feature = "inspect")]
pub mod twin;

use super::{Filter, alternate, per_pixel};
use crate::{
    layers::Body,
    parameters::parameters,
    plan::{Call, Plan, Target},
    shader::{CURVATURE_FLOW_COMP, IMAGE_GROUP},
};

parameters! {
    /// Mean curvature flow in explicit steps, none across a depth jump (vdLaan09, who print none of the numbers). Steps longer
    /// than is stable are shortened.
    pub struct CurvatureFlow {
        /// Length of a step; ours: the longest that is stable where a radius covers ten pixels (public implementations have
        /// 0.0005 in units of their scenes). Rendered at n times the size it is an n-th
        time_step: f32 = 0.05, "particle radii times pixels", "a finite value of at least 0"
            => |t| t.is_finite() && *t >= 0.0,
            enlarged |all, times| all.time_step / times as f32;
        /// Depth difference from one pixel to the next across which nothing flows; as Truong18 compares with
        jump: f32 = 5.0, "particle radii", "0 to 1000" => |j| (0.0..=1000.0).contains(j);
        /// Steps, as many as there is time for; public implementations have 60. Rendered at n times the size n^2 times as
        /// many: the flow spreads by pixels, and stable steps are an n-th as long
        iterations: u32 = 60, "", "0 to 1000" => |n| *n <= 1000,
            enlarged |all, times| all.iterations.saturating_mul(times.saturating_mul(times));
    }
}

impl Filter for CurvatureFlow {
    fn record(&self, plan: &mut Plan, body: &Body) -> Target {
        alternate(plan, body, self.iterations, |plan, _, from, to| {
            let call = Call::compute(&CURVATURE_FLOW_COMP)
                .read("depth_in", from)
                .write("depth_out", to)
                .counting(&["curvature_flow_step_shortened", "curvature_flow_before_near_plane"])
                .push("time_step", self.time_step)
                .push("jump", self.jump);
            let groups = per_pixel(plan, IMAGE_GROUP, body.sides);
            plan.dispatch("curvature flow", call, groups);
        })
    }

    #[cfg(feature = "inspect")]
    fn steps(&self) -> u32 {
        self.iterations
    }

    #[cfg(feature = "inspect")]
    fn twin(&self, _: u32, input: &super::twin::Input) -> super::twin::Smoothed {
        let flow = twin::flow(input.frame, input.depth, &self.into());
        let counted =
            vec![("curvature_flow_step_shortened", flow.shortened), ("curvature_flow_before_near_plane", flow.refused)];
        super::twin::Smoothed::new(flow.pixel, counted)
    }
}
