//! Why a particle file could not be read.

use std::fmt;
use std::path::PathBuf;

use super::FORMATS;
use crate::io::budget::OverBudget;
use crate::io::quote;

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum At {
    /// Not known.
    Unknown,
    /// Line, counted from 1.
    Line(u64),
    /// Byte offset, counted from 0.
    Byte(u64),
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            At::Unknown => Ok(()),
            At::Line(line) => write!(f, ", line {line}"),
            At::Byte(byte) => write!(f, ", byte {byte}"),
        }
    }
}

/// Why a particle file could not be read.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the fields are what the messages show")]
pub enum ReadError {
    /// There is no such file.
    #[error("{}: no such file; check the path", quote::path(path))]
    NotFound { path: PathBuf },
    /// The path is a directory.
    #[error("{}: is a directory; name one particle file in it", quote::path(path))]
    IsDirectory { path: PathBuf },
    /// The system does not let it be read.
    #[error("{}: cannot be read ({source}); check its permissions", quote::path(path))]
    Unreadable { path: PathBuf, source: std::io::Error },
    /// It has no bytes at all.
    #[error("{}: is empty (0 bytes); write it again", quote::path(path))]
    Empty { path: PathBuf },
    /// Its extension is none of [`FORMATS`].
    #[error(
        "{}: unknown extension `{}`; convert to, or rename to the true one of: {}",
        quote::path(path),
        quote::quote(extension),
        known_extensions()
    )]
    UnknownExtension { path: PathBuf, extension: String },
    /// It is truncated, corrupt, or not what its extension says.
    #[error("{}{at}: {detail}; {remedy}", quote::path(path))]
    Malformed { path: PathBuf, at: At, detail: String, remedy: &'static str },
    /// It is valid, but without the array, columns or element that positions are read from.
    #[error("{}: holds no positions: {wanted}, found {found}; rename or export them", quote::path(path))]
    NoPositions { path: PathBuf, wanted: &'static str, found: String },
    /// An array has dimensions or a type that cannot be used.
    #[error("{}: `{array}` is {found}, expected {expected}; reshape or convert it", quote::path(path))]
    WrongShape { path: PathBuf, array: String, found: String, expected: &'static str },
    /// An array has not one entry for each particle.
    #[error(
        "{}: `{array}` has {found} entries for {expected} particles; export all arrays from the same frame",
        quote::path(path)
    )]
    UnequalLengths { path: PathBuf, array: String, found: usize, expected: usize },
    /// Positions or velocities are infinite or not a number.
    #[error(
        "{}: {count} of {total} particles have a position or velocity that is not finite, the first at index {first}; `--drop-invalid` leaves them out",
        quote::path(path)
    )]
    NonFinite { path: PathBuf, first: usize, count: usize, total: usize },
    /// Reading it takes more memory than its [`Budget`](crate::io::Budget).
    #[error("{}: {source}", quote::path(path))]
    TooLarge { path: PathBuf, source: OverBudget },
    /// A collection has several times, and one picture is of one.
    #[error(
        "{}: holds {count} time steps, from {first} to {last}; take one by `--time`, or render all by `meniscus sequence`",
        quote::path(path)
    )]
    Steps { path: PathBuf, count: usize, first: f64, last: f64 },
    /// A collection has no state at a time: it is before its first or after its last.
    #[error("{}: has no time step for {time}; take a time from {first} to {last}", quote::path(path))]
    NoTime { path: PathBuf, time: f64, first: f64, last: f64 },
    /// A file that a collection names.
    #[error("{}: it names a file that cannot be read: {source}", quote::path(path))]
    Member { path: PathBuf, source: Box<ReadError> },
    /// A parser panicked (in programs that unwind).
    #[error(
        "{}: reading it failed in a way that nobody foresaw; export it again, and report it if other programs read it",
        quote::path(path)
    )]
    Panicked { path: PathBuf, panic: String },
}

fn known_extensions() -> String {
    FORMATS.iter().map(|(extension, _)| *extension).collect::<Vec<_>>().join(", ")
}
