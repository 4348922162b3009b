//! Keys of a scene file: what changes over the time of a film. A key says at what second which entries have which values; between
//! keys numbers change gradually, everything else at once.

use serde::Deserialize;
use toml::{Table, Value};

/// What a key may say; the rest is the same in all of a film.
const KEYED: [&str; 4] = ["camera", "environment.rotation", "preparation", "settings"];

/// How an entry comes from the key before to this one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Ease {
    /// In equal steps.
    #[default]
    Linear,
    /// As fast on both sides of a key, slow at the ends, and never past a key's value.
    Smooth,
    /// All at once.
    Hold,
}

#[derive(Deserialize)]
struct Key {
    time: f64,
    #[serde(default)]
    ease: Ease,
    #[serde(flatten)]
    says: Table,
}

/// One entry over time.
#[derive(Debug, PartialEq)]
struct Track {
    path: Vec<String>,
    points: Vec<Point>,
}

#[derive(Clone, Debug, PartialEq)]
struct Point {
    time: f64,
    ease: Ease,
    value: Value,
}

/// All entries that keys have.
#[derive(Debug, Default, PartialEq)]
pub struct Keys {
    /// Names of members before what belongs to them.
    tracks: Vec<Track>,
    /// Times of keys, ascending.
    pub times: Vec<f64>,
}

/// An entry that cannot be, and why.
#[derive(Debug, PartialEq)]
pub struct Wrong {
    pub key: String,
    pub message: String,
}

impl Keys {
    /// Takes them out of a scene file's table.
    pub fn take(table: &mut Table) -> Result<Keys, Wrong> {
        let Some(keys) = table.remove("keys") else { return Ok(Keys::default()) };
        let wrong = |key: String, message: &str| Wrong { key, message: message.into() };
        let Value::Array(entries) = keys else {
            return Err(wrong("keys".into(), "write each key under [[keys]]"));
        };
        let mut all = Keys::default();
        for (i, entry) in entries.into_iter().enumerate() {
            let name = format!("keys[{i}]");
            let key = Key::deserialize(entry).map_err(|e| wrong(name.clone(), e.message()))?;
            if !(key.time.is_finite() && key.time >= 0.0 && all.times.last().is_none_or(|t| *t < key.time)) {
                return Err(wrong(
                    format!("{name}.time"),
                    "use seconds, 0 or more, each key later than the one before",
                ));
            }
            all.times.push(key.time);
            let mut leaves = Vec::new();
            collect(&key.says, &mut Vec::new(), &mut leaves);
            for (path, value) in leaves {
                let dotted = path.join(".");
                if !KEYED.iter().any(|k| dotted == *k || dotted.starts_with(&format!("{k}."))) {
                    let message = format!("is the same in all of a film; only {} have keys", KEYED.join(", "));
                    return Err(wrong(format!("{name}.{dotted}"), &message));
                }
                let point = Point { time: key.time, ease: key.ease, value };
                match all.tracks.iter_mut().find(|t| t.path == path) {
                    Some(track) => track.points.push(point),
                    None => all.tracks.push(Track { path, points: vec![point] }),
                }
            }
        }
        all.tracks.sort_by_key(|t| t.path.last().is_none_or(|n| n != "name"));
        Ok(all)
    }

    /// The scene file's table at a time. `fits` tells whether a table can be read: where no fraction fits, whole numbers change
    /// at once.
    pub fn at(&self, base: &Table, time: f64, fits: impl Fn(&Table) -> bool) -> Table {
        let mut table = base.clone();
        for track in &self.tracks {
            let (leaf, parents) = track.path.split_last().expect("an entry has a name");
            let (from, to) = if leaf == "name" { (f64::MIN, f64::MAX) } else { self.member_between(parents, time) };
            let points: Vec<_> = track.points.iter().filter(|p| (from..to).contains(&p.time)).collect();
            // What stands outside of keys, or the default, holds until the first of them.
            let Some(held) = points.iter().rev().find(|p| p.time <= time).map(|p| &p.value) else { continue };
            let parent = inner(&mut table, parents);
            if leaf == "name" && parent.get(leaf).is_some_and(|old| old != held) {
                parent.clear(); // parameters of another member
            }
            parent.insert(leaf.clone(), held.clone());
            if let Some(value) = between(&points, time) {
                let mut tried = table.clone();
                inner(&mut tried, parents).insert(leaf.clone(), value);
                if fits(&tried) {
                    table = tried;
                }
            }
        }
        table
    }

    /// From when until when a family has the member that it has at this time.
    fn member_between(&self, family: &[String], time: f64) -> (f64, f64) {
        let named = self.tracks.iter().find(|t| t.path.split_last().is_some_and(|(n, p)| n == "name" && p == family));
        let (mut from, mut to) = (f64::MIN, f64::MAX);
        let points = named.map_or(&[][..], |t| &t.points);
        for (i, point) in points.iter().enumerate() {
            if i > 0 && points[i - 1].value == point.value {
                continue;
            }
            if point.time <= time {
                from = point.time;
            } else {
                to = to.min(point.time);
            }
        }
        (from, to)
    }
}

/// Every entry with the names of the tables that it is in.
fn collect(table: &Table, above: &mut Vec<String>, leaves: &mut Vec<(Vec<String>, Value)>) {
    for (key, value) in table {
        above.push(key.clone());
        match value {
            Value::Table(inner) => collect(inner, above, leaves),
            leaf => leaves.push((above.clone(), leaf.clone())),
        }
        above.pop();
    }
}

/// A table within a table, made where it is not there.
fn inner<'a>(table: &'a mut Table, path: &[String]) -> &'a mut Table {
    let Some((first, rest)) = path.split_first() else { return table };
    let slot = table.entry(first.clone()).or_insert_with(|| Value::Table(Table::new()));
    if !slot.is_table() {
        *slot = Value::Table(Table::new());
    }
    inner(slot.as_table_mut().expect("it was made one"), rest)
}

/// The value between two points, if it is numbers that change.
fn between(points: &[&Point], time: f64) -> Option<Value> {
    let next = points.iter().position(|p| p.time > time).filter(|i| *i > 0)?;
    let (a, b) = (points[next - 1], points[next]);
    if a.value == b.value || b.ease == Ease::Hold {
        return None;
    }
    let width = b.time - a.time;
    let s = (time - a.time) / width;
    let (before, after) = (next.checked_sub(2).map(|i| points[i]), points.get(next + 1));
    let one = |number: &dyn Fn(&Value) -> Option<f64>| {
        let (va, vb) = (number(&a.value)?, number(&b.value)?);
        if b.ease == Ease::Linear {
            return Some(va + s * (vb - va));
        }
        // Hermite's cubic; at a key the harmonic mean of the slopes on both sides, which never leads past it (Fritsch–Butland).
        let slope = |p: &Point, q: &Point| Some((number(&q.value)? - number(&p.value)?) / (q.time - p.time));
        let mean = |u: f64, v: f64| if u * v > 0.0 { 2.0 * u * v / (u + v) } else { 0.0 };
        let own = (vb - va) / width;
        let ta = before.filter(|_| a.ease == Ease::Smooth).and_then(|p| slope(p, a)).map_or(0.0, |u| mean(u, own));
        let tb = after.filter(|q| q.ease == Ease::Smooth).and_then(|q| slope(b, q)).map_or(0.0, |v| mean(own, v));
        let [a, b, da, db] = hermite(s);
        Some(a * va + b * vb + width * (da * ta + db * tb))
    };
    match (&a.value, &b.value) {
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => {
            let each = (0..x.len()).map(|i| Some(Value::Float(one(&|v| number(v.as_array()?.get(i)?))?)));
            each.collect::<Option<Vec<_>>>().map(Value::Array)
        }
        _ => one(&number).map(Value::Float),
    }
}

/// Hermite's cubic at 0 to 1 of its way: what its two ends weigh, and the slopes there times its width.
pub fn hermite(s: f64) -> [f64; 4] {
    let (s2, s3) = (s * s, s * s * s);
    [2.0 * s3 - 3.0 * s2 + 1.0, 3.0 * s2 - 2.0 * s3, s3 - 2.0 * s2 + s, s3 - s2]
}

fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|i| i as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<(Keys, Table), Wrong> {
        let mut table: Table = text.parse().expect("TOML");
        Keys::take(&mut table).map(|keys| (keys, table))
    }

    /// The value of an entry at several times.
    fn values(text: &str, path: &str, times: &[f64]) -> Vec<f64> {
        let (keys, base) = read(text).expect("keys");
        let at = |t: &f64| {
            let table = Value::Table(keys.at(&base, *t, |_| true));
            path.split('.').try_fold(&table, |v, k| v.get(k)).and_then(number).unwrap_or(f64::NAN)
        };
        times.iter().map(at).collect()
    }

    #[test]
    fn numbers_change_between_keys() {
        let keys = |ease: &str| {
            format!(
                "[camera]\nfov_y = 50\n[[keys]]\ntime = 1\ncamera.fov_y = 10\n[[keys]]\ntime = 3\nease = \"{ease}\"\n\
                 camera.fov_y = 30\n[[keys]]\ntime = 5\nease = \"{ease}\"\ncamera.fov_y = 50"
            )
        };
        let times = [0.0, 1.0, 2.0, 3.0, 4.5, 5.0, 9.0];
        assert_eq!(values(&keys("linear"), "camera.fov_y", &times), [50.0, 10.0, 20.0, 30.0, 45.0, 50.0, 50.0]);
        assert_eq!(values(&keys("hold"), "camera.fov_y", &times), [50.0, 10.0, 10.0, 30.0, 30.0, 50.0, 50.0]);
        let smooth = values(&keys("smooth"), "camera.fov_y", &[1.1, 2.0, 2.9, 3.1, 4.0, 4.9]);
        // Slow at the ends, and through the key at full speed.
        assert!(smooth[0] - 10.0 < 0.3 && 50.0 - smooth[5] < 0.3, "{smooth:?}");
        assert!((smooth[3] - smooth[2] - 2.0).abs() < 0.1, "{smooth:?}");
        assert!(smooth.windows(2).all(|w| w[0] < w[1]), "{smooth:?}");
        let turn = "[[keys]]\ntime = 0\ncamera.a = 0\n[[keys]]\ntime = 1\nease = \"smooth\"\ncamera.a = 1\n[[keys]]\ntime = 2\n\
                    ease = \"smooth\"\ncamera.a = 0.9";
        let most = values(turn, "camera.a", &[0.8, 0.9, 0.99, 1.01, 1.1, 1.3]).into_iter().fold(0.0, f64::max);
        assert!(most <= 1.0, "past the key's value: {most}");
    }

    #[test]
    fn vectors_change_and_words_do_not() {
        let text = "[[keys]]\ntime = 0\n[keys.camera]\neye = [0, 1, 2]\nword = \"a\"\n[[keys]]\ntime = 2\n[keys.camera]\neye = [4, 1, 0]\nword = \"b\"";
        let (keys, base) = read(text).expect("keys");
        let at = |t: f64| keys.at(&base, t, |_| true)["camera"].as_table().expect("a table").clone();
        assert_eq!(at(0.5)["eye"].as_array().expect("an array")[0], Value::Float(1.0));
        assert_eq!((&at(1.9)["word"], &at(2.0)["word"]), (&Value::from("a"), &Value::from("b")));
        // Where no fraction can be, whole numbers wait for the next key.
        let text = "[[keys]]\ntime = 0\nsettings.n = 5\n[[keys]]\ntime = 2\nsettings.n = 9";
        let (keys, base) = read(text).expect("keys");
        let at = |t: f64| keys.at(&base, t, |t| t["settings"]["n"].is_integer())["settings"]["n"].clone();
        assert_eq!([at(1.0), at(2.0)], [Value::from(5), Value::from(9)]);
    }

    #[test]
    fn another_member_has_parameters_of_its_own() {
        let text = "[settings.s]\nname = \"a\"\np = 1\n[[keys]]\ntime = 1\nsettings.s.p = 3\n[[keys]]\ntime = 2\n[keys.settings.s]\n\
                    name = \"b\"\nq = 5\n[[keys]]\ntime = 4\nsettings.s.q = 7.0";
        let (keys, base) = read(text).expect("keys");
        let at = |t: f64| keys.at(&base, t, |_| true)["settings"]["s"].as_table().expect("a table").to_string();
        assert_eq!(at(0.5), "name = \"a\"\np = 1\n");
        assert_eq!(at(1.5), "name = \"a\"\np = 3\n");
        assert_eq!(at(3.0), "name = \"b\"\nq = 6.0\n");
    }

    #[test]
    fn bad_keys_are_named() {
        for (text, key) in [
            ("keys = 5", "keys"),
            ("[[keys]]\ncamera.fov_y = 5", "keys[0]"),
            ("[[keys]]\ntime = -1", "keys[0].time"),
            ("[[keys]]\ntime = nan", "keys[0].time"),
            ("[[keys]]\ntime = 1\n[[keys]]\ntime = 1", "keys[1].time"),
            ("[[keys]]\ntime = 1\nsize = [1, 2]", "keys[0].size"),
            ("[[keys]]\ntime = 1\nease = \"bounce\"", "keys[0]"),
        ] {
            assert_eq!(read(text).expect_err(text).key, key);
        }
    }
}
