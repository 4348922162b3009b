//! VTK XML files (`.vtu`, `.vtp`).
//!
//! vtkio knows them too, but not raw appended data, nor empty arrays (it panics on them), nor blocks without a partial last
//! one, and it allocates whatever a corrupt block header says.

use std::borrow::Cow;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::numbers::Kind;
use super::source::{Ids, Source, Triples, find, is_id, is_velocity};
use super::vtk_xml_blocks::Codec;
use super::vtk_xml_data::{Array, Encoding};
use super::{At, ParticleFile, ReadError};
use crate::io::quote::quote;

/// Reads the points, the point array `class` and one of velocities of all pieces.
pub(super) fn read(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    if !source.bytes.trim_ascii_end().ends_with(b"</VTKFile>") {
        return Err(source.malformed(At::Byte(source.bytes.len() as u64), "the file ends before `</VTKFile>`"));
    }
    // Appended data may be raw bytes, which no XML parser should see.
    let mut encoding = Encoding::default();
    let text = match find(source.bytes, b"<AppendedData") {
        None => source.bytes,
        Some(at) => {
            let tail = &source.bytes[at..];
            let data = find(tail, b">").and_then(|tag| Some(tag + find(&tail[tag..], b"_")? + 1));
            let data = data.ok_or_else(|| source.malformed(At::Byte(at as u64), "AppendedData without `_`"))?;
            encoding.appended = Some(&tail[data..]);
            encoding.appended_base64 = find(&tail[..data], b"base64").is_some();
            &source.bytes[..at]
        }
    };
    let mut reader = Reader::from_reader(text);
    let mut pieces = Pieces::default();
    let (mut section, mut data_set) = (Vec::new(), String::new());
    let mut formats: Vec<String> = Vec::new();
    loop {
        let at = At::Byte(reader.buffer_position());
        let event = reader.read_event().map_err(|error| source.malformed(at, xml(&error)))?;
        let (tag, empty) = match event {
            Event::Eof => break,
            Event::Start(tag) => (tag, false),
            Event::Empty(tag) => (tag, true),
            Event::End(tag) if tag.name().as_ref() == section => {
                section.clear();
                continue;
            }
            _ => continue,
        };
        let attribute = |name| attribute(source, at, &tag, name);
        match tag.name().as_ref() {
            b"VTKFile" => {
                data_set = attribute("type")?.unwrap_or_default();
                encoding.big_endian = attribute("byte_order")?.as_deref() == Some("BigEndian");
                encoding.wide_header = attribute("header_type")?.as_deref() == Some("UInt64");
                encoding.compressor = attribute("compressor")?;
            }
            b"Piece" => {
                let count = attribute("NumberOfPoints")?.unwrap_or_default();
                let count = count.trim().parse();
                pieces.begin(source, at, count.map_err(|_| source.malformed(at, "a Piece without NumberOfPoints"))?)?;
            }
            name @ (b"Points" | b"PointData" | b"FieldData") if !empty => section = name.to_vec(),
            b"DataArray" => {
                let name = attribute("Name")?.unwrap_or_default();
                let stated = attribute("NumberOfComponents")?.unwrap_or_else(|| "1".into());
                let (data_type, format) = (attribute("type")?, attribute("format")?);
                let (scalar, numeric) = (stated.trim() == "1", data_type.as_deref().and_then(Kind::named).is_some());
                if section != b"FieldData" && !section.is_empty() && pieces.number == 1 {
                    let kind = data_type.as_deref().unwrap_or_default();
                    source.note_array(&name, kind, stated.trim().parse().unwrap_or(1));
                    formats.push(format.clone().unwrap_or_default().to_ascii_lowercase());
                }
                let what = match section.as_slice() {
                    b"Points" => What::Positions,
                    b"PointData" if name == "class" => What::Classes,
                    b"PointData" if is_velocity(&name) && stated.trim() == "3" => What::Velocities,
                    b"PointData" if is_id(&name) && scalar && numeric && !pieces.has_ids => What::Ids,
                    b"PointData" if name == "vtkGhostType" && scalar && numeric => What::Ghosts,
                    b"FieldData" if name == "TimeValue" && scalar && numeric => What::Time,
                    _ => continue,
                };
                let needed = match what {
                    What::Positions => Some(("Points", "3")),
                    What::Classes => Some(("class", "1")),
                    _ => None,
                };
                if let Some((array, components)) = needed.filter(|(_, components)| stated.trim() != *components) {
                    return Err(source.wrong_shape(array, format!("of {} components", quote(&stated)), components));
                }
                let offset = attribute("offset")?.and_then(|offset| offset.trim().parse().ok());
                let text = if empty { Cow::Borrowed(&[][..]) } else { content(source, &mut reader)? };
                let array = Array {
                    at,
                    data_type: data_type.unwrap_or_default(),
                    format: format.unwrap_or_default(),
                    offset: offset.unwrap_or(0),
                    count: match what {
                        What::Positions | What::Velocities => pieces.points.saturating_mul(3),
                        What::Classes | What::Ids | What::Ghosts => pieces.points,
                        What::Time => 1,
                    },
                    text: text.trim_ascii(),
                };
                match what {
                    What::Positions => pieces.positions(source, &array, &encoding)?,
                    What::Classes => pieces.classes(source, &array, &encoding)?,
                    What::Velocities => pieces.velocities(source, &name, &array, &encoding)?,
                    What::Ids => pieces.ids(source, &array, &encoding)?,
                    What::Ghosts => pieces.ghosts(source, &array, &encoding)?,
                    What::Time => {
                        let mut time = None;
                        array.values(source, &encoding, |v| time = Some(v))?;
                        source.note(|notes| notes.time = time);
                    }
                }
            }
            _ => {}
        }
    }
    pieces.end(source, At::Byte(text.len() as u64))?;
    source.note(|notes| {
        notes.format = format!("VTK XML {}, {}", quote(&data_set), stored(&formats, encoding.appended_base64));
        notes.compression =
            encoding.compressor.as_deref().map(|name| Codec::named(name).map_or("", Codec::name).into());
    });
    let Some(positions) = pieces.positions else {
        let found = format!("data set `{}` without", quote(&data_set));
        return Err(source.no_positions("a DataArray in Points expected", found));
    };
    let (positions, velocities) = (positions.finish(), pieces.velocities.map(Triples::finish));
    let ids = pieces.ids.and_then(Ids::finish);
    let mut file = ParticleFile { positions, classes: pieces.classes, velocities, ids, ..ParticleFile::default() };
    if pieces.ghosts.contains(&true) {
        // Where lists are not as long as positions it is refused later.
        file.retain(|index| !pieces.ghosts.get(index).is_some_and(|ghost| *ghost));
    }
    Ok(file)
}

/// How arrays are stored: what is not written out in text is in base64 or raw.
fn stored(formats: &[String], base64: bool) -> &'static str {
    let has = |format: &str| formats.iter().any(|f| f == format);
    match (has("appended"), has("binary")) {
        (true, _) if base64 => "appended in base64",
        (true, _) => "appended raw",
        (false, true) => "inline in base64",
        (false, false) => "ASCII",
    }
}

/// What an array holds that is read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum What {
    Positions,
    Classes,
    Velocities,
    Ids,
    Ghosts,
    Time,
}

/// Points of another piece (bit 0) or hidden ones (bit 1), by vtkGhostType.
const GHOST: u8 = 3;

/// The pieces of the data set so far: each brings its points once.
#[derive(Default)]
struct Pieces {
    positions: Option<Triples>,
    classes: Option<Vec<u8>>,
    velocities: Option<Triples>,
    ids: Option<Ids>,
    /// For each point so far whether it belongs to another piece; shorter where no piece says so.
    ghosts: Vec<bool>,
    /// Pieces so far, and points of those before the current one.
    number: usize,
    before: usize,
    /// Points of the current piece, and whether they, their classes, velocities and ids were read.
    points: usize,
    has_positions: bool,
    has_classes: bool,
    has_velocities: bool,
    has_ids: bool,
}

impl Pieces {
    fn begin(&mut self, source: &Source<'_>, at: At, points: usize) -> Result<(), ReadError> {
        self.end(source, at)?;
        self.before = self.before.saturating_add(self.points);
        self.points = points;
        self.number += 1;
        (self.has_positions, self.has_classes, self.has_velocities, self.has_ids) = (false, false, false, false);
        Ok(())
    }

    /// Checks that the current piece is complete.
    fn end(&self, source: &Source<'_>, at: At) -> Result<(), ReadError> {
        if self.points > 0 && !self.has_positions && self.positions.is_some() {
            return Err(source.malformed(at, "a Piece without Points before this"));
        }
        Ok(())
    }

    fn positions(&mut self, source: &Source<'_>, array: &Array<'_>, encoding: &Encoding<'_>) -> Result<(), ReadError> {
        if std::mem::replace(&mut self.has_positions, true) {
            return Err(source.malformed(array.at, "a second DataArray in Points"));
        }
        let more = source.triples(self.points as u64)?;
        let all = self.positions.get_or_insert(more);
        all.reserve(self.points);
        array.values(source, encoding, |v| all.push(v))
    }

    fn velocities(
        &mut self,
        source: &Source<'_>,
        name: &str,
        array: &Array<'_>,
        encoding: &Encoding<'_>,
    ) -> Result<(), ReadError> {
        if std::mem::replace(&mut self.has_velocities, true) {
            return Err(source.second_velocity(array.at, name));
        }
        let more = source.triples(self.points as u64)?;
        let all = self.velocities.get_or_insert(more);
        all.reserve(self.points);
        array.values(source, encoding, |v| all.push(v))
    }

    fn ids(&mut self, source: &Source<'_>, array: &Array<'_>, encoding: &Encoding<'_>) -> Result<(), ReadError> {
        self.has_ids = true;
        let more = source.ids(self.points as u64)?;
        let all = self.ids.get_or_insert(more);
        all.reserve(self.points);
        array.values(source, encoding, |v| all.push(v))
    }

    fn ghosts(&mut self, source: &Source<'_>, array: &Array<'_>, encoding: &Encoding<'_>) -> Result<(), ReadError> {
        let (from, to) = (self.before, self.before.saturating_add(self.points));
        source.hold(to.saturating_sub(self.ghosts.len()) as u64, size_of::<bool>(), "ghosts")?;
        self.ghosts.resize(to, false);
        let mut each = self.ghosts[from..].iter_mut();
        array.values(source, encoding, |v| each.next().into_iter().for_each(|ghost| *ghost = v as u8 & GHOST != 0))
    }

    fn classes(&mut self, source: &Source<'_>, array: &Array<'_>, encoding: &Encoding<'_>) -> Result<(), ReadError> {
        if std::mem::replace(&mut self.has_classes, true) {
            return Err(source.malformed(array.at, "a second DataArray `class`"));
        }
        let more: Vec<u8> = source.room(self.points as u64, "classes")?;
        let all = self.classes.get_or_insert(more);
        all.reserve(self.points);
        let mut bad = Ok(());
        array.values(source, encoding, |v| match source.class(v, all.len()) {
            Ok(class) => all.push(class),
            Err(error) if bad.is_ok() => bad = Err(error),
            Err(_) => {}
        })?;
        bad
    }
}

/// The text up to the end of the element, without comments in it and without what is inside other elements in it.
fn content<'a>(source: &Source<'_>, reader: &mut Reader<&'a [u8]>) -> Result<Cow<'a, [u8]>, ReadError> {
    let (mut text, mut depth) = (Cow::Borrowed(&[][..]), 0);
    loop {
        let at = At::Byte(reader.buffer_position());
        let part = match reader.read_event().map_err(|error| source.malformed(at, xml(&error)))? {
            Event::Text(part) if depth == 0 => part.into_inner(),
            Event::CData(part) if depth == 0 => part.into_inner(),
            Event::Start(_) => {
                depth += 1;
                continue;
            }
            Event::End(_) if depth > 0 => {
                depth -= 1;
                continue;
            }
            Event::End(_) | Event::Eof => return Ok(text),
            _ => continue,
        };
        if text.trim_ascii().is_empty() {
            text = part;
        } else {
            let mut joined: Vec<u8> = source.room((text.len() + part.len()) as u64, "an array")?;
            joined.extend([text, part].iter().flat_map(|part| part.iter()));
            text = Cow::Owned(joined);
        }
    }
}

pub(super) fn xml(error: &dyn std::fmt::Display) -> String {
    format!("XML error: {}", quote(&error.to_string()))
}

/// The value of the attribute `name`. The library's own check for repetitions takes time with the square of their number.
pub(super) fn attribute(
    source: &Source<'_>,
    at: At,
    tag: &BytesStart<'_>,
    name: &str,
) -> Result<Option<String>, ReadError> {
    let mut found = None;
    for attribute in tag.attributes().with_checks(false) {
        let attribute = attribute.map_err(|error| source.malformed(at, xml(&error)))?;
        if attribute.key.as_ref() != name.as_bytes() {
            continue;
        }
        let value = attribute.unescape_value().map_err(|error| source.malformed(at, xml(&error)))?;
        if found.replace(value.into_owned()).is_some() {
            return Err(source.malformed(at, format!("attribute `{name}` is there twice")));
        }
    }
    Ok(found)
}
