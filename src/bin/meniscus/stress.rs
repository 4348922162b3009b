//! `meniscus stress`: where methods fail, swept; curves, and a table of what passes, what fails and why.

mod curves;
mod store;

use crate::{
    choices, on, options,
    outputs::{self, OutputError},
    report,
    scene::progress,
    terminal, units,
};
use clap::builder::PossibleValuesParser;
use meniscus::{
    Equirect, PRESETS, Settings,
    host::{Gpu, Instance, Session},
    study::stress::{CASES, Case, Extent, Fault, Rig, Step},
};
use serde_json::{Value, json};
use std::{error::Error, path::PathBuf, process::ExitCode};
use store::Store;

#[derive(clap::Args)]
pub struct Args {
    /// Folder for curves (.svg), figures (stress.csv, stress.json) and the table (stress.md)
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Methods; all published ones if not given
    #[arg(long, value_name = "PRESET,...", value_delimiter = ',', value_parser = choices::presets())]
    pub methods: Vec<String>,
    /// Of all cases these
    #[arg(long, value_name = "CASE,...", value_delimiter = ',', long_help = cases_help(), value_parser = names())]
    pub only: Vec<String>,
    /// Fewer steps of each case: enough to see one fail
    #[arg(long)]
    pub small: bool,
    #[command(flatten)]
    pub units: units::Units,
    /// Device whose name or driver contains this; the best one if not given
    #[arg(long, value_name = "NAME")]
    pub device: Option<String>,
}

fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(CASES.iter().map(|c| c.name))
}

fn cases_help() -> String {
    let each: Vec<_> = CASES.iter().map(|c| format!("{}: {}", c.name, c.about)).collect();
    format!("Of all cases these:\n{}", each.join("\n"))
}

/// What a method made of a case.
pub struct Run {
    pub case: &'static Case,
    pub method: &'static str,
    pub steps: Vec<Step>,
    pub fault: Option<Fault>,
}

impl Run {
    /// Whether the method has a figure that the case is about.
    fn is_measured(&self) -> bool {
        self.steps.iter().any(|s| s.found.iter().skip(1).any(Option::is_some))
    }

    fn verdict(&self) -> &'static str {
        match self.fault {
            Some(_) => "fail",
            None if self.is_measured() => "pass",
            None => "-",
        }
    }
}

type Unit = (&'static Case, &'static str, Settings);

/// What is asked for: cases, methods, and the units that they make, each what one method makes of one case.
fn asked(args: &Args) -> (Vec<&'static Case>, Vec<(&'static str, Settings)>, Vec<Unit>) {
    let methods = PRESETS.iter().filter(|p| args.methods.is_empty() || args.methods.iter().any(|m| m == p.name));
    let methods: Vec<_> = methods.map(|p| (p.name, Settings::from(p.method()))).collect();
    let cases: Vec<_> =
        CASES.iter().filter(|c| args.only.is_empty() || args.only.iter().any(|o| o == c.name)).collect();
    let all = cases.iter().flat_map(|case| methods.iter().map(move |(m, s)| (*case, *m, *s))).collect();
    (cases, methods, all)
}

/// Into how many units it falls.
pub fn count(args: &Args) -> usize {
    asked(args).2.len()
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let (cases, methods, all) = asked(args);
    let names: Vec<_> = all.iter().map(|(case, method, _)| format!("{}/{method}", case.name)).collect();
    if args.units.listed(&names)? {
        return Ok(ExitCode::SUCCESS);
    }
    let some = args.units.some(&names)?;
    outputs::folder(&args.output)?;
    let instance = Instance::new(false)?;
    let device = instance.pick(args.device.as_deref())?;
    terminal::progress(format!("device: {}", device.label()));
    let store = Store::open(&args.output, &device.label(), args.small)?;
    let on_device = on(&device);
    let gpu = Gpu::new(&instance, device).map_err(|e| on_device(e.into()))?;
    let mut session = Session::new(&gpu, [160, 120], &Equirect::procedural_sky()).map_err(|e| on_device(e.into()))?;
    let extent = if args.small { Extent::Small } else { Extent::Full };
    let wanted: Vec<_> =
        all.iter().enumerate().filter(|(i, _)| some.as_ref().is_none_or(|s| s.contains(i))).map(|u| *u.1).collect();
    let runs = sweep(&mut session, &wanted, extent, &store);
    session.end();
    let runs = runs.map_err(on_device)?;
    if some.is_some() {
        terminal::progress(format!("{} of {} units are in {}", runs.len(), all.len(), args.output.display()));
        return Ok(ExitCode::SUCCESS);
    }
    for case in &cases {
        let own: Vec<_> = runs.iter().filter(|r| r.case.name == case.name).collect();
        for (measure, name) in case.measures.iter().enumerate().map(|(i, m)| (i, m.name)) {
            let Some(svg) = curves::draw(case, measure, &own)? else { continue };
            let file = format!("{}, {}.svg", case.name, name.replace('%', "percent"));
            outputs::write(
                &args.output.join(file.replace('\'', "").replace([' ', ','], "-").replace("--", "-")),
                svg.as_bytes(),
            )?;
        }
    }
    let table = table(&cases, &methods, &runs);
    write(args, &gpu.info.label(), &cases, &table, &runs)?;
    for line in table {
        terminal::line(line)?;
    }
    let broken: Vec<_> = runs.iter().filter(|r| r.case.promised.contains(&r.method) && r.fault.is_some()).collect();
    for r in &broken {
        terminal::complain(format!(
            "meniscus: {} does not keep what it promises: {}: {}",
            r.method,
            r.case.name,
            why(r)
        ));
    }
    terminal::progress(format!("wrote {}", args.output.display()));
    Ok(if broken.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// All that these units find, which are run if they are not there.
fn sweep(session: &mut Session, units: &[Unit], extent: Extent, store: &Store) -> Result<Vec<Run>, Box<dyn Error>> {
    let bar = progress(units.len() as u64, "sweeps");
    let mut rig = Rig::new(session);
    let mut runs = Vec::new();
    for (case, method, settings) in units {
        let steps = match store.steps(case, method, settings) {
            Some(steps) => steps,
            None => {
                let steps =
                    case.run(&mut rig, settings, extent).map_err(|e| format!("{method}, {}: {e}", case.name))?;
                store.keep(case, method, settings, &steps)?;
                steps
            }
        };
        let fault = case.fault(&steps);
        runs.push(Run { case, method, steps, fault });
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(runs)
}

/// Why a run fails, in words.
fn why(run: &Run) -> String {
    let Some(f) = run.fault else { return String::new() };
    let m = &run.case.measures[f.measure];
    format!("{} ({}: {}, at most {}, at {} {})", m.beyond, m.name, short(f.found), m.bound, short(f.x), run.case.x)
}

/// A figure with as many digits as are worth reading.
fn short(v: f64) -> String {
    if v.abs() >= 100.0 || v == v.trunc() { format!("{v:.0}") } else { format!("{v:.2}") }
}

/// Cases down, methods across, and below what fails and why.
fn table(cases: &[&'static Case], methods: &[(&'static str, Settings)], runs: &[Run]) -> Vec<String> {
    let wide = cases.iter().map(|c| c.name.len()).max().unwrap_or(0);
    let columns: Vec<_> = methods.iter().map(|m| m.0.len().max(6)).collect();
    let row = |name: &str, cells: Vec<&str>| {
        let cells: Vec<_> = cells.iter().zip(&columns).map(|(c, w)| format!("{c:<w$}")).collect();
        format!("| {name:<wide$} | {} |", cells.join(" | "))
    };
    let rule: Vec<_> = columns.iter().map(|w| "-".repeat(*w)).collect();
    let mut lines = vec![
        row("", methods.iter().map(|m| m.0).collect()),
        format!("|-{}-|-{}-|", "-".repeat(wide), rule.join("-|-")),
    ];
    for case in cases {
        let own = runs.iter().filter(|r| r.case.name == case.name);
        lines.push(row(case.name, own.map(Run::verdict).collect()));
    }
    lines.push(String::new());
    lines.extend(
        runs.iter().filter(|r| r.fault.is_some()).map(|r| format!("- {}, {}: {}", r.case.name, r.method, why(r))),
    );
    lines
}

fn write(args: &Args, device: &str, cases: &[&Case], table: &[String], runs: &[Run]) -> Result<(), OutputError> {
    let mut csv = String::from("case,method,x,measure,found,bound\n");
    for r in runs {
        for step in &r.steps {
            for (m, found) in r.case.measures.iter().zip(&step.found) {
                let found = found.map_or(String::new(), |f| f.to_string());
                csv += &format!("{},{},{},\"{}\",{found},{}\n", r.case.name, r.method, step.x, m.name, m.bound);
            }
        }
    }
    outputs::write(&args.output.join("stress.csv"), csv.as_bytes())?;
    let record = json!({
        "meniscus": env!("CARGO_PKG_VERSION"),
        "commit": report::COMMIT,
        "command": options::command(),
        "device": device,
        "runs": runs.iter().map(record).collect::<Vec<_>>(),
    });
    outputs::write(&args.output.join("stress.json"), format!("{record:#}\n").as_bytes())?;
    let about = cases.iter().map(|c| format!("- **{}**: {}", c.name, c.about)).collect::<Vec<_>>().join("\n");
    let text = format!("# Where methods fail\n\n{device}\n\n{}\n\n{about}\n", table.join("\n"));
    outputs::write(&args.output.join("stress.md"), text.as_bytes())
}

fn record(run: &Run) -> Value {
    let each = |(i, m): (usize, &meniscus::study::stress::Measure)| {
        // JSON has no infinity: what is no number is null, and fails all the same.
        json!({"measure": m.name, "bound": m.bound, "found": run.steps.iter().map(|s| s.found[i]).collect::<Vec<_>>()})
    };
    json!({
        "case": run.case.name,
        "method": run.method,
        "x": {"what": run.case.x, "at": run.steps.iter().map(|s| s.x).collect::<Vec<_>>()},
        "figures": run.case.measures.iter().enumerate().map(each).collect::<Vec<_>>(),
        "promised": run.case.promised.contains(&run.method),
        "pass": (run.fault.is_some() || run.is_measured()).then_some(run.fault.is_none()),
        "why": why(run),
    })
}
