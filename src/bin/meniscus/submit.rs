//! `meniscus submit`: what a scheduler of others needs to make a sequence or a sweep in parts at once. There is none of our own.

mod hyperqueue;
mod openjd;
mod slurm;

use crate::{Cli, Command, outputs, sequence, terminal};
#[cfg(feature = "study")]
use crate::{chart, stress};
use clap::{Parser, ValueEnum};
use std::{
    env,
    error::Error,
    fs,
    path::{Path, PathBuf},
    process::{self, ExitCode},
};

#[derive(clap::Args)]
pub struct Args {
    /// Who runs it
    #[arg(long, value_enum)]
    pub engine: Engine,
    /// Folder for the job's files: submit.sh hands them over, and passes on what it is given (./submit.sh --partition=gpu)
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Parts, each a task of its own; if not given, one for eight pictures, or one for each unit of a sweep, and a thousand at most
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub tasks: Option<u32>,
    /// Where the program lies on the nodes; where this one does if not given
    #[arg(long, value_name = "FILE")]
    pub program: Option<PathBuf>,
    /// Hand it over at once
    #[arg(long)]
    pub run: bool,
    /// The command: sequence 'frames/*.vtk' -o 'out/####.png' ..., chart ..., stress ... Its files are named from this folder, which
    /// nodes have to see
    #[arg(last = true, required = true, value_name = "COMMAND")]
    pub command: Vec<String>,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Engine {
    /// A job array, and a job that joins once all of it is done
    Slurm,
    /// A job file of tasks, the last of which joins once the others are done
    Hyperqueue,
    /// A template of Open Job Description, for those who run it (Deadline Cloud, openjd run)
    Openjd,
}

/// What is to be run.
struct Job {
    program: String,
    /// What names are relative to.
    folder: String,
    /// Without `--part`.
    command: Vec<String>,
    tasks: u32,
    /// Where the job's files are.
    place: String,
}

/// What an engine takes.
struct Engined {
    files: Vec<(&'static str, String)>,
    /// What hands them over, from their folder.
    submit: String,
    /// The program that does.
    by: &'static str,
    /// What brings it.
    package: &'static str,
}

#[derive(Debug, thiserror::Error)]
enum SubmitError {
    #[error(
        "what falls into parts can be submitted: sequence, chart, stress, such as meniscus submit ... -- sequence 'frames/*.vtk' -o \
         'out/####.png', not \"{0}\""
    )]
    NoParts(String),
    #[error("--part is what each task is given: leave it out")]
    Part,
    #[error("{0} is not text that a script can name: move it")]
    NotText(PathBuf),
    #[error("a template has its own {{{{...}}}}: leave them out of \"{0}\"")]
    Braces(String),
    #[error("no program \"{by}\" here: install {package}, or run {script} where it is")]
    NoEngine { by: &'static str, package: &'static str, script: PathBuf },
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let first = args.command.first().map(String::as_str).unwrap_or_default();
    let parsed = Cli::try_parse_from([&"meniscus".to_owned()].into_iter().chain(&args.command));
    // What is wrong with it is said as if it had been called.
    let command = parsed.unwrap_or_else(|e| e.exit()).command;
    let (part, count, what, each) = match command {
        Command::Sequence(sequence) => (sequence.part, sequence::count(&sequence)?, "pictures", 8),
        #[cfg(feature = "study")]
        Command::Chart(chart) => (chart.units.part, chart::count(&chart)?, "scenes", 1),
        #[cfg(feature = "study")]
        Command::Stress(stress) => (stress.units.part, stress::count(&stress), "sweeps", 1),
        _ => return Err(SubmitError::NoParts(terminal::plain(first)).into()),
    };
    if part.is_some() {
        return Err(SubmitError::Part.into());
    }
    let tasks = args.tasks.unwrap_or(count.div_ceil(each).clamp(1, 1000) as u32).min(count as u32);

    outputs::folder(&args.output)?;
    let text = |path: &Path| path.to_str().map(str::to_owned).ok_or_else(|| SubmitError::NotText(path.to_owned()));
    let program = args.program.clone().map_or_else(env::current_exe, Ok)?;
    let job = Job {
        program: text(&program)?,
        folder: text(&env::current_dir()?)?,
        command: args.command.clone(),
        tasks,
        place: text(&fs::canonicalize(&args.output)?)?,
    };
    let engined = match args.engine {
        Engine::Slurm => slurm::files(&job),
        Engine::Hyperqueue => hyperqueue::files(&job),
        Engine::Openjd => openjd::files(&job)?,
    };
    for (name, contents) in &engined.files {
        outputs::write(&args.output.join(name), contents.as_bytes())?;
    }
    let script = args.output.join("submit.sh");
    let head = format!("#!/bin/sh\n# Hands over {tasks} parts of {count} {what}.\nset -e\n");
    let contents = format!("{head}cd -- {}\n{}\n", quoted(&job.place), engined.submit);
    outputs::write(&script, contents.as_bytes())?;
    executable(&script)?;
    terminal::progress(format!("wrote {}: {tasks} parts of {count} {what}", script.display()));
    if !args.run {
        return Ok(ExitCode::SUCCESS);
    }
    if !found(engined.by) {
        return Err(SubmitError::NoEngine { by: engined.by, package: engined.package, script }.into());
    }
    let status = process::Command::new("sh").arg(fs::canonicalize(&script)?).status()?;
    match status.success() {
        true => Ok(ExitCode::SUCCESS),
        false => Err(format!("{}: {} did not take it ({status}); its message is above", script.display(), engined.by))?,
    }
}

impl Job {
    /// A part's command, the part being what the engine calls it.
    fn part(&self, part: &str) -> Vec<String> {
        self.join().into_iter().chain(["--part".to_owned(), format!("{part}/{}", self.tasks)]).collect()
    }

    /// What comes after all parts: makes what is not there, joins tables, and makes films.
    fn join(&self) -> Vec<String> {
        [self.program.clone()].into_iter().chain(self.command.iter().cloned()).collect()
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}

fn line(words: &[String]) -> String {
    words.iter().map(|w| quoted(w)).collect::<Vec<_>>().join(" ")
}

fn found(program: &str) -> bool {
    let folders = env::var_os("PATH").unwrap_or_default();
    env::split_paths(&folders).any(|folder| folder.join(program).is_file())
}

#[cfg(unix)]
fn executable(path: &Path) -> Result<(), Box<dyn Error>> {
    use std::os::unix::fs::PermissionsExt;
    Ok(fs::set_permissions(path, fs::Permissions::from_mode(0o755))?)
}

#[cfg(not(unix))]
fn executable(_: &Path) -> Result<(), Box<dyn Error>> {
    Ok(())
}
