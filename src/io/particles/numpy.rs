//! NumPy arrays and archives (`.npy`, `.npz`), by npyz.

use std::io::{Cursor, Read};

use glam::{DMat3, DVec3};
use npyz::npz::NpzArchive;
use npyz::{DType, Deserialize, NpyFile, NpyHeader, TypeChar};

use super::{At, ParticleFile, ReadError, Source};

/// Names of the array of positions in an archive, the first that is there counts.
const POSITIONS: [&str; 6] = ["position", "positions", "pos", "center", "centers", "points"];

/// Reads an array N x 3.
pub(super) fn read_npy(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let positions = Array::parse(source, "array", source.bytes)?.positions(source)?;
    Ok(ParticleFile { positions, ..ParticleFile::default() })
}

/// Reads the arrays this crate knows of an archive, compressed or not.
pub(super) fn read_npz(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let broken = |error: std::io::Error| source.malformed(At::Unknown, format!("archive: {error}"));
    let mut archive = NpzArchive::new(Cursor::new(source.bytes)).map_err(broken)?;
    let names: Vec<String> = archive.array_names().map(str::to_owned).collect();
    let mut array = |name: &str| -> Result<Option<Array>, ReadError> {
        if !names.iter().any(|known| known == name) {
            return Ok(None);
        }
        let mut bytes = Vec::new();
        let entry = archive.zip_archive().by_name(&format!("{name}.npy"));
        let read = entry.map_err(std::io::Error::other).and_then(|mut entry| entry.read_to_end(&mut bytes));
        read.map_err(|error| source.malformed(At::Unknown, format!("array `{name}`: {error}")))?;
        Array::parse(source, name, &bytes).map(Some)
    };
    let Some(name) = POSITIONS.iter().find(|name| names.iter().any(|known| known == *name)) else {
        let mut found = names.clone();
        found.sort();
        return Err(source
            .no_positions("an array named `position` or `points` expected", format!("arrays {}", found.join(", "))));
    };
    let positions = array(name)?.map(|array| array.positions(source)).transpose()?.unwrap_or_default();
    let mut length = |name: &str| array(name)?.map_or(Ok(None), |array| source.length(name, array.values));
    let (radius, support) = (length("radius")?, length("support")?);
    let classes = array("class")?.map(|array| array.classes(source)).transpose()?;
    let axes = array("axes")?.map(|array| array.axes(source)).transpose()?;
    Ok(ParticleFile { positions, radius, support, classes, axes })
}

/// An array of numbers of any type and order.
struct Array {
    name: String,
    shape: Vec<usize>,
    /// For each dimension the distance of neighbours in `values`; this is how Fortran order differs.
    strides: Vec<usize>,
    values: Vec<f64>,
}

impl Array {
    fn parse(source: &Source<'_>, name: &str, bytes: &[u8]) -> Result<Self, ReadError> {
        let broken =
            |detail: &dyn std::fmt::Display| source.malformed(At::Unknown, format!("array `{name}`: {detail}"));
        check_header(bytes).map_err(|detail| broken(&detail))?;
        let mut rest = bytes;
        let header = NpyHeader::from_reader(&mut rest).map_err(|error| broken(&error))?;
        let DType::Plain(data_type) = header.dtype() else {
            return Err(source.wrong_shape(name, "of records", "of numbers"));
        };
        let (shape, strides) = (header.shape().to_vec(), header.strides().to_vec());
        let size = shape.iter().try_fold(data_type.size_field(), |size, n| size.checked_mul(*n));
        if size.is_none_or(|size| size > rest.len() as u64) {
            return Err(broken(&format!(
                "shape {shape:?} of `{data_type}` does not fit in the {} bytes of data",
                rest.len()
            )));
        }
        let file = NpyFile::with_header(header, rest);
        let values = match (data_type.type_char(), data_type.size_field()) {
            (TypeChar::Float, 4) => values(file, |v: f32| v.into()),
            (TypeChar::Float, 8) => values(file, |v: f64| v),
            (TypeChar::Int, 1) => values(file, |v: i8| v.into()),
            (TypeChar::Int, 2) => values(file, |v: i16| v.into()),
            (TypeChar::Int, 4) => values(file, |v: i32| v.into()),
            (TypeChar::Int, 8) => values(file, |v: i64| v as f64),
            (TypeChar::Uint, 1) => values(file, |v: u8| v.into()),
            (TypeChar::Uint, 2) => values(file, |v: u16| v.into()),
            (TypeChar::Uint, 4) => values(file, |v: u32| v.into()),
            (TypeChar::Uint, 8) => values(file, |v: u64| v as f64),
            (TypeChar::Bool, _) => values(file, |v: bool| u8::from(v).into()),
            _ => {
                return Err(source.wrong_shape(name, format!("of type `{data_type}`"), "float32, float64 or integers"));
            }
        };
        let to_usize = |values: Vec<u64>| values.into_iter().map(|v| v as usize).collect();
        Ok(Array {
            name: name.into(),
            shape: to_usize(shape),
            strides: to_usize(strides),
            values: values.map_err(|error| broken(&error))?,
        })
    }

    fn wrong_shape(&self, source: &Source<'_>, expected: &'static str) -> ReadError {
        source.wrong_shape(&self.name, format!("of shape {:?}", self.shape), expected)
    }

    fn positions(&self, source: &Source<'_>) -> Result<Vec<DVec3>, ReadError> {
        let ([n, 3], [row, column]) = (&self.shape[..], &self.strides[..]) else {
            return Err(self.wrong_shape(source, "N x 3"));
        };
        let at = |i: usize, j: usize| self.values[i * row + j * column];
        Ok((0..*n).map(|i| DVec3::new(at(i, 0), at(i, 1), at(i, 2))).collect())
    }

    fn classes(&self, source: &Source<'_>) -> Result<Vec<u8>, ReadError> {
        match self.shape[..] {
            [_] | [_, 1] => source.classes(&self.values),
            _ => Err(self.wrong_shape(source, "N integers")),
        }
    }

    fn axes(&self, source: &Source<'_>) -> Result<Vec<DMat3>, ReadError> {
        let ([n, 3, 3], [matrix, row, column]) = (&self.shape[..], &self.strides[..]) else {
            return Err(self.wrong_shape(source, "N x 3 x 3"));
        };
        let axis =
            |i: usize, k: usize| DVec3::from_array([0, 1, 2].map(|c| self.values[i * matrix + k * row + c * column]));
        Ok((0..*n).map(|i| DMat3::from_cols(axis(i, 0), axis(i, 1), axis(i, 2))).collect())
    }
}

fn values<T: Deserialize>(file: NpyFile<&[u8]>, to_f64: impl Fn(T) -> f64) -> std::io::Result<Vec<f64>> {
    Ok(file.into_vec::<T>()?.into_iter().map(to_f64).collect())
}

/// npyz allocates what a header says of its own length, and its parser recurses as deep as the brackets in it.
fn check_header(bytes: &[u8]) -> Result<(), String> {
    let text = match bytes {
        [0x93, b'N', b'U', b'M', b'P', b'Y', 1, _, a, b, text @ ..] => text.get(..u16::from_le_bytes([*a, *b]).into()),
        [0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, _, a, b, c, d, text @ ..] => {
            text.get(..u32::from_le_bytes([*a, *b, *c, *d]) as usize)
        }
        _ => return Err("not a NumPy array of format 1 to 3".into()),
    };
    let text = text.ok_or("the header is cut off")?;
    match text.iter().filter(|b| b"([{-+".contains(b)).count() {
        0..=64 => Ok(()),
        _ => Err("the header is nested too deep".into()),
    }
}
