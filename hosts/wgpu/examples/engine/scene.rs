//! What `examples/embed.rs` draws: a chequered wall behind a ball of liquid, a post through its middle, a droplet beside it.

use meniscus_wgpu::meniscus::{
    Camera,
    glam::{Vec2, Vec3},
};

pub const SIZE: [u32; 2] = [640, 480];
pub const RADIUS: f32 = 0.02;

/// A rectangle of one depth and one colour, as the shader reads it.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Rect {
    low: [f32; 2],
    span: [f32; 2],
    color: [f32; 4],
    depth: f32,
}

impl Rect {
    pub const ATTRIBUTES: [wgpu::VertexAttribute; 4] =
        wgpu::vertex_attr_array![0 => Float32x2, 1 => Float32x2, 2 => Float32x4, 3 => Float32];
}

/// An opaque board that faces the camera.
struct Board {
    center: Vec3,
    half: Vec2,
    color: [f32; 4],
}

/// The camera of a frame.
pub fn camera(frame: usize) -> (Vec3, Camera) {
    let angle = 0.3 * frame as f32;
    let eye = Vec3::new(2.2 * angle.sin(), 0.6, 2.2 * angle.cos());
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    (eye, Camera::look_at(eye, Vec3::ZERO, Vec3::Y, 0.7, aspect, 0.1))
}

/// Wall and post, as seen by a camera; far ones first.
pub fn boards(eye: Vec3, camera: &Camera) -> Vec<Rect> {
    let (back, up) = (-eye.normalize(), Vec3::Y);
    let right = back.cross(up).normalize();
    let tile = |i: i32, j: i32| Board {
        center: 1.2 * back + 0.3 * (i as f32 * right + j as f32 * up),
        half: Vec2::splat(0.15),
        color: if (i + j) % 2 == 0 { [0.7, 0.65, 0.55, 1.0] } else { [0.12, 0.13, 0.16, 1.0] },
    };
    let wall = (-4..=4).flat_map(|i| (-4..=1).map(move |j| tile(i, j)));
    let post = Board { center: Vec3::ZERO, half: Vec2::new(0.05, 0.75), color: [0.8, 0.08, 0.05, 1.0] };
    wall.chain([post]).filter_map(|board| project(camera, &board)).collect()
}

/// How far the frames are, as a bar along the picture's lower edge: drawn last, over the liquid.
pub fn bar(frame: usize, frames: usize) -> Rect {
    let (width, height) = (SIZE[0] as f32, SIZE[1] as f32);
    let span = [width * (frame + 1) as f32 / frames as f32, BAR as f32];
    Rect { low: [0.0, height - BAR as f32], span, color: [1.0, 1.0, 0.0, 1.0], depth: 0.0 }
}

/// Height of the bar in pixels.
pub const BAR: u32 = 8;

/// A ball of liquid, and a droplet beside it.
pub fn positions() -> Vec<Vec3> {
    let axis = || (-12..=12).map(|i| 2.0 * RADIUS * i as f32);
    let lattice = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x, y, z))));
    lattice.filter(|p| p.length() < 24.0 * RADIUS).chain([Vec3::new(0.7, 0.1, 0.0)]).collect()
}

/// The pixels that a board covers, and its depth in the depth buffer; `None` if it is out of view.
fn project(camera: &Camera, board: &Board) -> Option<Rect> {
    let eye = camera.view.transform_point3(board.center);
    if -eye.z <= camera.near {
        return None;
    }
    let size = Vec2::new(SIZE[0] as f32, SIZE[1] as f32);
    let pixel = |x: Vec2| {
        let clip = camera.projection.project_point3(x.extend(eye.z));
        (0.5 * (clip.truncate() + 1.0) * size).round().clamp(Vec2::ZERO, size)
    };
    let (a, b) = (pixel(eye.truncate() - board.half), pixel(eye.truncate() + board.half));
    let span = (a - b).abs();
    let depth = camera.projection.project_point3(eye).z;
    let rect = Rect { low: a.min(b).to_array(), span: span.to_array(), color: board.color, depth };
    (span.min_element() > 0.0).then_some(rect)
}
