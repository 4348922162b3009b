//! Where outputs go: what can be refused is refused before anything is rendered, and what is written appears whole or not
//! at all.

use crate::{
    temporary::{self, Folder},
    terminal,
};
use same_file::{Handle, is_same_file};
use serde_json::{Value, json};
use std::{
    fs,
    io::{self, ErrorKind, Write},
    path::{Path, PathBuf},
};

/// Why something cannot be written, or was not.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    #[error("{}: cannot be written: {source}. {}", path.display(), remedy(source))]
    Write { path: PathBuf, source: io::Error },
    #[error("{}: there is no folder {}; create it", path.display(), folder.display())]
    NoFolder { path: PathBuf, folder: PathBuf },
    #[error("{}: is a folder; name a file", .0.display())]
    IsFolder(PathBuf),
    #[error("{}: is a link to nothing; name a file, or remove the link", .0.display())]
    DeadLink(PathBuf),
    #[error("{}: is {option} and {other} at once; give each a name of its own", path.display())]
    Clash { path: PathBuf, option: &'static str, other: &'static str },
    #[error(
        "{}: holds {other} ({}), and --dump replaces its folder whole; name another folder", folder.display(), path.display()
    )]
    InsideDump { folder: PathBuf, path: PathBuf, other: &'static str },
    #[error(
        "{}: holds {found}, so it is no dump, and --dump replaces its folder whole; name a new folder", .folder.display()
    )]
    NoDump { folder: PathBuf, found: String },
}

fn remedy(e: &io::Error) -> &'static str {
    match e.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            "Make room there, or write to another disk"
        }
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => "Name a folder that you may write to",
        ErrorKind::InvalidFilename => "Choose a shorter name",
        ErrorKind::NotFound | ErrorKind::NotADirectory => "Create its folder",
        _ => "Name another place",
    }
}

fn failed(path: &Path) -> impl Fn(io::Error) -> OutputError + '_ {
    move |source| OutputError::Write { path: path.into(), source }
}

/// A file that is read or written: what it is for, and its name.
pub type Named<'a> = (&'static str, &'a Path);

/// Refuses outputs that cannot be, before anything is rendered: in folders that are not there, in each other's place, in
/// the place of an input, or in that of a folder with something else in it.
pub fn check(outputs: &[Named], dump: Option<&Path>, inputs: &[Named]) -> Result<(), OutputError> {
    for (_, path) in outputs {
        check_file(path)?;
        if is_stdout(path) {
            terminal::leave_stdout();
        }
    }
    for (i, (option, path)) in outputs.iter().enumerate() {
        for (other, second) in outputs[..i].iter().chain(inputs) {
            if same(path, second)? {
                return Err(OutputError::Clash { path: (*path).into(), option, other });
            }
        }
    }
    let Some(folder) = dump else { return Ok(()) };
    let place = resolve(folder)?;
    let here = ("the current folder", Path::new("."));
    for (other, path) in outputs.iter().chain(inputs).chain([&here]) {
        // An input that is not there has an error message of its own.
        if resolve(path).is_ok_and(|p| p.starts_with(&place)) {
            return Err(OutputError::InsideDump { folder: folder.into(), path: (*path).into(), other });
        }
    }
    check_dump(folder, &place)
}

/// Refuses numbered pictures that cannot be, as [`check`] does: in the place of another file that is read or written.
pub fn check_pictures(pictures: &[PathBuf], others: &[Named]) -> Result<(), OutputError> {
    let mut places = std::collections::HashSet::new();
    for path in pictures {
        check_file(path)?;
        places.insert(resolve(path)?);
    }
    for (other, path) in others {
        // An input that is not there has an error message of its own.
        let Ok(place) = resolve(path) else { continue };
        if places.contains(&place) {
            return Err(OutputError::Clash { path: (*path).into(), option: "one of the pictures (--output)", other });
        }
    }
    Ok(())
}

/// Whether this is the program's own standard output, by its names or as the file that it was sent to.
fn is_stdout(path: &Path) -> bool {
    let names = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];
    names.iter().any(|p| path == Path::new(p))
        || path.is_file() && Handle::from_path(path).is_ok_and(|h| Handle::stdout().is_ok_and(|out| h == out))
}

/// Whether something is written to as it is, because a rename would put a file in its place: pipes, terminals, devices and
/// what someone else has opened.
fn special(path: &Path) -> bool {
    let opened = ["/dev/stderr", "/dev/fd", "/proc"].iter().any(|p| path.starts_with(p));
    opened || is_stdout(path) || !plain(path)
}

/// Whether this is a file, or nothing yet.
fn plain(path: &Path) -> bool {
    fs::metadata(path).map_or(true, |m| m.is_file() || m.is_dir())
}

fn check_file(path: &Path) -> Result<(), OutputError> {
    if path.is_dir() {
        return Err(OutputError::IsFolder(path.into()));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(OutputError::NoFolder { path: path.into(), folder: folder.into() });
    }
    if special(path) { Ok(()) } else { resolve(path).map(|_| ()) }
}

/// Whether two names are of one file, by whatever links; pipes and devices can be named twice.
fn same(a: &Path, b: &Path) -> Result<bool, OutputError> {
    if !plain(a) || !plain(b) {
        return Ok(false);
    }
    if a.exists() && b.exists() {
        return is_same_file(a, b).map_err(failed(a));
    }
    // What an input's name is of is for its reader to say.
    Ok(resolve(b).is_ok_and(|b| resolve(a).is_ok_and(|a| a == b)))
}

/// The path without links and dots, whether or not there is something.
fn resolve(path: &Path) -> Result<PathBuf, OutputError> {
    match fs::canonicalize(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => {
            if path.is_symlink() {
                return Err(OutputError::DeadLink(path.into()));
            }
            let Some(name) = path.file_name() else { return Err(failed(path)(e)) };
            let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            Ok(resolve(parent)?.join(name))
        }
        other => other.map_err(failed(path)),
    }
}

/// Writes a file, whole or not at all.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    if !special(path) {
        return temporary::write(&resolve(path)?, bytes).map_err(failed(path));
    }
    let written = if is_stdout(path) {
        // Where it stands: opened anew it would begin at its start.
        let mut out = io::stdout().lock();
        out.write_all(bytes).and_then(|()| out.flush())
    } else {
        fs::OpenOptions::new().append(true).open(path).and_then(|mut f| f.write_all(bytes))
    };
    match written {
        // Whoever read from the pipe has had enough.
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(failed(path)),
    }
}

/// A file that is written bit by bit: it has its name when it is whole, but for devices and pipes.
pub struct Growing<'a> {
    /// As it was named.
    name: &'a Path,
    made: Option<(temporary::Growing, PathBuf)>,
}

impl<'a> Growing<'a> {
    pub fn new(name: &'a Path) -> Result<(Growing<'a>, fs::File), OutputError> {
        if special(name) {
            let file = fs::OpenOptions::new().append(true).open(name).map_err(failed(name))?;
            return Ok((Growing { name, made: None }, file));
        }
        let place = resolve(name)?;
        let (made, file) = temporary::Growing::new(place.parent().unwrap_or(&place)).map_err(failed(name))?;
        Ok((Growing { name, made: Some((made, place)) }, file))
    }

    /// What went wrong in writing it, with its name.
    pub fn failed(&self, source: io::Error) -> OutputError {
        failed(self.name)(source)
    }

    pub fn finish(self) -> Result<(), OutputError> {
        let Some((made, place)) = self.made else { return Ok(()) };
        made.finish(&place).map_err(failed(self.name))
    }
}

/// Makes a folder, if it is not there, that several files are written into one after the other, and checks that they can be.
pub fn folder(path: &Path) -> Result<(), OutputError> {
    fs::create_dir_all(path).and_then(|()| temporary::try_out(&fs::canonicalize(path)?)).map_err(failed(path))
}

/// In every dump: what it is of, and among that the dump's files.
const FRAME: &str = "frame.json";
const FILES: &str = "files_of_this_dump";

/// Files of the dump in a folder, as it says itself: none where there is no dump; nothing where what says so is no dump's.
fn files_of_dump(place: &Path) -> Option<Vec<String>> {
    let text = match fs::read(place.join(FRAME)) {
        Ok(text) => text,
        Err(e) => return (e.kind() == ErrorKind::NotFound).then(Vec::new),
    };
    let frame: Value = serde_json::from_slice(&text).ok()?;
    let names = frame.get(FILES)?.as_array()?.iter();
    names.map(|name| name.as_str().map(str::to_owned)).collect()
}

/// Refuses to replace a folder that is neither empty nor a dump.
fn check_dump(folder: &Path, place: &Path) -> Result<(), OutputError> {
    let no_dump = |found: String| Err(OutputError::NoDump { folder: folder.into(), found });
    if !place.exists() {
        return Ok(());
    }
    let entries = fs::read_dir(place).map_err(failed(folder))?;
    let Some(files) = files_of_dump(place) else { return no_dump(format!("a {FRAME} that is no dump's")) };
    for entry in entries {
        let entry = entry.map_err(failed(folder))?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if !files.contains(&name) || !entry.file_type().is_ok_and(|t| t.is_file()) {
            return no_dump(format!("\"{name}\""));
        }
    }
    Ok(())
}

/// A dump in the making.
pub struct Dump<'a> {
    /// As it was named.
    name: &'a Path,
    place: PathBuf,
    folder: Folder,
    files: Vec<String>,
}

impl<'a> Dump<'a> {
    pub fn new(name: &'a Path) -> Result<Dump<'a>, OutputError> {
        let place = resolve(name)?;
        Ok(Dump { name, folder: Folder::new(&place).map_err(failed(name))?, place, files: Vec::new() })
    }

    pub fn write(&mut self, file: &str, bytes: &[u8]) -> Result<(), OutputError> {
        self.files.push(file.to_owned());
        self.folder.write(file, bytes).map_err(failed(&self.name.join(file)))
    }

    /// It is whole but for what it is of: takes its name, and the place of an older dump.
    pub fn finish(mut self, mut frame: Value) -> Result<(), OutputError> {
        let files = self.files.iter().map(String::as_str).chain([FRAME]).collect::<Vec<_>>();
        frame[FILES] = json!(files);
        self.write(FRAME, format!("{frame:#}").as_bytes())?;
        // Rendering takes a while; someone may have put something there.
        check_dump(self.name, &self.place)?;
        self.folder.finish().map_err(failed(self.name))
    }
}
