//! Forms of files that other programs write, beyond those in `io.rs`: each was once refused, or read wrongly.

use std::path::Path;

use base64::{Engine, engine::general_purpose::STANDARD};
use glam::DVec3;
use meniscus::io::Budget;
use meniscus::io::images::environment_from_bytes;
use meniscus::io::particles::{At, ParticleFile, ReadError, read_bytes};

const TWO: [DVec3; 2] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)];

fn read(name: &str, content: impl AsRef<[u8]>) -> Result<ParticleFile, ReadError> {
    read_bytes(Path::new(name), content.as_ref(), &Budget::default())
}

fn positions(name: &str, content: impl AsRef<[u8]>) -> Vec<DVec3> {
    read(name, content).expect(name).positions
}

fn refused(name: &str, content: &str, line: u64) {
    let error = read(name, content).expect_err(content);
    assert!(matches!(error, ReadError::Malformed { at: At::Line(at), .. } if at == line), "{error}");
}

#[test]
fn xml_arrays_may_have_comments_and_keys_in_them() {
    let packed: Vec<u8> = TWO.iter().flat_map(|p| p.to_array()).flat_map(f64::to_le_bytes).collect();
    let base64 = STANDARD.encode([&48_u32.to_le_bytes()[..], &packed].concat());
    let lines = format!("\n{}\n  {}\n", &base64[..30], &base64[30..]);
    for (format, text) in [
        ("ascii", "<!-- metres -->1 2 3 4 5 6"),
        ("ascii", "1 2 3 <!-- one -->4 5 6"),
        ("ascii", "<![CDATA[1 2 3 4 5 6]]>"),
        ("ascii", "\n<InformationKey name=\"L2\"><Value index=\"0\">0.5</Value></InformationKey>\n1 2 3 4 5 6\n"),
        ("binary", &lines),
    ] {
        let file = format!(
            "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\"><PolyData><Piece NumberOfPoints=\"2\"><Points>\
             <DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"{format}\">{text}</DataArray>\
             </Points></Piece></PolyData></VTKFile>"
        );
        assert_eq!(positions("a.vtp", file), TWO, "{text}");
    }
}

#[test]
fn legacy_vtk_may_have_strings_metadata_and_whole_numbers() {
    let start = |kind| format!("# vtk DataFile Version 4.2\nt\n{kind}\nDATASET POLYDATA\n");
    // As VTK writes names of components, and texts with what ends them encoded.
    let field = "FIELD FieldData 3\nv 3 2 float\n1 1 1 1 1 1\nMETADATA\nCOMPONENT_NAMES\nu\nv\nw\n\n\
                 name 1 2 string\n\na%20b c\nclass 1 2 int\n0 1\n";
    let ascii = start("ASCII") + "POINTS 2 int\n1 2 3 4 5 6\nPOINT_DATA 2\n" + field;
    let file = read("a.vtk", ascii).expect("valid");
    assert_eq!((file.positions.as_slice(), file.classes), (&TWO[..], Some(vec![0, 1])));

    let long = [&[0x80, 100][..], &[b'x'; 100]].concat();
    let strings = [b"FIELD FieldData 1\nnote 1 3 string\n\xc5hello\xc0", &long[..]].concat();
    let points: Vec<u8> = TWO.iter().flat_map(|p| p.to_array()).flat_map(|v| (v as i16).to_be_bytes()).collect();
    let binary = [start("BINARY").as_bytes(), &strings, b"\nPOINTS 2 short\n", &points].concat();
    assert_eq!(positions("a.vtk", &binary), TWO);
    assert!(read("a.vtk", &binary[..100]).is_err());
    // Eight bytes on one machine, four on another.
    let long = start("BINARY") + "POINTS 0 long\n";
    assert!(matches!(read("a.vtk", long), Err(ReadError::WrongShape { .. })));
}

#[test]
fn what_could_be_read_in_two_ways_is_refused() {
    refused("a.xyz", "2\nwater\n8 1.5 2 3\n1 4.5 5 6\n", 1);
    assert_eq!(positions("a.xyz", "2\nwater\nO 1 2 3\nH 4 5 6\n"), TWO);
    assert_eq!(positions("a.xyz", "1 2 3 0\n4 5 6 0\n"), TWO);
    for name in ["a.xyz", "a.csv"] {
        refused(name, "1,5e-03,2,25e+00,-3,125e-01\n1,5e-03,2,25e+00,3,0e-01\n", 1);
    }
}

#[test]
fn x_y_z_go_before_momenta() {
    assert_eq!(positions("a.csv", "px,py,pz,x,y,z\n7,8,9,1,2,3\n7,8,9,4,5,6\n"), TWO);
}

#[test]
fn both_first_lines_of_radiance_maps_are_known() {
    for mark in ["RADIANCE", "RGBE"] {
        let header = format!("#?{mark}\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n");
        let content = [header.as_bytes(), &[128, 64, 32, 129].repeat(2)].concat();
        let map = environment_from_bytes(Path::new("a.hdr"), &content, None, &Budget::default()).expect(mark);
        assert_eq!(map.texels()[..4], [1.0, 0.5, 0.25, 1.0], "{mark}");
    }
}
