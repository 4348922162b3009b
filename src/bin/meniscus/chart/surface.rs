//! The renderer's own front surface, as pixels of the picture see it.

use glam::{DVec2, Mat3, Vec3};
use meniscus::{
    Camera,
    shader::SIDE_FRONT,
    study::{measures::surface::Front, search::Walked},
    twin::{normal::decode_normal, quadric::pixel_ray},
};

/// Which pixel of those that a picture's is rendered as is looked at, each way.
fn chosen(times: u32) -> u32 {
    times / 2
}

/// Where its centre lies in the picture's pixel.
pub fn within(times: u32) -> DVec2 {
    DVec2::splat((f64::from(chosen(times)) + 0.5) / f64::from(times))
}

/// Of a frame that was rendered at `times` a picture's `size`; nothing of methods whose surfaces have another size.
pub fn fronts(walked: &Walked, camera: &Camera, radius: f32, size: [u32; 2], times: u32) -> Option<Vec<Option<Front>>> {
    let rendered = size.map(|n| n * times);
    let at = |i: u32| [times * (i % size[0]) + chosen(times), times * (i / size[0]) + chosen(times)];
    let pixels = 0..size[0] * size[1];
    let to_world = Mat3::from_mat4(camera.view).transpose();
    if let Some(field) = &walked.field {
        let eye = camera.view.as_dmat4().inverse().w_axis.truncate();
        let front = |i| {
            let [x, y] = at(i);
            let v = pixel_ray(&walked.frame, x, y).normalize();
            let (t, normal) = field.first(eye, to_world.as_dmat3() * v)?;
            Some(Front { depth: (t * -v.z) as f32, normal: Some(normal.as_vec3()) })
        };
        return Some(pixels.map(front).collect());
    }
    let sides = walked.maps.each_ref().map(|class| &class[SIDE_FRONT as usize]);
    let all = (rendered[0] * rendered[1]) as usize;
    if sides.iter().any(|(depths, _)| !depths.is_empty() && depths.len() != all) {
        return None;
    }
    let front = |i| {
        let [x, y] = at(i);
        let index = (y * rendered[0] + x) as usize;
        let found = sides.iter().filter_map(|(depths, normals)| {
            // Where the near plane lies inside the liquid a depth is negative, and has no surface to face anywhere.
            let d = *depths.get(index).filter(|d| **d != 0.0)?;
            let facing = normals.get(index).filter(|_| d > 0.0);
            let normal = facing.map(|code| (to_world * decode_normal(*code)).normalize_or(Vec3::Y));
            Some(Front { depth: radius * d.abs(), normal })
        });
        found.min_by(|a, b| a.depth.total_cmp(&b.depth))
    };
    Some(pixels.map(front).collect())
}
