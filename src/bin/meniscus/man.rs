//! `meniscus man`: a manual page of the command and of each of its subcommands, made of the options themselves.

use crate::{Cli, outputs, terminal::progress};
use clap::{Command, CommandFactory};
use clap_mangen::Man;
use std::{error::Error, path::PathBuf, process::ExitCode};

#[derive(clap::Args)]
pub struct Args {
    /// Folder for the pages, made if it is not there: `man -l DIR/meniscus.1` shows the first of them
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

const SOURCE: &str = concat!("meniscus ", env!("CARGO_PKG_VERSION"));

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    // Names of pages follow from building. `help` says what the pages say.
    let mut all = Cli::command().disable_help_subcommand(true);
    all.build();
    outputs::folder(&args.output)?;
    let subcommands: Vec<Command> = all.get_subcommands().filter(|c| !c.is_hide_set()).cloned().collect();
    let count = subcommands.len();
    for command in subcommands.into_iter().chain([all]) {
        // An empty date in quotes, or what follows would be taken for it.
        let page = Man::new(command).date("\"\"").source(SOURCE).manual("User Commands");
        let mut text = Vec::new();
        page.render(&mut text)?;
        outputs::write(&args.output.join(page.get_filename()), in_ascii(&String::from_utf8(text)?).as_bytes())?;
    }
    progress(format!("wrote {}/meniscus.1 and pages of {count} subcommands", args.output.display()));
    Ok(ExitCode::SUCCESS)
}

/// Other letters by their numbers: formatters do not agree on how a page is encoded.
fn in_ascii(page: &str) -> String {
    page.chars().map(|c| if c.is_ascii() { c.to_string() } else { format!("\\[u{:04X}]", u32::from(c)) }).collect()
}
