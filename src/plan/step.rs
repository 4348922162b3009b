//! The steps of a frame: fills, dispatches, draws.

use super::{Call, External, Made, Plan, Target, call::Blend};
use crate::access::Access;
use ash::vk;
use std::hash::{Hash, Hasher};

/// One thing that is recorded, with everything it touches; steps of one pass that follow each other share a label and a
/// pair of timestamps.
#[derive(Hash)]
pub(crate) struct Step {
    pub pass: &'static str,
    pub home: super::Home,
    /// As what part of the frame.
    pub part: &'static str,
    pub uses: Vec<(Target, Access)>,
    pub work: Work,
}

#[derive(Hash)]
pub(crate) enum Work {
    /// One word, all over a range of a buffer.
    Fill {
        buffer: Target,
        offset: u64,
        bytes: u64,
        word: u32,
    },
    Dispatch {
        call: Call,
        groups: Groups,
    },
    Render {
        rendering: Rendering,
        draws: Vec<(Call, Vertices)>,
    },
}

/// Work groups of a dispatch.
#[derive(Clone, Copy, Hash)]
pub(crate) enum Groups {
    Direct([u32; 3]),
    /// From a buffer, at an offset in bytes.
    Indirect(Target, u64),
}

/// What is drawn.
#[derive(Clone, Copy, Hash)]
pub(crate) enum Vertices {
    /// So many vertices of one instance.
    Direct(u32),
    /// One draw from a buffer, at an offset in bytes.
    Indirect(Target, u64),
}

/// What is drawn into.
#[derive(Hash)]
pub(crate) struct Rendering {
    pub colors: Vec<Color>,
    pub depth: Option<Depth>,
}

/// A colour attachment: one layer of an image.
pub(crate) struct Color {
    pub target: Target,
    pub layer: u32,
    /// What it starts as; `None`: it keeps what it holds.
    pub clear: Option<[f32; 4]>,
    pub blend: Blend,
}

/// A depth attachment, tested and written.
pub(crate) struct Depth {
    pub target: Target,
    /// What it starts as, and then what it holds is lost afterwards; `None`: it keeps what it holds.
    pub clear: Option<f32>,
    pub compare: vk::CompareOp,
}

impl Hash for Color {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (self.target, self.layer, self.clear.map(|c| c.map(f32::to_bits)), self.blend).hash(state);
    }
}

impl Hash for Depth {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (self.target, self.clear.map(f32::to_bits), self.compare).hash(state);
    }
}

impl Rendering {
    /// Into one layer of an image, from zeros.
    pub fn into(target: Target, layer: u32) -> Rendering {
        Rendering { colors: Vec::new(), depth: None }.and(target, layer)
    }

    /// And into one layer of another, from zeros.
    pub fn and(mut self, target: Target, layer: u32) -> Rendering {
        self.colors.push(Color { target, layer, clear: Some([0.0; 4]), blend: Blend::Replace });
        self
    }

    /// The last attachment keeps what it holds, if `keep`.
    pub fn keeping(mut self, keep: bool) -> Rendering {
        if let Some(color) = self.colors.last_mut().filter(|_| keep) {
            color.clear = None;
        }
        self
    }

    /// The last attachment starts as this, and what is drawn is blended with what is there.
    pub fn blending(mut self, blend: Blend, clear: [f32; 4]) -> Rendering {
        if let Some(color) = self.colors.last_mut() {
            (color.blend, color.clear) = (blend, Some(clear));
        }
        self
    }

    /// With a depth test.
    pub fn testing(mut self, target: Target, clear: f32, compare: vk::CompareOp) -> Rendering {
        self.depth = Some(Depth { target, clear: Some(clear), compare });
        self
    }

    /// Into depths alone, over what is there.
    pub fn over_depth(target: Target) -> Rendering {
        let depth = Depth { target, clear: None, compare: vk::CompareOp::ALWAYS };
        Rendering { colors: Vec::new(), depth: Some(depth) }
    }
}

impl Step {
    /// The pipelines it binds.
    pub fn calls(&self) -> impl Iterator<Item = &Call> {
        let (one, many) = match &self.work {
            Work::Fill { .. } => (None, &[][..]),
            Work::Dispatch { call, .. } => (Some(call), &[][..]),
            Work::Render { draws, .. } => (None, draws.as_slice()),
        };
        one.into_iter().chain(many.iter().map(|(call, _)| call))
    }
}

impl Plan {
    fn step(&mut self, pass: &'static str, uses: Vec<(Target, Access)>, work: Work) {
        for (i, (target, access)) in uses.iter().enumerate() {
            self.used(pass, *target, *access);
            let twice = uses[..i].iter().find(|(other, _)| other == target);
            if twice.is_some_and(|(_, other)| other.writes() || access.writes()) {
                let name = self.resource(*target).name;
                self.refuse(pass, format!("{name} is written in one step and used in it once more"));
            }
        }
        let (home, part) = (self.home, self.part);
        self.steps.push(Step { pass, home, part, uses, work });
    }

    /// Fills a buffer with one word, from an offset on, so many bytes (`vk::WHOLE_SIZE`: to its end).
    pub fn fill(&mut self, pass: &'static str, buffer: Target, offset: u64, bytes: u64, word: u32) {
        self.step(pass, vec![(buffer, Access::TransferWrite)], Work::Fill { buffer, offset, bytes, word });
    }

    /// A buffer whose bytes grow with the number of particles, and which keeps what it holds from frame to frame but in
    /// those that start it anew, all of this word. Made for being filled in either case: so it stays the same buffer.
    pub fn kept_array(&mut self, pass: &'static str, name: &'static str, bytes: u64, anew: Option<u32>) -> Target {
        let array = self.array(name, bytes);
        match anew {
            Some(word) => self.fill(pass, array, 0, vk::WHOLE_SIZE, word),
            None => self.used(pass, array, Access::TransferWrite),
        }
        array
    }

    /// A dispatch of a compute shader.
    pub fn dispatch(&mut self, pass: &'static str, mut call: Call, groups: Groups) {
        if !call.counts.is_empty() {
            let (counters, first) = self.counters(call.counts);
            call = call.update("counters", counters).constant("COUNTERS", first);
        }
        match call.bind(self) {
            Ok(mut uses) => {
                if let Groups::Indirect(arguments, _) = groups {
                    uses.push((arguments, Access::IndirectRead));
                }
                self.step(pass, uses, Work::Dispatch { call, groups });
            }
            Err(problem) => self.refuse(pass, problem),
        }
    }

    /// Draws into attachments of one size.
    pub fn render(&mut self, pass: &'static str, rendering: Rendering, draws: Vec<(Call, Vertices)>) {
        let mut formats = Vec::new();
        for color in &rendering.colors {
            match self.attachment_format(color.target) {
                Some((format, layers)) if color.layer < layers => formats.push((format, color.blend)),
                _ => return self.refuse(pass, format!("{} is no attachment", self.resource(color.target).name)),
            }
        }
        let depth = rendering.depth.as_ref().and_then(|d| Some(self.attachment_format(d.target)?.0));
        let mut uses: Vec<(Target, Access)> = Vec::new();
        let mut add = |one: (Target, Access)| {
            if !uses.contains(&one) {
                uses.push(one);
            }
        };
        let mut ready = Vec::with_capacity(draws.len());
        for (mut call, vertices) in draws {
            call.recipe.colors = formats.clone();
            call.recipe.depth = depth;
            if !call.counts.is_empty() {
                return self.refuse(pass, "only dispatches count".into());
            }
            match call.fits_attachments().and_then(|()| call.bind(self)) {
                Ok(uses) => uses.into_iter().for_each(&mut add),
                Err(problem) => return self.refuse(pass, problem),
            }
            if let Vertices::Indirect(arguments, _) = vertices {
                add((arguments, Access::IndirectRead));
            }
            ready.push((call, vertices));
        }
        rendering.colors.iter().for_each(|c| add((c.target, Access::ColorAttachment)));
        rendering.depth.iter().for_each(|d| add((d.target, Access::DepthAttachment)));
        let sizes: Vec<_> = uses_of_attachments(&rendering).map(|t| self.attachment_size(t)).collect();
        if sizes.windows(2).any(|w| w[0] != w[1]) {
            return self.refuse(pass, format!("its attachments are of different sizes: {sizes:?}"));
        }
        self.step(pass, uses, Work::Render { rendering, draws: ready });
    }

    /// Format and layers of what is drawn into.
    fn attachment_format(&self, target: Target) -> Option<(vk::Format, u32)> {
        match self.resource(target).made {
            Made::Given(External::Output(format) | External::Surface(_, format)) => Some((format, 1)),
            _ => self.image_spec(target).map(|spec| (spec.format, spec.layers)),
        }
    }

    /// Width and height of what is drawn into.
    pub fn attachment_size(&self, target: Target) -> [u32; 2] {
        self.image_spec(target).map_or(self.picture, |spec| spec.size)
    }
}

fn uses_of_attachments(rendering: &Rendering) -> impl Iterator<Item = Target> {
    rendering.colors.iter().map(|c| c.target).chain(rendering.depth.iter().map(|d| d.target))
}
