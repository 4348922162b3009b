//! Collections of VTK files (`.pvd`, `.vtm`, `.vtpd`, `.vtpc`, `.pvtu`, `.pvtp`): names of files, which are relative to
//! themselves. What they name is read and joined.

use std::path::{Path, PathBuf};

use quick_xml::Reader;
use quick_xml::events::Event;

use super::contents::{Contents, Notes};
use super::source::Source;
use super::vtk_xml::{attribute, xml};
use super::{At, ParticleFile, ReadError, guarded, read_noting};
use crate::io::budget::{Budget, Ledger};
use crate::io::quote::quote;

/// Collections in collections.
const DEPTH: usize = 4;
/// Letters of a file's name.
const NAME: usize = 250;

/// Whether files of this extension name others.
pub(super) fn known(extension: &str) -> bool {
    matches!(extension, "pvd" | "vtm" | "vtpd" | "vtpc" | "pvtu" | "pvtp")
}

/// A file that a collection names.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Member {
    pub(super) file: PathBuf,
    pub(super) time: Option<f64>,
}

/// The files that it names; paths are as they can be opened.
fn members(source: &Source<'_>) -> Result<Vec<Member>, ReadError> {
    if !source.bytes.trim_ascii_end().ends_with(b"</VTKFile>") {
        return Err(source.malformed(At::Byte(source.bytes.len() as u64), "the file ends before `</VTKFile>`"));
    }
    let folder = source.path.parent().unwrap_or(Path::new(""));
    let mut reader = Reader::from_reader(source.bytes);
    let mut members: Vec<Member> = Vec::new();
    loop {
        let at = At::Byte(reader.buffer_position());
        let tag = match reader.read_event().map_err(|error| source.malformed(at, xml(&error)))? {
            Event::Eof => break,
            Event::Start(tag) | Event::Empty(tag) => tag,
            _ => continue,
        };
        let name = match tag.name().as_ref() {
            b"VTKFile" => {
                let kind = attribute(source, at, &tag, "type")?.unwrap_or_default();
                source.note(|notes| notes.format = format!("VTK XML {}", quote(&kind)));
                continue;
            }
            b"DataSet" => "file",
            b"Piece" => "Source",
            _ => continue,
        };
        // Blocks may be empty.
        let Some(file) = attribute(source, at, &tag, name)?.filter(|file| !file.is_empty()) else {
            continue;
        };
        if file.chars().count() > NAME {
            return Err(source.malformed(at, format!("a file's name of more than {NAME} letters")));
        }
        let time = attribute(source, at, &tag, "timestep")?;
        let time = time.map(|time| match time.trim().parse::<f64>() {
            Ok(time) if time.is_finite() => Ok(time),
            _ => Err(source.malformed(at, format!("`timestep` is `{}`, and no time", quote(&time)))),
        });
        source.hold(1, size_of::<Member>() + 4 * file.len(), "names of files")?;
        members.push(Member { file: folder.join(file), time: time.transpose()? });
    }
    if members.is_empty() {
        return Err(source.no_positions("a DataSet or Piece that names a file expected", "none"));
    }
    Ok(members)
}

/// The times of a collection of several, in order, each with its files.
fn steps(members: &[Member]) -> Vec<(f64, Vec<&Path>)> {
    let mut timed: Vec<(f64, &Path)> = members.iter().filter_map(|m| Some((m.time?, m.file.as_path()))).collect();
    // Stable: files of one time stay in their order. -0 and 0 are one time, and none is no number.
    timed.sort_by(|a, b| a.0.partial_cmp(&b.0).unwrap_or(std::cmp::Ordering::Equal));
    timed.chunk_by(|a, b| a.0 == b.0).map(|same| (same[0].0, same.iter().map(|(_, file)| *file).collect())).collect()
}

fn wrong(path: &Path, detail: String, remedy: &'static str) -> ReadError {
    ReadError::Malformed { path: path.into(), at: At::Unknown, detail, remedy }
}

/// Reads what a collection of one time names, and joins it. `above` are the collections that name this one.
pub(super) fn read(
    path: &Path,
    bytes: &[u8],
    budget: &Budget,
    notes: &Notes,
    above: &[PathBuf],
) -> Result<ParticleFile, ReadError> {
    let members = guarded(path, bytes, budget, notes, members)?;
    let steps = steps(&members);
    if let [(first, _), .., (last, _)] = steps[..] {
        let (count, first, last) = (steps.len(), first, last);
        return Err(ReadError::Steps { path: path.into(), count, first, last });
    }
    notes.note(|notes| notes.time = steps.first().map(|(time, _)| *time));
    let files: Vec<PathBuf> = members.into_iter().map(|member| member.file).collect();
    joined(path, &files, budget, notes, above)
}

/// Reads files that a collection names, and joins them.
fn joined(
    path: &Path,
    members: &[PathBuf],
    budget: &Budget,
    notes: &Notes,
    above: &[PathBuf],
) -> Result<ParticleFile, ReadError> {
    let wrong = |detail: String, remedy| wrong(path, detail, remedy);
    let same = |file: &Path| file.canonicalize().unwrap_or_else(|_| file.into());
    let above = [above, &[same(path)]].concat();
    let files: Vec<PathBuf> = members.iter().map(|member| same(member)).collect();
    let mut sorted: Vec<_> = files.iter().collect();
    sorted.sort();
    if let Some(twice) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        let detail = format!("it names `{}` twice", quote(&twice[0].to_string_lossy()));
        return Err(wrong(detail, "remove one of them, or its particles are there twice"));
    }
    if let Some(again) = files.iter().find(|file| above.contains(file)) {
        let detail = format!("it names `{}`, which names it", quote(&again.to_string_lossy()));
        return Err(wrong(detail, "name the files that hold particles"));
    }
    if above.len() > DEPTH {
        return Err(wrong(format!("collections in collections, more than {DEPTH} deep"), "name one of them"));
    }
    let sizes = files.iter().filter_map(|file| file.metadata().ok()).map(|metadata| metadata.len());
    let ledger = Ledger::of_parts(*budget, sizes.fold(0, u64::saturating_add));
    let mut all: Option<ParticleFile> = None;
    for member in members {
        let inner = Notes::like(notes);
        let part = read_noting(member, budget, &inner, &above)
            .map_err(|source| ReadError::Member { path: path.into(), source: Box::new(source) })?;
        notes.join(inner);
        let whole = Joined { path, member, ledger: &ledger };
        all = Some(match all {
            None => whole.first(part)?,
            Some(all) => whole.join(all, part)?,
        });
    }
    Ok(all.unwrap_or_default())
}

/// What joining one more file needs.
struct Joined<'a> {
    path: &'a Path,
    member: &'a Path,
    ledger: &'a Ledger,
}

impl Joined<'_> {
    fn first(&self, part: ParticleFile) -> Result<ParticleFile, ReadError> {
        let each = size_of::<glam::DVec3>() * (1 + usize::from(part.velocities.is_some()))
            + usize::from(part.classes.is_some())
            + size_of::<u64>() * usize::from(part.ids.is_some());
        let held = self.ledger.hold_all(part.positions.len() as u64, each, "the files together");
        held.map_err(|source| ReadError::TooLarge { path: self.path.into(), source })?;
        Ok(part)
    }

    fn join(&self, mut all: ParticleFile, part: ParticleFile) -> Result<ParticleFile, ReadError> {
        // Of processes without particles there may be files without arrays.
        if part.positions.is_empty() {
            return Ok(all);
        }
        let mut part = self.first(part)?;
        if all.positions.is_empty() {
            return Ok(part);
        }
        self.append("class", &mut all.classes, part.classes)?;
        self.append("velocity", &mut all.velocities, part.velocities)?;
        self.append("id", &mut all.ids, part.ids)?;
        all.positions.append(&mut part.positions);
        Ok(all)
    }

    fn append<T>(&self, array: &str, all: &mut Option<Vec<T>>, part: Option<Vec<T>>) -> Result<(), ReadError> {
        match (all, part) {
            (Some(all), Some(mut part)) => all.append(&mut part),
            (None, None) => {}
            (has, _) => {
                let (with, without) =
                    if has.is_some() { ("others have", "has none") } else { ("it has", "others have none") };
                let name = quote(&self.member.to_string_lossy());
                let detail = format!("`{name}` and others cannot be joined: of `{array}` {with} one, and {without}");
                let remedy = "give all of them the same arrays, or name those that belong together";
                return Err(wrong(self.path, detail, remedy));
            }
        }
        Ok(())
    }
}

/// A time of a collection (`.pvd`), and the files that are there at it.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeStep {
    /// The file that says so.
    pub collection: PathBuf,
    /// In the collection's own units, which are mostly simulated seconds.
    pub time: f64,
    /// At least one; several are pieces of one state.
    pub files: Vec<PathBuf>,
}

impl TimeStep {
    /// Reads its files, and joins them.
    ///
    /// # Errors
    /// As [`super::read`].
    pub fn read(&self, budget: &Budget) -> Result<ParticleFile, ReadError> {
        joined(&self.collection, &self.files, budget, &Notes::default(), &[])
    }

    /// [`TimeStep::read`], and what the files say of themselves.
    ///
    /// # Errors
    /// As [`super::read`].
    pub fn describe(&self, budget: &Budget) -> Result<(ParticleFile, Contents), ReadError> {
        let notes = Notes::wanted();
        notes.note(|notes| (notes.format, notes.time) = ("VTK XML Collection".into(), Some(self.time)));
        let file = joined(&self.collection, &self.files, budget, &notes, &[])?;
        Ok((file, notes.finish()))
    }
}

/// The time steps of a collection in order of their times, however its files are called.
///
/// # Errors
/// As [`super::read`], of the collection alone.
pub fn time_steps(path: &Path, budget: &Budget) -> Result<Vec<TimeStep>, ReadError> {
    let bytes = super::bytes(path, budget)?;
    let members = guarded(path, &bytes, budget, &Notes::default(), members)?;
    let own = |(time, files): (f64, Vec<&Path>)| TimeStep {
        collection: path.into(),
        time,
        files: files.into_iter().map(Path::to_owned).collect(),
    };
    Ok(steps(&members).into_iter().map(own).collect())
}

/// The time step of a collection at a time, or the last before it.
///
/// # Errors
/// As [`time_steps`]; [`ReadError::NoTime`] for a time before the first or after the last; [`ReadError::Malformed`] for a file
/// without times.
pub fn time_step(path: &Path, time: f64, budget: &Budget) -> Result<TimeStep, ReadError> {
    let without = |detail: &str| wrong(path, detail.into(), "name it without a time");
    if !has_steps(path) {
        return Err(without("is no collection of time steps (.pvd), of which a time takes one"));
    }
    let mut steps = time_steps(path, budget)?;
    let (Some(first), Some(last)) = (steps.first().map(|s| s.time), steps.last().map(|s| s.time)) else {
        return Err(without("none of its files has a time"));
    };
    // A time is often written with fewer digits than somebody has of it, or with more: so much of a step is none.
    let shortest = steps.windows(2).map(|two| two[1].time - two[0].time).reduce(f64::min);
    let near = shortest.map_or(1e-6 * first.abs(), |shortest| 0.01 * shortest);
    if !(first - near..=last + near).contains(&time) {
        return Err(ReadError::NoTime { path: path.into(), time, first, last });
    }
    let before = steps.partition_point(|step| step.time <= time + near);
    Ok(steps.swap_remove(before.saturating_sub(1)))
}

/// Whether it is a collection whose files have times, by its name.
pub fn has_steps(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("pvd"))
}
