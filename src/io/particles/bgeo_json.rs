//! Houdini's JSON in binary, in which it has written `.bgeo` since version 12: values, each after a byte that says its kind, with arrays of
//! numbers of one kind, and strings that are defined once.

use std::collections::HashMap;
use std::io::{Error, ErrorKind, Read};

use exr::prelude::f16;

use super::source::Source;
use super::{At, ReadError};

const NULL: u8 = 0x00;
const MAP: u8 = b'{';
const MAP_END: u8 = b'}';
const ARRAY: u8 = b'[';
const ARRAY_END: u8 = b']';
const BOOL: u8 = 0x10;
const INT8: u8 = 0x11;
const INT16: u8 = 0x12;
const INT32: u8 = 0x13;
const INT64: u8 = 0x14;
const REAL16: u8 = 0x18;
const REAL32: u8 = 0x19;
const REAL64: u8 = 0x1a;
const UINT8: u8 = 0x21;
const UINT16: u8 = 0x22;
const TOKEN: u8 = b'&';
const STRING: u8 = b'\'';
const DEFINE: u8 = b'+';
const UNDEFINE: u8 = b'-';
const FALSE: u8 = b'0';
const TRUE: u8 = b'1';
const UNIFORM: u8 = b'@';

/// Longer strings are cut.
const STRING_BYTES: u64 = 1 << 12;
/// Values within values.
const DEPTH: u32 = 64;
const COMMA: u8 = b',';
const COLON: u8 = b':';

/// Bytes of a number of this kind; none if it is no number.
fn size(kind: u8) -> Option<usize> {
    Some(match kind {
        INT8 | UINT8 => 1,
        INT16 | UINT16 | REAL16 => 2,
        INT32 | REAL32 => 4,
        INT64 | REAL64 => 8,
        _ => return None,
    })
}

fn number(kind: u8, big: bool, bytes: &[u8]) -> f64 {
    let mut little = [0; 8];
    little[..bytes.len()].copy_from_slice(bytes);
    if big {
        little[..bytes.len()].reverse();
    }
    let bits = u64::from_le_bytes(little);
    match kind {
        INT8 => (bits as i8).into(),
        INT16 => (bits as i16).into(),
        INT32 => (bits as i32).into(),
        INT64 => bits as i64 as f64,
        REAL16 => f16::from_bits(bits as u16).to_f64(),
        REAL32 => f32::from_bits(bits as u32).into(),
        REAL64 => f64::from_bits(bits),
        _ => bits as f64,
    }
}

/// Numbers as they are in the file, or one by one.
pub(super) enum Numbers {
    Uniform { kind: u8, big: bool, bytes: Vec<u8> },
    Listed(Vec<f64>),
}

impl Numbers {
    pub(super) fn len(&self) -> usize {
        match self {
            Numbers::Uniform { kind, bytes, .. } => bytes.len() / size(*kind).unwrap_or(1),
            Numbers::Listed(all) => all.len(),
        }
    }

    pub(super) fn get(&self, index: usize) -> f64 {
        match self {
            Numbers::Uniform { kind, big, bytes } => {
                let size = size(*kind).unwrap_or(1);
                number(*kind, *big, &bytes[size * index..size * (index + 1)])
            }
            Numbers::Listed(all) => all[index],
        }
    }
}

/// Reads values one after the other.
pub(super) struct Parser<'a, R> {
    stream: R,
    source: &'a Source<'a>,
    big: bool,
    /// Of a kind that was looked at, and is still to be read.
    ahead: Option<u8>,
    strings: HashMap<u64, String>,
}

impl<'a, R: Read> Parser<'a, R> {
    /// After the four bytes that such files begin with; none if they are others.
    pub(super) fn new(begin: [u8; 4], mut stream: R, source: &'a Source<'a>) -> Result<Option<Self>, ReadError> {
        let mut last = [0];
        stream.read_exact(&mut last).map_err(|error| broken(source, error))?;
        let big = match (&begin, last) {
            (b"\x7fNSJ", [b'b']) => false,
            (b"\x7fbJS", [b'N']) => true,
            _ => return Ok(None),
        };
        Ok(Some(Parser { stream, source, big, ahead: None, strings: HashMap::new() }))
    }

    fn wrong(&self, detail: impl AsRef<str>) -> ReadError {
        self.source.malformed(At::Unknown, detail)
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let mut bytes = [0; N];
        self.stream.read_exact(&mut bytes).map_err(|error| broken(self.source, error))?;
        Ok(bytes)
    }

    /// A number of a kind that takes so many bytes.
    fn number(&mut self, kind: u8, size: usize) -> Result<f64, ReadError> {
        let mut bytes = [0; 8];
        self.stream.read_exact(&mut bytes[..size]).map_err(|error| broken(self.source, error))?;
        Ok(number(kind, self.big, &bytes[..size]))
    }

    fn pass(&mut self, length: u64) -> Result<(), ReadError> {
        match std::io::copy(&mut (&mut self.stream).take(length), &mut std::io::sink()) {
            Ok(passed) if passed == length => Ok(()),
            Ok(_) => Err(broken(self.source, ErrorKind::UnexpectedEof.into())),
            Err(error) => Err(broken(self.source, error)),
        }
    }

    fn length(&mut self) -> Result<u64, ReadError> {
        let [first] = self.bytes()?;
        let (kind, size) = match first {
            0..=0xf0 => return Ok(first.into()),
            0xf2 => (UINT16, 2),
            0xf4 => (INT64, 4),
            0xf8 => (INT64, 8),
            _ => return Err(self.wrong(format!("a length begins with {first:#x}"))),
        };
        let length = self.number(kind, size)?;
        if length < 0.0 { Err(self.wrong("a length is negative")) } else { Ok(length as u64) }
    }

    fn string(&mut self) -> Result<String, ReadError> {
        let length = self.length()?;
        let mut bytes = Vec::new();
        let kept = (&mut self.stream).take(length.min(STRING_BYTES)).read_to_end(&mut bytes);
        let kept = kept.map_err(|error| broken(self.source, error))? as u64;
        self.pass(length - kept)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// The next value's kind; strings that are defined before it are.
    fn kind(&mut self) -> Result<u8, ReadError> {
        if let Some(kind) = self.ahead.take() {
            return Ok(kind);
        }
        loop {
            let [kind] = self.bytes()?;
            match kind {
                DEFINE => {
                    let (id, string) = (self.length()?, self.string()?);
                    self.source.hold(1, 64 + 2 * string.len(), "strings")?;
                    self.strings.insert(id, string);
                }
                UNDEFINE => {
                    let id = self.length()?;
                    self.strings.remove(&id);
                }
                COMMA | COLON => {}
                _ => return Ok(kind),
            }
        }
    }

    /// Whether the array or map ends here.
    fn ends(&mut self, end: u8) -> Result<bool, ReadError> {
        let kind = self.kind()?;
        self.ahead = (kind != end).then_some(kind);
        Ok(kind == end)
    }

    /// A string; nothing if it is another value.
    pub(super) fn text(&mut self) -> Result<Option<String>, ReadError> {
        match self.kind()? {
            STRING => self.string().map(Some),
            TOKEN => {
                let id = self.length()?;
                match self.strings.get(&id) {
                    Some(string) => Ok(Some(string.clone())),
                    None => Err(self.wrong(format!("string {id} was not defined"))),
                }
            }
            kind => self.rest_of(kind, 0).map(|()| None),
        }
    }

    /// A whole number that is not negative; nothing if it is another value.
    pub(super) fn count(&mut self) -> Result<Option<usize>, ReadError> {
        let kind = self.kind()?;
        let Some(size) = size(kind) else { return self.rest_of(kind, 0).map(|()| None) };
        let number = self.number(kind, size)?;
        Ok(super::source::whole_number(number).and_then(|n| usize::try_from(n).ok()))
    }

    /// All elements of an array.
    pub(super) fn elements(
        &mut self,
        mut each: impl FnMut(&mut Self) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        match self.kind()? {
            ARRAY => {}
            kind => return Err(self.wrong(format!("an array expected, found {kind:#x}"))),
        }
        while !self.ends(ARRAY_END)? {
            each(self)?;
        }
        Ok(())
    }

    /// All values of a map, each with its name; mostly they are arrays of names and values in turns.
    pub(super) fn entries(
        &mut self,
        mut each: impl FnMut(&mut Self, &str) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        let end = match self.kind()? {
            ARRAY => ARRAY_END,
            MAP => MAP_END,
            kind => return Err(self.wrong(format!("names and values expected, found {kind:#x}"))),
        };
        while !self.ends(end)? {
            let Some(name) = self.text()? else { return Err(self.wrong("a name expected")) };
            each(self, &name)?;
        }
        Ok(())
    }

    /// An array of numbers, or of such arrays.
    pub(super) fn numbers(&mut self) -> Result<Numbers, ReadError> {
        match self.kind()? {
            UNIFORM => {
                let ([kind], count) = (self.bytes()?, self.length()?);
                let Some(size) = size(kind) else { return Err(self.wrong("numbers expected")) };
                let mut bytes = self.source.room::<u8>(count.saturating_mul(size as u64), "numbers")?;
                let wanted = count * size as u64;
                let read = (&mut self.stream).take(wanted).read_to_end(&mut bytes);
                match read.map_err(|error| broken(self.source, error))? as u64 == wanted {
                    true => Ok(Numbers::Uniform { kind, big: self.big, bytes }),
                    false => Err(broken(self.source, ErrorKind::UnexpectedEof.into())),
                }
            }
            ARRAY => {
                let mut all = Vec::new();
                self.list(&mut all, 0)?;
                Ok(Numbers::Listed(all))
            }
            _ => Err(self.wrong("an array of numbers expected")),
        }
    }

    /// The rest of an array.
    fn list(&mut self, all: &mut Vec<f64>, depth: u32) -> Result<(), ReadError> {
        while !self.ends(ARRAY_END)? {
            match self.kind()? {
                ARRAY if depth == 0 => self.list(all, 1)?,
                UNIFORM if depth == 0 => {
                    self.ahead = Some(UNIFORM);
                    let numbers = self.numbers()?;
                    self.source.hold(numbers.len() as u64, 16, "numbers")?;
                    all.extend((0..numbers.len()).map(|i| numbers.get(i)));
                }
                kind => {
                    let Some(size) = size(kind) else { return Err(self.wrong("a number expected")) };
                    let number = self.number(kind, size)?;
                    self.source.hold(1, 16, "numbers")?;
                    all.push(number);
                }
            }
        }
        Ok(())
    }

    /// An array of truths.
    pub(super) fn flags(&mut self) -> Result<Vec<bool>, ReadError> {
        let mut all = Vec::new();
        match self.kind()? {
            UNIFORM => {
                let ([kind], count) = (self.bytes()?, self.length()?);
                if kind != BOOL {
                    return Err(self.wrong("truths expected"));
                }
                all = self.source.room(count, "truths")?;
                while (all.len() as u64) < count {
                    let bits = self.bytes::<4>()?;
                    let bits = if self.big { u32::from_be_bytes(bits) } else { u32::from_le_bytes(bits) };
                    let left = (count - all.len() as u64).min(32);
                    all.extend((0..left).map(|bit| bits >> bit & 1 == 1));
                }
            }
            ARRAY => {
                while !self.ends(ARRAY_END)? {
                    self.source.hold(1, 2, "truths")?;
                    all.push(match self.kind()? {
                        TRUE => true,
                        FALSE => false,
                        BOOL => self.bytes::<1>()? != [0],
                        _ => return Err(self.wrong("a truth expected")),
                    });
                }
            }
            _ => return Err(self.wrong("truths expected")),
        }
        Ok(all)
    }

    /// Goes over a value.
    pub(super) fn skip(&mut self) -> Result<(), ReadError> {
        let kind = self.kind()?;
        self.rest_of(kind, 0)
    }

    fn rest_of(&mut self, kind: u8, depth: u32) -> Result<(), ReadError> {
        if depth > DEPTH {
            return Err(self.wrong(format!("values in values, more than {DEPTH} deep")));
        }
        match kind {
            NULL | TRUE | FALSE => Ok(()),
            BOOL => self.pass(1),
            STRING => {
                let length = self.length()?;
                self.pass(length)
            }
            TOKEN => self.length().map(|_| ()),
            ARRAY | MAP => {
                while !self.ends(if kind == MAP { MAP_END } else { ARRAY_END })? {
                    let inner = self.kind()?;
                    self.rest_of(inner, depth + 1)?;
                }
                Ok(())
            }
            UNIFORM => {
                let ([kind], count) = (self.bytes()?, self.length()?);
                match (kind, size(kind)) {
                    (_, Some(size)) => self.pass(count.saturating_mul(size as u64)),
                    (BOOL, _) => self.pass(count.div_ceil(32).saturating_mul(4)),
                    (STRING | TOKEN, _) => (0..count).try_for_each(|_| self.rest_of(kind, depth + 1)),
                    _ => Err(self.wrong(format!("an array of the unknown kind {kind:#x}"))),
                }
            }
            kind => match size(kind) {
                Some(size) => self.pass(size as u64),
                None => Err(self.wrong(format!("a value of the unknown kind {kind:#x}"))),
            },
        }
    }
}

/// What reading a stream failed for.
pub(super) fn broken(source: &Source<'_>, error: Error) -> ReadError {
    match error.kind() {
        ErrorKind::UnexpectedEof => source.malformed(At::Unknown, "the file ends within its points"),
        ErrorKind::Unsupported => source.malformed_but(
            At::Unknown,
            format!("a chunk cannot be unpacked: {error}"),
            "save it as .bgeo or .bgeo.gz in Houdini, or by its gconvert",
        ),
        _ => source.broken("unpacking", error),
    }
}
