//! What a frame does, as data: the resources that its passes make, and their steps in order. Passes write it
//! (`src/frame.rs` is the frame), the memory ledger, the pools and the pipelines follow from it, and
//! [`crate::recorder`] records it.

mod call;
mod declare;
mod step;
#[cfg(test)]
mod tests;

pub(crate) use call::{Blend, Call, Recipe};
#[cfg(feature = "inspect")]
pub(crate) use declare::COUNTERS;
#[cfg(feature = "inspect")]
pub use declare::SurfaceNames;
pub(crate) use step::{Groups, Rendering, Step, Vertices, Work};

use crate::{
    Error,
    access::Access,
    input::Says,
    resources::{ImageSpec, Spec},
    scale::Scale,
};
use ash::vk;
use std::hash::{DefaultHasher, Hash, Hasher};

/// A resource of one plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Target(usize);

/// What a resource is there for: one set of particles, or one view of them. Each has a table of its own, so that several
/// views can share the particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Home {
    Particles,
    View,
}

/// What the frame uses and does not own; barriers for it are its owner's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum External {
    /// The slot's uniform block for passes at this scale, which the host has just written.
    FrameBlock(Scale),
    Positions,
    /// How many they are.
    Count,
    Ids,
    Centers,
    Diagonals,
    Mixed,
    Speeds,
    Points,
    /// The host's.
    Environment,
    /// The renderer's own.
    Footprints,
    SceneColor,
    SceneDepth,
    Output(vk::Format),
    /// What the host is told of the first surface.
    Surface(Says, vk::Format),
    /// Particles that move, how many they are, and how.
    MovingPositions,
    MovingCount,
    Motions,
}

/// How a resource comes to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Made {
    Own(Spec),
    Given(External),
}

pub(crate) struct Declared {
    /// In the ledger, in the printed barriers and (after "meniscus") in debuggers; no two resources of a plan share one.
    pub name: &'static str,
    pub home: Home,
    pub made: Made,
    /// Whether its size is proportional to the number of particles.
    pub per_particle: bool,
}

/// A frame's resources and steps.
pub(crate) struct Plan {
    /// Width and height of the picture in pixels.
    pub picture: [u32; 2],
    pub resources: Vec<Declared>,
    pub steps: Vec<Step>,
    /// Names of the counters of each home.
    pub counters: [Vec<&'static str>; 2],
    /// Smoothing takes no more steps than so many.
    pub smoothing_steps: Option<u32>,
    /// Where the surfaces are that light meets.
    #[cfg(feature = "inspect")]
    pub surfaces: SurfaceNames,
    home: Home,
    part: &'static str,
    scale: Scale,
    /// What a pass got wrong first.
    wrong: Option<Error>,
}

impl Plan {
    /// An empty frame of so many pixels.
    pub fn new(picture: [u32; 2]) -> Plan {
        Plan {
            picture,
            resources: Vec::new(),
            steps: Vec::new(),
            counters: Default::default(),
            smoothing_steps: None,
            #[cfg(feature = "inspect")]
            surfaces: Default::default(),
            home: Home::Particles,
            part: "",
            scale: Scale::Full,
            wrong: None,
        }
    }

    /// Says what the passes that follow work for, and as what part of the frame.
    pub fn work_for(&mut self, home: Home, part: &'static str) {
        (self.home, self.part) = (home, part);
    }

    /// Says at what scale of the picture the passes that follow work: the maps that they declare and the block that they read
    /// are of that scale.
    pub fn work_at(&mut self, scale: Scale) {
        self.scale = scale;
    }

    /// Width and height of the view in pixels, at the scale of the passes at work.
    pub fn size(&self) -> [u32; 2] {
        self.scale.size(self.picture)
    }

    /// The plan, unless a pass declared something that cannot be.
    pub fn finish(mut self) -> Result<Plan, Error> {
        self.reset_counters();
        // Whatever can be copied may be asked for afterwards.
        #[cfg(feature = "inspect")]
        for declared in &mut self.resources {
            match &mut declared.made {
                Made::Own(Spec::Buffer { usage, .. }) => *usage |= vk::BufferUsageFlags::TRANSFER_SRC,
                Made::Own(Spec::Image(spec)) if spec.format != vk::Format::D32_SFLOAT => {
                    spec.usage |= vk::ImageUsageFlags::TRANSFER_SRC;
                }
                _ => {}
            }
        }
        match self.wrong.take() {
            Some(e) => Err(e),
            None => Ok(self),
        }
    }

    /// Says what a pass got wrong; the first of these becomes the plan's error.
    pub fn refuse(&mut self, pass: &'static str, problem: String) {
        self.wrong.get_or_insert(Error::Pass { pass, problem });
    }

    /// Says what the device or the settings have no room for; the first error becomes the plan's.
    pub fn fail(&mut self, error: Error) {
        self.wrong.get_or_insert(error);
    }

    pub fn resource(&self, target: Target) -> &Declared {
        &self.resources[target.0]
    }

    /// The resource of this name, if the frame has one.
    pub fn find(&self, name: &str) -> Option<Target> {
        self.resources.iter().position(|r| r.name == name).map(Target)
    }

    /// Bytes of a buffer of the frame's own.
    pub fn bytes(&self, target: Target) -> Option<u64> {
        match self.resource(target).made {
            Made::Own(Spec::Buffer { bytes, .. }) => Some(bytes),
            _ => None,
        }
    }

    /// How an image of the frame's own is made.
    fn image_spec(&self, target: Target) -> Option<&ImageSpec> {
        match &self.resource(target).made {
            Made::Own(Spec::Image(spec)) => Some(spec),
            _ => None,
        }
    }

    /// Notes a use of a resource: what it is used for decides what it has to be made for.
    fn used(&mut self, pass: &'static str, target: Target, access: Access) {
        let declared = &mut self.resources[target.0];
        let fits = match &mut declared.made {
            Made::Given(_) => true,
            Made::Own(Spec::Image(spec)) => access.image_usage().map(|usage| spec.usage |= usage).is_some(),
            Made::Own(Spec::Buffer { usage, .. }) => access.buffer_usage().map(|more| *usage |= more).is_some(),
        };
        if !fits {
            let name = declared.name;
            self.refuse(pass, format!("{name} cannot be used for {access:?}"));
        }
    }

    /// What is done for the particles, whatever the view, as a number: that of a plan which does the same to resources made in the
    /// same way is the same.
    pub fn work_for_particles(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        for step in self.steps.iter().filter(|s| s.home == Home::Particles) {
            step.hash(&mut hasher);
            step.uses.iter().for_each(|(target, _)| self.resource(*target).made.hash(&mut hasher));
        }
        hasher.finish()
    }

    /// Leaves out what is done for the particles: they are as they were, and so is all that follows from them alone.
    pub fn keep_particles(&mut self) {
        self.steps.retain(|s| s.home != Home::Particles);
    }

    /// Every pipeline that the frame binds, each once, with the pass that binds it first.
    pub fn pipelines(&self) -> Vec<(&'static str, &Recipe)> {
        let mut all: Vec<(&str, &Recipe)> = Vec::new();
        for (pass, call) in self.steps.iter().flat_map(|step| step.calls().map(|call| (step.pass, call))) {
            if !all.iter().any(|(_, recipe)| *recipe == &call.recipe) {
                all.push((pass, &call.recipe));
            }
        }
        all
    }

    /// The same without their passes.
    pub fn recipes(&self) -> Vec<&Recipe> {
        self.pipelines().into_iter().map(|(_, recipe)| recipe).collect()
    }

    /// Descriptor sets that the frame allocates, and descriptors of each type in all of them.
    pub fn descriptors(&self) -> (u32, Vec<(vk::DescriptorType, u32)>) {
        let (mut sets, mut counts) = (0, Vec::<(vk::DescriptorType, u32)>::new());
        for call in self.steps.iter().flat_map(Step::calls) {
            sets += 1;
            for binding in call.recipe.bindings() {
                let kind = binding.kind.descriptor_type();
                match counts.iter_mut().find(|(k, _)| *k == kind) {
                    Some((_, count)) => *count += 1,
                    None => counts.push((kind, 1)),
                }
            }
        }
        (sets, counts)
    }

    /// Scopes of the profiler: runs of steps of one pass.
    pub fn scopes(&self) -> u32 {
        self.steps.chunk_by(|a, b| a.pass == b.pass).count() as u32
    }
}
