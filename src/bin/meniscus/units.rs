//! Work in units that stand by themselves: listed, some of them done, all of them joined. Each leaves what it has found in the
//! output's folder under what decides it, whole or not at all: so units may be done by several programs at once, twice or not at all, and
//! whoever joins makes what is not there.

use crate::{
    part::Part,
    sequence::frames::Selection,
    terminal::{self, NotWritten},
};

#[derive(clap::Args)]
pub struct Units {
    /// Print the number and the name of each unit that this falls into, and do nothing else
    #[arg(long, conflicts_with = "units")]
    list_units: bool,
    /// Only these units, by number or by name, and nothing that needs them all: what they find stays in the output's folder. Without it what
    /// is there is joined, and the rest is done
    #[arg(long, value_name = "A-B|NAME")]
    units: Option<String>,
    /// The same of the K-th of N parts of the units, such as 0/10 to 9/10: what `submit` has its tasks do
    #[arg(long, value_name = "K/N", conflicts_with_all = ["units", "list_units"])]
    pub part: Option<Part>,
}

/// Why there are no such units.
#[derive(Debug, thiserror::Error)]
pub enum UnitsError {
    #[error("--units {0}: {1}, or the name of a unit (--list-units)")]
    Neither(String, String),
    #[error("--units {wanted}: none of them is among the {all} units; --list-units prints them")]
    None { wanted: String, all: usize },
}

impl Units {
    /// Prints the units if that is all that is asked for.
    pub fn listed(&self, names: &[String]) -> Result<bool, NotWritten> {
        if self.list_units {
            names.iter().enumerate().try_for_each(|(i, name)| terminal::line(format!("{} {name}", i + 1)))?;
        }
        Ok(self.list_units)
    }

    /// Which of the units are to be done, if not all; counted from 0.
    pub fn some(&self, names: &[String]) -> Result<Option<Vec<usize>>, UnitsError> {
        if let Some(part) = self.part {
            return Ok(Some(part.range(names.len()).collect()));
        }
        let Some(wanted) = &self.units else { return Ok(None) };
        if let Some(named) = names.iter().position(|n| n == wanted) {
            return Ok(Some(vec![named]));
        }
        let shown = || terminal::plain(wanted).to_string();
        let numbers: Selection = wanted.parse().map_err(|why| UnitsError::Neither(shown(), why))?;
        let some: Vec<_> = (0..names.len()).filter(|i| numbers.has(*i as u64 + 1)).collect();
        if some.is_empty() {
            return Err(UnitsError::None { wanted: shown(), all: names.len() });
        }
        Ok(Some(some))
    }
}
