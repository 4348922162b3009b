//! How much memory reading one file may take.
//!
//! A file says itself how much it holds, and a hostile one lies: a kilobyte can ask for gigabytes. So every reader asks a
//! [`Budget`] before it allocates:
//!
//! * What is held at once, the file's own bytes included (but for formats that are read in parts: BGEO, raw XYZ, NPY, NPZ), is at most [`MULTIPLE`] times the file's size plus a floor, a
//!   [`FLOOR_SHARE`]th of the cap; and never more than the cap: 2 GiB, or what `--max-memory` says.
//!   A pipe or device, of which the size is not known before, may give half of the cap, or a quarter as an environment map.
//! * What is unpacked on the way, whether or not it is held, is at most [`UNPACKED`] times as much as that would be without
//!   the cap. That bounds time.
//! * Environment maps are read block by block and averaged down to what may be held: see
//!   [`reduction`](super::images::reduction). A map has at most [`MAP_TEXELS`] texels, and [`MAP_TEXELS_PER_BYTE`] more for
//!   each byte of its file. That bounds time too.

use std::cell::Cell;
use std::fmt;
use std::str::FromStr;

/// Bytes that may be held for each byte of a file. Positions written as the shortest text grow less than fivefold.
pub const MULTIPLE: u64 = 32;
/// The floor is the cap divided by this: 64 MiB, 2.8 million positions, of 2 GiB.
pub const FLOOR_SHARE: u64 = 32;
/// Bytes that may be unpacked for each that may be held.
pub const UNPACKED: u64 = 8;
/// Texels that any environment map may have: twice 16384 x 8192.
pub const MAP_TEXELS: u64 = 1 << 28;
/// Texels that it may have beyond for each byte of its file.
pub const MAP_TEXELS_PER_BYTE: u64 = 64;

/// The cap on what reading one file may take.
///
/// ```
/// use meniscus::io::Budget;
/// assert_eq!("1.5G".parse::<Budget>()?.bytes(), 3 << 29);
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    bytes: u64,
}

impl Budget {
    /// A cap of so many bytes.
    pub const fn new(bytes: u64) -> Budget {
        Budget { bytes }
    }

    /// The cap, in bytes.
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Bytes that may be held while a file of `size` bytes is read, itself included.
    pub const fn allowance(&self, size: u64) -> u64 {
        let allowance = self.uncapped(size);
        if allowance < self.bytes { allowance } else { self.bytes }
    }

    const fn uncapped(&self, size: u64) -> u64 {
        (self.bytes / FLOOR_SHARE).saturating_add(size.saturating_mul(MULTIPLE))
    }
}

/// 2 GiB.
impl Default for Budget {
    fn default() -> Budget {
        Budget::new(2 << 30)
    }
}

/// A number of bytes, or of `K`, `M`, `G` or `T` (1024 times as many each): `512M`, `1.5G`.
impl FromStr for Budget {
    type Err = String;

    fn from_str(text: &str) -> Result<Budget, String> {
        let number = text.trim_end_matches(['K', 'M', 'G', 'T', 'k', 'm', 'g', 't']);
        let unit = match text[number.len()..].to_ascii_uppercase().as_str() {
            "" => 1.0,
            "K" => 1024.0,
            "M" => 1024.0 * 1024.0,
            "G" => 1024.0 * 1024.0 * 1024.0,
            "T" => 1024.0 * 1024.0 * 1024.0 * 1024.0,
            _ => f64::NAN,
        };
        match number.parse::<f64>().map(|n| n * unit) {
            // Below a megabyte nothing could be read; f64 holds whole bytes up to 2^53.
            Ok(bytes) if (1048576.0..=9e15).contains(&bytes) => Ok(Budget::new(bytes as u64)),
            _ => Err("give an amount of memory from 1M up, such as 512M, 2G or 1.5G".into()),
        }
    }
}

/// As [`FromStr`] reads it: `2G`.
impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&size(self.bytes))
    }
}

/// Bytes for people: `64M`, `1.5G`; exact where a digit suffices.
pub(crate) fn size(bytes: u64) -> String {
    let units = [("T", 40), ("G", 30), ("M", 20), ("K", 10)];
    let Some((unit, shift)) = units.into_iter().find(|(_, shift)| bytes >> shift > 0) else {
        return format!("{bytes} bytes");
    };
    let rounded = format!("{:.1}", bytes as f64 / (1_u64 << shift) as f64);
    format!("{}{unit}", rounded.strip_suffix(".0").unwrap_or(&rounded))
}

/// More than a file's budget.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{what} would take {} where a file of {} may take {}; if it is genuine, raise --max-memory (now {budget})",
    size(*needed), size(*file), size(*allowed)
)]
pub struct OverBudget {
    /// What there is no room for.
    pub what: String,
    /// Bytes that everything together would take.
    pub needed: u64,
    /// Bytes it may take.
    pub allowed: u64,
    /// The file's size in bytes.
    pub file: u64,
    /// The cap.
    pub budget: Budget,
}

/// What reading one file took so far.
pub(crate) struct Ledger {
    budget: Budget,
    file: u64,
    held: Cell<u64>,
    unpacked: Cell<u64>,
}

impl Ledger {
    /// The file's own bytes are held already.
    pub(crate) fn new(budget: Budget, file: u64) -> Result<Ledger, OverBudget> {
        let ledger = Ledger::of_parts(budget, file);
        ledger.hold(file, "the file")?;
        Ok(ledger)
    }

    /// What is made of several files, which are not held at once.
    pub(crate) fn of_parts(budget: Budget, files: u64) -> Ledger {
        Ledger { budget, file: files, held: Cell::new(0), unpacked: Cell::new(0) }
    }

    /// Asks for room for `count` values of `each` bytes. Nothing is given back: what is freed early is not worth the books.
    pub(crate) fn hold_all(&self, count: u64, each: usize, what: &str) -> Result<(), OverBudget> {
        self.hold(count.saturating_mul(each as u64), what)
    }

    fn hold(&self, bytes: u64, what: &str) -> Result<(), OverBudget> {
        self.add(&self.held, bytes, self.budget.allowance(self.file), what)
    }

    /// Bytes that may be held beside those that are.
    pub(crate) fn left(&self) -> u64 {
        self.budget.allowance(self.file).saturating_sub(self.held.get())
    }

    /// Notes bytes that were decompressed and are not kept.
    pub(crate) fn unpack(&self, bytes: u64, what: &str) -> Result<(), OverBudget> {
        let most = self.budget.uncapped(self.file).saturating_mul(UNPACKED);
        self.add(&self.unpacked, bytes, most, what)
    }

    fn add(&self, sum: &Cell<u64>, bytes: u64, allowed: u64, what: &str) -> Result<(), OverBudget> {
        let needed = sum.get().saturating_add(bytes);
        if needed > allowed {
            return Err(OverBudget { what: what.into(), needed, allowed, file: self.file, budget: self.budget });
        }
        sum.set(needed);
        Ok(())
    }
}

/// Reads what is being decompressed, and stops it when it is more than a file may unpack to.
pub(crate) struct Metered<'a, R> {
    pub(crate) inner: R,
    pub(crate) ledger: &'a Ledger,
    pub(crate) what: &'a str,
}

impl<R: std::io::Read> std::io::Read for Metered<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let length = self.inner.read(buffer)?;
        self.ledger.unpack(length as u64, self.what).map_err(std::io::Error::other)?;
        Ok(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_is_a_multiple_a_floor_and_a_cap() {
        let budget = Budget::default();
        assert_eq!(budget.allowance(0), 64 << 20);
        assert_eq!(budget.allowance(1000), (64 << 20) + 32_000);
        assert_eq!(budget.allowance(u64::MAX), 2 << 30);
        assert_eq!(budget.to_string(), "2G");
        for (text, bytes) in [("2G", 2 << 30), ("512m", 512 << 20), ("4194304", 4 << 20), ("0.5G", 1 << 29)] {
            assert_eq!(text.parse(), Ok(Budget::new(bytes)), "{text}");
        }
        for text in ["", "G", "2GB", "2X", "-1G", "nan", "1K", "infG", "1e300G", "2MG", "2µ"] {
            assert!(text.parse::<Budget>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_ledger_counts_before_anything_is_allocated() {
        let ledger = Ledger::new(Budget::default(), 1 << 20).expect("a small file");
        ledger.hold_all(1 << 20, 24, "positions").expect("room");
        let over = ledger.hold_all(u64::MAX, 24, "positions").expect_err("no room");
        assert!(over.to_string().contains("--max-memory (now 2G)"), "{over}");
        ledger.hold_all(1, 1, "a byte").expect("what was refused does not count");
        assert!(ledger.unpack(4 << 30, "blocks").is_err());
    }
}
