//! LAMMPS dumps: as LAMMPS writes them, and as its manual says.

use super::hostile::{bytes, corpus};
use glam::DVec3;
use meniscus::io::Budget;
use meniscus::io::particles::{describe, read};

/// Position and velocity of the first atom at the last time step.
const FIRST: [f64; 6] = [2.63641968, 0.593666274, 2.67080076, -2.69525491, 2.58175291, -7.06461285];

/// By LAMMPS: 32 atoms in a tilted box at two time steps. One dump has positions and velocities, sorted; the other shares of the box in
/// whatever order.
#[test]
fn scaled_positions_are_those_that_are_not() {
    let (plain, contents) = describe(&corpus("lammps_tilted.lammpstrj"), &Budget::default()).expect("a dump");
    assert_eq!((contents.step, contents.steps), (Some(20), Some(2)));
    assert!((contents.time.expect("dump_modify time yes") - 0.1).abs() < 1e-12);
    assert_eq!(contents.arrays.len(), 8);
    assert_eq!(plain.ids, Some((1..=32).collect()));
    // Of the last time step.
    assert_eq!(plain.positions[0], DVec3::new(FIRST[0], FIRST[1], FIRST[2]));
    assert_eq!(plain.velocities.as_ref().expect("velocities")[0], DVec3::new(FIRST[3], FIRST[4], FIRST[5]));
    let mut scaled = read(&corpus("lammps_tilted_scaled.lammpstrj")).expect("a dump");
    assert_ne!(scaled.ids, plain.ids, "in the order of atoms, nothing has to be sorted");
    scaled.sort_by_ids();
    assert_eq!(scaled.ids, plain.ids);
    for (i, (a, b)) in plain.positions.iter().zip(&scaled.positions).enumerate() {
        assert!(a.distance(*b) < 1e-7, "atom {i}: {a} {b}");
    }
    let default_style = read(&corpus("lammps_atom.dump")).expect("dump atom");
    assert_eq!(default_style.positions.len(), 32);
    let side = 3.359192382765015;
    assert!(
        default_style.positions.iter().all(|p| p.cmpge(DVec3::splat(-0.01)).all() && p.cmple(DVec3::splat(side)).all())
    );
    assert!(default_style.positions.iter().any(|p| p.max_element() > 0.7 * side), "they are shares");
}

fn dump(bounds: &str, columns: &str, rows: &str) -> String {
    let count = rows.lines().count();
    format!(
        "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{count}\nITEM: BOX BOUNDS {bounds}\nITEM: ATOMS {columns}\n{rows}\n"
    )
}

#[test]
fn columns_and_boxes() {
    let one = |bounds: &str, columns: &str, row: &str| {
        let text = dump(bounds, columns, row);
        let read = bytes("dump.120", &text).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(read.positions.len(), 1);
        read
    };
    let upright = "pp ff mm\n-1 3\n0 2\n10 11";
    assert_eq!(one(upright, "type zs ys xs", "1 0.5 0.25 0.75").positions[0], DVec3::new(2.0, 0.5, 10.5));
    // Wrapped before unwrapped before scaled, whatever comes first.
    assert_eq!(one(upright, "xs ys zs xu yu zu x y z", "0 0 0 4 5 6 1 2 3").positions[0], DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(one(upright, "xs ys zs xu yu zu x", "0 0 0 4 5 6 1").positions[0], DVec3::new(4.0, 5.0, 6.0));
    assert_eq!(one(upright, "xsu ysu zsu", "1.5 0 -1").positions[0], DVec3::new(5.0, 0.0, 9.0));
    // xlo is -1 and xhi 1: the bounds are of the tilted box.
    let tilted = "xy xz yz pp pp pp\n-1.5 3 -0.5\n0 2.25 2\n0 1 0.25";
    assert_eq!(one(tilted, "xs ys zs", "0 0 0").positions[0], DVec3::new(-1.0, 0.0, 0.0));
    assert_eq!(one(tilted, "xs ys zs", "0.5 1 1").positions[0], DVec3::new(1.5, 2.25, 1.0));
    let general = "abc origin\n2 0 0 10\n0 0 3 20\n0 1 0 30";
    assert_eq!(one(general, "xs ys zs", "0.5 1 0.25").positions[0], DVec3::new(11.0, 20.25, 33.0));
    let grains = one(upright, "id element x y z diameter class vx vy vz", "90071992547409 Si 1 2 3 0.5 1 4 5 6");
    assert_eq!((grains.radius, grains.classes), (Some(0.25), Some(vec![1])));
    assert_eq!(
        (grains.ids, grains.velocities),
        (Some(vec![90_071_992_547_409]), Some(vec![DVec3::new(4.0, 5.0, 6.0)]))
    );
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let refused = |text: &str, words: &[&str]| {
        let message = bytes("a.dump", text).expect_err(text).to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    let good = dump("pp pp pp\n0 1\n0 1\n0 1", "id x y z", "1 0 0 0\n2 1 1 1");
    assert_eq!(bytes("a.dump", &good).expect("good").positions.len(), 2);
    // What is wrong in a time step before the last does not matter.
    assert_eq!(
        bytes("a.dump", format!("{}{good}", &good[..good.find("ITEM: ATOMS").unwrap_or(0)]))
            .expect("good")
            .positions
            .len(),
        2
    );
    refused(&good.replace("2 1 1 1", "2 1 1"), &["line 11", "3 columns, where ITEM: ATOMS names 4"]);
    refused(&good.replace("2 1 1 1", "2 1 a 1"), &["line 11", "`a`"]);
    refused(&good.replace("2 1 1 1", "-2 1 1 1"), &["line 11", "an id expected"]);
    refused(&good.replace("\n2 1 1 1", ""), &["2 atoms promised, 1 found"]);
    refused(&format!("{good}3 2 2 2\n"), &["line 12", "more lines"]);
    refused(&good.replace("ATOMS\n2", "ATOMS\n4000000000"), &["too short"]);
    refused(&good.replace("ATOMS\n2", "ATOMS\n-1"), &["line 4"]);
    refused(&good.replace("id x y z", "id c_a y z"), &["holds no positions", "id, c_a, y, z"]);
    refused(
        &good.replace("ITEM: BOX BOUNDS pp pp pp\n0 1\n0 1\n0 1\n", "").replace("x y z", "xs ys zs"),
        &["BOX BOUNDS", "dump ID"],
    );
    refused(&good.replace("pp pp pp\n0 1\n", "pp pp pp\n0 1 0\n"), &["line 6", "2 numbers"]);
    refused("1 2 3\n", &["ITEM: TIMESTEP", "dump ID all custom"]);
    let later = format!("{good}{good}").replacen("2 1 1 1", "2 1 1 1 1", 2).replacen("2 1 1 1 1", "2 1 1 1", 1);
    refused(&later, &["line 22"]);
}
