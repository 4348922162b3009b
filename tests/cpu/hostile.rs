//! Files that lie: each was once read wrongly, slowly, with too much memory, or refused though it is valid. The small ones are
//! kept in `tests/corpus`; what is larger is made here.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use glam::DVec3;
use meniscus::io::Budget;
use meniscus::io::particles::{At, ParticleFile, ReadError, read, read_bytes, read_within};

pub(super) fn corpus(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name)
}

pub(super) fn bytes(name: &str, content: impl AsRef<[u8]>) -> Result<ParticleFile, ReadError> {
    read_bytes(Path::new(name), content.as_ref(), &Budget::default())
}

/// The message of refusing `content`, which is one line that can be printed, soon and not long.
fn refused(name: &str, content: impl AsRef<[u8]>) -> String {
    let start = Instant::now();
    let error = bytes(name, content).expect_err(name);
    assert!(!matches!(error, ReadError::Panicked { .. }), "{error:?}");
    assert!(start.elapsed().as_secs() < 5, "{name} took {:?}", start.elapsed());
    let message = error.to_string();
    assert!(message.starts_with(name) && message.contains("; "), "{message}");
    assert!(message.chars().count() < 500 && !message.chars().any(char::is_control), "{message}");
    message
}

fn line_of(error: &ReadError) -> Option<u64> {
    match error {
        ReadError::Malformed { at: At::Line(line), .. } => Some(*line),
        _ => None,
    }
}

#[test]
fn kept_files_are_read_right_or_refused_with_their_line() {
    // Decimal commas, repeated names: the line, and a word of the message.
    for (name, line, word) in [
        ("xyz_locale.xyz", 1, "decimal points"),
        ("csv_nohead_locale.csv", 1, "decimal"),
        ("ply_dupbin.ply", 5, "`x` is there twice"),
        ("ply_dupelem.ply", 7, "`vertex` is there twice"),
        ("ply_count_overflow.ply", 3, "number of entries"),
    ] {
        let error = read(&corpus(name)).expect_err(name);
        assert_eq!(line_of(&error), Some(line), "{error}");
        assert!(error.to_string().contains(word), "{error}");
    }
    for name in ["npy_nested_header.npy", "npz_nested_header.npz"] {
        let start = Instant::now();
        let error = read(&corpus(name)).expect_err(name);
        assert!(matches!(error, ReadError::WrongShape { .. }), "{error}");
        assert!(start.elapsed().as_millis() < 500, "{name} took {:?}", start.elapsed());
    }
    let error = read(&corpus("csv_escape.csv")).expect_err("no positions").to_string();
    assert!(error.contains("found a\\u{1b}[31mred") && !error.contains('\x1b'), "{error}");
    for name in ["bgeo_float3.bgeo", "bgeo_int2.bgeo"] {
        let file = read(&corpus(name)).expect(name);
        assert_eq!(file.positions.len(), 30);
        let (x, y) = (f32::from_bits(0x3f23_0fec), f32::from_bits(0x3e8a_217c));
        let first = if name == "bgeo_int2.bgeo" { file.positions[0] } else { DVec3::new(x.into(), y.into(), 0.0) };
        assert_eq!([first.x, first.y], [x, y].map(f64::from), "{name}");
    }
    let file = read(&corpus("xyz_bom4.xyz")).expect("a byte-order mark is no element");
    let text = std::fs::read_to_string(corpus("xyz_bom4.xyz")).expect("UTF-8");
    let first: Vec<f64> =
        text.trim_start_matches('\u{feff}').split_whitespace().take(3).map(|w| w.parse().unwrap()).collect();
    assert_eq!(file.positions[0].to_array(), first[..]);
}

#[test]
fn a_nested_numpy_header_takes_no_time() {
    for levels in [2, 64, 4000] {
        let descr = format!("{}'<f4'{}", "[('x',".repeat(levels), ")]".repeat(levels));
        let mut header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': (3, 3), }}");
        header.truncate(9_990);
        let npy = [b"\x93NUMPY\x01\0", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), &[0; 36]].concat();
        refused("a.npy", npy);
    }
    let header = |text: &str| [b"\x93NUMPY\x01\0", &(text.len() as u16).to_le_bytes()[..], text.as_bytes()].concat();
    for text in [
        "{'descr': '<f4', 'fortran_order': False, 'shape': ((((3, 3)))), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (-3, 3), }",
        "{'descr': '<f4', 'descr': '<f8', 'fortran_order': False, 'shape': (3, 3), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (4611686018427387904, 3), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (18446744073709551615, 3), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1000000, 3), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3), } trailing",
    ] {
        refused("a.npy", header(text));
    }
    let two_extra = [header("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }"), vec![0; 14]].concat();
    assert!(refused("a.npy", two_extra).contains("2 bytes after"));
}

/// Inputs of some kilobytes that unpack to gigabytes.
#[test]
fn bombs_are_refused_before_they_are_held() {
    // Points of a BGEO file, in gzip: 400 MB of zeros.
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(b"BgeoV").unwrap();
    gzip.write_all(&[5, 25_000_000, 0, 0, 0, 0, 0, 0, 0].map(i32::to_be_bytes).concat()).unwrap();
    for _ in 0..400 {
        gzip.write_all(&vec![0; 1_000_000]).unwrap();
    }
    let message = refused("a.bgeo", gzip.finish().unwrap());
    assert!(message.contains("positions would take") && message.contains("--max-memory (now 2G)"), "{message}");

    // A thousand pieces that name one block of a million positions.
    let mut zlib = ZlibEncoder::new(Vec::new(), Compression::best());
    zlib.write_all(&vec![0; 3_000_000]).unwrap();
    let block = zlib.finish().unwrap();
    let head = [1, 3_000_000, 0, block.len() as u32].map(u32::to_le_bytes).concat();
    let piece = "<Piece NumberOfPoints=\"1000000\"><Points><DataArray type=\"Int8\" NumberOfComponents=\"3\" \
                 format=\"appended\" offset=\"0\"/></Points></Piece>";
    let xml = format!(
        "<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>{}</UnstructuredGrid>",
        piece.repeat(1000)
    );
    let vtu =
        [xml.as_bytes(), b"<AppendedData encoding=\"raw\">_", &head, &block, b"</AppendedData></VTKFile>"].concat();
    assert!(refused("a.vtu", &vtu).contains("positions would take"));

    // Counts that nothing follows.
    refused("a.vtk", "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET POLYDATA\nPOINTS 9223372036854775807 float\n");
    refused(
        "a.vtk",
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 6148914691236517206 float\n1 2 3\n",
    );
    refused(
        "a.ply",
        "ply\nformat binary_little_endian 1.0\nelement a 9000000000000000000\nproperty float x\nend_header\n",
    );
    refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 99\nend_header\n");
    // An archive's directory of 2^40 arrays.
    let mut zip = b"PK\x06\x06".to_vec();
    zip.extend([0; 20]);
    zip.extend([1_u64 << 40, 1 << 40, 46 << 40, 0].map(u64::to_le_bytes).concat());
    zip.extend(b"PK\x06\x07\0\0\0\0");
    zip.extend([0; 8]);
    zip.extend(b"\x01\0\0\0PK\x05\x06\0\0\0\0\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\0\0");
    assert!(refused("a.npz", zip).contains("promises 1099511627776 arrays"));
}

#[test]
fn the_budget_can_be_raised() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xyz");
    std::fs::write(&path, vec![0; 12 * 100_000]).unwrap();
    let error = read_within(&path, &Budget::new(1 << 20)).expect_err("1.2 MB in 1 MiB");
    assert!(
        matches!(error, ReadError::TooLarge { .. }) && error.to_string().contains("--max-memory (now 1M)"),
        "{error}"
    );
    assert_eq!(read_within(&path, &Budget::new(4 << 20)).unwrap().positions.len(), 100_000);
}

#[test]
fn text_that_can_be_read_in_two_ways_is_refused() {
    for (name, content, line, word) in [
        ("a.xyz", "0,5 1,5 2,5\n", 1, "comma"),
        ("a.xyz", "1.5 2.5 3.5\n1,234.5 2 3\n", 2, "comma"),
        ("a.xyz", "0,637,0,270,0,041\n0,1,0,2,0,3\n", 1, "decimal commas"),
        ("a.xyz", "1 2 3\n1 2 3 4\n", 2, "4 columns"),
        ("a.xyz", "1.5;2.5;3.5\n", 1, "found"),
        ("a.xyz", "x y z\n1 2 3\n", 1, "headings"),
        ("a.xyz", "H 1 2 3\n1 2 3 4\n", 2, "element"),
        ("a.xyz", "1e5 1d5 2\n", 1, "`1d5`"),
        ("a.xyz", "0x1p3 1 2\n", 1, "`0x1p3`"),
        ("a.xyz", "3\n0 0 0\n1 1 1\n2 2 2\n", 1, "2 follow"),
        ("a.csv", "x;y;z\n0,5;1,5;2,5\n", 2, "decimal points"),
        ("a.csv", "x,y,z\n\"0,5\",\"1,5\",\"2,5\"\n", 2, "decimal points"),
        ("a.csv", "x,y,z\n0,5,1,5,2,5\n", 2, "columns"),
        ("a.csv", "x,y,z\n1,2,3\nx,y,z\n4,5,6\n", 3, "found `x`"),
        ("a.csv", "x,y,z,x\n1,2,3,4\n", 1, "there twice"),
        ("a.csv", "x,y,z,class,class\n1,2,3,0,1\n", 1, "there twice"),
        ("a.csv", "x,y,z\n1 234,2,3\n", 2, "number expected"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3 4\n",
            8,
            "more numbers",
        ),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n4 5 6\n",
            9,
            "more lines",
        ),
        ("a.ply", "ply\nformat ascii 2.0\nend_header\n", 2, "not a line"),
    ] {
        let message = refused(name, content);
        assert!(message.contains(word) && message.contains(&format!("{name}, line {line}:")), "{content:?}: {message}");
    }
    // One line of everything, or lines that end as on old Macs.
    assert!(refused("a.xyz", "1 2 3 ".repeat(40)).contains("columns"));
    assert_eq!(bytes("a.xyz", "1 2 3\r4 5 6\r").unwrap().positions.len(), 2);
    assert_eq!(bytes("a.csv", "x,y,z\r1,2,3\r4,5,6\r").unwrap().positions.len(), 2);
    // Signs of encodings.
    let wide: Vec<u8> = "\u{feff}1.0 2.0 3.0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let big: Vec<u8> = "x,y,z\n1,2,3\n".encode_utf16().flat_map(u16::to_be_bytes).collect();
    assert!(refused("a.xyz", wide).contains("UTF-16") && refused("a.csv", big).contains("UTF-16"));
    for (name, content) in [
        ("a.xyz", "\u{feff}1 2 3 4\n"),
        ("a.csv", "\u{feff}x,y,z\n1,2,3\n"),
        ("a.csv", "\u{feff}# note\nx,y,z\n1,2,3\n"),
        (
            "a.ply",
            "\u{feff}ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n",
        ),
        ("a.xyz", "# Координаты частиц: вода, лёд и снег в сосуде, который стоит на столе у окна дома\n1 2 3\n"),
        ("a.csv", "id,vx,Points:0,Points:1,Points:2\n9,8,1,2,3\n"),
    ] {
        let file = bytes(name, content).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(file.positions, [DVec3::new(1.0, 2.0, 3.0)], "{content:?}");
    }
}

#[test]
fn data_that_do_not_end_where_the_header_says_are_refused() {
    let ply = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let data = [1.0_f32, 2.0, 3.0].map(f32::to_le_bytes).concat();
    assert_eq!(bytes("a.ply", [&ply[..], &data, b"\n"].concat()).unwrap().positions.len(), 1);
    assert!(refused("a.ply", [&ply[..], &data, &data].concat()).contains("more data"));
    // Written as doubles under a header of floats.
    let vtk = b"# vtk DataFile Version 3.0\nt\nBINARY\nDATASET POLYDATA\nPOINTS 2 float\n";
    let doubles = [1.5_f64, 2.5, 3.5, 4.5, 5.5, 6.5].map(f64::to_be_bytes).concat();
    assert!(refused("a.vtk", [&vtk[..], &doubles].concat()).contains("keyword"));
    refused("a.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n1 2 3 4 5 6\n");
    let unknown = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n1 2 3\nSOMETHING 1\n7\nPOINT_DATA 1\n\
                   SCALARS class int\nLOOKUP_TABLE default\n1\n";
    assert_eq!(bytes("a.vtk", unknown).unwrap().classes, Some(vec![1]));
    refused(
        "a.vtk",
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n1 2 3\nPOINTS 1 float\n4 5 6\n",
    );
    let piece =
        |points: &str| format!("<VTKFile><PolyData><Piece NumberOfPoints=\"1\">{points}</Piece></PolyData></VTKFile>");
    let points =
        "<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">1 2 3</DataArray></Points>";
    assert_eq!(bytes("a.vtp", piece(points)).unwrap().positions.len(), 1);
    assert!(refused("a.vtp", piece(&points.repeat(2))).contains("second DataArray"));
    refused("a.vtp", piece(&points.replace("1 2 3", "1 2 3 4 5 6")));
    refused("a.vtp", piece(points).replace("Points=\"1\"", "Points=\"1\" NumberOfPoints=\"1\""));
    assert!(
        refused("a.vtp", piece(points).replace("</Piece>", "</Piece><Piece NumberOfPoints=\"1\"></Piece>"))
            .contains("without Points")
    );
}

#[test]
fn headers_of_any_length_give_short_messages() {
    let properties: String = (0..5000).map(|i| format!("property float \x1b[3{i}m\n")).collect();
    let message = refused(
        "a.ply",
        format!("ply\nformat ascii 1.0\nelement vertex 1\n{properties}end_header\n{}", "1 ".repeat(5000)),
    );
    assert!(message.contains("and 4992 more"), "{message}");
    let names: String = (0..5000).map(|i| format!("c{i},")).collect();
    assert!(refused("a.csv", format!("{names}last\n")).contains("and 4993 more"));
    let long = "x".repeat(1_000_000);
    for (name, content) in [
        ("a.vtk", format!("# vtk DataFile Version 3.0\nt\nASCII\nDATASET {long}\n")),
        ("a.vtk", format!("# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 1 {long}\n")),
        ("a.xyz", format!("1 2 {long}")),
        ("a.csv", long.clone()),
        ("a.vtu", format!("<VTKFile type=\"{long}\"></VTKFile>")),
        ("a.vtu", format!("<VTKFile><{long} ></{long}></VTKFile>")),
        ("a.ply", format!("ply\nformat {long} 1.0\n")),
    ] {
        refused(name, content);
    }
    let name = format!("a\x1b.{}", "y".repeat(200));
    let error = bytes(&name, "1").expect_err("unknown").to_string();
    assert!(error.starts_with("a\\u{1b}.yyy") && !error.contains('\x1b'), "{error}");
}

#[test]
#[cfg(unix)]
fn a_device_without_end_is_left_at_half_of_the_cap() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xyz");
    std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
    let budget = Budget::new(8 << 20);
    match read_within(&path, &budget) {
        Err(ReadError::TooLarge { source, .. }) => assert_eq!(source.file, budget.bytes() / 2 + 1),
        other => panic!("{other:?}"),
    }
}
