//! The blocks into which VTK XML files compress an array: zlib streams, LZ4 blocks or xz streams.

use std::io::{Error, ErrorKind, Read};

use flate2::bufread::ZlibDecoder;
use lzma_rust2::XzReader;

use super::ReadError;
use super::source::Source;
use crate::io::budget::Metered;

/// Bytes that are unpacked at a time, where a block need not be unpacked at once.
const PART: usize = 1 << 16;

/// What a block is packed by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Codec {
    Zlib,
    Lz4,
    Lzma,
}

impl Codec {
    /// By the name of VTK's class.
    pub(super) fn named(name: &str) -> Option<Codec> {
        Some(match name {
            "vtkZLibDataCompressor" => Codec::Zlib,
            "vtkLZ4DataCompressor" => Codec::Lz4,
            "vtkLZMADataCompressor" => Codec::Lzma,
            _ => return None,
        })
    }

    /// What `meniscus info` calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Codec::Zlib => "zlib",
            Codec::Lz4 => "LZ4",
            Codec::Lzma => "LZMA",
        }
    }

    /// Beginning with a block takes about as long as unpacking so many bytes.
    fn begin(self) -> u64 {
        match self {
            Codec::Zlib | Codec::Lz4 => 4096,
            // Its tables of probabilities, and the pages of its dictionary.
            Codec::Lzma => 16384,
        }
    }
}

/// Unpacks one block after the other.
pub(super) struct Blocks<'a> {
    codec: Codec,
    source: &'a Source<'a>,
    zlib: ZlibDecoder<&'a [u8]>,
    buffer: Vec<u8>,
}

impl<'a> Blocks<'a> {
    pub(super) fn new(codec: Codec, source: &'a Source<'a>) -> Blocks<'a> {
        Blocks { codec, source, zlib: ZlibDecoder::new(&[][..]), buffer: vec![0; PART] }
    }

    /// Gives `each` what block number `index` holds, `full` bytes or an error.
    pub(super) fn unpack(
        &mut self,
        index: usize,
        block: &'a [u8],
        full: usize,
        mut each: impl FnMut(&[u8]),
    ) -> Result<(), ReadError> {
        let (source, ledger) = (self.source, self.source.ledger);
        let broken = |error: Error| match error.kind() {
            ErrorKind::OutOfMemory => source.no_room("an LZMA dictionary"),
            _ => source.broken(&format!("compressed block {index}"), error),
        };
        source.unpack(self.codec.begin(), WHAT)?;
        let unpacked = match self.codec {
            Codec::Zlib => {
                self.zlib.reset(block);
                pump(Metered { inner: &mut self.zlib, ledger, what: WHAT }, full, &mut self.buffer, &mut each)
            }
            // Its dictionary has whatever size the block says.
            Codec::Lzma => {
                let most = u32::try_from(ledger.left() / 1024).unwrap_or(u32::MAX - 1);
                let inner = XzReader::new_mem_limit(block, false, most);
                pump(Metered { inner, ledger, what: WHAT }, full, &mut self.buffer, &mut each)
            }
            Codec::Lz4 => {
                source.unpack(full as u64, WHAT)?;
                if full > self.buffer.len() {
                    self.buffer = source.room(full as u64, WHAT)?;
                    self.buffer.resize(full, 0);
                }
                let unpacked = lz4_flex::block::decompress_into(block, &mut self.buffer[..full]);
                unpacked.map_err(Error::other).inspect(|length| each(&self.buffer[..*length]))
            }
        }
        .map_err(broken)?;
        if unpacked == full {
            return Ok(());
        }
        let found = if unpacked > full { "more".into() } else { format!("{unpacked} bytes") };
        Err(source.malformed(super::At::Unknown, format!("compressed block {index} has {found}, {full} promised")))
    }
}

const WHAT: &str = "unpacked blocks";

/// Reads the stream to its end, where its checksum is, but not far beyond `full` bytes; how many there were.
fn pump(stream: impl Read, full: usize, buffer: &mut [u8], each: &mut impl FnMut(&[u8])) -> Result<usize, Error> {
    let (mut stream, mut unpacked) = (stream.take((full as u64).saturating_add(1)), 0);
    loop {
        let length = stream.read(buffer)?;
        if length == 0 {
            return Ok(unpacked);
        }
        each(&buffer[..length]);
        unpacked += length;
    }
}
