//! Parts of a sequence, and what schedulers are given: that all of it together is what one run makes. tests/engines.sh does the same
//! on real ones.

use crate::{
    Run, listing,
    sequence::{GIVEN, frames, rows},
    text,
};
use serde_json::Value;
use std::{
    collections::HashMap,
    fs,
    path::Path,
    process::{Command, Output},
};

const SIZE: &[&str] = &["--size", "64x48"];

fn sequence<'a>(folder: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["sequence", "f/*.csv", "-o", folder], SIZE, GIVEN, more].concat()
}

fn made(output: &Output) -> String {
    assert!(output.status.success(), "{}", text(output));
    text(output)
}

fn same(run: &Run, a: &str, b: &str) {
    let names = listing(&run.path(a));
    assert_eq!(names, listing(&run.path(b)));
    assert!(!names.is_empty());
    for name in names {
        let [a, b] = [a, b].map(|folder| fs::read(run.path(folder).join(&name)).expect("a picture"));
        assert!(a == b, "{name} is another picture");
    }
}

#[test]
fn parts_together_are_all_of_it() {
    let run = Run::new();
    frames(&run, 7);
    made(&run.command(&sequence("whole/#.png", &["--stats", "whole.csv", "-o", "whole.gif"])));
    let shared = ["--stats", "s.csv", "-o", "film.gif"];
    // In any order, by programs that know nothing of each other.
    for part in ["2/3", "0/3", "1/3"] {
        made(&run.command(&sequence("parts/#.png", &[&shared[..], &["--part", part]].concat())));
    }
    assert!(!run.path("film.gif").exists() && !run.path("s.csv").exists());
    assert_eq!(rows(&run, "s.part-0-of-3.csv").len() + rows(&run, "s.part-1-of-3.csv").len(), 4);
    same(&run, "whole", "parts");
    let said = made(&run.command(&sequence("parts/#.png", &shared)));
    assert!(said.contains("all 7 pictures are there"), "{said}");
    let film = |name| fs::read(run.path(name)).expect("a film");
    assert!(film("film.gif") == film("whole.gif"));
    let [joined, whole] = [rows(&run, "s.csv"), rows(&run, "whole.csv")];
    // All but times.
    let counts = |rows: &[Vec<String>]| rows.iter().map(|r| [&r[..6], &r[12..]].concat()).collect::<Vec<_>>();
    assert_eq!(counts(&joined), counts(&whole));
    // More parts than pictures.
    let said = made(&run.command(&sequence("parts/#.png", &["--part", "0/30"])));
    assert!(said.contains("more parts than pictures"), "{said}");
    for (wrong, why) in
        [(&["--part", "3/3"][..], "use K/N"), (&["--part", "0/2", "--frames", "40-50"], "there are 0 to 6")]
    {
        let output = run.command(&sequence("parts/#.png", wrong));
        assert!(!output.status.success() && text(&output).contains(why), "{}", text(&output));
    }
    let output = run.command(&sequence("film.gif", &["--part", "0/2"]));
    assert!(!output.status.success() && text(&output).contains("numbered pictures"), "{}", text(&output));
}

/// Submits a sequence with a name that shells do not like, and has something else run what was written.
fn submitted(engine: &str, more: &[&str], run_it: impl Fn(&Run, &Path)) {
    let run = Run::new();
    frames(&run, 5);
    made(&run.command(&sequence("whole/#.png", &[])));
    let name = "it's $HOME/#.png";
    let film = ["-o", "film.gif"];
    let command = sequence(name, &film);
    let submit = [&["submit", "--engine", engine, "-o", "a job"], more, &["--"], &command].concat();
    let said = made(&run.command(&submit));
    assert!(said.contains("5 pictures"), "{said}");
    assert!(listing(&run.path("a job")).contains(&"submit.sh".to_owned()));
    run_it(&run, &run.path("a job"));
    same(&run, "whole", "it's $HOME");
    assert!(run.path("film.gif").is_file());
    // Nothing is made twice.
    let said = made(&run.command(&sequence(name, &[])));
    assert!(said.contains("nothing to do"), "{said}");
}

fn ran(command: &mut Command) {
    let output = command.output().expect("it starts");
    assert!(output.status.success(), "{}", text(&output));
}

/// The words of a JSON or TOML list.
fn words<'a>(list: impl IntoIterator<Item = Option<&'a str>>) -> Vec<String> {
    list.into_iter().map(|w| w.expect("text").to_owned()).collect()
}

#[cfg(unix)]
#[test]
fn a_slurm_array_makes_it() {
    submitted("slurm", &["--tasks", "2"], |_, job| {
        for script in ["parts.sh", "join.sh"] {
            let text = fs::read_to_string(job.join(script)).expect("a script");
            assert!(text.lines().skip(1).take_while(|l| l.starts_with("#SBATCH ")).count() >= 4, "{text}");
        }
        // As Slurm runs them: a copy, from where they were handed over. One is ended in the middle, and queued again.
        for task in ["1", "0", "0"] {
            ran(Command::new("sh").arg("parts.sh").current_dir(job).env("SLURM_ARRAY_TASK_ID", task));
        }
        ran(Command::new("sh").arg("join.sh").current_dir(job));
        // What is handed over, to a program of that name: the array is 0 to 1, and the second job hangs on the first.
        let bin = job.join("bin");
        fs::create_dir(&bin).expect("a folder");
        fs::write(bin.join("sbatch"), "#!/bin/sh\nprintf '%s|' \"$@\" >> \"$(dirname \"$0\")/log\"\necho >> \"$(dirname \"$0\")/log\"\necho '77;here'\n")
            .expect("written");
        ran(Command::new("chmod").arg("+x").arg(bin.join("sbatch")));
        let path = format!("{}:{}", bin.display(), std::env::var("PATH").expect("a path"));
        ran(Command::new("./submit.sh").arg("--partition=gpu").current_dir(job).env("PATH", path));
        let log = fs::read_to_string(bin.join("log")).expect("what was handed over");
        let dependent = "--parsable|--dependency=afterok:77|--kill-on-invalid-dep=yes|--partition=gpu|join.sh|\n";
        assert_eq!(log, format!("--parsable|--array=0-1|--partition=gpu|parts.sh|\n{dependent}"));
    });
}

/// A sweep in parts, and joined.
#[cfg(all(unix, feature = "study"))]
#[test]
fn a_sweep_is_submitted_too() {
    let run = Run::new();
    let stress =
        |folder: &'static str| ["stress", "-o", folder, "--small", "--methods", "field", "--only", "neighbours,sheet"];
    made_or_broken(&run.command(&stress("whole")));
    let said =
        made(&run.command(&[&["submit", "--engine", "slurm", "-o", "job", "--"][..], &stress("parts")].concat()));
    assert!(said.contains("2 parts of 2 sweeps"), "{said}");
    for task in ["1", "0"] {
        ran(Command::new("sh").arg("parts.sh").current_dir(run.path("job")).env("SLURM_ARRAY_TASK_ID", task));
        assert!(!run.path("parts/stress.csv").exists());
    }
    made_or_broken(&Command::new("sh").arg("join.sh").current_dir(run.path("job")).output().expect("it starts"));
    let table = |folder: &str| fs::read_to_string(run.path(folder).join("stress.csv")).expect("a table");
    assert_eq!(table("parts"), table("whole"));
}

/// A case that is not promised may fail.
fn made_or_broken(output: &Output) {
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", text(output));
}

#[cfg(unix)]
#[test]
fn a_hyperqueue_job_makes_it() {
    submitted("hyperqueue", &[], |_, job| {
        let file = fs::read_to_string(job.join("job.toml")).expect("a job");
        let file: toml::Table = file.parse().expect("TOML");
        let tasks = file["task"].as_array().expect("tasks");
        assert_eq!(tasks.len(), 2, "{tasks:?}");
        assert_eq!(tasks[1]["deps"].as_array().expect("needs").len(), 1);
        for task in tasks {
            let command = words(task["command"].as_array().expect("a command").iter().map(toml::Value::as_str));
            ran(Command::new(&command[0]).args(&command[1..]).current_dir(task["cwd"].as_str().expect("a folder")));
        }
    });
}

#[cfg(unix)]
#[test]
fn an_openjd_template_makes_it() {
    submitted("openjd", &["--tasks", "3"], |run, job| {
        let template = fs::read(job.join("template.json")).expect("a template");
        let template: Value = serde_json::from_slice(&template).expect("JSON");
        assert_eq!(template["steps"][1]["dependencies"][0]["dependsOn"], template["steps"][0]["name"]);
        let part = &template["steps"][0]["parameterSpace"]["taskParameterDefinitions"][0];
        assert_eq!((&part["name"], &part["range"]), (&"Part".into(), &"0-2".into()));
        // Values beside the template: it must not have absolute paths as defaults.
        let submit = fs::read_to_string(job.join("submit.sh")).expect("a script");
        assert!(submit.contains("openjd run template.json --job-param file://parameters.json "), "{submit}");
        let given: Value =
            serde_json::from_slice(&fs::read(job.join("parameters.json")).expect("values")).expect("JSON");
        let mut values = HashMap::new();
        for parameter in template["parameterDefinitions"].as_array().expect("parameters") {
            let name = parameter["name"].as_str().expect("a name");
            assert!(parameter["default"].is_null(), "{parameter}");
            values.insert(format!("{{{{Param.{name}}}}}"), given[name].as_str().expect("a value").to_owned());
        }
        let steps = [(0, "0"), (0, "1"), (0, "2"), (1, "")];
        for (step, part) in steps {
            values.insert("{{Task.Param.Part}}".to_owned(), part.to_owned());
            let run_it = &template["steps"][step]["script"]["actions"]["onRun"];
            let mut arguments = words(run_it["args"].as_array().expect("arguments").iter().map(Value::as_str));
            for argument in &mut arguments {
                values.iter().for_each(|(name, value)| *argument = argument.replace(name, value));
                assert!(!argument.contains("{{"), "{argument}");
            }
            // Not from where files are named.
            ran(Command::new(run_it["command"].as_str().expect("a program"))
                .args(&arguments)
                .current_dir(run.path("a job")));
        }
    });
}

#[test]
fn what_cannot_be_submitted_is_refused() {
    let run = Run::new();
    frames(&run, 2);
    let good = sequence("out/#.png", &[]);
    let refused = |engine: &str, more: &[&str], command: &[&str], says: &[&str]| {
        let submit = [&["submit", "--engine", engine, "-o", "job"], more, &["--"], command].concat();
        // No scheduler is to be found here.
        let output = run.prepared(&submit).env("PATH", run.path("f")).output().expect("it runs");
        assert!(!output.status.success(), "{submit:?}");
        assert!(says.iter().all(|s| text(&output).contains(s)), "{submit:?}: {}", text(&output));
    };
    refused("slurm", &[], &["info"], &["sequence, chart, stress", "info"]);
    refused("slurm", &[], &["stress", "-o", "s", "--part", "0/2"], &["--part", "leave it out"]);
    refused("slurm", &[], &["sequence", "f/*.csv"], &["--output"]);
    refused("slurm", &[], &sequence("film.gif", &[]), &["numbered pictures"]);
    refused("slurm", &[], &sequence("out/#.png", &["--part", "0/2"]), &["--part", "leave it out"]);
    refused("slurm", &[], &["sequence", "g/*.csv", "-o", "out/#.png"], &["g/*.csv"]);
    refused("openjd", &[], &sequence("{{out}}/#.png", &[]), &["leave them out"]);
    for (engine, program) in [("slurm", "sbatch"), ("hyperqueue", "hq"), ("openjd", "openjd")] {
        refused(engine, &["--run"], &good, &[program, "install", "submit.sh"]);
        assert!(run.path("job/submit.sh").is_file());
    }
    assert!(!run.path("out/0.png").exists());
}
