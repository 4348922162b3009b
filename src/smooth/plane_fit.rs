//! Smoothing by iterative plane fitting (`glsl/smooth/plane_fit.comp`; Imai16 §4.3).

#[cfg(feature = "inspect")]
pub mod twin;

use super::{Filter, alternate, edge};
use crate::{
    layers::Body,
    method::Offers,
    parameters::{choices, parameters},
    plan::{Call, Groups, Plan, Target},
    shader::{FIT_COLUMN, PLANE_FIT_COMP},
};

choices! {
    /// Weights of plane fitting (Imai16 fig. 5).
    pub enum Weighting {
        /// Difference of depths, eq. (2): keeps depth gaps.
        #[default]
        ViewDependent = "view-dependent",
        /// Distance of eye-space points: smooths across gaps; the paper's rejected alternative.
        Euclidean = "euclidean",
    }
}

/// Largest window.
const WIDEST: u32 = 25;

parameters! {
    /// Iterative plane fitting (Imai16 §4.3).
    pub struct PlaneFit {
        /// Edge of the window (Imai16 fig. 6: 9)
        window: u32 = 9, "pixels", "an odd number from 3 to 25" => |w| w % 2 == 1 && (3..=WIDEST).contains(w),
            enlarged |all, times| edge(all.window, times, all.projected.then_some(WIDEST));
        /// Whether the window is `width` wide at the pixel's depth, and `window` pixels at most: smoothing that does not
        /// depend on zoom and resolution. Ours: the paper's window is one of pixels
        projected: bool = false, "", "true or false" => |_| true;
        /// Width of a projected window; ours
        width: f32 = 4.0, "particle radii", "a finite value of at least 0" => |w| w.is_finite() && *w >= 0.0;
        /// How often planes are fitted (Imai16: 2 for its waves, 5 for its steps and a million particles)
        iterations: u32 = 2, "", "0 to 20" => |n| *n <= 20;
        /// Standard deviation of the weights, sigma of eq. (2) (Imai16 §4.3: 5.3 r)
        sigma: f32 = 5.3, "particle radii", "a finite value above 0"
            => |s| s.is_finite() && *s > 0.0;
        /// What weights are made of
        weighting: Weighting = Weighting::ViewDependent, "", "view-dependent (eq. 2) or euclidean" => |_| true;
    }
}

/// Pixels of a work group: the most of which 16 bytes each, with the windows around them, and a flag fit the guaranteed 16 KiB of
/// shared memory.
fn tile(reach: u32) -> [u32; 2] {
    let fits = |[x, y]: &[u32; 2]| 16 * (x + 2 * reach) * (y + 2 * reach) + 4 <= 16 << 10;
    [[16, 16], [8, 16], [8, 8]].into_iter().find(fits).unwrap_or([8, 4])
}

impl Filter for PlaneFit {
    fn asks(&self) -> Offers {
        Offers { maps: true, normals: true, ..Offers::default() }
    }

    fn record(&self, plan: &mut Plan, body: &Body) -> Target {
        let reach = self.window / 2;
        let [wide, tall] = tile(reach);
        let Some(normal) = body.normal else {
            plan.refuse("plane fit", "there are no normals of the particles, which it asks for".into());
            return body.depth;
        };
        alternate(plan, body, self.iterations, |plan, _, from, to| {
            let call = Call::compute(&PLANE_FIT_COMP)
                .read("depth_in", from)
                .read("normal_raw", normal)
                .write("depth_out", to)
                .counting(&[
                    "plane_fit_zero_normal_sum",
                    "plane_fit_grazing",
                    "plane_fit_update_too_long",
                    "plane_fit_window_clipped",
                ])
                .constant("local_size_x", wide)
                .constant("local_size_y", tall / FIT_COLUMN)
                .constant("HALF_WINDOW", reach)
                .constant("EUCLIDEAN", self.weighting == Weighting::Euclidean)
                .constant("PROJECTED", self.projected)
                .push("sigma", self.sigma)
                .push("width", self.width);
            let [width, height] = plan.size();
            let groups = Groups::Direct([width.div_ceil(wide), height.div_ceil(tall), body.sides]);
            plan.dispatch("plane fit", call, groups);
        })
    }

    #[cfg(feature = "inspect")]
    fn steps(&self) -> u32 {
        self.iterations
    }

    #[cfg(feature = "inspect")]
    fn guards(&self) -> Option<super::Guards> {
        use crate::shader::{FIT_GRAZING_LIMIT, FIT_UPDATE_LIMIT};
        let limits = vec![("grazing", FIT_GRAZING_LIMIT, false), ("update", FIT_UPDATE_LIMIT * self.sigma, true)];
        let meaning = "the old depth is kept where |n.v| (v unit) is below `grazing`; updates are cut to `update`";
        Some(super::Guards { limits, meaning })
    }

    #[cfg(feature = "inspect")]
    fn twin(&self, _: u32, input: &super::twin::Input) -> super::twin::Smoothed {
        twin::smoothed(self, input)
    }
}

#[cfg(test)]
mod tests {
    /// 16 KiB are guaranteed, and a work group has whole columns.
    #[test]
    fn tiles_fit_shared_memory() {
        for reach in 1..=super::WIDEST / 2 {
            let [wide, tall] = super::tile(reach);
            let entries = (wide + 2 * reach) * (tall + 2 * reach);
            assert!(16 * entries + 4 <= 16 * 1024, "{reach}: {entries} entries");
            assert!(tall % super::FIT_COLUMN == 0 && wide * tall / super::FIT_COLUMN >= 8, "{reach}: {wide} x {tall}");
        }
    }
}
