//! Reads particle files: positions and the few arrays a renderer can use beside them.
//!
//! The format follows from the file's extension (see [`FORMATS`]). Every failure, a truncated or corrupt file included, is a
//! [`ReadError`] that names the file, the place where that is known, and what to do about it.

mod bgeo;
mod numpy;
mod ply;
mod text;
mod vtk;
mod vtk_xml;

use std::fmt;
use std::io::ErrorKind;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use glam::{DMat3, DVec3};

/// The known extensions, lower case and without dot, each with what is read from it.
pub const FORMATS: &[(&str, &str)] = &[
    ("vtk", "legacy VTK, ASCII or binary: any data set with POINTS; point array `class`"),
    ("vtu", "VTK XML unstructured grid, inline or appended, plain or zlib; point array `class`"),
    ("vtp", "VTK XML poly data, as .vtu"),
    ("ply", "PLY, ASCII or binary: element `vertex` with x, y, z; property `class`"),
    ("bgeo", "Houdini/Partio BGEO version 5, plain or gzip; attribute `class`"),
    ("xyz", "raw little-endian float32 triples, or text columns x y z"),
    ("csv", "columns x, y, z by header, or the first three; columns `class`, `radius`"),
    ("npy", "NumPy array N x 3"),
    ("npz", "NumPy archive: `position` N x 3; `radius`, `support`, `class`, `axes` N x 3 x 3"),
];

/// What a particle file held. Lengths are in the file's own units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParticleFile {
    /// Particle centres. They may be non-finite: see [`check_finite`].
    pub positions: Vec<DVec3>,
    /// Particle radius; the median where the file gives one for each particle.
    pub radius: Option<f64>,
    /// Radius of the smoothing kernel's support.
    pub support: Option<f64>,
    /// For each particle 0 (splash) or 1 (body).
    pub classes: Option<Vec<u8>>,
    /// For each particle its anisotropic kernel: the columns are the semi-axis vectors (the *rows* of the file's `axes`).
    pub axes: Option<Vec<DMat3>>,
}

/// What [`check_finite`] does with positions that are infinite or not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invalid {
    /// Fail with [`ReadError::NonFinite`].
    Reject,
    /// Remove these particles.
    Drop,
}

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
    #[error("{}: no such file; check the path", path.display())]
    NotFound { path: PathBuf },
    /// The path is a directory.
    #[error("{}: is a directory; name one particle file in it", path.display())]
    IsDirectory { path: PathBuf },
    /// The system does not let it be read.
    #[error("{}: cannot be read ({source}); check its permissions", path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    /// It has no bytes at all.
    #[error("{}: is empty (0 bytes); write it again", path.display())]
    Empty { path: PathBuf },
    /// Its extension is none of [`FORMATS`].
    #[error("{}: unknown extension `{extension}`; convert to, or rename to the true one of: {}", path.display(), known_extensions())]
    UnknownExtension { path: PathBuf, extension: String },
    /// It is truncated, corrupt, or not what its extension says.
    #[error("{}{at}: {detail}; {remedy}", path.display())]
    Malformed { path: PathBuf, at: At, detail: String, remedy: &'static str },
    /// It is valid, but without the array, columns or element that positions are read from.
    #[error("{}: holds no positions: {wanted}, found {found}; rename or export them", path.display())]
    NoPositions { path: PathBuf, wanted: &'static str, found: String },
    /// An array has dimensions or a type that cannot be used.
    #[error("{}: `{array}` is {found}, expected {expected}; reshape or convert it", path.display())]
    WrongShape { path: PathBuf, array: String, found: String, expected: &'static str },
    /// An array has not one entry for each particle.
    #[error("{}: `{array}` has {found} entries for {expected} particles; export all arrays from the same frame", path.display())]
    UnequalLengths { path: PathBuf, array: String, found: usize, expected: usize },
    /// Positions are infinite or not a number.
    #[error("{}: {count} of {total} positions are not finite, the first at index {first}; `--drop-invalid` leaves them out", path.display())]
    NonFinite { path: PathBuf, first: usize, count: usize, total: usize },
}

fn known_extensions() -> String {
    FORMATS.iter().map(|(extension, _)| *extension).collect::<Vec<_>>().join(", ")
}

/// Reads the particle file at `path`, in the format its extension (in either case) says.
///
/// A valid file without particles gives empty positions. Non-finite positions pass: call [`check_finite`] next.
///
/// # Errors
/// Any [`ReadError`] but [`ReadError::NonFinite`]. Panics inside the parsers become [`ReadError::Malformed`] (in programs
/// that unwind). To keep those quiet the process's panic hook is replaced during the call, and put back after it; so reads
/// from several threads take turns.
pub fn read(path: &Path) -> Result<ParticleFile, ReadError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let reader = match extension.as_str() {
        "vtk" => vtk::read,
        "vtu" | "vtp" => vtk_xml::read,
        "ply" => ply::read,
        "bgeo" => bgeo::read,
        "xyz" => text::read_xyz,
        "csv" => text::read_csv,
        "npy" => numpy::read_npy,
        "npz" => numpy::read_npz,
        _ if path.is_dir() => return Err(ReadError::IsDirectory { path: path.into() }),
        _ if !path.exists() => return Err(ReadError::NotFound { path: path.into() }),
        _ => {
            return Err(ReadError::UnknownExtension { path: path.into(), extension });
        }
    };
    let bytes = std::fs::read(path).map_err(|source| match source.kind() {
        ErrorKind::NotFound => ReadError::NotFound { path: path.into() },
        _ if path.is_dir() => ReadError::IsDirectory { path: path.into() },
        _ => ReadError::Unreadable { path: path.into(), source },
    })?;
    if bytes.is_empty() {
        return Err(ReadError::Empty { path: path.into() });
    }
    let source = Source { path, bytes: &bytes };
    let file = quietly(|| reader(&source))
        .unwrap_or_else(|panic| Err(source.malformed(At::Unknown, format!("its reader gave up ({panic})"))))?;
    let lengths = [("class", file.classes.as_ref().map(Vec::len)), ("axes", file.axes.as_ref().map(Vec::len))];
    for (array, length) in lengths {
        if let Some(found) = length.filter(|length| *length != file.positions.len()) {
            return Err(ReadError::UnequalLengths {
                path: path.into(),
                array: array.into(),
                found,
                expected: file.positions.len(),
            });
        }
    }
    Ok(file)
}

/// Applies `policy` to the positions of `file` that are infinite or not a number; returns how many particles were dropped.
///
/// # Errors
/// [`ReadError::NonFinite`] under [`Invalid::Reject`], with `path` in its message.
pub fn check_finite(file: &mut ParticleFile, policy: Invalid, path: &Path) -> Result<usize, ReadError> {
    let keep: Vec<bool> = file.positions.iter().map(|p| p.is_finite()).collect();
    let Some(first) = keep.iter().position(|keep| !keep) else {
        return Ok(0);
    };
    let count = keep.iter().filter(|keep| !**keep).count();
    if policy == Invalid::Reject {
        return Err(ReadError::NonFinite { path: path.into(), first, count, total: keep.len() });
    }
    fn compact<T>(values: &mut Vec<T>, keep: &[bool]) {
        let mut keep = keep.iter();
        values.retain(|_| keep.next().copied().unwrap_or(false));
    }
    compact(&mut file.positions, &keep);
    file.classes.iter_mut().for_each(|classes| compact(classes, &keep));
    file.axes.iter_mut().for_each(|axes| compact(axes, &keep));
    Ok(count)
}

/// A file's content and, for error messages, its path.
struct Source<'a> {
    path: &'a Path,
    bytes: &'a [u8],
}

impl Source<'_> {
    fn malformed(&self, at: At, detail: impl Into<String>) -> ReadError {
        self.malformed_but(at, detail, "it may be truncated or corrupt: copy or export it again")
    }

    fn malformed_but(&self, at: At, detail: impl Into<String>, remedy: &'static str) -> ReadError {
        // Foreign messages quote what they could not parse: keep to one line without control characters.
        let detail: String = detail.into();
        let line = detail.split_whitespace().collect::<Vec<_>>().join(" ");
        ReadError::Malformed {
            path: self.path.into(),
            at,
            detail: line.chars().filter(|c| !c.is_control()).take(300).collect(),
            remedy,
        }
    }

    fn no_positions(&self, wanted: &'static str, found: impl Into<String>) -> ReadError {
        ReadError::NoPositions { path: self.path.into(), wanted, found: found.into() }
    }

    fn wrong_shape(&self, array: &str, found: impl Into<String>, expected: &'static str) -> ReadError {
        ReadError::WrongShape { path: self.path.into(), array: array.into(), found: found.into(), expected }
    }

    /// Checks the values of an array named `class`, which in a foreign file could mean anything.
    fn classes(&self, values: &[f64]) -> Result<Vec<u8>, ReadError> {
        if let Some(i) = values.iter().position(|v| *v != 0.0 && *v != 1.0) {
            let detail = format!("`class` is {} at index {i}, and only 0 (splash) and 1 (body) are known", values[i]);
            return Err(self.malformed_but(At::Unknown, detail, "rename the array if it means something else"));
        }
        Ok(values.iter().map(|v| *v as u8).collect())
    }

    /// The length an array or column named `name` stands for: its median; `None` if it is empty.
    fn length(&self, name: &str, mut values: Vec<f64>) -> Result<Option<f64>, ReadError> {
        if let Some(bad) = values.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
            return Err(self.malformed_but(
                At::Unknown,
                format!("`{name}` is {bad}"),
                "it must be positive: correct or remove it",
            ));
        }
        values.sort_by(f64::total_cmp);
        Ok(values.get(values.len() / 2).copied())
    }
}

/// Groups a flat list of coordinates; a rest shorter than three is left out.
fn points(values: &[f64]) -> Vec<DVec3> {
    values.as_chunks().0.iter().copied().map(DVec3::from_array).collect()
}

/// Decodes packed numbers of the type `name` as VTK calls it, in XML or legacy files; `None` for an unknown type.
fn numbers(bytes: &[u8], name: &str, big_endian: bool) -> Option<Vec<f64>> {
    macro_rules! decode {
        ($t:ty) => {
            bytes
                .as_chunks()
                .0
                .iter()
                .map(|c| if big_endian { <$t>::from_be_bytes(*c) } else { <$t>::from_le_bytes(*c) } as f64)
                .collect()
        };
    }
    Some(match name {
        "Float32" | "float" => decode!(f32),
        "Float64" | "double" => decode!(f64),
        "Int8" => decode!(i8),
        "UInt8" => decode!(u8),
        "Int16" => decode!(i16),
        "UInt16" => decode!(u16),
        "Int32" => decode!(i32),
        "UInt32" => decode!(u32),
        "Int64" => decode!(i64),
        "UInt64" => decode!(u64),
        _ => return None,
    })
}

fn find(haystack: &[u8], needle: &[u8]) -> Option<usize> {
    haystack.windows(needle.len()).position(|window| window == needle)
}

/// Calls `f`; a panic in it is not printed, and its message returned.
fn quietly<T>(f: impl FnOnce() -> T) -> Result<T, String> {
    type Hook = Arc<dyn Fn(&PanicHookInfo<'_>) + Sync + Send>;
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _lock = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let (before, here): (Hook, _) = (take_hook().into(), std::thread::current().id());
    let during = before.clone();
    set_hook(Box::new(move |info| {
        if std::thread::current().id() != here {
            during(info);
        }
    }));
    let result = catch_unwind(AssertUnwindSafe(f));
    set_hook(Box::new(move |info| before(info)));
    result.map_err(|panic| match panic.downcast::<String>() {
        Ok(message) => *message,
        Err(panic) => panic.downcast_ref::<&str>().unwrap_or(&"no message").to_string(),
    })
}
