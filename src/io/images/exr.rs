//! OpenEXR environment maps, block by block, and pictures, by exr.

use std::collections::HashSet;
use std::io::{BufRead, Seek};
use std::path::Path;

use exr::block::UncompressedBlock;
use exr::math::Vec2;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::prelude::f16;
use rayon::prelude::*;

use super::map::{Fault, Frame, Target};
use super::{LABEL, Layers};
use crate::io::guard;

/// Blocks that are unpacked at once, so that every core has some.
const BATCH: usize = 16;
/// Bytes of such blocks at most: what is packed, unpacked and on the way is about four times as much.
const BATCH_BYTES: usize = 1 << 26;

pub(super) fn read(input: impl BufRead + Seek, frame: &Frame<'_>) -> Result<Target, Fault> {
    let reader = exr::block::read(input, false)?;
    let rgb = |header: &Header| {
        let channels = &header.channels.list;
        let place = |name: &str| channels.iter().position(|channel| channel.name.eq(name));
        Some([place("R")?, place("G")?, place("B")?])
    };
    let found = reader.headers().iter().enumerate().filter(|(_, header)| !header.deep);
    let (layer, channels) = found
        .filter_map(|(layer, header)| Some((layer, rgb(header)?)))
        .next()
        .ok_or(Fault::Corrupt("it has no layer of flat R, G and B".into()))?;
    let header = reader.headers()[layer].clone();
    if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(Fault::Corrupt("it has subsampled channels, which are not known".into()));
    }
    let window = header.shared_attributes.display_window;
    let offset = header.own_attributes.layer_position - window.position;
    let [width, height] = [window.size.width(), window.size.height()].map(|n| n.try_into().unwrap_or(u32::MAX));
    let mut target = frame.target(width, height)?;
    // The data may be more, or less, than what is on display.
    frame.check_texels(header.layer_size.width() as u64, header.layer_size.height() as u64)?;
    let chunks: usize = reader.headers().iter().map(|header| header.chunk_count).fold(0, usize::saturating_add);
    if chunks as u64 > frame.file / 8 {
        return Err(Fault::Corrupt(format!("it promises {chunks} blocks, and is too short for them")));
    }
    let most = reader.headers().iter().map(block_bytes).max().unwrap_or_default();
    frame.check_block(most)?;
    let batch = (BATCH_BYTES / most.max(1) as usize).clamp(1, BATCH);

    let meta = reader.meta_data().clone();
    let mut chunks = reader.all_chunks(false)?;
    let mut seen = HashSet::new();
    loop {
        let some: Vec<_> = chunks.by_ref().take(batch).collect::<Result<_, _>>()?;
        if some.is_empty() {
            break;
        }
        let mine = some.into_par_iter().filter(|chunk| chunk.layer_index == layer);
        let blocks: Vec<_> = mine
            .map(|chunk| {
                guard::helping(|| {
                    let tile = header.get_block_data_indices(&chunk.compressed_block)?;
                    match tile.is_largest_resolution_level() {
                        true => UncompressedBlock::decompress_chunk(chunk, &meta, false).map(Some),
                        false => Ok(None),
                    }
                })
            })
            .collect::<Result<_, exr::error::Error>>()?;
        for block in blocks.into_iter().flatten() {
            let position = (block.index.pixel_position.x(), block.index.pixel_position.y());
            if !seen.insert(position) {
                return Err(Fault::Corrupt("it has a block twice".into()));
            }
            place(&block, &header, channels, (offset.x(), offset.y()), &mut target)?;
        }
    }
    let [blocks_x, blocks_y] = blocks(&header);
    if seen.len() != blocks_x * blocks_y {
        return Err(Fault::Corrupt(format!("it has {} of {} blocks", seen.len(), blocks_x * blocks_y)));
    }
    Ok(target)
}

/// Bytes of an unpacked block.
fn block_bytes(header: &Header) -> u64 {
    let size = header.max_block_pixel_size();
    [size.width(), size.height()]
        .iter()
        .fold(header.channels.bytes_per_pixel as u64, |n, m| n.saturating_mul(*m as u64))
}

/// A picture of linear light, row by row, as 32-bit floats. The same picture has the same bytes: blocks, which are packed in
/// parallel, come in the order of their rows.
pub(super) fn write(
    [width, height]: [u32; 2],
    layers: &Layers<'_>,
    label: Option<&str>,
) -> exr::error::Result<Vec<u8>> {
    use exr::prelude::*;
    let size = Vec2(width as usize, height as usize);
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let mut attributes = LayerAttributes::default();
    attributes.other.extend(label.and_then(|l| Some((LABEL.into(), AttributeValue::Text(Text::new_or_none(l)?)))));
    let of = |values: &[[f32; 3]], i: usize| FlatSamples::F32(values.iter().map(|v| v[i]).collect());
    let mut channels: SmallVec<[_; 4]> =
        ["R", "G", "B"].into_iter().enumerate().map(|(i, name)| AnyChannel::new(name, of(layers.rgb, i))).collect();
    for (name, values) in [("A", layers.alpha), ("Z", layers.depth)] {
        channels.extend(values.map(|v| AnyChannel::new(name, FlatSamples::F32(v.to_vec()))));
    }
    for (i, name) in ["normal.X", "normal.Y", "normal.Z"].into_iter().enumerate() {
        channels.extend(layers.normal.map(|n| AnyChannel::new(name, of(n, i))));
    }
    let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// The label that [`write`] wrote.
pub(super) fn label(path: &Path) -> Option<String> {
    use exr::prelude::{AttributeValue, MetaData, Text};
    let data = MetaData::read_from_file(path, false).ok()?;
    match data.headers.first()?.own_attributes.other.get(&Text::from(LABEL))? {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    }
}

/// Blocks of the full size in each direction.
fn blocks(header: &Header) -> [usize; 2] {
    let (size, block) = (header.layer_size, header.max_block_pixel_size());
    [size.width().div_ceil(block.width().max(1)), size.height().div_ceil(block.height().max(1))]
}

/// Adds what the display window shows of a block; its first column is at `left`, its first row at `top` of the window.
fn place(
    block: &UncompressedBlock,
    header: &Header,
    channels: [usize; 3],
    (left, top): (i32, i32),
    target: &mut Target,
) -> Result<(), Fault> {
    let [width, height] = [block.index.pixel_size.width(), block.index.pixel_size.height()];
    let on_map = |at: usize, offset: i32| at as i64 + i64::from(offset);
    let x = on_map(block.index.pixel_position.x(), left);
    let y = on_map(block.index.pixel_position.y(), top);
    let [map_width, map_height] = target.size().map(i64::from);
    let columns = (-x).clamp(0, width as i64) as usize..(map_width - x).clamp(0, width as i64) as usize;
    let bytes: Vec<usize> = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample()).collect();
    let line_bytes = width * bytes.iter().sum::<usize>();
    let short = || Fault::Corrupt("a block is shorter than its header says".into());
    for row in 0..height {
        let at = y + row as i64;
        if !(0..map_height).contains(&at) || columns.is_empty() {
            continue;
        }
        let line = block.data.get(row * line_bytes..(row + 1) * line_bytes).ok_or_else(short)?;
        // One channel of the line after the other, in native byte order.
        let samples = channels.map(|channel| {
            let start = width * bytes[..channel].iter().sum::<usize>();
            let line = &line[start..start + width * bytes[channel]];
            (header.channels.list[channel].sample_type, line)
        });
        let colors = columns.clone().map(|i| samples.map(|(kind, line)| sample(kind, line, i)));
        target.add((x + columns.start as i64) as u32, 1, at as u32, colors)?;
    }
    Ok(())
}

fn sample(kind: SampleType, line: &[u8], i: usize) -> f32 {
    let word = |i: usize| [line[4 * i], line[4 * i + 1], line[4 * i + 2], line[4 * i + 3]];
    match kind {
        SampleType::F16 => f16::from_ne_bytes([line[2 * i], line[2 * i + 1]]).to_f32(),
        SampleType::F32 => f32::from_ne_bytes(word(i)),
        SampleType::U32 => u32::from_ne_bytes(word(i)) as f32,
    }
}

impl From<exr::error::Error> for Fault {
    fn from(error: exr::error::Error) -> Self {
        match error {
            exr::error::Error::Io(error) => error.into(),
            error => Fault::Corrupt(error.to_string()),
        }
    }
}
