//! What reading a file takes: a frame is not held twice. A binary of its own, because it counts what is allocated.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use base64::Engine as _;
use meniscus::io::particles::read;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

#[global_allocator]
static COUNTING: Counting = Counting;

// SAFETY: everything is left to the system's allocator; only sizes are noted.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(LIVE.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }
}

const COUNT: usize = 300_000;
/// Bytes of a position.
const EACH: usize = 24;
/// Buffers, and what libraries take for themselves.
const BESIDE: usize = 1 << 20;

fn floats(encode: impl Fn(f32) -> [u8; 4]) -> Vec<u8> {
    (0..3 * COUNT).flat_map(|i| encode(i as f32 * 0.25)).collect()
}

/// Each format, and whether its file is held beside the positions.
fn files() -> Vec<(&'static str, bool, Vec<u8>)> {
    let raw = floats(f32::to_le_bytes);
    let rows = |separator: &str| -> String {
        (0..COUNT).map(|i| format!("{i}{separator}{}{separator}0.5\n", 0.25 * i as f32)).collect()
    };
    let npy = |data: &[u8]| {
        let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({COUNT}, 3), }}\n");
        [b"\x93NUMPY\x01\0", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), data].concat()
    };
    let npz = |method| {
        let mut content = std::io::Cursor::new(Vec::new());
        let mut writer = npyz::npz::NpzWriter::new(&mut content);
        let options = npyz::zip::write::FileOptions::default().compression_method(method);
        writer.zip_writer().start_file("position.npy", options).expect("into memory");
        writer.zip_writer().write_all(&npy(&raw)).expect("into memory");
        writer.zip_writer().finish().expect("into memory");
        drop(writer);
        content.into_inner()
    };
    let mut bgeo = b"BgeoV".to_vec();
    bgeo.extend([5, COUNT as i32, 0, 0, 0, 0, 0, 0, 0].map(i32::to_be_bytes).concat());
    for point in floats(f32::to_be_bytes).chunks(12) {
        bgeo.extend([point, &1_f32.to_be_bytes()].concat());
    }
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(&bgeo).expect("into memory");
    let inline =
        base64::engine::general_purpose::STANDARD.encode([&(raw.len() as u32).to_le_bytes()[..], &raw].concat());
    let vtp = format!(
        "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\"><PolyData><Piece NumberOfPoints=\"{COUNT}\"><Points><DataArray \
         type=\"Float32\" NumberOfComponents=\"3\" format=\"binary\">{inline}</DataArray></Points></Piece></PolyData></VTKFile>"
    );
    let vtk = format!("# vtk DataFile Version 3.0\nt\nBINARY\nDATASET POLYDATA\nPOINTS {COUNT} float\n");
    let axes = "property float x\nproperty float y\nproperty float z\n";
    let ply = format!("ply\nformat binary_little_endian 1.0\nelement vertex {COUNT}\n{axes}end_header\n");
    let bounds = "ITEM: BOX BOUNDS pp pp pp\n0 1\n0 1\n0 1\n";
    let dump = format!("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{COUNT}\n{bounds}ITEM: ATOMS x y z\n{}", rows(" "));
    vec![
        ("raw.xyz", false, raw.clone()),
        ("a.npy", false, npy(&raw)),
        ("stored.npz", false, npz(npyz::zip::CompressionMethod::Stored)),
        ("deflated.npz", false, npz(npyz::zip::CompressionMethod::Deflated)),
        ("packed.bgeo", false, gzip.finish().expect("into memory")),
        ("a.bgeo", false, bgeo),
        ("inline.vtp", true, vtp.into()),
        ("a.vtk", true, [vtk.as_bytes(), &floats(f32::to_be_bytes)].concat()),
        ("a.ply", true, [ply.as_bytes(), &raw].concat()),
        ("a.csv", true, format!("x,y,z\n{}", rows(",")).into()),
        ("text.xyz", true, rows(" ").into()),
        ("a.lammpstrj", true, dump.into()),
    ]
}

#[test]
fn a_frame_is_not_held_twice() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, held, content) in files() {
        let path = folder.path().join(name);
        std::fs::write(&path, &content).expect("written");
        let size = content.len();
        drop(content);
        let before = LIVE.load(Relaxed);
        PEAK.store(before, Relaxed);
        let file = read(&path).unwrap_or_else(|error| panic!("{error}"));
        let peak = PEAK.load(Relaxed) - before;
        assert_eq!(file.positions.len(), COUNT, "{name}");
        let allowed = EACH * COUNT + if held { size } else { 0 } + BESIDE;
        let per = |bytes: usize| bytes as f64 / COUNT as f64;
        println!("{name}: {:.1} bytes a particle, its file {:.1}", per(peak), per(size));
        assert!(peak <= allowed, "{name}: {peak} bytes, {allowed} allowed");
    }
}
