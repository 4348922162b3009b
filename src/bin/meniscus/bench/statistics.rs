//! What the device counts of each pass, of one frame: nothing that is timed has these queries in it.

use crate::terminal::line;
use meniscus::{FrameInput, host::Session, inspect::Inspection, statistics::COUNTED};
use std::error::Error;

/// Draws a frame and prints what was counted; passes of one name are summed.
pub fn print(what: &str, session: &mut Session, input: &FrameInput) -> Result<(), Box<dyn Error>> {
    session.renderer.inspect(Inspection { statistics: true, ..Inspection::default() });
    session.frame(input)?;
    let all = session.renderer.statistics(input.slot).ok_or("the device counted nothing")?;
    let mut passes: Vec<(&str, [u64; COUNTED.len()])> = Vec::new();
    for pass in &all {
        match passes.iter_mut().find(|(name, _)| *name == pass.name) {
            Some((_, counts)) => counts.iter_mut().zip(pass.counts).for_each(|(sum, n)| *sum += n),
            None => passes.push((pass.name, pass.counts)),
        }
    }
    line("")?;
    let row = |name: &str, cells: Vec<String>| {
        let cells: String =
            cells.iter().zip(COUNTED).map(|(c, head)| format!("  {c:>width$}", width = head.len())).collect();
        line(format!("{name:<24}{cells}"))
    };
    line(format!("{what}:"))?;
    row("pass", COUNTED.map(str::to_owned).to_vec())?;
    for (name, counts) in passes {
        row(name, counts.iter().map(u64::to_string).collect())?;
    }
    Ok(())
}
