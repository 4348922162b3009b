//! The arrays of VTK XML files: text, base64 or raw bytes, plain or in compressed blocks.

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::numbers::{Decoder, Kind};
use super::source::Source;
use super::vtk_xml_blocks::{Blocks, Codec};
use super::{At, ReadError};
use crate::io::quote::quote;

/// Letters that are decoded at a time, a multiple of four.
const PART: usize = 1 << 16;

/// How the file stores its arrays.
#[derive(Default)]
pub(super) struct Encoding<'a> {
    pub(super) big_endian: bool,
    pub(super) wide_header: bool,
    pub(super) compressor: Option<String>,
    pub(super) appended: Option<&'a [u8]>,
    pub(super) appended_base64: bool,
}

pub(super) struct Array<'a> {
    pub(super) at: At,
    pub(super) data_type: String,
    pub(super) format: String,
    pub(super) offset: usize,
    pub(super) count: usize,
    pub(super) text: &'a [u8],
}

impl Array<'_> {
    /// Calls `each` with the array's `count` values; fails if there are more or fewer.
    pub(super) fn values(
        &self,
        source: &Source<'_>,
        encoding: &Encoding<'_>,
        mut each: impl FnMut(f64),
    ) -> Result<(), ReadError> {
        let mut found = 0_u64;
        let most = self.count as u64;
        let mut count = |value: f64| {
            found += 1;
            // More than promised are an error in the end, and not kept.
            if found <= most {
                each(value);
            }
        };
        match self.format.to_ascii_lowercase().as_str() {
            _ if self.count == 0 => return Ok(()),
            "ascii" => {
                for word in self.text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()) {
                    let word = String::from_utf8_lossy(word);
                    count(super::text::number(source, self.at, &word, "")?);
                }
            }
            "binary" if self.text.iter().any(u8::is_ascii_whitespace) => {
                let mut joined: Vec<u8> = source.room(self.text.len() as u64, "an array")?;
                joined.extend(self.text.iter().filter(|b| !b.is_ascii_whitespace()));
                self.decode(source, &joined, true, encoding, &mut count)?;
            }
            "binary" => self.decode(source, self.text, true, encoding, &mut count)?,
            "appended" => {
                let data = encoding.appended.and_then(|data| data.get(self.offset..));
                let data = data.ok_or_else(|| source.malformed(self.at, "appended data missing"))?;
                self.decode(source, data, encoding.appended_base64, encoding, &mut count)?;
            }
            other => return Err(source.malformed(self.at, format!("unknown array format `{}`", quote(other)))),
        }
        if found != most {
            return Err(source.malformed(self.at, format!("{most} values promised, {found} found")));
        }
        Ok(())
    }

    fn decode(
        &self,
        source: &Source<'_>,
        data: &[u8],
        base64: bool,
        encoding: &Encoding<'_>,
        each: &mut dyn FnMut(f64),
    ) -> Result<(), ReadError> {
        let bad = |detail: String| source.malformed(self.at, detail);
        let kind = Kind::named(&self.data_type)
            .ok_or_else(|| bad(format!("unknown array type `{}`", quote(&self.data_type))))?;
        let header = if encoding.wide_header { Kind::U64 } else { Kind::U32 };
        // Sizes above 2^53 are rounded on the way through f64; they are far too large either way.
        let words = |bytes: &[u8]| -> Vec<usize> {
            bytes.chunks_exact(header.size()).map(|word| header.decode(word, encoding.big_endian) as usize).collect()
        };
        let word = header.size();
        // Parts that are decoded from base64 are held beside the file.
        let take = |skip: usize, length: usize| -> Result<Vec<u8>, ReadError> {
            let part = part(data, skip, length, base64).map_err(bad)?;
            let room: Vec<u8> = source.room(part.len() as u64, "an array")?;
            unpack(part, length, base64, room).map_err(bad)
        };
        let mut decoder = Decoder::new(kind, encoding.big_endian);
        match encoding.compressor.as_deref() {
            None | Some("") => {
                let length = words(&take(0, word)?)[0];
                if base64 {
                    // Header and data are encoded together; a part of whole groups of letters is whole bytes.
                    let all = word.saturating_add(length);
                    let (mut skip, mut left) = (word, all);
                    for letters in part(data, 0, all, true).map_err(bad)?.chunks(PART) {
                        let whole = left.min(letters.len() / 4 * 3);
                        let bytes = unpack(letters, whole, true, Vec::new()).map_err(bad)?;
                        left -= bytes.len();
                        decoder.feed(&bytes[skip.min(bytes.len())..], &mut *each);
                        skip = skip.saturating_sub(bytes.len());
                    }
                } else {
                    decoder.feed(part(data, word, length, false).map_err(bad)?, each);
                }
            }
            Some(name) => {
                let codec = Codec::named(name).ok_or_else(|| {
                    let detail = format!("compressor `{}` is not known", quote(name));
                    source.malformed_but(self.at, detail, "save with zlib, LZ4, LZMA or without compression")
                })?;
                // [blocks][block size][last block's size, 0 if it is full][compressed size of each], then the blocks.
                let head = words(&take(0, 3 * word)?);
                let header_length = head[0].saturating_add(3).saturating_mul(word);
                let sizes = words(&take(0, header_length)?).split_off(3);
                let total = sizes.iter().fold(0_usize, |sum, size| sum.saturating_add(*size));
                let held;
                let mut rest = match base64 {
                    true => {
                        held = take(header_length, total)?;
                        &held[..]
                    }
                    false => part(data, header_length, total, false).map_err(bad)?,
                };
                let mut blocks = Blocks::new(codec, source);
                for (i, size) in sizes.iter().enumerate() {
                    let (block, after) = rest.split_at(*size);
                    rest = after;
                    let full = if i + 1 == head[0] && head[2] != 0 { head[2] } else { head[1] };
                    blocks.unpack(i, block, full, |bytes| decoder.feed(bytes, &mut *each))?;
                }
            }
        }
        match decoder.left() {
            0 => Ok(()),
            left => Err(bad(format!("{left} bytes after the last whole value"))),
        }
    }
}

/// The stored form of `length` bytes from after the array's first part of `skip` bytes; each part is encoded on its own.
fn part(data: &[u8], skip: usize, length: usize, base64: bool) -> Result<&[u8], String> {
    let encoded = |bytes: usize| if base64 { bytes.div_ceil(3).saturating_mul(4) } else { bytes };
    let (start, end) = (encoded(skip), encoded(skip).saturating_add(encoded(length)));
    data.get(start..end).ok_or_else(|| format!("{length} bytes of data promised, the array is shorter"))
}

/// The `length` bytes that `part` stands for, in `bytes`, which are empty.
fn unpack(part: &[u8], length: usize, base64: bool, mut bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    if !base64 {
        bytes.extend(part);
        return Ok(bytes);
    }
    // A part cut off in the middle of the encoded text ends in bits that do not count.
    let config = GeneralPurposeConfig::new()
        .with_decode_allow_trailing_bits(true)
        .with_decode_padding_mode(DecodePaddingMode::Indifferent);
    let engine = GeneralPurpose::new(&base64::alphabet::STANDARD, config);
    engine.decode_vec(part, &mut bytes).map_err(|error| format!("base64: {error}"))?;
    if bytes.len() < length {
        return Err(format!("{length} bytes of data promised, {} found", bytes.len()));
    }
    bytes.truncate(length);
    Ok(bytes)
}
