//! Normals from one-sided differences (Green10) against planes and a sphere.

use crate::twin_plane_fit::{frame, plane, tilted};
use glam::{DVec3, Vec3};
use meniscus::shader::{SIDE_BACK, SIDE_FRONT};
use meniscus::smooth::{normals::twin::normals, plane_fit::twin::view_ray};
use meniscus::twin::normal::{decode_normal, encode_normal};

const SIZE: [u32; 2] = [61, 47];

fn degrees(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

#[test]
fn a_tilted_plane_has_its_normal() {
    let frame = frame(SIZE);
    for tilt in (0..=85).step_by(5) {
        let (_, n) = tilted(f64::from(tilt), 37.0 + 50.0 * f64::from(tilt));
        let depth = plane(&frame, n, 1.5, |x, y| x != 20 && y != 30);
        let raw = vec![7; depth.len()];
        for (side, expected) in [(SIDE_FRONT, n), (SIDE_BACK, -n)] {
            let result = normals(&frame, &depth, &raw, side);
            let mut seen = 0;
            for (i, d) in depth.iter().enumerate() {
                if *d == 0.0 {
                    assert_eq!(result.normal[i], 0);
                } else if result.normal[i] != 7 {
                    let angle = degrees(decode_normal(result.normal[i]).as_dvec3(), expected);
                    // The code holds 0.004 degrees. A rounded depth tilts the difference by about a float's step times
                    // the image's height in pixels, 0.0004 degrees; a plane seen at 85 degrees or more lessens it.
                    assert!(angle < 0.006, "{tilt}, {i}: {angle}");
                    seen += 1;
                }
            }
            assert!(seen > 500, "{tilt}: {seen}");
            assert_eq!(result.degenerate as usize, result.normal.iter().filter(|n| **n == 7).count());
        }
    }
}

#[test]
fn a_sphere_has_its_normals() {
    let frame = frame(SIZE);
    let (center, radius) = (DVec3::new(0.1, -0.05, -2.0), 0.6);
    let pixel = 2.0 / f64::from(frame.pixel_scale.x);
    for side in [SIDE_FRONT, SIDE_BACK] {
        let mut depth = Vec::new();
        for (y, x) in (0..SIZE[1] as i32).flat_map(|y| (0..SIZE[0] as i32).map(move |x| (y, x))) {
            let v = view_ray(&frame, x, y);
            let (a, b, c) = (v.length_squared(), v.dot(center), center.length_squared() - radius * radius);
            let root = b * b - a * c;
            let d = if side == SIDE_FRONT { b - root.sqrt() } else { b + root.sqrt() } / a;
            depth.push(if root > 0.0 { d as f32 } else { 0.0 });
        }
        let result = normals(&frame, &depth, &vec![7; depth.len()], side);
        let (mut seen, mut straight) = (0, 0);
        for (i, d) in depth.iter().enumerate().filter(|(i, d)| **d > 0.0 && result.normal[*i] != 7) {
            let v = view_ray(&frame, i as i32 % SIZE[0] as i32, i as i32 / SIZE[0] as i32);
            let expected = (v * f64::from(*d) - center) / radius;
            let facing = expected.dot(v.normalize()).abs();
            let angle = degrees(decode_normal(result.normal[i]).as_dvec3(), expected);
            // A difference over one pixel is the normal half a pixel away on each axis; a pixel sees 1 / facing
            // times its width of surface. The smaller jump lies towards the middle, where that shrinks.
            let half = 0.5 * std::f64::consts::SQRT_2 * pixel * f64::from(*d) / 2.0 / radius / facing;
            assert!(angle < 1.2 * half.to_degrees() + 0.006, "{i}: {angle}, facing {facing}");
            seen += 1;
            straight += u32::from(facing > 0.5);
        }
        assert!(seen > 600 && straight > 400, "{seen}, {straight}");
    }
}

#[test]
fn a_jump_is_not_differenced() {
    // Two flat halves: at the edge each takes its own side.
    let frame = frame(SIZE);
    let depth: Vec<f32> = (0..SIZE[0] * SIZE[1]).map(|i| if i % SIZE[0] < 30 { 1.0 } else { 1.3 }).collect();
    let result = normals(&frame, &depth, &vec![7; depth.len()], SIDE_FRONT);
    assert!(result.normal.iter().all(|n| *n == encode_normal(Vec3::Z)));
    assert_eq!(result.degenerate, 0);
}

#[test]
fn lone_pixels_and_lines_keep_the_ray_cast_normal() {
    let frame = frame(SIZE);
    let at = |x: usize, y: usize| y * SIZE[0] as usize + x;
    let mut depth = vec![0.0; (SIZE[0] * SIZE[1]) as usize];
    let raw: Vec<u32> = (1..=depth.len() as u32).collect();
    depth[at(0, 0)] = 1.0;
    depth[at(60, 46)] = 1.0;
    depth[at(10, 10)] = 1.0;
    depth[at(11, 10)] = 1.0;
    depth[at(10, 11)] = -1.0; // behind the near plane: no neighbour, no normal
    depth[at(30, 29)] = 1.0;
    depth[at(30, 30)] = 1.0;
    depth[at(0, 20)] = 1.0; // the end of the row above is no neighbour
    depth[at(60, 19)] = 1.0;
    let result = normals(&frame, &depth, &raw, SIDE_FRONT);
    for (i, d) in depth.iter().enumerate() {
        assert_eq!(result.normal[i], if *d > 0.0 { raw[i] } else { 0 });
    }
    assert_eq!(result.degenerate, 8);
}
