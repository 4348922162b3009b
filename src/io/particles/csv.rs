//! Text tables with separated columns (`.csv`), by csv.

use ::csv::{ReaderBuilder, StringRecord, Trim};
use glam::DVec3;

use super::source::{Source, is_id};
use super::text::{self, CommaCheck};
use super::{At, ParticleFile, ReadError};
use crate::io::quote::{list, quote};

/// Lines that may come before the names of columns.
const PREFACE: usize = 16;

/// A comma may be part of a number where another separator is there, not the other way round.
fn delimiter(line: &[u8]) -> u8 {
    [b'\t', b';'].into_iter().find(|d| line.contains(d)).unwrap_or(b',')
}

fn is_comment(line: &[u8]) -> bool {
    line.is_empty() || line.starts_with(b"#")
}

/// Reads columns separated by tabs, semicolons or commas, found by the header's names, before which may be lines about the
/// whole; without a header the first three.
pub(super) fn read(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let whole = text::content(source)?;
    let preface = Preface::of(whole);
    let content = &whole[preface.length..];
    let mut lines = text::lines(content).map(|(_, line)| line);
    let first_line = lines.find(|line| !is_comment(line)).unwrap_or_default();
    let delimiter = delimiter(first_line);
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .trim(Trim::All)
        .from_reader(content);
    let mut record = StringRecord::new();
    let line = |record: &StringRecord| preface.line(record.position());
    let mut next = |record: &mut StringRecord| {
        reader.read_record(record).map_err(|error| {
            let at = preface.line(error.position());
            source.malformed_but(
                at,
                detail(&error),
                "give every line the same columns, in UTF-8; commas within a number need decimal points instead",
            )
        })
    };
    let mut more = next(&mut record)?;
    let has_header = record.iter().take(3).any(|field| field.parse::<f64>().is_err());
    let columns =
        if has_header { Columns::named(source, &record, line(&record))? } else { Columns::first(source, &record)? };
    for (i, name) in record.iter().enumerate() {
        let number = (i + 1).to_string();
        source.note_array(if has_header { name } else { &number }, "text", 1);
    }
    source.note(|notes| {
        (notes.format, notes.time) =
            (format!("columns of text, separated by {}", char::from(delimiter).escape_default()), preface.time);
    });
    let first = line(&record);
    if has_header {
        more = next(&mut record)?;
    }
    let (rows, some) = (text::line_count(content), |column: Option<usize>, n| if column.is_some() { n } else { 0 });
    let mut positions = source.room(rows, "positions")?;
    let mut classes: Vec<u8> = source.room(some(columns.class, rows), "classes")?;
    let moving = if columns.velocity.is_some() { rows } else { 0 };
    let mut velocities: Vec<DVec3> = source.room(moving, "velocities")?;
    let mut ids = source.ids(some(columns.id, rows))?;
    let mut radii: Vec<f64> = source.room(some(columns.radius, rows), "radii")?;
    let mut check = CommaCheck::default();
    while more {
        let number = |column: usize| {
            let place = format!(" in column {}", column + 1);
            text::number(source, line(&record), record.get(column).unwrap_or_default(), &place)
        };
        let [x, y, z] = columns.axes;
        positions.push(DVec3::new(number(x)?, number(y)?, number(z)?));
        if let Some(column) = columns.class {
            classes.push(source.class(number(column)?, classes.len())?);
        }
        if let Some([x, y, z]) = columns.velocity {
            velocities.push(DVec3::new(number(x)?, number(y)?, number(z)?));
        }
        if let Some(column) = columns.id {
            ids.push(record.get(column).and_then(|word| word.parse().ok()).unwrap_or(f64::NAN));
        }
        if let Some(column) = columns.radius {
            radii.push(number(column)?);
        }
        if !has_header && delimiter == b',' {
            record.iter().for_each(|field| check.field(field));
        }
        more = next(&mut record)?;
    }
    if !has_header && delimiter == b',' {
        check.finish(source, first, columns.count)?;
    }
    let (classes, velocities) = (columns.class.map(|_| classes), columns.velocity.map(|_| velocities));
    let radius = source.length("radius", radii)?;
    let ids = columns.id.and_then(|_| ids.finish());
    Ok(ParticleFile { positions, radius, classes, velocities, ids, ..ParticleFile::default() })
}

/// What comes before the names of columns.
#[derive(Default)]
struct Preface {
    length: usize,
    lines: u64,
    time: Option<f64>,
}

impl Preface {
    /// There is one where the first line has words and no positions, and one soon after names them.
    fn of(content: &[u8]) -> Preface {
        let mut before: Vec<Vec<String>> = Vec::new();
        for (number, line) in text::lines(content).take(PREFACE) {
            let text = String::from_utf8_lossy(line);
            let delimiter = delimiter(line);
            let names: Vec<String> = text.split(char::from(delimiter)).map(|name| name.trim().to_owned()).collect();
            let numbers = names.len() >= 3 && names[..3].iter().all(|name| name.parse::<f64>().is_ok());
            let comment = is_comment(line);
            if before.is_empty() && numbers && !comment {
                break;
            }
            if !comment && triple(names.iter().map(String::as_str), &POSITIONS, true).is_some() {
                let length = line.as_ptr() as usize - content.as_ptr() as usize;
                return if before.is_empty() {
                    Preface::default()
                } else {
                    Preface { length, lines: number - 1, time: time(&before) }
                };
            }
            if !comment {
                before.push(names);
            }
        }
        Preface::default()
    }

    fn line(&self, position: Option<&::csv::Position>) -> At {
        position.map_or(At::Unknown, |position| At::Line(self.lines + position.line()))
    }
}

/// The number below the word for time, with or without its unit.
fn time(before: &[Vec<String>]) -> Option<f64> {
    let is_time = |name: &String| ["time", "timestep"].contains(&without_unit(name).to_ascii_lowercase().as_str());
    before.windows(2).find_map(|two| two[1].get(two[0].iter().position(is_time)?)?.parse().ok())
}

/// A column's name but for a unit behind it: `Pos.x [m]`.
fn without_unit(name: &str) -> &str {
    let name = name.trim();
    let unit = name
        .strip_suffix(']')
        .and_then(|n| n.rsplit_once('['))
        .or(name.strip_suffix(')').and_then(|n| n.rsplit_once('(')));
    match unit {
        // `v[0]` has no unit.
        Some((name, unit)) if !["0", "1", "2", "x", "y", "z", "X", "Y", "Z"].contains(&unit.trim()) => name.trim_end(),
        _ => name,
    }
}

/// csv's own words name byte offsets and records beside the line.
fn detail(error: &::csv::Error) -> String {
    match error.kind() {
        ::csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("{len} columns, where the lines before have {expected_len}")
        }
        ::csv::ErrorKind::Utf8 { .. } => "no UTF-8 text".into(),
        _ => error.to_string(),
    }
}

/// Where the table has what.
struct Columns {
    axes: [usize; 3],
    class: Option<usize>,
    id: Option<usize>,
    radius: Option<usize>,
    velocity: Option<[usize; 3]>,
    count: usize,
}

impl Columns {
    fn first(source: &Source<'_>, record: &StringRecord) -> Result<Columns, ReadError> {
        match record.len() {
            0..3 => Err(Self::missing(source, record)),
            count => Ok(Columns { axes: [0, 1, 2], class: None, id: None, radius: None, velocity: None, count }),
        }
    }

    fn missing(source: &Source<'_>, record: &StringRecord) -> ReadError {
        source.no_positions("columns x, y, z expected", list(record))
    }

    /// `x`, `y` and `z` count; else the first names that are the same but for their axis, `px` or `Points:0` alike.
    fn named(source: &Source<'_>, header: &StringRecord, at: At) -> Result<Columns, ReadError> {
        let Some(axes) = triple(header.iter(), &POSITIONS, true) else {
            return Err(Self::missing(source, header));
        };
        let velocity = triple(header.iter(), &VELOCITIES, false);
        let one = |name: &str| {
            let mut places =
                header.iter().enumerate().filter(|(_, n)| without_unit(n).eq_ignore_ascii_case(name)).map(|(i, _)| i);
            (places.next(), places.next().is_some())
        };
        let ((class, two_classes), (radius, two_radii)) = (one("class"), one("radius"));
        let repeated = axes
            .iter()
            .chain(velocity.iter().flatten())
            .find(|(_, again)| *again)
            .and_then(|(column, _)| header.get(*column));
        let repeated = repeated.or(two_classes.then_some("class")).or(two_radii.then_some("radius"));
        if let Some(name) = repeated {
            let detail = format!("column `{}` is there twice", quote(name));
            return Err(source.malformed_but(at, detail, "remove or rename one of them"));
        }
        let id = header.iter().position(|name| is_id(without_unit(name)));
        let columns = |found: [(usize, bool); 3]| found.map(|(column, _)| column);
        Ok(Columns { axes: columns(axes), class, id, radius, velocity: velocity.map(columns), count: header.len() })
    }
}

/// Stems of the names of columns that hold positions.
const POSITIONS: [&str; 12] = [
    "p",
    "pos",
    "position",
    "positions",
    "point",
    "points",
    "coord",
    "coords",
    "coordinate",
    "coordinates",
    "center",
    "centre",
];
/// … and velocities.
const VELOCITIES: [&str; 4] = ["v", "vel", "velocity", "velocities"];

/// Three columns of vectors, and whether each is there once more: the first whose names are the same but for their axis; names
/// that are nothing but an axis first, where they count.
fn triple<'a>(header: impl Iterator<Item = &'a str>, stems: &[&str], bare: bool) -> Option<[(usize, bool); 3]> {
    let names: Vec<Option<(String, usize, bool)>> = header.map(|name| axis(name, stems, bare)).collect();
    let place = |stem: &str, axis: usize, digits: bool| {
        let same = |name: &Option<(String, usize, bool)>| {
            name.as_ref().is_some_and(|name| (name.0.as_str(), name.1, name.2) == (stem, axis, digits))
        };
        names.iter().position(same).map(|first| (first, names[first + 1..].iter().any(same)))
    };
    // Few stems are known, so this is quick however long the header.
    let mut stems: Vec<(&str, bool)> = Vec::new();
    for (stem, _, digits) in names.iter().flatten() {
        if !stems.contains(&(stem, *digits)) {
            stems.push((stem, *digits));
        }
    }
    stems.sort_by_key(|(stem, _)| !stem.is_empty());
    stems.into_iter().find_map(|(stem, digits)| {
        let found = [0, 1, 2].map(|axis| place(stem, axis, digits));
        found.iter().all(Option::is_some).then(|| found.map(Option::unwrap_or_default))
    })
}

/// Whether a column named `name` holds vectors along an axis: `x` (where `bare` names count), `Points:0`, `position_x`, `Pos.X`,
/// `px` and the like. Its stem, the axis, and whether a digit names it.
fn axis(name: &str, stems: &[&str], bare: bool) -> Option<(String, usize, bool)> {
    let mut stem: String =
        without_unit(name).chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase();
    let last = stem.pop()?;
    let (axis, digits) = "xyz".find(last).map(|i| (i, false)).or("012".find(last).map(|i| (i, true)))?;
    let known = stems.contains(&stem.as_str()) || (bare && stem.is_empty() && !digits);
    known.then_some((stem, axis, digits))
}
