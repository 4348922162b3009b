//! Legacy VTK files (`.vtk`).
//!
//! vtkio rejects a whole file for parts that do not matter here (a FIELD before POINTS as ParaView writes, ids of type
//! vtkIdType, nan in ASCII); so POINTS are read directly, and vtkio says whether the rest is whole, and reads `class`.

use std::io::Read;

use splashsurf_lib::vtkio::Error;
use splashsurf_lib::vtkio::model::{Attribute, DataSet, IOBuffer, Piece, Vtk};

use super::{At, ParticleFile, ReadError, Source, find, numbers, points};

/// Reads POINTS and, where there is one, the point array `class`.
pub(super) fn read(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let bytes = source.bytes;
    let mut lines =
        bytes.splitn(4, |b| *b == b'\n').map(|line| String::from_utf8_lossy(line).trim().to_ascii_uppercase());
    let (first, kind) = (lines.next().unwrap_or_default(), lines.nth(1).unwrap_or_default());
    if !first.starts_with("# VTK DATAFILE") {
        return Err(source.malformed(At::Line(1), "`# vtk DataFile Version` expected"));
    }
    let ascii = kind == "ASCII";
    if !ascii && kind != "BINARY" {
        return Err(source.malformed(At::Line(3), "`ASCII` or `BINARY` expected"));
    }
    let Some(at) = find(bytes, b"\nPOINTS ").map(|at| at + 1) else {
        let tail = &bytes[find(bytes, b"\nDATASET ").map_or(bytes.len(), |at| at + 9)..];
        let dataset = String::from_utf8_lossy(tail.split(|b| *b == b'\n').next().unwrap_or_default());
        return Err(source.no_positions("POINTS expected", format!("data set `{}` without", dataset.trim())));
    };
    let line_end = bytes[at..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |length| at + length);
    let line = String::from_utf8_lossy(&bytes[at..line_end]);
    let mut words = line.split_ascii_whitespace().skip(1);
    let count: usize = words
        .next()
        .and_then(|word| word.parse().ok())
        .ok_or_else(|| source.malformed(At::Byte(at as u64), "POINTS without a count"))?;
    let data_type = words.next().unwrap_or_default().to_ascii_lowercase();
    let size = match data_type.as_str() {
        "float" => 4,
        "double" => 8,
        _ => {
            return Err(source.wrong_shape("POINTS", format!("of type `{data_type}`"), "float or double"));
        }
    };
    let body = bytes.get(line_end + 1..).unwrap_or_default();
    let wanted = count.saturating_mul(3);
    let values = if ascii {
        ascii_values(source, body, wanted)?
    } else {
        binary_values(body, wanted.saturating_mul(size), &data_type)
    };
    if values.len() != wanted {
        let detail = format!("POINTS promises {count} positions, and the file holds {}", values.len() / 3);
        return Err(source.malformed(At::Byte(at as u64), detail));
    }
    // Binary data that ends early fails as `Complete`; any other failure is something that vtkio does not know.
    if let Err(Error::Parse(kind)) = Vtk::parse_legacy_be(bytes)
        && format!("{kind:?}") == "Complete"
    {
        let at = At::Byte(bytes.len() as u64);
        return Err(source.malformed(at, "the file ends within the data after POINTS"));
    }
    Ok(ParticleFile {
        positions: points(&values),
        classes: classes(source, line_end, &kind)?,
        ..ParticleFile::default()
    })
}

fn binary_values(body: &[u8], length: usize, data_type: &str) -> Vec<f64> {
    // A short body decodes to fewer values, which the caller reports.
    numbers(&body[..length.min(body.len())], data_type, true).unwrap_or_default()
}

fn ascii_values(source: &Source<'_>, body: &[u8], wanted: usize) -> Result<Vec<f64>, ReadError> {
    let words = body.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).take(wanted);
    words
        .map(|word| {
            let text = String::from_utf8_lossy(word);
            let at = At::Byte((word.as_ptr().addr() - source.bytes.as_ptr().addr()) as u64);
            text.parse().map_err(|_| {
                source.malformed(at, format!("number expected in POINTS, found `{}`", text.escape_debug()))
            })
        })
        .collect()
}

/// The array `class` of the point data, if there is one.
fn classes(source: &Source<'_>, after_points: usize, kind: &str) -> Result<Option<Vec<u8>>, ReadError> {
    let rest = &source.bytes[after_points..];
    let named = [&b"SCALARS class "[..], b"\nclass "].iter().any(|name| find(rest, name).is_some());
    let (true, Some(start)) = (named, find(rest, b"\nPOINT_DATA ")) else {
        return Ok(None);
    };
    let header = format!("# vtk DataFile Version 4.1\n-\n{kind}\nDATASET POLYDATA\nPOINTS 0 float\n");
    let vtk = Vtk::parse_legacy_be(header.as_bytes().chain(&rest[start..])).map_err(|error| {
        source.malformed(
            At::Byte((after_points + start) as u64),
            format!("point data with a `class` array that cannot be read ({error})"),
        )
    })?;
    let DataSet::PolyData { pieces, .. } = vtk.data else {
        return Ok(None);
    };
    for piece in pieces {
        let Piece::Inline(piece) = piece else {
            continue;
        };
        for attribute in piece.data.point {
            let arrays: Vec<(String, IOBuffer)> = match attribute {
                Attribute::DataArray(array) => vec![(array.name, array.data)],
                Attribute::Field { data_array, .. } => {
                    data_array.into_iter().map(|array| (array.name, array.data)).collect()
                }
            };
            if let Some(values) =
                arrays.into_iter().find(|(name, _)| name == "class").and_then(|(_, data)| data.cast_into::<f64>())
            {
                return source.classes(&values).map(Some);
            }
        }
    }
    Ok(None)
}
