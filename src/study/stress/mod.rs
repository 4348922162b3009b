//! The known failure cases of screen-space liquids, swept: how far off a method is as a scene goes where methods fail.
//!
//! Every case has a closed form or a symmetry to be compared with; lengths are in particle radii, the radius is 1. A bound says
//! what a sound method stays within; what a method has no figure for (a direction, of optics that follow no rays) is left out.

mod angles;
mod clouds;
mod exact;
mod eye;
mod few;
mod motion;
mod same;
mod search;
mod shot;
mod volumes;

pub(crate) use super::search::degrees;
use crate::{Settings, host::HostError, prepare::PrepareError, study::reconstruct::ReconstructError};
pub use shot::Rig;

/// Why a case could not be run.
#[derive(Debug, thiserror::Error)]
pub enum StressError {
    /// The device or the renderer refused.
    #[error(transparent)]
    Host(#[from] HostError),
    /// The case's own particles have no surface.
    #[error(transparent)]
    Reconstruct(#[from] ReconstructError),
    /// The case's own particles could not be prepared.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
}

/// A figure that a case has at each of its steps.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// What it is, with its unit.
    pub name: &'static str,
    /// What a sound method stays within: at most this. Of a figure that is shown beside others, infinite.
    pub bound: f64,
    /// What it means to be beyond.
    pub beyond: &'static str,
}

/// Runs a method at some steps.
type Sweep = fn(&mut Rig, &Settings, &[f64]) -> Result<Vec<Step>, StressError>;

/// A failure case.
#[derive(Clone, Copy)]
pub struct Case {
    /// What it goes by.
    pub name: &'static str,
    /// What happens in it.
    pub about: &'static str,
    /// What changes from step to step, with its unit.
    pub x: &'static str,
    /// Methods that stay within its bounds: of the others nothing is promised, and that `field` or `imai16` is not named means that it does not.
    pub promised: &'static [&'static str],
    /// Its figures, in the order of a step's; the first is common to all cases.
    pub measures: &'static [Measure],
    steps: fn(Extent) -> Vec<f64>,
    run: Sweep,
}

/// How much of a sweep is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Some steps: enough to see a case fail.
    Small,
    /// All of them.
    Full,
}

impl Extent {
    /// Some of the steps, or all.
    fn of(self, some: &[f64], all: &[f64]) -> Vec<f64> {
        match self {
            Extent::Small => some.to_vec(),
            Extent::Full => all.to_vec(),
        }
    }
}

/// What a case found at one of its steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Where.
    pub x: f64,
    /// A figure for each of the case's measures; `None` where the method has none.
    pub found: Vec<Option<f64>>,
}

/// The step at which a method is furthest beyond a bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// Which of the case's measures.
    pub measure: usize,
    /// Where.
    pub x: f64,
    /// What was found there.
    pub found: f64,
}

/// The default, and the paper that it began with.
const BOTH: &[&str] = &["field", "imai16"];

/// All cases.
pub const CASES: &[Case] = &[
    angles::GRAZING,
    angles::CRITICAL,
    angles::RIMS,
    eye::DOLLY_BALL,
    eye::DOLLY_SURFACE,
    same::RESOLUTION,
    same::DISTANCE,
    same::OFFSET,
    same::SHUFFLED,
    few::NEIGHBOURS,
    few::SHEET,
    few::RADIUS,
    volumes::INTERFACES,
    volumes::THRESHOLD,
    motion::ORBIT,
    motion::DRIFT,
    search::SEARCH,
    search::RESIDUALS,
];

impl Case {
    /// Runs it with a method; `None` where the method has no figure that the case is about.
    pub fn run(&self, rig: &mut Rig, settings: &Settings, extent: Extent) -> Result<Vec<Step>, StressError> {
        rig.extent = extent;
        let mut steps = (self.run)(rig, settings, &(self.steps)(extent))?;
        // A figure that is no number is the worst there can be.
        for found in steps.iter_mut().flat_map(|s| s.found.iter_mut().flatten()).filter(|f| f.is_nan()) {
            *found = f64::INFINITY;
        }
        Ok(steps)
    }

    /// The worst fault of a run; `None` if it stays within all bounds.
    pub fn fault(&self, steps: &[Step]) -> Option<Fault> {
        let all = steps.iter().flat_map(|s| {
            let found = s.found.iter().enumerate();
            found.filter_map(|(measure, f)| f.map(|found| Fault { measure, x: s.x, found }))
        });
        // How many times the bound; of a bound of nothing, any.
        let beyond = |f: &Fault| match self.measures[f.measure].bound {
            0.0 => f.found * f64::MAX,
            bound => f.found / bound,
        };
        all.filter(|f| f.found > self.measures[f.measure].bound).max_by(|a, b| beyond(a).total_cmp(&beyond(b)))
    }
}

/// Pixels whose colour or direction is no number or infinite; every case asks for it.
const NO_NUMBER: Measure = Measure { name: "pixels that are no number", bound: 0.0, beyond: "a value is not finite" };

/// The median; `None` of nothing.
fn median(values: Vec<f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// What this share of values is not above; `None` of nothing.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get((share * values.len() as f64) as usize).copied()
}

/// Which part of so many it is, in percent; `None` of nothing.
fn percent(part: usize, of: usize) -> Option<f64> {
    (of > 0).then(|| 100.0 * part as f64 / of as f64)
}
