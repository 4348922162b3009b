//! `--stats`: a row for each picture.

use super::{
    Args,
    ahead::Ready,
    plan::{Plan, Shot},
};
use crate::{
    outputs::{self, OutputError},
    part::Part,
    scene::Scene,
};
use meniscus::prepare::Report;
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// What is known of one picture. Of several exposures times are summed, counts are the last one's.
#[derive(Default)]
pub struct Row {
    number: u64,
    particles: usize,
    splash: usize,
    body: usize,
    dropped: usize,
    read_ms: f64,
    prepare_ms: f64,
    /// How long the device waited for the frame to be read and prepared.
    pub waited_ms: f64,
    pub frame_ms: f64,
    pub gpu_ms: Option<f64>,
    pub encode_ms: f64,
    /// Mean difference from the last picture's colours, of 1.
    pub change: Option<f64>,
    /// Particles whose class is another than in the frame before.
    class_changes: Option<usize>,
    /// Why it shows no liquid, if it shows none.
    pub note: Option<String>,
}

const HEADER: [&str; 12] = [
    "number",
    "file",
    "particles",
    "splash",
    "body",
    "dropped",
    "read_ms",
    "prepare_ms",
    "waited_ms",
    "frame_ms",
    "gpu_ms",
    "encode_ms",
];
/// From the picture before, and from the frame before.
const CHANGES: [&str; 2] = ["change", "class_changes"];

impl Row {
    pub fn new(shot: &Shot) -> Row {
        Row { number: shot.number, ..Row::default() }
    }

    pub fn count(&mut self, scene: &Scene, report: &Report, ready: &Ready) {
        self.particles = scene.positions.len();
        (self.splash, self.body, self.dropped) = (report.splash, report.body, scene.dropped);
        self.read_ms += ready.read_ms;
        self.prepare_ms += ready.prepare_ms;
        self.class_changes = ready.class_changes;
    }

    fn cells(&self, file: String) -> Vec<String> {
        let ms = |v: f64| format!("{v:.2}");
        let counts = [self.particles, self.splash, self.body, self.dropped].map(|n| n.to_string());
        let times = [self.read_ms, self.prepare_ms, self.waited_ms, self.frame_ms].map(ms);
        let mut cells = vec![self.number.to_string(), file];
        cells.extend(counts.into_iter().chain(times));
        cells.extend([self.gpu_ms.map_or(String::new(), ms), ms(self.encode_ms)]);
        cells.push(change_cell(self.change));
        cells.push(self.class_changes.map_or(String::new(), |c| c.to_string()));
        cells
    }
}

/// All rows, by number; those of pictures that were there already are an older table's.
pub struct Table<'a> {
    path: &'a Path,
    plan: &'a Plan,
    rows: BTreeMap<u64, Vec<String>>,
    /// When it is to be written again: as rarely as that takes long.
    due: Instant,
}

impl<'a> Table<'a> {
    pub fn new(path: &'a Path, plan: &'a Plan) -> Table<'a> {
        let mut rows = older(path).unwrap_or_default();
        // And those of parts, where this joins them.
        for part in parts_of(path) {
            older(&part)
                .unwrap_or_default()
                .into_iter()
                .for_each(|(number, row)| _ = rows.entry(number).or_insert(row));
        }
        rows.retain(|number, _| plan.shots.iter().any(|s| s.kept && s.number == *number));
        Table { path, plan, rows, due: Instant::now() }
    }

    /// Whether the row of a picture that is there does not say what has changed since the one before: a part's first.
    pub fn lacks_change(&self, shot: &Shot) -> bool {
        self.rows.get(&shot.number).and_then(|row| row.get(HEADER.len())).is_some_and(String::is_empty)
    }

    /// Says so now.
    pub fn set_change(&mut self, shot: &Shot, change: Option<f64>) {
        if let Some(cell) = self.rows.get_mut(&shot.number).and_then(|row| row.get_mut(HEADER.len())) {
            *cell = change_cell(change);
        }
    }

    pub fn add(&mut self, row: Row) -> Result<(), OutputError> {
        let shot = self.plan.shots.iter().find(|s| s.number == row.number);
        let file = shot.map(|s| self.plan.frames.all()[s.exposures[0].moment.frame].file.display().to_string());
        self.rows.insert(row.number, row.cells(file.unwrap_or_default()));
        let begin = Instant::now();
        if begin < self.due {
            return Ok(());
        }
        self.write()?;
        self.due = Instant::now() + 20 * begin.elapsed().saturating_sub(Duration::from_millis(2));
        Ok(())
    }

    pub fn write(&mut self) -> Result<(), OutputError> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let header: Vec<_> = HEADER.iter().chain(&CHANGES).map(|h| (*h).to_owned()).collect();
        // Into memory, rows of one length: nothing can fail.
        for row in [&header].into_iter().chain(self.rows.values()) {
            writer.write_record(row).expect("rows of one length");
        }
        outputs::write(self.path, &writer.into_inner().expect("written to memory"))
    }
}

fn change_cell(change: Option<f64>) -> String {
    change.map_or(String::new(), |c| format!("{c:.6}"))
}

/// Where rows go: those of a part to a file of its own.
pub fn path(args: &Args) -> Option<PathBuf> {
    let path = args.stats.as_deref()?;
    let name = |part: Part| beside(path, &part.name());
    Some(args.part.map_or_else(|| path.to_owned(), name))
}

/// stats.csv, stats.part-0-of-3.csv
fn beside(path: &Path, part: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}.{part}.csv"))
}

/// The tables of parts beside this one.
fn parts_of(path: &Path) -> Vec<PathBuf> {
    let folder = glob::Pattern::escape(&path.parent().unwrap_or(Path::new("")).to_string_lossy());
    let stem = glob::Pattern::escape(&path.file_stem().unwrap_or_default().to_string_lossy());
    let pattern = Path::new(&folder).join(format!("{stem}.part-*-of-*.csv"));
    glob::glob(&pattern.to_string_lossy()).map_or_else(|_| Vec::new(), |found| found.flatten().collect())
}

/// Whether there are tables of parts to join.
pub fn has_parts(path: &Path) -> bool {
    !parts_of(path).is_empty()
}

/// The rows of a table that was written before; nothing if it is none.
fn older(path: &Path) -> Option<BTreeMap<u64, Vec<String>>> {
    let mut reader = csv::Reader::from_path(path).ok().filter(|_| path.is_file())?;
    let header = reader.headers().ok()?.clone();
    if header.iter().ne(HEADER.into_iter().chain(CHANGES)) {
        return None;
    }
    let row = |r: csv::StringRecord| Some((r.get(0)?.parse().ok()?, r.iter().map(str::to_owned).collect()));
    reader.into_records().map_while(Result::ok).map(row).collect()
}
