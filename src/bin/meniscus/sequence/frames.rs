//! The frames of a simulation: which files they are, what numbers they have, which of them are wanted, and what pictures of them
//! are called.

use crate::{picture::Picture, scene::Scene};
use meniscus::io::{
    Budget,
    particles::{ParticleFile, ReadError, TimeStep, has_steps, time_steps},
};
use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
    slice,
    str::FromStr,
};

/// Why a sequence's files or pictures are not what they have to be.
#[derive(Debug, thiserror::Error)]
pub enum FramesError {
    #[error("{}: is no pattern of file names: {message}. Write `[*]` for a star that is meant", pattern.display())]
    Pattern { pattern: PathBuf, message: String },
    #[error(transparent)]
    Collection(#[from] ReadError),
    #[error("{}: cannot be looked through: {source}", path.display())]
    Folder { path: PathBuf, source: std::io::Error },
    #[error("{}: no file has such a name; check the folder, and put the pattern in quotation marks", .0.display())]
    None(PathBuf),
    #[error("no frames are named: give a pattern such as 'frames/*.vtk', or --scene with `particles`")]
    Nothing,
    #[error(
        "{} and {}: their names differ in more than numbers, so that their order is not known; name files of one series", .0.display(), .1.display()
    )]
    Unlike(PathBuf, PathBuf),
    #[error("{} and {}: both would be picture {number}; name one of them", first.display(), second.display())]
    Twice { number: u64, first: PathBuf, second: PathBuf },
    #[error("{} has time steps of its own, and {} is none of them; name one of them", collection.display(), file.display())]
    Mixed { collection: PathBuf, file: PathBuf },
    #[error("{} and {}: both have a time step at {time}; name one of them", first.display(), second.display())]
    SameTime { time: f64, first: PathBuf, second: PathBuf },
    #[error("--frames {selection}: none of the numbers is among them: there are {first} to {last}")]
    Unselected { selection: Selection, first: u64, last: u64 },
    #[error("{}: name numbered pictures, `#` for each digit, such as out/####.png", .0.display())]
    NoNumber(PathBuf),
}

/// One state of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    pub number: u64,
    /// What it is called: its file, or the collection that has several for it.
    pub file: PathBuf,
    /// Of a collection with several.
    step: Option<TimeStep>,
}

impl Frame {
    /// Reads its particles; also says how many were left out.
    pub fn read(&self, picture: &Picture) -> Result<(ParticleFile, usize), ReadError> {
        Scene::read(picture, Some(&self.file), self.step.as_ref())
    }

    /// All that is read of it.
    pub fn files(&self) -> &[PathBuf] {
        self.step.as_ref().map_or(slice::from_ref(&self.file), |step| &step.files)
    }
}

/// All of them, by their numbers; at least one.
#[derive(Debug)]
pub struct Frames {
    all: Vec<Frame>,
    /// From one number to the next where none is missing.
    stride: u64,
}

impl Frames {
    /// Files that are there by these names, and those that match them as patterns.
    pub fn find(patterns: &[PathBuf]) -> Result<Frames, FramesError> {
        let mut files = Vec::new();
        for pattern in patterns {
            if pattern.exists() {
                files.push(pattern.clone());
                continue;
            }
            let wrong = |message: String| FramesError::Pattern { pattern: pattern.clone(), message };
            let text = pattern.to_str().ok_or_else(|| wrong("it is not in UTF-8".into()))?;
            let before = files.len();
            for found in glob::glob(text).map_err(|e| wrong(e.to_string()))? {
                files.push(found.map_err(|e| FramesError::Folder { path: e.path().into(), source: e.into() })?);
            }
            if files.len() == before {
                return Err(FramesError::None(pattern.clone()));
            }
        }
        files.sort();
        files.dedup();
        let (mut steps, mut single) = (Vec::new(), Vec::new());
        for file in files {
            match if has_steps(&file) { time_steps(&file, &Budget::default())? } else { Vec::new() } {
                several if several.len() > 1 => steps.extend(several),
                _ => single.push(file),
            }
        }
        match (steps.first(), single.first()) {
            (None, _) => Frames::of(single),
            (Some(_), None) => Frames::in_time(steps),
            (Some(step), Some(file)) => {
                Err(FramesError::Mixed { collection: step.collection.clone(), file: file.clone() })
            }
        }
    }

    /// Numbers time steps from 0, as ParaView does: their files' names say nothing of time.
    fn in_time(mut steps: Vec<TimeStep>) -> Result<Frames, FramesError> {
        steps.sort_by(|a, b| a.time.total_cmp(&b.time));
        if let Some([a, b]) = steps.windows(2).find(|two| two[0].time == two[1].time) {
            let (first, second) = (a.collection.clone(), b.collection.clone());
            return Err(FramesError::SameTime { time: a.time, first, second });
        }
        let frame = |(number, step): (u64, TimeStep)| {
            let file = if let [file] = &step.files[..] { file } else { &step.collection };
            Frame { number, file: file.clone(), step: Some(step) }
        };
        Ok(Frames { all: (0..).zip(steps).map(frame).collect(), stride: 1 })
    }

    /// Numbers files by what their names differ in.
    fn of(mut files: Vec<PathBuf>) -> Result<Frames, FramesError> {
        files.sort();
        let names: Vec<_> = files.iter().map(|f| parts(f)).collect();
        let Some(first) = names.first() else { return Err(FramesError::Nothing) };
        if let Some(i) = names.iter().position(|n| n.text != first.text) {
            return Err(FramesError::Unlike(files[0].clone(), files[i].clone()));
        }
        let column = |c: usize| names.iter().map(|n| n.digits[c].parse().ok()).collect::<Option<Vec<u64>>>();
        let numbers = match files.len() {
            1 => first.digits.len().checked_sub(1).and_then(column).unwrap_or(vec![0]),
            _ => {
                let varying = (0..first.digits.len()).filter_map(column).filter(|n| n.iter().any(|v| *v != n[0]));
                let distinct = |n: &Vec<u64>| {
                    let mut sorted = n.clone();
                    sorted.sort_unstable();
                    sorted.windows(2).all(|w| w[0] < w[1])
                };
                let mut varying: Vec<_> = varying.collect();
                let best = varying.iter().position(distinct).unwrap_or(0);
                // Names such as 1 and 01 differ, and their numbers do not.
                if varying.is_empty() { vec![0; files.len()] } else { varying.swap_remove(best) }
            }
        };
        let mut all = BTreeMap::new();
        for (number, file) in numbers.into_iter().zip(files) {
            if let Some(first) = all.insert(number, file.clone()) {
                return Err(FramesError::Twice { number, first, second: file });
            }
        }
        let all: Vec<_> = all.into_iter().map(|(number, file)| Frame { number, file, step: None }).collect();
        let stride = all.windows(2).map(|w| w[1].number - w[0].number).min().unwrap_or(1);
        Ok(Frames { all, stride })
    }

    pub fn all(&self) -> &[Frame] {
        &self.all
    }

    /// The number of a frame that is so far on the way to the next.
    pub fn number(&self, index: usize, toward: f64) -> f64 {
        let number = |i: usize| self.all[i.min(self.all.len() - 1)].number as f64;
        number(index) + toward * (number(index + 1) - number(index))
    }

    /// When a frame comes, counted in frames from the first; where numbers are missing there is time between.
    pub fn place(&self, index: usize) -> f64 {
        (self.all[index].number - self.all[0].number) as f64 / self.stride as f64
    }

    /// Their own times, if they have any, counted from the first.
    pub fn times(&self) -> Option<Vec<f64>> {
        let time = |frame: &Frame| frame.step.as_ref().map(|step| step.time);
        let first = self.all.first().and_then(time)?;
        self.all.iter().map(|frame| Some(time(frame)? - first)).collect()
    }

    /// Where numbers are missing: the last before and the first after.
    pub fn gaps(&self) -> Vec<(u64, u64)> {
        let pairs = self.all.windows(2).map(|w| (w[0].number, w[1].number));
        pairs.filter(|(a, b)| b - a > self.stride).collect()
    }
}

/// A path taken apart into what is digits and what is not.
struct Parts {
    text: Vec<String>,
    digits: Vec<String>,
}

fn parts(path: &Path) -> Parts {
    let (mut text, mut digits) = (vec![String::new()], Vec::<String>::new());
    for c in path.to_string_lossy().chars() {
        if c.is_ascii_digit() {
            if digits.len() < text.len() {
                digits.push(String::new());
            }
            digits.last_mut().expect("one was pushed").push(c);
        } else {
            if digits.len() == text.len() {
                text.push(String::new());
            }
            text.last_mut().expect("there is always one").push(c);
        }
    }
    if digits.len() == text.len() {
        text.push(String::new());
    }
    Parts { text, digits }
}

/// Which numbers are wanted: `A-B:STEP`, of which all but `A` or `-B` may be missing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Selection {
    pub first: u64,
    /// Included.
    pub last: u64,
    pub step: u64,
}

impl Selection {
    pub fn has(&self, number: u64) -> bool {
        (self.first..=self.last).contains(&number) && (number - self.first).is_multiple_of(self.step)
    }
}

impl FromStr for Selection {
    type Err = String;

    fn from_str(text: &str) -> Result<Selection, String> {
        let wrong = || format!("\"{}\" is not A-B or A-B:STEP, such as 10-250:2", crate::terminal::plain(text));
        let number = |t: &str, otherwise| if t.is_empty() { Ok(otherwise) } else { t.parse().map_err(|_| wrong()) };
        let (range, step) = text.split_once(':').map_or((text, "1"), |(r, s)| (r, s));
        let step: u64 = step.parse().map_err(|_| wrong())?;
        let (first, last) = match range.split_once('-') {
            Some((a, b)) => (number(a, 0)?, number(b, u64::MAX)?),
            None if range.is_empty() => return Err(wrong()),
            None => (number(range, 0)?, number(range, 0)?),
        };
        if first > last || step == 0 {
            return Err(format!("{}: its end lies before its start, or its step is 0", wrong()));
        }
        Ok(Selection { first, last, step })
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-", self.first)?;
        if self.last < u64::MAX {
            write!(f, "{}", self.last)?;
        }
        if self.step > 1 { write!(f, ":{}", self.step) } else { Ok(()) }
    }
}

/// What numbered pictures are called: `#` for each digit, in the name of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    pub fn new(path: &Path) -> Result<Pattern, FramesError> {
        let wrong = || FramesError::NoNumber(path.into());
        let name = path.file_name().and_then(|n| n.to_str()).ok_or_else(wrong)?;
        let end = name.rfind('#').ok_or_else(wrong)? + 1;
        let begin = name[..end].trim_end_matches('#').len();
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        Ok(Pattern { folder, before: name[..begin].into(), digits: end - begin, after: name[end..].into() })
    }

    pub fn folder(&self) -> &Path {
        if self.folder == Path::new("") { Path::new(".") } else { &self.folder }
    }

    pub fn name(&self, number: u64) -> PathBuf {
        self.folder.join(format!("{}{number:0width$}{}", self.before, self.after, width = self.digits))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(names: &[&str]) -> Result<Vec<u64>, String> {
        let files = names.iter().map(PathBuf::from).collect();
        Frames::of(files).map(|f| f.all.iter().map(|f| f.number).collect()).map_err(|e| e.to_string())
    }

    #[test]
    fn numbers_are_what_names_differ_in() {
        assert_eq!(numbers(&["run2/f_10.vtk", "run2/f_9.vtk", "run2/f_007.vtk"]), Ok(vec![7, 9, 10]));
        // How many particles there are is no number of a frame, and need not differ.
        assert_eq!(numbers(&["f_2_500_p.ply", "f_1_500_p.ply", "f_3_499_p.ply"]), Ok(vec![1, 2, 3]));
        assert_eq!(numbers(&["a/1/p.csv", "a/2/p.csv"]), Ok(vec![1, 2]));
        assert_eq!(numbers(&["v2/f_14.bgeo"]), Ok(vec![14]));
        assert_eq!(numbers(&["f.bgeo"]), Ok(vec![0]));
        assert!(numbers(&["f_1.vtk", "g_2.vtk"]).is_err_and(|e| e.contains("differ in more")));
        assert!(numbers(&["f_1.vtk", "f_01.vtk"]).is_err_and(|e| e.contains("both would be picture")));
        assert!(numbers(&[]).is_err());
    }

    #[test]
    fn a_collection_of_several_times_is_its_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let set = |time, name| format!("<DataSet timestep=\"{time}\" file=\"{name}\"/>");
        let write =
            |name, sets: String| std::fs::write(at(name), format!("<VTKFile type=\"Collection\">{sets}</VTKFile>"));
        write("all.pvd", set(3, "a_10.vtu") + &set(1, "a_20.vtu") + &set(2, "a_4.vtu") + &set(2, "b.vtu"))
            .expect("written");
        write("one.pvd", set(0, "a_10.vtu")).expect("written");
        write("late.pvd", set(4, "c.vtu") + &set(6, "d.vtu")).expect("written");
        write("same.pvd", set(2, "c.vtu") + &set(6, "d.vtu")).expect("written");
        let found = |names: &[&str]| Frames::find(&names.iter().map(|name| at(name)).collect::<Vec<_>>());
        let files = |name| found(&[name]).map(|f| f.all.into_iter().map(|f| f.file).collect::<Vec<_>>());
        // In the order of time, not of names; what has several files is called as what names them.
        assert_eq!(files("all.pvd").expect("steps"), [at("a_20.vtu"), at("all.pvd"), at("a_10.vtu")]);
        assert_eq!(files("one.pvd").expect("one"), [at("one.pvd")]);
        let both = found(&["late.pvd", "all.pvd"]).expect("both");
        assert_eq!(both.all.iter().map(|f| f.number).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert_eq!(both.times(), Some(vec![0.0, 1.0, 2.0, 3.0, 5.0]));
        assert_eq!(both.all[1].files(), [at("a_4.vtu"), at("b.vtu")]);
        // As a pattern it is the same.
        assert_eq!(found(&["al*.pvd"]).expect("a pattern").all.len(), 3);
        let refused = |names: &[&str], words: &[&str]| {
            let said = found(names).expect_err("refused").to_string();
            assert!(words.iter().all(|w| said.contains(w)), "{said}");
        };
        refused(&["all.pvd", "same.pvd"], &["all.pvd", "same.pvd", "at 2"]);
        refused(&["all.pvd", "one.pvd"], &["one.pvd", "all.pvd has time steps"]);
        std::fs::write(at("torn.pvd"), "<VTKFile").expect("written");
        assert!(files("torn.pvd").expect_err("torn").to_string().contains("torn.pvd"));
    }

    #[test]
    fn missing_numbers_are_known_and_take_time() {
        let files = ["f10", "f20", "f30", "f60"].map(PathBuf::from).to_vec();
        let frames = Frames::of(files).expect("frames");
        assert_eq!(frames.gaps(), [(30, 60)]);
        assert_eq!((0..4).map(|i| frames.place(i)).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 5.0]);
    }

    #[test]
    fn selections_are_read_and_shown() {
        let wanted = |text: &str| {
            let s: Selection = text.parse().expect("a selection");
            assert_eq!(s.to_string().parse(), Ok(s));
            (0..10).filter(|n| s.has(*n)).collect::<Vec<_>>()
        };
        assert_eq!(wanted("3-5"), [3, 4, 5]);
        assert_eq!(wanted("1-8:3"), [1, 4, 7]);
        assert_eq!(wanted("7-"), [7, 8, 9]);
        assert_eq!(wanted("-2"), [0, 1, 2]);
        assert_eq!(wanted("4"), [4]);
        for bad in ["", "a", "5-3", "1-2:0", "1-2:", "1-2-3", ":2"] {
            assert!(bad.parse::<Selection>().is_err(), "{bad}");
        }
    }

    #[test]
    fn pictures_keep_their_numbers() {
        let pattern = |text: &str| Pattern::new(Path::new(text));
        assert_eq!(pattern("out/a##b####.png").expect("a pattern").name(12), Path::new("out/a##b0012.png"));
        assert_eq!(pattern("#.exr").expect("a pattern").name(1234), Path::new("1234.exr"));
        assert!(pattern("out/a.png").is_err());
        assert!(pattern("o##/a.png").is_err());
    }
}
