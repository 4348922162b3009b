//! The `meniscus` command: a caller of the library like any other.
// A write to a closed pipe or a full disk is no reason to panic: see `terminal`.
#![deny(clippy::print_stdout, clippy::print_stderr, clippy::dbg_macro)]

mod bench;
mod camera;
mod camera_file;
#[cfg(feature = "study")]
mod chart;
mod choices;
mod codes;
#[cfg(feature = "study")]
mod compare;
mod completions;
mod compositing;
mod dump;
mod dump_field;
mod empty;
mod info;
mod keys;
mod man;
mod options;
mod outputs;
mod part;
mod picture;
mod pipelines;
mod prepared;
mod render;
mod report;
mod scene;
mod scene_file;
mod sequence;
mod stats;
#[cfg(feature = "study")]
mod stress;
mod submit;
mod temporary;
mod terminal;
#[cfg(feature = "study")]
mod truth;
#[cfg(feature = "study")]
mod tune;
#[cfg(feature = "study")]
mod units;
#[cfg(feature = "view")]
mod view;
mod workload;

use clap::{Parser, Subcommand, error::ContextValue};
use meniscus::host::{DeviceInfo, HostError, Instance};
use std::{error::Error, process::ExitCode};
use terminal::NotWritten;

/// Particle liquids with complex refractions, in screen space, on Vulkan.
#[derive(Parser)]
#[command(
    version,
    after_help = "Exit codes: 0 done; 1 a file, a parameter or the device failed; 2 wrong usage; 3 no usable Vulkan device;\n4 done, but validation (--validate) had something to say; 130 and 143 ended by SIGINT and SIGTERM."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render particles to a picture.
    Render(Box<render::Args>),
    /// Render the frames of a simulation to numbered pictures; goes on where it was ended
    Sequence(Box<sequence::Args>),
    /// Measure what each pass takes.
    Bench(Box<bench::Args>),
    /// Path-trace the same scene off-line on the CPU: the truth that pictures are compared with
    #[cfg(feature = "study")]
    Truth(Box<truth::Args>),
    /// Chart speed against accuracy of methods and their parameters
    #[cfg(feature = "study")]
    Chart(Box<chart::Args>),
    /// Measure how far a picture is from a reference
    #[cfg(feature = "study")]
    Compare(compare::Args),
    /// Sweep the cases in which methods fail: curves, and what passes, what fails and why
    #[cfg(feature = "study")]
    Stress(stress::Args),
    /// Find the cheapest settings within an error, or the best within a time, and write them as a scene file
    #[cfg(feature = "study")]
    Tune(Box<tune::Args>),
    /// Write, and hand to a scheduler, what makes a sequence in parts at once: Slurm, HyperQueue, OpenJD
    Submit(Box<submit::Args>),
    /// Show particles in a window: fly around them, play a sequence, change method and parameters, two methods side by side
    #[cfg(feature = "view")]
    View(Box<view::Args>),
    /// Print what a driver's compiler makes of a method's shaders: registers, spills, occupancy; needs no GPU
    Pipelines(Box<pipelines::Args>),
    /// Draw a fixed set of frames and print every draw and dispatch of them: for simulators, traces and modified drivers
    Workload(workload::Args),
    /// Print what a shell needs to complete command lines
    Completions(completions::Args),
    /// Write manual pages
    Man(man::Args),
    /// List devices, drivers, features, limits and file formats; or what is in particle files.
    Info(info::Args),
}

fn main() -> ExitCode {
    run().unwrap_or_else(|e| match e.downcast_ref() {
        Some(e) if NotWritten::reader_left(e) => ExitCode::SUCCESS,
        _ => {
            terminal::complain(format!("meniscus: {e}"));
            let no_device = matches!(
                e.downcast_ref(),
                Some(HostError::NoDevice { .. } | HostError::NoDriver { .. } | HostError::Loader(_))
            );
            ExitCode::from(if no_device { 3 } else { 1 })
        }
    })
}

fn run() -> Result<ExitCode, Box<dyn Error>> {
    let command = match Cli::try_parse() {
        Ok(cli) => cli.command,
        Err(e) => return help(e),
    };
    temporary::clean_up_on_signals()?;
    match command {
        Command::Render(args) => render::run(&args),
        Command::Sequence(args) => sequence::run(&args),
        Command::Bench(args) => bench::run(&args),
        #[cfg(feature = "study")]
        Command::Truth(args) => truth::run(&args),
        #[cfg(feature = "study")]
        Command::Chart(args) => chart::run(&args),
        #[cfg(feature = "study")]
        Command::Compare(args) => compare::run(&args),
        #[cfg(feature = "study")]
        Command::Stress(args) => stress::run(&args),
        #[cfg(feature = "study")]
        Command::Tune(args) => tune::run(&args),
        #[cfg(feature = "view")]
        Command::View(args) => view::run(&args),
        Command::Pipelines(args) => pipelines::run(&args),
        Command::Submit(args) => submit::run(&args),
        Command::Workload(args) => workload::run(&args),
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => man::run(&args),
        Command::Info(args) => info::run(&args),
    }
}

/// Names the device in errors that are its own.
fn on(device: &DeviceInfo) -> impl Fn(Box<dyn Error>) -> Box<dyn Error> + use<> {
    use meniscus::Error as Renderer;
    let name = format!("device {} ({})", device.name, device.driver);
    move |e| match e.downcast_ref() {
        Some(
            HostError::Vulkan(..)
            | HostError::Memory(_)
            | HostError::Renderer(Renderer::Vulkan { .. } | Renderer::Memory { .. } | Renderer::MemoryShort { .. }),
        ) => format!("{name}: {e}").into(),
        _ => e,
    }
}

/// Shows what validation had to say, and how the program ends because of it.
fn validated(instance: &Instance) -> ExitCode {
    let messages = instance.messages();
    messages.iter().for_each(|m| terminal::complain(format!("validation: {m}")));
    if messages.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(4) }
}

/// Shows what clap has to say: help, or what was wrong with the command line.
fn help(mut said: clap::Error) -> Result<ExitCode, Box<dyn Error>> {
    // Arguments as they can be shown, before they are taken apart into lines.
    let given: Vec<_> = said.context().map(|(kind, value)| (kind, value.clone())).collect();
    for (kind, value) in given {
        if let ContextValue::String(text) = value {
            said.insert(kind, ContextValue::String(terminal::plain(&text)));
        }
    }
    let wrong = said.use_stderr();
    for line in said.render().to_string().lines() {
        if wrong {
            terminal::complain(line);
        } else {
            terminal::line(line)?;
        }
    }
    Ok(ExitCode::from(if wrong { 2 } else { 0 }))
}

#[cfg(test)]
mod tests {
    use super::Cli;
    use clap::CommandFactory;

    /// Flags that follow from the library's parameters have names of their own.
    #[test]
    fn no_two_options_have_one_name() {
        Cli::command().debug_assert();
    }
}
