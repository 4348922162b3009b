//! The thread that encodes and writes pictures while the next one is drawn.

use super::{
    Args,
    film::{Film, Format},
    ms_since,
    plan::Plan,
    table::{Row, Table},
};
use crate::{compositing::Pixels, outputs, terminal};
use indicatif::{ProgressBar, ProgressStyle};
use meniscus::io::images::{picture_from_bytes, read_picture, srgb_bytes};
use std::{sync::mpsc::Receiver, time::Instant};

/// What becomes of one picture after the other.
pub enum Message {
    Drawn {
        shot: usize,
        /// Of the size rendered at.
        pixels: Box<Pixels>,
        row: Row,
    },
    /// It is there already.
    Kept { shot: usize },
    /// Its frame could not be had.
    Failed,
    /// That were all of them.
    Complete,
}

/// Errors that a thread may hand over.
type Failure = Box<dyn std::error::Error + Send + Sync>;

pub struct Writer<'a> {
    plan: &'a Plan,
    bar: &'a ProgressBar,
    table: Option<Table<'a>>,
    /// The last picture's sRGB bytes, for what has changed since.
    last: Option<Vec<[u8; 3]>>,
    films: Vec<Film<'a>>,
    /// Pictures that could not be had before the first of a film.
    owed: usize,
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
    pub fn new(args: &'a Args, plan: &'a Plan, bar: &'a ProgressBar) -> Result<Self, Failure> {
        let table = plan.stats.as_deref().map(|path| Table::new(path, plan));
        let size = plan.shots[0].exposures[0].picture.size;
        let format = Format { size, rate: args.fps, frames: plan.shots.len() };
        let films = plan.films.iter().map(|(path, kind)| Film::new(path, *kind, format)).collect::<Result<_, _>>()?;
        Ok(Writer { plan, bar, table, last: None, films, owed: 0 })
    }

    /// Writes pictures until no more come.
    pub fn run(mut self, messages: &Receiver<Message>) -> Result<(), Failure> {
        let mut whole = false;
        for message in messages {
            match message {
                Message::Drawn { shot, pixels, row } => self.write(shot, &pixels, row)?,
                Message::Kept { shot } => self.keep(shot)?,
                Message::Failed => {
                    self.bar.inc(1);
                    match self.last.clone() {
                        Some(last) => self.film(&last)?,
                        None => self.owed += 1,
                    }
                }
                Message::Complete => whole = true,
            }
        }
        self.table.as_mut().map_or(Ok(()), Table::write)?;
        for film in self.films.drain(..).filter(|_| whole) {
            film.finish()?;
        }
        Ok(())
    }

    /// Adds a picture to the films.
    fn film(&mut self, bytes: &[[u8; 3]]) -> Result<(), Failure> {
        for _ in 0..=std::mem::take(&mut self.owed) {
            self.films.iter_mut().try_for_each(|film| film.add(bytes))?;
        }
        Ok(())
    }

    /// One that is there: needed by what compares it with the next, and by films.
    fn keep(&mut self, index: usize) -> Result<(), Failure> {
        let (shot, next) = (&self.plan.shots[index], self.plan.shots.get(index + 1));
        let lacks = |table: &Table, shot| table.lacks_change(shot) && shot.number > self.plan.shots[0].number;
        let this = self.table.as_ref().is_some_and(|table| lacks(table, shot));
        let following = |table: &Table| next.is_some_and(|next| !next.kept || lacks(table, next));
        let compared = this || self.table.as_ref().is_some_and(following);
        let last = self.last.take();
        if compared || !self.films.is_empty() {
            let picture = &shot.exposures[0].picture;
            let file = shot.files.first().ok_or("a picture that is there has no name; report this")?;
            let bytes = srgb_bytes(&read_picture(file, &picture.max_memory)?.1);
            self.film(&bytes)?;
            if let Some(table) = self.table.as_mut().filter(|_| this) {
                table.set_change(shot, last.and_then(|last| change(&last, &bytes)));
            }
            self.last = Some(bytes);
        }
        Ok(())
    }

    fn write(&mut self, index: usize, pixels: &Pixels, mut row: Row) -> Result<(), Failure> {
        let shot = &self.plan.shots[index];
        let picture = &shot.exposures[0].picture;
        let begin = Instant::now();
        let pixels = pixels.average([0, 1].map(|i| picture.size[i] * picture.supersample), picture.supersample);
        let encoded: Result<Vec<_>, _> =
            shot.files.iter().map(|f| pixels.encode(f, picture, Some(&shot.label))).collect();
        let encoded = encoded?;
        row.encode_ms = ms_since(begin);
        if let Some(why) = row.note.take() {
            self.bar.suspend(|| terminal::complain(format!("meniscus: picture {}: {why}", shot.number)));
        }
        // Where there is alpha, as what is read again: straight bytes are not to the last bit what they were made of.
        let bytes = match (shot.files.first(), encoded.first()) {
            // Nobody compares or films it.
            _ if self.table.is_none() && self.films.is_empty() => Vec::new(),
            (Some(file), Some(bytes)) if pixels.has_alpha() => {
                srgb_bytes(&picture_from_bytes(file, bytes, &picture.max_memory)?.1)
            }
            _ => srgb_bytes(&pixels.rgb),
        };
        if let Some(table) = &mut self.table {
            row.change = self.last.as_ref().and_then(|last| change(last, &bytes));
            // Before the picture: one that is there has its row.
            table.add(row)?;
        }
        for (file, bytes) in shot.files.iter().zip(encoded) {
            outputs::write(file, &bytes)?;
        }
        self.film(&bytes)?;
        self.last = Some(bytes);
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
