//! `meniscus workload`: fixed frames for simulators, traces and modified drivers. Particles are made here, on one queue of a
//! device without extensions or optional features; what it is given to do is printed command by command.

use crate::{bench, choices, on, outputs, report, terminal::line, validated};
use clap::ValueEnum;
use glam::Vec3;
use meniscus::{
    Camera, Equirect, FrameInput, Settings,
    ash::vk::ImageView,
    host::{Gpu, HostError, Instance, Session, Upload},
    io::images::{check_extension, encode_picture},
    prepare::DevicePositions,
    work::{Command, WorkEntry},
};
use serde_json::{Value, json};
use std::{collections::HashMap, error::Error, path::PathBuf, process::ExitCode};

#[derive(clap::Args)]
pub struct Args {
    /// Which one
    #[arg(value_enum)]
    name: Name,
    /// Method that draws it
    #[arg(long, value_name = "PRESET", default_value = "field", value_parser = choices::presets())]
    method: String,
    /// Device whose name or driver contains this; the best one if not given
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Run with core and synchronization validation; exit code 4 if it has something to say
    #[arg(long)]
    validate: bool,
    /// Where to write the commands of every frame as JSON; the terminal shows those of the first in any case
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    /// Where to write the last frame's picture
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Name {
    /// 128x128 pixels, 2,000 particles
    #[value(name = "128")]
    Small,
    /// 512x512 pixels, 16,000 particles
    #[value(name = "512")]
    Medium,
    /// 1920x1080 pixels, 128,000 particles
    #[value(name = "1080p")]
    Large,
}

impl Name {
    /// Width and height in pixels, and particles along the shorter edges of the pool.
    fn size(self) -> ([u32; 2], u32) {
        match self {
            Name::Small => ([128, 128], 10),
            Name::Medium => ([512, 512], 20),
            Name::Large => ([1920, 1080], 40),
        }
    }
}

const FRAMES: u32 = 3;

fn count(edge: u32) -> u32 {
    2 * edge * edge * edge
}

/// A pool at rest spacing, twice as long as it is wide and deep, every particle a fifth of a radius off its place; one of 25 is
/// a drop, above it, that falls. Sums, products and quotients alone, which are the same on every machine.
fn positions(edge: u32, frame: u32) -> Vec<Vec3> {
    let mut state = bench::SEED;
    let spacing = 2.0 * bench::RADIUS;
    let all = (0..count(edge)).map(|i| {
        let at = bench::place(edge, i) + bench::offset(&mut state, 0.2 * bench::RADIUS);
        let drop = bench::unit(&mut state) < 0.04;
        if drop { at + Vec3::Y * (spacing * (1.2 * edge as f32 - frame as f32)) } else { at }
    });
    all.collect()
}

fn camera(edge: u32, size: [u32; 2]) -> Camera {
    let length = 2.0 * bench::RADIUS * edge as f32;
    let target = length * Vec3::new(1.0, 0.8, 0.5);
    let eye = target + length * Vec3::new(0.8, 1.0, 3.2);
    Camera::look_at(eye, target, Vec3::Y, 45f32.to_radians(), size[0] as f32 / size[1] as f32, 0.1 * bench::RADIUS)
}

/// A command and its size: bytes, work groups or vertices, as the device found them where they lay in a buffer.
struct Done {
    entry: WorkEntry,
    kind: &'static str,
    indirect: bool,
    size: [u64; 3],
}

impl Done {
    fn amount(&self) -> u64 {
        self.size.iter().product()
    }
}

struct Frame {
    checksum: String,
    done: Vec<Done>,
}

impl Frame {
    /// How many commands there are of a kind, and the sum of their sizes.
    fn sum(&self, kind: &str) -> (usize, u64) {
        let of = || self.done.iter().filter(|d| d.kind == kind);
        (of().count(), of().map(Done::amount).sum())
    }
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    if let Some(path) = &args.output {
        report::check_json(path, "file")?;
    }
    if let Some(path) = &args.picture {
        check_extension(path)?;
    }
    let written = [("the commands (--output)", &args.output), ("the picture (--picture)", &args.picture)];
    let written: Vec<_> = written.iter().filter_map(|(what, path)| Some((*what, path.as_deref()?))).collect();
    outputs::check(&written, None, &[])?;
    let (size, edge) = args.name.size();
    let instance = Instance::new(args.validate)?;
    let mut device = instance.pick(args.device.as_deref())?;
    // Optional, so that the device is made without it.
    device.large_points = false;
    line(report::measured_on(&device))?;
    let on_device = on(&device);
    let gpu = Gpu::new(&instance, device).map_err(|e| on_device(e.into()))?;
    let sky = Equirect::procedural_sky();
    let mut session = Session::new(&gpu, size, &sky).map_err(|e| on_device(e.into()))?;
    let frames = frames(args, &mut session, size, edge);
    let picture = args.picture.as_ref().map(|path| Ok((path, session.picture()?)));
    session.end();
    let frames = frames.map_err(&on_device)?;
    print(args, size, edge, &frames)?;
    if let Some((path, picture)) = picture.transpose().map_err(on_device)? {
        outputs::write(path, &encode_picture(path, size, &picture)?)?;
        line(format!("wrote {}", path.display()))?;
    }
    if let Some(path) = &args.output {
        outputs::write(path, &serde_json::to_vec_pretty(&tree(args, size, edge, &frames, &gpu))?)?;
        line(format!("wrote {}", path.display()))?;
    }
    Ok(validated(&instance))
}

fn frames(args: &Args, session: &mut Session, size: [u32; 2], edge: u32) -> Result<Vec<Frame>, Box<dyn Error>> {
    let method = choices::preset(&args.method).ok_or("a method that clap has not refused")?.method();
    let mut settings = Settings::from(method);
    settings.liquid.absorption = Vec3::new(1.0, 0.35, 0.2) / (4.0 * bench::RADIUS * edge as f32);
    let camera = camera(edge, size);
    let mut frames = Vec::new();
    for frame in 0..FRAMES {
        let positions = positions(edge, frame);
        let upload = Upload::new(session.gpu, bytemuck::cast_slice(&positions))?;
        let given = DevicePositions::packed(upload.buffer, positions.len() as u32, bench::RADIUS);
        session.frame(&FrameInput::new(0, &camera, &settings, ImageView::null()).positions(given))?;
        let picture = session.picture()?;
        let checksum = blake3::hash(bytemuck::cast_slice(&picture)).to_hex()[..16].to_owned();
        frames.push(Frame { checksum, done: done(session)? });
    }
    Ok(frames)
}

/// What the last frame gave the device to do. Arguments in buffers are as shaders left them.
fn done(session: &mut Session) -> Result<Vec<Done>, HostError> {
    let mut read = HashMap::new();
    let mut all = Vec::new();
    for entry in session.renderer.work().to_vec() {
        let mut arguments = |buffer: &'static str, offset: u64, count: usize| -> Result<[u64; 3], HostError> {
            if !read.contains_key(buffer) {
                read.insert(buffer, session.words(buffer, 0)?.unwrap_or_default());
            }
            let words = read[buffer].iter().skip(offset as usize / 4).take(count);
            let mut size = [1; 3];
            size.iter_mut().zip(words).for_each(|(to, word)| *to = u64::from(*word));
            Ok(size)
        };
        let (kind, indirect, size) = match entry.command {
            Command::Fill { bytes } => ("fill", false, [bytes, 1, 1]),
            Command::Dispatch { groups } => ("dispatch", false, groups.map(u64::from)),
            Command::DispatchIndirect { buffer, offset } => ("dispatch", true, arguments(buffer, offset, 3)?),
            Command::Draw { vertices } => ("draw", false, [u64::from(vertices), 1, 1]),
            // Vertices and instances.
            Command::DrawIndirect { buffer, offset } => ("draw", true, arguments(buffer, offset, 2)?),
        };
        all.push(Done { entry, kind, indirect, size });
    }
    Ok(all)
}

/// What the sizes of commands of a kind are.
const KINDS: [(&str, &str, &str); 3] =
    [("dispatch", "dispatches", "groups"), ("draw", "draws", "vertices"), ("fill", "fills", "bytes")];

fn print(args: &Args, size: [u32; 2], edge: u32, frames: &[Frame]) -> Result<(), Box<dyn Error>> {
    let name = args.name.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned());
    line(format!(
        "workload {name}: {}x{} pixels, {} particles, {FRAMES} frames, method {}; one queue, no extensions, no optional features",
        size[0],
        size[1],
        count(edge),
        args.method
    ))?;
    line("")?;
    line(format!("{:<24} {:<18} {:<28} size", "pass, first frame", "command", "shader"))?;
    for d in &frames[0].done {
        let (_, _, unit) = KINDS.iter().find(|k| k.0 == d.kind).expect("one of the three");
        let kind = format!("{}{}", d.kind, if d.indirect { ", indirect" } else { "" });
        let times = d.size.map(|n| n.to_string());
        let size = if d.kind == "dispatch" { times.join("x") } else { d.amount().to_string() };
        line(format!("{:<24} {kind:<18} {:<28} {size} {unit}", d.entry.pass, d.entry.shader))?;
    }
    line("")?;
    for (i, frame) in frames.iter().enumerate() {
        let sums = KINDS.map(|(kind, all, unit)| {
            let (count, amount) = frame.sum(kind);
            format!("{count} {all} ({amount} {unit})")
        });
        line(format!("frame {}: {}; picture {}", i + 1, sums.join(", "), frame.checksum))?;
    }
    Ok(())
}

fn tree(args: &Args, size: [u32; 2], edge: u32, frames: &[Frame], gpu: &Gpu) -> Value {
    let frames: Vec<_> = frames
        .iter()
        .map(|frame| {
            let commands = frame.done.iter().map(|d| {
                json!({
                    "pass": d.entry.pass, "command": d.kind, "indirect": d.indirect, "shader": d.entry.shader, "size": d.size,
                })
            });
            json!({"picture": frame.checksum, "commands": commands.collect::<Vec<_>>()})
        })
        .collect();
    json!({
        "device": gpu.info.name, "driver": gpu.info.driver, "commit": report::COMMIT, "size": size,
        "particles": count(edge), "method": args.method, "frames": frames,
    })
}
