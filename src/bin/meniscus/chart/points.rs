//! What a chart measures: each method as it is, and with one parameter varied at a time.

use crate::choices;
use meniscus::{
    Error, Settings,
    study::measures::{Means, surface::SurfaceError},
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::str::FromStr;

/// A parameter or a family (`layers`, `smooth`, `optics`), and the values that it takes one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Vary {
    pub name: String,
    pub values: Vec<String>,
}

/// The most values of one range.
const MOST: i64 = 100;

impl FromStr for Vary {
    type Err = String;

    fn from_str(text: &str) -> Result<Vary, String> {
        let wrong =
            || format!("\"{text}\" is not NAME=VALUE,... or NAME=FIRST..LAST, such as window=5,9 or iterations=0..5");
        let (name, values) = text.split_once('=').ok_or_else(wrong)?;
        let values: Vec<String> = match values.split_once("..") {
            Some((first, last)) => {
                let [first, last] = [first, last].map(|v| v.trim().parse::<i64>());
                let (first, last) = first.ok().zip(last.ok()).ok_or_else(wrong)?;
                if last < first || last.abs_diff(first) >= MOST as u64 {
                    return Err(format!("\"{text}\": use up to {MOST} values, the first one the smallest"));
                }
                (first..=last).map(|v| v.to_string()).collect()
            }
            None => values.split(',').map(|v| v.trim().to_owned()).collect(),
        };
        if name.trim().is_empty() || values.iter().any(String::is_empty) {
            return Err(wrong());
        }
        Ok(Vary { name: name.trim().replace('-', "_"), values })
    }
}

/// One way to draw a scene.
#[derive(Clone, Debug)]
pub struct Way {
    pub method: String,
    /// What is not as the method has it.
    pub varied: Option<(String, String)>,
    pub settings: Settings,
}

impl Way {
    pub fn name(&self) -> String {
        name(&self.method, self.varied.as_ref())
    }
}

fn name(method: &str, varied: Option<&(String, String)>) -> String {
    varied.map_or_else(|| method.to_owned(), |(name, value)| format!("{method} {name}={value}"))
}

/// Every way: methods as they are, then each with one value after the other of each variation that it has. A value that is the
/// method's own anyway is not drawn twice.
pub fn ways(methods: &[(String, Settings)], vary: &[Vary]) -> Result<Vec<Way>, Error> {
    let mut ways: Vec<Way> = Vec::new();
    for (method, settings) in methods {
        ways.push(Way { method: method.clone(), varied: None, settings: *settings });
    }
    for v in vary {
        let family = settings_has_family(&v.name);
        let has = |s: &Settings| family || s.parameters().iter().any(|p| p.name == v.name);
        if !methods.iter().any(|(_, s)| has(s)) {
            let known: Vec<_> = methods.iter().flat_map(|(_, s)| s.parameters()).map(|p| p.name).collect();
            return Err(Error::Parameter {
                parameter: "vary",
                value: v.name.clone(),
                remedy: format!("none of the methods has it; they have layers, smooth, optics, {}", known.join(", ")),
            });
        }
        for (method, settings) in methods.iter().filter(|(_, s)| has(s)) {
            for value in &v.values {
                let mut changed = *settings;
                if family {
                    changed.method.choose(&v.name, value)?;
                } else {
                    changed.set(&v.name, value)?;
                }
                // Members of a family that do not go with the method's others are no way to draw.
                match changed.validate() {
                    Err(_) if family => continue,
                    checked => checked?,
                }
                let varied = Some((v.name.clone(), value.clone()));
                if !ways.iter().any(|w| w.method == *method && w.settings == changed) {
                    ways.push(Way { method: method.clone(), varied, settings: changed });
                }
            }
        }
    }
    Ok(ways)
}

fn settings_has_family(name: &str) -> bool {
    Settings::default().method.members().iter().any(|(family, _)| *family == name)
}

/// Milliseconds of a few frames in a row.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Visit {
    /// Sum of the passes, frame by frame.
    pub sum: Vec<f64>,
    /// Each pass's, frame by frame.
    pub passes: Vec<(String, Vec<f64>)>,
}

/// What is known of one way to draw a scene: kept from run to run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Point {
    pub scene: String,
    pub method: String,
    pub varied: Option<(String, String)>,
    pub settings: Map<String, Value>,
    /// Bytes of device memory.
    pub memory: u64,
    pub picture: Means,
    pub liquid: Means,
    /// Of the method's own surface, where it has one at pixels' centres.
    pub surface: Option<SurfaceError>,
    pub visits: Vec<Visit>,
}

impl Point {
    pub fn name(&self) -> String {
        name(&self.method, self.varied.as_ref())
    }

    /// Of the surface: silhouette's IoU, depth and its absolute value in radii, normals in degrees.
    pub fn surface_figures(&self) -> [Option<f64>; 4] {
        let s = self.surface;
        [s.map(|s| s.iou), s.and_then(|s| s.depth), s.and_then(|s| s.depth_absolute), s.and_then(|s| s.normal)]
    }

    /// Milliseconds of all frames that were measured.
    pub fn times(&self) -> Vec<f64> {
        self.visits.iter().flat_map(|v| v.sum.iter().copied()).collect()
    }

    /// Each pass's milliseconds of all frames, in the frame's order.
    pub fn passes(&self) -> Vec<(String, Vec<f64>)> {
        let mut all: Vec<(String, Vec<f64>)> = Vec::new();
        for (name, times) in self.visits.iter().flat_map(|v| &v.passes) {
            match all.iter_mut().find(|(n, _)| n == name) {
                Some((_, sum)) => sum.extend(times),
                None => all.push((name.clone(), times.clone())),
            }
        }
        all
    }
}

/// A point's name in files: by all that decides what is measured.
pub fn key(parts: &[&str], settings: &Settings) -> String {
    let mut key = blake3::Hasher::new();
    let record = Value::Object(choices::record(settings)).to_string();
    for part in parts.iter().copied().chain([record.as_str()]) {
        key.update(&(part.len() as u64).to_le_bytes());
        key.update(part.as_bytes());
    }
    key.finalize().to_hex()[..24].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variations_are_read() {
        let values = |text: &str| text.parse::<Vary>().map(|v| v.values.join(" "));
        assert_eq!(values("window=5,9, 13"), Ok("5 9 13".into()));
        assert_eq!(values("iterations=0..3"), Ok("0 1 2 3".into()));
        assert_eq!("time-step=0.1".parse::<Vary>().expect("one").name, "time_step");
        for wrong in ["window", "=5", "window=", "window=5,,9", "a=3..1", "a=0..1000", "a=x..y"] {
            assert!(wrong.parse::<Vary>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn ways_vary_one_thing_at_a_time() {
        let preset = |name: &str| (name.to_owned(), choices::preset(name).expect("a preset").method().into());
        let methods = [preset("imai16"), preset("green10")];
        let vary = |text: &str| text.parse::<Vary>().expect("a variation");
        let ways = ways(&methods, &[vary("window=9,11"), vary("optics=one,four")]).expect("ways");
        let names: Vec<_> = ways.iter().map(|w| name(&w.method, w.varied.as_ref())).collect();
        // Nine is imai16's own window, and `four` its own optics; green10's layers have no far side for `four`.
        assert!(names.starts_with(&["imai16".into(), "green10".into()]), "{names:?}");
        assert!(names.contains(&"imai16 window=11".into()) && !names.contains(&"imai16 window=9".into()), "{names:?}");
        assert!(
            names.contains(&"imai16 optics=one".into()) && !names.contains(&"imai16 optics=four".into()),
            "{names:?}"
        );
        let unknown = super::ways(&methods, &[vary("colour=1")]).expect_err("unknown").to_string();
        assert!(unknown.contains("colour") && unknown.contains("window"), "{unknown}");
    }
}
