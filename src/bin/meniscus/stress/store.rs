//! Where the runs of cases are kept, so that several programs may each do some, and one that was ended goes on.

use crate::{
    choices,
    outputs::{self, OutputError},
};
use meniscus::{
    Settings,
    study::stress::{Case, Step},
};
use serde_json::{Value, json};
use std::{
    fs,
    path::{Path, PathBuf},
};

pub struct Store {
    place: PathBuf,
    /// All that decides figures beside case and method: the program itself, and the device.
    hash: blake3::Hasher,
}

impl Store {
    pub fn open(output: &Path, device: &str, small: bool) -> Result<Store, OutputError> {
        let place = output.join("units");
        outputs::folder(&place)?;
        let mut hash = blake3::Hasher::new();
        // Built again it may find something else, and there is nothing smaller that would say so.
        match std::env::current_exe().and_then(fs::read) {
            Ok(program) => hash.update(&program),
            Err(_) => hash.update(crate::report::COMMIT.as_bytes()),
        };
        hash.update(format!("\0{device}\0{small}\0").as_bytes());
        Ok(Store { place, hash })
    }

    fn file(&self, case: &Case, method: &str, settings: &Settings) -> PathBuf {
        let mut hash = self.hash.clone();
        let settings = Value::Object(choices::record(settings));
        hash.update(format!("{}\0{method}\0{settings}", case.name).as_bytes());
        self.place.join(format!("{}.json", &hash.finalize().to_hex()[..32]))
    }

    /// What a run found, if it is there and whole.
    pub fn steps(&self, case: &Case, method: &str, settings: &Settings) -> Option<Vec<Step>> {
        let record: Value = serde_json::from_slice(&fs::read(self.file(case, method, settings)).ok()?).ok()?;
        let number = |v: &Value| v.as_str()?.parse::<f64>().ok();
        let found = |v: &Value| if v.is_null() { Some(None) } else { number(v).map(Some) };
        let step = |v: &Value| {
            let found: Vec<_> = v.get("found")?.as_array()?.iter().map(found).collect::<Option<_>>()?;
            (found.len() == case.measures.len()).then_some(Step { x: number(v.get("x")?)?, found })
        };
        record.get("steps")?.as_array()?.iter().map(step).collect()
    }

    pub fn keep(&self, case: &Case, method: &str, settings: &Settings, steps: &[Step]) -> Result<(), OutputError> {
        // As text: JSON has no infinity, and every digit counts.
        let number = |v: f64| json!(v.to_string());
        let step = |s: &Step| json!({"x": number(s.x), "found": s.found.iter().map(|f| f.map_or(Value::Null, number)).collect::<Vec<_>>()});
        let steps: Vec<_> = steps.iter().map(step).collect();
        let record = json!({"case": case.name, "method": method, "steps": steps});
        outputs::write(&self.file(case, method, settings), format!("{record:#}\n").as_bytes())
    }
}
