//! What a chart measures: each method as it is, and with parameters varied, in all combinations or one at a time.

use crate::choices;
use meniscus::{
    Error, Settings,
    study::{
        measures::{Means, surface::SurfaceError},
        search::SearchError,
    },
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
    /// What is not as the method has it: names and values.
    pub varied: Varied,
    pub settings: Settings,
}

pub type Varied = Vec<(String, String)>;

impl Way {
    pub fn name(&self) -> String {
        name(&self.method, &self.varied)
    }
}

fn name(method: &str, varied: &[(String, String)]) -> String {
    varied.iter().fold(method.to_owned(), |all, (name, value)| format!("{all} {name}={value}"))
}

/// Every way: methods as they are, then each with values of the variations that it has, `combined` or one variation at a time. A value
/// that is the method's own anyway is not drawn twice.
pub fn ways(methods: &[(String, Settings)], vary: &[Vary], combined: bool) -> Result<Vec<Way>, Error> {
    let mut ways: Vec<Way> = Vec::new();
    for (method, settings) in methods {
        ways.push(Way { method: method.clone(), varied: Vec::new(), settings: *settings });
    }
    // Another member of a family has parameters of its own: families come first.
    let (families, parameters): (Vec<&Vary>, Vec<&Vary>) = vary.iter().partition(|v| settings_has_family(&v.name));
    let mut known = vec![false; vary.len()];
    for (method, settings) in methods {
        let mut made = vec![(Varied::new(), *settings)];
        for (v, known) in families.iter().chain(&parameters).zip(&mut known) {
            for (varied, settings) in made.clone() {
                if !has(&settings, &v.name) || !combined && !varied.is_empty() {
                    continue;
                }
                *known = true;
                for value in &v.values {
                    let Some(changed) = with(&settings, v, value, !varied.is_empty())? else { continue };
                    let varied = varied.iter().cloned().chain([(v.name.clone(), value.clone())]).collect();
                    made.push((varied, changed));
                }
            }
        }
        for (varied, settings) in made {
            if !ways.iter().any(|w| w.method == *method && w.settings == settings) {
                ways.push(Way { method: method.clone(), varied, settings });
            }
        }
    }
    if let Some((v, _)) = families.iter().chain(&parameters).zip(known).find(|(_, known)| !known) {
        let known: Vec<_> = methods.iter().flat_map(|(_, s)| s.parameters()).map(|p| p.name).collect();
        return Err(Error::Parameter {
            parameter: "vary",
            value: v.name.clone(),
            remedy: format!("none of the methods has it; they have layers, smooth, optics, {}", known.join(", ")),
        });
    }
    Ok(ways)
}

fn has(settings: &Settings, name: &str) -> bool {
    settings_has_family(name) || settings.parameters().iter().any(|p| p.name == name)
}

/// Settings with another value; `None` if it does not go with the others, which are `varied` themselves or of other families.
fn with(settings: &Settings, v: &Vary, value: &str, varied: bool) -> Result<Option<Settings>, Error> {
    let family = settings_has_family(&v.name);
    let mut changed = *settings;
    let set = if family { changed.method.choose(&v.name, value) } else { changed.set(&v.name, value) };
    match set.and_then(|()| changed.validate()) {
        Ok(()) => Ok(Some(changed)),
        Err(_) if varied => Ok(None),
        // Members of a family that do not go with the method's others are no way to draw.
        Err(_) if family && changed != *settings => Ok(None),
        Err(e) => Err(e),
    }
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
    pub varied: Varied,
    pub settings: Map<String, Value>,
    /// Bytes of device memory.
    pub memory: u64,
    pub picture: Means,
    pub liquid: Means,
    /// Of the method's own surface, where it has one at pixels' centres.
    pub surface: Option<SurfaceError>,
    /// Of its optics, traced exactly on the truth's surface; over the liquid.
    pub light_model: Option<Means>,
    /// Of its walk, beside an exact search in its own maps or field.
    pub search: Option<SearchError>,
    pub visits: Vec<Visit>,
}

impl Point {
    pub fn name(&self) -> String {
        name(&self.method, &self.varied)
    }

    /// Of the surface: silhouette's IoU, depth and its absolute value in radii, normals in degrees.
    pub fn surface_figures(&self) -> [Option<f64>; 4] {
        let s = self.surface;
        [s.map(|s| s.iou), s.and_then(|s| s.depth), s.and_then(|s| s.depth_absolute), s.and_then(|s| s.normal)]
    }

    /// Of the optics alone: FLIP and relative squared error.
    pub fn light_figures(&self) -> [Option<f64>; 2] {
        [self.light_model.map(|m| m.flip), self.light_model.map(|m| m.relative_mse)]
    }

    /// Of the search: pixels that miss, in percent, and the angle in degrees.
    pub fn search_figures(&self) -> [Option<f64>; 2] {
        [self.search.map(|s| 100.0 * s.missed), self.search.map(|s| s.angle)]
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

    fn preset(name: &str) -> (String, Settings) {
        (name.to_owned(), choices::preset(name).expect("a preset").method().into())
    }

    fn names(methods: &[(String, Settings)], vary: &[&str], combined: bool) -> Result<Vec<String>, Error> {
        let vary: Vec<Vary> = vary.iter().map(|text| text.parse().expect("a variation")).collect();
        Ok(ways(methods, &vary, combined)?.iter().map(Way::name).collect())
    }

    #[test]
    fn ways_vary_one_thing_at_a_time() {
        let methods = [preset("imai16"), preset("green10")];
        let names = |vary: &[&str]| names(&methods, vary, false);
        let found = names(&["window=9,11", "optics=one,four"]).expect("ways");
        // Nine is imai16's own window, and `four` its own optics; green10's layers have no far side for `four`.
        assert!(found.starts_with(&["imai16".into(), "green10".into()]), "{found:?}");
        let has = |name: &str| found.iter().any(|n| n == name);
        assert!(has("imai16 window=11") && !has("imai16 window=9"), "{found:?}");
        assert!(has("imai16 optics=one") && !has("imai16 optics=four"), "{found:?}");
        assert!(!has("imai16 optics=one window=11"), "{found:?}");
        let unknown = names(&["colour=1"]).expect_err("unknown").to_string();
        assert!(unknown.contains("colour") && unknown.contains("window"), "{unknown}");
        assert!(names(&["smooth=polish"]).expect_err("unknown").to_string().contains("plane-fit"));
        assert!(names(&["window=8"]).expect_err("even").to_string().contains("window"));
    }

    #[test]
    fn ways_combine_all_that_varies() {
        let mut found = names(&[preset("imai16")], &["window=5,9,11", "iterations=1,3"], true).expect("ways");
        found.sort();
        // Its own are 9 and 2.
        let own = preset("imai16").1;
        let value =
            |name: &str| own.parameters().into_iter().find(|p| p.name == name).expect("a parameter").value.to_string();
        assert_eq!([value("window"), value("iterations")], ["9", "2"]);
        let wanted = [
            "imai16",
            "imai16 iterations=1",
            "imai16 iterations=3",
            "imai16 window=11",
            "imai16 window=11 iterations=1",
            "imai16 window=11 iterations=3",
            "imai16 window=5",
            "imai16 window=5 iterations=1",
            "imai16 window=5 iterations=3",
        ];
        assert_eq!(found, wanted);
        // A parameter that only another member has, and one that the other member takes no such value of.
        let found = names(&[preset("imai16")], &["time_step=0.01", "smooth=curvature-flow,none"], true).expect("ways");
        assert!(found.contains(&"imai16 smooth=curvature-flow time_step=0.01".to_owned()), "{found:?}");
        assert_eq!(found.len(), 4, "{found:?}");
    }
}
