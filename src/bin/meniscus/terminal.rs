//! The one way to the terminal. What is shown has no control characters and no more than so many letters, wherever it came
//! from, and a terminal that cannot be written to is no reason to panic.

use meniscus::io::quote;
use std::{
    fmt::Display,
    io::{self, ErrorKind, Write},
    sync::atomic::{AtomicBool, Ordering},
};

/// The most characters of a line that are shown.
const LONGEST: usize = 2000;

/// The text that a command is for (devices, figures) could not be written.
#[derive(Debug, thiserror::Error)]
#[error("standard output: {0}. Send it to where there is room")]
pub struct NotWritten(io::Error);

impl NotWritten {
    /// Whoever read the text has had enough: nothing went wrong.
    pub fn reader_left(&self) -> bool {
        self.0.kind() == ErrorKind::BrokenPipe
    }
}

/// Writes one line that the command is for.
pub fn line(text: impl Display) -> Result<(), NotWritten> {
    write(&mut io::stdout().lock(), &text.to_string()).map_err(NotWritten)
}

/// Writes one line beside what the command is for: where it cannot be written, the work goes on.
pub fn progress(text: impl Display) {
    if STDOUT_TAKEN.load(Ordering::Relaxed) {
        complain(text);
    } else {
        let _ = line(text);
    }
}

static STDOUT_TAKEN: AtomicBool = AtomicBool::new(false);

/// From now on standard output is one of the outputs: what is said goes to standard error.
pub fn leave_stdout() {
    STDOUT_TAKEN.store(true, Ordering::Relaxed);
}

/// Writes one line to standard error; there is nobody else to tell if that fails.
pub fn complain(text: impl Display) {
    let _ = write(&mut io::stderr().lock(), &text.to_string());
}

fn write(to: &mut dyn Write, text: &str) -> io::Result<()> {
    // One call, so that lines of several programs do not mix.
    to.write_all(format!("{}\n", plain(text)).as_bytes())?;
    to.flush()
}

/// Text as it can be shown: what cannot be printed is escaped, and of a long text the middle is left out, because the
/// start names the file and the end says what to do.
pub fn plain(text: &str) -> String {
    let shown: String = quote::escape(text).collect();
    let count = shown.chars().count();
    if count <= LONGEST {
        return shown;
    }
    let take = |from: usize, n: usize| shown.chars().skip(from).take(n).collect::<String>();
    let half = LONGEST / 2;
    format!("{} [… {} characters …] {}", take(0, half), count - 2 * half, take(count - half, half))
}

#[cfg(test)]
mod tests {
    use super::{LONGEST, plain};

    #[test]
    fn nothing_that_moves_the_cursor_is_shown() {
        assert_eq!(plain("a\u{1b}[2Jb\r\n\u{9b}c\u{202e}\u{7f}"), r"a\u{1b}[2Jb\r\n\u{9b}c\u{202e}\u{7f}");
        assert_eq!(plain("Wasser „é“ \"C:\\x\""), "Wasser „é“ \"C:\\x\"");
    }

    #[test]
    fn long_texts_keep_their_ends() {
        let text = format!("file.vtk: {}; export it again", "\u{1b}".repeat(100_000));
        let shown = plain(&text);
        assert!(shown.starts_with("file.vtk: ") && shown.ends_with("; export it again"));
        assert!(shown.chars().count() < LONGEST + 50);
    }
}
