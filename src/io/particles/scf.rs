//! Houdini's container of packed files (`.sc`): `scf1`, eight bytes, chunks of Blosc, an index by which to seek, `1fcs`. SideFX publish no
//! description; this is what others found.

use std::io::{Error, Read};

use super::blosc::{HEADER, Header};
use super::source::Source;

pub(super) const MAGIC: &[u8; 4] = b"scf1";
const END: &[u8; 4] = b"1fcs";
/// Before the first chunk.
const BEFORE: u64 = 12;

/// Gives what is packed, chunk by chunk.
pub(super) struct Unpacked<'a, R> {
    inner: R,
    source: &'a Source<'a>,
    packed: Vec<u8>,
    full: Vec<u8>,
    given: usize,
    ended: bool,
}

impl<'a, R: Read> Unpacked<'a, R> {
    pub(super) fn new(mut inner: R, source: &'a Source<'a>) -> Result<Self, Error> {
        std::io::copy(&mut (&mut inner).take(BEFORE), &mut std::io::sink())?;
        Ok(Unpacked { inner, source, packed: Vec::new(), full: Vec::new(), given: 0, ended: false })
    }

    /// Unpacks the next chunk, or goes over the index if there is none.
    fn advance(&mut self) -> Result<(), Error> {
        let mut header = Vec::with_capacity(HEADER);
        (&mut self.inner).take(HEADER as u64).read_to_end(&mut header)?;
        let found = <[u8; HEADER]>::try_from(&header[..]).ok().and_then(|bytes| Header::of(&bytes));
        let Some(found) = found else { return self.end(header) };
        for (buffer, length) in [(&self.packed, found.packed), (&self.full, found.full)] {
            let more = length.saturating_sub(buffer.capacity()) as u64;
            self.source.ledger.hold_all(more, 1, "a packed chunk").map_err(Error::other)?;
        }
        self.packed.clear();
        self.packed.append(&mut header);
        (&mut self.inner).take((found.packed - HEADER) as u64).read_to_end(&mut self.packed)?;
        if self.packed.len() < found.packed {
            return Err(Error::other("it ends within a chunk"));
        }
        self.full.resize(found.full, 0);
        self.given = 0;
        found.unpack(&self.packed, &mut self.full)
    }

    fn end(&mut self, mut last: Vec<u8>) -> Result<(), Error> {
        (self.ended, self.given) = (true, self.full.len());
        let mut buffer = [0; 4096];
        loop {
            match self.inner.read(&mut buffer)? {
                0 => break,
                length => last.extend(&buffer[..length]),
            }
            last.drain(..last.len().saturating_sub(END.len()));
        }
        if last.ends_with(END) { Ok(()) } else { Err(Error::other("it ends without its index")) }
    }
}

impl<R: Read> Read for Unpacked<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Error> {
        while self.given == self.full.len() && !self.ended {
            self.advance()?;
        }
        let left = &self.full[self.given..];
        let length = left.len().min(buffer.len());
        buffer[..length].copy_from_slice(&left[..length]);
        self.given += length;
        Ok(length)
    }
}
