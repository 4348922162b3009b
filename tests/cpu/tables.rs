//! Tables as simulators write them, and ids in every format that has a place for them.

use super::hostile::bytes;
use glam::DVec3;
use meniscus::io::Budget;
use meniscus::io::particles::{ParticleFile, describe};

/// As `JOutputCsv::SaveCsv` of DualSPHysics writes it: lines of its caller's, names with units, and a separator behind each value.
fn dualsphysics(separator: char) -> String {
    let text = "Part;Time [s];Count\n3;0.25;2\nPos.x [m];Pos.y [m];Pos.z [m];Idp;Vel.x [m/s];Vel.y [m/s];Vel.z [m/s];Rhop [kg/m^3];\n\
                0.5;-1.25;2;7;1;-2;0.5;1000.5;\n3;4.5;-0.125;5;0;4;8;999;\n";
    text.replace(';', &separator.to_string())
}

#[test]
fn dualsphysics_writes_units_and_lines_before_the_names() {
    let positions = vec![DVec3::new(0.5, -1.25, 2.0), DVec3::new(3.0, 4.5, -0.125)];
    let velocities = Some(vec![DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.0, 4.0, 8.0)]);
    for separator in [';', ','] {
        let text = dualsphysics(separator);
        let read = bytes("PartFluid_0003.csv", &text).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((read.positions, read.velocities), (positions.clone(), velocities.clone()));
        assert_eq!(read.ids, Some(vec![7, 5]));
        // Lines are those of the file, not of the table.
        let error = bytes("a.csv", text.replace("4.5", "high")).expect_err("no number").to_string();
        assert!(error.contains("line 5") && error.contains("`high`"), "{error}");
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.csv");
        std::fs::write(&path, &text).expect("written");
        let (_, contents) = describe(&path, &Budget::default()).expect("it reads");
        assert_eq!(contents.time, Some(0.25));
        let names: Vec<_> = contents.arrays.iter().map(|array| array.name.as_str()).collect();
        assert_eq!(names[..4], ["Pos.x [m]", "Pos.y [m]", "Pos.z [m]", "Idp"]);
    }
    // Without lines before, and with a comment instead.
    let table: String = dualsphysics(';').lines().skip(2).map(|line| format!("{line}\n")).collect();
    for before in ["", "# PartVTK\n", "\n", "Case Dambreak, run 7\n"] {
        assert_eq!(bytes("a.csv", format!("{before}{table}")).expect(before).positions, positions);
    }
}

#[test]
fn names_with_units_and_names_with_indices() {
    for header in ["x (m),y (m),z (m)", "X[mm],Y[mm],Z[mm]", "P[0],P[1],P[2]"] {
        let read = bytes("a.csv", format!("{header}\n1,2,3\n")).unwrap_or_else(|error| panic!("{header}: {error}"));
        assert_eq!(read.positions, [DVec3::new(1.0, 2.0, 3.0)], "{header}");
    }
    // Numbers are data, whatever is below them.
    let error = bytes("a.csv", "1,2,3\nx,y,z\n4,5,6\n").expect_err("two tables").to_string();
    assert!(error.contains("line 2"), "{error}");
    // Words without names of positions soon after them are an error of the first line.
    let error = bytes("a.csv", "a,b,c\n1,2,3\n").expect_err("no positions").to_string();
    assert!(error.contains("holds no positions") && error.contains("a, b, c"), "{error}");
}

/// Two particles with these ids, in every format that has a place for them.
fn with_ids(first: &str, second: &str) -> Vec<(&'static str, Vec<u8>)> {
    let vtk = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n0 0 0 1 1 1\nPOINT_DATA 2\n";
    let xml = format!(
        "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"2\"><PointData><DataArray type=\"Float64\" Name=\"ids\" \
         format=\"ascii\">{first} {second}</DataArray></PointData><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" \
         format=\"ascii\">0 0 0 1 1 1</DataArray></Points></Piece></PolyData></VTKFile>"
    );
    let axes = "property float x\nproperty float y\nproperty float z\n";
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 2\n{axes}property double id\nend_header\n0 0 0 {first}\n1 1 1 {second}\n"
    );
    vec![
        ("a.csv", format!("x,y,z,particle_id\n0,0,0,{first}\n1,1,1,{second}\n").into()),
        ("a.vtk", format!("{vtk}FIELD FieldData 1\nid 1 2 double\n{first} {second}\n").into()),
        ("a.vtk", format!("{vtk}SCALARS ID double\nLOOKUP_TABLE default\n{first} {second}\n").into()),
        ("a.vtp", xml.into()),
        ("a.ply", ply.into()),
    ]
}

#[test]
fn ids_of_every_format_put_particles_in_order() {
    let mut all = with_ids("7", "3");
    let mut bgeo = b"BgeoV".to_vec();
    bgeo.extend([5_i32, 2, 0, 0, 0, 1, 0, 0, 0].map(i32::to_be_bytes).concat());
    bgeo.extend(b"\0\x02id\0\x01\0\0\0\x01\0\0\0\0");
    for (place, id) in [(0.0_f32, 7_i32), (1.0, 3)] {
        bgeo.extend([place, place, place, 1.0].map(f32::to_be_bytes).concat());
        bgeo.extend(id.to_be_bytes());
    }
    all.push(("a.bgeo", bgeo));
    for (name, content) in all {
        let mut read = bytes(name, &content).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(
            (read.ids.as_deref(), &read.positions[..]),
            (Some(&[7, 3][..]), &[DVec3::ZERO, DVec3::ONE][..]),
            "{name}"
        );
        read.sort_by_ids();
        assert_eq!(
            (read.ids.as_deref(), &read.positions[..]),
            (Some(&[3, 7][..]), &[DVec3::ONE, DVec3::ZERO][..]),
            "{name}"
        );
    }
    // Something else may be called so.
    for (name, content) in with_ids("0.5", "3").into_iter().chain(with_ids("-1", "3")) {
        assert_eq!(bytes(name, &content).expect(name).ids, None, "{name}");
    }
}

#[test]
fn sorting_keeps_particles_whole() {
    let count = 1000_u64;
    // A permutation of many cycles.
    let ids: Vec<u64> = (0..count).map(|i| i * 387 % 1009).collect();
    let place = |id: u64| DVec3::new(id as f64, 0.5 * id as f64, -(id as f64));
    let file = ParticleFile {
        positions: ids.iter().map(|id| place(*id)).collect(),
        velocities: Some(ids.iter().map(|id| -place(*id)).collect()),
        classes: Some(ids.iter().map(|id| (id % 2) as u8).collect()),
        ids: Some(ids),
        ..ParticleFile::default()
    };
    let mut sorted = file.clone();
    sorted.sort_by_ids();
    let ids = sorted.ids.clone().expect("ids");
    assert!(ids.is_sorted() && ids.len() == count as usize);
    for (i, id) in ids.iter().enumerate() {
        assert_eq!(sorted.positions[i], place(*id));
        assert_eq!(sorted.velocities.as_ref().expect("velocities")[i], -place(*id));
        assert_eq!(sorted.classes.as_ref().expect("classes")[i], (id % 2) as u8);
    }
    // One twice: nobody knows which is which.
    let mut twice = file;
    twice.ids.iter_mut().for_each(|ids| ids[9] = ids[8]);
    let before = twice.clone();
    twice.sort_by_ids();
    assert_eq!(twice, before);
}
