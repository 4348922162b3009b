//! Particle files: every format is written here byte by byte, read back, and broken.

use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use glam::{DMat3, DVec3};
use meniscus::io::particles::{At, FORMATS, Invalid, ParticleFile, ReadError, check_finite, read};
use npyz::WriterBuilder as _;
use npyz::npz::NpzWriter;
use npyz::zip::CompressionMethod;
use npyz::zip::write::FileOptions;
use tempfile::TempDir;

/// Exact in single precision, so every format gives them back exactly.
const POSITIONS: [[f32; 3]; 3] = [[0.5, -1.25, 2.0], [3.0, 4.5, -0.125], [100.25, 0.0, -7.0]];

fn expected() -> Vec<DVec3> {
    POSITIONS.map(|p| DVec3::from_array(p.map(f64::from))).to_vec()
}

fn bytes<const N: usize>(encode: impl Fn(f32) -> [u8; N]) -> Vec<u8> {
    POSITIONS.as_flattened().iter().flat_map(|v| encode(*v)).collect()
}

fn rows(separator: &str) -> String {
    POSITIONS.map(|[x, y, z]| format!("{x}{separator}{y}{separator}{z}\n")).concat()
}

/// A file in a folder of its own, which must outlive it.
fn file(name: &str, content: impl AsRef<[u8]>) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, content).unwrap();
    (dir, path)
}

fn read_as(name: &str, content: impl AsRef<[u8]>) -> ParticleFile {
    let (_dir, path) = file(name, content);
    read(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// The error of reading `content`; its message must be one line that names the file.
fn fail_as(name: &str, content: impl AsRef<[u8]>) -> ReadError {
    let (_dir, path) = file(name, content);
    let error = read(&path).expect_err(name);
    assert_names(&error, &path);
    error
}

fn assert_names(error: &ReadError, path: &Path) {
    let message = error.to_string();
    assert!(message.starts_with(&path.display().to_string()), "{message}");
    assert!(!message.contains('\n') && message.contains("; "), "{message}");
}

fn assert_malformed(name: &str, content: impl AsRef<[u8]>) {
    let error = fail_as(name, content);
    assert!(matches!(error, ReadError::Malformed { .. }), "{name}: {error:?}");
}

fn vtk(dataset: &str, data_type: &str, positions: &[u8], rest: &[u8]) -> Vec<u8> {
    let head = format!("# vtk DataFile Version 4.1\ntest\nBINARY\nDATASET {dataset}\nPOINTS 3 {data_type}\n");
    [head.as_bytes(), positions, rest].concat()
}

/// Three vertex cells, and the point array `class` among others.
fn vtk_rest() -> Vec<u8> {
    let ints = |values: &[i32]| values.iter().flat_map(|v| v.to_be_bytes()).collect::<Vec<u8>>();
    let mut rest = b"\nCELLS 3 6\n".to_vec();
    rest.extend(ints(&[1, 0, 1, 1, 1, 2]));
    rest.extend(b"\nCELL_TYPES 3\n");
    rest.extend(ints(&[1, 1, 1]));
    rest.extend(b"\nPOINT_DATA 3\nSCALARS id unsigned_int 1\nLOOKUP_TABLE id_table\n");
    rest.extend(ints(&[7, 8, 9]));
    rest.extend(b"\nFIELD FieldData 2\nvelocity 3 3 float\n");
    rest.extend(bytes(f32::to_be_bytes));
    rest.extend(b"\nclass 1 3 int\n");
    rest.extend(ints(&[1, 0, 1]));
    rest.push(b'\n');
    rest
}

#[test]
fn reads_legacy_vtk() {
    let single = vtk("UNSTRUCTURED_GRID", "float", &bytes(f32::to_be_bytes), &vtk_rest());
    let read = read_as("a.vtk", single);
    assert_eq!(read.positions, expected());
    assert_eq!(read.classes, Some(vec![1, 0, 1]));
    assert_eq!(read.velocities, Some(expected()));
    let double = vtk("POLYDATA", "double", &bytes(|v| f64::from(v).to_be_bytes()), b"\n");
    assert_eq!(read_as("A.VTK", double).positions, expected());
    let ascii = format!(
        "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 double\n{}\nCELLS 4 3\n\
         OFFSETS vtktypeint64\n0 1 2 3\nCONNECTIVITY vtktypeint64\n0 1 2\nCELL_TYPES 3\n1 1 1\n",
        rows(" ")
    );
    assert_eq!(read_as("a.vtk", ascii).positions, expected());
    // As ParaView writes it.
    let dataset = "UNSTRUCTURED_GRID\nFIELD FieldData 1\nTimeValue 1 1 double\n\0\0\0\0\0\0\0\0";
    let field_first = vtk(dataset, "float", &bytes(f32::to_be_bytes), &vtk_rest());
    assert_eq!(read_as("a.vtk", field_first).positions, expected());
}

fn vtu(attributes: &str, format: &str, inline: &str, after: &[u8]) -> Vec<u8> {
    let head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" {attributes}>\
         <UnstructuredGrid><Piece NumberOfPoints=\"3\" NumberOfCells=\"0\"><PointData><DataArray type=\"UInt8\" Name=\"class\" \
         format=\"ascii\">0 1 1</DataArray></PointData><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" {format}>\
         {inline}</DataArray></Points></Piece></UnstructuredGrid>"
    );
    [head.as_bytes(), after, b"\n</VTKFile>\n"].concat()
}

#[test]
fn reads_xml_vtk() {
    let data = bytes(f32::to_le_bytes);
    let plain = [&36_u32.to_le_bytes()[..], &data].concat();
    // Two blocks of 18 bytes, the second of which is whole and so has the size 0.
    let blocks: Vec<Vec<u8>> = data
        .chunks(18)
        .map(|block| {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
            encoder.write_all(block).unwrap();
            encoder.finish().unwrap()
        })
        .collect();
    let sizes = [2, 18, 0, blocks[0].len() as u64, blocks[1].len() as u64];
    let head: Vec<u8> = sizes.iter().flat_map(|v| v.to_le_bytes()).collect();
    let zlib = "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"";
    let raw = [b"<AppendedData encoding=\"raw\">_skip", &head[..], &blocks.concat(), b"</AppendedData>"].concat();
    let zlib64 = STANDARD.encode(&head) + &STANDARD.encode(blocks.concat());
    let files = [
        vtu("", "format=\"ascii\"", &rows(" "), b""),
        vtu("", "format=\"binary\"", &STANDARD.encode(&plain), b""),
        vtu(zlib, "format=\"binary\"", &zlib64, b""),
        vtu(zlib, "format=\"appended\" offset=\"4\"", "", &raw),
    ];
    for content in files {
        let read = read_as("a.vtu", &content);
        assert_eq!(read.positions, expected());
        assert_eq!(read.classes, Some(vec![0, 1, 1]));
        assert_malformed("a.vtu", &content[..content.len() / 2]);
    }
    // A block count from a corrupt file must not be allocated.
    let huge = STANDARD.encode([u64::MAX / 64, u64::MAX, 0].map(u64::to_le_bytes).concat());
    assert_malformed("a.vtu", vtu(zlib, "format=\"binary\"", &huge, b""));
    let none = vtu("", "format=\"ascii\"", &rows(" "), b"");
    let none = String::from_utf8(none).unwrap().replace("Points>", "Dots>");
    assert!(matches!(fail_as("a.vtp", none), ReadError::NoPositions { .. }));
}

#[test]
fn reads_ply() {
    let head = |format: &str, kind: &str, count: usize| {
        let axes = ["x", "y", "z"].map(|axis| format!("property {kind} {axis}\n")).concat();
        format!(
            "ply\nformat {format} 1.0\ncomment test\nelement vertex {count}\n{axes}property uchar class\nend_header\n"
        )
    };
    let ascii = head("ascii", "double", 3) + &rows(" ").replace('\n', " 1\n");
    let read = read_as("a.ply", &ascii);
    assert_eq!((read.positions, read.classes), (expected(), Some(vec![1, 1, 1])));
    let mut binary = head("binary_little_endian", "float", 3).into_bytes();
    for chunk in bytes(f32::to_le_bytes).chunks(12) {
        binary.extend(chunk);
        binary.push(0);
    }
    let read = read_as("a.ply", &binary);
    assert_eq!((read.positions, read.classes), (expected(), Some(vec![0, 0, 0])));

    assert!(read_as("a.ply", head("ascii", "float", 0)).positions.is_empty());
    assert_malformed("a.ply", &binary[..binary.len() - 3]);
    assert_malformed("a.ply", &ascii[..ascii.len() - 8]);
    assert_malformed("a.ply", &ascii[..40]);
    assert_malformed("a.ply", head("binary_little_endian", "float", 4_000_000_000));
    assert_malformed("a.ply", "ply\nformat ascii 1.0\nelement vertex 4000000000\nend_header\n");
    // Overflows an integer inside the parser, which panics.
    assert_malformed("a.ply", "ply\nformat ascii 1.0\nelement vertex 99999999999999999999999\nend_header\n");
    let error = fail_as("a.ply", ascii.replace("double y", "double h"));
    assert!(matches!(&error, ReadError::NoPositions { found, .. } if found == "x, h, z, class"), "{error:?}");
}

/// Version 5 with the integer attribute `class`.
fn bgeo() -> Vec<u8> {
    let mut content = b"BgeoV".to_vec();
    content.extend([5_i32, 3, 0, 0, 0, 1, 0, 0, 0].iter().flat_map(|v| v.to_be_bytes()));
    content.extend(b"\0\x05class\0\x01\0\0\0\x01\0\0\0\0");
    for position in POSITIONS {
        content.extend(position.iter().chain(&[1.0]).flat_map(|v| v.to_be_bytes()));
        content.extend(1_i32.to_be_bytes());
    }
    content.extend(b"\0\xff");
    content
}

#[test]
fn reads_bgeo() {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    gzip.write_all(&bgeo()).unwrap();
    for content in [bgeo(), gzip.finish().unwrap()] {
        let read = read_as("a.bgeo", &content);
        assert_eq!((read.positions, read.classes), (expected(), Some(vec![1, 1, 1])));
        assert_malformed("a.bgeo", &content[..content.len() - 20]);
    }
    for count in [-1_i32, i32::MAX] {
        let mut content = bgeo();
        content[9..13].copy_from_slice(&count.to_be_bytes());
        assert_malformed("a.bgeo", content);
    }
    assert_malformed("a.bgeo", "not one");
}

#[test]
fn reads_xyz() {
    let raw = bytes(f32::to_le_bytes);
    assert_eq!(read_as("a.xyz", &raw).positions, expected());
    assert!(matches!(fail_as("a.xyz", &raw[..31]), ReadError::Malformed { at: At::Byte(24), .. }));
    for text in [
        rows(" "),
        rows(", "),
        format!("# comment\n\n{}", rows("\t")),
        format!("3\nfrom a test\n{}", rows(" ")),
        format!("3\n\nH {}", rows(" ").trim_end().replace('\n', " 9\nO ")),
    ] {
        assert_eq!(read_as("a.XYZ", &text).positions, expected(), "{text}");
    }
    assert_malformed("a.xyz", format!("4\nfrom a test\n{}", rows(" ")));
    assert!(matches!(fail_as("a.xyz", "1 2 3\n1 2\n"), ReadError::Malformed { at: At::Line(2), .. }));
}

#[test]
fn reads_csv() {
    for header in
        ["", "x,y,z\n", "Points:0,Points:1,Points:2\n", "\"Position_X\", position_y, position_z\n", "# note\nx,y,z\n"]
    {
        assert_eq!(read_as("a.csv", format!("{header}{}", rows(","))).positions, expected(), "{header}");
    }
    assert_eq!(read_as("a.csv", rows(";")).positions, expected());
    let read =
        read_as("a.csv", "class,z,id,Y,x,radius\n1,2,9,-1.25,0.5,0.25\n0,-0.125,8,4.5,3,0.25\n1,-7,7,0,100.25,0.25\n");
    assert_eq!((read.positions, read.classes, read.radius), (expected(), Some(vec![1, 0, 1]), Some(0.25)));
    assert!(read_as("a.csv", "x,y,z\n").positions.is_empty());

    assert!(matches!(fail_as("a.csv", "x,y,z\n1,2,3\n1,2\n"), ReadError::Malformed { at: At::Line(3), .. }));
    assert!(matches!(fail_as("a.csv", "x,y,z\n1,two,3\n"), ReadError::Malformed { at: At::Line(2), .. }));
    assert!(matches!(fail_as("a.csv", "u,v,w\n1,2,3\n"), ReadError::NoPositions { .. }));
    assert_malformed("a.csv", "x,y,z,class\n1,2,3,4\n");
    assert_malformed("a.csv", "x,y,z,radius\n1,2,3,-4\n");
}

fn npy<T: npyz::AutoSerialize + Copy>(shape: &[u64], order: npyz::Order, values: &[T]) -> Vec<u8> {
    let mut content = Vec::new();
    let mut writer =
        npyz::WriteOptions::new().default_dtype().shape(shape).order(order).writer(&mut content).begin_nd().unwrap();
    writer.extend(values.iter().copied()).unwrap();
    writer.finish().unwrap();
    content
}

#[test]
fn reads_npy() {
    use npyz::Order::{C, Fortran};
    let flat = POSITIONS.as_flattened();
    let single = npy(&[3, 3], C, flat);
    assert_eq!(read_as("a.npy", &single).positions, expected());
    let columns: Vec<f64> = (0..9).map(|i| f64::from(POSITIONS[i % 3][i / 3])).collect();
    assert_eq!(read_as("a.npy", npy(&[3, 3], Fortran, &columns)).positions, expected());
    // Big endian: the same header with the other mark, and the other bytes.
    let at = single.windows(3).position(|w| w == b"<f4").unwrap();
    let mut big = single[..single.len() - 36].to_vec();
    big[at] = b'>';
    big.extend(bytes(f32::to_be_bytes));
    assert_eq!(read_as("a.npy", big).positions, expected());
    assert!(read_as("a.npy", npy::<f32>(&[0, 3], C, &[])).positions.is_empty());

    assert_malformed("a.npy", &single[..single.len() - 1]);
    assert_malformed("a.npy", &single[..30]);
    assert_malformed("a.npy", b"\x93NUMPY\x02\0\xff\xff\xff\xff{'descr'");
    assert_malformed("a.npy", [b"\x93NUMPY\x01\0\xff\xff", &[b'('; 0xffff][..]].concat());
    assert!(matches!(fail_as("a.npy", npy(&[9], C, flat)), ReadError::WrongShape { .. }));
    assert!(matches!(fail_as("a.npy", npy(&[2, 2], C, &flat[..4])), ReadError::WrongShape { .. }));
}

/// An archive of arrays in npy form, as `numpy.savez` or `numpy.savez_compressed` would make it.
fn npz(arrays: &[(&str, Vec<u8>)], method: CompressionMethod) -> Vec<u8> {
    let mut content = Cursor::new(Vec::new());
    let mut writer = NpzWriter::new(&mut content);
    let zip = writer.zip_writer();
    for (name, array) in arrays {
        zip.start_file(format!("{name}.npy"), FileOptions::default().compression_method(method)).unwrap();
        zip.write_all(array).unwrap();
    }
    zip.finish().unwrap();
    drop(writer);
    content.into_inner()
}

#[test]
fn reads_npz() {
    use npyz::Order::C;
    let positions = npy(&[3, 3], C, POSITIONS.as_flattened());
    let numbers: Vec<f64> = (0..27).map(f64::from).collect();
    let all = [
        ("velocity", positions.clone()),
        ("position", positions.clone()),
        ("radius", npy(&[], C, &[0.025_f64])),
        ("support", npy(&[1], C, &[0.5_f32])),
        ("class", npy(&[3], C, &[1_i64, 0, 1])),
        ("axes", npy(&[3, 3, 3], C, &numbers)),
    ];
    for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
        let content = npz(&all, method);
        let read = read_as("a.npz", &content);
        assert_eq!(read.positions, expected());
        assert_eq!((read.radius, read.support), (Some(0.025), Some(0.5)));
        assert_eq!(read.velocities, Some(expected()));
        assert_eq!(read.classes, Some(vec![1, 0, 1]));
        let axes = read.axes.unwrap();
        assert_eq!(axes.len(), 3);
        // The file's rows are the columns here.
        assert_eq!(axes[1], DMat3::from_cols_array(&[9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0]));
        assert_malformed("a.npz", &content[..content.len() - 40]);
    }
    for name in ["positions", "pos", "center", "points"] {
        let content = npz(&[(name, positions.clone())], CompressionMethod::Stored);
        assert_eq!(read_as("a.npz", content).positions, expected());
    }
    let with = |name: &'static str, array| {
        fail_as("a.npz", npz(&[("position", positions.clone()), (name, array)], CompressionMethod::Stored))
    };
    let error = with("class", npy(&[2], C, &[1_u8, 0]));
    assert!(matches!(error, ReadError::UnequalLengths { found: 2, expected: 3, .. }), "{error:?}");
    assert!(matches!(with("axes", npy(&[3, 3], C, &[0.0_f32; 9])), ReadError::WrongShape { .. }));
    assert!(matches!(with("class", npy(&[3], C, &[1_i32, 0, 5])), ReadError::Malformed { .. }));
    assert!(matches!(with("radius", npy(&[], C, &[0.0_f32])), ReadError::Malformed { .. }));
    let error = fail_as("a.npz", npz(&[("mass", positions.clone())], CompressionMethod::Stored));
    assert!(matches!(&error, ReadError::NoPositions { found, .. } if found == "arrays mass"), "{error:?}");
}

#[test]
fn rejects_bad_legacy_vtk() {
    let positions = bytes(f32::to_be_bytes);
    let whole = vtk("UNSTRUCTURED_GRID", "float", &positions, &vtk_rest());
    // Cut within the positions, the cells, and the last array.
    let cells = whole.windows(5).position(|w| w == b"CELLS").unwrap();
    for keep in [90, cells - 2, cells + 20, whole.len() - 8] {
        assert_malformed("a.vtk", &whole[..keep]);
    }
    assert_malformed("a.vtk", "solid stl\n");
    let text = String::from_utf8_lossy(&whole[..90]).replace("POINTS 3", "POINTS 4000000000");
    assert_malformed("a.vtk", text);
    assert!(matches!(fail_as("a.vtk", vtk("POLYDATA", "long", &positions, b"")), ReadError::WrongShape { .. }));
    let image = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n";
    let error = fail_as("a.vtk", image);
    assert!(matches!(&error, ReadError::NoPositions { found, .. } if found.contains("STRUCTURED_POINTS")), "{error:?}");
    let ascii = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n1 2 3 4 five 6\n";
    let five = ascii.find("five").unwrap() as u64;
    let error = fail_as("a.vtk", ascii);
    assert!(matches!(error, ReadError::Malformed { at: At::Byte(at), .. } if at == five), "{error:?}");
}

#[test]
fn rejects_what_is_no_particle_file() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["missing.vtk", "missing", "missing.obj"] {
        let path = dir.path().join(name);
        let error = read(&path).unwrap_err();
        assert_names(&error, &path);
        assert!(matches!(error, ReadError::NotFound { .. }), "{error:?}");
    }
    for name in ["folder", "folder.ply"] {
        let path = dir.path().join(name);
        std::fs::create_dir(&path).unwrap();
        let error = read(&path).unwrap_err();
        assert_names(&error, &path);
        assert!(matches!(error, ReadError::IsDirectory { .. }), "{error:?}");
    }
    let error = fail_as("mesh.Obj", "v 0 0 0");
    assert!(matches!(&error, ReadError::UnknownExtension { extension, .. } if extension == "obj"));
    for (extension, _) in FORMATS {
        assert!(error.to_string().contains(extension), "{error}");
        let name = format!("a.{extension}");
        assert!(matches!(fail_as(&name, ""), ReadError::Empty { .. }), "{name}");
        // Cut off content of several formats, and noise.
        for content in [
            &bgeo()[..50],
            &vtk("POLYDATA", "float", b"", b""),
            &[0x93; 61],
            b"\x1f\x8b\x08",
            b"PK\x03\x04",
            b"ply\n",
            b"<",
        ] {
            fail_as(&name, content);
        }
    }
}

#[test]
fn rejects_or_drops_positions_that_are_not_finite() {
    let path = Path::new("some/a.csv");
    let broken = read_as("a.csv", "x,y,z,class\n0,0,0,1\n1,nan,0,0\n2,0,0,0\n3,0,-inf,1\n");
    assert_eq!(broken.positions.len(), 4);
    let error = check_finite(&mut broken.clone(), Invalid::Reject, path).unwrap_err();
    assert!(matches!(error, ReadError::NonFinite { first: 1, count: 2, total: 4, .. }), "{error:?}");
    assert_names(&error, path);
    assert!(error.to_string().contains("--drop-invalid"), "{error}");

    let axes = [0.0, 1.0, 2.0, 3.0].map(|scale| DMat3::IDENTITY * scale).to_vec();
    let mut dropped = ParticleFile { axes: Some(axes), ..broken };
    assert_eq!(check_finite(&mut dropped, Invalid::Drop, path).unwrap(), 2);
    assert_eq!(dropped.positions, [DVec3::ZERO, DVec3::X * 2.0]);
    assert_eq!(dropped.classes, Some(vec![1, 0]));
    assert_eq!(dropped.axes, Some(vec![DMat3::ZERO, DMat3::IDENTITY * 2.0]));
    assert_eq!(check_finite(&mut dropped, Invalid::Reject, path).unwrap(), 0);
}

#[test]
fn survives_every_flipped_byte() {
    let files = [
        ("a.vtk", vtk("UNSTRUCTURED_GRID", "float", &bytes(f32::to_be_bytes), &vtk_rest())),
        ("a.vtu", vtu("", "format=\"ascii\"", &rows(" "), b"")),
        ("a.bgeo", bgeo()),
        (
            "a.npz",
            npz(&[("position", npy(&[3, 3], npyz::Order::C, POSITIONS.as_flattened()))], CompressionMethod::Deflated),
        ),
    ];
    let dir = tempfile::tempdir().unwrap();
    for (name, content) in files {
        let path = dir.path().join(name);
        for i in 0..content.len() {
            for flip in [0x01, 0x80, 0xff] {
                let mut broken = content.clone();
                broken[i] ^= flip;
                std::fs::write(&path, &broken).unwrap();
                if let Err(error) = read(&path) {
                    assert_names(&error, &path);
                }
            }
        }
    }
}
