//! Fuzzes every reader of files, in this process, on stable Rust: no panic, no allocation beyond the budget, no long read, no
//! message that could hurt a terminal. See CONTRIBUTING.md.
//!
//! Input number N of a format follows from the seed and N alone, so whatever happens can be had again.

mod allocator;
mod mutate;
mod pack;
mod seeds;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

use meniscus::Equirect;
use meniscus::io::particles::{Invalid, ReadError, check_finite, read_bytes};
use meniscus::io::{Budget, images::ImageError, images::environment_from_bytes};
use meniscus::study::{
    mesh::Mesh,
    mesh_file::{self, MeshFileError},
    surface::{MeshSurface, Ray, Surface as _},
};
use mutate::Random;

/// Small, so that what goes beyond it is found quickly.
const BUDGET: Budget = Budget::new(64 << 20);
/// No input takes longer, in seconds, in a debug build on a busy machine.
const LONGEST: u64 = 10;

const FORMATS: [&str; 18] = [
    "xyz", "csv", "ply", "vtk", "vtu", "vtp", "pvd", "pvtu", "dump", "bgeo", "npy", "npz", "png", "hdr", "exr",
    "mesh-ply", "mesh-obj", "mesh-npz",
];

/// The number of the input being read, and when that began, for what watches from outside.
static CURRENT: AtomicU64 = AtomicU64::new(0);
static BEGAN: AtomicU64 = AtomicU64::new(0);

struct Args {
    bytes: u64,
    seed: u64,
    only: Option<u64>,
    formats: Vec<String>,
    files: Vec<PathBuf>,
}

const USAGE: &str = "fuzz [--bytes 100M] [--seed N] [--only N] [FORMAT or FILE ...]";

fn args() -> Result<Args, String> {
    let mut args = Args { bytes: 1 << 20, seed: 1, only: None, formats: Vec::new(), files: Vec::new() };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or_else(|| format!("{word} needs a value"));
        let number = |text: String| text.parse().map_err(|_| format!("{text} is no whole number"));
        match word.as_str() {
            "--bytes" => args.bytes = value()?.parse::<Budget>()?.bytes(),
            "--seed" => args.seed = number(value()?)?,
            "--only" => args.only = Some(number(value()?)?),
            _ if FORMATS.contains(&word.as_str()) => args.formats.push(word),
            _ if Path::new(&word).is_file() => args.files.push(word.into()),
            _ => return Err(format!("{word}: neither a file nor one of {}", FORMATS.join(", "))),
        }
    }
    if args.formats.is_empty() && args.files.is_empty() {
        args.formats = FORMATS.map(str::to_owned).to_vec();
    }
    Ok(args)
}

fn main() -> ExitCode {
    let args = match args() {
        Ok(args) => args,
        Err(error) => {
            eprintln!("{error}\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    let mut failures = 0;
    for file in &args.files {
        let bytes = std::fs::read(file).expect("readable");
        let result = check(file, &bytes);
        println!("{}: {}", file.display(), result.as_ref().unwrap_or_else(|what| what));
        failures += u32::from(result.is_err());
    }
    for format in &args.formats {
        failures += run(format, &args);
    }
    if failures > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

/// Reads mutated files of one format; the number of failures.
fn run(format: &str, args: &Args) -> u32 {
    let seeds = seeds::of(format);
    let name = PathBuf::from(format!("fuzz.{format}"));
    let watched = watch(format.to_owned(), args.seed);
    let (mut failures, mut good, mut bytes, mut most) = (0, 0_u64, 0, (0, 0));
    let start = Instant::now();
    // What nobody touched is read too, and what once went wrong.
    let mut whole = 0;
    for (i, seed) in seeds.iter().enumerate() {
        match check(&name, &seed.pack(&seed.bytes)) {
            Ok(text) => whole += u32::from(text == "read"),
            Err(what) => {
                eprintln!("{format} seed file {i}: {what}");
                failures += 1;
            }
        }
    }
    if whole < 2 {
        eprintln!("{format}: {whole} of {} seed files can be read", seeds.len());
        failures += 1;
    }
    let first = args.only.unwrap_or(0);
    for index in first.. {
        if bytes >= args.bytes || args.only.is_some_and(|only| index > only) || failures >= 20 {
            break;
        }
        let mut random = Random::new(args.seed, format, index);
        let content = mutate::one(&mut random, &seeds, format);
        bytes += content.len() as u64 + 1;
        CURRENT.store(index, Relaxed);
        BEGAN.store(now(), Relaxed);
        let begun = Instant::now();
        let result = check(&name, &content);
        BEGAN.store(0, Relaxed);
        most = most.max((begun.elapsed().as_millis(), index));
        match result {
            Ok(text) => good += u64::from(text == "read"),
            Err(what) => {
                failures += 1;
                let file = save(format, args.seed, index, &content);
                eprintln!("{format}: {what}\n  repeat: cargo run --example fuzz -- {}", file.display());
            }
        }
    }
    watched.store(true, Relaxed);
    println!(
        "{format:>4}: {:6.1} MB from {} seed files ({whole} good); {good} were read; the slowest, number {}, took {} ms; {failures} failures; {:.1} s",
        bytes as f64 / 1e6,
        seeds.len(),
        most.1,
        most.0,
        start.elapsed().as_secs_f64()
    );
    failures
}

/// What is wrong with how `content` is read; or "read", or the error it gives.
fn check(name: &Path, content: &[u8]) -> Result<String, String> {
    let size = content.len();
    let mut name = name.to_owned();
    allocator::start();
    let extension = name.extension().unwrap_or_default().to_string_lossy().into_owned();
    let (result, allowed) = if matches!(&*extension, "png" | "hdr" | "exr") {
        let map = environment_from_bytes(&name, content, None, &BUDGET);
        // Half of the budget is for three copies, one of them here; blocks may take a 32nd, some times over.
        (map.map_err(image_error).map(check_map), BUDGET.bytes() / 2 + 16 * size as u64)
    } else if let Some(kind) = extension.strip_prefix("mesh-") {
        name.set_extension(kind);
        let mesh = mesh_file::from_bytes(&name, content, &BUDGET);
        // Beside what files take a face of two digits is a list of its own.
        let allowed = 2 * BUDGET.allowance(size as u64) + 256 * size as u64;
        (mesh.map_err(mesh_error).map(|mesh| check_mesh(&mesh)), allowed)
    } else {
        let file = read_bytes(&name, content, &BUDGET);
        // Lists that grow may be twice as large as what they hold; libraries take some bytes for each of the file.
        let allowed = 2 * BUDGET.allowance(size as u64) as usize + 128 * size;
        let result = file.map_err(particle_error).map(|mut file| {
            check_finite(&mut file, Invalid::Drop, &name).map_err(|error| error.to_string())?;
            let n = file.positions.len();
            let lengths = file.classes.as_ref().is_none_or(|c| c.len() == n && c.iter().all(|c| *c < 2))
                && file.velocities.as_ref().is_none_or(|v| v.len() == n && v.iter().all(|v| v.is_finite()))
                && file.ids.as_ref().is_none_or(|ids| ids.len() == n)
                && file.axes.as_ref().is_none_or(|a| a.len() == n);
            let radii = [file.radius, file.support].into_iter().flatten().all(|r| r.is_finite() && r > 0.0);
            match lengths && radii && file.positions.iter().all(|p| p.is_finite()) {
                true => Ok(()),
                false => Err("read, but with wrong lengths, classes or radii".to_owned()),
            }
        });
        (result, allowed as u64)
    };
    let peak = allocator::peak();
    if peak as u64 > allowed + (1 << 20) {
        return Err(format!("{peak} bytes were allocated for a file of {size}, {allowed} allowed"));
    }
    match result {
        Ok(content) => content.map(|()| "read".into()),
        Err((message, None)) => check_message(&name, message),
        Err((_, Some(panic))) => Err(format!("panic: {panic}")),
    }
}

type Failure = (String, Option<String>);

fn particle_error(error: ReadError) -> Failure {
    let message = error.to_string();
    match error {
        ReadError::Panicked { panic, .. } => (message, Some(panic)),
        _ => (message, None),
    }
}

fn image_error(error: ImageError) -> Failure {
    let message = error.to_string();
    match error {
        ImageError::Panicked { panic, .. } => (message, Some(panic)),
        _ => (message, None),
    }
}

fn mesh_error(error: MeshFileError) -> Failure {
    let message = error.to_string();
    match error {
        MeshFileError::Panicked { panic, .. } => (message, Some(panic)),
        MeshFileError::Archive(error) => particle_error(error),
        _ => (message, None),
    }
}

/// Rays can be sent at every mesh that is not refused.
fn check_mesh(mesh: &Mesh) -> Result<(), String> {
    if let Err(error) = mesh.check() {
        return if error.to_string().contains(": ") { Ok(()) } else { Err(format!("no remedy: {error}")) };
    }
    let traced = || {
        let (surface, (low, high)) = (MeshSurface::new(mesh), mesh.bounds());
        let origin = low - 0.5 * (high - low);
        surface.hit(&Ray { origin, dir: (0.5 * (low + high) - origin).normalize() }, None)
    };
    let seen = std::panic::catch_unwind(traced).map_err(|_| "panic: at a ray".to_owned())?;
    match seen.is_none_or(|hit| hit.t.is_finite() && hit.geometric.is_finite() && hit.shading.is_finite()) {
        true => Ok(()),
        false => Err(format!("read, but a ray meets it at {seen:?}")),
    }
}

fn check_map(map: Equirect) -> Result<(), String> {
    let [width, height] = map.size();
    let right = map.texels().len() == 4 * width as usize * height as usize
        && map.texels().iter().all(|v| v.is_finite() && *v >= 0.0);
    if right { Ok(()) } else { Err("read, but with texels that light cannot have".into()) }
}

/// A message names its file, is one line that can be printed, not too long, and no library's internals.
fn check_message(name: &Path, message: String) -> Result<String, String> {
    let foreign = ["unwrap()", "panicked", ".rs:", "assertion"];
    let bad = if !message.starts_with(&name.display().to_string()) {
        "does not name its file"
    } else if message.chars().any(|c| c.is_control()) {
        "has control characters"
    } else if message.chars().count() > 500 {
        "is too long"
    } else if !message.contains("; ") && !message.contains(": environment map is ") {
        "has no remedy"
    } else if foreign.iter().any(|word| message.contains(word)) {
        "has a library's internals"
    } else {
        return Ok(message);
    };
    Err(format!("the message {bad}: {message:?}"))
}

/// Keeps an input that went wrong.
fn save(format: &str, seed: u64, index: u64, content: &[u8]) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/fuzz");
    std::fs::create_dir_all(&folder).expect("a folder");
    let file = folder.join(format!("seed{seed}-{index}.{format}"));
    std::fs::write(&file, content).expect("written");
    file
}

fn now() -> u64 {
    std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |time| time.as_secs())
}

/// Ends the process when an input takes too long. Store `true` in what is returned when all is done.
fn watch(format: String, seed: u64) -> std::sync::Arc<std::sync::atomic::AtomicBool> {
    let done = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
    let watched = done.clone();
    allocator::name(&format, seed);
    std::thread::spawn(move || {
        while !done.load(Relaxed) {
            std::thread::sleep(Duration::from_millis(200));
            let began = BEGAN.load(Relaxed);
            if began != 0 && now() > began + LONGEST {
                let index = CURRENT.load(Relaxed);
                let file = save(&format, seed, index, &{
                    let mut random = Random::new(seed, &format, index);
                    mutate::one(&mut random, &seeds::of(&format), &format)
                });
                eprintln!(
                    "{format}: longer than {LONGEST} s\n  repeat: cargo run --example fuzz -- {}",
                    file.display()
                );
                std::process::exit(1);
            }
        }
    });
    watched
}
