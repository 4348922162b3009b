//! BGEO files (`.bgeo`), by splashsurf_lib.

use std::io::Read;

use flate2::bufread::GzDecoder;
use splashsurf_lib::io::bgeo_format::{AttributeStorage, load_bgeo_file};

use super::{At, ParticleFile, ReadError, Source, points};

/// The header before the attribute definitions.
const HEADER: usize = 41;

/// Reads the positions and the integer attribute `class`.
pub(super) fn read(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let unpacked;
    let bytes = if source.bytes.starts_with(&[0x1f, 0x8b]) {
        let mut buffer = Vec::new();
        let result = GzDecoder::new(source.bytes).read_to_end(&mut buffer);
        result.map_err(|error| source.malformed(At::Unknown, format!("gzip: {error}")))?;
        unpacked = buffer;
        &unpacked[..]
    } else {
        source.bytes
    };
    if !bytes.starts_with(b"Bgeo") {
        return Err(source.malformed_but(
            At::Byte(0),
            "`Bgeo` expected",
            "export it as classic BGEO (version 5), as Partio and SPlisHSPlasH do",
        ));
    }
    if promised_size(bytes).is_none_or(|size| size > bytes.len()) {
        return Err(
            source.malformed(At::Unknown, format!("the header promises more than the {} bytes there are", bytes.len()))
        );
    }
    let file = load_bgeo_file(source.path).map_err(|error| source.malformed(At::Unknown, format!("{error:#}")))?;
    let AttributeStorage::Vector(3, coordinates) = &file.positions else {
        return Err(source.wrong_shape("position", "no vector of 3", "a vector of 3"));
    };
    let coordinates: Vec<f64> = coordinates.iter().map(|v| f64::from(*v)).collect();
    let class = file.attribute_data.iter().find(|(name, _)| name == "class");
    let classes = class.map(|(_, storage)| match storage {
        AttributeStorage::Int(values) => source.classes(&values.iter().map(|v| f64::from(*v)).collect::<Vec<_>>()),
        _ => Err(source.wrong_shape("class", "not of integers", "one integer for each particle")),
    });
    Ok(ParticleFile { positions: points(&coordinates), classes: classes.transpose()?, ..ParticleFile::default() })
}

/// The bytes that header and points take at least. splashsurf_lib allocates by the header alone (and panics on a short
/// file), so its sums are done here first. `None` if the attribute definitions run past the end.
fn promised_size(bytes: &[u8]) -> Option<usize> {
    let be = |at: usize, length: usize| {
        Some(bytes.get(at..at.checked_add(length)?)?.iter().fold(0, |v, b| v << 8 | usize::from(*b)))
    };
    // Negative counts come out huge, and so too large.
    let (points, attributes) = (be(9, 4)?, be(25, 4)?);
    // x, y, z and a weight, 4 bytes each.
    let (mut at, mut stride) = (HEADER, 16_usize);
    for _ in 0..attributes {
        let name = be(at, 2)?;
        let size = be(at + 2 + name, 2)?;
        // Name, size, type, and a default value for each component.
        at += 2 + name + 2 + 4 + 4 * size;
        stride += 4 * size;
    }
    points.checked_mul(stride)?.checked_add(at)
}
