//! The camera.

use crate::{
    status::{Failure, MeniscusStatus, guard},
    versioned::{self, Versioned, read, write},
};
use renderer::{
    Camera,
    glam::{Mat4, Vec3},
};
use std::mem::offset_of;

/// A perspective camera, as it is drawn with: the picture's upper left corner is (-1, -1) in Vulkan's clip space. Matrices are
/// column by column, and multiply column vectors.
///
/// Left-handed worlds: `view` may mirror. An eye space that looks along +z, with w = +z, becomes this one by
/// F = diag(1, 1, -1, 1): projection p * F, view F * v. Viewports of negative height turn y around after the projection: negate
/// `projection`'s second row.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusCamera {
    /// sizeof(MeniscusCamera).
    pub struct_size: usize,
    /// World to eye: a rotation, with or without a reflection, and a translation.
    pub view: [f32; 16],
    /// Eye to Vulkan clip space (y down), perspective: w = -z. May be off-centre, jittered, reversed or infinite.
    pub projection: [f32; 16],
    /// Distance from the eye along the view axis, above 0, before which no liquid is drawn. It need not be the projection's near
    /// plane.
    pub near_distance: f32,
    /// World direction in which the environment's +y points. Three zeros stand for +y.
    pub up: [f32; 3],
    /// Angle by which the environment is turned around `up`, in radians, counter-clockwise as seen from above.
    pub environment_rotation: f32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C); its size first; no padding (a test adds it up); numbers.
unsafe impl Versioned for MeniscusCamera {
    const NAME: &'static str = "MeniscusCamera";
    const LEAST: usize = offset_of!(MeniscusCamera, up);

    fn reserved(&self) -> u32 {
        self.reserved
    }
}

impl MeniscusCamera {
    /// # Safety
    /// As [`read`].
    pub(crate) unsafe fn get(camera: *const MeniscusCamera) -> Result<Camera, Failure> {
        // SAFETY: this function's contract.
        let c = unsafe { read(camera) }?;
        let matrix = |m: &[f32; 16]| Mat4::from_cols_array(m);
        let mut camera = Camera::new(matrix(&c.view), matrix(&c.projection), c.near_distance);
        if c.up != [0.0; 3] {
            camera.up = Vec3::from_array(c.up);
        }
        camera.environment_rotation = c.environment_rotation;
        Ok(camera)
    }
}

/// Fills a camera, whose struct_size is set, at `eye` that looks at `target`, `fov_y` radians high. Its projection is infinite: the
/// depth is 0 at `near_distance` and 1 infinitely far away, where a depth buffer is cleared to.
///
/// # Safety
/// `eye`, `target` and `up` are three floats each; `camera` is null or a MeniscusCamera with its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_camera_look_at(
    camera: *mut MeniscusCamera,
    eye: *const f32,
    target: *const f32,
    up: *const f32,
    fov_y: f32,
    aspect: f32,
    near_distance: f32,
) -> MeniscusStatus {
    guard(|| {
        let vector = |v, what: &str| {
            // SAFETY: this function's contract.
            unsafe { versioned::slice(v, 3, what) }.map(Vec3::from_slice)
        };
        let [eye, target, up] = [vector(eye, "eye")?, vector(target, "target")?, vector(up, "up")?];
        if !(fov_y > 0.0 && fov_y < std::f32::consts::PI && aspect > 0.0 && aspect.is_finite()) {
            let remedy = "use an angle between 0 and pi, and width / height";
            return Err(Failure::parameter(format!("a field of view of {fov_y} and an aspect of {aspect}: {remedy}")));
        }
        let made = Camera::look_at(eye, target, up, fov_y, aspect, near_distance);
        made.validate()?;
        let value = MeniscusCamera {
            struct_size: size_of::<MeniscusCamera>(),
            view: made.view.to_cols_array(),
            projection: made.projection.to_cols_array(),
            near_distance: made.near,
            up: made.up.to_array(),
            environment_rotation: made.environment_rotation,
            reserved: 0,
        };
        // SAFETY: this function's contract.
        unsafe { write(camera, value) }
    })
}
