//! Particles, prepared on the host.

use crate::{
    settings::MeniscusSettings,
    status::{Failure, MeniscusStatus, guard},
    versioned::{Versioned, borrow, give, read, slice, take, tell, write},
};
use renderer::{
    Class, Particles, Point,
    ash::vk::Bool32 as VkBool32,
    glam::{Mat3, Vec3},
    prepare::{self, DensityField, Input},
};
use std::mem::offset_of;

/// A class of particles: an isolated droplet, drawn as a ball.
pub const MENISCUS_CLASS_SPLASH: u32 = 0;
/// A class of particles: part of the liquid body.
pub const MENISCUS_CLASS_BODY: u32 = 1;

/// One frame of particles, in world units, in the host's memory. Arrays are read before the call returns.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusParticles {
    /// sizeof(MeniscusParticles).
    pub struct_size: usize,
    /// Centres: three floats each.
    pub positions: *const f32,
    /// How many particles there are.
    pub count: usize,
    /// Particle radius: half the rest spacing.
    pub radius: f32,
    /// Below what share of a filled body's density the classes were kept (meniscus_classify's `upper`), or 0.
    pub keep_class_below: f32,
    /// Velocities, three floats each, in world units a second; or null. For spray.
    pub velocities: *const f32,
    /// Classes (MENISCUS_CLASS_...), one byte each, to use instead of the threshold's; or null.
    pub classes: *const u8,
    /// Semi-axes, three vectors of three floats each, to use instead of fitted ones for particles of the body; or null.
    pub axes: *const f32,
    /// VK_TRUE to leave out what only a density field needs (layers "field", the default).
    pub without_points: VkBool32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C); its size first; no padding (a test adds it up); numbers and pointers that may be null.
unsafe impl Versioned for MeniscusParticles {
    const NAME: &'static str = "MeniscusParticles";
    const LEAST: usize = offset_of!(MeniscusParticles, keep_class_below);

    fn reserved(&self) -> u32 {
        self.reserved
    }
}

/// How many particles went which way.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusReport {
    /// sizeof(MeniscusReport).
    pub struct_size: usize,
    /// Particles drawn as splash.
    pub splash: usize,
    /// Particles drawn as body.
    pub body: usize,
    /// Of the body, left spheres for want of neighbours.
    pub few_neighbours: usize,
    /// Of the body, left spheres because their neighbours coincide.
    pub degenerate: usize,
    /// Of the body, cut to the longest semi-axis.
    pub clamped_long: usize,
    /// Of the body, thickened to the shortest semi-axis, or to the largest ratio.
    pub clamped_ratio: usize,
    /// Splashes that came with an ellipsoid other than the ball they are drawn as.
    pub splash_axes_ignored: usize,
}

// SAFETY: repr(C); its size first; no padding (a test adds it up); numbers.
unsafe impl Versioned for MeniscusReport {
    const NAME: &'static str = "MeniscusReport";
    const LEAST: usize = offset_of!(MeniscusReport, few_neighbours);
}

/// A particle as it is drawn.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusEllipsoid {
    /// Centre.
    pub center: [f32; 3],
    /// The three semi-axis vectors, one after the other.
    pub axes: [f32; 9],
}

/// A particle as a density field takes it.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusPoint {
    /// Where it is.
    pub position: [f32; 3],
    /// Its number density, as a part of a filled body's; above 0.
    pub density: f32,
    /// MENISCUS_CLASS_...
    pub kind: u32,
}

/// Particles, prepared; for any renderer. Any number of threads may read it.
pub struct MeniscusPrepared {
    pub(crate) particles: Particles,
    pub(crate) speeds: Option<Vec<f32>>,
    pub(crate) points: Option<Vec<Point>>,
    report: prepare::Report,
}

/// How dense the liquid is anywhere. Any number of threads may read it.
pub struct MeniscusDensity {
    field: DensityField,
}

/// A class of C's.
pub(crate) fn class(number: u32) -> Result<Class, Failure> {
    match number {
        MENISCUS_CLASS_SPLASH => Ok(Class::Splash),
        MENISCUS_CLASS_BODY => Ok(Class::Body),
        other => Err(Failure::parameter(format!("a particle of class {other}: use one of MENISCUS_CLASS_..."))),
    }
}

/// # Safety
/// As [`slice`].
unsafe fn classes(given: *const u8, count: usize) -> Result<Option<Vec<Class>>, Failure> {
    if given.is_null() {
        return Ok(None);
    }
    // SAFETY: this function's contract.
    let given = unsafe { slice(given, count, "classes") }?;
    given.iter().map(|c| class(u32::from(*c))).collect::<Result<_, _>>().map(Some)
}

/// Values that may be left out.
///
/// # Safety
/// As [`slice`].
unsafe fn some<'a, T: Copy>(from: *const T, count: usize, what: &str) -> Result<Option<&'a [T]>, Failure> {
    // SAFETY: this function's contract.
    (!from.is_null()).then(|| unsafe { slice(from, count, what) }).transpose()
}

/// Classifies particles and gives each its shape, by the preparation's settings (splash_threshold and so on): what a renderer takes
/// with meniscus_renderer_set_prepared. The order of the particles changes nothing. Runs on all cores, and may run on any thread.
///
/// # Safety
/// `particles` is null or a MeniscusParticles with its size, whose arrays are null or hold what is said of them; `settings` is null
/// or settings; `prepared` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_prepare(
    particles: *const MeniscusParticles,
    settings: *const MeniscusSettings,
    prepared: *mut *mut MeniscusPrepared,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    guard(|| unsafe {
        give(prepared, || {
            let p = read(particles)?;
            let options = &borrow(settings, "the settings")?.options;
            let positions = slice(p.positions.cast::<Vec3>(), p.count, "positions")?;
            let velocities = some(p.velocities.cast::<Vec3>(), p.count, "velocities")?;
            let axes = some(p.axes.cast::<Mat3>(), p.count, "axes")?;
            let classes = classes(p.classes, p.count)?;
            let input = Input::new(positions, p.radius)
                .classes(classes.as_deref())
                .ellipsoids(axes)
                .keep_class_below((p.keep_class_below != 0.0).then_some(p.keep_class_below));
            let (particles, report, speeds) = match velocities {
                Some(velocities) => {
                    let (particles, report, speeds) =
                        prepare::prepare_with_velocities(&input, velocities, options, &|_| ())?;
                    (particles, report, Some(speeds))
                }
                None => {
                    let (particles, report) = prepare::prepare(&input, options)?;
                    (particles, report, None)
                }
            };
            let points = (p.without_points == 0).then(|| prepare::points(&input, options)).transpose()?;
            Ok(MeniscusPrepared { particles, speeds, points, report })
        })
    })
}

/// Fills a report, whose struct_size is set, of how many particles went which way.
///
/// # Safety
/// `prepared` is null or prepared particles; `report` is null or a MeniscusReport with its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_prepared_report(
    prepared: *const MeniscusPrepared,
    report: *mut MeniscusReport,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let r = unsafe { borrow(prepared, "the prepared particles") }?.report;
        let value = MeniscusReport {
            struct_size: size_of::<MeniscusReport>(),
            splash: r.splash,
            body: r.body,
            few_neighbours: r.few_neighbours,
            degenerate: r.degenerate,
            clamped_long: r.clamped_long,
            clamped_ratio: r.clamped_ratio,
            splash_axes_ignored: r.splash_axes_ignored,
        };
        // SAFETY: this function's contract.
        unsafe { write(report, value) }
    })
}

/// Destroys prepared particles; null is none.
///
/// # Safety
/// `prepared` is null, or prepared particles that nobody uses any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_prepared_destroy(prepared: *mut MeniscusPrepared) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        drop(unsafe { take(prepared) });
        Ok(())
    })
}

/// Tells the class of each particle (MENISCUS_CLASS_..., one byte each, in their order), by the setting splash_threshold. Against
/// popping from frame to frame a particle of `last` class keeps it while its density lies between that threshold and `upper`: give
/// the result to meniscus_prepare, and `upper` as keep_class_below. `last` may be null, and then `upper` counts for nothing; it may
/// be `classes`.
///
/// # Safety
/// `positions` is null or three floats for each of `count` particles; `settings` is null or settings; `last` is null or `count`
/// bytes; `classes` is null or has room for as many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_classify(
    positions: *const f32,
    count: usize,
    radius: f32,
    settings: *const MeniscusSettings,
    last: *const u8,
    upper: f32,
    classes: *mut u8,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let (positions, options, last) = unsafe {
            let positions = slice(positions.cast::<Vec3>(), count, "positions")?;
            (positions, &borrow(settings, "the settings")?.options, self::classes(last, count)?)
        };
        if classes.is_null() && count > 0 {
            return Err(Failure::argument("where the classes are to be told is null: give room for one byte each"));
        }
        let found = prepare::classify(positions, radius, options, last.as_deref().map(|last| (last, upper)))?;
        for (i, class) in found.into_iter().enumerate() {
            // SAFETY: this function's contract: there is room for `count`.
            unsafe { classes.add(i).write(class as u8) };
        }
        Ok(())
    })
}

/// Guesses the particle radius from the nearest neighbours' distances, good to about 7 % on simulated liquid; a radius from the
/// simulation is always better. MENISCUS_STATUS_ERROR_PARAMETER where fewer than two places are distinct.
///
/// # Safety
/// `positions` is null or three floats for each of `count` particles; `radius` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_estimate_radius(
    positions: *const f32,
    count: usize,
    radius: *mut f32,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let positions = unsafe { slice(positions.cast::<Vec3>(), count, "positions") }?;
        let found = prepare::estimate_radius(positions).ok_or_else(|| {
            Failure::parameter("no two of the positions are finite and distinct: give the radius of the simulation")
        })?;
        // SAFETY: this function's contract.
        unsafe { tell(radius, found) };
        Ok(())
    })
}

/// Sorts particles, to be asked how dense the liquid is, for instance at the eye.
///
/// # Safety
/// `positions` is null or three floats for each of `count` particles; `settings` is null or settings; `density` is null or can be
/// written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_density_create(
    positions: *const f32,
    count: usize,
    radius: f32,
    settings: *const MeniscusSettings,
    density: *mut *mut MeniscusDensity,
) -> MeniscusStatus {
    // SAFETY: this function's contract.
    guard(|| unsafe {
        give(density, || {
            let positions = slice(positions.cast::<Vec3>(), count, "positions")?;
            let options = &borrow(settings, "the settings")?.options;
            Ok(MeniscusDensity { field: DensityField::new(positions, radius, options)? })
        })
    })
}

/// Tells the liquid's density at a point, as a part of a filled body's: about 1 inside the liquid at rest, a half on a flat surface.
///
/// # Safety
/// `density` is null or a density; `point` is null or three floats; `value` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_density_at(
    density: *const MeniscusDensity,
    point: *const f32,
    value: *mut f32,
) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        let (density, point) = unsafe { (borrow(density, "the density")?, slice(point, 3, "the point")?) };
        // SAFETY: as above.
        unsafe { tell(value, density.field.relative_density(Vec3::from_slice(point))) };
        Ok(())
    })
}

/// Destroys a density; null is none.
///
/// # Safety
/// `density` is null, or a density that nobody uses any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meniscus_density_destroy(density: *mut MeniscusDensity) -> MeniscusStatus {
    guard(|| {
        // SAFETY: this function's contract.
        drop(unsafe { take(density) });
        Ok(())
    })
}
