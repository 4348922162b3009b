//! HyperQueue: a job file with a task for each part, and one that needs them all. A task whose worker is lost starts again on
//! another and goes on where it was.

use super::{Engined, Job};
use serde::Serialize;

#[derive(Serialize)]
struct File<'a> {
    name: &'a str,
    task: Vec<Task<'a>>,
}

#[derive(Serialize)]
struct Task<'a> {
    id: u32,
    name: String,
    command: Vec<String>,
    cwd: &'a str,
    stdout: String,
    stderr: String,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    deps: Vec<u32>,
    request: [Request; 1],
}

/// A driver on the CPU uses all cores of its worker.
#[derive(Serialize)]
struct Request {
    resources: Resources,
}

#[derive(Serialize)]
struct Resources {
    cpus: &'static str,
}

pub fn files(job: &Job) -> Engined {
    let task = |id: u32, name: String, command: Vec<String>, deps: Vec<u32>| {
        let log = format!("{}/{name}.log", job.place);
        let request = [Request { resources: Resources { cpus: "all" } }];
        Task { id, name, command, cwd: &job.folder, stdout: log.clone(), stderr: log, deps, request }
    };
    let parts = (0..job.tasks).map(|k| task(k, format!("part-{k}"), job.part(&k.to_string()), Vec::new()));
    let join = task(job.tasks, "join".to_owned(), job.join(), (0..job.tasks).collect());
    let file = File { name: "meniscus", task: parts.chain([join]).collect() };
    Engined {
        files: vec![("job.toml", toml::to_string(&file).expect("text, numbers and lists"))],
        submit: "exec hq job submit-file \"$@\" job.toml".to_owned(),
        by: "hq",
        package: "HyperQueue",
    }
}
