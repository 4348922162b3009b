//! LAMMPS dumps in text, of one time step or several, of which the last is read.

use glam::{DMat3, DVec3};

use super::source::{Source, whole};
use super::text;
use super::{At, ParticleFile, ReadError};
use crate::io::quote::{list, quote};

const STEP: &[u8] = b"ITEM: TIMESTEP";
const ADVICE: &str = "dump it in text, by `dump ID all custom N FILE id x y z vx vy vz`";
/// A line of more words is no dump's.
const COLUMNS: usize = 1024;

/// Reads positions, however they are scaled, and velocities, ids, `radius` (or `diameter`) and `class`.
pub(super) fn read(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let content = text::content(source)?;
    let Some(start) = last_step(content) else {
        return Err(source.malformed_but(At::Byte(0), "`ITEM: TIMESTEP` expected", ADVICE));
    };
    let before = text::line_count(&content[..start]) - 1;
    let mut lines = text::lines(&content[start..]).map(|(number, line)| (At::Line(before + number), line)).peekable();
    let ends = || source.malformed(At::Byte(source.bytes.len() as u64), "the file ends within its last time step");
    let mut step = Step { source, count: None, cell: None };
    source.note(|notes| {
        notes.format = "LAMMPS dump, text".into();
        notes.time = time(&content[..start]);
        notes.steps = Some(count_steps(content));
    });
    loop {
        let (at, line) = lines.next().ok_or_else(ends)?;
        let line = String::from_utf8_lossy(line);
        let Some(item) = line.trim().strip_prefix("ITEM: ") else {
            return Err(source.malformed(at, format!("`ITEM:` expected, found `{}`", quote(&line))));
        };
        if let Some(columns) = item.strip_prefix("ATOMS") {
            let left = content.len() - start;
            let file = step.atoms(at, columns, left, &mut lines)?;
            return match lines.find(|(_, line)| !line.trim_ascii().is_empty()) {
                Some((at, _)) => Err(source.malformed(at, "more lines than the number of atoms says")),
                None => Ok(file),
            };
        }
        let mut next =
            || lines.next().ok_or_else(ends).map(|(at, line)| (at, String::from_utf8_lossy(line).into_owned()));
        if let Some(style) = item.strip_prefix("BOX BOUNDS") {
            step.cell = Some(Cell::read(source, style, [next()?, next()?, next()?])?);
            continue;
        }
        let (at, value) = next()?;
        match item.trim() {
            "NUMBER OF ATOMS" => {
                let count = value.trim().parse();
                let bad = |_| source.malformed(at, format!("a number of atoms expected, found `{}`", quote(&value)));
                step.count = Some(count.map_err(bad)?);
            }
            "TIMESTEP" => source.note(|notes| notes.step = value.trim().parse().ok()),
            _ => {}
        }
    }
}

/// Where the last time step begins.
fn last_step(content: &[u8]) -> Option<usize> {
    let mut end = content.len();
    loop {
        let at = content[..end].windows(STEP.len()).rposition(|window| window == STEP)?;
        if at == 0 || matches!(content[at - 1], b'\n' | b'\r') {
            return Some(at);
        }
        end = at + STEP.len() - 1;
    }
}

fn count_steps(content: &[u8]) -> u64 {
    text::lines(content).filter(|(_, line)| line.starts_with(STEP)).count() as u64
}

/// What `dump_modify time yes` writes before a time step.
fn time(before: &[u8]) -> Option<f64> {
    let mut lines = before.trim_ascii_end().rsplit(|b| *b == b'\n');
    let (value, item) = (lines.next()?, lines.next()?);
    let value = std::str::from_utf8(value.trim_ascii()).ok()?.parse().ok()?;
    (item.trim_ascii() == b"ITEM: TIME").then_some(value)
}

/// The box, of which scaled coordinates are shares.
struct Cell {
    origin: DVec3,
    edges: DMat3,
}

impl Cell {
    fn read(source: &Source<'_>, style: &str, lines: [(At, String); 3]) -> Result<Cell, ReadError> {
        let mut rows = [[0.0; 4]; 3];
        let tilted = style.contains("xy xz yz");
        let general = style.contains("abc origin");
        let needed = [2, 3, 4][usize::from(tilted) + 2 * usize::from(general && !tilted)];
        for (row, (at, line)) in rows.iter_mut().zip(&lines) {
            let words: Vec<&str> = line.split_ascii_whitespace().take(5).collect();
            if words.len() != needed {
                return Err(source.malformed(*at, format!("{needed} numbers expected, found `{}`", quote(line))));
            }
            for (slot, word) in row.iter_mut().zip(words) {
                *slot = text::number(source, *at, word, " in BOX BOUNDS")?;
            }
        }
        if general {
            let edges = DMat3::from_cols_array_2d(&rows.map(|[x, y, z, _]| [x, y, z]));
            return Ok(Cell { origin: DVec3::from_array(rows.map(|row| row[3])), edges });
        }
        let [[mut x0, mut x1, xy, _], [mut y0, mut y1, xz, _], [z0, z1, yz, _]] = rows;
        if tilted {
            // Bounds of what is tilted, not of the box.
            let corners = [0.0, xy, xz, xy + xz];
            x0 -= corners.into_iter().fold(0.0, f64::min);
            x1 -= corners.into_iter().fold(0.0, f64::max);
            (y0, y1) = (y0 - yz.min(0.0), y1 - yz.max(0.0));
        }
        let (a, b, c) = (DVec3::new(x1 - x0, 0.0, 0.0), DVec3::new(xy, y1 - y0, 0.0), DVec3::new(xz, yz, z1 - z0));
        Ok(Cell { origin: DVec3::new(x0, y0, z0), edges: DMat3::from_cols(a, b, c) })
    }
}

struct Step<'a> {
    source: &'a Source<'a>,
    count: Option<u64>,
    cell: Option<Cell>,
}

impl Step<'_> {
    fn atoms<'b>(
        &self,
        at: At,
        columns: &str,
        left: usize,
        lines: &mut impl Iterator<Item = (At, &'b [u8])>,
    ) -> Result<ParticleFile, ReadError> {
        let source = self.source;
        let names: Vec<&str> = columns.split_ascii_whitespace().take(COLUMNS + 1).collect();
        if names.len() > COLUMNS {
            return Err(source.malformed(at, format!("more than {COLUMNS} columns")));
        }
        names.iter().for_each(|name| source.note_array(name, "text", 1));
        let one = |name: &str| names.iter().position(|n| *n == name);
        let three = |names: [&str; 3]| match names.map(one) {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
        // Wrapped into the box, or not; then the same as shares of it.
        let plain = three(["x", "y", "z"]).or_else(|| three(["xu", "yu", "zu"]));
        let scaled = || three(["xs", "ys", "zs"]).or_else(|| three(["xsu", "ysu", "zsu"]));
        let Some(axes) = plain.or_else(scaled) else {
            return Err(source.no_positions("columns x y z, xu yu zu or xs ys zs expected", list(names)));
        };
        let cell = match (&self.cell, plain) {
            (_, Some(_)) => None,
            (Some(cell), None) => Some(cell),
            (None, None) => return Err(source.malformed_but(at, "scaled positions, and no BOX BOUNDS before", ADVICE)),
        };
        let count = self.count.ok_or_else(|| source.malformed(at, "no NUMBER OF ATOMS before"))?;
        if count.saturating_mul(2 * names.len() as u64) > left as u64 + 1 {
            return Err(source.malformed(at, format!("{count} atoms promised, and the file is too short for them")));
        }
        let (velocity, id, class) = (three(["vx", "vy", "vz"]), one("id"), one("class"));
        let radius = one("radius").map(|i| (i, 1.0)).or_else(|| one("diameter").map(|i| (i, 0.5)));
        let rows = |wanted: bool| if wanted { count } else { 0 };
        let mut positions = source.room(count, "positions")?;
        let mut velocities = source.room(rows(velocity.is_some()), "velocities")?;
        let mut ids = source.room(rows(id.is_some()), "ids")?;
        let mut classes = source.room(rows(class.is_some()), "classes")?;
        let mut radii = source.room(rows(radius.is_some()), "radii")?;
        let mut words = Vec::with_capacity(names.len());
        for index in 0..count as usize {
            let row = lines.next().filter(|(_, line)| !line.trim_ascii().is_empty());
            let (at, line) = row.ok_or_else(|| {
                let detail = format!("the file ends within a time step: {count} atoms promised, {index} found");
                source.malformed(At::Byte(source.bytes.len() as u64), detail)
            })?;
            words.clear();
            words.extend(line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).take(COLUMNS + 1));
            if words.len() != names.len() {
                let detail = format!("{} columns, where ITEM: ATOMS names {}", words.len(), names.len());
                return Err(source.malformed(at, detail));
            }
            let number = |column: usize| {
                let word = String::from_utf8_lossy(words[column]);
                text::number(source, at, &word, &format!(" in column {}", column + 1))
            };
            let vector = |[x, y, z]: [usize; 3]| Ok(DVec3::new(number(x)?, number(y)?, number(z)?));
            let position = vector(axes)?;
            positions.push(cell.map_or(position, |cell| cell.origin + cell.edges * position));
            if let Some(columns) = velocity {
                velocities.push(vector(columns)?);
            }
            if let Some(column) = id {
                let word = String::from_utf8_lossy(words[column]);
                let bad = || source.malformed(at, format!("an id expected, found `{}`", quote(&word)));
                ids.push(whole(&word).ok_or_else(bad)?);
            }
            if let Some(column) = class {
                classes.push(source.class(number(column)?, index)?);
            }
            if let Some((column, share)) = radius {
                radii.push(share * number(column)?);
            }
        }
        let radius = source.length("radius", radii)?;
        Ok(ParticleFile {
            positions,
            radius,
            classes: class.map(|_| classes),
            velocities: velocity.map(|_| velocities),
            ids: id.map(|_| ids),
            ..ParticleFile::default()
        })
    }
}
