//! `meniscus completions`: what a shell needs to complete its command lines, made of the options themselves.

use crate::{Cli, outputs};
use clap::CommandFactory;
use clap_complete::{Shell, generate};
use std::{error::Error, path::Path, process::ExitCode};

#[derive(clap::Args)]
pub struct Args {
    /// The shell that is to complete
    shell: Shell,
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let mut script = Vec::new();
    generate(args.shell, &mut Cli::command(), "meniscus", &mut script);
    // As it is: lines for a shell are longer than lines for a terminal.
    outputs::write(Path::new("/dev/stdout"), &script)?;
    Ok(ExitCode::SUCCESS)
}
