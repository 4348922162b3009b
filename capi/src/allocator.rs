//! Device memory, from an allocator of the host's own.

use crate::{
    status::Failure,
    versioned::{Versioned, null},
};
use renderer::{
    allocator::{Location, Memory, MemoryAllocator, Refusal, Request},
    ash::vk::{
        Bool32 as VkBool32, DeviceMemory as VkDeviceMemory, DeviceSize as VkDeviceSize, Handle, Result as VkResult,
    },
};
use std::{
    ffi::{CString, c_char, c_void},
    mem::offset_of,
    ptr::{self, NonNull},
};

/// MeniscusMemoryRequest::location: on the device, DEVICE_LOCAL where there is such memory.
pub const MENISCUS_LOCATION_DEVICE: u32 = 0;
/// MeniscusMemoryRequest::location: where the host writes and the device reads: HOST_VISIBLE and HOST_COHERENT, and mapped.
pub const MENISCUS_LOCATION_UPLOAD: u32 = 1;

/// Memory that the renderer asks for.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusMemoryRequest {
    /// sizeof(MeniscusMemoryRequest), of the library's version.
    pub struct_size: usize,
    /// What for, for debuggers; it ends with a 0, and is there until the call returns.
    pub name: *const c_char,
    /// Size in bytes at least, as Vulkan has said it.
    pub size: VkDeviceSize,
    /// What its offset has to be a multiple of.
    pub alignment: VkDeviceSize,
    /// Types that will do, one bit each (VkMemoryRequirements::memoryTypeBits).
    pub memory_type_bits: u32,
    /// MENISCUS_LOCATION_...
    pub location: u32,
    /// VK_TRUE where a buffer is bound to it, or else an optimally tiled image: of one allocation they lie bufferImageGranularity apart.
    pub linear: VkBool32,
    /// 0.
    pub reserved: u32,
}

/// A piece of device memory that one resource is bound to.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusAllocation {
    /// What it is a part of.
    pub memory: VkDeviceMemory,
    /// Where it begins there, in bytes.
    pub offset: VkDeviceSize,
    /// Its first byte as the host sees it; of MENISCUS_LOCATION_UPLOAD alone.
    pub mapped: *mut c_void,
    /// Whatever the allocator wants to have back with it.
    pub own: *mut c_void,
}

/// Fills an allocation, which comes as zeros, and gives VK_SUCCESS; or says why there is no memory.
#[allow(non_camel_case_types)]
pub type PFN_meniscusAllocate = Option<
    unsafe extern "C" fn(
        user_data: *mut c_void,
        request: *const MeniscusMemoryRequest,
        allocation: *mut MeniscusAllocation,
    ) -> VkResult,
>;
/// Takes an allocation back as it was given, which no frame uses any more.
#[allow(non_camel_case_types)]
pub type PFN_meniscusFree = Option<unsafe extern "C" fn(user_data: *mut c_void, allocation: *const MeniscusAllocation)>;

/// An allocator of device memory. It is called by calls that make, record or destroy something, on their threads: by those of
/// several renderers at a time, if it serves several. What it gives is memory of the renderer's device, of a type that the request
/// allows, aligned, and nobody else's, until it is taken back; where that is mapped, all of it can be written without flushes.
/// It does not throw, and does not jump out.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MeniscusAllocator {
    /// sizeof(MeniscusAllocator).
    pub struct_size: usize,
    /// Given to both functions.
    pub user_data: *mut c_void,
    /// Memory, or why there is none.
    pub allocate: PFN_meniscusAllocate,
    /// Takes it back.
    pub free: PFN_meniscusFree,
}

// SAFETY: repr(C); its size first; no padding (a test adds it up); pointers that may be null.
unsafe impl Versioned for MeniscusAllocator {
    const NAME: &'static str = "MeniscusAllocator";
    const LEAST: usize = offset_of!(MeniscusAllocator, free) + size_of::<PFN_meniscusFree>();
}

/// The same with both functions.
pub(crate) struct Callbacks {
    user_data: *mut c_void,
    allocate: unsafe extern "C" fn(*mut c_void, *const MeniscusMemoryRequest, *mut MeniscusAllocation) -> VkResult,
    free: unsafe extern "C" fn(*mut c_void, *const MeniscusAllocation),
}

// SAFETY: the host has said that both functions may be called on any thread, with its data.
unsafe impl Send for Callbacks {}
// SAFETY: as above.
unsafe impl Sync for Callbacks {}

impl MeniscusAllocator {
    /// What the renderer takes.
    pub(crate) fn get(&self) -> Result<Callbacks, Failure> {
        let allocate = self.allocate.ok_or_else(|| null("MeniscusAllocator::allocate"))?;
        let free = self.free.ok_or_else(|| null("MeniscusAllocator::free"))?;
        Ok(Callbacks { user_data: self.user_data, allocate, free })
    }
}

/// What the host is to have back.
struct Given(MeniscusAllocation);

// SAFETY: nothing is done with its pointers but giving them back.
unsafe impl Send for Given {}
// SAFETY: as above.
unsafe impl Sync for Given {}

// SAFETY: the host has said so of its functions (MeniscusAllocator).
unsafe impl MemoryAllocator for Callbacks {
    fn allocate(&self, request: &Request) -> Result<Memory, Refusal> {
        let name = CString::new(request.name).unwrap_or_default();
        let asked = MeniscusMemoryRequest {
            struct_size: size_of::<MeniscusMemoryRequest>(),
            name: name.as_ptr(),
            size: request.requirements.size,
            alignment: request.requirements.alignment,
            memory_type_bits: request.requirements.memory_type_bits,
            location: match request.location {
                Location::Device => MENISCUS_LOCATION_DEVICE,
                Location::Upload => MENISCUS_LOCATION_UPLOAD,
            },
            linear: request.linear.into(),
            reserved: 0,
        };
        let mut given = MeniscusAllocation {
            memory: VkDeviceMemory::null(),
            offset: 0,
            mapped: ptr::null_mut(),
            own: ptr::null_mut(),
        };
        // SAFETY: the host's function, with its data; both structs live until it returns.
        match unsafe { (self.allocate)(self.user_data, &asked, &mut given) } {
            VkResult::SUCCESS if given.memory.is_null() => Err("MeniscusAllocator::allocate gave no memory".into()),
            VkResult::SUCCESS => {
                let memory = Memory::new(given.memory, given.offset).own(Given(given));
                Ok(match NonNull::new(given.mapped.cast()) {
                    Some(first) => memory.mapped(first),
                    None => memory,
                })
            }
            refusal => Err(refusal.into()),
        }
    }

    fn free(&self, memory: Memory) {
        if let Some(Given(given)) = memory.own.downcast_ref::<Given>() {
            // SAFETY: as above; it is what the host gave.
            unsafe { (self.free)(self.user_data, given) };
        }
    }
}
