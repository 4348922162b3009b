//! The header of a NumPy array.
//!
//! Own code: npyz's parser takes four times as long for each level of nesting more, allocates what a header says of its own
//! length, and multiplies dimensions without looking. What describes an array of numbers is flat.

use std::io::Read;

use super::numbers::Kind;
use super::source::Source;
use super::{At, ReadError};
use crate::io::quote::quote;

/// NumPy itself reads no longer header.
const LONGEST: usize = 10_000;
/// Nor more dimensions than 64.
const DIMENSIONS: usize = 64;

pub(super) struct Header {
    pub(super) kind: Kind,
    pub(super) big_endian: bool,
    pub(super) fortran: bool,
    pub(super) shape: Vec<u64>,
}

/// Reads up to the first byte of data.
pub(super) fn read(source: &Source<'_>, name: &str, stream: &mut dyn Read) -> Result<Header, ReadError> {
    let bad = |detail: &str| source.malformed(At::Unknown, format!("array `{name}`: {detail}"));
    let cut = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::UnexpectedEof => bad("the header is cut off"),
        _ => source.broken(&format!("array `{name}`"), error),
    };
    let (mut start, mut wide) = ([0; 10], [0; 2]);
    stream.read_exact(&mut start).map_err(cut)?;
    let length = match start {
        [0x93, b'N', b'U', b'M', b'P', b'Y', 1, _, a, b] => u16::from_le_bytes([a, b]).into(),
        [0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, _, a, b] => {
            stream.read_exact(&mut wide).map_err(cut)?;
            u32::from_le_bytes([a, b, wide[0], wide[1]]) as usize
        }
        _ => return Err(bad("not a NumPy array of format 1 to 3")),
    };
    if length > LONGEST {
        return Err(bad(&format!("a header of {length} bytes, and NumPy reads no more than {LONGEST}")));
    }
    let mut text = vec![0; length];
    stream.read_exact(&mut text).map_err(cut)?;
    let text = String::from_utf8_lossy(&text);
    if text.contains('[') {
        return Err(source.wrong_shape(name, "of records", "of numbers"));
    }
    let fields = Fields::parse(&text).ok_or_else(|| bad(&format!("not a header of numbers: `{}`", quote(&text))))?;
    let (big_endian, number) = match fields.descr.split_at_checked(1) {
        Some(("<" | "|" | "=", number)) => (false, number),
        Some((">", number)) => (true, number),
        _ => (false, fields.descr),
    };
    let kind = match number {
        "f2" => Kind::F16,
        "f4" => Kind::F32,
        "f8" => Kind::F64,
        "i1" => Kind::I8,
        "i2" => Kind::I16,
        "i4" => Kind::I32,
        "i8" => Kind::I64,
        "u1" | "b1" => Kind::U8,
        "u2" => Kind::U16,
        "u4" => Kind::U32,
        "u8" => Kind::U64,
        _ => {
            let found = format!("of type `{}`", quote(fields.descr));
            return Err(source.wrong_shape(name, found, "float16, float32, float64 or integers"));
        }
    };
    Ok(Header { kind, big_endian, fortran: fields.fortran, shape: fields.shape })
}

struct Fields<'a> {
    descr: &'a str,
    fortran: bool,
    shape: Vec<u64>,
}

impl<'a> Fields<'a> {
    /// `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 3), }`, in any order.
    fn parse(text: &'a str) -> Option<Self> {
        let (mut descr, mut fortran, mut shape) = (None, None, None);
        let mut rest = text.trim().strip_prefix('{')?.strip_suffix('}')?.trim();
        while !rest.is_empty() {
            let (key, after) = quoted(rest)?;
            let value = after.trim_start().strip_prefix(':')?.trim_start();
            let again;
            (again, rest) = match key {
                "descr" => {
                    let (value, rest) = quoted(value)?;
                    (descr.replace(value).is_some(), rest)
                }
                "fortran_order" => {
                    let (order, rest) = match value.strip_prefix("True") {
                        Some(rest) => (true, rest),
                        None => (false, value.strip_prefix("False")?),
                    };
                    (fortran.replace(order).is_some(), rest)
                }
                "shape" => {
                    let (value, rest) = value.strip_prefix('(')?.split_once(')')?;
                    (shape.replace(dimensions(value)?).is_some(), rest)
                }
                _ => return None,
            };
            rest = rest.trim_start();
            rest = match rest.strip_prefix(',') {
                Some(rest) => rest.trim_start(),
                None if rest.is_empty() => rest,
                None => return None,
            };
            if again {
                return None;
            }
        }
        Some(Fields { descr: descr?, fortran: fortran?, shape: shape? })
    }
}

fn quoted(text: &str) -> Option<(&str, &str)> {
    let mark = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split_once(mark)
}

/// `3, 3`, `3,` or nothing; Python 2 wrote `3L`.
fn dimensions(text: &str) -> Option<Vec<u64>> {
    let text = text.trim();
    let text = text.strip_suffix(',').unwrap_or(text);
    if text.is_empty() {
        return Some(Vec::new());
    }
    let shape: Option<Vec<u64>> = text
        .split(',')
        .map(|n| n.trim().trim_end_matches('L'))
        .map(|n| n.bytes().all(|b| b.is_ascii_digit()).then(|| n.parse().ok())?)
        .collect();
    shape.filter(|shape| shape.len() <= DIMENSIONS)
}
