//! The renderer: made, sized, fed, destroyed.

use crate::{
    host::MeniscusHost,
    prepare::{MeniscusEllipsoid, MeniscusPoint, MeniscusPrepared},
    settings::MeniscusSettings,
    status::{Failure, MeniscusStatus, guard},
    versioned::{borrow, borrow_mut, give, read, slice, take, tell},
};
use renderer::{
    Ellipsoid, Equirect, Particles, Point, Renderer,
    ash::vk::{CommandBuffer as VkCommandBuffer, Format as VkFormat},
    glam::{Mat3, Vec3},
};

/// Renders particle liquids into a host's command buffers. One thread at a time uses it.
pub struct MeniscusRenderer {
    whole: Whole<Renderer>,
}

/// What a panic may have left half done: nothing but its end is left to it then.
pub(crate) struct Whole<T> {
    inner: T,
    broken: bool,
}

impl<T> Whole<T> {
    pub fn new(inner: T) -> Whole<T> {
        Whole { inner, broken: false }
    }

    /// Does something with it, unless something panicked before.
    pub fn with<R>(&mut self, body: impl FnOnce(&mut T) -> Result<R, Failure>) -> Result<R, Failure> {
        if self.broken {
            let message =
                "an earlier call panicked, which is a mistake in meniscus: destroy this object, and make another";
            return Err(Failure::new(MeniscusStatus::ErrorPanic, message));
        }
        self.broken = true;
        let done = body(&mut self.inner);
        self.broken = false;
        done
    }
}

/// Runs what a function does with a renderer.
///
/// # Safety
/// `renderer` is null or one of ours, that nobody else uses.
pub(crate) unsafe fn with(
    renderer: *mut MeniscusRenderer,
    body: impl FnOnce(&mut Renderer) -> Result<(), Failure>,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    guard(|| unsafe { borrow_mut(renderer, "the renderer") }?.whole.with(body))
}

/// Makes a renderer for outputs of one format: UNORM formats receive colour encoded as sRGB, float and _SRGB formats linear colour.
/// Without an allocator of the host's it has one of its own on the host's device.
///
/// # Safety
/// * The handles in `host` are of each other, alive, and stay so until meniscus_renderer_destroy has returned; so is what its
///   allocator's functions need.
/// * The device was created with what meniscus_required_features turns on, and with largePoints if `host` says so.
/// * `renderer` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_create(
    host: *const MeniscusHost,
    output: VkFormat,
    renderer: *mut *mut MeniscusRenderer,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    guard(|| unsafe {
        give(renderer, || {
            let host = read(host)?.borrow()?;
            Ok(MeniscusRenderer { whole: Whole::new(Renderer::new(host, output)?) })
        })
    })
}

/// Destroys a renderer and everything it made; null is none.
///
/// # Safety
/// `renderer` is null, or a renderer that nobody uses any more. No frame that it recorded is in flight.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_destroy(renderer: *mut MeniscusRenderer) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        unsafe {
            if let Some(renderer) = take(renderer) {
                renderer.whole.inner.destroy();
            }
        }
        Ok(())
    })
}

/// Sets the size of outputs to come, in pixels. Allocates nothing: the next frame does.
///
/// # Safety
/// `renderer` is null or a renderer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_resize(
    renderer: *mut MeniscusRenderer,
    width: u32,
    height: u32,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe { with(renderer, |renderer| Ok(renderer.resize([width, height])?)) }
}

/// Gives the particles of the frames to come, as meniscus_prepare made them. They are copied; what was given before goes.
///
/// # Safety
/// `renderer` is null or a renderer; `prepared` is null or prepared particles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_set_prepared(
    renderer: *mut MeniscusRenderer,
    prepared: *const MeniscusPrepared,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            let prepared = borrow(prepared, "the prepared particles")?;
            renderer.set_particles(&prepared.particles)?;
            if let Some(speeds) = &prepared.speeds {
                renderer.set_speeds(speeds)?;
            }
            if let Some(points) = &prepared.points {
                renderer.set_points(points)?;
            }
            Ok(())
        })
    }
}

/// Gives the particles of the frames to come, as they are drawn: `splash_count` splashes first, then the body's. They are copied;
/// what was given before goes, speeds and points too.
///
/// # Safety
/// `renderer` is null or a renderer; `ellipsoids` is null or `count` of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_set_ellipsoids(
    renderer: *mut MeniscusRenderer,
    radius: f32,
    ellipsoids: *const MeniscusEllipsoid,
    count: usize,
    splash_count: usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            let given = slice(ellipsoids, count, "ellipsoids")?;
            let ellipsoid = |e: &MeniscusEllipsoid| Ellipsoid {
                center: Vec3::from_array(e.center),
                axes: Mat3::from_cols_array(&e.axes),
            };
            let ellipsoids = given.iter().map(ellipsoid).collect();
            Ok(renderer.set_particles(&Particles { radius, ellipsoids, splash_count })?)
        })
    }
}

/// Says how fast the particles of meniscus_renderer_set_ellipsoids are, in world units a second and in their order; for spray.
///
/// # Safety
/// `renderer` is null or a renderer; `speeds` is null or `count` floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_set_speeds(
    renderer: *mut MeniscusRenderer,
    speeds: *const f32,
    count: usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe { with(renderer, |renderer| Ok(renderer.set_speeds(slice(speeds, count, "speeds")?)?)) }
}

/// Says where the particles of meniscus_renderer_set_ellipsoids are and how dense, for a density field; in any order.
///
/// # Safety
/// `renderer` is null or a renderer; `points` is null or `count` of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_set_points(
    renderer: *mut MeniscusRenderer,
    points: *const MeniscusPoint,
    count: usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            let given = slice(points, count, "points")?;
            let points = given.iter().map(|p| {
                let class = crate::prepare::class(p.kind)?;
                Ok(Point { position: Vec3::from_array(p.position), density: p.density, class })
            });
            Ok(renderer.set_points(&points.collect::<Result<Vec<_>, Failure>>()?)?)
        })
    }
}

/// Gives the environment of the frames to come; records its upload. Linear RGB, row by row: the first row is straight up, columns run
/// once around, the first at atan2(z, x) = -pi. Values are finite and at least 0. It is copied.
///
/// # Safety
/// `renderer` is null or a renderer; `rgb` is null or three floats for each of `width` x `height` texels. `cmd` is recording, outside
/// rendering, and is submitted before the frames that see the map.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_set_environment(
    renderer: *mut MeniscusRenderer,
    cmd: VkCommandBuffer,
    width: u32,
    height: u32,
    rgb: *const f32,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            let count = usize::try_from(u64::from(width) * u64::from(height)).unwrap_or(usize::MAX);
            let texels = slice(rgb.cast::<[f32; 3]>(), count, "texels of the environment")?;
            let map = Equirect::new(width, height, texels)?;
            Ok(renderer.set_environment(check(cmd)?, &map)?)
        })
    }
}

/// The same of a sky that needs no file: a clear afternoon over a tiled floor.
///
/// # Safety
/// `renderer` is null or a renderer. `cmd` is recording, outside rendering, and is submitted before the frames that see the sky.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_set_procedural_sky(
    renderer: *mut MeniscusRenderer,
    cmd: VkCommandBuffer,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe { with(renderer, |renderer| Ok(renderer.set_environment(check(cmd)?, &Equirect::procedural_sky())?)) }
}

/// Compiles, on all cores, whatever frames with these settings can need, so that recording them compiles nothing. To be called after
/// meniscus_renderer_resize, when there is time. Not what MeniscusFrame::surface asks for, whose formats are not known here: that is
/// meniscus_renderer_warm_up_like's. `made`, if it is not null, tells how many pipelines were made.
///
/// # Safety
/// `renderer` is null or a renderer; `settings` is null or settings; `made` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_renderer_warm_up(
    renderer: *mut MeniscusRenderer,
    settings: *const MeniscusSettings,
    made: *mut usize,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    unsafe {
        with(renderer, |renderer| {
            tell(made, renderer.warm_up(&borrow(settings, "the settings")?.settings)?);
            Ok(())
        })
    }
}

/// Refuses no command buffer.
pub(crate) fn check(cmd: VkCommandBuffer) -> Result<VkCommandBuffer, Failure> {
    if cmd == VkCommandBuffer::null() {
        return Err(Failure::parameter("the command buffer is null: give one that is recording"));
    }
    Ok(cmd)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After a panic an object does nothing more: what it holds may be half done.
    #[test]
    fn a_panic_ends_an_object() {
        let mut whole = Whole::new(1);
        let mut add = |n: i32| {
            guard(|| {
                whole.with(|x| {
                    assert!(n < 10, "{n} is too much");
                    *x += n;
                    if n == 0 { Err(Failure::parameter("nothing")) } else { Ok(()) }
                })
            })
        };
        use MeniscusStatus as S;
        // Errors are no panics.
        assert_eq!([1, 0, 2, 10, 3].map(&mut add), [S::Ok, S::ErrorParameter, S::Ok, S::ErrorPanic, S::ErrorPanic]);
        assert_eq!(whole.inner, 4);
    }
}
