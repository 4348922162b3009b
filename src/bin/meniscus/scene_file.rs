//! Scene files: a [`Picture`] as TOML, read for `--scene` and written for `--save-scene`.

use crate::{keys::Keys, picture::Picture};
use meniscus::{Error, io::quote::quote};
use serde::Deserialize;
use std::{
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};
use toml::{Table, Value};

/// Why a scene file cannot be read, or a picture not be written as one.
#[derive(Debug, thiserror::Error)]
pub enum SceneFileError {
    #[error("{}: cannot be read: {source}. Name a scene file, such as --save-scene writes", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("{}: is larger than {LONGEST} bytes, so it is no scene file; name one such as --save-scene writes", .0.display())]
    TooLarge(PathBuf),
    #[error("{}: is no text, so it is no scene file; name one such as --save-scene writes", .0.display())]
    NoText(PathBuf),
    #[error("{}: line {line}: {message}; --save-scene shows how scene files are written", path.display())]
    Syntax { path: PathBuf, line: usize, message: String },
    #[error("{}: {key}: {message}", path.display())]
    Key { path: PathBuf, key: String, message: String },
    #[error("{}: {source}", path.display())]
    Value { path: PathBuf, source: Error },
    #[error("{}: no scene file can hold this: {message}. Give files names in UTF-8", path.display())]
    Write { path: PathBuf, message: String },
}

/// Scene files have some forty lines.
const LONGEST: u64 = 1 << 20;

/// What was read of one: a picture for each second of a film, which without keys are all the same.
pub struct SceneFile {
    path: PathBuf,
    table: Table,
    keys: Keys,
}

/// The picture of one at the start.
#[cfg(any(feature = "study", test))]
pub fn read(path: &Path) -> Result<Picture, SceneFileError> {
    SceneFile::read(path)?.at(0.0)
}

impl SceneFile {
    /// Reads one, and checks all keys and what is between them.
    pub fn read(path: &Path) -> Result<SceneFile, SceneFileError> {
        let failed = |source| SceneFileError::Read { path: path.into(), source };
        let mut bytes = Vec::new();
        File::open(path).and_then(|f| f.take(LONGEST + 1).read_to_end(&mut bytes)).map_err(failed)?;
        if bytes.len() as u64 > LONGEST {
            return Err(SceneFileError::TooLarge(path.into()));
        }
        let text = String::from_utf8(bytes).map_err(|_| SceneFileError::NoText(path.into()))?;
        let mut table: Table = text.parse().map_err(|e: toml::de::Error| {
            let before = e.span().and_then(|s| text.get(..s.start)).unwrap_or("");
            SceneFileError::Syntax {
                path: path.into(),
                line: before.matches('\n').count() + 1,
                message: quote(e.message()),
            }
        })?;
        camera_table(&mut table);
        let keys = Keys::take(&mut table).map_err(|w| SceneFileError::Key {
            path: path.into(),
            key: quote(&w.key),
            message: w.message.replace('\n', " "),
        })?;
        let file = SceneFile { path: path.into(), table, keys };
        let times = &file.keys.times;
        let halfway = times.windows(2).map(|w| 0.5 * (w[0] + w[1]));
        for time in times.iter().copied().chain(halfway) {
            file.at(time).map_err(|e| match e {
                SceneFileError::Key { path, key, message } => {
                    SceneFileError::Key { path, key, message: format!("at {time} seconds: {message}") }
                }
                other => other,
            })?;
        }
        Ok(file)
    }

    /// The picture at a second of the film. What the file does not say is as by default, of the method as in the first that has
    /// what it says; its paths are relative to itself.
    pub fn at(&self, time: f64) -> Result<Picture, SceneFileError> {
        let path = &self.path;
        let mut table = self.keys.at(&self.table, time, |table| Picture::deserialize(table.clone()).is_ok());
        camera_table(&mut table);
        if let Some(key) = said_twice(&table) {
            let message = "the camera file says that: leave one of them out".into();
            return Err(SceneFileError::Key { path: path.clone(), key: format!("camera.{key}"), message });
        }
        let given = |key: &str| table.get("settings")?.get("liquid")?.get(key).map(|_| true);
        let absorption_given = given(crate::choices::LEFT_OPEN).unwrap_or(false);
        let mut picture = Picture::deserialize(table.clone()).map_err(|e| {
            let (key, message) = blame(&table).unwrap_or_else(|| ("scene file".into(), e.message().to_owned()));
            SceneFileError::Key { path: path.into(), key: quote(&key), message: message.replace('\n', " ") }
        })?;
        picture.absorption_given = absorption_given;
        picture.size_given = table.contains_key("size");
        let method = &mut picture.settings.method;
        let named = |family: &str| table.get("settings")?.get("method")?.get(family).map(|_| true);
        *method = crate::choices::completed(method, |family| named(family).unwrap_or(false));
        picture.validate().map_err(|source| SceneFileError::Value { path: path.into(), source })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let files = [&mut picture.particles, &mut picture.environment.file, &mut picture.camera.file];
        for file in files.into_iter().flatten() {
            *file = folder.join(&*file);
        }
        Ok(picture)
    }
}

/// `camera = "camera.json"` is short for a table with a file.
fn camera_table(table: &mut Table) {
    if let Some(camera) = table.get_mut("camera").filter(|c| c.is_str()) {
        *camera = Value::Table(Table::from_iter([("file".to_owned(), camera.clone())]));
    }
}

/// What stands beside a camera file that decides it.
fn said_twice(table: &Table) -> Option<&str> {
    let camera = table.get("camera")?.as_table().filter(|c| c.contains_key("file"))?;
    camera.keys().map(String::as_str).find(|key| !["file", "up"].contains(key))
}

/// The first entry that cannot be read when it stands alone, and why: what reads the whole does not say where it is.
fn blame(table: &Table) -> Option<(String, String)> {
    let mut leaves = Vec::new();
    collect(table, &mut Vec::new(), &mut leaves);
    leaves
        .into_iter()
        .find_map(|(keys, alone)| Some((keys.join("."), Picture::deserialize(alone).err()?.message().to_owned())))
}

/// Every entry, with the names of the tables it is in; and a table in which it stands alone but for the name of what it
/// belongs to.
fn collect<'a>(table: &'a Table, above: &mut Vec<&'a str>, leaves: &mut Vec<(Vec<String>, Table)>) {
    let name = table.get_key_value("name").filter(|_| !above.is_empty());
    // A wrong name is to blame for what follows it.
    for (key, value) in name.into_iter().chain(table.iter().filter(|(key, _)| name.is_none_or(|n| n.0 != *key))) {
        match value {
            Value::Table(inner) if !inner.is_empty() => {
                above.push(key);
                collect(inner, above, leaves);
                above.pop();
            }
            leaf => {
                let own = name.into_iter().chain([(key, leaf)]).map(|(k, v)| (k.clone(), v.clone()));
                let around = |inner, key: &&str| Table::from_iter([((*key).to_owned(), Value::Table(inner))]);
                let alone = above.iter().rev().fold(own.collect(), around);
                leaves.push((above.iter().copied().chain([key.as_str()]).map(str::to_owned).collect(), alone));
            }
        }
    }
}

/// A picture as the text of a scene file at this place.
pub fn text(picture: &Picture, path: &Path) -> Result<String, SceneFileError> {
    let mut picture = picture.clone();
    let folder = path.parent().unwrap_or(Path::new(""));
    for file in [&mut picture.particles, &mut picture.environment.file].into_iter().flatten() {
        *file = seen_from(folder, file);
    }
    let body = toml::to_string(&picture)
        .map_err(|e| SceneFileError::Write { path: path.into(), message: e.to_string().replace('\n', " ") })?;
    Ok(format!("# A scene of meniscus {}: meniscus render --scene FILE\n\n{body}", env!("CARGO_PKG_VERSION")))
}

/// A file's path from a folder that it is in, so that both can be moved together; else from the root.
fn seen_from(folder: &Path, file: &Path) -> PathBuf {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let here = if folder == Path::new("") { Path::new(".") } else { folder };
    let file = absolute(file);
    file.strip_prefix(absolute(here)).map_or(file.clone(), Path::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str) -> String {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), text).expect("written");
        read(file.path()).map_or_else(|e| e.to_string(), |_| String::new())
    }

    #[test]
    fn what_is_written_is_read() {
        let mut picture = Picture { absorption_given: true, size_given: true, ..Picture::default() };
        picture.settings.method = meniscus::Method::preset("imai16").expect("a preset");
        picture.settings.set("sigma", "0.1").expect("set");
        picture.settings.method.choose("optics", "two").expect("a member");
        picture.max_memory = "123456789".parse().expect("an amount");
        picture.camera.eye = Some(glam::DVec3::new(0.1, -1e30, 1.0 / 3.0));
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.toml");
        picture.particles = Some(folder.path().join("sub/p.vtk"));
        let text = text(&picture, &path).expect("text");
        assert!(text.contains("particles = \"sub/p.vtk\""), "{text}");
        std::fs::write(&path, text).expect("written");
        assert_eq!(read(&path).expect("read"), picture);
    }

    #[test]
    fn bad_entries_are_named() {
        assert_eq!(said(""), "");
        for (text, words) in [
            ("sise = [1, 2]", &["sise", "unknown field"][..]),
            ("size = 5", &["size", "invalid type"]),
            ("size = [0, 5]", &["size", "1 or more"]),
            ("size = [-1, 5]", &["size"]),
            ("radius = nan", &["radius", "NaN"]),
            ("camera = 5", &["camera"]),
            ("[camera]\nup = [0, 0, 0]", &["up"]),
            ("[camera]\nup = [1e300, 1e300, 0]", &["up"]),
            ("[camera]\neye = [1, 2]", &["camera.eye"]),
            ("[camera]\neye = [inf, 2, 1]", &["eye"]),
            ("[camera]\nfov_y = 180", &["fov"]),
            ("[environment]\nrotation = inf", &["environment.rotation"]),
            ("supersample = 4", &["supersample", "1 to 3"]),
            ("max_memory = \"lots\"", &["max_memory", "512M"]),
            ("[preparation]\nsearch = 1", &["preparation.search"]),
            ("[preparation]\nsplash_threshold = nan", &["splash_threshold", "a number"]),
            ("prepare = \"tpu\"", &["prepare", "gpu-relation"]),
            ("[settings.liquid]\nior = 0.5", &["ior", "above 1"]),
            ("[settings.liquid]\ncolour = 0.5", &["settings.liquid.colour", "ior"]),
            ("[settings.method.smooth]\nname = \"plane-fit\"\nwindow = 8", &["window is 8", "odd"]),
            ("[settings.method.smooth]\nname = \"plane-fit\"\nwindow = \"9\"", &["settings.method.smooth.window"]),
            (
                "[settings.method.smooth]\nname = \"none\"\nwindow = 9",
                &["settings.method.smooth.window", "unknown field"],
            ),
            ("[settings.method.smooth]\nname = \"blur\"", &["settings.method.smooth.name", "plane-fit"]),
            ("[settings.method.smooth]\nwindow = 9", &["settings.method.smooth.window", "name"]),
            ("a = 1\nb = [", &["line 2"]),
            ("\u{0}", &["line 1"]),
            ("a = 1\na = 2", &["line 2"]),
        ] {
            let said = said(text);
            assert!(words.iter().all(|w| said.contains(w)), "{text:?}: {said}");
        }
    }

    /// Every prefix of a good file, and the file with each byte changed, is read or refused.
    #[test]
    fn damaged_files_are_no_panic() {
        let good = text(&Picture::default(), Path::new("s.toml")).expect("text").into_bytes();
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.toml");
        let (mut state, mut refused) = (1u64, 0);
        for i in 0..2 * good.len() {
            let mut bytes = good.clone();
            if i < good.len() {
                bytes.truncate(i);
            } else {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                bytes[i - good.len()] = (state >> 33) as u8;
            }
            std::fs::write(&path, &bytes).expect("written");
            if let Err(e) = read(&path) {
                refused += 1;
                assert!(e.to_string().contains("s.toml"), "{e}");
            }
        }
        assert!(refused > good.len() / 2, "only {refused}");
        let deep = "[".repeat(100_000);
        for text in [format!("a = {deep}"), format!("{deep}a"), "a.".repeat(100_000) + "b = 1", "x = { ".repeat(50_000)]
        {
            std::fs::write(&path, text).expect("written");
            assert!(read(&path).is_err());
        }
        std::fs::write(&path, vec![b' '; LONGEST as usize + 1]).expect("written");
        assert!(matches!(read(&path), Err(SceneFileError::TooLarge(_))));
        std::fs::write(&path, [0xff, 0xfe]).expect("written");
        assert!(matches!(read(&path), Err(SceneFileError::NoText(_))));
        assert!(matches!(read(folder.path()), Err(SceneFileError::Read { .. })));
    }
}
