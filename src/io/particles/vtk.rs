//! Legacy VTK files (`.vtk`).

use glam::DVec3;

use super::numbers::Kind;
use super::source::{Source, find, is_id, is_velocity};
use super::vtk_sections::{Sections, legacy};
use super::{At, ParticleFile, ReadError};
use crate::io::quote::quote;

/// Reads POINTS and, where they are there, the point array `class` and one of velocities.
pub(super) fn read(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let bytes = source.bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(source.bytes);
    let mut lines = bytes.splitn(4, |b| *b == b'\n');
    let mut line = |length: &mut usize| {
        let line = lines.next().unwrap_or_default();
        *length += line.len() + 1;
        String::from_utf8_lossy(line).trim().to_ascii_uppercase()
    };
    let mut at = source.bytes.len() - bytes.len();
    let (first, _title, kind) = (line(&mut at), line(&mut at), line(&mut at));
    if !first.starts_with("# VTK DATAFILE") {
        return Err(source.malformed(At::Line(1), "`# vtk DataFile Version` expected"));
    }
    let ascii = kind == "ASCII";
    if !ascii && kind != "BINARY" {
        return Err(source.malformed(At::Line(3), "`ASCII` or `BINARY` expected"));
    }
    source.note(|notes| notes.format = format!("legacy VTK, {kind}"));
    let sections = Sections { source, at: at.min(source.bytes.len()), ascii };
    Walk {
        sections,
        data_set: String::new(),
        positions: None,
        classes: None,
        velocities: None,
        ids: None,
        after_points: false,
        of: Of::Set,
        tuples: 0,
    }
    .run()
}

/// What arrays belong to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Of {
    Set,
    Points,
    Cells,
}

/// Goes through a file section by section.
struct Walk<'a> {
    sections: Sections<'a>,
    data_set: String,
    positions: Option<Vec<DVec3>>,
    classes: Option<Vec<u8>>,
    velocities: Option<Vec<DVec3>>,
    ids: Option<Vec<u64>>,
    /// Whether POINTS came last.
    after_points: bool,
    of: Of,
    /// Entries of an array of the current POINT_DATA or CELL_DATA.
    tuples: u64,
}

impl Walk<'_> {
    fn run(mut self) -> Result<ParticleFile, ReadError> {
        loop {
            let at = self.sections.at;
            let Some(line) = self.sections.line() else {
                break;
            };
            if !self.section(at, &line)? {
                break;
            }
        }
        let Some(positions) = self.positions else {
            let found = format!("data set `{}` without", quote(&self.data_set));
            return Err(self.sections.source.no_positions("POINTS expected", found));
        };
        let (classes, velocities) = (self.classes, self.velocities);
        self.sections.source.note(|notes| notes.format += &format!(", {}", quote(&self.data_set)));
        Ok(ParticleFile { positions, classes, velocities, ids: self.ids, ..ParticleFile::default() })
    }

    /// Reads or passes over the section that begins with `line`; `false` where it is unknown and so the last that is looked at.
    fn section(&mut self, at: usize, line: &str) -> Result<bool, ReadError> {
        let source = self.sections.source;
        let bad = |what: &str| source.malformed(At::Byte(at as u64), format!("{what}: `{}`", quote(line)));
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let keyword = words.first().copied().unwrap_or_default().to_ascii_uppercase();
        let number = |i: usize| -> Result<u64, ReadError> {
            words.get(i).and_then(|word| word.parse().ok()).ok_or_else(|| bad("a number is missing"))
        };
        let kind = |i: usize| words.get(i).copied().unwrap_or_default().to_ascii_lowercase();
        let tuples = self.tuples;
        match keyword.as_str() {
            "DATASET" => self.data_set = kind(1).to_ascii_uppercase(),
            "POINTS" => {
                if self.positions.is_some() {
                    return Err(bad("a second POINTS"));
                }
                let kind = kind(2);
                // How long a packed `long` is depends on its writer's machine.
                let known = if self.sections.ascii { legacy(&kind) } else { Kind::named(&kind) };
                if known.is_none() {
                    let found = format!("of type `{}`", quote(&kind));
                    return Err(source.wrong_shape("POINTS", found, "float, double or integers of a known size"));
                }
                source.note_array("points", &kind, 3);
                self.positions = Some(self.sections.points(number(1)?, &kind)?.finish());
            }
            "CELLS" | "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS" => {
                let (first, second) = (number(1)?, number(2)?);
                let offsets = self.sections.peek_line().filter(|line| line.to_ascii_uppercase().starts_with("OFFSETS"));
                if offsets.is_none() {
                    self.sections.skip(&keyword, "int", second)?;
                } else {
                    for (name, count) in [("OFFSETS", first), ("CONNECTIVITY", second)] {
                        let line = self.sections.line().unwrap_or_default();
                        let kind = line.split_ascii_whitespace().nth(1).unwrap_or_default().to_ascii_lowercase();
                        self.sections.skip(name, &kind, count)?;
                    }
                }
            }
            "CELL_TYPES" => self.sections.skip(&keyword, "int", number(1)?)?,
            "POINT_DATA" => {
                (self.of, self.tuples) = (Of::Points, number(1)?);
                let points = self.positions.as_ref().map_or(self.tuples, |positions| positions.len() as u64);
                if points != self.tuples {
                    return Err(bad(&format!("data for other than {points} points")));
                }
            }
            "CELL_DATA" => (self.of, self.tuples) = (Of::Cells, number(1)?),
            "SCALARS" => {
                let components = if words.len() > 3 { number(3)? } else { 1 };
                let table =
                    self.sections.peek_line().filter(|line| line.to_ascii_uppercase().starts_with("LOOKUP_TABLE"));
                table.and_then(|_| self.sections.line());
                self.array(words.get(1).copied().unwrap_or_default(), &kind(2), components, tuples)?;
            }
            "COLOR_SCALARS" => {
                self.sections.skip(&keyword, "unsigned_char", tuples.saturating_mul(number(2)?))?;
            }
            "LOOKUP_TABLE" => self.sections.skip(&keyword, "unsigned_char", number(2)?.saturating_mul(4))?,
            "VECTORS" => self.array(words.get(1).copied().unwrap_or_default(), &kind(2), 3, tuples)?,
            "NORMALS" => self.sections.skip(&keyword, &kind(2), tuples.saturating_mul(3))?,
            "TENSORS" => self.sections.skip(&keyword, &kind(2), tuples.saturating_mul(9))?,
            "TENSORS6" => self.sections.skip(&keyword, &kind(2), tuples.saturating_mul(6))?,
            "TEXTURE_COORDINATES" => self.sections.skip(&keyword, &kind(3), tuples.saturating_mul(number(2)?))?,
            "GLOBAL_IDS" | "PEDIGREE_IDS" | "EDGE_FLAGS" => self.sections.skip(&keyword, &kind(2), tuples)?,
            "FIELD" => {
                let mut left = number(2)?;
                while left > 0 {
                    let at = self.sections.at;
                    let Some(line) = self.sections.line() else {
                        return Err(bad("the file ends within this FIELD"));
                    };
                    if self.metadata(&line) {
                        continue;
                    }
                    left -= 1;
                    let words: Vec<&str> = line.split_ascii_whitespace().collect();
                    let [name, components, tuples, kind] = words[..] else {
                        return self.find_next(at);
                    };
                    let (Ok(components), Ok(tuples)) = (components.parse(), tuples.parse()) else {
                        return Err(source.malformed(self.sections.here(), format!("no array: `{}`", quote(&line))));
                    };
                    self.array(name, &kind.to_ascii_lowercase(), components, tuples)?;
                }
            }
            "METADATA" => return Ok(self.metadata(line)),
            "DIMENSIONS" | "SPACING" | "ORIGIN" | "ASPECT_RATIO" => {}
            "X_COORDINATES" | "Y_COORDINATES" | "Z_COORDINATES" => {
                self.sections.skip(&keyword, &kind(2), number(1)?)?;
            }
            // Another keyword is only unknown; what is none is a part of POINTS.
            _ if self.after_points
                && !(keyword.len() > 3 && keyword.bytes().all(|b| b.is_ascii_uppercase() || b == b'_')) =>
            {
                return Err(bad("a keyword expected after POINTS, which are more than promised"));
            }
            _ => return self.find_next(at),
        }
        self.after_points = keyword == "POINTS";
        Ok(true)
    }

    /// Goes on behind what is not known here: with POINTS or, after them, POINT_DATA.
    fn find_next(&mut self, at: usize) -> Result<bool, ReadError> {
        let source = self.sections.source;
        let rest = &source.bytes[at..];
        if self.positions.is_none() {
            self.sections.at = find(rest, b"\nPOINTS ").map_or(source.bytes.len(), |next| at + next);
            return Ok(true);
        }
        if let Some(next) = find(rest, b"\nPOINT_DATA ") {
            self.sections.at = at + next;
            return Ok(true);
        }
        if self.classes.is_none() && [&b"SCALARS class "[..], b"\nclass "].iter().any(|name| find(rest, name).is_some())
        {
            let detail = "a `class` array behind something that cannot be read";
            return Err(source.malformed(At::Byte(at as u64), detail));
        }
        Ok(false)
    }

    /// Reads the array if it is `class` or velocities of the points, or passes over it.
    fn array(&mut self, name: &str, kind: &str, components: u64, tuples: u64) -> Result<(), ReadError> {
        let count = components.saturating_mul(tuples);
        // How long numbers of an unknown type are is not known.
        let known = self.sections.ascii || legacy(kind).is_some();
        if self.of == Of::Points {
            self.sections.source.note_array(name, kind, components);
        }
        if self.of == Of::Set && name == "TimeValue" && count == 1 && known {
            let mut time = None;
            self.sections.numbers(name, kind, 1, |v| time = Some(v))?;
            self.sections.source.note(|notes| notes.time = time);
            return Ok(());
        }
        if is_id(name) && self.of == Of::Points && components == 1 && known && self.ids.is_none() {
            let mut ids = self.sections.source.ids(tuples.min(self.sections.source.bytes.len() as u64))?;
            self.sections.numbers(name, kind, tuples, |v| ids.push(v))?;
            self.ids = ids.finish();
            return Ok(());
        }
        if is_velocity(name) && self.of == Of::Points && components == 3 && known {
            return self.velocities(name, kind, tuples);
        }
        if name != "class" || self.of != Of::Points {
            return self.sections.skip(&format!("array `{}`", quote(name)), kind, count);
        }
        let source = self.sections.source;
        if self.classes.is_some() {
            return Err(source.malformed(self.sections.here(), "a second array `class`"));
        }
        if components != 1 {
            return Err(source.wrong_shape(
                "class",
                format!("of {components} components"),
                "one integer for each point",
            ));
        }
        // As many as there are points, or refused later; never more than the file has bytes.
        let mut classes = source.room(count.min(source.bytes.len() as u64), "classes")?;
        let mut bad = Ok(());
        self.sections.numbers("class", kind, count, |v| match source.class(v, classes.len()) {
            Ok(class) => classes.push(class),
            Err(error) if bad.is_ok() => bad = Err(error),
            Err(_) => {}
        })?;
        bad?;
        self.classes = Some(classes);
        Ok(())
    }

    fn velocities(&mut self, name: &str, kind: &str, tuples: u64) -> Result<(), ReadError> {
        let source = self.sections.source;
        if self.velocities.is_some() {
            return Err(source.second_velocity(self.sections.here(), name));
        }
        // As many as there are points, or refused later; never more than the file has bytes.
        let mut velocities = source.triples(tuples.min(source.bytes.len() as u64))?;
        self.sections.numbers(name, kind, tuples.saturating_mul(3), |v| velocities.push(v))?;
        self.velocities = Some(velocities.finish());
        Ok(())
    }

    /// Passes over METADATA, which end at a blank line; `false` for anything else.
    fn metadata(&mut self, line: &str) -> bool {
        if !line.eq_ignore_ascii_case("METADATA") {
            return false;
        }
        let rest = &self.sections.source.bytes[self.sections.at..];
        let lines = rest.split_inclusive(|b| *b == b'\n');
        let length: usize = lines.take_while(|line| !line.trim_ascii().is_empty()).map(<[u8]>::len).sum();
        self.sections.at += length;
        true
    }
}
