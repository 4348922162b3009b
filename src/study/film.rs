//! Pictures in the making: samples pass by pass, their noise, and how a film that was broken off goes on.

use super::{random::Random, tracer::Tracer};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Strata of a pixel each way; a pass has one sample in each.
const STRATA: u32 = 4;
/// Samples a pixel of one pass.
pub const PASS: u32 = STRATA * STRATA;

/// What was gathered up to a pass: always the same numbers after the same passes, on however many threads.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    size: [u32; 2],
    passes: u32,
    /// Of each pixel: the sum of its passes' means, and of their squares.
    sums: Vec<[DVec3; 2]>,
}

/// At the start of a film's bytes; the digit is the version.
const MAGIC: &[u8; 8] = b"MENFILM1";

/// Bytes that are no film of this picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("it holds no samples of this picture")]
pub struct NotThisFilm;

impl Film {
    /// Without samples.
    pub fn new(size: [u32; 2]) -> Film {
        let pixels = size[0] as usize * size[1] as usize;
        Film { size, passes: 0, sums: vec![[DVec3::ZERO; 2]; pixels] }
    }

    /// Passes it has.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// Traces one more pass; `row` is told after each row of pixels.
    pub fn expose(&mut self, tracer: &Tracer, row: &(dyn Fn() + Sync)) {
        let (width, pass) = (self.size[0] as usize, self.passes);
        self.sums.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, sums)| {
            for (x, sum) in sums.iter_mut().enumerate() {
                let mean = pixel(tracer, [x, y], (y * width + x) as u64, pass);
                *sum = [sum[0] + mean, sum[1] + mean * mean];
            }
            row();
        });
        self.passes += 1;
    }

    /// Linear light of each pixel, row by row: the mean over its area.
    pub fn picture(&self) -> Vec<DVec3> {
        self.sums.iter().map(|s| s[0] / f64::from(self.passes.max(1))).collect()
    }

    /// Variance of each pixel's mean, as the passes' spread tells it; unknown (NaN) from fewer than two passes.
    pub fn variance(&self) -> Vec<DVec3> {
        let n = f64::from(self.passes);
        let of = |[sum, squares]: &[DVec3; 2]| (*squares - *sum * *sum / n).max(DVec3::ZERO) / (n * (n - 1.0));
        self.sums.iter().map(|s| if self.passes < 2 { DVec3::NAN } else { of(s) }).collect()
    }

    /// All there is, to go on from.
    pub fn bytes(&self) -> Vec<u8> {
        let head = [self.size[0], self.size[1], self.passes];
        let words = self.sums.iter().flatten().flat_map(|v| v.to_array());
        let mut bytes = MAGIC.to_vec();
        bytes.extend(head.into_iter().flat_map(u32::to_le_bytes));
        bytes.extend(words.flat_map(f64::to_le_bytes));
        let check = blake3::hash(&bytes);
        bytes.extend(check.as_bytes());
        bytes
    }

    /// What [`Film::bytes`] gave, for a picture of this size.
    pub fn from_bytes(size: [u32; 2], bytes: &[u8]) -> Result<Film, NotThisFilm> {
        let mut film = Film::new(size);
        let (content, check) = bytes.split_last_chunk::<32>().ok_or(NotThisFilm)?;
        let rest = content.strip_prefix(MAGIC).filter(|_| blake3::hash(content) == *check).ok_or(NotThisFilm)?;
        let (head, rest) = rest.split_at_checked(12).ok_or(NotThisFilm)?;
        let [width, height, passes] = [0, 4, 8].map(|at| u32::from_le_bytes([0, 1, 2, 3].map(|i| head[at + i])));
        let (words, tail) = rest.as_chunks::<8>();
        if [width, height] != size || !tail.is_empty() || words.len() != 6 * film.sums.len() {
            return Err(NotThisFilm);
        }
        film.passes = passes;
        let mut words = words.iter().map(|w| f64::from_le_bytes(*w));
        for value in film.sums.iter_mut().flatten() {
            *value = DVec3::from_array([0; 3].map(|_| words.next().unwrap_or_default()));
        }
        Ok(film)
    }
}

/// The mean of one pass's samples of a pixel, one in each stratum.
fn pixel(tracer: &Tracer, [x, y]: [usize; 2], index: u64, pass: u32) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for stratum in 0..PASS {
        let mut random = Random::of(index, u64::from(pass) * u64::from(PASS) + u64::from(stratum));
        let within = DVec2::new(
            (f64::from(stratum % STRATA) + random.unit()) / f64::from(STRATA),
            (f64::from(stratum / STRATA) + random.unit()) / f64::from(STRATA),
        );
        sum += tracer.light(tracer.view.ray(DVec2::new(x as f64, y as f64) + within), &mut random);
    }
    sum / f64::from(PASS)
}
