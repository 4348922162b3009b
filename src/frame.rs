//! THE FRAME, from top to bottom. Everything a frame does is a line here; each pass lives in `src/passes/` with its
//! shader in `glsl/`, its CPU twin in `src/twin/` and its test in `tests/gpu/`, all under the same name.

use crate::{
    Error, input::Background, passes::Passes, recorder::Recorder, settings::Settings, shader::Prepare, targets::Needs,
};

/// Records the passes of one frame. What a scene does not need is not there: no splash particles, no splash maps; one
/// refraction, no back maps; no particles at all, only the background.
pub(crate) fn record(
    r: &mut Recorder,
    passes: &mut Passes,
    needs: &Needs,
    settings: &Settings,
    prepare: Option<&Prepare>,
) -> Result<(), Error> {
    if needs.count > 0 {
        // Counters to zero, bounds to "nothing is certain".
        passes.reset.record(r, needs)?;
        if let Some(prepare) = prepare {
            // From positions on the device: their box, their neighbours (Im16 §III), classes and ellipsoids (YuTurk13).
            passes.extent.record(r, needs, prepare)?;
            passes.sort.record(r, needs, prepare)?;
            passes.shape.record(r, needs, prepare)?;
        }
        // Which particles can show at all.
        if needs.body && needs.occlusion {
            passes.occlude.record(r, needs)?;
        }
        passes.cull.record(r, needs)?;
        passes.compact.record(r, needs)?;
        // Nearest fronts and farthest backs of both classes, ray-cast (Imai16 §4.2).
        passes.splat.record(r, needs)?;
    }
    if needs.body {
        // The body's surfaces, smoothed (Imai16 §4.3). A smoothing filter goes here.
        for iteration in 0..needs.iterations {
            passes.plane_fit.record(r, needs, settings, iteration)?;
        }
        if needs.iterations > 0 {
            passes.normals.record(r, needs)?;
        }
    }
    if needs.tiles() {
        // Where rays outside the liquid need not look for a second volume.
        passes.tiles.record(r, needs)?;
    }
    // Up to four refractions, and the light they bring back (Imai16 §4.4, §4.5). Without liquid the host's picture stays.
    if needs.count > 0 || needs.debug || r.externals.background == Background::Environment {
        passes.refract.record(r, needs, settings)?;
    }
    Ok(())
}
