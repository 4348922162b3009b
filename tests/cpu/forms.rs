//! Forms of files that other programs write, beyond those in `io.rs`: each was once refused, or read wrongly.

use std::path::Path;

use glam::DVec3;
use meniscus::io::Budget;
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
