//! What the Tracy profiler is told, read by a profiler of our own: `cargo test --features tracy --test tracy`.

use meniscus::{
    Camera, Ellipsoid, Equirect, FrameInput, Particles, Settings,
    ash::vk,
    glam::{Mat3, Vec3},
    host::{Gpu, Instance, Session},
    profile::FrameTimes,
};
use std::{
    io::{Read, Write},
    net::TcpStream,
    time::{Duration, Instant},
};

/// Of Tracy 0.13 (`TracyProtocol.hpp`), whose client `Cargo.lock` names.
const PROTOCOL: u32 = 82;
const WELCOME: u8 = 1;
const WELCOME_BYTES: usize = 1170;
const PID_AT: usize = 48;
/// The first port that a client listens on, and how many it tries.
const PORTS: std::ops::Range<u16> = 8086..8106;
/// What a block of the stream can refer back to.
const HISTORY: usize = 64 << 10;
const MOST_BYTES: usize = 1 << 20;

/// A connection to this process's client.
fn connect() -> Option<TcpStream> {
    PORTS.into_iter().find_map(|port| {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
        stream.set_read_timeout(Some(Duration::from_secs(5))).ok()?;
        stream.write_all(&[&b"TracyPrf"[..], &PROTOCOL.to_le_bytes()].concat()).ok()?;
        let mut said = [0; 1 + WELCOME_BYTES];
        stream.read_exact(&mut said).ok()?;
        let pid: [u8; 8] = said[1 + PID_AT..][..8].try_into().ok()?;
        (said[0] == WELCOME && u64::from_le_bytes(pid) == u64::from(std::process::id())).then_some(stream)
    })
}

/// Whatever it sends until `enough` of it has come.
fn receive(stream: &mut TcpStream, enough: impl Fn(&[u8]) -> bool) -> Vec<u8> {
    let (mut all, begin) = (Vec::new(), Instant::now());
    while !enough(&all) && begin.elapsed() < Duration::from_secs(20) {
        let mut size = [0; 4];
        stream.read_exact(&mut size).expect("a block of the stream");
        let mut block = vec![0; u32::from_le_bytes(size) as usize];
        stream.read_exact(&mut block).expect("a whole block");
        let history = &all[all.len().saturating_sub(HISTORY)..];
        let mut text = vec![0; MOST_BYTES];
        let long = lz4_flex::block::decompress_into_with_dict(&block, &mut text, history).expect("LZ4");
        all.extend_from_slice(&text[..long]);
    }
    all
}

fn count(all: &[u8], part: &[u8]) -> usize {
    all.windows(part.len()).filter(|w| *w == part).count()
}

/// Moments of a frame's zones in nanoseconds: of the frame around them, and of each pass.
fn moments(times: &FrameTimes) -> Vec<i64> {
    let [begin, end] = [times.begin_ns, times.begin_ns.round() + 1e6 * times.span_ms].map(|ns| ns.round() as i64);
    let after = |ms: f64| (begin + (1e6 * ms).round() as i64).min(end);
    let passes = times.passes.iter().flat_map(|p| [after(p.begin_ms), after(p.begin_ms + p.ms)]);
    [begin].into_iter().chain(passes).chain([end]).collect()
}

#[test]
fn passes_are_zones() {
    let instance = Instance::new(false).expect("Vulkan");
    let gpu = Gpu::new(&instance, instance.pick(None).expect("one that can")).expect("a device");
    let axes = Mat3::from_diagonal(Vec3::splat(0.3));
    let ball = |i| Ellipsoid { center: Vec3::new(0.5 * (i as f32 - 2.0), 0.0, 0.0), axes };
    let particles = Particles { radius: 0.3, ellipsoids: (0..5).map(ball).collect(), splash_count: 5 };
    let camera = Camera::look_at(Vec3::new(0.0, 0.5, 3.0), Vec3::ZERO, Vec3::Y, 0.8, 4.0 / 3.0, 0.01);
    let settings = Settings::from(meniscus::Method::preset("imai16").expect("a preset"));
    let mut session = Session::new(&gpu, [64, 48], &Equirect::procedural_sky()).expect("a session");
    session.renderer.set_particles(&particles).expect("particles");
    let input = FrameInput::new(0, &camera, &settings, vk::ImageView::null());
    let frames: Vec<_> = (0..3).map(|_| session.frame(&input).expect("a frame").expect("timestamps")).collect();
    session.end();

    let mut stream = connect().expect("a client of this process");
    let frame = b"frame\0src/frame.rs\0meniscus";
    let last = *moments(&frames[2]).last().expect("a moment") - *moments(&frames[2]).iter().rev().nth(1).expect("two");
    let per_frame = moments(&frames[0]).len();
    let moment = |i: usize, ns: i64| [&ns.to_le_bytes()[..], &(i as u16).to_le_bytes(), &[0]].concat();
    let all = receive(&mut stream, |all| count(all, &moment(3 * per_frame - 1, last)) > 0);
    assert_eq!(count(&all, frame), frames.len(), "a zone for each frame");
    for pass in &frames[0].passes {
        let named = frames[0].passes.iter().filter(|p| (&p.name, p.part) == (&pass.name, pass.part)).count();
        let zone = format!("{}\0src/frame.rs\0{}", pass.part, pass.name);
        // What comes after a name is another message, whose kind is no letter.
        let longer = frames[0].passes.iter().filter(|p| p.part == pass.part && p.name != pass.name);
        let longer = longer.filter(|p| p.name.starts_with(&pass.name)).count();
        assert_eq!(count(&all, zone.as_bytes()), (named + longer) * frames.len(), "{pass:?}");
    }
    // Moments are sent as what lies between one and the next, each with its number and its track's.
    for (f, times) in frames.iter().enumerate() {
        for (i, pair) in moments(times).windows(2).enumerate() {
            let number = f * per_frame + i + 1;
            assert!(count(&all, &moment(number, pair[1] - pair[0])) > 0, "moment {number} of {times:?}");
        }
    }
}
