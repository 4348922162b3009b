//! What stands where in a legacy VTK file: its keywords and the arrays after them, one after the other.
//!
//! Own code: vtkio rejects a whole file for parts that do not matter here (a FIELD before POINTS as ParaView writes, ids of
//! type vtkIdType, nan in ASCII) and holds all of it several times over.

use super::numbers::{Decoder, Kind};
use super::source::{Source, Triples};
use super::{At, ReadError, text};
use crate::io::quote::quote;

/// Reads words and arrays from the start of a legacy VTK file on.
pub(super) struct Sections<'a> {
    pub(super) source: &'a Source<'a>,
    pub(super) at: usize,
    pub(super) ascii: bool,
}

impl<'a> Sections<'a> {
    pub(super) fn here(&self) -> At {
        At::Byte(self.at as u64)
    }

    fn rest(&self) -> &'a [u8] {
        &self.source.bytes[self.at..]
    }

    /// The next line that is not blank, without its end; `None` at the end of the file.
    pub(super) fn line(&mut self) -> Option<String> {
        let blank = self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
        self.at += blank;
        let rest = self.rest();
        if rest.is_empty() {
            return None;
        }
        let length = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        self.at += length.saturating_add(1).min(rest.len());
        Some(String::from_utf8_lossy(&rest[..length]).trim_end().to_owned())
    }

    /// That line, without taking it.
    pub(super) fn peek_line(&mut self) -> Option<String> {
        let at = self.at;
        let line = self.line();
        self.at = at;
        line
    }

    /// Decodes `count` numbers of an array named `name`.
    pub(super) fn numbers(
        &mut self,
        name: &str,
        kind: &str,
        count: u64,
        mut each: impl FnMut(f64),
    ) -> Result<(), ReadError> {
        if self.ascii {
            return self.words(name, count, |source, at, word| {
                let word = String::from_utf8_lossy(word);
                text::number(source, at, &word, &format!(" in {name}")).map(&mut each)
            });
        }
        let Some(kind) = legacy(kind) else {
            return Err(self.source.wrong_shape(name, format!("of type `{}`", quote(kind)), "a numeric type"));
        };
        let bytes = self.packed(name, kind, count)?;
        Decoder::new(kind, true).feed(bytes, each);
        Ok(())
    }

    /// Passes over an array. The length of one of an unknown type is unknown: what comes next is then no keyword.
    pub(super) fn skip(&mut self, name: &str, kind: &str, count: u64) -> Result<(), ReadError> {
        if matches!(kind, "string" | "utf8_string") {
            return self.strings(name, count);
        }
        if self.ascii {
            return self.words(name, count, |_, _, _| Ok(()));
        }
        match legacy(kind) {
            Some(kind) => self.packed(name, kind, count).map(drop),
            // Eight to a byte.
            None if kind == "bit" => self.packed(name, Kind::U8, count.div_ceil(8)).map(drop),
            None => Ok(()),
        }
    }

    /// Passes over strings: each a line, or packed behind its length, of which the first two bits say how long that is.
    fn strings(&mut self, name: &str, count: u64) -> Result<(), ReadError> {
        for found in 0..count {
            let rest = self.rest();
            let length = if self.ascii {
                rest.iter().position(|b| *b == b'\n').map(|end| end + 1)
            } else {
                rest.first().and_then(|first| {
                    let size = 1 << (3 - (first >> 6));
                    let bytes = rest[1..].get(..size - 1)?;
                    let length = bytes.iter().fold(u64::from(first & 0x3f), |n, b| n << 8 | u64::from(*b));
                    usize::try_from(length).ok()?.checked_add(size)
                })
            };
            match length.filter(|length| *length <= rest.len()) {
                Some(length) => self.at += length,
                None => return Err(self.ends(name, count, found)),
            }
        }
        Ok(())
    }

    fn packed(&mut self, name: &str, kind: Kind, count: u64) -> Result<&'a [u8], ReadError> {
        let rest = self.rest();
        match rest.get(..count.saturating_mul(kind.size() as u64) as usize) {
            Some(bytes) => {
                self.at += bytes.len();
                Ok(bytes)
            }
            None => Err(self.ends(name, count, (rest.len() / kind.size()) as u64)),
        }
    }

    fn words(
        &mut self,
        name: &str,
        count: u64,
        mut each: impl FnMut(&Source<'_>, At, &[u8]) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        for found in 0..count {
            let rest = self.rest();
            let start = rest.iter().take_while(|b| b.is_ascii_whitespace()).count();
            let length = rest[start..].iter().take_while(|b| !b.is_ascii_whitespace()).count();
            if length == 0 {
                return Err(self.ends(name, count, found));
            }
            each(self.source, At::Byte((self.at + start) as u64), &rest[start..start + length])?;
            self.at += start + length;
        }
        Ok(())
    }

    fn ends(&self, name: &str, count: u64, found: u64) -> ReadError {
        let detail = format!("the file ends within {name}: {count} entries promised, {found} found");
        self.source.malformed(At::Byte(self.source.bytes.len() as u64), detail)
    }

    /// The positions that `POINTS count kind` promises.
    pub(super) fn points(&mut self, count: u64, kind: &str) -> Result<Triples, ReadError> {
        let least = if self.ascii { 2 } else { legacy(kind).map_or(1, Kind::size) as u64 };
        if count.saturating_mul(3).saturating_mul(least) > self.rest().len() as u64 + 1 {
            let detail = format!("POINTS promises {count} positions, and the file is too short for them");
            return Err(self.source.malformed(self.here(), detail));
        }
        let mut triples = self.source.triples(count)?;
        self.numbers("POINTS", kind, 3 * count, |v| triples.push(v))?;
        Ok(triples)
    }
}

/// `long` is as long as on its writer's machine, most likely 8 bytes. VTK writes ids as `int`.
pub(super) fn legacy(name: &str) -> Option<Kind> {
    match name {
        "long" => Some(Kind::I64),
        "vtkidtype" => Some(Kind::I32),
        "unsigned_long" => Some(Kind::U64),
        _ => Kind::named(name),
    }
}
