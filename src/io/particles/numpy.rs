//! NumPy arrays and archives (`.npy`, `.npz`): the archives by npyz.

#[cfg(feature = "study")]
use std::io::Cursor;
use std::io::{Read, Seek, SeekFrom};

use glam::{DMat3, DVec3};
use npyz::npz::NpzArchive;

#[cfg(feature = "study")]
use super::Triples;
use super::numbers::Decoder;
use super::numpy_header::{self, Header};
use super::source::{Input, Source, find};
use super::{At, ParticleFile, ReadError};
use crate::io::budget::Metered;
use crate::io::quote::list;

/// Names of the array of positions in an archive, the first that is there counts.
const POSITIONS: [&str; 6] = ["position", "positions", "pos", "center", "centers", "points"];

/// Bytes of the end of a zip directory without its comment, and of the 64-bit end's locator.
const END: usize = 22;
const LOCATOR: usize = 20;
/// Bytes that are searched for the 64-bit end from where its locator says on.
const SEARCHED: usize = 1 << 20;
/// Bytes that an entry of a zip directory takes at least.
const LEAST_ENTRY: u64 = 46;

/// Bytes that are decoded at a time.
const PART: usize = 1 << 16;

/// Reads an array N x 3.
pub(super) fn read_npy(source: &Source<'_>, mut input: &mut dyn Input) -> Result<ParticleFile, ReadError> {
    source.note(|notes| notes.format = "NumPy array".into());
    let positions = Array::open(source, "array", &mut input)?.positions(source)?;
    let rest = std::io::copy(input, &mut std::io::sink()).map_err(|error| source.broken("array", error))?;
    if rest > 0 {
        let at = At::Byte(source.size.saturating_sub(rest));
        return Err(source.malformed(at, format!("{rest} bytes after the array's end")));
    }
    Ok(ParticleFile { positions, ..ParticleFile::default() })
}

/// Reads the arrays this crate knows of an archive, compressed or not.
pub(super) fn read_npz(source: &Source<'_>, input: &mut dyn Input) -> Result<ParticleFile, ReadError> {
    let (mut archive, names) = open(source, input)?;
    source.note(|notes| notes.format = "NumPy archive".into());
    let Some(position) = POSITIONS.iter().find(|name| names.iter().any(|known| known == *name)) else {
        let found = format!("arrays {}", list(names.iter().map(String::as_str)));
        return Err(source.no_positions("an array named `position` or `points` expected", found));
    };
    let positions = entry(source, &mut archive, &names, position, |array| array.positions(source))?.unwrap_or_default();
    let mut length = |name: &str| match entry(source, &mut archive, &names, name, |array| array.numbers(source))? {
        Some(values) => source.length(name, values),
        None => Ok(None),
    };
    let (radius, support) = (length("radius")?, length("support")?);
    let classes = entry(source, &mut archive, &names, "class", |array| array.classes(source))?;
    let velocities = entry(source, &mut archive, &names, "velocity", |array| array.positions(source))?;
    let axes = entry(source, &mut archive, &names, "axes", |array| array.axes(source))?;
    let ids = entry(source, &mut archive, &names, "id", |array| array.ids(source))?.flatten();
    Ok(ParticleFile { positions, radius, support, classes, velocities, ids, axes })
}

/// The shape and the values of one array, which is in C order.
#[cfg(feature = "study")]
pub(super) fn read_values(source: &Source<'_>) -> Result<(Vec<u64>, Vec<f64>), ReadError> {
    let mut rest = source.bytes;
    let array = Array::open(source, "array", &mut rest)?;
    let shape = array.header.shape.clone();
    if array.header.fortran && shape.len() > 1 {
        return Err(array.wrong_shape(source, "in C order"));
    }
    Ok((shape, array.numbers(source)?))
}

/// An archive, and the names of its arrays.
fn open<R: Read + Seek>(source: &Source<'_>, mut input: R) -> Result<(NpzArchive<R>, Vec<String>), ReadError> {
    let broken = |error: std::io::Error| source.broken("archive", error);
    let promised = promised(source, &mut input).map_err(broken)?;
    if let Some(promised) = promised.filter(|promised| *promised > source.size / LEAST_ENTRY) {
        let detail = format!("archive: it promises {promised} arrays, and is too short for them");
        return Err(source.malformed(At::Unknown, detail));
    }
    let mut archive = NpzArchive::new(input).map_err(broken)?;
    let mut names: Vec<String> = archive.array_names().map(str::to_owned).collect();
    names.sort_unstable();
    let zip = archive.zip_archive();
    if zip.len() != zip.file_names().count() {
        return Err(source.malformed(At::Unknown, "archive: two arrays have the same name"));
    }
    Ok((archive, names))
}

/// Arrays N x 3 of an archive by their names.
#[cfg(feature = "study")]
pub(super) fn read_triples(source: &Source<'_>, wanted: &[&str]) -> Result<Triples, ReadError> {
    let (mut archive, names) = open(source, Cursor::new(source.bytes))?;
    let arrays = wanted.iter().map(|name| entry(source, &mut archive, &names, name, |array| array.positions(source)));
    Ok(Triples { arrays: arrays.collect::<Result<_, _>>()?, names })
}

/// What `read` makes of the array `name`, if the archive has it. Nothing is unpacked that is not decoded at once.
fn entry<T, R: Read + Seek>(
    source: &Source<'_>,
    archive: &mut NpzArchive<R>,
    names: &[String],
    name: &str,
    read: impl FnOnce(Array<'_>) -> Result<T, ReadError>,
) -> Result<Option<T>, ReadError> {
    if !names.iter().any(|known| known == name) {
        return Ok(None);
    }
    let what = format!("array `{name}`");
    let entry = archive.zip_archive().by_name(&format!("{name}.npy"));
    let inner = entry.map_err(|error| source.broken(&what, std::io::Error::other(error)))?;
    if inner.compression() != npyz::zip::CompressionMethod::Stored {
        source.note(|notes| notes.compression = Some("deflate".into()));
    }
    let mut stream = Metered { inner, ledger: source.ledger, what: &what };
    let value = read(Array::open(source, name, &mut stream)?)?;
    // The archive's checksum is looked at where the entry ends.
    match std::io::copy(&mut stream, &mut std::io::sink()) {
        Ok(0) => Ok(Some(value)),
        Ok(rest) => Err(source.malformed(At::Unknown, format!("{what}: {rest} bytes after its end"))),
        Err(error) => Err(source.broken(&what, error)),
    }
}

/// Entries that a 64-bit end of the directory promises. The zip crate allocates for as many; 64 bits can promise too many.
fn promised(source: &Source<'_>, input: &mut (impl Read + Seek)) -> std::io::Result<Option<u64>> {
    let mut from = |at: u64, most: usize| {
        let mut bytes = Vec::new();
        input.seek(SeekFrom::Start(at))?;
        input.take(most as u64).read_to_end(&mut bytes)?;
        Ok::<_, std::io::Error>(bytes)
    };
    // The end of the directory, before a comment; a locator before it, if there is a 64-bit end somewhere before that.
    let tail = LOCATOR + END + usize::from(u16::MAX);
    let bytes = from(source.size.saturating_sub(tail as u64), tail)?;
    let end = bytes.windows(4).rposition(|window| window == b"PK\x05\x06");
    let locator = end.and_then(|end| bytes.get(end.checked_sub(LOCATOR)?..end));
    let nominal = locator.filter(|l| l.starts_with(b"PK\x06\x07")).and_then(|l| l[8..16].try_into().ok());
    let Some(nominal) = nominal.map(u64::from_le_bytes) else { return Ok(None) };
    let bytes = from(nominal, SEARCHED)?;
    let end = find(&bytes, b"PK\x06\x06").and_then(|at| bytes.get(at + 32..at + 40)?.try_into().ok());
    match end {
        Some(end) => Ok(Some(u64::from_le_bytes(end))),
        // There is none, or nobody knows what the zip crate would find.
        None => Err(std::io::Error::other("the end of its directory is not where it says")),
    }
}

/// An array of numbers of any type and order, of which the header is read.
struct Array<'a> {
    name: &'a str,
    header: Header,
    stream: &'a mut dyn Read,
}

impl<'a> Array<'a> {
    fn open(source: &Source<'_>, name: &'a str, stream: &'a mut dyn Read) -> Result<Self, ReadError> {
        let header = numpy_header::read(source, name, stream)?;
        let components = header.shape.iter().skip(1).fold(1_u64, |all, n| all.saturating_mul(*n));
        source.note_array(name, header.kind.name(), components);
        Ok(Array { name, header, stream })
    }

    fn wrong_shape(&self, source: &Source<'_>, expected: &'static str) -> ReadError {
        source.wrong_shape(self.name, format!("of shape {:?}", self.header.shape), expected)
    }

    fn positions(self, source: &Source<'_>) -> Result<Vec<DVec3>, ReadError> {
        let [n, 3] = self.header.shape[..] else {
            return Err(self.wrong_shape(source, "N x 3"));
        };
        let (mut positions, rows) = (self.filled(source, n, DVec3::ZERO)?, n as usize);
        let fortran = self.header.fortran;
        self.read(source, 3 * rows, |i, v| {
            let (row, axis) = if fortran { (i % rows, i / rows) } else { (i / 3, i % 3) };
            positions[row][axis] = v;
            Ok(())
        })?;
        Ok(positions)
    }

    fn classes(self, source: &Source<'_>) -> Result<Vec<u8>, ReadError> {
        let ([n] | [n, 1]) = self.header.shape[..] else {
            return Err(self.wrong_shape(source, "N integers"));
        };
        let mut classes = self.filled(source, n, 0_u8)?;
        self.read(source, n as usize, |i, v| source.class(v, i).map(|class| classes[i] = class))?;
        Ok(classes)
    }

    /// Nothing where they are no whole numbers.
    fn ids(self, source: &Source<'_>) -> Result<Option<Vec<u64>>, ReadError> {
        let ([n] | [n, 1]) = self.header.shape[..] else {
            return Err(self.wrong_shape(source, "N integers"));
        };
        let mut ids = source.ids(n)?;
        self.read(source, n as usize, |_, v| {
            ids.push(v);
            Ok(())
        })?;
        Ok(ids.finish())
    }

    fn axes(self, source: &Source<'_>) -> Result<Vec<DMat3>, ReadError> {
        let [n, 3, 3] = self.header.shape[..] else {
            return Err(self.wrong_shape(source, "N x 3 x 3"));
        };
        let (mut axes, rows) = (self.filled(source, n, DMat3::ZERO)?, n as usize);
        let fortran = self.header.fortran;
        self.read(source, 9 * rows, |i, v| {
            let (matrix, row, column) =
                if fortran { (i % rows, i / rows % 3, i / (3 * rows)) } else { (i / 9, i / 3 % 3, i % 3) };
            // A row of the file's matrix is a column here.
            axes[matrix].col_mut(row)[column] = v;
            Ok(())
        })?;
        Ok(axes)
    }

    /// All values, whatever the shape.
    fn numbers(self, source: &Source<'_>) -> Result<Vec<f64>, ReadError> {
        let n = self.header.shape.iter().try_fold(1_u64, |n, d| n.checked_mul(*d)).unwrap_or(u64::MAX);
        let mut values = self.filled(source, n, 0.0)?;
        self.read(source, n as usize, |i, v| {
            values[i] = v;
            Ok(())
        })?;
        Ok(values)
    }

    /// `n` times `value`, to be overwritten.
    fn filled<T: Clone>(&self, source: &Source<'_>, n: u64, value: T) -> Result<Vec<T>, ReadError> {
        let mut list = source.room(n, &format!("array `{}`", self.name))?;
        list.resize(n as usize, value);
        Ok(list)
    }

    /// Calls `each` with index and value of all `count` values in the order of the file.
    fn read(
        self,
        source: &Source<'_>,
        count: usize,
        mut each: impl FnMut(usize, f64) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        let Array { name, header, stream } = self;
        let mut decoder = Decoder::new(header.kind, header.big_endian);
        let mut stream = stream.take((count * header.kind.size()) as u64);
        let mut part = vec![0; PART];
        let (mut found, mut first_error) = (0, Ok(()));
        loop {
            let length = match stream.read(&mut part) {
                Ok(0) => break,
                Ok(length) => length,
                Err(error) => return Err(source.broken(&format!("array `{name}`"), error)),
            };
            decoder.feed(&part[..length], |value| {
                if first_error.is_ok() {
                    first_error = each(found, value);
                }
                found += 1;
            });
            std::mem::replace(&mut first_error, Ok(()))?;
        }
        if found < count {
            let detail = format!("array `{name}`: {count} values promised, {found} found");
            return Err(source.malformed(At::Unknown, detail));
        }
        Ok(())
    }
}
