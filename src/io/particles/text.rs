//! What text formats share: encodings, lines, numbers.

use super::source::Source;
use super::{At, ReadError};
use crate::io::quote::quote;

/// Bytes at the start of a file by which text is known.
const HEAD: usize = 1024;

/// Both readers of tables advise this.
pub(super) const DECIMAL_POINTS: &str = "write decimal points, and no thousands separators";

/// The file without a UTF-8 byte-order mark.
///
/// # Errors
/// [`ReadError::Malformed`] for UTF-16 and UTF-32, which look like packed numbers.
pub(super) fn content<'a>(source: &Source<'a>) -> Result<&'a [u8], ReadError> {
    let bytes = source.bytes;
    let head = &bytes[..bytes.len().min(HEAD)];
    let wide = |lead: usize| {
        let (mut pairs, mut text) = (0, 0);
        for pair in head.chunks_exact(2) {
            pairs += 1;
            text += usize::from(pair[1 - lead] == 0 && printable(pair[lead]));
        }
        pairs >= 4 && text * 8 >= pairs * 7
    };
    let utf32 = [[0xff, 0xfe, 0, 0], [0, 0, 0xfe, 0xff]].iter().any(|mark| bytes.starts_with(mark));
    if utf32 || wide(0) || wide(1) {
        return Err(source.malformed_but(At::Byte(0), "it is UTF-16 or UTF-32 text", "save it as UTF-8"));
    }
    Ok(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
}

/// Whether `bytes` begin as a text does. Of the bytes of packed numbers hardly half are printable; a text may have a few
/// that are not (an accent, a flaw), or many if they are UTF-8.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(HEAD)];
    let plain = head.iter().filter(|b| printable(**b)).count() * 16 >= head.len() * 15;
    let utf8 = match std::str::from_utf8(head) {
        Ok(_) => true,
        // The head may end within a character.
        Err(error) => error.error_len().is_none(),
    };
    plain || (utf8 && head.iter().all(|b| printable(*b) || !b.is_ascii()))
}

fn printable(byte: u8) -> bool {
    byte.is_ascii_graphic() || byte.is_ascii_whitespace()
}

/// The lines of `bytes` with their numbers from 1. A line ends at a line feed, a carriage return, or both.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    let (mut rest, mut number) = (Some(bytes), 0);
    std::iter::from_fn(move || {
        let bytes = rest?;
        number += 1;
        let end = bytes.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(bytes.len());
        let skip = if bytes[end..].starts_with(b"\r\n") { 2 } else { 1 };
        rest = bytes.get(end + skip..);
        Some((number, &bytes[..end]))
    })
}

/// How many lines there are, at most.
pub(super) fn line_count(bytes: &[u8]) -> u64 {
    bytes.iter().filter(|b| matches!(b, b'\n' | b'\r')).count() as u64 + 1
}

/// The number `word`, in which a comma can only be a decimal comma or a thousands separator.
pub(super) fn number(source: &Source<'_>, at: At, word: &str, place: &str) -> Result<f64, ReadError> {
    word.parse().map_err(|_| {
        let detail = format!("number expected{place}, found `{}`", quote(word));
        let digits = |part: &str| part.chars().all(|c| c.is_ascii_digit() || "+-.,eE".contains(c));
        if word.contains(',') && digits(word) {
            return source.malformed_but(at, detail, DECIMAL_POINTS);
        }
        source.malformed_but(
            at,
            detail,
            "correct it; headings and comments start with # (.xyz, .csv) or are names of columns (.csv)",
        )
    })
}

/// Tells the columns of a file without names of columns: whether all of it could be decimal commas taken for separators.
///
/// `0,637,0,270,0,041` has six integers or three decimals, and so may exponents follow. Positions that are all integers, followed by integers, with
/// nothing but commas between, are rare enough to ask for a header.
#[derive(Default)]
pub(super) struct CommaCheck {
    no_integer: bool,
}

impl CommaCheck {
    pub(super) fn field(&mut self, field: &str) {
        self.no_integer |= !field.is_empty() && field.bytes().any(|b| !b.is_ascii_digit() && !b"+-eE".contains(&b));
    }

    pub(super) fn finish(&self, source: &Source<'_>, at: At, columns: usize) -> Result<(), ReadError> {
        if self.no_integer || columns < 4 {
            return Ok(());
        }
        let detail = format!("{columns} columns of integers, which may as well be fewer with decimal commas");
        Err(source.malformed_but(
            at,
            detail,
            "write decimal points, or a first line with the names of columns in a .csv",
        ))
    }
}
