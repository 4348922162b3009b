//! Reads particle files: positions and the few arrays a renderer can use beside them.
//!
//! The format follows from the file's extension (see [`FORMATS`]). Every failure, a truncated or corrupt file included, is a
//! [`ReadError`] that names the file, the place where that is known, and what to do about it. What could be read in two ways
//! (decimal commas, repeated columns) is refused rather than guessed. What a file may take is bounded: see
//! [`budget`](super::budget).

mod bgeo;
mod bgeo_json;
mod bgeo_points;
mod blosc;
mod collection;
mod contents;
mod csv;
mod error;
mod lammps;
mod numbers;
mod numpy;
mod numpy_header;
mod ply;
mod ply_header;
mod scf;
mod source;
mod text;
mod vtk;
mod vtk_sections;
mod vtk_xml;
mod vtk_xml_blocks;
mod vtk_xml_data;
mod xyz;

use std::fs::File;
use std::io::{BufReader, Cursor, ErrorKind, Read};
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};

use super::budget::{Budget, Ledger, OverBudget};
use super::guard;
pub use collection::{TimeStep, has_steps, time_step, time_steps};
use contents::Notes;
pub use contents::{ArrayInfo, Contents};
pub use error::{At, ReadError};
use source::{Input, Source};

/// The known extensions, lower case and without dot, each with what is read from it.
pub const FORMATS: &[(&str, &str)] = &[
    (
        "vtk",
        "legacy VTK, ASCII or binary: any data set with POINTS; point arrays `class`, `id`, `velocity` (or `v`, `U`)",
    ),
    ("vtu", "VTK XML unstructured grid, inline or appended, plain, zlib, LZ4 or LZMA; point arrays as .vtk"),
    ("vtp", "VTK XML poly data, as .vtu"),
    ("pvtu", "VTK XML in pieces, which are joined; names of .vtu files"),
    ("pvtp", "as .pvtu, of .vtp files"),
    ("vtm", "VTK XML blocks, which are joined; names of files"),
    ("vtpd", "VTK XML partitions, as .vtm"),
    ("vtpc", "collections of these, as .vtm"),
    (
        "pvd",
        "ParaView collection: of one time, whose files are joined; of several, by `--time` or all of them by `meniscus sequence`",
    ),
    ("ply", "PLY, ASCII or binary: element `vertex` with x, y, z; properties `class`, `id`, vx, vy, vz"),
    (
        "bgeo",
        "Houdini's geometry, and version 5, as Partio writes it; plain or gzip (also .bgeo.gz); attributes `class`, `id`, `v` (or `velocity`)",
    ),
    ("bgeo.sc", "as .bgeo, in chunks of Blosc: LZ4, BloscLZ, zlib"),
    ("xyz", "raw little-endian float32 triples, or text columns x y z with decimal points"),
    (
        "csv",
        "columns x, y, z by header, or the first three, with decimal points; columns `class`, `radius`, `id`, vx, vy, vz; \
         as DualSPHysics' PartVTK writes it",
    ),
    (
        "lammpstrj",
        "LAMMPS dump in text: the last time step; x y z, xu yu zu or xs ys zs, `id`, vx vy vz, `radius`, `class`",
    ),
    ("dump", "the same, also as dump.NUMBER"),
    ("npy", "NumPy array N x 3"),
    (
        "npz",
        "NumPy archive: `position` N x 3; `radius`, `support`, `class`, `id`, `velocity` N x 3, `axes` N x 3 x 3 (rows are \
         semi-axes; of splashes, which are balls, they are ignored)",
    ),
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
    /// For each particle its velocity, in the file's units of length a second; as finite as positions are.
    pub velocities: Option<Vec<DVec3>>,
    /// For each particle a number that it keeps from frame to frame: see [`ParticleFile::sort_by_ids`].
    pub ids: Option<Vec<u64>>,
    /// For each particle its anisotropic kernel: the columns are the semi-axis vectors (the *rows* of the file's `axes`).
    /// What is drawn has those of the body; splashes are balls.
    pub axes: Option<Vec<DMat3>>,
}

impl ParticleFile {
    /// Leaves out the particles of which `keep` says so by their index.
    fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        fn compact<T>(values: &mut Vec<T>, keep: &impl Fn(usize) -> bool) {
            let mut indices = 0..;
            values.retain(|_| indices.next().is_some_and(keep));
        }
        compact(&mut self.positions, &keep);
        self.classes.iter_mut().for_each(|classes| compact(classes, &keep));
        self.velocities.iter_mut().for_each(|velocities| compact(velocities, &keep));
        self.ids.iter_mut().for_each(|ids| compact(ids, &keep));
        self.axes.iter_mut().for_each(|axes| compact(axes, &keep));
    }

    /// Puts particles into the order of their ids, so that those of several frames can be followed. Where there are no ids, or
    /// some twice, nothing changes.
    pub fn sort_by_ids(&mut self) {
        let Some(ids) = self.ids.as_ref().filter(|ids| !ids.is_sorted()) else { return };
        let Ok(count) = u32::try_from(ids.len()) else { return };
        let mut order: Vec<u32> = (0..count).collect();
        order.sort_unstable_by_key(|i| ids[*i as usize]);
        if order.windows(2).any(|pair| ids[pair[0] as usize] == ids[pair[1] as usize]) {
            return;
        }
        let mut seen = vec![false; order.len()];
        arrange(&mut self.positions, &order, &mut seen);
        self.classes.iter_mut().for_each(|all| arrange(all, &order, &mut seen));
        self.velocities.iter_mut().for_each(|all| arrange(all, &order, &mut seen));
        self.axes.iter_mut().for_each(|all| arrange(all, &order, &mut seen));
        self.ids.iter_mut().for_each(|all| arrange(all, &order, &mut seen));
    }
}

/// Puts what is at `order[i]` to `i`, in place: along each of the cycles, of which `seen` tells what is done.
fn arrange<T: Copy>(values: &mut [T], order: &[u32], seen: &mut [bool]) {
    seen.fill(false);
    for start in 0..values.len() {
        if seen[start] {
            continue;
        }
        let (first, mut at) = (values[start], start);
        loop {
            seen[at] = true;
            let from = order[at] as usize;
            if from == start {
                values[at] = first;
                break;
            }
            values[at] = values[from];
            at = from;
        }
    }
}

/// What [`check_finite`] does with positions that are infinite or not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invalid {
    /// Fail with [`ReadError::NonFinite`].
    Reject,
    /// Remove these particles.
    Drop,
}

/// Reads the particle file at `path`, in the format its extension (in either case) says, within the default [`Budget`].
///
/// A valid file without particles gives empty positions. Non-finite positions pass: call [`check_finite`] next.
///
/// # Errors
/// Any [`ReadError`] but [`ReadError::NonFinite`]. To keep panics inside parsers quiet the process's panic hook is replaced
/// during the call, and put back after it; so reads from several threads take turns.
pub fn read(path: &Path) -> Result<ParticleFile, ReadError> {
    read_within(path, &Budget::default())
}

/// [`read`] with a cap of your own.
///
/// # Errors
/// As [`read`].
pub fn read_within(path: &Path, budget: &Budget) -> Result<ParticleFile, ReadError> {
    read_noting(path, budget, &Notes::default(), &[])
}

/// [`read_within`], and what the file says of itself.
///
/// # Errors
/// As [`read`].
pub fn describe(path: &Path, budget: &Budget) -> Result<(ParticleFile, Contents), ReadError> {
    let notes = Notes::wanted();
    let file = read_noting(path, budget, &notes, &[])?;
    Ok((file, notes.finish()))
}

/// `above` are the collections that name the file.
fn read_noting(path: &Path, budget: &Budget, notes: &Notes, above: &[PathBuf]) -> Result<ParticleFile, ReadError> {
    let reader = reader(path).map_err(|error| match path.metadata() {
        Ok(metadata) if metadata.is_dir() => ReadError::IsDirectory { path: path.into() },
        Err(source) if source.kind() == ErrorKind::NotFound => ReadError::NotFound { path: path.into() },
        _ => error,
    })?;
    if let Some(Reader::Parts(read)) = reader
        && let Some((file, size)) = regular(path)
    {
        let ledger = Ledger::of_parts(*budget, size);
        let source = Source { path, bytes: &[], size, ledger: &ledger, notes };
        let mut input = BufReader::with_capacity(PART, file);
        return checked(path, quietly(path, || read(&source, &mut input))?);
    }
    read_content(path, &bytes(path, budget)?, budget, notes, above)
}

/// A file that has a length and so can be read in parts; what goes wrong here is said where it is read whole.
fn regular(path: &Path) -> Option<(File, u64)> {
    // A pipe is opened once, where it is read whole: who writes to it would be cut off.
    path.metadata().ok().filter(|metadata| metadata.is_file())?;
    let file = File::open(path).ok()?;
    let size = file.metadata().ok()?.len();
    (size > 0).then_some((file, size))
}

/// A file's content.
fn bytes(path: &Path, budget: &Budget) -> Result<Vec<u8>, ReadError> {
    let missing = |source: std::io::Error| match source.kind() {
        ErrorKind::NotFound => ReadError::NotFound { path: path.into() },
        _ if path.is_dir() => ReadError::IsDirectory { path: path.into() },
        _ => ReadError::Unreadable { path: path.into(), source },
    };
    let file = File::open(path).map_err(missing)?;
    let stated = file.metadata().map_err(missing)?.len();
    let too_large = |source| ReadError::TooLarge { path: path.into(), source };
    Ledger::new(*budget, stated).map_err(too_large)?;
    // Devices and pipes state no size, and may have no end. What is made of their bytes needs room too.
    let most = if stated == 0 { budget.bytes() / 2 } else { budget.bytes() };
    let mut bytes = Vec::with_capacity(stated as usize);
    file.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(missing)?;
    let file = bytes.len() as u64;
    if stated == 0 && file > most {
        let what = "what this pipe or device gives, with positions as large,".into();
        return Err(too_large(OverBudget {
            what,
            needed: 2 * file,
            allowed: budget.allowance(file),
            file,
            budget: *budget,
        }));
    }
    Ok(bytes)
}

/// Reads a particle file's content; `name` gives its format, and stands in messages. What a collection names is read from files.
///
/// # Errors
/// As [`read`], but for those of the file system.
pub fn read_bytes(name: &Path, bytes: &[u8], budget: &Budget) -> Result<ParticleFile, ReadError> {
    read_content(name, bytes, budget, &Notes::default(), &[])
}

fn read_content(
    name: &Path,
    bytes: &[u8],
    budget: &Budget,
    notes: &Notes,
    above: &[PathBuf],
) -> Result<ParticleFile, ReadError> {
    let reader = reader(name)?;
    if bytes.is_empty() {
        return Err(ReadError::Empty { path: name.into() });
    }
    let file = match reader {
        Some(Reader::Whole(read)) => guarded(name, bytes, budget, notes, read)?,
        Some(Reader::Parts(read)) => {
            guarded(name, bytes, budget, notes, |source| read(source, &mut Cursor::new(source.bytes)))?
        }
        None => collection::read(name, bytes, budget, notes, above)?,
    };
    checked(name, file)
}

/// Every array has an entry for each particle.
fn checked(name: &Path, file: ParticleFile) -> Result<ParticleFile, ReadError> {
    let lengths = [
        ("class", file.classes.as_ref().map(Vec::len)),
        ("velocity", file.velocities.as_ref().map(Vec::len)),
        ("id", file.ids.as_ref().map(Vec::len)),
        ("axes", file.axes.as_ref().map(Vec::len)),
    ];
    for (array, length) in lengths {
        if let Some(found) = length.filter(|length| *length != file.positions.len()) {
            return Err(ReadError::UnequalLengths {
                path: name.into(),
                array: array.into(),
                found,
                expected: file.positions.len(),
            });
        }
    }
    Ok(file)
}

/// Arrays N x 3 of an archive.
#[cfg(feature = "study")]
pub(crate) struct Triples {
    /// Those that were asked for; nothing for one that is not there.
    pub(crate) arrays: Vec<Option<Vec<DVec3>>>,
    /// The names of all arrays that are there.
    pub(crate) names: Vec<String>,
}

/// Arrays N x 3 of a NumPy archive's content by their names; for readers of other things than particles, which share their
/// guards.
#[cfg(feature = "study")]
pub(crate) fn read_triples(name: &Path, bytes: &[u8], wanted: &[&str], budget: &Budget) -> Result<Triples, ReadError> {
    guarded(name, bytes, budget, &Notes::default(), |source| numpy::read_triples(source, wanted))
}

/// Refuses a PLY file's content whose header is none or promises more than follows; for readers of meshes.
#[cfg(feature = "study")]
pub(crate) fn check_ply_header(name: &Path, bytes: &[u8], budget: &Budget) -> Result<(), ReadError> {
    guarded(name, bytes, budget, &Notes::default(), ply::check_header)
}

/// Shape and values of a NumPy array's content (.npy) in C order, whatever it is of.
///
/// # Errors
/// As [`read_bytes`].
#[cfg(feature = "study")]
pub fn read_array(name: &Path, bytes: &[u8], budget: &Budget) -> Result<(Vec<u64>, Vec<f64>), ReadError> {
    guarded(name, bytes, budget, &Notes::default(), numpy::read_values)
}

/// What `read` makes of a file's content, within a budget, and without panics.
fn guarded<T>(
    name: &Path,
    bytes: &[u8],
    budget: &Budget,
    notes: &Notes,
    read: impl FnOnce(&Source<'_>) -> Result<T, ReadError>,
) -> Result<T, ReadError> {
    let ledger =
        Ledger::new(*budget, bytes.len() as u64).map_err(|source| ReadError::TooLarge { path: name.into(), source })?;
    let source = Source { path: name, bytes, size: bytes.len() as u64, ledger: &ledger, notes };
    quietly(name, || read(&source))
}

fn quietly<T>(name: &Path, read: impl FnOnce() -> Result<T, ReadError>) -> Result<T, ReadError> {
    guard::quietly(read).unwrap_or_else(|panic| Err(ReadError::Panicked { path: name.into(), panic }))
}

/// Bytes of a file that are held at a time where it is read in parts.
const PART: usize = 1 << 16;

enum Reader {
    /// Of a content that is held.
    Whole(fn(&Source<'_>) -> Result<ParticleFile, ReadError>),
    /// Of one that need not be.
    Parts(fn(&Source<'_>, &mut dyn Input) -> Result<ParticleFile, ReadError>),
}

/// The reader for the extension of `path`; none for collections, which name other files.
fn reader(path: &Path) -> Result<Option<Reader>, ReadError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    // LAMMPS' own example is `dump.*`, and the star becomes the number of the time step.
    let numbered = !extension.is_empty() && extension.bytes().all(|b| b.is_ascii_digit());
    let dump = || path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("dump."));
    Ok(Some(match extension.as_str() {
        _ if collection::known(&extension) => return Ok(None),
        "lammpstrj" | "dump" => Reader::Whole(lammps::read),
        _ if numbered && dump() => Reader::Whole(lammps::read),
        "vtk" => Reader::Whole(vtk::read),
        "vtu" | "vtp" => Reader::Whole(vtk_xml::read),
        "ply" => Reader::Whole(ply::read),
        "bgeo" => Reader::Parts(bgeo::read),
        "sc" | "gz"
            if path.file_stem().is_some_and(|stem| stem.to_string_lossy().to_lowercase().ends_with(".bgeo")) =>
        {
            Reader::Parts(bgeo::read)
        }
        "xyz" => Reader::Parts(xyz::read),
        "csv" => Reader::Whole(csv::read),
        "npy" => Reader::Parts(numpy::read_npy),
        "npz" => Reader::Parts(numpy::read_npz),
        "vtkhdf" => {
            let remedy = "save it as .vtu or .vtp in ParaView, or by VTK (the README has a line for it)";
            let detail = "VTKHDF is not read".into();
            return Err(ReadError::Malformed { path: path.into(), at: At::Unknown, detail, remedy });
        }
        _ => return Err(ReadError::UnknownExtension { path: path.into(), extension }),
    }))
}

/// Applies `policy` to the particles of `file` whose position or velocity is infinite or not a number; returns how many particles were dropped.
///
/// # Errors
/// [`ReadError::NonFinite`] under [`Invalid::Reject`], with `path` in its message.
pub fn check_finite(file: &mut ParticleFile, policy: Invalid, path: &Path) -> Result<usize, ReadError> {
    let moves = |i: usize| file.velocities.as_ref().and_then(|v| v.get(i)).is_none_or(|v| v.is_finite());
    let keep: Vec<bool> = file.positions.iter().enumerate().map(|(i, p)| p.is_finite() && moves(i)).collect();
    let Some(first) = keep.iter().position(|keep| !keep) else {
        return Ok(0);
    };
    let count = keep.iter().filter(|keep| !**keep).count();
    if policy == Invalid::Reject {
        return Err(ReadError::NonFinite { path: path.into(), first, count, total: keep.len() });
    }
    file.retain(|index| keep[index]);
    Ok(count)
}
