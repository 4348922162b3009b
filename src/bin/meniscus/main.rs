//! The `meniscus` command: a caller of the library like any other.

mod bench;
mod camera;
mod codes;
mod dump;
mod info;
mod prepared;
mod render;
mod report;
mod scene;
mod stats;

use clap::{Parser, Subcommand};
use meniscus::host::HostError;
use std::process::ExitCode;

/// Particle liquids with complex refractions, in screen space, on Vulkan.
#[derive(Parser)]
#[command(
    version,
    after_help = "Exit codes: 0 done; 1 a file, a parameter or the device failed; 2 wrong usage; 3 no usable Vulkan device;\n4 done, but validation (--validate) had something to say."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render particles to a picture.
    Render(Box<render::Args>),
    /// Measure what each pass takes.
    Bench(Box<bench::Args>),
    /// List devices, drivers, features, limits and file formats.
    Info,
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Render(args) => render::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Info => info::run(),
    };
    match result {
        Ok(code) => code,
        Err(e) => {
            eprintln!("meniscus: {e}");
            let no_device = matches!(e.downcast_ref(), Some(HostError::NoDevice { .. } | HostError::NoDriver { .. } | HostError::Loader(_)));
            ExitCode::from(if no_device { 3 } else { 1 })
        }
    }
}
