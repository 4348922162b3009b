//! Puts mutated content back into what surrounds it, with right checksums: else no mutation would get past them.

use std::io::{Cursor, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use npyz::npz::NpzWriter;
use npyz::zip::{CompressionMethod, write::FileOptions};

/// Packs what was mutated.
pub type Pack = fn(&[u8]) -> Vec<u8>;

pub fn gzip(content: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(content).and_then(|()| encoder.finish()).expect("into memory")
}

pub fn zlib(content: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(content).and_then(|()| encoder.finish()).expect("into memory")
}

/// An archive of arrays.
pub fn npz(arrays: &[(&str, &[u8])], method: CompressionMethod) -> Vec<u8> {
    let mut content = Cursor::new(Vec::new());
    let mut writer = NpzWriter::new(&mut content);
    let zip = writer.zip_writer();
    for (name, array) in arrays {
        let options = FileOptions::default().compression_method(method);
        zip.start_file(format!("{name}.npy"), options).expect("into memory");
        zip.write_all(array).expect("into memory");
    }
    zip.finish().expect("into memory");
    drop(writer);
    content.into_inner()
}

pub fn lz4(content: &[u8]) -> Vec<u8> {
    lz4_flex::block::compress(content)
}

/// In Houdini's container: half in a chunk that is copied, half in one of LZ4.
pub fn scf(content: &[u8]) -> Vec<u8> {
    let (copied, packed) = content.split_at(content.len() / 2);
    let chunk = |flags: u8, full: &[u8], body: &[u8]| {
        let sizes = [full.len(), full.len(), 16 + body.len()].map(|length| (length as u32).to_le_bytes()).concat();
        [&[2, 1, flags, 1][..], &sizes, body].concat()
    };
    let block = lz4(packed);
    let body = [&20_u32.to_le_bytes()[..], &(block.len() as u32).to_le_bytes(), &block].concat();
    [b"scf1\0\0\0\0\0\0\0\0", &chunk(2, copied, copied)[..], &chunk(1 << 5 | 16, packed, &body), b"\x001fcs"].concat()
}

/// With a dictionary that a small budget has room for.
pub fn xz(content: &[u8]) -> Vec<u8> {
    let mut options = lzma_rust2::XzOptions::with_preset(0);
    options.lzma_options.dict_size = 1 << 16;
    let mut writer = lzma_rust2::XzWriter::new(Vec::new(), options).expect("options");
    writer.write_all(content).and_then(|()| writer.finish()).expect("into memory")
}

/// A VTU file with three points and this as their inline data; or with as many as there are in its one block, which a compressor of
/// this name packs.
pub fn vtu(data: &[u8], compressed: Option<(&str, Pack)>) -> Vec<u8> {
    let (attributes, inline) = if let Some((name, pack)) = compressed {
        let block = pack(data);
        let head: Vec<u8> =
            [1, data.len() as u32, 0, block.len() as u32].iter().flat_map(|v| v.to_le_bytes()).collect();
        (format!(" compressor=\"{name}\""), STANDARD.encode(head) + &STANDARD.encode(block))
    } else {
        (String::new(), STANDARD.encode(data))
    };
    let points = if compressed.is_some() { (data.len() / 12).max(1) } else { 3 };
    format!(
        "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\"{attributes}><PolyData><Piece NumberOfPoints=\"{points}\"><Points>\
         <DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"binary\">{inline}</DataArray></Points></Piece>\
         </PolyData></VTKFile>"
    )
    .into_bytes()
}

/// A PNG file of 4 x 2 RGB texels (or what the header says) with these rows, filter bytes included.
pub fn png(header: &[u8; 13], rows: &[u8]) -> Vec<u8> {
    let mut content = b"\x89PNG\r\n\x1a\n".to_vec();
    for (name, data) in [(b"IHDR", &header[..]), (b"IDAT", &zlib(rows)), (b"IEND", &[])] {
        content.extend((data.len() as u32).to_be_bytes());
        content.extend(name);
        content.extend(data);
        content.extend([0; 4]);
    }
    mend_png(&mut content);
    content
}

/// Sets the length of a NumPy header to what it is.
pub fn mend_npy(content: &mut [u8]) {
    if let Some(end) = content.iter().position(|b| *b == b'\n').filter(|end| *end >= 10) {
        content[8..10].copy_from_slice(&((end - 9) as u16).to_le_bytes());
    }
}

/// Computes the checksums of all chunks, as far as they can be followed.
pub fn mend_png(content: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = content.get(at..at + 4).and_then(|bytes| bytes.try_into().ok()).map(u32::from_be_bytes) {
        let end = at + 8 + length as usize;
        let Some(chunk) = content.get(at + 4..end) else {
            break;
        };
        let mut crc = flate2::Crc::new();
        crc.update(chunk);
        match content.get_mut(end..end + 4) {
            Some(sum) => sum.copy_from_slice(&crc.sum().to_be_bytes()),
            None => break,
        }
        at = end + 4;
    }
}
