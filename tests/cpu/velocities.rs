//! Velocities: read of every format that has a place for them, kept beside their particles, and made speeds.

use glam::{DVec3, Vec3};
use meniscus::{
    io::{
        budget::Budget,
        particles::{Invalid, ParticleFile, ReadError, check_finite, read_bytes},
    },
    prepare::{self, Fit, Input, Options, PrepareError},
};
use std::path::Path;

fn read(name: &str, content: impl AsRef<[u8]>) -> Result<ParticleFile, ReadError> {
    read_bytes(Path::new(name), content.as_ref(), &Budget::default())
}

fn expected() -> Option<Vec<DVec3>> {
    Some(vec![DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.0, 4.0, 8.0)])
}

/// Two points with velocities, in formats of text: velocities are told by name and number of components.
fn texts(name: &str, components: u32) -> Vec<(&'static str, String)> {
    let values = ["1 -2 0.5 0 4 8", "1 -2"][usize::from(components != 3)];
    let vtk = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n0 0 0 1 1 1\nPOINT_DATA 2\n";
    let xml = |extension, kind| {
        let text = format!(
            "<VTKFile type=\"{kind}\"><{kind}><Piece NumberOfPoints=\"2\"><PointData><DataArray type=\"Float32\" \
             Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">{values}</DataArray></PointData><Points>\
             <DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 1 1</DataArray></Points></Piece>\
             </{kind}></VTKFile>"
        );
        (extension, text)
    };
    let mut all = vec![
        ("a.vtk", format!("{vtk}FIELD FieldData 2\n{name} {components} 2 float\n{values}\nclass 1 2 int\n0 1\n")),
        ("a.vtk", format!("{vtk}SCALARS {name} float {components}\nLOOKUP_TABLE default\n{values}\n")),
        xml("a.vtu", "UnstructuredGrid"),
        xml("a.vtp", "PolyData"),
    ];
    if components == 3 {
        all.push(("a.vtk", format!("{vtk}VECTORS {name} float\n{values}\nSCALARS class int\n0 1\n")));
    }
    all
}

#[test]
fn point_arrays_of_vtk() {
    for name in ["velocity", "v", "U"] {
        for (file, text) in texts(name, 3) {
            let read = read(file, &text).unwrap_or_else(|e| panic!("{e}: {text}"));
            assert_eq!(read.velocities, expected(), "{text}");
            assert_eq!(read.classes.is_some(), text.contains("class"), "{text}");
        }
    }
    // Of another name, or with other than three components, it is something else.
    for (file, text) in texts("normal", 3).into_iter().chain(texts("v", 1)) {
        assert_eq!(read(file, &text).expect("it reads").velocities, None, "{text}");
    }
    // Cells have velocities of their own.
    let (file, text) = texts("v", 3).remove(0);
    assert_eq!(read(file, text.replace("POINT_DATA", "CELL_DATA")).expect("it reads").velocities, None);
    let twice = texts("v", 3).into_iter().map(|(file, text)| {
        let array =
            "<DataArray type=\"Float32\" Name=\"U\" NumberOfComponents=\"3\" format=\"ascii\">1 2 3 4 5 6</DataArray>";
        (file, text.replace("</PointData>", &format!("{array}</PointData>")) + "VECTORS U float\n1 2 3 4 5 6\n")
    });
    for (file, text) in twice {
        let text = text.replace("</VTKFile>VECTORS U float\n1 2 3 4 5 6\n", "</VTKFile>");
        let error = read(file, &text).expect_err("which one?").to_string();
        assert!(error.contains("second array of velocities"), "{error}: {text}");
    }
    let (file, text) = texts("v", 3).remove(0);
    let short = text.replace("v 3 2 float\n1 -2 0.5 0 4 8", "v 3 1 float\n1 -2 0.5");
    let error = read(file, short).expect_err("one for two");
    assert!(matches!(&error, ReadError::UnequalLengths { array, found: 1, expected: 2, .. } if array == "velocity"));
}

#[test]
fn columns_and_properties() {
    for header in
        ["x,y,z,vx,vy,vz", "Points:0,Points:1,Points:2,velocity:0,velocity:1,velocity:2", "x,y,z,Vel_X,Vel_Y,Vel_Z"]
    {
        let text = format!("{header}\n0,0,0,1,-2,0.5\n1,1,1,0,4,8\n");
        assert_eq!(read("a.csv", text).expect("it reads").velocities, expected(), "{header}");
    }
    let some = read("a.csv", "x,y,z,vx,vy\n0,0,0,1,2\n").expect("it reads");
    assert_eq!((some.positions.len(), some.velocities), (1, None), "two of three columns are no velocity");
    read("a.csv", "x,y,z,vx,vy,vz,vx\n0,0,0,1,2,3,4\n").expect_err("a column twice");

    let ply = |names: &str| {
        format!("ply\nformat ascii 1.0\nelement vertex 2\n{names}end_header\n0 0 0 1 -2 0.5\n1 1 1 0 4 8\n")
    };
    let property = |names: [&str; 6]| names.map(|n| format!("property float {n}\n")).concat();
    let read_ply = |names| read("a.ply", ply(&property(names))).expect("it reads").velocities;
    assert_eq!(read_ply(["x", "y", "z", "vx", "vy", "vz"]), expected());
    assert_eq!(read_ply(["x", "y", "z", "nx", "ny", "nz"]), None);
}

/// Two points whose attributes are these: name, type, numbers.
fn bgeo(attributes: &[(&str, i32, &[[f32; 3]])]) -> Vec<u8> {
    let mut content = b"BgeoV".to_vec();
    content.extend([5, 2, 0, 0, 0, attributes.len() as i32, 0, 0, 0].iter().flat_map(|v: &i32| v.to_be_bytes()));
    for (name, kind, _) in attributes {
        content.extend((name.len() as u16).to_be_bytes());
        content.extend(name.as_bytes());
        content.extend(3u16.to_be_bytes());
        content.extend(kind.to_be_bytes());
        content.extend([0; 12]);
    }
    for point in 0..2 {
        content.extend([0.0, 0.0, point as f32, 1.0].iter().flat_map(|v: &f32| v.to_be_bytes()));
        content.extend(attributes.iter().flat_map(|a| a.2[point]).flat_map(f32::to_be_bytes));
    }
    content
}

#[test]
fn attributes_of_bgeo() {
    let values = [[1.0, -2.0, 0.5], [0.0, 4.0, 8.0]];
    let other = [[9.0; 3]; 2];
    for (name, kind) in [("v", 5), ("velocity", 5), ("v", 0)] {
        let file = bgeo(&[("force", 5, &other), (name, kind, &values), ("N", 5, &other)]);
        let read = read("a.bgeo", file).expect("it reads");
        assert_eq!((read.velocities, read.positions[1]), (expected(), DVec3::Z), "{name}");
    }
    // Integers are no velocity.
    assert_eq!(read("a.bgeo", bgeo(&[("v", 1, &values)])).expect("it reads").velocities, None);
    read("a.bgeo", bgeo(&[("v", 5, &values), ("velocity", 5, &other)])).expect_err("which one?");
}

#[test]
fn particles_whose_velocity_is_not_finite_are_refused_or_dropped() {
    let path = Path::new("a.csv");
    let broken =
        read("a.csv", "x,y,z,vx,vy,vz\n0,0,0,1,0,0\n1,0,0,nan,0,0\ninf,0,0,3,0,0\n2,0,0,4,0,0\n").expect("read");
    let error = check_finite(&mut broken.clone(), Invalid::Reject, path).expect_err("two are not");
    assert!(matches!(error, ReadError::NonFinite { first: 1, count: 2, total: 4, .. }), "{error:?}");
    let mut dropped = broken;
    assert_eq!(check_finite(&mut dropped, Invalid::Drop, path).expect("dropped"), 2);
    assert_eq!(dropped.positions, [DVec3::ZERO, 2.0 * DVec3::X]);
    assert_eq!(dropped.velocities, Some(vec![DVec3::X, 4.0 * DVec3::X]));
}

/// Each particle as drawn has the speed of its own, in whatever order they come.
#[test]
fn speeds_go_with_their_particles() {
    // Splashes far apart among a filled block, and two at one place.
    let mut positions: Vec<Vec3> =
        (0..512).map(|i| 0.1 * Vec3::new((i % 8) as f32, (i / 8 % 8) as f32, (i / 64) as f32)).collect();
    positions.extend((0..20).map(|i| Vec3::new(3.0 + i as f32, 0.0, 0.0)));
    positions.push(positions[7]);
    let speed_of = |p: Vec3| 1.0 + p.x + 10.0 * p.y + 100.0 * p.z;
    let mut velocities: Vec<Vec3> = positions.iter().map(|p| speed_of(*p) * Vec3::new(0.6, 0.0, -0.8)).collect();
    *velocities.last_mut().expect("one") *= 2.0;
    let centres_stay = Options::default().ellipsoids(Fit::YuTurk).smoothing(0.0);
    let run = |positions: &[Vec3], velocities: &[Vec3]| {
        let input = Input::new(positions, 0.05);
        prepare::prepare_with_velocities(&input, velocities, &centres_stay, &|_| ())
    };
    let (particles, report, speeds) = run(&positions, &velocities).expect("it prepares");
    assert!(report.splash >= 20 && report.body > 400, "{report:?}");
    let mut twice = 0;
    for (e, speed) in particles.ellipsoids.iter().zip(&speeds) {
        let ratio = speed / speed_of(e.center);
        twice += usize::from((ratio - 2.0).abs() < 1e-4);
        assert!((ratio - 1.0).abs() < 1e-4 || (ratio - 2.0).abs() < 1e-4, "{e:?}: {speed}");
    }
    assert_eq!((twice, speeds.len()), (1, positions.len()));
    // The same bits in any order, and the same particles as without velocities.
    positions.reverse();
    velocities.reverse();
    assert_eq!(run(&positions, &velocities).expect("it prepares"), (particles.clone(), report, speeds));
    let still = Input::new(&positions, 0.05);
    assert_eq!(prepare::prepare(&still, &centres_stay).expect("it prepares").0, particles);

    assert!(matches!(run(&positions, &velocities[1..]), Err(PrepareError::Length { what: "velocities", .. })));
    velocities[3].y = f32::INFINITY;
    assert!(matches!(run(&positions, &velocities), Err(PrepareError::Velocity { index: 3, .. })));
    // Squares that are no float32 numbers.
    let fast = run(&positions[..1], &[Vec3::splat(1e30)]).expect("it prepares").2;
    assert!((fast[0] / 1.732_050_8e30 - 1.0).abs() < 1e-6, "{fast:?}");
}
