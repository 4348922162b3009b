//! VTK XML files (`.vtu`, `.vtp`).
//!
//! vtkio knows them too, but not raw appended data, nor empty arrays (it panics on them), nor blocks without a partial last
//! one, and it allocates whatever a corrupt block header says.

use std::io::Read;

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use flate2::bufread::ZlibDecoder;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::{At, ParticleFile, ReadError, Source, find, numbers, points};

/// How the file stores its arrays.
#[derive(Default)]
struct Encoding<'a> {
    big_endian: bool,
    wide_header: bool,
    compressor: Option<String>,
    appended: Option<&'a [u8]>,
    appended_base64: bool,
}

/// Reads the points and point array `class` of all pieces.
pub(super) fn read(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    if !source.bytes.trim_ascii_end().ends_with(b"</VTKFile>") {
        return Err(source.malformed(At::Byte(source.bytes.len() as u64), "the file ends before `</VTKFile>`"));
    }
    // Appended data may be raw bytes, which no XML parser should see.
    let mut encoding = Encoding::default();
    let xml = match find(source.bytes, b"<AppendedData") {
        None => source.bytes,
        Some(at) => {
            let tail = &source.bytes[at..];
            let data = find(tail, b">").and_then(|tag| Some(tag + find(&tail[tag..], b"_")? + 1));
            let data = data.ok_or_else(|| source.malformed(At::Byte(at as u64), "AppendedData without `_`"))?;
            encoding.appended = Some(&tail[data..]);
            encoding.appended_base64 = find(&tail[..data], b"base64").is_some();
            &source.bytes[..at]
        }
    };
    let mut reader = Reader::from_reader(xml);
    let (mut positions, mut classes) = (Vec::new(), Vec::new());
    let (mut section, mut data_set) = (Vec::new(), String::new());
    let (mut piece_points, mut found_points, mut found_classes) = (0_usize, false, false);
    loop {
        let at = At::Byte(reader.buffer_position());
        let event = reader.read_event().map_err(|error| source.malformed(at, format!("XML error: {error}")))?;
        let (tag, empty) = match event {
            Event::Eof => break,
            Event::Start(tag) => (tag, false),
            Event::Empty(tag) => (tag, true),
            Event::End(tag) if tag.name().as_ref() == section => {
                section.clear();
                continue;
            }
            _ => continue,
        };
        let attribute = |name| attribute(source, at, &tag, name);
        match tag.name().as_ref() {
            b"VTKFile" => {
                data_set = attribute("type")?.unwrap_or_default();
                encoding.big_endian = attribute("byte_order")?.as_deref() == Some("BigEndian");
                encoding.wide_header = attribute("header_type")?.as_deref() == Some("UInt64");
                encoding.compressor = attribute("compressor")?;
            }
            b"Piece" => {
                let count = attribute("NumberOfPoints")?.unwrap_or_default();
                piece_points =
                    count.trim().parse().map_err(|_| source.malformed(at, format!("NumberOfPoints is `{count}`")))?;
            }
            name @ (b"Points" | b"PointData") if !empty => section = name.to_vec(),
            b"DataArray" => {
                let of_class = section == b"PointData" && attribute("Name")?.as_deref() == Some("class");
                if !of_class && section != b"Points" {
                    continue;
                }
                let mut text = Vec::new();
                if !empty
                    && let Event::Text(content) =
                        reader.read_event().map_err(|error| source.malformed(at, format!("XML error: {error}")))?
                {
                    text = content.trim_ascii().to_vec();
                }
                let components = if of_class { 1 } else { 3 };
                let stated = attribute("NumberOfComponents")?.unwrap_or_else(|| "1".into());
                if stated.trim() != components.to_string() {
                    let array = if of_class { "class" } else { "Points" };
                    return Err(source.wrong_shape(
                        array,
                        format!("of {stated} components"),
                        if of_class { "1" } else { "3" },
                    ));
                }
                let array = Array {
                    data_type: attribute("type")?.unwrap_or_default(),
                    format: attribute("format")?.unwrap_or_default(),
                    offset: attribute("offset")?.and_then(|offset| offset.trim().parse().ok()).unwrap_or(0),
                    count: piece_points.saturating_mul(components),
                    text,
                };
                let values = array.values(&encoding).map_err(|detail| source.malformed(at, detail))?;
                if of_class {
                    found_classes = true;
                    classes.extend(source.classes(&values)?);
                } else {
                    found_points = true;
                    positions.extend(points(&values));
                }
            }
            _ => {}
        }
    }
    if !found_points {
        return Err(source.no_positions("a DataArray in Points expected", format!("data set `{data_set}` without")));
    }
    Ok(ParticleFile { positions, classes: found_classes.then_some(classes), ..ParticleFile::default() })
}

fn attribute(source: &Source<'_>, at: At, tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, ReadError> {
    let bad = |error: &dyn std::fmt::Display| source.malformed(at, format!("XML error: {error}"));
    let Some(attribute) = tag.try_get_attribute(name).map_err(|error| bad(&error))? else {
        return Ok(None);
    };
    Ok(Some(attribute.unescape_value().map_err(|error| bad(&error))?.into_owned()))
}

struct Array {
    data_type: String,
    format: String,
    offset: usize,
    count: usize,
    text: Vec<u8>,
}

impl Array {
    /// The array's `count` values, or what is wrong with it.
    fn values(&self, encoding: &Encoding<'_>) -> Result<Vec<f64>, String> {
        let values = match self.format.to_ascii_lowercase().as_str() {
            _ if self.count == 0 => return Ok(Vec::new()),
            "ascii" => {
                let text = String::from_utf8_lossy(&self.text);
                let words = text.split_ascii_whitespace();
                words
                    .map(|word| word.parse().map_err(|_| format!("number expected, found `{word}`")))
                    .collect::<Result<_, _>>()?
            }
            "binary" => self.decode(&self.text, true, encoding)?,
            "appended" => {
                let data = encoding.appended.and_then(|data| data.get(self.offset..));
                self.decode(data.ok_or("appended data missing")?, encoding.appended_base64, encoding)?
            }
            other => return Err(format!("unknown array format `{other}`")),
        };
        if values.len() != self.count {
            return Err(format!("{} values promised, {} found", self.count, values.len()));
        }
        Ok(values)
    }

    fn decode(&self, data: &[u8], base64: bool, encoding: &Encoding<'_>) -> Result<Vec<f64>, String> {
        let word = if encoding.wide_header { 8 } else { 4 };
        let header_type = if encoding.wide_header { "UInt64" } else { "UInt32" };
        // Sizes above 2^53 are rounded on the way through f64; they are far too large either way.
        let words = |bytes: &[u8]| -> Vec<usize> {
            numbers(bytes, header_type, encoding.big_endian)
                .unwrap_or_default()
                .into_iter()
                .map(|v| v as usize)
                .collect()
        };
        let mut bytes = Vec::new();
        match encoding.compressor.as_deref() {
            None | Some("") => {
                let length = words(&take(data, 0, word, base64)?)[0];
                bytes = take(data, 0, word.saturating_add(length), base64)?.split_off(word);
            }
            Some("vtkZLibDataCompressor") => {
                // [blocks][block size][last block's size, 0 if it is full][compressed size of each], then the blocks.
                let head = words(&take(data, 0, 3 * word, base64)?);
                let header_length = head[0].saturating_add(3).saturating_mul(word);
                let sizes = words(&take(data, 0, header_length, base64)?.split_off(3 * word));
                let total = sizes.iter().fold(0_usize, |sum, size| sum.saturating_add(*size));
                let blocks = take(data, header_length, total, base64)?;
                let mut rest = blocks.as_slice();
                for (i, size) in sizes.iter().enumerate() {
                    let (block, after) = rest.split_at(*size);
                    rest = after;
                    let full = if i + 1 == head[0] && head[2] != 0 { head[2] } else { head[1] };
                    let unpacked = ZlibDecoder::new(block).take(full as u64).read_to_end(&mut bytes);
                    match unpacked {
                        Ok(length) if length == full => {}
                        Ok(length) => {
                            return Err(format!("compressed block {i} has {length} bytes, {full} promised"));
                        }
                        Err(error) => return Err(format!("compressed block {i}: {error}")),
                    }
                }
            }
            Some(other) => {
                return Err(format!("compressor `{other}` is not known, save with zlib or without compression"));
            }
        }
        numbers(&bytes, &self.data_type, encoding.big_endian)
            .ok_or_else(|| format!("unknown array type `{}`", self.data_type))
    }
}

/// `length` bytes of `data` from after its first part of `skip` bytes; in base64 each part is encoded on its own.
fn take(data: &[u8], skip: usize, length: usize, base64: bool) -> Result<Vec<u8>, String> {
    let encoded = |bytes: usize| {
        if base64 { bytes.div_ceil(3).saturating_mul(4) } else { bytes }
    };
    let (start, end) = (encoded(skip), encoded(skip).saturating_add(encoded(length)));
    let part = data.get(start..end).ok_or_else(|| format!("{length} bytes of data promised, the array is shorter"))?;
    if !base64 {
        return Ok(part.to_vec());
    }
    // A part cut off in the middle of the encoded text ends in bits that do not count.
    let config = GeneralPurposeConfig::new()
        .with_decode_allow_trailing_bits(true)
        .with_decode_padding_mode(DecodePaddingMode::Indifferent);
    let mut bytes = GeneralPurpose::new(&base64::alphabet::STANDARD, config)
        .decode(part)
        .map_err(|error| format!("base64: {error}"))?;
    if bytes.len() < length {
        return Err(format!("{length} bytes of data promised, {} found", bytes.len()));
    }
    bytes.truncate(length);
    Ok(bytes)
}
