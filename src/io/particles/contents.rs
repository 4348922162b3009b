//! What a file has, whether it is read or not: readers note it on their way, where somebody asks.

use std::cell::RefCell;

use crate::io::quote::quote;

/// More arrays than anybody lists.
const ARRAYS: usize = 1000;

/// What a particle file says of itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contents {
    /// The format, with what there is of it: version, encoding, data set.
    pub format: String,
    /// What packs it, or arrays in it.
    pub compression: Option<String>,
    /// Simulated time.
    pub time: Option<f64>,
    /// The number of the simulation's step that was read.
    pub step: Option<u64>,
    /// Steps in the file.
    pub steps: Option<u64>,
    /// Files that a collection names, those of its collections among them.
    pub files: u64,
    /// Arrays, columns or properties of particles; of a collection those of its first file.
    pub arrays: Vec<ArrayInfo>,
}

/// An array of particles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArrayInfo {
    /// As the file calls it; what cannot be printed is escaped.
    pub name: String,
    /// The type of its numbers, as the format calls it; `text` where numbers are written out.
    pub kind: String,
    /// Numbers for each particle.
    pub components: u64,
}

/// Where readers note what they see.
#[derive(Default)]
pub(super) struct Notes {
    wanted: bool,
    contents: RefCell<Contents>,
}

impl Notes {
    /// Somebody asks.
    pub(super) fn wanted() -> Notes {
        Notes { wanted: true, contents: RefCell::default() }
    }

    /// For a file that another names.
    pub(super) fn like(other: &Notes) -> Notes {
        Notes { wanted: other.wanted, contents: RefCell::default() }
    }

    pub(super) fn note(&self, note: impl FnOnce(&mut Contents)) {
        if self.wanted {
            note(&mut self.contents.borrow_mut());
        }
    }

    pub(super) fn array(&self, name: &str, kind: &str, components: u64) {
        self.note(|contents| {
            if contents.arrays.len() < ARRAYS {
                contents.arrays.push(ArrayInfo { name: quote(name), kind: quote(kind), components });
            }
        });
    }

    /// Adds what a file that this one names has.
    pub(super) fn join(&self, inner: Notes) {
        let inner = inner.contents.into_inner();
        self.note(|contents| {
            contents.files += 1 + inner.files;
            contents.compression = contents.compression.take().or(inner.compression);
            contents.time = contents.time.or(inner.time);
            if contents.arrays.is_empty() {
                contents.arrays = inner.arrays;
            }
        });
    }

    pub(super) fn finish(self) -> Contents {
        self.contents.into_inner()
    }
}
