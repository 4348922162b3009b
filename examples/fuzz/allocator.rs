//! Counts what is allocated, and ends the process before a lie takes all memory.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};

/// Far above what any input may take.
const MOST: usize = 1 << 30;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
static BASE: AtomicUsize = AtomicUsize::new(0);
static SEED: AtomicU64 = AtomicU64::new(0);
/// The format's name, eight bytes of it.
static FORMAT: AtomicU64 = AtomicU64::new(0);

struct Counting;

#[global_allocator]
static COUNTING: Counting = Counting;

// SAFETY: everything is left to the system's allocator; only sizes are noted.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        grow(layout.size());
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        grow(layout.size());
        // SAFETY: as the caller promises.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        LIVE.fetch_sub(layout.size(), Relaxed);
        grow(size);
        // SAFETY: as the caller promises.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

fn grow(size: usize) {
    let live = LIVE.fetch_add(size, Relaxed) + size;
    PEAK.fetch_max(live, Relaxed);
    if live > MOST {
        LIVE.fetch_sub(size, Relaxed);
        let bytes = FORMAT.load(Relaxed).to_le_bytes();
        let name = str::from_utf8(&bytes).unwrap_or_default().trim_end_matches('\0');
        let index = super::CURRENT.load(Relaxed);
        eprintln!(
            "{name}: {size} bytes at once\n  repeat: cargo run --example fuzz -- {name} --seed {} --only {index}",
            SEED.load(Relaxed)
        );
        std::process::abort();
    }
}

/// What the message of an abort names.
pub fn name(format: &str, seed: u64) {
    let mut bytes = [0; 8];
    bytes[..format.len()].copy_from_slice(format.as_bytes());
    FORMAT.store(u64::from_le_bytes(bytes), Relaxed);
    SEED.store(seed, Relaxed);
}

/// Counts from now on.
pub fn start() {
    let live = LIVE.load(Relaxed);
    BASE.store(live, Relaxed);
    PEAK.store(live, Relaxed);
}

/// The most bytes that were held at once since then.
pub fn peak() -> usize {
    PEAK.load(Relaxed) - BASE.load(Relaxed)
}
