//! What can go wrong, and what to do about it.

/// Why there is no liquid.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// wgpu runs on something else.
    #[error("wgpu runs on {0}, meniscus on Vulkan: make the instance with `backends: wgpu::Backends::VULKAN`")]
    NotVulkan(&'static str),
    /// The loader is too old for what drivers offer.
    #[error("the Vulkan loader is of version {0}.{1}: install one of 1.3 or later")]
    Loader(u32, u32),
    /// An encoder of wgpu's was lost, with the device most likely.
    #[error(
        "wgpu gives no command buffer: its device is lost, or was made by another backend. Make device and liquid anew"
    )]
    NoEncoder,
    /// Frames were recorded, but neither submitted nor dropped.
    #[error(
        "all {0} frames in flight are recorded, and not submitted: submit or drop their command buffers before recording more"
    )]
    Unsubmitted(usize),
    /// An output of another format.
    #[error("the output is of {given:?}, and the liquid draws into {wanted:?}: make another Liquid for this format")]
    Format {
        /// The output's.
        given: wgpu::TextureFormat,
        /// That of [`crate::Liquid::new`], with or without `Srgb`.
        wanted: wgpu::TextureFormat,
    },
    /// A texture of the scene's is the output.
    #[error(
        "the output is a texture of the scene's: draw the scene into another, and copy its picture into the output first"
    )]
    SceneIsOutput,
    /// wgpu's own device.
    #[error("{0}")]
    Hal(#[from] wgpu::hal::DeviceError),
    /// wgpu's own device.
    #[error(transparent)]
    Device(#[from] wgpu::RequestDeviceError),
    /// Waiting for a frame.
    #[error(transparent)]
    Poll(#[from] wgpu::PollError),
    /// The allocator.
    #[error("device memory: {0}. Make fewer devices, or let go of some")]
    Memory(#[from] meniscus::gpu_allocator::AllocationError),
    /// The renderer refused.
    #[error(transparent)]
    Renderer(#[from] meniscus::Error),
}
