//! How the body's surfaces are smoothed. A filter takes their depths and gives the target that holds the result.

pub mod none;
mod normals;
pub mod plane_fit;

use crate::{
    layers::{Body, Surface},
    method::Offers,
    parameters::family,
    plan::{Groups, Plan, Target},
};

family! {
    /// How the body's surfaces are smoothed.
    pub enum Smooth: Filter {
        PlaneFit(plane_fit) = "plane-fit",
        Unsmoothed(none) = "none",
    }
}

/// A member of the family.
pub(crate) trait Filter {
    /// What it asks of the layers.
    fn asks(&self) -> Offers {
        Offers::default()
    }
    /// Smooths the depths of all sides of the body; gives the target that holds the result, which may be the body's own.
    fn record(&self, plan: &mut Plan, body: &Body) -> Target;
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
    let [width, height] = plan.size.map(|s| s.div_ceil(edge));
    Groups::Direct([width, height, sides])
}
