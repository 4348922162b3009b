//! What a long run costs: memory stays flat and no frame compiles anything, on each driver, over hundreds of frames of
//! every kind. A binary of its own, because it watches the memory of the whole process.

use glam::Vec3;
use meniscus::{
    Background, Camera, Equirect, FrameInput, Method, SceneInput, Settings,
    host::{Canvas, Gpu, Instance, Session, Upload},
    inspect::Inspection,
    layers::split::Split,
    optics::Optics,
    prepare::{self, DevicePositions},
    smooth::plane_fit::PlaneFit,
};
use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::atomic::{AtomicIsize, Ordering},
};

/// A kind of frame.
struct Kind {
    name: &'static str,
    refractions: u32,
    iterations: u32,
    on_device: bool,
    scene: bool,
    debug: bool,
    inside: bool,
    /// Published method, in place of refractions and iterations; none if empty.
    method: &'static str,
}

const PLAIN: Kind = Kind {
    name: "",
    refractions: 4,
    iterations: 2,
    on_device: false,
    scene: false,
    debug: false,
    inside: false,
    method: "",
};
/// Lavapipe of Mesa 22.3 makes constants of uniforms that a branch hangs on alone, and does so in every frame where that changes
/// a shader's size enough; how much is enough differs from shader to shader. Of what can be planted, only a loop in the shader
/// of the second kind has been seen to be compiled anew (tests/mutants/); the other kinds are there for what other drivers do.
const KINDS: [Kind; 17] = [
    Kind { name: "one refraction", refractions: 1, ..PLAIN },
    Kind { name: "one refraction, debug", refractions: 1, debug: true, ..PLAIN },
    Kind { name: "two refractions", refractions: 2, ..PLAIN },
    Kind { name: "four refractions", ..PLAIN },
    Kind { name: "no smoothing", iterations: 0, ..PLAIN },
    Kind { name: "debug", debug: true, ..PLAIN },
    Kind { name: "scene", scene: true, ..PLAIN },
    Kind { name: "scene, debug, eye inside", scene: true, debug: true, inside: true, ..PLAIN },
    Kind { name: "two refractions, debug", refractions: 2, debug: true, ..PLAIN },
    Kind { name: "prepared on the device", on_device: true, ..PLAIN },
    Kind { name: "a field, prepared on the device", method: "field", on_device: true, ..PLAIN },
    Kind { name: "imai14", method: "imai14", ..PLAIN },
    Kind { name: "cords08", method: "cords08", ..PLAIN },
    Kind { name: "green10 before a scene", method: "green10", scene: true, ..PLAIN },
    Kind { name: "im16", method: "im16", ..PLAIN },
    Kind { name: "narrow-range", method: "narrow-range", ..PLAIN },
    Kind { name: "curvature-flow", method: "curvature-flow", ..PLAIN },
];

/// Frames: those that may still fill pools and caches, and those that are watched.
const WARM: usize = 100;
const WATCHED: usize = 200;

/// Bytes a frame by which the process's memory may grow. A driver that compiled a shader in every frame took nine million;
/// SwiftShader goes on filling pools of its own for a thousand frames where shaders have barriers, ever more slowly.
const GROWTH: f64 = 300e3;
/// Milliseconds that any pass of such a small frame may take: it takes a few, compiling it forty and more.
const SLOWEST: f64 = 20.0;

/// Bytes that Rust code holds: the library's and the test's own, none of the driver's.
static HELD: AtomicIsize = AtomicIsize::new(0);

struct Counting;

// SAFETY: every call goes to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        HELD.fetch_add(layout.size() as isize, Ordering::Relaxed);
        // SAFETY: this function's own contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size() as isize, Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Resident memory of this process in bytes.
fn resident() -> f64 {
    let text = std::fs::read_to_string("/proc/self/statm").expect("Linux");
    4096.0 * text.split(' ').nth(1).and_then(|w| w.parse::<f64>().ok()).expect("pages")
}

/// A ball of liquid and a droplet beside it.
fn liquid(radius: f32) -> Vec<Vec3> {
    let axis = || (-5..=5).map(|i| 2.0 * radius * i as f32);
    let lattice = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x, y, z))));
    lattice.filter(|p| p.length() < 11.0 * radius).chain([Vec3::new(14.0 * radius, 0.0, 0.0)]).collect()
}

/// Each usable device in turn, by an instance of its own, without validation, which keeps books of its own.
fn each_device(test: impl Fn(&Gpu)) {
    let devices = Instance::new(false).and_then(|i| i.devices()).expect("a Vulkan loader");
    let usable: Vec<_> = devices.into_iter().filter(|d| d.refusal.is_none()).collect();
    assert!(!usable.is_empty(), "no usable Vulkan device: run ./setup.sh");
    for device in usable {
        let instance = Instance::new(false).expect("instance");
        test(&Gpu::new(&instance, instance.pick(Some(&device.label())).expect("it was there")).expect("device"));
    }
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "reads /proc")]
fn memory_and_time_stay_flat() {
    each_device(|gpu| {
        for kind in &KINDS {
            let label = format!("{}: {}", gpu.info.driver, kind.name);
            let Endured { process, held, slowest, pass } = run(gpu, kind);
            println!("{label}: {:.1} kB a frame, {held} bytes of it Rust's; {pass} {slowest:.2} ms", process / 1e3);
            assert!(process <= GROWTH, "{label}: {process} bytes a frame");
            assert_eq!(held, 0, "{label}: bytes that the library does not give back");
            assert!(slowest <= SLOWEST, "{label}: {pass} takes {slowest} ms");
        }
    });
}

/// What the watched frames cost.
struct Endured {
    /// Bytes a frame by which the process grows.
    process: f64,
    /// Bytes that Rust code holds more than before.
    held: isize,
    /// Milliseconds of the slowest pass in the quickest tenth of the frames, and its name.
    slowest: f64,
    pass: String,
}

fn settings(kind: &Kind) -> Settings {
    if !kind.method.is_empty() {
        return Method::preset(kind.method).expect("a preset").into();
    }
    let optics = ["one", "two", "", "four"][kind.refractions as usize - 1];
    let optics = Optics::named(optics).expect("one of three");
    let smooth = PlaneFit::default().iterations(kind.iterations);
    Method::new(Split::default(), smooth, optics).into()
}

fn run(gpu: &Gpu, kind: &Kind) -> Endured {
    const SIZE: [u32; 2] = [16, 12];
    let radius = 0.05;
    let positions = liquid(radius);
    let grey = Equirect::new(2, 1, &[[0.5; 3]; 2]).expect("a map");
    let mut session = Session::new(gpu, SIZE, &grey).expect("session");
    let settings = settings(kind);
    session.renderer.inspect(Inspection { walks: kind.debug, ..Inspection::default() });
    let input = prepare::Input::new(&positions, radius);
    session.renderer.set_particles(&prepare::prepare(&input, &Default::default()).expect("prepared").0).expect("given");
    let upload = Upload::new(gpu, bytemuck::cast_slice(&positions)).expect("upload");
    let packed = DevicePositions::packed(upload.buffer, positions.len() as u32, radius);
    let device_positions = packed.keep_class_below(0.6);
    let layout = ash::vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
    let image = |format, texel: usize| {
        let canvas = Canvas::new(gpu, format, texel as u64, SIZE).expect("canvas");
        let half = 0.5f32.to_ne_bytes().repeat(texel / 4 * (SIZE[0] * SIZE[1]) as usize);
        canvas.write(&half, layout).expect("written");
        canvas
    };
    let color = image(ash::vk::Format::R32G32B32A32_SFLOAT, 16);
    let depth = image(ash::vk::Format::R32_SFLOAT, 4);
    let scene = SceneInput::new((color.view, layout), (depth.view, layout), 1.0);
    let (mut before, mut held) = (0.0, 0);
    let mut times = Vec::with_capacity(WATCHED);
    for frame in 0..WARM + WATCHED {
        if frame == WARM {
            (before, held) = (resident(), HELD.load(Ordering::Relaxed));
        }
        // A camera that moves, as everything a frame tells shaders does.
        let eye = Vec3::new((0.01 * frame as f32).sin(), 0.2, 2.0);
        let camera = Camera::look_at(eye, Vec3::ZERO, Vec3::Y, 0.7, 4.0 / 3.0, 0.01);
        let frame_times = session
            .frame(
                &FrameInput::new(0, &camera, &settings, ash::vk::ImageView::null())
                    .positions(kind.on_device.then_some(device_positions))
                    .scene(kind.scene.then_some(scene))
                    .background(if kind.scene { Background::Host } else { Background::Environment })
                    .eye_inside(kind.inside),
            )
            .expect("frame");
        if frame >= WARM {
            // Only the slowest pass, by its place: nothing that would count as held.
            let passes = frame_times.expect("timestamps").passes;
            let slowest = (0..passes.len()).max_by(|a, b| passes[*a].ms.total_cmp(&passes[*b].ms)).expect("passes");
            times.push((passes[slowest].ms, slowest));
        }
    }
    held = HELD.load(Ordering::Relaxed) - held;
    let process = (resident() - before) / WATCHED as f64;
    let plan = session.renderer.times(0).expect("timestamps").passes;
    session.end();
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    // The tenth percentile: a busy machine makes most frames slow, compiling makes all of them so.
    let (slowest, place) = times[WATCHED / 10];
    Endured { process, held, slowest, pass: plan[place].name.clone() }
}

/// A window's day: ten thousand frames of liquid that moves, five hundred of them after a size that nobody foresees.
#[test]
#[ignore = "takes minutes: cargo test --test endurance -- --ignored"]
fn ten_thousand_frames_of_five_hundred_sizes() {
    each_device(|gpu| {
        let grey = Equirect::new(2, 1, &[[0.5; 3]; 2]).expect("a map");
        let mut session = Session::new(gpu, [64, 48], &grey).expect("session");
        let (radius, settings) = (0.05, Settings::default());
        let positions = liquid(radius);
        let uploads = [0.0, 0.01].map(|x| {
            let moved: Vec<Vec3> = positions.iter().map(|p| *p + x * Vec3::X).collect();
            Upload::new(gpu, bytemuck::cast_slice(&moved)).expect("upload")
        });
        let mut state = 7_u32;
        let mut random = |most: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            1 + (state >> 16) % most
        };
        let (mut before, mut held, mut resized) = (0.0, 0, 0);
        let (frames, warm) = (10_000, 2_000);
        for frame in 0..frames {
            if random(20) == 1 {
                session.resize([random(96), random(72)]).expect("a size");
                resized += 1;
            }
            if frame == warm {
                session.resize([96, 72]).expect("a size");
                (before, held) = (resident(), HELD.load(Ordering::Relaxed));
            }
            let eye = Vec3::new((0.01 * frame as f32).sin(), 0.2, 2.0);
            let camera = Camera::look_at(eye, Vec3::ZERO, Vec3::Y, 0.7, 4.0 / 3.0, 0.01);
            let given = DevicePositions::packed(uploads[frame % 2].buffer, positions.len() as u32, radius);
            let input = FrameInput::new(0, &camera, &settings, ash::vk::ImageView::null()).positions(given);
            session.frame(&input).expect("frame");
        }
        session.resize([96, 72]).expect("a size");
        let held = HELD.load(Ordering::Relaxed) - held;
        let process = (resident() - before) / (frames - warm) as f64;
        println!("{}: {resized} sizes, {process:.0} bytes a frame, {held} bytes held by Rust", gpu.info.driver);
        assert!(resized > 400 && process < 10e3 && held < 100_000, "{}: {process}, {held}", gpu.info.driver);
        session.end();
    });
}
