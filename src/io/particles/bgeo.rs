//! BGEO files (`.bgeo`), plain or packed: classic version 5, big-endian, of which points come first and primitives and the rest are not
//! looked at; and what Houdini has written since version 12 (`bgeo_json.rs`, `bgeo_points.rs`).
//!
//! Own code: the one crate that reads BGEO panics on vectors of floats or integers, which Partio writes.

use std::io::{BufReader, Read};

use flate2::bufread::MultiGzDecoder;
use glam::DVec3;

use super::bgeo_json::{Parser, broken};
use super::source::{Input, Source, is_id, is_velocity};
use super::{At, ParticleFile, ReadError, bgeo_points, scf};
use crate::io::budget::Metered;
use crate::io::quote::quote;

/// Words of 4 bytes of x, y, z and the weight, which every point has.
const POSITION: usize = 4;
/// A point's record is at most so long: far more attributes than any writer makes.
const WORDS: usize = 1 << 16;

/// Reads the positions, the integer attribute `class` and velocities.
pub(super) fn read(source: &Source<'_>, mut input: &mut dyn Input) -> Result<ParticleFile, ReadError> {
    let begin = input.fill_buf().map_err(|error| source.broken("reading", error))?;
    if begin.starts_with(&[0x1f, 0x8b]) {
        source.note(|notes| notes.compression = Some("gzip".into()));
        return read_packed(source, MultiGzDecoder::new(input), "the unpacked gzip stream");
    }
    if begin.starts_with(scf::MAGIC) {
        source.note(|notes| notes.compression = Some("Blosc".into()));
        let inner = scf::Unpacked::new(input, source).map_err(|error| broken(source, error))?;
        return read_packed(source, inner, "the unpacked chunks");
    }
    read_points(source, &mut input, Some(source.size))
}

fn read_packed(source: &Source<'_>, inner: impl Read, what: &str) -> Result<ParticleFile, ReadError> {
    let mut stream = BufReader::new(Metered { inner, ledger: source.ledger, what });
    let file = read_points(source, &mut stream, None)?;
    // gzip's checksum is at its end, and so is the index of chunks.
    std::io::copy(&mut stream, &mut std::io::sink()).map_err(|error| broken(source, error))?;
    Ok(file)
}

/// `length` is that of the whole stream, if it is known.
fn read_points(source: &Source<'_>, stream: &mut impl Read, length: Option<u64>) -> Result<ParticleFile, ReadError> {
    let broken = |error: std::io::Error| broken(source, error);
    let begin = take(stream).map_err(broken)?;
    if begin[0] == 0x7f
        && let Some(mut parser) = Parser::new(begin, &mut *stream, source)?
    {
        return bgeo_points::read(source, &mut parser);
    }
    if begin != *b"Bgeo" {
        return Err(source.malformed_but(
            At::Byte(0),
            "geometry by Houdini, or `Bgeo`, expected",
            "export it as .bgeo, as Houdini, Partio and SPlisHSPlasH do",
        ));
    }
    let [version_char] = take(stream).map_err(broken)?;
    let version = int(stream).map_err(broken)?;
    if (version_char, version) != (b'V', 5) {
        let detail = format!("BGEO version {version}, and only 5 is known");
        return Err(source.malformed_but(At::Byte(4), detail, "export it as classic BGEO (version 5)"));
    }
    // Points, primitives, groups of points and of primitives, attributes of points, vertices, primitives, of the whole.
    let mut counts = [0; 8];
    for count in &mut counts {
        *count = int(stream).map_err(broken)?;
    }
    let negative = || source.malformed(At::Byte(9), "a count in the header is negative");
    let points = usize::try_from(counts[0]).map_err(|_| negative())?;
    let attributes = usize::try_from(counts[4]).map_err(|_| negative())?;
    let layout = Layout::read(source, stream, attributes, broken)?;
    let needed = (points as u64) * 4 * layout.words as u64;
    if let Some(length) = length.filter(|length| needed > *length) {
        let detail = format!("the header promises {points} points, {needed} bytes; the file has {length}");
        return Err(source.malformed(At::Byte(9), detail));
    }
    source.note(|notes| notes.format = "BGEO, version 5".into());
    let mut positions = source.room(points as u64, "positions")?;
    let mut ids = source.ids(if layout.id.is_some() { points as u64 } else { 0 })?;
    let mut classes = source.room(if layout.class.is_some() { points as u64 } else { 0 }, "classes")?;
    let mut velocities = source.room(if layout.velocity.is_some() { points as u64 } else { 0 }, "velocities")?;
    let mut record = vec![0; 4 * layout.words];
    for index in 0..points {
        stream.read_exact(&mut record).map_err(broken)?;
        let words = record.as_chunks().0;
        let vector = |at: usize| DVec3::from_array([0, 1, 2].map(|axis| f32::from_be_bytes(words[at + axis]).into()));
        positions.push(vector(0));
        velocities.extend(layout.velocity.map(vector));
        layout.id.iter().for_each(|id| ids.push(i32::from_be_bytes(words[*id]).into()));
        if let Some(class) = layout.class {
            classes.push(source.class(i32::from_be_bytes(words[class]).into(), index)?);
        }
    }
    let (classes, velocities) = (layout.class.map(|_| classes), layout.velocity.map(|_| velocities));
    let ids = layout.id.and_then(|_| ids.finish());
    Ok(ParticleFile { positions, classes, velocities, ids, ..ParticleFile::default() })
}

/// Where a point's record has what.
struct Layout {
    words: usize,
    class: Option<usize>,
    velocity: Option<usize>,
    id: Option<usize>,
}

impl Layout {
    /// Reads the definitions of the points' attributes.
    fn read(
        source: &Source<'_>,
        stream: &mut impl Read,
        attributes: usize,
        broken: impl Fn(std::io::Error) -> ReadError,
    ) -> Result<Layout, ReadError> {
        let mut layout = Layout { words: POSITION, class: None, velocity: None, id: None };
        for _ in 0..attributes {
            let name = text(stream).map_err(&broken)?;
            let size = usize::from(short(stream).map_err(&broken)?);
            let kind = int(stream).map_err(&broken)?;
            match kind {
                // FLOAT, INT and VECTOR of any size have a default value for each component.
                0 | 1 | 5 => skip(stream, 4 * size as u64).map_err(&broken)?,
                // INDEX has the strings that points refer to.
                4 => {
                    for _ in 0..int(stream).map_err(&broken)?.max(0) {
                        let length = short(stream).map_err(&broken)?;
                        skip(stream, length.into()).map_err(&broken)?;
                    }
                }
                _ => {
                    let detail = format!("attribute `{}` has the unknown type {kind}", quote(&name));
                    return Err(source.malformed_but(At::Unknown, detail, "remove the attribute and export again"));
                }
            }
            let known = [(0, "float"), (1, "int"), (4, "string"), (5, "vector")];
            let called = known.iter().find(|(number, _)| *number == kind).map_or("", |(_, name)| name);
            source.note_array(&name, called, size as u64);
            if is_id(&name) && (kind, size) == (1, 1) {
                layout.id.get_or_insert(layout.words);
            }
            if name == "class" {
                if (kind, size) != (1, 1) {
                    return Err(source.wrong_shape(
                        "class",
                        format!("of type {kind} and size {size}"),
                        "one integer (type 1) for each particle",
                    ));
                }
                if layout.class.replace(layout.words).is_some() {
                    return Err(source.malformed(At::Unknown, "attribute `class` is there twice"));
                }
            }
            // FLOAT or VECTOR.
            if is_velocity(&name)
                && size == 3
                && matches!(kind, 0 | 5)
                && layout.velocity.replace(layout.words).is_some()
            {
                return Err(source.second_velocity(At::Unknown, &name));
            }
            layout.words += size;
            if layout.words > WORDS {
                return Err(source.malformed(At::Unknown, format!("a point has more than {WORDS} numbers")));
            }
        }
        Ok(layout)
    }
}

fn take<const N: usize>(stream: &mut impl Read) -> std::io::Result<[u8; N]> {
    let mut bytes = [0; N];
    stream.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn int(stream: &mut impl Read) -> std::io::Result<i32> {
    take(stream).map(i32::from_be_bytes)
}

fn short(stream: &mut impl Read) -> std::io::Result<u16> {
    take(stream).map(u16::from_be_bytes)
}

fn text(stream: &mut impl Read) -> std::io::Result<String> {
    let mut name = vec![0; short(stream)?.into()];
    stream.read_exact(&mut name)?;
    Ok(String::from_utf8_lossy(&name).into_owned())
}

fn skip(stream: &mut impl Read, length: u64) -> std::io::Result<()> {
    match std::io::copy(&mut stream.take(length), &mut std::io::sink())? {
        skipped if skipped == length => Ok(()),
        _ => Err(std::io::ErrorKind::UnexpectedEof.into()),
    }
}
