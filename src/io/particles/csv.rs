//! Text tables with separated columns (`.csv`), by csv.

use ::csv::{ReaderBuilder, StringRecord, Trim};
use glam::DVec3;

use super::source::Source;
use super::text::{self, CommaCheck};
use super::{At, ParticleFile, ReadError};
use crate::io::quote::{list, quote};

/// Reads columns separated by tabs, semicolons or commas, found by the header's names; without a header the first three.
pub(super) fn read(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let content = text::content(source)?;
    let mut lines = text::lines(content).map(|(_, line)| line);
    let first_line = lines.find(|line| !line.is_empty() && !line.starts_with(b"#")).unwrap_or_default();
    // A comma may be part of a number where another separator is there, not the other way round.
    let delimiter = [b'\t', b';', b','].into_iter().find(|d| first_line.contains(d)).unwrap_or(b',');
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .trim(Trim::All)
        .from_reader(content);
    let mut record = StringRecord::new();
    let mut next = |record: &mut StringRecord| {
        reader.read_record(record).map_err(|error| {
            let at = error.position().map_or(At::Unknown, |position| At::Line(position.line()));
            source.malformed_but(
                at,
                detail(&error),
                "give every line the same columns, in UTF-8; commas within a number need decimal points instead",
            )
        })
    };
    let mut more = next(&mut record)?;
    let has_header = record.iter().take(3).any(|field| field.parse::<f64>().is_err());
    let columns = if has_header { Columns::named(source, &record)? } else { Columns::first(source, &record)? };
    let first = line(&record);
    if has_header {
        more = next(&mut record)?;
    }
    let (rows, some) = (text::line_count(content), |column: Option<usize>, n| if column.is_some() { n } else { 0 });
    let mut positions = source.room(rows, "positions")?;
    let mut classes: Vec<u8> = source.room(some(columns.class, rows), "classes")?;
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
    let classes = columns.class.map(|_| classes);
    Ok(ParticleFile { positions, radius: source.length("radius", radii)?, classes, ..ParticleFile::default() })
}

fn line(record: &StringRecord) -> At {
    record.position().map_or(At::Unknown, |position| At::Line(position.line()))
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
    radius: Option<usize>,
    count: usize,
}

impl Columns {
    fn first(source: &Source<'_>, record: &StringRecord) -> Result<Columns, ReadError> {
        match record.len() {
            0..3 => Err(Self::missing(source, record)),
            count => Ok(Columns { axes: [0, 1, 2], class: None, radius: None, count }),
        }
    }

    fn missing(source: &Source<'_>, record: &StringRecord) -> ReadError {
        source.no_positions("columns x, y, z expected", list(record))
    }

    /// `x`, `y` and `z` count; else the first names that are the same but for their axis, `px` or `Points:0` alike.
    fn named(source: &Source<'_>, header: &StringRecord) -> Result<Columns, ReadError> {
        let names: Vec<Option<(String, usize, bool)>> = header.iter().map(axis).collect();
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
        let whole = stems.into_iter().find_map(|(stem, digits)| {
            let found = [0, 1, 2].map(|axis| place(stem, axis, digits));
            found.iter().all(Option::is_some).then(|| found.map(Option::unwrap_or_default))
        });
        let Some(axes) = whole else {
            return Err(Self::missing(source, header));
        };
        let one = |name: &str| {
            let mut places = header.iter().enumerate().filter(|(_, n)| n.eq_ignore_ascii_case(name)).map(|(i, _)| i);
            (places.next(), places.next().is_some())
        };
        let ((class, two_classes), (radius, two_radii)) = (one("class"), one("radius"));
        let repeated = axes.iter().find(|(_, again)| *again).and_then(|(column, _)| header.get(*column));
        let repeated = repeated.or(two_classes.then_some("class")).or(two_radii.then_some("radius"));
        if let Some(name) = repeated {
            let detail = format!("column `{}` is there twice", quote(name));
            return Err(source.malformed_but(line(header), detail, "remove or rename one of them"));
        }
        Ok(Columns { axes: axes.map(|(column, _)| column), class, radius, count: header.len() })
    }
}

/// Whether a column named `name` holds positions along an axis: `x`, `Points:0`, `position_x`, `Pos.X`, `px` and the like.
/// Its stem, the axis, and whether a digit names it.
fn axis(name: &str) -> Option<(String, usize, bool)> {
    const STEMS: [&str; 12] = [
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
    let mut stem: String = name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase();
    let last = stem.pop()?;
    let (axis, digits) = "xyz".find(last).map(|i| (i, false)).or("012".find(last).map(|i| (i, true)))?;
    let known = STEMS.contains(&stem.as_str()) || (stem.is_empty() && !digits);
    known.then_some((stem, axis, digits))
}
