//! VTK XML files as VTK's own writers compress them, and as others may.

use glam::DVec3;
use meniscus::io::Budget;
use meniscus::io::particles::{ParticleFile, ReadError, read, read_bytes};
use std::{io::Write as _, num::NonZeroU64, path::Path};

fn bytes(content: &[u8]) -> Result<ParticleFile, ReadError> {
    read_bytes(Path::new("a.vtu"), content, &Budget::default())
}

/// By VTK 9.7: LZ4 in raw appended data and, big-endian, inline; LZMA in base64, appended and inline. Twenty points in blocks of 96
/// and 160 bytes, but for the last file.
#[test]
fn what_vtk_compresses() {
    for name in ["vtk_lz4_raw.vtu", "vtk_lz4_inline.vtu", "vtk_lzma_base64.vtu", "vtk_lzma_inline.vtp"] {
        let file = read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name)).expect(name);
        assert_eq!(file.positions.len(), 20, "{name}");
        assert_eq!(file.positions[..2], [DVec3::new(87.4375, 156.125, -244.4375), DVec3::new(157.625, -16.0, 7.8125)]);
        let velocities = file.velocities.expect("velocities");
        assert_eq!(velocities[..2], [DVec3::new(4.375, 3.25, 4.25), DVec3::new(-8.0, -7.5, 0.0)], "{name}");
        assert_eq!(file.classes, Some([0, 1].repeat(10)), "{name}");
    }
}

const POINTS: usize = 8192;

/// Values that pack well.
fn values() -> Vec<f32> {
    (0..3 * POINTS).map(|i| (i % 97) as f32).collect()
}

/// The array in blocks of so many bytes, after its header of 32 bits.
fn packed(block: usize, pack: impl Fn(&[u8]) -> Vec<u8>) -> Vec<u8> {
    let data: Vec<u8> = values().iter().flat_map(|v| v.to_le_bytes()).collect();
    let blocks: Vec<_> = data.chunks(block).map(pack).collect();
    let mut head = vec![blocks.len(), block, data.len() % block];
    head.extend(blocks.iter().map(Vec::len));
    [head.iter().flat_map(|v| (*v as u32).to_le_bytes()).collect(), blocks.concat()].concat()
}

fn vtu(compressor: &str, array: &[u8]) -> Vec<u8> {
    let head = format!(
        "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" compressor=\"{compressor}\"><UnstructuredGrid><Piece \
         NumberOfPoints=\"{POINTS}\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"appended\" \
         offset=\"0\"/></Points></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_"
    );
    [head.as_bytes(), array, b"</AppendedData></VTKFile>"].concat()
}

fn xz(block: &[u8], dictionary: u32) -> Vec<u8> {
    let mut options = lzma_rust2::XzOptions::with_preset(1);
    options.lzma_options.dict_size = dictionary;
    options.set_block_size(NonZeroU64::new(1 << 20));
    let mut writer = lzma_rust2::XzWriter::new(Vec::new(), options).expect("options");
    writer.write_all(block).and_then(|()| writer.finish()).expect("into memory")
}

#[test]
fn blocks_of_any_size() {
    let expected: Vec<DVec3> =
        values().as_chunks::<3>().0.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
    // Within a number, larger than what is unpacked at a time, and one that is all there is.
    for size in [1001, 16384, 3 * 4 * POINTS, 1 << 20] {
        let lz4 = vtu("vtkLZ4DataCompressor", &packed(size, lz4_flex::block::compress));
        assert_eq!(bytes(&lz4).expect("LZ4").positions, expected, "{size}");
        let lzma = vtu("vtkLZMADataCompressor", &packed(size, |b| xz(b, 1 << 16)));
        assert_eq!(bytes(&lzma).expect("LZMA").positions, expected, "{size}");
    }
}

#[test]
fn blocks_that_lie() {
    let refused = |content: &[u8], word: &str| {
        let message = bytes(content).expect_err(word).to_string();
        assert!(message.starts_with("a.vtu") && message.contains(word), "{word}: {message}");
    };
    let unlike = packed(4096, |b| lz4_flex::block::compress(&b[1..]));
    refused(&vtu("vtkLZ4DataCompressor", &unlike), "block 0 has 4095 bytes, 4096 promised");
    let more = packed(4096, |b| lz4_flex::block::compress(&[b, b"+"].concat()));
    refused(&vtu("vtkLZ4DataCompressor", &more), "compressed block 0");
    let more = packed(4096, |b| xz(&[b, b"+"].concat(), 1 << 16));
    refused(&vtu("vtkLZMADataCompressor", &more), "block 0 has more, 4096 promised");
    // The check at the end of the block, before index and footer.
    let spoilt = packed(1 << 20, |b| {
        let mut block = xz(b, 1 << 16);
        let middle = block.len() / 2;
        block[middle] ^= 1;
        block
    });
    refused(&vtu("vtkLZMADataCompressor", &spoilt), "compressed block 0");
    // A dictionary of a gigabyte, in a file of some kilobytes.
    refused(&vtu("vtkLZMADataCompressor", &packed(4096, |b| xz(b, 1 << 30))), "--max-memory");
    refused(&vtu("vtkBrotliDataCompressor", &unlike), "save with zlib, LZ4, LZMA");
    // One block that would be the whole of a disk.
    let mut huge = packed(1 << 20, lz4_flex::block::compress);
    huge[8..12].copy_from_slice(&0xf000_0000_u32.to_le_bytes());
    refused(&vtu("vtkLZ4DataCompressor", &huge), "--max-memory");
}

/// What is not read says what becomes of it; one that is not there is not there.
#[test]
fn vtkhdf_has_a_way_out() {
    let error = read_bytes(Path::new("a.vtkhdf"), b"\x89HDF\r\n", &Budget::default()).expect_err("refused");
    assert_eq!(error.to_string().split(';').next(), Some("a.vtkhdf: VTKHDF is not read"));
    assert!(error.to_string().contains(".vtu or .vtp in ParaView"), "{error}");
    assert!(matches!(read(Path::new("none.vtkhdf")), Err(ReadError::NotFound { .. })));
}
