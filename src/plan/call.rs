//! One use of a pipeline: which shaders, and what each of their names stands for.

use super::{External, Made, Plan, Target};
use crate::{
    access::Access,
    resources::Spec,
    shader::{Binding, Kind, Scalar, Shader},
};
use ash::vk;

/// Everything that a pipeline is made from: two calls with the same recipe share one.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Recipe {
    /// A compute shader; or a vertex and a fragment shader.
    pub shaders: Vec<&'static Shader>,
    /// Specialisation constants by id.
    pub constants: Vec<(u32, u32)>,
    pub topology: vk::PrimitiveTopology,
    /// Formats of the colour attachments, and how each blends.
    pub colors: Vec<(vk::Format, Blend)>,
    /// Format of the depth attachment, tested and written, if there is one.
    pub depth: Option<vk::Format>,
}

/// What becomes of a colour that is drawn over another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) enum Blend {
    /// It replaces that.
    #[default]
    Replace,
    /// It is added to that.
    Add,
    /// The larger of the two stays, component by component.
    Largest,
}

impl Recipe {
    pub fn stages(&self) -> vk::ShaderStageFlags {
        match self.shaders.len() {
            1 => vk::ShaderStageFlags::COMPUTE,
            _ => vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT,
        }
    }

    /// The bindings of all shaders, each once.
    pub fn bindings(&self) -> Vec<Binding> {
        let mut all: Vec<Binding> = Vec::new();
        for b in self.shaders.iter().flat_map(|s| s.bindings) {
            if !all.contains(b) {
                all.push(*b);
            }
        }
        all
    }

    pub fn push_bytes(&self) -> u32 {
        self.shaders.iter().map(|s| s.push_bytes).max().unwrap_or(0)
    }

    pub fn name(&self) -> &'static str {
        self.shaders.last().map_or("", |s| s.name)
    }
}

/// Four bytes for a shader.
pub(crate) trait Word {
    const TYPE: Scalar;
    fn word(self) -> u32;
}

impl Word for u32 {
    const TYPE: Scalar = Scalar::Uint;
    fn word(self) -> u32 {
        self
    }
}

impl Word for f32 {
    const TYPE: Scalar = Scalar::Float;
    fn word(self) -> u32 {
        self.to_bits()
    }
}

impl Word for bool {
    const TYPE: Scalar = Scalar::Bool;
    fn word(self) -> u32 {
        u32::from(self)
    }
}

/// Whether what a shader declares takes such words. Whole numbers are small and not below 0 here: `int` takes them too.
fn takes<W: Word>(declared: Option<Scalar>) -> bool {
    declared == Some(W::TYPE) || (declared == Some(Scalar::Int) && W::TYPE == Scalar::Uint)
}

/// One use of a pipeline.
#[derive(Hash)]
pub(crate) struct Call {
    pub recipe: Recipe,
    /// By index in set 0, filled from `named` when the call is added to a plan.
    pub bound: Vec<(Binding, Target, Access)>,
    pub push: Vec<u8>,
    named: Vec<(&'static str, Target, Touch)>,
    /// What it counts.
    pub(super) counts: &'static [&'static str],
    /// Members of the push-constant block that were set; the whole block at once is "".
    pushed: Vec<&'static str>,
    wrong: Option<String>,
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Touch {
    Read,
    Write,
    Update,
}

impl Call {
    fn new(shaders: Vec<&'static Shader>) -> Call {
        let recipe = Recipe {
            shaders,
            constants: Vec::new(),
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            colors: Vec::new(),
            depth: None,
        };
        let push = vec![0; recipe.push_bytes() as usize];
        Call { recipe, bound: Vec::new(), push, named: Vec::new(), counts: &[], pushed: Vec::new(), wrong: None }
    }

    pub fn compute(shader: &'static Shader) -> Call {
        Call::new(vec![shader])
    }

    pub fn draw(vertex: &'static Shader, fragment: &'static Shader) -> Call {
        Call::new(vec![vertex, fragment])
    }

    pub fn topology(mut self, topology: vk::PrimitiveTopology) -> Call {
        self.recipe.topology = topology;
        self
    }

    /// What the shaders call `name` is this resource, and is read.
    pub fn read(mut self, name: &'static str, target: Target) -> Call {
        self.named.push((name, target, Touch::Read));
        self
    }

    /// … and is written; of an image every texel is.
    pub fn write(mut self, name: &'static str, target: Target) -> Call {
        self.named.push((name, target, Touch::Write));
        self
    }

    /// … and is read and written.
    pub fn update(mut self, name: &'static str, target: Target) -> Call {
        self.named.push((name, target, Touch::Update));
        self
    }

    /// What the shader counts, from the slot COUNTERS of the buffer `counters` on.
    pub fn counting(mut self, names: &'static [&'static str]) -> Call {
        self.counts = names;
        self
    }

    /// Sets a specialisation constant.
    pub fn constant<W: Word>(mut self, name: &'static str, value: W) -> Call {
        let mut found = self.recipe.shaders.iter().flat_map(|s| s.constants).filter(|c| c.1 == name);
        match found.next() {
            None => self.complain(format!("no shader has a constant {name}")),
            Some((_, _, of)) if !takes::<W>(*of) => {
                self.complain(format!("the constant {name} is {of:?}, not {:?}", W::TYPE));
            }
            Some((id, ..)) if self.recipe.constants.iter().any(|c| c.0 == *id) => {
                self.complain(format!("the constant {name} is set twice"));
            }
            Some((id, ..)) => self.recipe.constants.push((*id, value.word())),
        }
        self
    }

    /// Sets a member of the push-constant block.
    pub fn push<W: Word>(mut self, name: &'static str, value: W) -> Call {
        let mut members = self.recipe.shaders.iter().flat_map(|s| s.push);
        match members.find(|m| m.0 == name) {
            None => self.complain(format!("no shader has a push constant {name}")),
            Some((_, _, of)) if !takes::<W>(*of) => {
                self.complain(format!("the push constant {name} is {of:?}, not {:?}", W::TYPE));
            }
            Some(_) if self.pushed.contains(&name) => self.complain(format!("the push constant {name} is set twice")),
            Some((_, offset, _)) => {
                self.push[*offset as usize..][..4].copy_from_slice(&value.word().to_ne_bytes());
                self.pushed.push(name);
            }
        }
        self
    }

    /// Sets the whole push-constant block.
    pub fn push_all<T: bytemuck::Pod>(mut self, block: &T) -> Call {
        let bytes = bytemuck::bytes_of(block);
        if bytes.len() == self.push.len() {
            self.push.copy_from_slice(bytes);
            self.pushed.push("");
        } else {
            self.complain(format!("{} bytes are pushed, the shaders have {}", bytes.len(), self.push.len()));
        }
        self
    }

    fn complain(&mut self, problem: String) {
        self.wrong.get_or_insert(problem);
    }

    /// Matches names with the shaders' own; gives every use, or says what does not fit.
    pub(super) fn bind(&mut self, plan: &mut Plan) -> Result<Vec<(Target, Access)>, String> {
        if let Some(problem) = self.wrong.take() {
            return Err(problem);
        }
        let bindings = self.recipe.bindings();
        for (i, b) in bindings.iter().enumerate() {
            if bindings[..i].iter().any(|a| a.index == b.index) {
                return Err(format!("binding {} is two things in two shaders", b.index));
            }
        }
        let frame = bindings.iter().find(|b| matches!(b.kind, Kind::UniformBuffer(_)));
        if let Some(b) = frame {
            if b.kind != Kind::UniformBuffer(size_of::<crate::shader::Frame>() as u32) {
                return Err(format!("{} is {:?}, and no frame block", b.name, b.kind));
            }
            self.bound.push((*b, plan.given(External::FrameBlock(plan.scale)), Access::UniformRead));
        }
        for (name, target, touch) in std::mem::take(&mut self.named) {
            let Some(b) = bindings.iter().find(|b| b.name == name) else {
                return Err(format!("no shader has a binding {name}"));
            };
            if self.bound.iter().any(|(other, ..)| other.index == b.index) {
                return Err(format!("{name} is bound twice"));
            }
            fits(plan, b, target)?;
            self.bound.push((*b, target, self.access(b, touch)?));
        }
        let missing = |b: &&Binding| b.kind != Kind::Sampler && !self.bound.iter().any(|(o, ..)| o.index == b.index);
        if let Some(b) = bindings.iter().find(missing) {
            return Err(format!("nothing is bound to {}", b.name));
        }
        let members = self.recipe.shaders.iter().flat_map(|s| s.push);
        if let Some((name, ..)) = members.clone().find(|m| !self.pushed.contains(&m.0) && !self.pushed.contains(&"")) {
            return Err(format!("the push constant {name} is not set"));
        }
        let mut constants = self.recipe.shaders.iter().flat_map(|s| s.constants);
        if let Some((_, name, _)) = constants.find(|c| !self.recipe.constants.iter().any(|set| set.0 == c.0)) {
            return Err(format!("the constant {name} is not set"));
        }
        self.recipe.constants.sort_unstable();
        Ok(self.bound.iter().map(|(_, target, access)| (*target, *access)).collect())
    }

    /// Whether the fragment shader writes each of the attachments, of its type, and no other.
    pub(super) fn fits_attachments(&self) -> Result<(), String> {
        let outputs = self.recipe.shaders.last().map_or(&[][..], |s| s.outputs);
        for (location, of) in outputs {
            let Some((format, _)) = self.recipe.colors.get(*location as usize) else {
                return Err(format!("{} writes colour {location}, which is not attached", self.recipe.name()));
            };
            if (*of == Some(Scalar::Uint)) != is_uint(*format) {
                return Err(format!("{} writes {of:?} to colour {location}, which is {format:?}", self.recipe.name()));
            }
        }
        let written = |i: &usize| outputs.iter().any(|(location, _)| *location as usize == *i);
        match (0..self.recipe.colors.len()).find(|i| !written(i)) {
            Some(i) => Err(format!("{} does not write colour {i}, which is attached", self.recipe.name())),
            None => Ok(()),
        }
    }

    /// How the shader that has a binding touches what is bound there.
    fn access(&self, b: &Binding, touch: Touch) -> Result<Access, String> {
        let (image, storage) = match b.kind {
            Kind::SampledImage(_) => (true, false),
            Kind::StorageImage(..) => (true, true),
            Kind::TexelBuffer => (false, false),
            _ => (false, true),
        };
        if let [vertex, _] = self.recipe.shaders.as_slice() {
            return match (touch, vertex.bindings.contains(b), image && storage) {
                (Touch::Read, true, false) => Ok(Access::VertexRead),
                (Touch::Read, true, true) => Err(format!("{} is an image that a vertex shader reads", b.name)),
                (Touch::Read, false, false) if b.kind == Kind::TexelBuffer => Ok(Access::FragmentTexelRead),
                (Touch::Read, false, false) => Ok(Access::FragmentRead),
                (Touch::Read, false, true) => Ok(Access::FragmentStorageRead),
                _ => Err(format!("{} is written while drawing", b.name)),
            };
        }
        if b.kind == Kind::TexelBuffer {
            return Err(format!("{} is a texel buffer, and not a fragment shader's", b.name));
        }
        if image && (touch == Touch::Read) == storage {
            return Err(format!("{} is {:?}: sampled images are read, storage images written", b.name, b.kind));
        }
        Ok(match touch {
            Touch::Read => Access::ComputeRead,
            Touch::Write => Access::ComputeWrite,
            Touch::Update => Access::ComputeReadWrite,
        })
    }
}

/// Whether a format of a target holds unsigned integers; the others hold floats.
fn is_uint(format: vk::Format) -> bool {
    matches!(format, vk::Format::R32_UINT | vk::Format::R32G32B32A32_UINT)
}

/// Whether a resource is of the kind that the shader has at this binding.
fn fits(plan: &Plan, b: &Binding, target: Target) -> Result<(), String> {
    let declared = plan.resource(target);
    let (wanted, format) = match b.kind {
        Kind::SampledImage(texels) => (Some(texels), None),
        Kind::StorageImage(texels, format) => (Some(texels), Some(format)),
        _ => (None, None),
    };
    let fits = match (wanted, declared.made) {
        (Some(texels), Made::Own(Spec::Image(spec))) => {
            texels.uint == is_uint(spec.format)
                && texels.array == spec.array
                && !texels.cube
                && format.is_none_or(|f| f == spec.format)
        }
        (Some(texels), Made::Given(External::SceneColor | External::SceneDepth)) => !texels.uint && !texels.cube,
        (Some(texels), Made::Given(External::Environment)) => !texels.uint,
        (Some(texels), Made::Given(External::Footprints)) => texels.uint && !texels.array && !texels.cube,
        (None, Made::Own(Spec::Buffer { .. })) => true,
        (None, Made::Given(given)) if b.kind != Kind::TexelBuffer => {
            use External::{
                Centers, Count, Diagonals, FrameBlock, Ids, Mixed, Motions, MovingCount, MovingPositions, Points,
                Positions, Speeds,
            };
            let particles = matches!(given, Positions | Count | Ids | Centers | Diagonals | Mixed | Speeds | Points);
            particles || matches!(given, FrameBlock(_) | MovingPositions | MovingCount | Motions)
        }
        _ => false,
    };
    if fits { Ok(()) } else { Err(format!("{} is {:?}, and {} is not", b.name, b.kind, declared.name)) }
}
