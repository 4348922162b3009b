//! Where a chart's points are kept, so that what was broken off goes on.

use super::points::Point;
use crate::outputs::{self, OutputError};
use std::{
    fs,
    path::{Path, PathBuf},
};

pub struct Store {
    place: PathBuf,
}

impl Store {
    pub fn open(output: &Path) -> Result<Store, OutputError> {
        let place = output.join("points");
        outputs::folder(&place)?;
        Ok(Store { place })
    }

    fn record(&self, key: &str) -> PathBuf {
        self.place.join(format!("{key}.json"))
    }

    /// The picture that was drawn, or a truth's.
    pub fn picture(&self, key: &str) -> PathBuf {
        self.place.join(format!("{key}.png"))
    }

    /// FLIP's map of it.
    pub fn error_map(&self, key: &str) -> PathBuf {
        self.place.join(format!("{key}-flip.png"))
    }

    /// What is known of a point; nothing if its pictures are gone or its record is not whole.
    pub fn point(&self, key: &str) -> Option<Point> {
        let there = self.picture(key).is_file() && self.error_map(key).is_file();
        serde_json::from_slice(&fs::read(self.record(key)).ok().filter(|_| there)?).ok()
    }

    pub fn keep(&self, key: &str, point: &Point) -> Result<(), OutputError> {
        let text = serde_json::to_string_pretty(point).unwrap_or_default();
        outputs::write(&self.record(key), text.as_bytes())
    }
}
