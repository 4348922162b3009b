//! Twin of `glsl/smooth/normals.comp`: normals of a smoothed depth map from one-sided differences (Green10).

use crate::{
    shader::{Frame, SIDE_BACK},
    smooth::plane_fit::twin::view_ray,
    twin::normal::encode_normal,
};
use glam::DVec3;

/// One layer's normals.
#[derive(Clone, Debug, PartialEq)]
pub struct Normals {
    /// Packed; 0 where there is no surface.
    pub normal: Vec<u32>,
    /// Pixels that lack a neighbour on some axis and kept the ray-cast normal.
    pub degenerate: u32,
    /// By how much the smaller depth jump is smaller, on the axis where the choice of sides was closer; infinite where
    /// there was none. Rounding may turn a choice below a float's step at this depth.
    pub margin: Vec<f64>,
}

/// Normals of `depth` (row by row); `raw` are those of the ray cast, `side` is the layer.
pub fn normals(frame: &Frame, depth: &[f32], raw: &[u32], side: u32) -> Normals {
    let (width, height) = (frame.size.x as i32, frame.size.y as i32);
    // Eye-space point of a pixel, if it has a surface.
    let point = |x: i32, y: i32| {
        let inside = (0..width).contains(&x) && (0..height).contains(&y);
        let d = if inside { depth[(y * width + x) as usize] } else { 0.0 };
        (d > 0.0).then(|| view_ray(frame, x, y) * f64::from(d))
    };
    let mut result = Normals { normal: vec![0; depth.len()], degenerate: 0, margin: vec![f64::INFINITY; depth.len()] };
    for y in 0..height {
        for x in 0..width {
            let i = (y * width + x) as usize;
            let Some(p) = point(x, y) else { continue };
            let (along_x, margin_x) = difference(point(x - 1, y), p, point(x + 1, y));
            let (along_y, margin_y) = difference(point(x, y - 1), p, point(x, y + 1));
            result.margin[i] = margin_x.min(margin_y);
            let n = along_x.cross(along_y);
            if n == DVec3::ZERO {
                result.normal[i] = raw[i];
                result.degenerate += 1;
                continue;
            }
            // The eye is at the origin: p points away from it, as backs do.
            let away = n.dot(p) > 0.0;
            let n = if away == (side == SIDE_BACK) { n } else { -n };
            result.normal[i] = encode_normal(n.normalize().as_vec3());
        }
    }
    result
}

/// Difference of positions one pixel apart, on the side with the smaller depth jump (forward if they are equal), and
/// by how much it is smaller; zero if neither side has a surface.
fn difference(before: Option<DVec3>, p: DVec3, after: Option<DVec3>) -> (DVec3, f64) {
    match (before, after) {
        (None, None) => (DVec3::ZERO, f64::INFINITY),
        (None, Some(a)) => (a - p, f64::INFINITY),
        (Some(b), None) => (p - b, f64::INFINITY),
        (Some(b), Some(a)) => {
            let (back, ahead) = ((p.z - b.z).abs(), (a.z - p.z).abs());
            (if ahead <= back { a - p } else { p - b }, (ahead - back).abs())
        }
    }
}
