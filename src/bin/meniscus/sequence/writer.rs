//! The thread that encodes and writes pictures while the next one is drawn.

use super::{
    Args, ms_since,
    plan::Plan,
    table::{Row, Table},
};
use crate::{outputs, render::average, terminal};
use indicatif::{ProgressBar, ProgressStyle};
use meniscus::io::images::{encode_labelled, read_picture, srgb_bytes};
use std::{sync::mpsc::Receiver, time::Instant};

/// What becomes of one picture after the other.
pub enum Message {
    Drawn {
        shot: usize,
        /// Of the size rendered at.
        pixels: Vec<[f32; 3]>,
        row: Row,
    },
    /// It is there already.
    Kept,
    /// Its frame could not be had.
    Failed,
}

/// Errors that a thread may hand over.
type Failure = Box<dyn std::error::Error + Send + Sync>;

pub struct Writer<'a> {
    plan: &'a Plan,
    bar: &'a ProgressBar,
    table: Option<Table<'a>>,
    /// The last picture's sRGB bytes, for what has changed since.
    last: Option<Vec<[u8; 3]>>,
}

/// A bar for pictures that are to be made, with the time that is left.
pub fn bar(length: usize) -> ProgressBar {
    let template = "pictures [{bar:30}] {pos}/{len}, {per_sec}, {eta} left";
    let style = ProgressStyle::with_template(template).expect("a constant template");
    let bar = ProgressBar::new(length as u64).with_style(style);
    bar.enable_steady_tick(std::time::Duration::from_secs(1));
    bar
}

impl<'a> Writer<'a> {
    pub fn new(args: &'a Args, plan: &'a Plan, bar: &'a ProgressBar) -> Self {
        let table = args.stats.as_deref().map(|path| Table::new(path, plan));
        Writer { plan, bar, table, last: None }
    }

    /// Writes pictures until no more come.
    pub fn run(mut self, messages: &Receiver<Message>) -> Result<(), Failure> {
        for message in messages {
            match message {
                Message::Drawn { shot, pixels, row } => self.write(shot, &pixels, row)?,
                Message::Kept => self.last = None,
                Message::Failed => {
                    self.last = None;
                    self.bar.inc(1);
                }
            }
        }
        self.table.as_mut().map_or(Ok(()), Table::write)?;
        Ok(())
    }

    fn write(&mut self, index: usize, pixels: &[[f32; 3]], mut row: Row) -> Result<(), Failure> {
        let shot = &self.plan.shots[index];
        let picture = &shot.exposures[0].picture;
        let begin = Instant::now();
        let pixels = average(pixels, [0, 1].map(|i| picture.size[i] * picture.supersample), picture.supersample);
        let encoded: Result<Vec<_>, _> =
            shot.files.iter().map(|f| encode_labelled(f, picture.size, &pixels, Some(&shot.label))).collect();
        row.encode_ms = ms_since(begin);
        if let Some(why) = row.note.take() {
            self.bar.suspend(|| terminal::complain(format!("meniscus: picture {}: {why}", shot.number)));
        }
        if let Some(table) = &mut self.table {
            let bytes = srgb_bytes(&pixels);
            let before = index.checked_sub(1).map(|i| &self.plan.shots[i]);
            let last = self
                .last
                .take()
                .or_else(|| read_picture(before?.files.first()?, &picture.max_memory).ok().map(|p| srgb_bytes(&p.1)));
            row.change = last.and_then(|last| change(&last, &bytes));
            self.last = Some(bytes);
            // Before the picture: one that is there has its row.
            table.add(row)?;
        }
        for (file, bytes) in shot.files.iter().zip(encoded?) {
            outputs::write(file, &bytes)?;
        }
        self.bar.inc(1);
        Ok(())
    }
}

/// Mean difference of two pictures' colours, of 1.
fn change(last: &[[u8; 3]], now: &[[u8; 3]]) -> Option<f64> {
    if last.len() != now.len() {
        return None;
    }
    let both = last.as_flattened().iter().zip(now.as_flattened());
    let sum: u64 = both.map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    Some(sum as f64 / (255 * 3 * now.len()) as f64)
}
