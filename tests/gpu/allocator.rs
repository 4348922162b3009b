//! Device memory from an allocator of the host's own.

use crate::{
    field_walk,
    host::SIZE,
    support::{Case, SKY, camera, each_driver, imai16, random_cloud},
};
use ash::vk;
use glam::Vec3;
use meniscus::{
    Error, FrameInput, Host, Renderer,
    allocator::{Location, Memory, MemoryAllocator, Refusal, Request},
    host::{Canvas, Gpu, HostError},
    layers::field::Field,
    prepare,
};
use std::{
    ptr::NonNull,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// The plainest one: an allocation of its own for each resource.
struct Plain {
    device: ash::Device,
    types: vk::PhysicalDeviceMemoryProperties,
    /// Allocations that were not given back.
    alive: AtomicU64,
    asked: AtomicU64,
    /// From this one on there is no more.
    most: u64,
    /// Whether it forgets to say where memory is mapped.
    unmapped: bool,
    /// Bytes of what is alive, by what comes back.
    bytes: AtomicU64,
}

impl Plain {
    fn new(gpu: &Gpu, most: u64, unmapped: bool) -> Plain {
        let host = gpu.host(1);
        // SAFETY: the device's own instance and physical device.
        let types = unsafe { host.instance.get_physical_device_memory_properties(host.physical_device) };
        let [alive, asked, bytes] = [0; 3].map(AtomicU64::new);
        Plain { device: gpu.device.clone(), types, alive, asked, most, unmapped, bytes }
    }
}

// SAFETY: each allocation is a new one, of an allowed type, and mapped where that is asked for.
unsafe impl MemoryAllocator for Plain {
    fn allocate(&self, request: &Request) -> Result<Memory, Refusal> {
        if self.asked.fetch_add(1, Ordering::Relaxed) >= self.most {
            return Err("the engine keeps the rest".into());
        }
        use vk::MemoryPropertyFlags as P;
        let wanted = match request.location {
            Location::Device => P::DEVICE_LOCAL,
            Location::Upload => P::HOST_VISIBLE | P::HOST_COHERENT,
        };
        let fits = |(i, t): &(usize, &vk::MemoryType)| {
            request.requirements.memory_type_bits >> i & 1 == 1 && t.property_flags.contains(wanted)
        };
        let (index, _) = self.types.memory_types_as_slice().iter().enumerate().find(fits).ok_or("no such memory")?;
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(request.requirements.size)
            .memory_type_index(index as u32);
        // SAFETY: a live device; memory of a host-visible type is mapped once, as a whole.
        let (memory, mapped) = unsafe {
            let memory = self.device.allocate_memory(&info, None)?;
            let mapped = match request.location {
                Location::Device => None,
                Location::Upload => {
                    NonNull::new(self.device.map_memory(memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty())?.cast())
                }
            };
            (memory, mapped)
        };
        self.alive.fetch_add(1, Ordering::Relaxed);
        self.bytes.fetch_add(request.requirements.size, Ordering::Relaxed);
        let given = Memory::new(memory, 0).own(request.requirements.size);
        // A host's mistake that cannot be found by the library later.
        Ok(match mapped.filter(|_| !self.unmapped) {
            Some(first) => given.mapped(first),
            None => given,
        })
    }

    fn free(&self, memory: Memory) {
        self.alive.fetch_sub(1, Ordering::Relaxed);
        self.bytes.fetch_sub(*memory.own.downcast_ref::<u64>().expect("a size"), Ordering::Relaxed);
        // SAFETY: no frame uses it any more.
        unsafe { self.device.free_memory(memory.memory, None) };
    }
}

/// What the renderer said; nothing else may fail.
fn refused(error: HostError) -> Error {
    match error {
        HostError::Renderer(e) => e,
        e => panic!("{e}"),
    }
}

fn give(renderer: &mut Renderer, case: &Case) -> Result<(), Error> {
    renderer.set_particles(&case.particles)?;
    let positions: Vec<Vec3> = case.particles.ellipsoids.iter().map(|e| e.center).collect();
    let input = prepare::Input::new(&positions, case.particles.radius);
    renderer.set_points(&prepare::points(&input, &Default::default()).expect("points"))
}

/// Pictures of maps and of a field, in two sizes, on a renderer of a host's.
fn pictures(gpu: &Gpu, host: Host) -> Result<Vec<Vec<u8>>, Error> {
    let particles = random_cloud(7, 0.1, Vec3::splat(-0.6), Vec3::splat(0.6), 30, 300);
    let eye = camera(Vec3::new(0.4, 0.3, 2.4), Vec3::ZERO, SIZE);
    let maps = Case { particles, camera: eye, settings: imai16(), size: SIZE, eye_inside: false };
    let field = field_walk::case(Field::default(), 2, 1);
    // SAFETY: the device outlives the renderer, and has the required features.
    let mut renderer = unsafe { Renderer::new(host, FORMAT) }?;
    let mut draw = || {
        let mut all = Vec::new();
        renderer.resize(SIZE)?;
        // SAFETY: recorded outside rendering, before any frame.
        gpu.run(|cmd| Ok(unsafe { renderer.set_environment(cmd, &SKY) }?)).map_err(refused)?;
        for case in [&maps, &field] {
            renderer.resize(case.size)?;
            give(&mut renderer, case)?;
            let canvas = Canvas::new(gpu, FORMAT, 16, case.size).expect("canvas");
            let input = FrameInput::new(0, &case.camera, &case.settings, canvas.view);
            let recorded = gpu.run(|cmd| {
                canvas.transition(cmd, vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
                // SAFETY: recorded outside rendering; `run` waits.
                Ok(unsafe { renderer.record(cmd, &input) }?)
            });
            recorded.map_err(refused)?;
            all.push(canvas.read().expect("picture"));
        }
        Ok(all)
    };
    let drawn = draw();
    // SAFETY: every frame was waited for.
    unsafe { renderer.destroy() };
    drawn
}

/// The same bits as with gpu-allocator, and everything is given back.
#[test]
fn an_engines_own_allocator_serves() {
    each_driver(|driver| {
        let gpu = driver.gpu();
        let plain = Arc::new(Plain::new(gpu, u64::MAX, false));
        let lent = gpu.host(1);
        let mut own = gpu.host(1);
        own.allocator = plain.clone();
        let (usual, found) = (pictures(gpu, lent).expect("pictures"), pictures(gpu, own).expect("pictures"));
        assert!(usual == found && usual[0] != usual[1], "{}: other pictures", driver.name);
        let [asked, alive, bytes] = [&plain.asked, &plain.alive, &plain.bytes].map(|n| n.load(Ordering::Relaxed));
        println!("{}: {asked} allocations", driver.name);
        assert!(asked > 20, "{}: {asked} asked for", driver.name);
        assert_eq!((alive, bytes), (0, 0), "{}: not given back", driver.name);
    });
}

/// Where it refuses, its own words are in the error, with what they are about; and what there was is given back.
#[test]
fn its_refusals_are_said() {
    each_driver(|driver| {
        let gpu = driver.gpu();
        let mut about = std::collections::BTreeSet::new();
        // A renderer's slot, its environment, particles, points; what a frame takes.
        for most in [0, 1, 2, 3, 5, 6, 9, 15] {
            let plain = Arc::new(Plain::new(gpu, most, false));
            let mut own = gpu.host(1);
            own.allocator = plain.clone();
            let error = pictures(gpu, own).expect_err("refused");
            let said = error.to_string();
            let Error::Memory { resource, source, .. } = error else { panic!("{}: {said}", driver.name) };
            assert!(source.to_string() == "the engine keeps the rest" && said.contains(&source.to_string()), "{said}");
            assert_eq!(plain.alive.load(Ordering::Relaxed), 0, "{}: after {most}", driver.name);
            about.insert(resource);
        }
        assert_eq!(about.len(), 8, "{}: {about:?}", driver.name);
    });
}

/// Memory that the host has to write and that is not mapped is no panic later.
#[test]
fn memory_that_is_not_mapped_is_refused() {
    each_driver(|driver| {
        let gpu = driver.gpu();
        let plain = Arc::new(Plain::new(gpu, u64::MAX, true));
        let mut own = gpu.host(1);
        own.allocator = plain.clone();
        let said = pictures(gpu, own).expect_err("refused").to_string();
        assert!(said.starts_with("frame block needs") && said.contains("not mapped"), "{}: {said}", driver.name);
        assert_eq!(plain.alive.load(Ordering::Relaxed), 0, "{}: not given back", driver.name);
    });
}
