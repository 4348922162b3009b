//! PNG environment maps, row by row, and pictures, by png.

use std::fs::File;
use std::io::{BufRead, BufReader, Seek};
use std::path::Path;

use png::{ColorType, Decoder, Transformations};

use super::LABEL;
use super::map::{Fault, Frame, Target};
use crate::srgb::decode_srgb;

/// First column and row, and the steps between, of Adam7's seven passes.
const ADAM7: [[u32; 4]; 7] =
    [[0, 8, 0, 8], [4, 8, 0, 8], [0, 4, 4, 8], [2, 4, 0, 4], [0, 2, 2, 4], [1, 2, 0, 2], [0, 1, 1, 2]];

pub(super) fn read(input: impl BufRead + Seek, frame: &Frame<'_>) -> Result<Target, Fault> {
    let mut decoder = Decoder::new(input);
    // What these may unpack to is nobody's business here.
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    decoder.set_transformations(Transformations::EXPAND);
    let info = decoder.read_header_info()?;
    let (width, height, interlaced) = (info.width, info.height, info.interlaced);
    let mut target = frame.target(width, height)?;
    let mut reader = decoder.read_info()?;
    let (color, depth) = reader.output_color_type();
    let channels = color.samples();
    let gray = matches!(color, ColorType::Grayscale | ColorType::GrayscaleAlpha);
    // Every value of light there can be, once.
    let wide = depth == png::BitDepth::Sixteen;
    let most = if wide { u16::MAX } else { u8::MAX.into() };
    let light: Vec<f32> = (0..=most).map(|v| decode_srgb(f32::from(v) / f32::from(most))).collect();
    let passes: &[[u32; 4]] = if interlaced { &ADAM7 } else { &[[0, 1, 0, 1]] };
    for &[x, step, first, rows] in passes {
        if x >= width {
            continue;
        }
        for y in (first..height).step_by(rows as usize) {
            let row = reader.next_interlaced_row()?.ok_or(Fault::Corrupt("it ends within its rows".into()))?;
            let sample = |texel: &[u8], channel: usize| {
                let value = match wide {
                    true => u16::from_be_bytes([texel[2 * channel], texel[2 * channel + 1]]),
                    false => texel[channel].into(),
                };
                light[usize::from(value)]
            };
            let colors = row.data().chunks_exact(channels * if wide { 2 } else { 1 }).map(|texel| match gray {
                true => [sample(texel, 0); 3],
                false => [0, 1, 2].map(|channel| sample(texel, channel)),
            });
            target.add(x, step, y, colors)?;
        }
    }
    Ok(target)
}

impl From<png::DecodingError> for Fault {
    fn from(error: png::DecodingError) -> Self {
        match error {
            png::DecodingError::IoError(error) => error.into(),
            error => Fault::Corrupt(error.to_string()),
        }
    }
}

/// A picture of sRGB bytes, with a label if there is one.
pub(super) fn write(size: [u32; 2], rgb: &[[u8; 3]], label: Option<&str>) -> Result<Vec<u8>, png::EncodingError> {
    encode(size, rgb.as_flattened(), ColorType::Rgb, label)
}

/// The same with straight alpha.
pub(super) fn write_alpha(
    size: [u32; 2],
    rgba: &[[u8; 4]],
    label: Option<&str>,
) -> Result<Vec<u8>, png::EncodingError> {
    encode(size, rgba.as_flattened(), ColorType::Rgba, label)
}

fn encode(
    [width, height]: [u32; 2],
    samples: &[u8],
    color: ColorType,
    label: Option<&str>,
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    if let Some(label) = label {
        encoder.add_text_chunk(LABEL.into(), label.into())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(samples)?;
    writer.finish()?;
    Ok(bytes)
}

/// The label that [`write`] wrote.
pub(super) fn label(path: &Path) -> Option<String> {
    let reader = Decoder::new(BufReader::new(File::open(path).ok()?)).read_info().ok()?;
    let mut texts = reader.info().uncompressed_latin1_text.iter();
    texts.find(|t| t.keyword == LABEL).map(|t| t.text.clone())
}
