//! The header of a PLY file. It is strict: what the data mean depends on every word of it.

use std::collections::HashSet;

use super::numbers::Kind;
use super::source::Source;
use super::{At, ReadError};
use crate::io::quote::quote;

/// A longer header is no writer's.
const LONGEST: usize = 1 << 20;

pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Where the data begin, in bytes; their first line.
    pub(super) body: usize,
    pub(super) body_line: u64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Binary { big_endian: bool },
}

pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
    /// The type of the number of entries, for a list.
    pub(super) list: Option<Kind>,
}

impl Element {
    /// Where the scalar `name` is among the properties.
    pub(super) fn scalar(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.name == name && p.list.is_none())
    }

    /// The fewest bytes that one entry takes.
    pub(super) fn least_size(&self, encoding: Encoding) -> u64 {
        let sizes = self.properties.iter().map(|property| match encoding {
            // A digit and a separator; the file's last entry can do without the separator.
            Encoding::Ascii => 2,
            Encoding::Binary { .. } => property.list.unwrap_or(property.kind).size() as u64,
        });
        sizes.sum()
    }
}

pub(super) fn read(source: &Source<'_>) -> Result<Header, ReadError> {
    // Binary data may begin with what looks like the rest of a line's end, so all lines end as the first one does.
    let bytes = source.bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(source.bytes);
    let skipped = source.bytes.len() - bytes.len();
    let end: &[u8] = match bytes {
        [b'p', b'l', b'y', b'\r', b'\n', ..] => b"\r\n",
        [b'p', b'l', b'y', b'\r', ..] => b"\r",
        [b'p', b'l', b'y', b'\n', ..] => b"\n",
        _ => return Err(source.malformed(At::Line(1), "`ply` expected")),
    };
    let (mut encoding, mut elements): (_, Vec<Element>) = (None, Vec::new());
    let (mut names, mut properties) = (HashSet::new(), HashSet::new());
    let (mut at_byte, mut line_number) = (3 + end.len(), 1);
    loop {
        line_number += 1;
        let at = At::Line(line_number);
        let rest = &bytes[at_byte..bytes.len().min(LONGEST)];
        let length = rest
            .windows(end.len())
            .position(|window| window == end)
            .ok_or_else(|| source.malformed(at, "the header has no end (`end_header`)"))?;
        let line = String::from_utf8_lossy(&rest[..length]);
        at_byte += length + end.len();
        let words: Vec<&str> = line.split_whitespace().collect();
        let bad = |what: &str| source.malformed(at, format!("{what}: `{}`", quote(&line)));
        let kind = |name: &str| Kind::named(name).ok_or_else(|| bad("unknown type"));
        match words[..] {
            ["end_header"] => break,
            [] | ["comment" | "obj_info", ..] => {}
            ["format", format, "1.0"] if encoding.is_none() => {
                encoding = Some(match format {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Binary { big_endian: false },
                    "binary_big_endian" => Encoding::Binary { big_endian: true },
                    _ => return Err(bad("unknown format")),
                });
            }
            ["element", name, count] => {
                if !names.insert(name.to_owned()) {
                    return Err(twice(source, at, "element", name));
                }
                let count = count.parse().map_err(|_| bad("no number of entries that a file could hold"))?;
                properties.clear();
                elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            ["property", ref kinds @ .., name] => {
                let element = elements.last_mut().ok_or_else(|| bad("a property before any element"))?;
                if !properties.insert(name.to_owned()) {
                    return Err(twice(source, at, "property", name));
                }
                let (kind, list) = match kinds {
                    [scalar] => (kind(scalar)?, None),
                    ["list", count, entry] => (kind(entry)?, Some(kind(count)?)),
                    _ => return Err(bad("not a property")),
                };
                element.properties.push(Property { name: name.into(), kind, list });
            }
            _ => return Err(bad("not a line of a PLY header (version 1.0)")),
        }
    }
    let encoding = encoding.ok_or_else(|| source.malformed(At::Line(2), "the header has no `format`"))?;
    Ok(Header { encoding, elements, body: skipped + at_byte, body_line: line_number + 1 })
}

fn twice(source: &Source<'_>, at: At, what: &str, name: &str) -> ReadError {
    let detail = format!("{what} `{}` is there twice", quote(name));
    source.malformed_but(at, detail, "nobody can say which one is meant: rename or remove one")
}
