//! What can be asked for and made before a frame is recorded: its memory and its pipelines.

use super::{
    HOMES, Renderer,
    uploads::{PARTICLE_ARRAYS, POINTS, SPEEDS, check_count, check_most_points, check_points_count},
};
use crate::{
    Error, Settings,
    device::{BINDING_ALIGNMENT, Host, Limits},
    frame,
    input::{Background, EnvironmentShape, FrameInput},
    plan::{Made, Plan},
    prepare::{self, DeviceIds, DevicePositions, Search},
    resources::Spec,
    scene::{Preparation, Scene},
    table::{self, LedgerEntry, Table},
};
use ash::vk;
use std::collections::HashSet;

/// How many particles frames will draw.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Amount<'a> {
    /// Prepared on the host.
    Prepared {
        /// On their own.
        splash: usize,
        /// Of the body.
        body: usize,
    },
    /// Prepared on the device.
    OnDevice(&'a DevicePositions),
}

impl Amount<'_> {
    /// Puts them into a scene.
    pub(crate) fn fill(self, scene: &mut Scene) -> Result<(), Error> {
        match self {
            Amount::Prepared { splash, body } => {
                (scene.count, scene.splash, scene.body) = ((splash + body) as u32, splash > 0, body > 0);
            }
            Amount::OnDevice(p) => {
                scene.count = p.count;
                scene.counted = p.device_count.is_some();
                // Only the device will know whether there are particles of each class.
                (scene.splash, scene.body) = (p.count > 0, p.count > 0);
                let constants = p.constants(BINDING_ALIGNMENT)?;
                let yu_turk = p.options.ellipsoids == prepare::Fit::YuTurk;
                let (entries, kept) = (p.entries(), p.kept());
                let made = Preparation { constants, entries, yu_turk, kept, anew: true, neighbours: 0 };
                scene.prepare = (p.count > 0).then_some(made);
            }
        }
        Ok(())
    }
}

impl Renderer {
    /// Device memory that frames of a size take, resource by resource, before anything is allocated. Particles that the
    /// host prepared are extra, 36 bytes each, 4 more with their speeds and 16 with their points, and a static environment map, 16 bytes a texel.
    pub fn memory_requirements(
        &self,
        size: [u32; 2],
        amount: Amount,
        settings: &Settings,
    ) -> Result<Vec<LedgerEntry>, Error> {
        self.check_size(size)?;
        settings.validate()?;
        let mut scene = Scene::new(settings, size, [0, 0], &self.limits);
        amount.fill(&mut scene)?;
        Ok(table::ledger(&self.host.device, &frame::plan(&scene)?))
    }

    /// Refuses so many particles as no frame of this size and these settings can draw, before they are prepared, which may take
    /// minutes: [`Renderer::set_particles`] and [`Renderer::record`] would refuse them after it. Whether there is memory for them is not looked
    /// at.
    pub fn check_amount(&self, size: [u32; 2], amount: Amount, settings: &Settings) -> Result<(), Error> {
        self.check_size(size)?;
        check_amount(&self.limits, size, amount, settings)
    }

    /// Device memory in use now, resource by resource.
    pub fn memory(&self) -> Vec<LedgerEntry> {
        let mut ledger: Vec<_> = self.tables.iter().flat_map(Table::ledger).collect();
        let entry = |name, bytes, per_particle| LedgerEntry { name, bytes, per_particle };
        let particles = PARTICLE_ARRAYS.into_iter().zip(self.particles.iter().flatten());
        ledger.extend(particles.map(|(name, b)| entry(name, b.bytes, true)));
        ledger.extend(self.speeds.iter().map(|b| entry(SPEEDS, b.bytes, true)));
        ledger.extend(self.points.iter().map(|b| entry(POINTS, b.bytes, true)));
        ledger.extend(self.environment.iter().map(|own| entry("environment", own.image.bytes, false)));
        ledger
    }

    /// Compiles, on all cores, whatever frames with these settings can need, so that recording them compiles nothing:
    /// with particles of either class, of both or of none, prepared on the host or on the device, with and without a scene,
    /// before either background, in its own environment and the host's of either shape. Says how many pipelines were made; those that were there
    /// already count for nothing. To be called after [`Renderer::resize`], when there is time: at loading, say.
    ///
    /// Not what [`FrameInput::surface`] asks for, whose formats are not known here: [`Renderer::warm_up_like`] makes those. Drivers on
    /// CPUs (lavapipe) put off some of their own compiling to the first draw all the same.
    ///
    /// That is dozens of pipelines; [`Renderer::warm_up_like`] makes those of one kind of frame. Without either, what a
    /// frame needs is compiled when it is first recorded.
    pub fn warm_up(&mut self, settings: &Settings) -> Result<usize, Error> {
        settings.validate()?;
        let size = self.size.map(|s| s.max(1));
        let scene = |classes| {
            let mut scene = Scene::new(settings, size, classes, &self.limits);
            scene.output = self.output;
            scene
        };
        let mut scenes = Vec::new();
        for classes in [[0, 0], [1, 0], [0, 1], [1, 1]] {
            for has_scene in [false, true] {
                for background in [Background::Environment, Background::Host] {
                    for environment in [None, Some(EnvironmentShape::Equirect), Some(EnvironmentShape::Cube)] {
                        scenes.push(Scene { has_scene, background, environment, ..scene(classes) });
                    }
                }
            }
        }
        for search in [Search::Runs, Search::Relation] {
            for ellipsoids in [prepare::Fit::InPlace, prepare::Fit::YuTurk] {
                let options = prepare::Options { search, ellipsoids, ..Default::default() };
                let plain = DevicePositions::packed(vk::Buffer::null(), 1, 1.0).options(options);
                let kept = plain.keep_class_below(1.0);
                for positions in [plain, kept, kept.ids(DeviceIds::packed(vk::Buffer::null(), 1))] {
                    let mut scene = Scene { eye_on_device: true, ..scene([0, 0]) };
                    Amount::OnDevice(&positions).fill(&mut scene)?;
                    scenes.push(scene);
                }
            }
        }
        let plans: Vec<_> = scenes.iter().map(frame::plan).collect::<Result<_, _>>()?;
        let recipes: HashSet<_> = plans.iter().flat_map(Plan::recipes).collect();
        self.pipelines.make(&self.host, recipes)
    }

    /// Compiles what a frame like this one needs and is not there yet, of the particles last given or of its positions.
    /// Of what it names (outputs, buffers, images) nothing is touched; null handles will do. Says how many pipelines were
    /// made.
    pub fn warm_up_like(&mut self, input: &FrameInput) -> Result<usize, Error> {
        input.settings.validate()?;
        let plan = frame::plan(&self.scene_of(input)?)?;
        self.pipelines.make(&self.host, plan.recipes())
    }
}

/// Refuses so many particles as no frame of this size and these settings can draw on a device, before they are prepared.
pub(crate) fn check_amount(limits: &Limits, size: [u32; 2], amount: Amount, settings: &Settings) -> Result<(), Error> {
    settings.validate()?;
    let positions = match amount {
        Amount::Prepared { splash, body } => {
            check_count(limits, splash + body)?;
            if settings.method.layers.field().is_some() {
                check_points_count(limits, splash + body)?;
            }
            None
        }
        Amount::OnDevice(positions) => Some(positions),
    };
    let mut scene = Scene::new(settings, size, [0, 0], limits);
    amount.fill(&mut scene)?;
    check_most_points(&scene)?;
    check_bindings(limits, &frame::plan(&scene)?, scene.count, positions)
}

/// Refuses particles whose buffers the device cannot bind.
pub(super) fn check_bindings(
    limits: &Limits,
    plan: &Plan,
    count: u32,
    positions: Option<&DevicePositions>,
) -> Result<(), Error> {
    let largest = limits.storage_size;
    let asked = |stride| BINDING_ALIGNMENT + stride * u64::from(count);
    let given = positions.into_iter().flat_map(|p| {
        [("positions (host's)", asked(p.stride)), ("ids (host's)", p.ids.map_or(0, |ids| asked(ids.stride)))]
    });
    let entries = positions.map_or(0, DevicePositions::entries);
    let buffers = plan.resources.iter().filter_map(|r| match r.made {
        Made::Own(Spec::Buffer { bytes, .. }) => Some((r.name, bytes)),
        _ => None,
    });
    for (name, bytes) in buffers.chain(given) {
        if bytes > largest || entries > u64::from(u32::MAX) {
            let remedy = format!("{name} would take {bytes} bytes; this device binds {largest} at most");
            return Err(Error::parameter("particles", count, remedy));
        }
    }
    Ok(())
}

/// Refuses a frame that does not fit the device, before anything is made for it.
pub(super) fn check_memory(host: &Host, limits: &Limits, tables: &[Table; 2], plan: &Plan) -> Result<(), Error> {
    if tables.iter().zip(HOMES).all(|(table, home)| table.fits(plan, home)) {
        return Ok(());
    }
    let needed: u64 = table::ledger(&host.device, plan).iter().map(|e| e.bytes).sum();
    match needed.checked_sub(limits.memory) {
        None | Some(0) => Ok(()),
        Some(missing) => Err(Error::MemoryShort { needed, available: limits.memory, missing }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Method;

    /// lavapipe's.
    const LIMITS: Limits = Limits {
        point_size: 255.0,
        image_size: 16384,
        timestamp_period: None,
        timestamp_mask: 0,
        storage_size: 128 << 20,
        texels_size: 16 * (128 << 20),
        memory: 1 << 34,
        cpu: true,
    };

    fn refused(method: &str, amount: Amount) -> Option<String> {
        let settings = Settings { method: Method::preset(method).expect("a preset"), ..Settings::default() };
        check_amount(&LIMITS, [640, 480], amount, &settings).err().map(|e| e.to_string())
    }

    #[test]
    fn more_particles_than_a_device_binds_are_refused_ahead() {
        let bodies = |body| Amount::Prepared { splash: 0, body };
        // Three floats each are bound of all, four of those of a field.
        let [all, field] = [12, 16].map(|each| (128 << 20) / each);
        assert_eq!(refused("field", bodies(1000)), None);
        assert_eq!(refused("imai16", bodies(1000)), None);
        let said = refused("field", bodies(field + 1)).expect("too many");
        assert!(said.contains("8388609") && said.contains("holds 8388608 at most"), "{said}");
        let said = refused("imai16", bodies(all + 1)).expect("too many");
        assert!(said.contains(&format!("holds {all} at most")), "{said}");
        // What the device prepares is bound where it lies: alone it would fit.
        let positions = DevicePositions::packed(vk::Buffer::null(), all as u32, 1.0);
        let said = refused("imai16", Amount::OnDevice(&positions)).expect("too many");
        assert!(said.contains("would take") && said.contains("binds 134217728 at most"), "{said}");
        let few = DevicePositions::packed(vk::Buffer::null(), 1000, 1.0);
        assert_eq!(refused("imai16", Amount::OnDevice(&few)), None);
        // Of large pictures no more than of small ones hangs on particles.
        assert_eq!(refused("imai16", bodies(0)), None);
    }
}
