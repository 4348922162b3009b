//! Chunks of Blosc (version 1): a header, offsets of blocks, and blocks, each packed whole or one byte of all its numbers after the
//! other, after their bytes were shuffled.
//!
//! Own code: the crates that read them bring the C library, and what there is in Rust alone is of Blosc 2.

use std::io::{Error, ErrorKind, Read};

use flate2::bufread::ZlibDecoder;

/// Bytes of a chunk's header.
pub(super) const HEADER: usize = 16;
const SHUFFLED: u8 = 1;
const COPIED: u8 = 2;
const BITS_SHUFFLED: u8 = 4;
const WHOLE: u8 = 16;
/// Numbers of so many bytes at most, and so many of them at least, are packed byte by byte.
const SPLITS: usize = 16;
const LEAST: usize = 128;

/// What a chunk says of itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    flags: u8,
    /// Bytes of a number.
    size: usize,
    /// Bytes of a block when it is unpacked; the last one may have fewer.
    block: usize,
    /// Bytes of the chunk when it is unpacked.
    pub(super) full: usize,
    /// Bytes of the chunk, its header among them.
    pub(super) packed: usize,
}

impl Header {
    /// None where these bytes begin no chunk.
    pub(super) fn of(bytes: &[u8; HEADER]) -> Option<Header> {
        let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]) as usize;
        let header = Header { flags: bytes[2], size: bytes[3].into(), full: word(4), block: word(8), packed: word(12) };
        let known = matches!(bytes[0], 1 | 2) && header.size > 0 && header.full > 0 && header.block > 0;
        (known && header.packed > HEADER).then_some(header)
    }

    /// Unpacks a chunk, its header among its bytes, into as many bytes as it says.
    pub(super) fn unpack(&self, chunk: &[u8], into: &mut [u8]) -> Result<(), Error> {
        if self.flags & COPIED != 0 {
            into.copy_from_slice(part(chunk, HEADER, into.len())?);
            return Ok(());
        }
        if self.flags & BITS_SHUFFLED != 0 {
            return Err(Error::new(ErrorKind::Unsupported, "its bits are shuffled"));
        }
        let shuffled = self.flags & SHUFFLED != 0 && self.size > 1;
        let mut bytes = vec![0; if shuffled { self.block.min(into.len()) } else { 0 }];
        for (index, block) in into.chunks_mut(self.block).enumerate() {
            let at = word(chunk, HEADER + 4 * index)?;
            if !shuffled {
                self.unpack_block(chunk, at, block)?;
                continue;
            }
            let bytes = &mut bytes[..block.len()];
            self.unpack_block(chunk, at, bytes)?;
            unshuffle(bytes, block, self.size);
        }
        Ok(())
    }

    fn unpack_block(&self, chunk: &[u8], mut at: usize, block: &mut [u8]) -> Result<(), Error> {
        let split = self.flags & WHOLE == 0
            && self.size <= SPLITS
            && self.block / self.size >= LEAST
            && block.len() == self.block;
        let parts = if split { self.size } else { 1 };
        if !block.len().is_multiple_of(parts) {
            return Err(Error::other("a block is of no whole numbers"));
        }
        for into in block.chunks_mut(block.len() / parts) {
            let length = word(chunk, at)?;
            let packed = part(chunk, at + 4, length)?;
            at += 4 + length;
            if length == into.len() {
                into.copy_from_slice(packed);
                continue;
            }
            let unpacked = match self.flags >> 5 {
                0 => blosclz(packed, into),
                1 => {
                    lz4_flex::block::decompress_into(packed, into).ok().filter(|length| *length == into.len()).map(drop)
                }
                3 => ZlibDecoder::new(packed).read_exact(into).ok(),
                codec => {
                    let name = match codec {
                        2 => "Snappy".into(),
                        4 => "Zstandard".into(),
                        _ => format!("compressor {codec}"),
                    };
                    return Err(Error::new(ErrorKind::Unsupported, format!("it is packed by {name}")));
                }
            };
            unpacked.ok_or_else(|| Error::other("a block is corrupt"))?;
        }
        Ok(())
    }
}

fn part(chunk: &[u8], at: usize, length: usize) -> Result<&[u8], Error> {
    let found = at.checked_add(length).and_then(|end| chunk.get(at..end));
    found.ok_or_else(|| Error::other("a block lies outside of its chunk"))
}

fn word(chunk: &[u8], at: usize) -> Result<usize, Error> {
    let word = part(chunk, at, 4)?;
    Ok(u32::from_le_bytes([word[0], word[1], word[2], word[3]]) as usize)
}

/// First all numbers' first bytes, then all their second ones; what is left over as it is.
fn unshuffle(bytes: &[u8], into: &mut [u8], size: usize) {
    let count = into.len() / size;
    for (i, number) in into.chunks_exact_mut(size).enumerate() {
        for (k, byte) in number.iter_mut().enumerate() {
            *byte = bytes[k * count + i];
        }
    }
    into[count * size..].copy_from_slice(&bytes[count * size..]);
}

/// Blosc's own compressor: literals and matches up to 8 KiB back, or 64 KiB more; none if it is not that.
fn blosclz(packed: &[u8], into: &mut [u8]) -> Option<()> {
    let mut packed = packed.iter().copied();
    let mut next = || packed.next().map(usize::from);
    let mut filled = 0;
    let mut control = next()? & 31;
    loop {
        if control < 32 {
            for _ in 0..=control {
                *into.get_mut(filled)? = u8::try_from(next()?).ok()?;
                filled += 1;
            }
        } else {
            let (mut length, high) = ((control >> 5) + 2, (control & 31) << 8);
            if length == 9 {
                loop {
                    let more = next()?;
                    length += more;
                    if more != 255 {
                        break;
                    }
                }
            }
            let low = next()?;
            let far = low == 255 && high == 31 << 8;
            let back = 1 + if far { 8191 + (next()? << 8) + next()? } else { high + low };
            for _ in 0..length {
                *into.get_mut(filled)? = *into.get(filled.checked_sub(back)?)?;
                filled += 1;
            }
        }
        control = match next() {
            Some(control) => control,
            None => return (filled == into.len()).then_some(()),
        };
    }
}
