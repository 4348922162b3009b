//! Good files of every format, small: made here, or kept in tests/corpus because something went wrong with them once.

use std::io::Cursor;
use std::path::Path;

use exr::prelude as ex;
use exr::prelude::WritableImage as _;
use npyz::zip::CompressionMethod::{Deflated, Stored};

use super::pack::{self, Pack};

/// A file's content before it is packed, and how that is done.
pub struct Seed {
    pub bytes: Vec<u8>,
    pack: Pack,
}

impl Seed {
    pub fn pack(&self, bytes: &[u8]) -> Vec<u8> {
        (self.pack)(bytes)
    }
}

const POSITIONS: [[f32; 3]; 3] = [[0.5, -1.25, 2.0], [3.0, 4.5, -0.125], [100.25, 0.0, -7.0]];

fn packed<const N: usize>(encode: impl Fn(f32) -> [u8; N]) -> Vec<u8> {
    POSITIONS.as_flattened().iter().flat_map(|v| encode(*v)).collect()
}

fn rows(separator: &str) -> String {
    POSITIONS.map(|[x, y, z]| format!("{x}{separator}{y}{separator}{z}\n")).concat()
}

/// All seeds of a format.
pub fn of(format: &str) -> Vec<Seed> {
    let plain = |bytes: Vec<u8>| Seed { bytes, pack: |bytes| bytes.to_vec() };
    let mut seeds: Vec<Seed> = match format {
        "xyz" => vec![
            packed(f32::to_le_bytes),
            rows(" ").into(),
            rows(", ").into(),
            format!("3\nfrom a test\n{}", rows("\t")).into(),
            format!("# note\nH {}", rows(" ").trim_end().replace('\n', "\nO ")).into(),
            format!("\u{feff}{}", rows(" ").replace('\n', " 7\r\n")).into(),
        ],
        "csv" => vec![
            rows(",").into(),
            format!("x;y;z\n{}", rows(";")).into(),
            format!("\u{feff}\"Points:0\",\"Points:1\",\"Points:2\"\r\n{}", rows(",")).into(),
            b"# note\nclass,z,id,Y,x,radius\n1,2,9,-1.25,0.5,0.25\n0,-0.125,8,4.5,3,0.25\n".to_vec(),
            format!("x\ty\tz\n{}", rows("\t")).into(),
            b"x,y,z,vx,vy,vz\n0,1,2,0.5,-1,nan\n3,4,5,0,2,0\n".to_vec(),
            b"Part;Time [s]\n3;0.5\nPos.x [m];Pos.y [m];Pos.z [m];Idp;\n1;2;3;7;\n4;5;6;8;\n".to_vec(),
        ],
        "ply" => ply(),
        "vtk" => vtk(),
        "vtu" | "vtp" => vtu(),
        "pvd" | "pvtu" => collections(format),
        "dump" => vec![
            lammps("pp pp pp\n0 1\n0 2\n-1 1", "id type xs ys zs", "1 1 "),
            lammps(
                "xy xz yz pp pp pp\n-1.5 3 -0.5\n0 2.25 2\n0 1 0.25",
                "class vx vy vz id diameter xsu ysu zsu",
                "1 1 2 3 7 0.5 ",
            ),
            format!(
                "ITEM: UNITS\nlj\nITEM: TIME\n0.25\n{}",
                String::from_utf8_lossy(&lammps("abc origin\n2 0 0 1\n0 0 3 2\n0 1 0 3", "x y z", ""))
            )
            .into(),
        ],
        "bgeo" => vec![
            bgeo(&[], 0),
            bgeo(b"\0\x05class\0\x01\0\0\0\x01\0\0\0\0", 1),
            bgeo(b"\0\x01v\0\x03\0\0\0\x05\0\0\0\0\0\0\0\0\0\0\0\0", 3),
            bgeo(b"\0\x01v\0\x02\0\0\0\x00\0\0\0\0\0\0\0\0", 2),
            include_bytes!("../../tests/corpus/bgeo_houdini.bgeo").to_vec(),
        ],
        "npy" => npy(),
        "npz" => npy(),
        "png" => vec![PNG_ROWS.to_vec()],
        "hdr" => hdr(),
        "exr" => exr(),
        "mesh-ply" => mesh_ply(),
        "mesh-obj" => vec![
            SOLID.into(),
            format!(
                "o a\nvn 0 0 1\nvt 0 1\n{}",
                SOLID.replace("f 1 2 4", "f 1/1/1 2/1/1 4/1/1").replace("f 1 3 2", "f 1//1 3//1 2//1")
            )
            .into(),
            format!("# note\nmtllib a.mtl\ng one\nusemtl x\ns off\n{SOLID}o two\nf -4 -3 -2 -1\nl 1 2\np 1\n").into(),
            SOLID.replace('\n', " \\\n\r\n").into(),
        ],
        "mesh-npz" => npy(),
        _ => Vec::new(),
    }
    .into_iter()
    .map(plain)
    .collect();
    // The same content again, packed.
    let more: &[Pack] = match format {
        "bgeo" => &[pack::gzip, pack::scf],
        "npz" => &[
            |array| pack::npz(&[("position", array)], Stored),
            |array| pack::npz(&[("points", array)], Deflated),
            |array| pack::npz(&[("pos", &npy()[0]), ("class", array)], Deflated),
            |array| pack::npz(&[("pos", &npy()[0]), ("radius", array)], Stored),
            |array| pack::npz(&[("center", &npy()[0]), ("axes", array)], Deflated),
            |array| pack::npz(&[("center", &npy()[0]), ("velocity", array)], Stored),
        ],
        "mesh-npz" => &[
            |array| pack::npz(&[("vertices", array), ("triangles", &triangles())], Stored),
            |array| pack::npz(&[("vertices", &corners()), ("triangles", array)], Deflated),
            |array| pack::npz(&[("vertices", &corners()), ("triangles", &triangles()), ("normals", array)], Deflated),
        ],
        "png" => &[
            |rows| pack::png(b"\0\0\0\x04\0\0\0\x02\x08\x02\0\0\0", rows),
            |rows| pack::png(b"\0\0\0\x02\0\0\0\x01\x10\x06\0\0\0", rows),
            |rows| pack::png(b"\0\0\0\x08\0\0\0\x04\x01\0\0\0\0", rows),
            |rows| pack::png(b"\0\0\0\x04\0\0\0\x02\x08\x00\0\0\x01", rows),
            |rows| pack::png(b"\0\0\0\x02\0\0\0\x01\x08\x04\0\0\0", rows),
        ],
        _ => &[],
    };
    let contents: Vec<Vec<u8>> = seeds.iter().map(|seed| seed.bytes.clone()).collect();
    seeds.retain(|_| !matches!(format, "npz" | "mesh-npz" | "png"));
    seeds.extend(more.iter().flat_map(|pack| contents.iter().map(|bytes| Seed { bytes: bytes.clone(), pack: *pack })));
    if matches!(format, "png" | "npz" | "mesh-npz") {
        // What surrounds the content, as content.
        let whole: Vec<Vec<u8>> = seeds.iter().map(|seed| seed.pack(&seed.bytes)).collect();
        seeds.extend(whole.into_iter().map(plain));
    }
    if matches!(format, "vtu" | "vtp") {
        let data = [&36_u32.to_le_bytes()[..], &packed(f32::to_le_bytes)].concat();
        seeds.push(Seed { bytes: data, pack: |data| pack::vtu(data, None) });
        let packs: [Pack; 4] = [
            |data| pack::vtu(data, Some(("vtkZLibDataCompressor", pack::zlib))),
            |data| pack::vtu(data, Some(("vtkLZ4DataCompressor", pack::lz4))),
            |data| pack::vtu(data, Some(("vtkLZMADataCompressor", pack::xz))),
            // Mutated after it was packed.
            |data| pack::vtu(data, Some(("vtkLZ4DataCompressor", |data| data.to_vec()))),
        ];
        seeds.extend(packs.map(|pack| Seed { bytes: packed(f32::to_le_bytes), pack }));
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let mut kept: Vec<_> =
        std::fs::read_dir(folder).expect("tests/corpus").map(|e| e.expect("an entry").path()).collect();
    kept.sort();
    let kept = kept.iter().filter(|path| path.extension().is_some_and(|extension| extension == format));
    seeds.extend(kept.map(|path| plain(std::fs::read(path).expect("readable"))));
    seeds
}

/// Of files that are kept in tests/corpus; fuzzing runs in the folder above.
fn collections(format: &str) -> Vec<Vec<u8>> {
    let kept = ["vtk_lz4_raw.vtu", "vtk_lz4_inline.vtu", "vtk_blocks.vtm"].map(|name| format!("tests/corpus/{name}"));
    let file =
        |kind: &str, body: &str| format!("<VTKFile type=\"{kind}\"><{kind}>{body}</{kind}></VTKFile>\n").into_bytes();
    let sets = |times: [&str; 3]| -> String {
        let sets = kept.iter().zip(times).map(|(name, time)| format!("<DataSet timestep=\"{time}\" file=\"{name}\"/>"));
        sets.collect()
    };
    let pieces: String = kept.iter().take(2).map(|name| format!("<Piece Source=\"{name}\"/>")).collect();
    match format {
        "pvd" => vec![
            file("Collection", &sets(["0", "0", "0"])),
            file("Collection", &sets(["0", "0.5", "1"])),
            file("Collection", &pieces),
        ],
        _ => vec![
            file("PUnstructuredGrid", &pieces),
            file("PUnstructuredGrid", &format!("<PPoints/>{}", sets(["1", "1", "1"]))),
        ],
    }
}

fn lammps(bounds: &str, columns: &str, before: &str) -> Vec<u8> {
    let rows: String = rows(" ").lines().map(|row| format!("{before}{row}\n")).collect();
    format!("ITEM: TIMESTEP\n10\nITEM: NUMBER OF ATOMS\n3\nITEM: BOX BOUNDS {bounds}\nITEM: ATOMS {columns}\n{rows}")
        .into()
}

fn ply() -> Vec<Vec<u8>> {
    let head = |format: &str, kind: &str, rest: &str| {
        let axes = ["x", "y", "z"].map(|axis| format!("property {kind} {axis}\n")).concat();
        format!(
            "ply\nformat {format} 1.0\ncomment test\nelement vertex 3\n{axes}property uchar class\n{rest}end_header\n"
        )
    };
    let velocity = ["vx", "vy", "vz"].map(|axis| format!("property float {axis}\n")).concat();
    let faces = "element face 1\nproperty list uchar int vertex_indices\n";
    let records = |data: Vec<u8>| data.chunks(12).flat_map(|xyz| [xyz, &[1]].concat()).collect::<Vec<u8>>();
    vec![
        (head("ascii", "double", &velocity) + &rows(" ").replace('\n', " 1 0.5 -1 2\n")).into_bytes(),
        (head("ascii", "double", faces) + &rows(" ").replace('\n', " 1\n") + "3 0 1 2\n").into_bytes(),
        [head("binary_little_endian", "float", "").into_bytes(), records(packed(f32::to_le_bytes))].concat(),
        [
            head("binary_big_endian", "float", faces).into_bytes(),
            records(packed(f32::to_be_bytes)),
            vec![3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2],
        ]
        .concat(),
    ]
}

/// A tetrahedron.
const SOLID: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const SOLID_CORNERS: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const SOLID_FACES: [[u8; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn corners() -> Vec<u8> {
    npy_file(
        "<f4",
        "False",
        "(4, 3)",
        &SOLID_CORNERS.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>(),
    )
}

fn triangles() -> Vec<u8> {
    npy_file("|u1", "False", "(4, 3)", SOLID_FACES.as_flattened())
}

fn mesh_ply() -> Vec<Vec<u8>> {
    let head = |format: &str, kind: &str, normals: &str, list: &str| {
        let axes = ["x", "y", "z"].map(|axis| format!("property {kind} {axis}\n")).concat();
        format!(
            "ply\nformat {format} 1.0\nelement vertex 4\n{axes}{normals}element face 4\nproperty list {list} vertex_indices\nend_header\n"
        )
    };
    let normals = ["nx", "ny", "nz"].map(|axis| format!("property float {axis}\n")).concat();
    let text = |more: &str| {
        let corners = SOLID_CORNERS.map(|[x, y, z]| format!("{x} {y} {z}{more}\n")).concat();
        corners + &SOLID_FACES.map(|[a, b, c]| format!("3 {a} {b} {c}\n")).concat()
    };
    let data = |float: fn(&f32) -> [u8; 4], int: fn(i32) -> [u8; 4]| {
        let corners = SOLID_CORNERS.as_flattened().iter().flat_map(float);
        let faces = SOLID_FACES.iter().flat_map(|f| [vec![3], f.map(|i| int(i.into())).concat()].concat());
        corners.chain(faces).collect::<Vec<u8>>()
    };
    vec![
        (head("ascii", "double", "", "uchar int") + &text("")).into_bytes(),
        (head("ascii", "float", &normals, "uint uchar") + &text(" 0 0 1")).into_bytes(),
        [
            head("binary_little_endian", "float", "", "uchar uint").into_bytes(),
            data(|v| v.to_le_bytes(), i32::to_le_bytes),
        ]
        .concat(),
        [head("binary_big_endian", "float", "", "uchar int").into_bytes(), data(|v| v.to_be_bytes(), i32::to_be_bytes)]
            .concat(),
    ]
}

fn vtk() -> Vec<Vec<u8>> {
    let ints = |values: &[i32]| values.iter().flat_map(|v| v.to_be_bytes()).collect::<Vec<u8>>();
    let binary = [
        b"# vtk DataFile Version 4.1\ntest\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n",
        &packed(f32::to_be_bytes)[..],
        b"\nCELLS 3 6\n",
        &ints(&[1, 0, 1, 1, 1, 2]),
        b"\nCELL_TYPES 3\n",
        &ints(&[1, 1, 1]),
        b"\nPOINT_DATA 3\nSCALARS id unsigned_int 1\nLOOKUP_TABLE id_table\n",
        &ints(&[7, 8, 9]),
        b"\nMETADATA\nINFORMATION 0\n\nFIELD FieldData 1\nclass 1 3 int\n",
        &ints(&[1, 0, 1]),
        b"\n",
    ];
    let ascii = format!(
        "# vtk DataFile Version 5.1\nt\nASCII\nDATASET POLYDATA\nPOINTS 3 double\n{}\nVERTICES 4 3\nOFFSETS vtktypeint64\n0 1 2 3\n\
         CONNECTIVITY vtktypeint64\n0 1 2\nPOINT_DATA 3\nSCALARS class int\nLOOKUP_TABLE default\n1 0 1\nVECTORS v float\n{}",
        rows(" "),
        rows(" ")
    );
    vec![binary.concat(), ascii.into_bytes()]
}

fn vtu() -> Vec<Vec<u8>> {
    let file = |attributes: &str, array: &str, data: &[u8]| {
        let head = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" {attributes}><UnstructuredGrid>\
             <Piece NumberOfPoints=\"3\" NumberOfCells=\"0\"><PointData><DataArray type=\"UInt8\" Name=\"class\" format=\"ascii\">\
             0 1 1</DataArray><DataArray type=\"Float32\" Name=\"velocity\" NumberOfComponents=\"3\" format=\"ascii\">1 2 3 4 5
             6 7 8 9</DataArray></PointData><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" {array}</DataArray></Points>\
             </Piece></UnstructuredGrid>"
        );
        [head.as_bytes(), data, b"\n</VTKFile>\n"].concat()
    };
    let data = packed(f32::to_le_bytes);
    let blocks = [pack::zlib(&data[..18]), pack::zlib(&data[18..])];
    let head = [2, 18, 0, blocks[0].len() as u64, blocks[1].len() as u64].map(u64::to_le_bytes).concat();
    let appended = [b"<AppendedData encoding=\"raw\">_", &head[..], &blocks.concat(), b"</AppendedData>"].concat();
    let zlib = "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"";
    vec![
        file("", &format!("format=\"ascii\">{}", rows(" ")), b""),
        file(zlib, "format=\"appended\" offset=\"0\">", &appended),
    ]
}

/// With this definition of one attribute of so many words, or of none.
fn bgeo(attribute: &[u8], words: usize) -> Vec<u8> {
    let mut content = b"BgeoV".to_vec();
    let attributes = i32::from(!attribute.is_empty());
    content.extend([5, 3, 0, 0, 0, attributes, 0, 0, 0].map(i32::to_be_bytes).concat());
    content.extend(attribute);
    for position in POSITIONS {
        content.extend(position.iter().chain(&[1.0]).flat_map(|v| v.to_be_bytes()));
        content.extend([0, 0, 0, 1].repeat(words));
    }
    content.extend(b"\0\xff");
    content
}

fn npy_file(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    [b"\x93NUMPY\x01\0", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), data].concat()
}

fn npy() -> Vec<Vec<u8>> {
    let file = |descr: &str, fortran: &str, shape: &str, data: Vec<u8>| npy_file(descr, fortran, shape, &data);
    vec![
        file("<f4", "False", "(3, 3)", packed(f32::to_le_bytes)),
        file(">f8", "True", "(3, 3)", packed(|v| f64::from(v).to_be_bytes())),
        file("|u1", "False", "(3,)", vec![1, 0, 1]),
        file("<f4", "False", "()", 0.5_f32.to_le_bytes().to_vec()),
        file("<f4", "False", "(3, 3, 3)", packed(f32::to_le_bytes).repeat(3)),
    ]
}

/// Two rows of four RGB texels, each after its filter byte.
const PNG_ROWS: [u8; 26] =
    [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 1, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24];

fn hdr() -> Vec<Vec<u8>> {
    let of = |width: usize| {
        let mut content = Vec::new();
        let texels: Vec<_> = (0..width * width / 2).map(|i| image::Rgb([0.1 + (i / 5) as f32, 1.0, 0.01])).collect();
        let encoder = image::codecs::hdr::HdrEncoder::new(&mut content);
        encoder.encode(&texels, width, width / 2).expect("into memory");
        content
    };
    let flat =
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1\n\n-Y 1 +X 2\n\x80\x40\x20\x80\x01\x02\x03\x70".to_vec();
    let old =
        b"#?RADIANCE\n\n-Y 2 +X 4\n\x80\x40\x20\x80\x01\x01\x01\x03\x80\x40\x20\x80\x80\x40\x20\x81\x01\x01\x01\x02"
            .to_vec();
    vec![of(8), of(16), flat, old]
}

fn exr() -> Vec<Vec<u8>> {
    use ex::{Blocks, Compression, Encoding, Image, Layer, LayerAttributes, LineOrder, SpecificChannels, Vec2};
    let light = |p: Vec2<usize>| (p.x() as f32 * 0.25, p.y() as f32, 1.0_f32);
    let file = |compression, blocks| {
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        let mut content = Cursor::new(Vec::new());
        let attributes = LayerAttributes::named("map");
        match blocks {
            Blocks::ScanLines => {
                let channels = SpecificChannels::rgb(light);
                let layer = Layer::new((8, 4), attributes, encoding, channels);
                Image::from_layer(layer).write().to_buffered(&mut content)
            }
            Blocks::Tiles(_) => {
                let half = |p| {
                    let (r, g, b) = light(p);
                    (ex::f16::from_f32(r), ex::f16::from_f32(g), ex::f16::from_f32(b))
                };
                let layer = Layer::new((8, 4), attributes, encoding, SpecificChannels::rgb(half));
                Image::from_layer(layer).write().to_buffered(&mut content)
            }
        }
        .expect("into memory");
        content.into_inner()
    };
    use Compression::{B44, PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
    [Uncompressed, RLE, ZIP1, ZIP16, PIZ, PXR24, B44]
        .into_iter()
        .flat_map(|compression| [file(compression, Blocks::ScanLines), file(compression, Blocks::Tiles(Vec2(4, 4)))])
        .collect()
}
