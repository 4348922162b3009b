//! The renderer's own resources: kept from frame to frame while plans ask for the same, with the state each is in.

use crate::{
    Error,
    access::State,
    allocator::Location,
    device::Host,
    plan::{Home, Made, Plan},
    resources::{Buffer, Image, Resource, Retired, Spec},
};
use ash::vk;
use std::collections::BTreeMap;

pub(crate) struct Entry {
    pub resource: Resource,
    pub spec: Spec,
    pub state: State,
}

/// One line of the memory ledger.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct LedgerEntry {
    /// Resource name.
    pub name: &'static str,
    /// Device memory in bytes, as the driver requires it.
    pub bytes: u64,
    /// Whether it grows with the number of particles.
    pub per_particle: bool,
}

/// The resources of one home, by name.
#[derive(Default)]
pub(crate) struct Table(BTreeMap<&'static str, (Entry, bool)>);

/// The resources that a plan makes for one home.
fn wanted(plan: &Plan, home: Home) -> impl Iterator<Item = (&'static str, Spec, bool)> {
    plan.resources.iter().filter(move |r| r.home == home).filter_map(|r| match r.made {
        Made::Own(spec) => Some((r.name, spec, r.per_particle)),
        Made::Given(_) => None,
    })
}

impl Table {
    /// Makes what a plan asks for and is not there, retires what it no longer asks for.
    pub fn fit(
        &mut self,
        host: &Host,
        plan: &Plan,
        home: Home,
        retired: &mut Retired,
        frame: u64,
    ) -> Result<(), Error> {
        let all: BTreeMap<_, _> = wanted(plan, home).map(|(name, spec, per)| (name, (spec, per))).collect();
        let stale: Vec<_> =
            self.0.iter().filter(|(n, (e, _))| all.get(*n).map(|w| w.0) != Some(e.spec)).map(|(n, _)| *n).collect();
        for name in stale {
            if let Some((old, _)) = self.0.remove(name) {
                retired.push(frame, old.resource);
            }
        }
        for (name, (spec, per_particle)) in all {
            if self.0.contains_key(name) {
                continue;
            }
            let resource = match &spec {
                Spec::Image(image) => Resource::Image(Image::new(host, name, image)?),
                Spec::Buffer { bytes, usage } => {
                    Resource::Buffer(Buffer::new(host, name, *bytes, *usage, Location::Device)?)
                }
            };
            self.0.insert(name, (Entry { resource, spec, state: State::default() }, per_particle));
        }
        Ok(())
    }

    /// Whether all that a plan asks for is there.
    pub fn fits(&self, plan: &Plan, home: Home) -> bool {
        wanted(plan, home).all(|(name, spec, _)| self.0.get(name).is_some_and(|(e, _)| e.spec == spec))
    }

    /// Forgets contents: every frame makes everything anew.
    pub fn discard_contents(&mut self) {
        self.0.values_mut().for_each(|(e, _)| e.state.discard());
    }

    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.0.get(name).map(|(e, _)| e)
    }

    pub fn get_mut(&mut self, name: &str) -> Option<&mut Entry> {
        self.0.get_mut(name).map(|(e, _)| e)
    }

    /// Names of everything that is there.
    #[cfg(feature = "inspect")]
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.0.keys().copied()
    }

    /// Driver's size of each resource.
    pub fn ledger(&self) -> impl Iterator<Item = LedgerEntry> {
        self.0.iter().map(|(name, (e, per_particle))| LedgerEntry {
            name,
            bytes: match &e.resource {
                Resource::Image(i) => i.bytes,
                Resource::Buffer(b) => b.bytes,
            },
            per_particle: *per_particle,
        })
    }

    pub fn retire_all(&mut self, retired: &mut Retired, frame: u64) {
        for (_, (e, _)) in std::mem::take(&mut self.0) {
            retired.push(frame, e.resource);
        }
    }
}

/// Memory that a plan takes, resource by resource, asked of the driver without allocating.
pub(crate) fn ledger(device: &ash::Device, plan: &Plan) -> Vec<LedgerEntry> {
    let entry = |(name, spec, per_particle)| {
        let mut requirements = vk::MemoryRequirements2::default();
        match spec {
            Spec::Image(spec) => {
                let create = spec.info();
                let info = vk::DeviceImageMemoryRequirements::default().create_info(&create);
                // SAFETY: core in 1.3; the create info is complete and outlives the call.
                unsafe { device.get_device_image_memory_requirements(&info, &mut requirements) };
            }
            Spec::Buffer { bytes, usage } => {
                let create = vk::BufferCreateInfo::default().size(bytes).usage(usage);
                let info = vk::DeviceBufferMemoryRequirements::default().create_info(&create);
                // SAFETY: as above.
                unsafe { device.get_device_buffer_memory_requirements(&info, &mut requirements) };
            }
        }
        LedgerEntry { name, bytes: requirements.memory_requirements.size, per_particle }
    };
    [Home::Particles, Home::View].into_iter().flat_map(|home| wanted(plan, home)).map(entry).collect()
}
