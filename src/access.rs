//! How passes touch resources, and the barriers that follow from it.

use ash::vk::{self, AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as S};

/// One way of using a resource: it fixes pipeline stage, memory access and image layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// Sampled (or storage-buffer) read in compute.
    ComputeRead,
    /// Storage write in compute; for images the whole content is replaced.
    ComputeWrite,
    /// Storage-buffer read and write (atomics) in compute.
    ComputeReadWrite,
    /// Storage-buffer read in a vertex shader.
    VertexRead,
    /// Sampled read in a fragment shader.
    FragmentRead,
    /// Storage-image read in a fragment shader: without levels and samplers, which cost llvmpipe most of a texel's price.
    FragmentStorageRead,
    /// Texel-buffer read in a fragment shader: llvmpipe reads four words for what one of a storage buffer costs it.
    FragmentTexelRead,
    /// Uniform block, in any shader.
    UniformRead,
    /// Colour attachment.
    ColorAttachment,
    /// Depth attachment, tested and written.
    DepthAttachment,
    /// Arguments of an indirect draw or dispatch.
    IndirectRead,
    /// Source of a copy.
    #[cfg_attr(not(feature = "inspect"), expect(dead_code, reason = "frames are only copied to be looked at"))]
    TransferRead,
    /// Destination of a copy, fill or update.
    TransferWrite,
}

impl Access {
    /// Stage, access and layout (the layout is meaningless for buffers).
    pub fn flags(self) -> (S, A, L) {
        match self {
            Access::ComputeRead => (S::COMPUTE_SHADER, A::SHADER_READ, L::SHADER_READ_ONLY_OPTIMAL),
            Access::ComputeWrite => (S::COMPUTE_SHADER, A::SHADER_WRITE, L::GENERAL),
            Access::ComputeReadWrite => {
                (S::COMPUTE_SHADER, A::from_raw(A::SHADER_READ.as_raw() | A::SHADER_WRITE.as_raw()), L::GENERAL)
            }
            Access::VertexRead => (S::VERTEX_SHADER, A::SHADER_READ, L::SHADER_READ_ONLY_OPTIMAL),
            Access::FragmentRead | Access::FragmentTexelRead => {
                (S::FRAGMENT_SHADER, A::SHADER_READ, L::SHADER_READ_ONLY_OPTIMAL)
            }
            Access::FragmentStorageRead => (S::FRAGMENT_SHADER, A::SHADER_READ, L::GENERAL),
            Access::UniformRead => (
                S::from_raw(S::VERTEX_SHADER.as_raw() | S::FRAGMENT_SHADER.as_raw() | S::COMPUTE_SHADER.as_raw()),
                A::UNIFORM_READ,
                L::UNDEFINED,
            ),
            Access::ColorAttachment => (
                S::COLOR_ATTACHMENT_OUTPUT,
                A::from_raw(A::COLOR_ATTACHMENT_READ.as_raw() | A::COLOR_ATTACHMENT_WRITE.as_raw()),
                L::COLOR_ATTACHMENT_OPTIMAL,
            ),
            Access::DepthAttachment => (
                S::from_raw(S::EARLY_FRAGMENT_TESTS.as_raw() | S::LATE_FRAGMENT_TESTS.as_raw()),
                A::from_raw(A::DEPTH_STENCIL_ATTACHMENT_READ.as_raw() | A::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()),
                L::DEPTH_ATTACHMENT_OPTIMAL,
            ),
            Access::IndirectRead => (S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ, L::UNDEFINED),
            Access::TransferRead => (S::ALL_TRANSFER, A::TRANSFER_READ, L::TRANSFER_SRC_OPTIMAL),
            Access::TransferWrite => (S::ALL_TRANSFER, A::TRANSFER_WRITE, L::TRANSFER_DST_OPTIMAL),
        }
    }

    /// What an image has to be made for to be used so; `None` if no image is.
    pub(crate) fn image_usage(self) -> Option<vk::ImageUsageFlags> {
        use vk::ImageUsageFlags as U;
        match self {
            Access::ComputeRead | Access::FragmentRead => Some(U::SAMPLED),
            Access::ComputeWrite | Access::FragmentStorageRead => Some(U::STORAGE),
            Access::ColorAttachment => Some(U::COLOR_ATTACHMENT),
            Access::DepthAttachment => Some(U::DEPTH_STENCIL_ATTACHMENT),
            Access::TransferRead => Some(U::TRANSFER_SRC),
            Access::TransferWrite => Some(U::TRANSFER_DST),
            Access::ComputeReadWrite | Access::VertexRead | Access::FragmentTexelRead => None,
            Access::UniformRead | Access::IndirectRead => None,
        }
    }

    /// The same of buffers.
    pub(crate) fn buffer_usage(self) -> Option<vk::BufferUsageFlags> {
        use vk::BufferUsageFlags as U;
        match self {
            Access::ComputeRead | Access::ComputeWrite | Access::ComputeReadWrite => Some(U::STORAGE_BUFFER),
            Access::VertexRead | Access::FragmentRead => Some(U::STORAGE_BUFFER),
            Access::FragmentTexelRead => Some(U::UNIFORM_TEXEL_BUFFER),
            Access::UniformRead => Some(U::UNIFORM_BUFFER),
            Access::IndirectRead => Some(U::INDIRECT_BUFFER),
            Access::TransferRead => Some(U::TRANSFER_SRC),
            Access::TransferWrite => Some(U::TRANSFER_DST),
            Access::FragmentStorageRead | Access::ColorAttachment | Access::DepthAttachment => None,
        }
    }

    /// Whether this changes the resource.
    pub fn writes(self) -> bool {
        use Access::*;
        matches!(self, ComputeWrite | ComputeReadWrite | ColorAttachment | DepthAttachment | TransferWrite)
    }
}

/// What has happened to a resource so far: enough to say which barrier its next use needs.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    layout: L,
    /// The last write that later uses have to wait for.
    written: (S, A),
    /// Stages that have read since.
    read: S,
    /// Stages and accesses to which the last write was already made visible.
    visible: (S, A),
}

/// A barrier's four flags and two layouts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Barrier {
    /// Before.
    pub src: (S, A, L),
    /// After.
    pub dst: (S, A, L),
}

impl Barrier {
    /// The barrier for every subresource of an image.
    pub(crate) fn on_image(&self, image: vk::Image, aspect: vk::ImageAspectFlags) -> vk::ImageMemoryBarrier2<'static> {
        vk::ImageMemoryBarrier2::default()
            .src_stage_mask(self.src.0)
            .src_access_mask(self.src.1)
            .old_layout(self.src.2)
            .dst_stage_mask(self.dst.0)
            .dst_access_mask(self.dst.1)
            .new_layout(self.dst.2)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image)
            .subresource_range(whole(aspect))
    }

    /// The barrier for a whole buffer; layouts mean nothing to it.
    pub(crate) fn on_buffer(&self, buffer: vk::Buffer) -> vk::BufferMemoryBarrier2<'static> {
        vk::BufferMemoryBarrier2::default()
            .src_stage_mask(self.src.0)
            .src_access_mask(self.src.1)
            .dst_stage_mask(self.dst.0)
            .dst_access_mask(self.dst.1)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .buffer(buffer)
            .size(vk::WHOLE_SIZE)
    }
}

impl State {
    /// The content no longer matters: the next use may start from an undefined layout. Execution order is kept.
    pub fn discard(&mut self) {
        self.layout = L::UNDEFINED;
    }

    /// Notes the next use; returns the barrier it needs before it, if any. `image`: whether layouts matter.
    pub fn step(&mut self, access: Access, image: bool) -> Option<Barrier> {
        let (stage, flags, layout) = access.flags();
        let moved = image && self.layout != layout;
        let before = self.layout;
        if access.writes() || moved {
            let (written, wrote) = self.written;
            let src = (written | self.read, wrote, before);
            self.layout = if image { layout } else { before };
            // A layout transition is a write of its own, which this use's stage has already waited for.
            self.written = (stage, if access.writes() { flags & WRITES } else { A::NONE });
            self.visible = if access.writes() { (S::NONE, A::NONE) } else { (stage, flags) };
            self.read = if access.writes() { S::NONE } else { stage };
            let needed = moved || !src.0.is_empty();
            return needed.then_some(Barrier { src, dst: (stage, flags, layout) });
        }
        self.read |= stage;
        if self.written.0.is_empty() || (self.visible.0.contains(stage) && self.visible.1.contains(flags)) {
            return None;
        }
        self.visible = (self.visible.0 | stage, self.visible.1 | flags);
        Some(Barrier { src: (self.written.0, self.written.1, before), dst: (stage, flags, layout) })
    }
}

const WRITES: A = A::from_raw(
    A::SHADER_WRITE.as_raw()
        | A::COLOR_ATTACHMENT_WRITE.as_raw()
        | A::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()
        | A::TRANSFER_WRITE.as_raw(),
);

/// Every subresource of an image with this aspect.
pub(crate) fn whole(aspect: vk::ImageAspectFlags) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: aspect,
        base_mip_level: 0,
        level_count: vk::REMAINING_MIP_LEVELS,
        base_array_layer: 0,
        layer_count: vk::REMAINING_ARRAY_LAYERS,
    }
}
