//! Text tables (`.csv`, `.xyz`) and raw `.xyz`.

use csv::{ReaderBuilder, StringRecord, Trim};
use glam::DVec3;

use super::{At, ParticleFile, ReadError, Source, numbers, points};

/// Reads little-endian float32 triples; or, if the file starts with printable text, [`text_xyz`].
pub(super) fn read_xyz(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    // Of the bytes of float32 triples hardly half are printable; a text may have a few that are not (an accent, a flaw).
    let head = &source.bytes[..source.bytes.len().min(1024)];
    let printable = |b: &&u8| b.is_ascii_graphic() || b.is_ascii_whitespace();
    if head.iter().filter(printable).count() * 16 >= head.len() * 15 {
        return text_xyz(source);
    }
    let rest = source.bytes.len() % 12;
    if rest != 0 {
        let at = At::Byte((source.bytes.len() - rest) as u64);
        return Err(source.malformed(at, format!("{rest} bytes left after the last whole float32 triple")));
    }
    let values = numbers(source.bytes, "float", false).unwrap_or_default();
    Ok(ParticleFile { positions: points(&values), ..ParticleFile::default() })
}

/// Lines `x y z ...` or, as in chemistry, `element x y z ...`, separated by blanks or commas; `#` starts a comment. A first
/// line with nothing but a count is followed by a comment line, and checked.
fn text_xyz(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let text = String::from_utf8_lossy(source.bytes);
    let mut lines = text.lines().enumerate().peekable();
    let blank = |line: &str| line.trim().is_empty() || line.trim_start().starts_with('#');
    while lines.next_if(|(_, line)| blank(line)).is_some() {}
    let promised: Option<usize> = lines.peek().and_then(|(_, line)| line.trim().parse().ok());
    if promised.is_some() {
        lines.nth(1);
    }
    let mut positions = Vec::new();
    for (index, line) in lines.filter(|(_, line)| !blank(line)) {
        let at = At::Line(index as u64 + 1);
        let mut words = line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()).peekable();
        words.next_if(|word| word.parse::<f64>().is_err());
        let mut number = || {
            let word = words.next().ok_or_else(|| source.malformed(at, "three numbers expected, fewer found"))?;
            word.parse::<f64>()
                .map_err(|_| source.malformed(at, format!("number expected, found `{}`", word.escape_debug())))
        };
        positions.push(DVec3::new(number()?, number()?, number()?));
    }
    if promised.is_some_and(|promised| promised != positions.len()) {
        let detail =
            format!("the first line promises {} positions, {} follow", promised.unwrap_or_default(), positions.len());
        return Err(source.malformed(At::Line(1), detail));
    }
    Ok(ParticleFile { positions, ..ParticleFile::default() })
}

/// Reads columns separated by commas, semicolons or tabs, found by the header's names; without a header the first three.
pub(super) fn read_csv(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let first_line = source.bytes.split(|b| *b == b'\n').find(|line| !line.starts_with(b"#")).unwrap_or_default();
    let delimiter = [b',', b';', b'\t'].into_iter().find(|d| first_line.contains(d)).unwrap_or(b',');
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .trim(Trim::All)
        .from_reader(source.bytes);
    let broken = |error: csv::Error| {
        let at = error.position().map_or(At::Unknown, |position| At::Line(position.line()));
        source.malformed(at, error.to_string())
    };
    let mut records = reader.records();
    let first = records.next().transpose().map_err(broken)?.unwrap_or_default();
    let number = |record: &StringRecord, column: usize| -> Result<f64, ReadError> {
        let text = record.get(column).unwrap_or_default();
        let at = record.position().map_or(At::Unknown, |position| At::Line(position.line()));
        text.parse().map_err(|_| {
            source.malformed(at, format!("number expected in column {}, found `{}`", column + 1, text.escape_debug()))
        })
    };
    let has_header = first.iter().take(3).any(|field| field.parse::<f64>().is_err());
    let column = |wanted: &dyn Fn(&str) -> bool| first.iter().position(wanted).filter(|_| has_header);
    let axes = if has_header {
        [('x', '0'), ('y', '1'), ('z', '2')].map(|(letter, digit)| column(&|name| is_axis(name, letter, digit)))
    } else {
        [0, 1, 2].map(|axis| (axis < first.len()).then_some(axis))
    };
    let [Some(x), Some(y), Some(z)] = axes else {
        return Err(source
            .no_positions("columns x, y, z expected", format!("`{}`", first.iter().collect::<Vec<_>>().join("`, `"))));
    };
    let class = column(&|name| name.eq_ignore_ascii_case("class"));
    let radius = column(&|name| name.eq_ignore_ascii_case("radius"));
    let (mut positions, mut classes, mut radii) = (Vec::new(), Vec::new(), Vec::new());
    for record in (!has_header).then(|| Ok(first.clone())).into_iter().chain(records) {
        let record = record.map_err(broken)?;
        positions.push(DVec3::new(number(&record, x)?, number(&record, y)?, number(&record, z)?));
        class.map(|column| number(&record, column).map(|value| classes.push(value))).transpose()?;
        radius.map(|column| number(&record, column).map(|value| radii.push(value))).transpose()?;
    }
    let classes = class.map(|_| source.classes(&classes)).transpose()?;
    Ok(ParticleFile { positions, radius: source.length("radius", radii)?, classes, ..ParticleFile::default() })
}

/// Whether a column named `name` holds positions along an axis: `x`, `Points:0`, `position_x`, `Pos.X`, `px` and the like.
fn is_axis(name: &str, letter: char, digit: char) -> bool {
    let name: String = name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase();
    let stems = [
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
    name.strip_suffix(letter).is_some_and(|stem| stem.is_empty() || stems.contains(&stem))
        || name.strip_suffix(digit).is_some_and(|stem| stems.contains(&stem))
}
