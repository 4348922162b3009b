//! The truth and the measures, against closed forms and independent implementations.

mod film;
mod light_model;
mod measures;
mod mesh;
mod tracer;

use glam::{DVec3, Vec3};
use meniscus::{
    Camera, Equirect,
    settings::Liquid,
    study::{mesh::Mesh, view::View},
};

/// The same light from everywhere.
fn uniform_sky() -> Equirect {
    Equirect::new(4, 2, &[[1.0; 3]; 8]).expect("a map")
}

fn liquid(absorption: f32) -> Liquid {
    let mut liquid = Liquid::default();
    liquid.absorption = Vec3::splat(absorption);
    liquid
}

/// From z = 5 straight at the origin.
fn view(map: &Equirect, size: [u32; 2]) -> View<'_> {
    let camera =
        Camera::look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, Vec3::Y, 0.6, size[0] as f32 / size[1] as f32, 0.1);
    View::new(&camera, size, map)
}

/// A ball as a closed mesh of `rings` x 2 `rings` quads, with the ball's own normals.
fn ball(center: DVec3, radius: f64, rings: u32) -> Mesh {
    let around = 2 * rings;
    let mut normals = vec![DVec3::Y];
    for i in 1..rings {
        let polar = std::f64::consts::PI * f64::from(i) / f64::from(rings);
        normals.extend((0..around).map(|j| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(j) / f64::from(around)).sin_cos();
            DVec3::new(polar.sin() * cos, polar.cos(), -polar.sin() * sin)
        }));
    }
    normals.push(-DVec3::Y);
    let (last, at) = (normals.len() as u32 - 1, |i: u32, j: u32| 1 + (i - 1) * around + j % around);
    let mut triangles = Vec::new();
    for j in 0..around {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([last, at(rings - 1, j + 1), at(rings - 1, j)]);
        for i in 1..rings - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let vertices = normals.iter().map(|n| center + radius * *n).collect();
    Mesh { vertices, triangles, normals: Some(normals.iter().map(|n| n.as_vec3()).collect()) }
}
