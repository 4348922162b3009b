//! What follows from a frame's plan: pipelines made ahead, pools as large as it takes, the ledger.

use crate::{
    background::{HostScene, painted},
    host::{self, SIZE, case, with_renderer},
    support::{Choose, each_driver, imai16, random_cloud},
};
use ash::vk::{self, Handle};
use glam::Vec3;
use meniscus::{
    Background, FrameInput, Particles, Renderer, Settings,
    host::{Canvas, Gpu, Upload},
    prepare::{DeviceIds, DevicePositions, Options, Search},
    renderer::Amount,
    smooth::{Smooth, curvature_flow::CurvatureFlow, plane_fit::PlaneFit},
};
use std::{
    ffi::c_void,
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
};

const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

fn draw(gpu: &Gpu, renderer: &mut Renderer, canvas: &Canvas, input: &FrameInput) {
    gpu.run(|cmd| {
        canvas.transition(cmd, vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
        // SAFETY: `cmd` is recording outside rendering; `run` waits, so slot 0 is free; the output is in its layout.
        Ok(unsafe { renderer.record(cmd, input) }?)
    })
    .expect("frame");
}

fn cloud(splash: usize, body: usize) -> Particles {
    random_cloud(3, 0.1, Vec3::splat(-0.5), Vec3::splat(0.5), splash, body)
}

/// After a warm-up no frame of these settings makes a pipeline, whatever it shows; without one, the first does.
#[test]
fn a_warmed_up_renderer_compiles_nothing() {
    let positions: Vec<Vec3> = cloud(0, 300).ellipsoids.iter().map(|e| e.center).collect();
    each_driver(|driver| {
        with_renderer(driver, FORMAT, 1, |gpu, renderer| {
            let canvas = Canvas::new(gpu, FORMAT, 16, SIZE).expect("canvas");
            let case = case(cloud(5, 60));
            let images = HostScene::new(gpu, &case.camera, SIZE, &painted(SIZE, |x, _| 1.0 + f64::from(x % 7)));
            let upload = Upload::new(gpu, bytemuck::cast_slice(&positions)).expect("upload");
            assert_eq!(renderer.pipelines(), 0);
            renderer.set_particles(&case.particles).expect("particles");
            let like = host::input(&case, 0, vk::ImageView::null());
            let few = renderer.warm_up_like(&like).expect("compiled");
            draw(gpu, renderer, &canvas, &host::input(&case, 0, canvas.view));
            assert!(few > 5 && renderer.pipelines() == few, "{}: {few}, then {}", driver.name, renderer.pipelines());
            let start = std::time::Instant::now();
            let made = renderer.warm_up(&case.settings).expect("compiled");
            println!("{}: {made} pipelines in {:.2} s", driver.name, start.elapsed().as_secs_f64());
            assert_eq!(renderer.pipelines(), few + made);
            assert_eq!(renderer.warm_up(&case.settings).expect("compiled"), 0, "{}: made twice", driver.name);
            let input = host::input(&case, 0, canvas.view);
            for (splash, body) in [(5, 60), (5, 0), (0, 60), (0, 0)] {
                renderer.set_particles(&cloud(splash, body)).expect("particles");
                for background in [Background::Environment, Background::Host] {
                    for scene in [None, Some(images.input())] {
                        draw(gpu, renderer, &canvas, &input.background(background).scene(scene));
                    }
                }
            }
            for search in [Search::Runs, Search::Relation] {
                let options = Options { search, ..Options::default() };
                let given = DevicePositions::packed(upload.buffer, positions.len() as u32, 0.1).options(options);
                let kept = given.keep_class_below(0.6);
                // Whatever lies there will do as ids.
                for given in [given, kept, kept.ids(DeviceIds::packed(upload.buffer, 5))] {
                    draw(gpu, renderer, &canvas, &input.positions(given));
                }
            }
            assert_eq!(renderer.pipelines(), few + made, "{}: a frame compiled something", driver.name);
            // Other settings are other pipelines, but for the background's.
            renderer.set_particles(&cloud(5, 60)).expect("particles");
            let other = case.settings.refractions(2).iterations(0);
            draw(gpu, renderer, &canvas, &FrameInput::new(0, &case.camera, &other, canvas.view));
            assert!(renderer.pipelines() > few + made, "{}: nothing was compiled", driver.name);
        });
    });
}

/// Hundreds of sets and steps in one frame, then few, then more again: pools and timestamps follow, and validation has
/// nothing to say.
#[test]
fn pools_are_as_large_as_the_plan() {
    let many = |iterations| {
        let mut method = imai16().method;
        method.smooth = CurvatureFlow::default().iterations(iterations).into();
        Settings::from(method)
    };
    each_driver(|driver| {
        with_renderer(driver, FORMAT, 1, |gpu, renderer| {
            let canvas = Canvas::new(gpu, FORMAT, 16, SIZE).expect("canvas");
            let mut case = case(cloud(5, 60));
            renderer.set_particles(&case.particles).expect("particles");
            for settings in [many(300), imai16(), many(700), many(20)] {
                case.settings = settings;
                draw(gpu, renderer, &canvas, &host::input(&case, 0, canvas.view));
                let times = renderer.times(0).expect("timestamps");
                let smoothing =
                    times.passes.iter().filter(|p| ["plane fit", "curvature flow"].contains(&p.name.as_str()));
                // Steps of one pass are one scope.
                assert_eq!(smoothing.count(), 1, "{}: {:?}", driver.name, times.passes);
                assert!(times.passes.iter().all(|p| p.ms >= 0.0 && p.ms < 1e5), "{}: {times:?}", driver.name);
            }
        });
    });
}

/// The ledger has what the chosen members make, and nothing else.
#[test]
fn memory_follows_from_the_method() {
    each_driver(|driver| {
        with_renderer(driver, FORMAT, 1, |_, renderer| {
            let names = |smooth: Smooth, refractions| {
                let mut settings = imai16().refractions(refractions);
                settings.method.smooth = smooth;
                let amount = Amount::Prepared { splash: 0, body: 60 };
                let ledger = renderer.memory_requirements(SIZE, amount, &settings).expect("a valid size");
                ledger.into_iter().map(|e| e.name).collect::<Vec<_>>()
            };
            let one = names(PlaneFit::default().iterations(1).into(), 4);
            let two = names(PlaneFit::default().iterations(2).into(), 4);
            let (odd, even) = ("body depth (smoothed, odd)", "body depth (smoothed, even)");
            assert!(one.contains(&odd) && !one.contains(&even), "{one:?}");
            assert!(two.contains(&odd) && two.contains(&even), "{two:?}");
            assert!(two.contains(&"walls") && !names(PlaneFit::default().into(), 1).contains(&"walls"));
            let binomial = names(Smooth::named("binomial").expect("a filter"), 4);
            assert!(binomial.contains(&"missing silhouette") && !two.contains(&"missing silhouette"), "{binomial:?}");
        });
    });
}

/// The device's own vkCreateComputePipelines and vkCreateGraphicsPipelines, and the last cache that each was given.
static ORIGINAL: Mutex<[Option<unsafe extern "system" fn()>; 2]> = Mutex::new([None; 2]);
static CACHES: [AtomicU64; 2] = [AtomicU64::new(0), AtomicU64::new(0)];

macro_rules! noting {
    ($name:ident, $which:literal, $Info:ty, $Function:ty) => {
        unsafe extern "system" fn $name(
            device: vk::Device,
            cache: vk::PipelineCache,
            count: u32,
            infos: *const $Info,
            callbacks: *const vk::AllocationCallbacks,
            pipelines: *mut vk::Pipeline,
        ) -> vk::Result {
            CACHES[$which].store(cache.as_raw(), Ordering::Relaxed);
            let original = ORIGINAL.lock().expect("not poisoned")[$which].expect("loaded");
            // SAFETY: it was loaded under this function's name; the arguments are the caller's.
            unsafe {
                let original: $Function = std::mem::transmute(original);
                original(device, cache, count, infos, callbacks, pipelines)
            }
        }
    };
}
noting!(compute, 0, vk::ComputePipelineCreateInfo, vk::PFN_vkCreateComputePipelines);
noting!(graphics, 1, vk::GraphicsPipelineCreateInfo, vk::PFN_vkCreateGraphicsPipelines);

/// Pipelines are made with the host's cache. The CPU drivers keep nothing in theirs, so the calls are watched.
#[test]
fn the_hosts_pipeline_cache_is_used() {
    each_driver(|driver| {
        let gpu = driver.gpu();
        // SAFETY: a complete info on a live device; destroyed below, after the renderer.
        let cache = unsafe { gpu.device.create_pipeline_cache(&vk::PipelineCacheCreateInfo::default(), None) };
        let cache = cache.expect("cache");
        let mut host = gpu.host(1);
        let load = |name: &std::ffi::CStr| {
            // SAFETY: the device belongs to this instance.
            let own = unsafe { host.instance.get_device_proc_addr(gpu.device.handle(), name.as_ptr()) };
            let watched: Option<(usize, *const c_void)> = match name.to_bytes() {
                b"vkCreateComputePipelines" => Some((0, compute as *const c_void)),
                b"vkCreateGraphicsPipelines" => Some((1, graphics as *const c_void)),
                _ => None,
            };
            if let Some((which, ours)) = watched {
                ORIGINAL.lock().expect("not poisoned")[which] = own;
                return ours;
            }
            own.map_or(std::ptr::null(), |f| f as *const c_void)
        };
        // SAFETY: the same device's functions, two of them watched.
        let device = unsafe { meniscus::ash::Device::load_with(load, gpu.device.handle()) };
        (host.device, host.pipeline_cache) = (device, cache);
        // SAFETY: the device outlives the renderer and has the required features.
        let mut renderer = unsafe { Renderer::new(host, FORMAT) }.expect("renderer");
        let case = case(cloud(5, 60));
        renderer.resize(SIZE).expect("size");
        renderer.set_particles(&case.particles).expect("particles");
        let made = renderer.warm_up_like(&host::input(&case, 0, vk::ImageView::null())).expect("compiled");
        // SAFETY: nothing was recorded, so nothing is in flight.
        unsafe {
            renderer.destroy();
            gpu.device.destroy_pipeline_cache(cache, None);
        }
        let given = CACHES.each_ref().map(|c| c.swap(0, Ordering::Relaxed));
        assert!(made > 5 && given == [cache.as_raw(); 2], "{}: {made}, {given:?}", driver.name);
    });
}
