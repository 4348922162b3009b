//! How passes declare their resources.

use super::{Declared, External, Home, Made, Plan, Target};
use crate::{
    input::Says,
    resources::{ImageSpec, Spec},
    scale::Scale,
};
use ash::vk;

/// The buffers of counters, of the particles and of the view.
pub(crate) const COUNTERS: [&str; 2] = ["particle counters", "counters"];

impl Plan {
    fn declare(&mut self, name: &'static str, made: Made, per_particle: bool) -> Target {
        if self.find(name).is_some() {
            self.refuse(name, "two resources have this name".into());
        }
        self.resources.push(Declared { name, home: self.home, made, per_particle });
        Target(self.resources.len() - 1)
    }

    /// A map of the whole view with one layer for each of so many sides: front, then back. Shaders see an array.
    pub fn map(&mut self, name: &'static str, format: vk::Format, sides: u32) -> Target {
        self.image(name, ImageSpec { format, size: self.size(), layers: sides, array: true, usage: Default::default() })
    }

    /// A map of the whole view without layers.
    pub fn flat(&mut self, name: &'static str, format: vk::Format) -> Target {
        self.image(name, ImageSpec { format, size: self.size(), layers: 1, array: false, usage: Default::default() })
    }

    /// Any image; what it is used for follows from its uses.
    pub fn image(&mut self, name: &'static str, spec: ImageSpec) -> Target {
        self.declare(name, Made::Own(Spec::Image(spec)), false)
    }

    /// An image of one texel that nothing looks at, for what a shader has a place for and does not use; the same one each time.
    pub fn nothing(&mut self, name: &'static str, format: vk::Format, array: bool) -> Target {
        let spec = ImageSpec { format, size: [1, 1], layers: 1, array, usage: Default::default() };
        self.find(name).unwrap_or_else(|| self.image(name, spec))
    }

    /// A buffer of so many bytes.
    pub fn buffer(&mut self, name: &'static str, bytes: u64) -> Target {
        self.declare(name, Made::Own(Spec::Buffer { bytes, usage: Default::default() }), false)
    }

    /// A buffer whose bytes grow with the number of particles.
    pub fn array(&mut self, name: &'static str, bytes: u64) -> Target {
        self.declare(name, Made::Own(Spec::Buffer { bytes, usage: Default::default() }), true)
    }

    /// The buffer that counts for the home at work, and the first of the slots that these names have in it. Names of a
    /// frame's counters are unique, but for steps that count the same things.
    pub(super) fn counters(&mut self, names: &'static [&'static str]) -> (Target, u32) {
        let buffer = COUNTERS[self.home as usize];
        let target = self.find(buffer).unwrap_or_else(|| self.buffer(buffer, 0));
        let all = &mut self.counters[self.home as usize];
        let first = all.windows(names.len()).position(|w| w == names).unwrap_or_else(|| {
            all.extend(names);
            all.len() - names.len()
        });
        (target, first as u32)
    }

    /// Counters are as many as were named, and start at zero.
    pub(super) fn reset_counters(&mut self) {
        for (home, name) in [Home::Particles, Home::View].into_iter().zip(COUNTERS) {
            let Some(target) = self.find(name) else { continue };
            let count = self.counters[home as usize].len() as u64;
            if let Made::Own(Spec::Buffer { bytes, .. }) = &mut self.resources[target.0].made {
                *bytes = 4 * count;
            }
            self.work_for(home, "visibility");
            self.fill("reset", target, 0, 4 * count, 0);
            self.steps.rotate_right(1);
        }
    }

    /// Something that is not the frame's own; the same one each time.
    pub fn given(&mut self, external: External) -> Target {
        if let Some(at) = self.resources.iter().position(|r| r.made == Made::Given(external)) {
            return Target(at);
        }
        let (name, home) = match external {
            External::FrameBlock(Scale::Full) => ("frame block", Home::View),
            External::FrameBlock(Scale::Half) => ("frame block (half)", Home::View),
            External::Positions => ("positions (host's)", Home::Particles),
            External::Count => ("particle count (host's)", Home::Particles),
            External::Ids => ("ids (host's)", Home::Particles),
            External::Centers => ("particle centres", Home::Particles),
            External::Diagonals => ("particle shapes (diagonal)", Home::Particles),
            External::Mixed => ("particle shapes (mixed)", Home::Particles),
            External::Speeds => ("particle speeds", Home::Particles),
            External::Points => ("particle points", Home::Particles),
            External::Environment => ("environment (host's)", Home::View),
            External::Footprints => ("environment", Home::View),
            External::SceneColor => ("scene colour (host's)", Home::View),
            External::SceneDepth => ("scene depth (host's)", Home::View),
            External::Output(_) => ("output (host's)", Home::View),
            External::Surface(Says::Depth, _) => ("surface depth (host's)", Home::View),
            External::Surface(Says::Normal, _) => ("surface normal (host's)", Home::View),
            External::Surface(Says::Motion, _) => ("motion vectors (host's)", Home::View),
            External::Surface(Says::Reactive, _) => ("reactive mask (host's)", Home::View),
            External::MovingPositions => ("moving positions (host's)", Home::View),
            External::MovingCount => ("moving count (host's)", Home::View),
            External::Motions => ("motions (host's)", Home::View),
        };
        self.resources.push(Declared { name, home, made: Made::Given(external), per_particle: false });
        Target(self.resources.len() - 1)
    }
}

#[cfg(feature = "inspect")]
/// Targets that hold the liquid's surfaces as light meets them: the body's after smoothing. `None` where the frame has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct SurfaceNames {
    /// Depths of the splashes.
    pub splash_depth: Option<&'static str>,
    /// Normals of the splashes.
    pub splash_normal: Option<&'static str>,
    /// Depths of the body.
    pub body_depth: Option<&'static str>,
    /// Normals of the body.
    pub body_normal: Option<&'static str>,
}
