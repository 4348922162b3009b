//! Files and folders under temporary names: renamed when they are whole, removed on errors and on SIGINT and SIGTERM.

use std::{
    ffi::OsStr,
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

/// What there is at this moment. Only who holds the lock makes, renames or removes: so a signal, which takes the lock for
/// good, finds everything that there is, and nothing can come after it.
static ALL: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn all() -> MutexGuard<'static, Vec<PathBuf>> {
    ALL.lock().unwrap_or_else(PoisonError::into_inner)
}

fn remove(path: &Path) {
    // Whatever is in the way of removing it, there is nothing more to be done about it.
    let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
}

/// Removes what is temporary and ends the program when SIGINT or SIGTERM says so, with 128 and the signal's number as
/// shells count.
#[cfg(unix)]
pub fn clean_up_on_signals() -> io::Result<()> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM])?;
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            let all = all();
            all.iter().for_each(|path| remove(path));
            // Not `std::process::exit`: that runs the drivers' destructors under the feet of their own threads.
            signal_hook::low_level::exit(128 + signal);
        }
    });
    Ok(())
}

#[cfg(not(unix))]
pub fn clean_up_on_signals() -> io::Result<()> {
    Ok(())
}

/// One temporary file or folder; gone when this is dropped, unless it was renamed.
struct Temporary(PathBuf);

impl Temporary {
    /// As readable as any new file, which temporary ones are not by themselves.
    fn builder(mode: u32) -> tempfile::Builder<'static, 'static> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".meniscus-");
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
        #[cfg(not(unix))]
        let _ = mode;
        builder
    }

    fn file(parent: &Path) -> io::Result<(Temporary, File)> {
        let mut all = all();
        let (file, path) = Self::builder(0o666).tempfile_in(parent)?.keep()?;
        all.push(path.clone());
        Ok((Temporary(path), file))
    }

    fn folder(parent: &Path) -> io::Result<Temporary> {
        let mut all = all();
        let path = Self::builder(0o777).tempdir_in(parent)?.keep();
        all.push(path.clone());
        Ok(Temporary(path))
    }

    fn rename(&self, to: &Path) -> io::Result<()> {
        let mut all = all();
        fs::rename(&self.0, to)?;
        all.retain(|p| *p != self.0);
        Ok(())
    }

    /// Takes the place of a folder, which is removed.
    fn replace(&self, old: &Path) -> io::Result<()> {
        let attic = Temporary::folder(old.parent().unwrap_or(old))?;
        let kept = attic.0.join("old");
        let mut all = all();
        fs::rename(old, &kept)?;
        if let Err(e) = fs::rename(&self.0, old) {
            if fs::rename(&kept, old).is_err() {
                // Better a folder too many than a dump lost.
                all.retain(|p| *p != attic.0);
            }
            return Err(e);
        }
        all.retain(|p| *p != self.0);
        drop(all); // the attic takes the lock to go
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let mut all = all();
        if all.contains(&self.0) {
            remove(&self.0);
            all.retain(|p| *p != self.0);
        }
    }
}

/// Writes a file that is whole as soon as it is there. `path` has no links in it.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let (temporary, mut file) = Temporary::file(path.parent().unwrap_or(path))?;
    file.write_all(bytes)?;
    drop(file);
    temporary.rename(path)
}

/// Checks that files can be made in a folder.
pub fn try_out(folder: &Path) -> io::Result<()> {
    Temporary::file(folder).map(|_| ())
}

/// A file that is written bit by bit, and has its name when it is whole.
pub struct Growing(Temporary);

impl Growing {
    pub fn new(parent: &Path) -> io::Result<(Growing, File)> {
        Temporary::file(parent).map(|(temporary, file)| (Growing(temporary), file))
    }

    /// Gives it its name; `path` has no links in it.
    pub fn finish(self, path: &Path) -> io::Result<()> {
        self.0.rename(path)
    }
}

/// A folder that is whole as soon as it is there.
pub struct Folder {
    path: PathBuf,
    temporary: Temporary,
    /// What the temporary folder becomes: the folder itself, or the first of its parents that is not there yet.
    becomes: PathBuf,
    /// Where the folder's files are until then.
    inside: PathBuf,
}

impl Folder {
    /// Starts a folder that will be at `path`, which has no links in it.
    pub fn new(path: &Path) -> io::Result<Folder> {
        let mut becomes = path;
        while let Some(parent) = becomes.parent().filter(|p| !p.exists()) {
            becomes = parent;
        }
        let temporary = Temporary::folder(becomes.parent().unwrap_or(becomes))?;
        let rest = path.strip_prefix(becomes).unwrap_or(Path::new(""));
        let inside = temporary.0.join(rest);
        let all = all();
        fs::create_dir_all(&inside)?;
        drop(all);
        Ok(Folder { path: path.to_path_buf(), temporary, becomes: becomes.to_path_buf(), inside })
    }

    pub fn write(&self, name: impl AsRef<OsStr>, bytes: &[u8]) -> io::Result<()> {
        let all = all();
        let mut file = File::create_new(self.inside.join(name.as_ref()))?;
        drop(all);
        file.write_all(bytes)
    }

    /// Gives it its name; a folder that had it is removed.
    pub fn finish(self) -> io::Result<()> {
        // Where parents were missing, whatever came in their place meanwhile is not a dump to replace.
        if self.becomes == self.path && self.becomes.is_dir() {
            return self.temporary.replace(&self.becomes);
        }
        self.temporary.rename(&self.becomes)
    }
}
