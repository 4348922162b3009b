//! Device memory, from an allocator of the host's: `gpu-allocator`'s (a feature, on by default), VMA, or an engine's own.

use ash::vk;
use std::{any::Any, ptr::NonNull};

/// Where memory has to lie. The device's own writes are never read by the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Location {
    /// On the device: `DEVICE_LOCAL`, where there is such memory.
    Device,
    /// Where the host writes and the device reads: `HOST_VISIBLE` and `HOST_COHERENT`, and mapped.
    Upload,
}

/// Memory that is asked for.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Request<'a> {
    /// What for, for debuggers.
    pub name: &'a str,
    /// Size, alignment and types, as Vulkan has said them.
    pub requirements: vk::MemoryRequirements,
    /// Where it has to lie.
    pub location: Location,
    /// Whether a buffer is bound to it, or else an optimally tiled image: of one allocation they lie `bufferImageGranularity` apart.
    pub linear: bool,
}

/// A piece of device memory that one resource is bound to.
#[non_exhaustive]
pub struct Memory {
    /// What it is a part of.
    pub memory: vk::DeviceMemory,
    /// Where it begins there, in bytes.
    pub offset: u64,
    /// Its first byte as the host sees it; of [`Location::Upload`] alone.
    pub mapped: Option<NonNull<u8>>,
    /// Whatever its allocator wants to have back with it.
    pub own: Box<dyn Any + Send + Sync>,
}

impl Memory {
    /// Memory from this byte on, not mapped.
    pub fn new(memory: vk::DeviceMemory, offset: u64) -> Memory {
        Memory { memory, offset, mapped: None, own: Box::new(()) }
    }

    /// The same, mapped: its first byte lies here.
    #[must_use]
    pub fn mapped(self, first: NonNull<u8>) -> Self {
        Memory { mapped: Some(first), ..self }
    }

    /// The same with what its allocator wants to have back with it.
    #[must_use]
    pub fn own(self, own: impl Any + Send + Sync) -> Self {
        Memory { own: Box::new(own), ..self }
    }
}

impl std::fmt::Debug for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Memory").field("memory", &self.memory).field("offset", &self.offset).finish_non_exhaustive()
    }
}

// SAFETY: the pointer is to memory that the `Memory` stands for, and is used through references to that alone.
unsafe impl Send for Memory {}
// SAFETY: as above.
unsafe impl Sync for Memory {}

/// Why there is no memory.
pub type Refusal = Box<dyn std::error::Error + Send + Sync>;

/// An allocator of device memory, shared with the host. It is called by calls of the renderer's that make or record something, and
/// by its end, on their threads; never by the device, and never while a frame still uses what is given back.
///
/// # Safety
/// What [`MemoryAllocator::allocate`] gives is memory of the renderer's device, of a type that the request allows, aligned, at least as
/// large as the request, and nobody else's, until it is given to [`MemoryAllocator::free`]. Where it says that it is mapped, all of the
/// request can be read and written there without flushes.
pub unsafe trait MemoryAllocator: Send + Sync {
    /// Memory, or why there is none.
    fn allocate(&self, request: &Request) -> Result<Memory, Refusal>;
    /// Takes back what [`MemoryAllocator::allocate`] gave, which no frame uses any more.
    fn free(&self, memory: Memory);
}

#[cfg(feature = "gpu-allocator")]
mod with_gpu_allocator {
    use super::{Location, Memory, MemoryAllocator, Refusal, Request};
    use gpu_allocator::{
        MemoryLocation,
        vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator},
    };
    use std::sync::Mutex;

    // SAFETY: gpu-allocator's allocations are such.
    unsafe impl MemoryAllocator for Mutex<Allocator> {
        fn allocate(&self, request: &Request) -> Result<Memory, Refusal> {
            let location = match request.location {
                Location::Device => MemoryLocation::GpuOnly,
                Location::Upload => MemoryLocation::CpuToGpu,
            };
            let desc = AllocationCreateDesc {
                name: request.name,
                requirements: request.requirements,
                location,
                linear: request.linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            };
            // A poisoned lock means that the host panicked while it held it; its allocator is still the one to ask.
            let allocation = self.lock().unwrap_or_else(|e| e.into_inner()).allocate(&desc)?;
            // SAFETY: the memory is bound as a whole, and freed as a whole.
            let memory = unsafe { allocation.memory() };
            let given = Memory::new(memory, allocation.offset());
            let mapped = allocation.mapped_ptr().map(std::ptr::NonNull::cast);
            Ok(Memory { mapped, ..given.own(allocation) })
        }

        fn free(&self, memory: Memory) {
            if let Ok(allocation) = memory.own.downcast::<Allocation>() {
                // It came from this allocator; there is nothing a caller could do about a refusal.
                let _ = self.lock().unwrap_or_else(|e| e.into_inner()).free(*allocation);
            }
        }
    }
}
