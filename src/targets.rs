//! The table of everything a frame keeps in memory: name, format, size, and when it exists at all.

use crate::{resources::ImageSpec, settings::Settings, shader};
use ash::vk::{self, BufferUsageFlags as B, Format as F, ImageUsageFlags as U};

/// Resources that passes name in their declarations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)] // each is described where it is made, in `spec`
pub enum Id {
    FrameBlock,
    Positions,
    Extent,
    Order,
    Sorted,
    LastClasses,
    Neighbours,
    Centers,
    Diagonals,
    Mixed,
    Bounds,
    Visible,
    Sums,
    Drawn,
    Draws,
    Counters,
    SplatDepth,
    SplashDepth,
    SplashNormal,
    BodyDepthRaw,
    BodyNormalRaw,
    BodyDepthA,
    BodyDepthB,
    BodyNormal,
    FrontTiles,
    Walk,
    Direction,
    Environment,
    SceneColor,
    SceneDepth,
    Output,
}

impl Id {
    /// Those the renderer makes for itself from [`Needs`], in the order of the memory ledger.
    pub const OWN: [Id; 25] = [
        Id::Extent,
        Id::Order,
        Id::Sorted,
        Id::LastClasses,
        Id::Neighbours,
        Id::Centers,
        Id::Diagonals,
        Id::Mixed,
        Id::Bounds,
        Id::Visible,
        Id::Sums,
        Id::Drawn,
        Id::Draws,
        Id::Counters,
        Id::SplatDepth,
        Id::SplashDepth,
        Id::SplashNormal,
        Id::BodyDepthRaw,
        Id::BodyNormalRaw,
        Id::BodyDepthA,
        Id::BodyDepthB,
        Id::BodyNormal,
        Id::FrontTiles,
        Id::Walk,
        Id::Direction,
    ];

    /// Name in the ledger, in the printed barriers and (after "meniscus") in debuggers.
    pub fn name(self) -> &'static str {
        match self {
            Id::FrameBlock => "frame block",
            Id::Positions => "positions (host's)",
            Id::Extent => "extent",
            Id::Order => "sort order",
            Id::Sorted => "sorted positions",
            Id::LastClasses => "last classes",
            Id::Neighbours => "neighbours (debug)",
            Id::Centers => "particle centres",
            Id::Diagonals => "particle shapes (diagonal)",
            Id::Mixed => "particle shapes (mixed)",
            Id::Bounds => "body depth bounds",
            Id::Visible => "visible particles",
            Id::Sums => "prefix sums",
            Id::Drawn => "drawn particles",
            Id::Draws => "indirect draws",
            Id::Counters => "counters",
            Id::SplatDepth => "splat depth test",
            Id::SplashDepth => "splash depth",
            Id::SplashNormal => "splash normal",
            Id::BodyDepthRaw => "body depth (ray-cast)",
            Id::BodyNormalRaw => "body normal (ray-cast)",
            Id::BodyDepthA => "body depth (smoothed, odd)",
            Id::BodyDepthB => "body depth (smoothed, even)",
            Id::BodyNormal => "body normal (smoothed)",
            Id::FrontTiles => "front depth tiles",
            Id::Walk => "walk (debug)",
            Id::Direction => "final direction (debug)",
            Id::Environment => "environment",
            Id::SceneColor => "scene colour (host's)",
            Id::SceneDepth => "scene depth (host's)",
            Id::Output => "output (host's)",
        }
    }
}

/// What a frame has to draw: everything that decides which resources exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Particles.
    pub count: u32,
    /// Whether any of them may be splash.
    pub splash: bool,
    /// Whether any of them may belong to the body.
    pub body: bool,
    /// Surfaces at which light bends: 1, 2 or 4.
    pub refractions: u32,
    /// Iterations of plane fitting.
    pub iterations: u32,
    /// Whether hidden particles are dropped before drawing.
    pub occlusion: bool,
    /// Whether the refraction pass also writes what each walk met.
    pub debug: bool,
    /// Preparation on the device, if the frame starts from positions there.
    pub prepare: Option<Preparation>,
}

/// What the preparation on the device needs memory for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preparation {
    /// Entries of the sort: one a particle, or 27.
    pub entries: u64,
    /// Whether classes are kept from frame to frame.
    pub keep_classes: bool,
    /// Neighbours of each particle that are listed, for tests.
    pub neighbours: u32,
}

/// An image or a buffer, as it has to be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spec {
    /// An image.
    Image(ImageSpec),
    /// A buffer of so many bytes in device memory.
    Buffer {
        /// Size.
        bytes: u64,
        /// Usage.
        usage: B,
    },
}

impl Needs {
    /// What settings need for so many particles of each class.
    pub fn new(size: [u32; 2], splash: usize, body: usize, settings: &Settings, debug: bool) -> Needs {
        Needs {
            size,
            count: (splash + body) as u32,
            splash: splash > 0,
            body: body > 0,
            refractions: settings.refractions,
            iterations: settings.iterations,
            occlusion: settings.occlusion_culling,
            debug,
            prepare: None,
        }
    }

    /// Sides of each class that are drawn: front only, or front and back.
    pub fn sides(&self) -> u32 {
        if self.refractions == 1 { 1 } else { 2 }
    }

    /// Whether rays look for a second volume, and so for tiles of front depths.
    pub fn tiles(&self) -> bool {
        self.refractions == 4 && self.count > 0
    }

    /// Final depth and normal of a class; of the other class where this one has no particles, and so no maps: the
    /// shader then does not look, but something has to be bound.
    pub(crate) fn maps_or_other(&self, body: bool) -> (Id, Id) {
        if self.body && (body || !self.splash) {
            (self.body_depth(), self.body_normal())
        } else {
            (Id::SplashDepth, Id::SplashNormal)
        }
    }

    /// The image that holds the body's smoothed depth: iterations alternate between two.
    pub fn body_depth(&self) -> Id {
        match self.iterations {
            0 => Id::BodyDepthRaw,
            n if n % 2 == 1 => Id::BodyDepthA,
            _ => Id::BodyDepthB,
        }
    }

    /// The image that holds the normals of the smoothed body.
    pub fn body_normal(&self) -> Id {
        if self.iterations == 0 { Id::BodyNormalRaw } else { Id::BodyNormal }
    }

    /// How a resource is made for this frame; `None` where the frame does without it.
    pub fn spec(&self, id: Id) -> Option<Spec> {
        let (splash, body, any) = (self.splash, self.body, self.count > 0);
        let count = u64::from(self.count);
        let prepare = self.prepare.filter(|_| any);
        let blocks = |items: u64| items.div_ceil(u64::from(shader::BLOCK));
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        let image = |format, layers, array, usage| {
            Some(Spec::Image(ImageSpec { format, size: self.size, layers, array, usage }))
        };
        let buffer = |bytes, usage| {
            Some(Spec::Buffer { bytes, usage: usage | B::STORAGE_BUFFER | B::TRANSFER_SRC | B::TRANSFER_DST })
        };
        // One layer a side: front, back.
        let drawn = |format| image(format, self.sides(), true, U::COLOR_ATTACHMENT | U::SAMPLED | U::TRANSFER_SRC);
        let computed = |format| image(format, self.sides(), true, U::STORAGE | U::SAMPLED | U::TRANSFER_SRC);
        let placeholder =
            |format| Some(Spec::Image(ImageSpec { format, size: [1, 1], layers: 1, array: true, usage: U::SAMPLED }));
        match id {
            Id::Extent if prepare.is_some() => buffer(4 * u64::from(shader::EXTENT_WORDS), B::INDIRECT_BUFFER),
            // Indices, read from one half and written to the other.
            Id::Order => prepare.and_then(|p| buffer(8 * p.entries, B::empty())),
            Id::Sorted | Id::Centers | Id::Diagonals | Id::Mixed if prepare.is_some() => buffer(12 * count, B::empty()),
            Id::LastClasses if prepare.is_some_and(|p| p.keep_classes) => buffer(4 * count, B::empty()),
            Id::Neighbours => prepare
                .filter(|p| p.neighbours > 0)
                .and_then(|p| buffer(4 * (2 + u64::from(p.neighbours)) * count, B::empty())),
            // Two 32-bit bounds a pixel: nearest and farthest depth that the body certainly reaches.
            Id::Bounds if body && self.occlusion => buffer(8 * pixels, B::empty()),
            // A word a particle: its class and the sides on which it shows.
            Id::Visible if any => buffer(4 * count, B::empty()),
            // Counts of each block's particles in each list, and the lists' totals; before that, of the sort's entries
            // for each digit.
            Id::Sums if any => {
                let sorting = self.prepare.map_or(0, |p| u64::from(shader::DIGITS) * (blocks(p.entries) + 1));
                buffer(4 * sorting.max(4 * (blocks(count) + 1)), B::empty())
            }
            // The lists: for each side splashes from the start, the body from the end.
            Id::Drawn if any => buffer(4 * u64::from(self.sides()) * count, B::empty()),
            Id::Draws if any => buffer(4 * size_of::<shader::Draws>() as u64, B::INDIRECT_BUFFER),
            Id::Counters if any => buffer(4 * u64::from(shader::COUNTERS), B::empty()),
            // The depth test of whichever class and side is being drawn.
            Id::SplatDepth if any => image(F::D32_SFLOAT, 1, false, U::DEPTH_STENCIL_ATTACHMENT),
            Id::SplashDepth if splash => drawn(F::R32_SFLOAT),
            Id::SplashNormal if splash => drawn(F::R32_UINT),
            // With no particles at all the refraction pass still binds maps it does not look at.
            Id::SplashDepth if !any => placeholder(F::R32_SFLOAT),
            Id::SplashNormal if !any => placeholder(F::R32_UINT),
            Id::BodyDepthRaw if body => drawn(F::R32_SFLOAT),
            Id::BodyNormalRaw if body => drawn(F::R32_UINT),
            Id::BodyDepthA if body && self.iterations >= 1 => computed(F::R32_SFLOAT),
            Id::BodyDepthB if body && self.iterations >= 2 => computed(F::R32_SFLOAT),
            Id::BodyNormal if body && self.iterations >= 1 => computed(F::R32_UINT),
            // Smallest and largest front depth of each tile.
            Id::FrontTiles if self.tiles() => Some(Spec::Image(ImageSpec {
                format: F::R32_SFLOAT,
                size: self.size.map(|s| s.div_ceil(shader::FRONT_TILE)),
                layers: 2,
                array: true,
                usage: U::STORAGE | U::SAMPLED | U::TRANSFER_SRC,
            })),
            Id::Walk | Id::Direction if self.debug => {
                image(F::R32G32B32A32_SFLOAT, 1, false, U::COLOR_ATTACHMENT | U::TRANSFER_SRC)
            }
            _ => None,
        }
    }
}

/// One line of the memory ledger.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LedgerEntry {
    /// Resource name.
    pub name: &'static str,
    /// Device memory in bytes, as the driver requires it.
    pub bytes: u64,
}

/// Memory that a frame with these needs takes, resource by resource, asked of the driver without allocating.
pub(crate) fn ledger(device: &ash::Device, needs: &Needs) -> Vec<LedgerEntry> {
    let entry = |id: Id| {
        let spec = needs.spec(id)?;
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
        Some(LedgerEntry { name: id.name(), bytes: requirements.memory_requirements.size })
    };
    Id::OWN.into_iter().filter_map(entry).collect()
}
