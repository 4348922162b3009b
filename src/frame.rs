//! THE FRAME, from top to bottom. Everything a frame does is a line here. A pass has one stem: its shader is in `glsl/`,
//! its CPU twin and its test go by the same name.

use crate::{
    Error,
    input::Background,
    layers::{Kind, Surfaces},
    passes::{Arrays, Points, compact, cull, extent, eye, first_surface, occlude, shape, sort, surface},
    plan::{Home, Plan},
    scale::Scale,
    scene::Scene,
    smooth,
};

/// The passes of one frame. What a scene does not need is not there: no splash particles, no splash maps; one refraction,
/// no back maps; no particles at all, only the background.
pub(crate) fn plan(scene: &Scene) -> Result<Plan, Error> {
    let mut plan = Plan::new(scene.size);
    let method = &scene.settings.method;
    let mut surfaces = Surfaces::default();
    if scene.count > 0 {
        plan.work_for(Home::Particles, "particles");
        // From positions on the device: their box, their neighbours (Im16 §III).
        let sorted = scene.prepare.as_ref().map(|p| {
            let extent = extent::record(&mut plan, scene, &p.constants);
            (p, extent, sort::record(&mut plan, scene, p, extent))
        });
        match method.layers.member().kind() {
            Kind::Maps(maps) => {
                let particles = match &sorted {
                    // Classes and ellipsoids (YuTurk13).
                    Some((p, extent, sorted)) => shape::record(&mut plan, scene, p, *extent, sorted),
                    None => Arrays::given(&mut plan),
                };

                plan.work_for(Home::View, "visibility");
                // Whether the eye is in the body: the maps do not tell.
                if eye::wanted(scene) {
                    eye::record(&mut plan, sorted.as_ref());
                }
                // Optics that upsample have the surfaces at half the picture's width and height (Cords08 §5).
                plan.work_at(scene.scale());
                // Which particles can show at all.
                let bounds = occlude::wanted(scene, maps).then(|| occlude::record(&mut plan, scene, &particles));
                let culled = cull::record(&mut plan, scene, &particles, bounds);
                let drawn = compact::record(&mut plan, scene, &particles, &culled);
                // The liquid's surfaces (Imai16 §4.2), the body's smoothed (Imai16 §4.3).
                plan.work_for(Home::View, "layers");
                let layered = maps.record(&mut plan, scene, &drawn);
                plan.work_for(Home::View, "smooth");
                plan.smoothing_steps = scene.smoothing_steps;
                surfaces.body = layered.body.map(|body| smooth::record(&mut plan, &method.smooth, &body));
                (surfaces.splash, surfaces.thickness, surfaces.speed) =
                    (layered.splash, layered.thickness, layered.speed);
                surfaces.tiles = culled.tiles;
                plan.work_at(Scale::Full);
            }
            Kind::Field(field) => {
                let points = match &sorted {
                    // The same without ellipsoids: nobody draws them.
                    Some((p, extent, sorted)) => shape::points(&mut plan, scene, p, *extent, sorted),
                    None => Points::given(&mut plan),
                };
                // A density field around them (Iwasaki06), whose level is the surface.
                plan.work_for(Home::Particles, "field");
                surfaces.field = Some(field.record(&mut plan, scene, &points));
            }
        }
    }
    #[cfg(feature = "inspect")]
    {
        plan.surfaces = surfaces.names(&plan);
    }
    plan.work_for(Home::View, "optics");
    // Light through them (Imai16 §4.4, §4.5). Without liquid the host's picture stays.
    if scene.count > 0 || scene.walks || scene.background == Background::Environment {
        method.optics.member().record(&mut plan, scene, &surfaces);
    }
    // What later passes of the host's are told of the first surface.
    if scene.count > 0 && (scene.surface_read || scene.surface_formats().next().is_some()) {
        plan.work_for(Home::View, "surface");
        let first = first_surface::record(&mut plan, scene, &surfaces);
        surface::record(&mut plan, scene, first);
    }
    plan.finish()
}
