//! `.xyz`: raw float32, or lines of text.

use std::io::{Read, SeekFrom};

use super::numbers::{Decoder, Kind};
use super::source::{Input, Source};
use super::text::{self, CommaCheck};
use super::{At, ParticleFile, ReadError};
use crate::io::quote::quote;

/// A line of more words is no table's: likely the whole file is one line.
const COLUMNS: usize = 64;

/// Bytes by which text is told from packed numbers; bytes that are decoded at a time.
const HEAD: u64 = 4096;
const PART: usize = 1 << 16;

/// Reads little-endian float32 triples; or, if the file starts as text does, [`lines`].
pub(super) fn read(source: &Source<'_>, input: &mut dyn Input) -> Result<ParticleFile, ReadError> {
    let broken = |error: std::io::Error| source.broken("reading", error);
    let mut head = Vec::new();
    (&mut *input).take(HEAD).read_to_end(&mut head).map_err(broken)?;
    input.seek(SeekFrom::Start(0)).map_err(broken)?;
    let text = text::is_text(text::content(&Source { bytes: &head, ..*source })?);
    drop(head);
    if text {
        let mut whole = source.room(if source.bytes.is_empty() { source.size } else { 0 }, "the file")?;
        if source.bytes.is_empty() {
            input.take(source.size).read_to_end(&mut whole).map_err(broken)?;
        }
        let source = &Source { bytes: if source.bytes.is_empty() { &whole } else { source.bytes }, ..*source };
        let content = text::content(source)?;
        source.note(|notes| notes.format = "XYZ, text".into());
        return lines(source, content);
    }
    let rest = source.size % 12;
    if rest != 0 {
        let at = At::Byte(source.size - rest);
        return Err(source.malformed(at, format!("{rest} bytes left after the last whole float32 triple")));
    }
    source.note(|notes| notes.format = "XYZ, raw".into());
    source.note_array("position", "float32", 3);
    let mut triples = source.triples(source.size / 12)?;
    let (mut decoder, mut part) = (Decoder::new(Kind::F32, false), vec![0; PART]);
    let mut input = input.take(source.size);
    loop {
        match input.read(&mut part).map_err(broken)? {
            0 => break,
            length => decoder.feed(&part[..length], |v| triples.push(v)),
        }
    }
    let positions = triples.finish();
    if positions.len() as u64 != source.size / 12 {
        return Err(source.malformed(At::Unknown, "the file became shorter while it was read"));
    }
    Ok(ParticleFile { positions, ..ParticleFile::default() })
}

/// Lines `x y z ...`, all with as many words, or, as in chemistry, `element x y z ...`, separated by blanks or commas; `#`
/// starts a comment. A first line with nothing but a count is followed by a comment line, and checked.
fn lines(source: &Source<'_>, content: &[u8]) -> Result<ParticleFile, ReadError> {
    let blank =
        |(_, line): &(u64, &[u8])| line.split(|b| *b == b'#').next().unwrap_or_default().trim_ascii().is_empty();
    let first = text::lines(content).find(|line| !blank(line));
    let count =
        first.and_then(|(number, line)| Some((number, std::str::from_utf8(line).ok()?.trim().parse::<usize>().ok()?)));
    // The line after a count is a comment, whatever it holds.
    let skip = count.map_or(0, |(number, _)| number as usize + 1);
    let mut triples = source.triples(text::line_count(content))?;
    let mut table = Table::default();
    for (number, line) in text::lines(content).skip(skip).filter(|line| !blank(line)) {
        let line = String::from_utf8_lossy(line);
        let line = line.split('#').next().unwrap_or_default();
        table.line(source, At::Line(number), line, |v| triples.push(v))?;
    }
    if let Some((number, _)) = count.filter(|_| table.atoms && table.columns > 3 && !table.element) {
        let detail = "a count, as in chemistry, and whole numbers in the first column: they may stand for elements";
        let remedy = "name the elements by letters, or leave out the count and the comment";
        return Err(source.malformed_but(At::Line(number), detail, remedy));
    }
    if table.commas {
        table.check.finish(source, table.first, table.columns)?;
    }
    let positions = triples.finish();
    match count {
        Some((number, promised)) if promised != positions.len() => {
            let detail = format!("a count of {promised} positions, {} follow", positions.len());
            Err(source.malformed(At::Line(number), detail))
        }
        _ => Ok(ParticleFile { positions, ..ParticleFile::default() }),
    }
}

/// What the first line says of all others.
struct Table {
    first: At,
    columns: usize,
    element: bool,
    /// Whether each line so far begins with what may be an atomic number.
    atoms: bool,
    commas: bool,
    check: CommaCheck,
}

impl Default for Table {
    fn default() -> Self {
        Table {
            first: At::Unknown,
            columns: 0,
            element: false,
            atoms: true,
            commas: false,
            check: CommaCheck::default(),
        }
    }
}

impl Table {
    fn line(&mut self, source: &Source<'_>, at: At, line: &str, mut each: impl FnMut(f64)) -> Result<(), ReadError> {
        let blanks = line.split_whitespace().nth(1).is_some();
        let inner = |word: &&str| word.trim_matches(',').contains(',');
        if let Some(word) = line.split_whitespace().find(inner).filter(|_| blanks) {
            let detail = format!("`{}` has a comma amid columns separated by blanks", quote(word));
            return Err(source.malformed_but(at, detail, text::DECIMAL_POINTS));
        }
        let words = || line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty());
        let columns = words().take(COLUMNS + 1).count();
        let is_name = |word: &str| word.starts_with(|c: char| c.is_alphabetic()) && word.parse::<f64>().is_err();
        if self.columns == 0 {
            let element = words().next().is_some_and(is_name) && columns >= 4;
            self.commas = line.contains(',') && !blanks;
            (self.first, self.columns, self.element) = (at, columns, element);
        }
        if columns > COLUMNS {
            return Err(source.malformed(at, format!("more than {COLUMNS} columns")));
        }
        // Behind the name of an element it is clear which numbers are the position.
        if columns != self.columns && !self.element {
            let detail = format!("{columns} columns, where the first line has {}", self.columns);
            return Err(source.malformed_but(at, detail, "give every line as many columns, x y z first"));
        }
        if columns < 3 + usize::from(self.element) {
            return Err(source.malformed(at, "three numbers expected, fewer found"));
        }
        if self.element && !words().next().is_some_and(is_name) {
            return Err(source.malformed_but(
                at,
                "a number, where the first line has the name of an element",
                "give every line the same columns",
            ));
        }
        self.atoms &= words().next().is_some_and(|word| word.bytes().all(|b| b.is_ascii_digit()));
        for word in words().skip(self.element.into()).take(3) {
            each(text::number(source, at, word, "")?);
        }
        if self.commas {
            words().for_each(|word| self.check.field(word));
        }
        Ok(())
    }
}
