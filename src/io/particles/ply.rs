//! PLY files (`.ply`).
//!
//! Own code: ply-rs keeps properties by name, so it shifts all data where a name comes twice, and believes counts.

use glam::DVec3;

use super::numbers::Kind;
use super::ply_header::{self, Element, Encoding, Header, Property};
use super::source::Source;
use super::{At, ParticleFile, ReadError, text};
use crate::io::quote::{list, quote};

/// Reads x, y, z (any numeric type), vx, vy, vz and `class` of the element `vertex`; all other elements are walked over, so that data
/// that do not end where the header says are noticed.
pub(super) fn read(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let header = ply_header::read(source)?;
    let encoding = match header.encoding {
        Encoding::Ascii => "ASCII",
        Encoding::Binary { big_endian: true } => "binary, big-endian",
        Encoding::Binary { big_endian: false } => "binary, little-endian",
    };
    source.note(|notes| notes.format = format!("PLY, {encoding}"));
    let mut body = match header.encoding {
        Encoding::Ascii => {
            let lines = text::lines(&source.bytes[header.body..]);
            Body::Ascii(Box::new(lines.filter(|(_, line)| !line.trim_ascii().is_empty())), header.body_line - 1)
        }
        Encoding::Binary { big_endian } => Body::Binary { at: header.body, big_endian },
    };
    let mut file = None;
    for element in &header.elements {
        promised(source, &header, element)?;
        if element.name == "vertex" {
            file = Some(vertices(source, element, &mut body)?);
        } else {
            body.skip(source, element)?;
        }
    }
    body.finish(source)?;
    let names = || format!("elements {}", list(header.elements.iter().map(|e| e.name.as_str())));
    file.ok_or_else(|| source.no_positions("an element `vertex` expected", names()))
}

/// Refuses an element that promises more than follows the header.
fn promised(source: &Source<'_>, header: &Header, element: &Element) -> Result<(), ReadError> {
    let (needed, follow) =
        (element.count.saturating_mul(element.least_size(header.encoding)), source.bytes.len() - header.body);
    if needed <= follow as u64 + 1 && (element.count == 0 || !element.properties.is_empty()) {
        return Ok(());
    }
    let detail = format!(
        "element `{}` promises {} entries, at least {needed} bytes; {follow} follow",
        quote(&element.name),
        element.count,
    );
    Err(source.malformed(At::Byte(header.body as u64), detail))
}

/// Refuses a header that is none, or promises more than follows it: for readers of what is no particle.
#[cfg(feature = "study")]
pub(super) fn check_header(source: &Source<'_>) -> Result<(), ReadError> {
    let header = ply_header::read(source)?;
    header.elements.iter().try_for_each(|element| promised(source, &header, element))
}

fn vertices(source: &Source<'_>, element: &Element, body: &mut Body<'_>) -> Result<ParticleFile, ReadError> {
    let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(|axis| element.scalar(axis)) else {
        let found = list(element.properties.iter().map(|p| p.name.as_str()));
        return Err(source.no_positions("vertex properties x, y, z expected", found));
    };
    for property in &element.properties {
        source.note_array(&property.name, property.kind.name(), 1);
    }
    let (class, id) = (element.scalar("class"), element.scalar("id"));
    let mut ids = source.ids(if id.is_some() { element.count } else { 0 })?;
    let mut positions = source.room(element.count, "positions")?;
    let mut classes = source.room(if class.is_some() { element.count } else { 0 }, "classes")?;
    let velocity = match ["vx", "vy", "vz"].map(|axis| element.scalar(axis)) {
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        _ => None,
    };
    let mut velocities = source.room(if velocity.is_some() { element.count } else { 0 }, "velocities")?;
    let mut values = vec![f64::NAN; element.properties.len()];
    for index in 0..element.count as usize {
        body.entry(source, &element.name, &element.properties, &mut values)?;
        positions.push(DVec3::new(values[x], values[y], values[z]));
        velocities.extend(velocity.map(|columns| DVec3::from_array(columns.map(|column| values[column]))));
        id.iter().for_each(|id| ids.push(values[*id]));
        if let Some(class) = class {
            classes.push(source.class(values[class], index)?);
        }
    }
    let (classes, velocities) = (class.map(|_| classes), velocity.map(|_| velocities));
    let ids = id.and_then(|_| ids.finish());
    Ok(ParticleFile { positions, classes, velocities, ids, ..ParticleFile::default() })
}

/// What follows the header.
enum Body<'a> {
    /// Lines that are not blank, and the number of lines before them.
    Ascii(Box<dyn Iterator<Item = (u64, &'a [u8])> + 'a>, u64),
    Binary {
        at: usize,
        big_endian: bool,
    },
}

impl Body<'_> {
    fn skip(&mut self, source: &Source<'_>, element: &Element) -> Result<(), ReadError> {
        if let Body::Binary { at, .. } = self
            && element.properties.iter().all(|p| p.list.is_none())
        {
            let size: usize = element.properties.iter().map(|p| p.kind.size()).sum();
            // The caller found that the file is as long as this alone; not that it is after what came before.
            let length = (element.count as usize).saturating_mul(size);
            *at = at.saturating_add(length);
            return if *at > source.bytes.len() { Err(ends(source, &element.name)) } else { Ok(()) };
        }
        let mut values = vec![0.0; element.properties.len()];
        (0..element.count).try_for_each(|_| self.entry(source, &element.name, &element.properties, &mut values))
    }

    /// Reads one entry's scalars into `values`.
    fn entry(
        &mut self,
        source: &Source<'_>,
        name: &str,
        properties: &[Property],
        values: &mut [f64],
    ) -> Result<(), ReadError> {
        match self {
            Body::Binary { at, big_endian } => {
                let mut take = |kind: Kind, count: usize| {
                    let end = count.checked_mul(kind.size()).and_then(|length| at.checked_add(length));
                    let part = end.and_then(|end| source.bytes.get(*at..end)).ok_or_else(|| ends(source, name))?;
                    *at += part.len();
                    Ok(part)
                };
                for (property, value) in properties.iter().zip(values) {
                    let Some(count_kind) = property.list else {
                        *value = property.kind.decode(take(property.kind, 1)?, *big_endian);
                        continue;
                    };
                    let count = count_kind.decode(take(count_kind, 1)?, *big_endian);
                    let count = entries(count).ok_or_else(|| ends(source, name))?;
                    take(property.kind, count)?;
                }
            }
            Body::Ascii(lines, before) => {
                let (number, line) = lines.next().ok_or_else(|| ends(source, name))?;
                let at = At::Line(*before + number);
                let line = String::from_utf8_lossy(line);
                let mut words = line.split_whitespace();
                let mut next = || {
                    let word = words.next().ok_or_else(|| {
                        let detail = format!("fewer numbers than `{}` has properties", quote(name));
                        source.malformed(at, detail)
                    })?;
                    text::number(source, at, word, "")
                };
                for (property, value) in properties.iter().zip(values) {
                    *value = next()?;
                    if property.list.is_some() {
                        let bad = || source.malformed(at, "a list with an impossible number of entries");
                        (0..entries(*value).ok_or_else(bad)?).try_for_each(|_| next().map(drop))?;
                    }
                }
                if words.next().is_some() {
                    let detail = format!("more numbers than `{}` has properties", quote(name));
                    return Err(source.malformed(at, detail));
                }
            }
        }
        Ok(())
    }

    /// Checks that nothing is left but blanks and zeros.
    fn finish(self, source: &Source<'_>) -> Result<(), ReadError> {
        let (at, detail) = match self {
            Body::Ascii(mut lines, before) => match lines.next() {
                Some((number, _)) => (At::Line(before + number), "more lines than the header promises"),
                None => return Ok(()),
            },
            Body::Binary { at, .. } => match &source.bytes[at..] {
                rest if rest.iter().all(|b| *b == 0 || b.is_ascii_whitespace()) => return Ok(()),
                _ => (At::Byte(at as u64), "more data than the header promises"),
            },
        };
        Err(source.malformed_but(at, detail, "positions may be wrong: correct the header, or export it again"))
    }
}

/// A list's number of entries.
fn entries(value: f64) -> Option<usize> {
    (value >= 0.0 && value.fract() == 0.0 && value < 4e9).then_some(value as usize)
}

fn ends(source: &Source<'_>, element: &str) -> ReadError {
    let at = At::Byte(source.bytes.len() as u64);
    source.malformed(at, format!("the file ends within element `{}`", quote(element)))
}
