//! Open Job Description: a template with one step whose tasks are the parts, and one that depends on it.

use super::{Engined, Job, SubmitError};
use serde_json::{Value, json};

/// The program and the folder are parameters, since nodes may have them elsewhere.
const PROGRAM: &str = "{{Param.Program}}";
const FOLDER: &str = "{{Param.Folder}}";

pub fn files(job: &Job) -> Result<Engined, SubmitError> {
    if let Some(word) = job.command.iter().find(|w| w.contains("{{") || w.contains("}}")) {
        return Err(SubmitError::Braces(word.clone()));
    }
    // An action begins in a folder of its session.
    let script = |command: Vec<String>| -> Value {
        let mut arguments: Vec<String> =
            ["-c", "cd -- \"$0\" && exec \"$@\"", FOLDER, PROGRAM].map(str::to_owned).to_vec();
        arguments.extend(command.into_iter().skip(1));
        json!({"actions": {"onRun": {"command": "sh", "args": arguments}}})
    };
    // Without defaults: those of paths must be relative, and are taken from the template's folder.
    let parameter = |name: &str, object: &str, about: &str| {
        let (kind, flow) = ("PATH", "NONE");
        json!({"name": name, "type": kind, "objectType": object, "dataFlow": flow, "description": about})
    };
    let values = json!({"Program": job.program, "Folder": job.folder});
    let template = json!({
        "specificationVersion": "jobtemplate-2023-09",
        "name": "meniscus",
        "parameterDefinitions": [
            parameter("Program", "FILE", "meniscus"),
            parameter("Folder", "DIRECTORY", "What the command's files are named from"),
        ],
        "steps": [
            {
                "name": "Parts",
                "parameterSpace": {
                    "taskParameterDefinitions": [{"name": "Part", "type": "INT", "range": format!("0-{}", job.tasks - 1)}],
                },
                "script": script(job.part("{{Task.Param.Part}}")),
            },
            {"name": "Join", "dependencies": [{"dependsOn": "Parts"}], "script": script(job.join())},
        ],
    });
    Ok(Engined {
        files: vec![("template.json", format!("{template:#}\n")), ("parameters.json", format!("{values:#}\n"))],
        submit:
            "exec openjd run template.json --job-param file://parameters.json --step Join --run-dependencies \"$@\""
                .to_owned(),
        by: "openjd",
        package: "openjd-cli (PyPI)",
    })
}
