//! Radiance environment maps, row by row, by image.

use std::io::{BufRead, Cursor, Read, Seek};

use image::codecs::hdr::HdrDecoder;
use image::{ImageDecoder, ImageError};

use super::map::{Fault, Frame, Target};

/// No header is longer.
const HEADER: u64 = 1 << 16;

pub(super) fn read(mut input: impl BufRead + Seek, frame: &Frame<'_>) -> Result<Target, Fault> {
    // What the decoder calls strict refuses `#?RGBE`, the other first line that there is.
    let (width, height) = HdrDecoder::new_nonstrict((&mut input).take(HEADER))?.dimensions();
    let mut target = frame.target(width, height)?;
    // The decoder reads all of an image or nothing, but takes no byte more than that: so each row is an image of its own.
    let header = format!("#?RADIANCE\n\n-Y 1 +X {width}\n");
    let mut row = vec![[0.0_f32; 3]; width as usize];
    for y in 0..height {
        let one = HdrDecoder::new(Cursor::new(header.as_bytes()).chain(&mut input))?;
        one.read_image(bytemuck::cast_slice_mut(&mut row))?;
        target.add(0, 1, y, row.iter().copied())?;
    }
    Ok(target)
}

impl From<ImageError> for Fault {
    fn from(error: ImageError) -> Self {
        match error {
            ImageError::IoError(error) => error.into(),
            error => Fault::Corrupt(error.to_string()),
        }
    }
}
