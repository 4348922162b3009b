//! How the body's surfaces are smoothed. A filter takes their depths and gives the target that holds the result.

pub mod bilateral;
pub mod bilateral_separable;
pub mod binomial;
pub mod curvature_flow;
pub mod narrow_range;
pub mod none;
pub mod normals;
pub mod plane_fit;
#[cfg(feature = "inspect")]
pub mod twin;

use crate::{
    layers::{Body, Surface},
    method::Offers,
    parameters::family,
    plan::{Groups, Plan, Target},
};
use ash::vk::Format;

family! {
    /// How the body's surfaces are smoothed.
    pub enum Smooth: Filter {
        PlaneFit(plane_fit) = "plane-fit",
        Bilateral(bilateral) = "bilateral",
        BilateralSeparable(bilateral_separable) = "bilateral-separable",
        Binomial(binomial) = "binomial",
        CurvatureFlow(curvature_flow) = "curvature-flow",
        NarrowRange(narrow_range) = "narrow-range",
        Unsmoothed(none) = "none",
    }
}

/// A member of the family.
pub(crate) trait Filter {
    /// What it asks of the layers.
    fn asks(&self) -> Offers {
        Offers { maps: true, ..Offers::default() }
    }
    /// Smooths the depths of all sides of the body; gives the target that holds the result, which may be the body's own.
    fn record(&self, plan: &mut Plan, body: &Body) -> Target;
    /// How many times depths go through a shader on the way to the result.
    #[cfg(feature = "inspect")]
    fn steps(&self) -> u32;
    /// The target beside the depths that one of these times, counted from 0, reads.
    #[cfg(feature = "inspect")]
    fn beside(&self, _step: u32) -> Option<&'static str> {
        None
    }
    /// Where it leaves a depth as it is.
    #[cfg(feature = "inspect")]
    fn guards(&self) -> Option<Guards> {
        None
    }
    /// What one of these times, counted from 0, makes of the depths of one side: the same in 64 bits.
    #[cfg(feature = "inspect")]
    fn twin(&self, step: u32, input: &twin::Input) -> twin::Smoothed;
}

/// Where a filter leaves a depth as it is.
#[cfg(feature = "inspect")]
#[non_exhaustive]
pub struct Guards {
    /// Name and value of each limit, and whether it is a length in particle radii.
    pub limits: Vec<(&'static str, f32, bool)>,
    /// What they limit.
    pub meaning: &'static str,
}

#[cfg(feature = "inspect")]
impl Smooth {
    /// How many times depths go through a shader on the way to the result.
    pub fn steps(&self) -> u32 {
        self.member().steps()
    }

    /// The target beside the depths that one of these times, counted from 0, reads.
    pub fn beside(&self, step: u32) -> Option<&'static str> {
        self.member().beside(step)
    }

    /// Where it leaves a depth as it is.
    pub fn guards(&self) -> Option<Guards> {
        self.member().guards()
    }

    /// The CPU twin of one of these times, counted from 0.
    pub fn twin(&self, step: u32, input: &twin::Input) -> twin::Smoothed {
        self.member().twin(step, input)
    }
}

/// Edge of a window of pixels in a picture that is rendered at `times` its size: it covers the same part of it. A kernel that
/// is projected grows with the picture by itself, and what only caps it ends with its own range.
fn edge(window: u32, times: u32, cap: Option<u32>) -> u32 {
    let wide = window.saturating_sub(1).saturating_mul(times).saturating_add(1);
    cap.map_or(wide, |most| wide.min(most))
}

/// Takes the body's depths through so many steps, each from the target that the last one wrote to another; there are two
/// of these, and the first step reads the body's own. Gives the last.
fn alternate(plan: &mut Plan, body: &Body, steps: u32, mut step: impl FnMut(&mut Plan, u32, Target, Target)) -> Target {
    let steps = steps.min(plan.smoothing_steps.unwrap_or(u32::MAX));
    let names = ["body depth (smoothed, odd)", "body depth (smoothed, even)"];
    let targets: Vec<_> =
        names.into_iter().take(steps as usize).map(|name| plan.map(name, Format::R32_SFLOAT, body.sides)).collect();
    let mut from = body.depth;
    for i in 0..steps {
        let to = targets[i as usize % 2];
        step(plan, i, from, to);
        from = to;
    }
    from
}

/// The body, smoothed: its depths by the filter, its normals from them.
pub(crate) fn record(plan: &mut Plan, filter: &Smooth, body: &Body) -> Surface {
    let depth = filter.member().record(plan, body);
    let own = body.normal.filter(|_| depth == body.depth);
    let normal = own.unwrap_or_else(|| normals::record(plan, body, depth));
    Surface { depth, normal, sides: body.sides }
}

/// Groups of `edge` x `edge` invocations for each pixel of each side.
fn per_pixel(plan: &Plan, edge: u32, sides: u32) -> Groups {
    let [width, height] = plan.size().map(|s| s.div_ceil(edge));
    Groups::Direct([width, height, sides])
}
