//! Houdini's geometry, plain and in chunks of Blosc. Files in tests/corpus are made by a script after SideFX's description of the JSON,
//! their chunks by c-blosc 1.21; tests/corpus/README.md says more.

use glam::DVec3;
use meniscus::io::Budget;
use meniscus::io::particles::{ParticleFile, ReadError, describe, read_bytes};
use std::path::{Path, PathBuf};

fn corpus(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name)
}

fn content(name: &str) -> Vec<u8> {
    std::fs::read(corpus(name)).expect("a file")
}

fn read(bytes: &[u8]) -> Result<ParticleFile, ReadError> {
    read_bytes(Path::new("a.bgeo.sc"), bytes, &Budget::default())
}

fn refused(bytes: &[u8], words: &[&str]) {
    let message = read(bytes).expect_err("refused").to_string();
    assert!(message.starts_with("a.bgeo.sc") && message.contains("; "), "{message}");
    assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
}

/// With one place changed, which is there once.
fn changed(name: &str, from: &[u8], to: &[u8]) -> Vec<u8> {
    let mut bytes = content(name);
    let places: Vec<usize> = (0..=bytes.len() - from.len()).filter(|at| bytes[*at..].starts_with(from)).collect();
    assert_eq!(places.len(), 1, "{from:x?}");
    bytes.splice(places[0]..places[0] + from.len(), to.iter().copied());
    bytes
}

fn as_made(file: &ParticleFile, count: usize) {
    let at = |i: usize| DVec3::new(0.5 * i as f64, -(i as f64), 100.0 - i as f64);
    assert_eq!(file.positions, (0..count).map(at).collect::<Vec<_>>());
    // The first page's is one for all of it.
    let speed = |i: usize| if i < 512 { DVec3::new(1.0, 2.0, -0.5) } else { DVec3::new(i as f64, 0.0, 1.0) };
    assert_eq!(file.velocities, Some((0..count).map(speed).collect()));
    assert_eq!(file.ids, Some((0..count).map(|i| (3 * count - i) as u64).collect()));
    assert_eq!(file.classes, None);
}

#[test]
fn geometry_by_houdini() {
    for name in ["bgeo_houdini.bgeo", "bgeo_houdini_big.bgeo"] {
        let (file, contents) = describe(&corpus(name), &Budget::default()).expect(name);
        as_made(&file, 5);
        assert_eq!((contents.format.as_str(), contents.compression), ("BGEO, Houdini 20.0.547", None));
        let arrays: Vec<_> = contents.arrays.iter().map(|a| (a.name.as_str(), a.kind.as_str(), a.components)).collect();
        assert_eq!(arrays, [("P", "fpreal32", 4), ("name", "int32", 1), ("v", "fpreal32", 3), ("id", "int32", 1)]);
        let whole = content(name);
        for length in 0..whole.len() {
            let error = read(&whole[..length]).expect_err("cut off");
            assert!(matches!(error, ReadError::Malformed { .. } | ReadError::Empty { .. }), "{length}: {error}");
        }
    }
}

#[test]
fn chunks_of_blosc() {
    // Blocks of numbers byte by byte, shuffled, by both of its own compressors; the last ones of chunks are shorter, and whole.
    for name in ["bgeo_lz4.bgeo", "bgeo_blosclz.bgeo"] {
        let (file, contents) = describe(&corpus(name), &Budget::default()).expect(name);
        as_made(&file, 700);
        assert_eq!(contents.compression.as_deref(), Some("Blosc"));
        let whole = content(name);
        for length in (12..whole.len()).step_by(61).chain([whole.len() - 1]) {
            assert!(read(&whole[..length]).is_err(), "{name} cut off at {length}");
        }
    }
    // Copied, and by zlib.
    let plain = content("bgeo_houdini.bgeo");
    let chunks = |flags: u8, body: &[u8], full: usize| {
        let sizes = [full, full, 16 + body.len()].map(|n| (n as u32).to_le_bytes()).concat();
        [b"scf1\0\0\0\0\0\0\0\0\x02\x01", &[flags, 4][..], &sizes, body, b"\0\0\0\0\0\0\0\0\x001fcs"].concat()
    };
    as_made(&read(&chunks(2, &plain, plain.len())).expect("copied"), 5);
    let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut zlib, &plain).expect("into memory");
    let zlib = zlib.finish().expect("into memory");
    let block = [&20_u32.to_le_bytes()[..], &(zlib.len() as u32).to_le_bytes(), &zlib].concat();
    as_made(&read(&chunks(3 << 5 | 16, &block, plain.len())).expect("zlib"), 5);
    // What else there is is named, and the way out.
    refused(&chunks(4 << 5 | 16, &block, plain.len()), &["Zstandard", "gconvert"]);
    refused(&chunks(2 << 5 | 16, &block, plain.len()), &["Snappy", ".bgeo.gz"]);
    refused(&chunks(1 << 5 | 4 | 16, &block, plain.len()), &["bits are shuffled", "gconvert"]);
    // Blocks that lie.
    refused(&chunks(3 << 5 | 16, &block, plain.len() + 1), &["a block is corrupt"]);
    refused(&chunks(1 << 5 | 16, &block, plain.len()), &["a block is corrupt"]);
    refused(&chunks(16, &block, plain.len()), &["a block is corrupt"]);
    refused(&chunks(3 << 5 | 16, &block[..block.len() - 9], plain.len()), &["outside of its chunk"]);
    refused(&chunks(3 << 5 | 16, &[&[0xff; 4], &block[4..]].concat(), plain.len()), &["outside of its chunk"]);
    refused(&chunks(3 << 5 | 16, &block, u32::MAX as usize), &["--max-memory"]);
    refused(&chunks(2, &plain, plain.len() + 1), &["outside of its chunk"]);
    let mut open = chunks(2, &plain, plain.len());
    open.truncate(open.len() - 1);
    refused(&open, &["without its index"]);
    refused(b"scf1\0\0\0\0\0\0\0\0\0\0\0\x001fcs", &["ends within"]);
}

#[test]
fn geometry_that_lies() {
    let file = "bgeo_houdini.bgeo";
    // Packs, pages and numbers that do not belong to each other.
    refused(&changed(file, b"@\x21\x02\x03\x01", b"@\x21\x02\x02\x01"), &["`P`", "packs of [2, 1]"]);
    refused(&changed(file, b"@\x21\x02\x03\x01", b"@\x21\x02\x04\0"), &["`P`", "packs of [4, 0]"]);
    let points =
        |count: u8| changed(file, b"pointcount&\x03\x13\x05", &[b"pointcount&\x03\x13", &[count][..]].concat());
    refused(&points(6), &["`P`", "16 numbers"]);
    refused(&points(4), &["`P`", "16 numbers, 13 expected"]);
    assert_eq!(read(&points(5)).expect("as it was").positions.len(), 5);
    refused(&changed(file, b"pointcount&", b"pointcounT&"), &["how many points"]);
    refused(&changed(file, b"\x01P&", b"\x01Q&"), &["no positions", "Q, name, v, id"]);
    // Far more numbers than there are bytes.
    let many = [b"@\x19\xf4".as_slice(), &[0xff; 4]].concat();
    refused(&changed(file, b"@\x19\x10", &many), &["--max-memory"]);
    refused(&changed(file, b"@\x19\x10", b"@\x19\xf9"), &["0xf9"]);
    refused(&changed(file, b"@\x19\x10", b"@\x77\x10"), &["numbers expected"]);
    let deep = [b"\x7fNSJb".as_slice(), b"[\x27\x01a", &[b'['; 100]].concat();
    refused(&deep, &["64 deep"]);
    refused(b"\x7fNSJb[&\x05", &["string 5 was not defined"]);
    refused(b"\x7fNSJc[]", &["geometry by Houdini"]);
    // Half floats: one third, the least, minus infinity.
    let places = [0x3555_u16, 0x0001, 0xfc00].map(u16::to_le_bytes).concat();
    let tuple = [
        b"\x7fNSJb[\x27\x0apointcount\x21\x01\x27\x0aattributes[\x27\x0fpointattributes[[[\x27\x04type\x27\x07numeric"
            .as_slice(),
        b"\x27\x04name\x27\x01P][\x27\x06values[\x27\x04size\x21\x03\x27\x06tuples[@\x18\x03",
        &places,
        b"]]]]]]]",
    ]
    .concat();
    let position = read(&tuple).expect("a tuple").positions[0];
    assert_eq!(position, DVec3::new(0.333251953125, 2_f64.powi(-24), f64::NEG_INFINITY));
}
