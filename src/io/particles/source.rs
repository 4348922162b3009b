//! A file's content, and what its readers share: errors that name it, room for what it holds, checks of its arrays.

use std::io::{BufRead, Seek};
use std::path::Path;

use glam::DVec3;

use super::contents::{Contents, Notes};
use super::{At, ReadError};
use crate::io::budget::{Ledger, OverBudget};
use crate::io::quote;

/// A message's detail is cut after so many characters.
const DETAIL: usize = 240;

/// What arrays of velocities are called: three components for each particle. Anything else of such a name means something else,
/// and is passed over.
pub(super) fn is_velocity(name: &str) -> bool {
    ["velocity", "Velocity", "velocities", "v", "U"].contains(&name)
}

/// Whether an array of one component with this name has the particles' ids.
pub(super) fn is_id(name: &str) -> bool {
    let name = name.replace(['_', ' '], "").to_ascii_lowercase();
    ["id", "ids", "idp", "particleid", "particleids"].contains(&name.as_str())
}

/// The whole number that `word` is.
pub(super) fn whole(word: &str) -> Option<u64> {
    word.trim().parse().ok().or_else(|| whole_number(word.trim().parse().ok()?))
}

/// `value` as an id: a whole number that doubles tell from its neighbours.
pub(super) fn whole_number(value: f64) -> Option<u64> {
    (value >= 0.0 && value.fract() == 0.0 && value < 9007199254740992.0).then_some(value as u64)
}

/// Ids as they are read. An array of such a name may be something else: then there are none.
pub(super) struct Ids {
    ids: Vec<u64>,
    whole: bool,
}

impl Ids {
    pub(super) fn push(&mut self, value: f64) {
        match whole_number(value) {
            Some(id) if self.whole => self.ids.push(id),
            _ => self.whole = false,
        }
    }

    /// Makes room that was asked for before.
    pub(super) fn reserve(&mut self, count: usize) {
        self.ids.reserve(count);
    }

    pub(super) fn finish(self) -> Option<Vec<u64>> {
        self.whole.then_some(self.ids)
    }
}

/// What is read in parts: a file, or bytes that are held.
pub(super) trait Input: BufRead + Seek {}

impl<T: BufRead + Seek> Input for T {}

/// A file's content, its path for error messages, and what reading it took so far.
pub(super) struct Source<'a> {
    pub(super) path: &'a Path,
    /// None where it is read from a stream.
    pub(super) bytes: &'a [u8],
    /// Bytes of the file, whether or not they are held.
    pub(super) size: u64,
    pub(super) ledger: &'a Ledger,
    pub(super) notes: &'a Notes,
}

impl Source<'_> {
    /// Notes what the file says of itself, where somebody asks.
    pub(super) fn note(&self, note: impl FnOnce(&mut Contents)) {
        self.notes.note(note);
    }

    /// Notes an array of particles.
    pub(super) fn note_array(&self, name: &str, kind: &str, components: u64) {
        self.notes.array(name, kind, components);
    }

    pub(super) fn malformed(&self, at: At, detail: impl AsRef<str>) -> ReadError {
        self.malformed_but(at, detail, "it may be truncated or corrupt: copy or export it again")
    }

    pub(super) fn malformed_but(&self, at: At, detail: impl AsRef<str>, remedy: &'static str) -> ReadError {
        // Foreign messages quote what they could not parse, over several lines.
        let detail = detail.as_ref().split_whitespace().collect::<Vec<_>>().join(" ");
        ReadError::Malformed { path: self.path.into(), at, detail: quote::cut(&detail, DETAIL), remedy }
    }

    /// A failure of reading packed data: corrupt, or more than the budget.
    pub(super) fn broken(&self, what: &str, error: std::io::Error) -> ReadError {
        let over = error.get_ref().and_then(|inner| inner.downcast_ref::<OverBudget>()).cloned();
        match over {
            Some(over) => self.too_large(over),
            None => self.malformed(At::Unknown, format!("{what}: {error}")),
        }
    }

    fn too_large(&self, source: OverBudget) -> ReadError {
        ReadError::TooLarge { path: self.path.into(), source }
    }

    /// For what asks for more than is left without saying how much.
    pub(super) fn no_room(&self, what: &str) -> ReadError {
        match self.ledger.hold_all(self.ledger.left() + 1, 1, what) {
            Err(over) => self.too_large(over),
            Ok(()) => self.malformed(At::Unknown, format!("{what} takes more memory than there can be")),
        }
    }

    pub(super) fn no_positions(&self, wanted: &'static str, found: impl AsRef<str>) -> ReadError {
        ReadError::NoPositions { path: self.path.into(), wanted, found: quote::cut(found.as_ref(), DETAIL) }
    }

    pub(super) fn wrong_shape(&self, array: &str, found: impl AsRef<str>, expected: &'static str) -> ReadError {
        let found = quote::cut(found.as_ref(), DETAIL);
        ReadError::WrongShape { path: self.path.into(), array: quote::quote(array), found, expected }
    }

    /// Counts `count` values of `each` bytes that are to be allocated elsewhere.
    pub(super) fn hold(&self, count: u64, each: usize, what: &str) -> Result<(), ReadError> {
        self.ledger.hold_all(count, each, what).map_err(|over| self.too_large(over))
    }

    /// An empty list with room for `count` values, which are counted before they are allocated.
    pub(super) fn room<T>(&self, count: u64, what: &str) -> Result<Vec<T>, ReadError> {
        self.hold(count, size_of::<T>(), what)?;
        Ok(Vec::with_capacity(count as usize))
    }

    /// Notes work that is as much as unpacking so many bytes.
    pub(super) fn unpack(&self, bytes: u64, what: &str) -> Result<(), ReadError> {
        self.ledger.unpack(bytes, what).map_err(|over| self.too_large(over))
    }

    /// Room for so many ids.
    pub(super) fn ids(&self, count: u64) -> Result<Ids, ReadError> {
        Ok(Ids { ids: self.room(count, "ids")?, whole: true })
    }

    /// Room for so many more positions, read number by number.
    pub(super) fn triples(&self, count: u64) -> Result<Triples, ReadError> {
        Ok(Triples { positions: self.room(count, "positions")?, open: [0.0; 3], filled: 0 })
    }

    /// Two arrays of velocities could be meant.
    pub(super) fn second_velocity(&self, at: At, name: &str) -> ReadError {
        let detail = format!("a second array of velocities, `{}`", quote::quote(name));
        self.malformed_but(at, detail, "remove or rename one of them")
    }

    /// Checks the values of an array named `class`, which in a foreign file could mean anything.
    pub(super) fn class(&self, value: f64, index: usize) -> Result<u8, ReadError> {
        if value != 0.0 && value != 1.0 {
            let detail = format!("`class` is {value} at index {index}, and only 0 (splash) and 1 (body) are known");
            return Err(self.malformed_but(At::Unknown, detail, "rename the array if it means something else"));
        }
        Ok(value as u8)
    }

    /// The length an array or column named `name` stands for: its median; `None` if it is empty.
    pub(super) fn length(&self, name: &str, mut values: Vec<f64>) -> Result<Option<f64>, ReadError> {
        if let Some(bad) = values.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
            return Err(self.malformed_but(
                At::Unknown,
                format!("`{name}` is {bad}"),
                "it must be positive: correct or remove it",
            ));
        }
        if values.is_empty() {
            return Ok(None);
        }
        let middle = values.len() / 2;
        Ok(Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1))
    }
}

/// Positions of which one coordinate comes after the other.
pub(super) struct Triples {
    positions: Vec<DVec3>,
    open: [f64; 3],
    filled: usize,
}

impl Triples {
    pub(super) fn push(&mut self, coordinate: f64) {
        self.open[self.filled] = coordinate;
        self.filled += 1;
        if self.filled == 3 {
            self.positions.push(DVec3::from_array(self.open));
            self.filled = 0;
        }
    }

    /// Makes room that was asked for before.
    pub(super) fn reserve(&mut self, positions: usize) {
        self.positions.reserve(positions);
    }

    /// The whole positions.
    pub(super) fn finish(self) -> Vec<DVec3> {
        self.positions
    }
}

/// Where `needle` begins in `haystack`.
pub(super) fn find(haystack: &[u8], needle: &[u8]) -> Option<usize> {
    haystack.windows(needle.len()).position(|window| window == needle)
}
