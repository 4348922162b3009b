use super::{ball, liquid, uniform_sky, view};
use glam::{DVec2, DVec3, Vec3};
use meniscus::{
    io::Budget,
    study::{
        first,
        mesh::{Mesh, MeshError},
        mesh_file::{MeshFileError, read, to_npz},
        random::Random,
        reconstruct::{ReconstructError, reconstruct},
        surface::{MeshSurface, Ray, Surface},
        tracer::Tracer,
    },
};
use std::{
    fs,
    path::{Path, PathBuf},
};

fn direction(random: &mut Random) -> DVec3 {
    loop {
        let v = 2.0 * DVec3::new(random.unit(), random.unit(), random.unit()) - 1.0;
        if v.length_squared() < 1.0 && v.length_squared() > 0.01 {
            return v.normalize();
        }
    }
}

/// Every triangle, by its plane and the sides of its edges.
fn nearest(mesh: &Mesh, ray: &Ray) -> Option<f64> {
    let met = mesh.triangles.iter().filter_map(|t| {
        let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
        let normal = (b - a).cross(c - a);
        let t = (a - ray.origin).dot(normal) / ray.dir.dot(normal);
        let p = ray.at(t);
        let inside =
            [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (*to - *from).cross(p - *from).dot(normal) >= 0.0);
        (inside && t >= 0.0 && t.is_finite()).then_some(t)
    });
    met.min_by(f64::total_cmp)
}

/// At any scale and place of the mesh, and from any distance.
#[test]
fn the_hierarchy_misses_nothing() {
    let mut random = Random::of(1, 2);
    for (scale, place) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
        let center = DVec3::new(place, -place, 0.5 * place);
        let mesh = ball(center, scale, 12);
        let surface = MeshSurface::new(&mesh);
        let (mut met, mut inside) = (0, 0);
        for i in 0..3000 {
            let distance = [0.0, 3.0, 1e5][i % 3] * scale;
            let origin = center + distance * direction(&mut random) + 0.3 * scale * direction(&mut random);
            // At something near the ball, the shorter half of them within it.
            let aim = center + 1.1 * scale * direction(&mut random);
            let ray = Ray { origin, dir: (aim - origin).normalize() };
            let (seen, right) = (surface.hit(&ray, None), nearest(&mesh, &ray));
            assert_eq!(seen.is_some(), right.is_some(), "{ray:?}: {seen:?} instead of {right:?}");
            let (Some(seen), Some(right)) = (seen, right) else { continue };
            assert!((seen.t - right).abs() <= 1e-9 * (right + center.length()), "{} instead of {right}", seen.t);
            met += 1;
            inside += usize::from(seen.geometric.dot(ray.dir) > 0.0);
            // On from there, and never at the same triangle.
            let on = Ray { origin: ray.at(seen.t), dir: ray.dir };
            let next = surface.hit(&on, Some(seen.id));
            assert_eq!(next.is_some(), seen.geometric.dot(ray.dir) < 0.0, "{on:?}: {next:?}");
        }
        assert!(met > 1500 && inside > 900, "{met} {inside}");
    }
}

/// Along an axis as any other way, whatever the signs of its zeros, and between triangles and through corners too.
#[test]
fn rays_along_axes_meet_what_others_meet() {
    let mesh = ball(DVec3::ZERO, 1.0, 12);
    let surface = MeshSurface::new(&mesh);
    let place = |i: &u32| mesh.vertices[*i as usize];
    // Every corner, the middle of every edge, and a lattice.
    let mut through = mesh.vertices.clone();
    through.extend(mesh.triangles.iter().map(|[a, b, _]| 0.5 * (place(a) + place(b))));
    through.extend(
        (0..17 * 17 * 17).map(|i| DVec3::new((i % 17).into(), (i / 17 % 17).into(), (i / 289).into()) / 8.0 - 1.0),
    );
    let zeros = [[0.0, 0.0], [-0.0, 0.0], [0.0, -0.0], [-0.0, -0.0], [-1e-60, 1e-60]];
    let mut met = 0;
    for (axis, sign, zeros) in (0..6).flat_map(|i| zeros.map(|z| (i / 2, 1.0 - f64::from(i as u8 % 2) * 2.0, z))) {
        let mut dir = DVec3::ZERO;
        (dir[axis], dir[(axis + 1) % 3], dir[(axis + 2) % 3]) = (sign, zeros[0], zeros[1]);
        for point in &through {
            let mut across = *point;
            across[axis] = 0.0;
            // All triangles lie between two balls.
            let half = [0.96f64, 1.0].map(|radius| (radius * radius - across.length_squared()).max(0.0).sqrt());
            if half[0] == 0.0 {
                continue;
            }
            for start in [-3.0, 0.0] {
                let hit = surface.hit(&Ray { origin: across + start * sign * DVec3::AXES[axis], dir }, None);
                let t = hit.unwrap_or_else(|| panic!("along {dir} through {point} nothing is met")).t + start;
                let [least, most] = half.map(|h| if start < 0.0 { -h } else { h });
                assert!((least.min(most) - 1e-12..=least.max(most) + 1e-12).contains(&t), "{t}: {least} to {most}");
                met += 1;
            }
        }
    }
    assert!(met > 100_000, "{met}");
}

/// What is there many times is met as if it were there once.
#[test]
fn triangles_that_come_again_change_nothing() {
    let once = ball(DVec3::ZERO, 1.0, 4);
    let mut often = once.clone();
    for k in 0..400 {
        often.triangles.extend(once.triangles.iter().map(|[a, b, c]| [[*a, *b, *c], [*b, *c, *a]][k % 2]));
    }
    often.check().expect("closed");
    let (once, often) = (MeshSurface::new(&once), MeshSurface::new(&often));
    let mut random = Random::of(4, 4);
    for _ in 0..500 {
        let (origin, aim) = (3.0 * direction(&mut random), 0.9 * direction(&mut random));
        let ray = Ray { origin, dir: (aim - origin).normalize() };
        let [a, b] = [&once, &often].map(|s| s.hit(&ray, None).map(|hit| (hit.t, hit.geometric)));
        assert_eq!(a, b, "{ray:?}");
    }
}

/// A fine mesh with a ball's normals bends light as the ball does; without normals facets show.
#[test]
fn interpolated_normals_bend_light() {
    let map = uniform_sky();
    let view = view(&map, [32, 32]);
    let mut mesh = ball(DVec3::ZERO, 1.0, 64);
    let errors = |mesh: &Mesh| {
        let surface = MeshSurface::new(mesh);
        let maps = first::maps(&Tracer::new(&surface, &view, &liquid(0.0)));
        let mut sum = (0.0, 0);
        for (i, seen) in maps.iter().enumerate() {
            let ray = view.ray(DVec2::new((i % 32) as f64 + 0.5, (i / 32) as f64 + 0.5));
            let b = (ray.origin + ray.dir * -ray.origin.dot(ray.dir)).length();
            if b < 0.9 {
                let turn = 2.0 * (b.asin() - (b / f64::from(liquid(0.0).ior)).asin());
                sum.0 += (seen.final_direction.as_dvec3().dot(ray.dir).min(1.0).acos() - turn).abs();
                sum.1 += 1;
            }
        }
        sum.0 / f64::from(sum.1)
    };
    let smooth = errors(&mesh);
    mesh.normals = None;
    let flat = errors(&mesh);
    assert!(smooth < 2e-3 && flat > 5e-3, "{smooth} with normals, {flat} without");
    // Where normals are no numbers, triangles are flat, and nothing else is.
    mesh.normals = Some(vec![Vec3::NAN; mesh.vertices.len()]);
    assert_eq!(errors(&mesh), flat);
}

/// A lattice of particles fills its cells.
#[test]
fn particles_have_a_closed_surface() {
    let radius = 0.02f32;
    let lattice: Vec<Vec3> =
        (0..1000).map(|i| Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32) * 2.0 * radius).collect();
    let volume = 1000.0 * (2.0 * f64::from(radius)).powi(3);
    let meshes = [0, 25].map(|passes| reconstruct(&lattice, radius, passes).expect("a surface"));
    for mesh in &meshes {
        mesh.check().expect("closed");
        let share = mesh.volume() / volume;
        assert!((0.8..1.2).contains(&share), "{share} of the particles' volume");
        let normals = mesh.normals.as_ref().expect("normals");
        let middle = DVec3::splat(9.0 * f64::from(radius));
        let outward = mesh.vertices.iter().zip(normals).filter(|(v, n)| (**v - middle).dot(n.as_dvec3()) > 0.0).count();
        assert!(outward > mesh.vertices.len() * 9 / 10, "{outward} of {}", mesh.vertices.len());
    }
    // Smoothing makes a surface smaller.
    let area = |m: &Mesh| {
        let of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| m.vertices[i as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        m.triangles.iter().map(of).sum::<f64>()
    };
    assert!(area(&meshes[1]) < 0.99 * area(&meshes[0]), "{} {}", area(&meshes[0]), area(&meshes[1]));
    assert_eq!(reconstruct(&[], radius, 25), Err(ReconstructError::NoParticles));
}

#[test]
fn mesh_files_give_the_mesh() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, content: &[u8]| -> PathBuf {
        fs::write(folder.path().join(name), content).expect("written");
        folder.path().join(name)
    };
    let budget = Budget::default();
    let mesh = ball(DVec3::new(0.1, 1e5, -3.0), 0.7, 6);
    assert_eq!(read(&file("m.npz", &to_npz(&mesh).expect("packed")), &budget).expect("read"), mesh);

    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let faces = [[1, 3, 2], [1, 2, 4], [1, 4, 3], [2, 3, 4]];
    let plain: String = faces.iter().map(|[a, b, c]| format!("f {a} {b} {c}\n")).collect();
    let obj = read(&file("t.obj", (vertices.to_owned() + &plain).as_bytes()), &budget).expect("read");
    obj.check().expect("closed");
    assert!((obj.volume() - 1.0 / 6.0).abs() < 1e-12 && obj.normals.is_none());
    let with: String = faces.iter().map(|[a, b, c]| format!("f {a}//{a} {b}//{b} {c}//{c}\n")).collect();
    let normals = "vn 0 0 -1\nvn 1 0 0\nvn 0 1 0\nvn 0 0 1\n";
    let obj = read(&file("n.obj", (vertices.to_owned() + normals + &with).as_bytes()), &budget).expect("read");
    for (vertex, normal) in obj.vertices.iter().zip(obj.normals.expect("normals")) {
        assert_eq!(normal, if *vertex == DVec3::ZERO { -Vec3::Z } else { vertex.as_vec3() });
    }

    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty float z\nproperty float nx\n\
                  property float ny\nproperty float nz\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n";
    let body = "0 0 0 0 0 -1\n1 0 0 1 0 0\n0 1 0 0 1 0\n0.5 0.5 0 0 0 1\n3 0 2 1\n4 0 1 3 2\n3 1 3 2\n";
    let ply = read(&file("t.ply", (header.to_owned() + body).as_bytes()), &budget).expect("read");
    assert_eq!(ply.triangles, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 3, 2]]);
    assert_eq!(ply.normals.expect("normals")[3], Vec3::Z);

    let failed = |path: PathBuf| read(&path, &budget).expect_err("refused");
    assert!(matches!(failed(file("m.stl", b"solid")), MeshFileError::Extension(_)));
    assert!(matches!(failed(folder.path().join("none.ply")), MeshFileError::Io { .. }));
    assert!(matches!(failed(file("cut.npz", &to_npz(&mesh).expect("packed")[..900])), MeshFileError::Archive(_)));
    for (name, content) in [("cut.ply", &header[..90]), ("bad.obj", "v 1 2\nf 1 2 x\n"), ("text.ply", "no ply")] {
        let said = failed(file(name, content.as_bytes())).to_string();
        assert!(said.contains(name) && said.contains("export"), "{said}");
    }
    for (name, line, index) in [("far_index", 6, "9223372036854775807"), ("before_first", 5, "-3")] {
        let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/corpus/obj_{name}.mesh-obj"));
        let said = failed(file("kept.obj", &fs::read(kept).expect("kept"))).to_string();
        assert!(said.contains(&format!("kept.obj: line {line} names number {index}")), "{said}");
    }
    let lie = header.replace("vertex 4", "vertex 4000000000");
    let said = failed(file("lie.ply", lie.as_bytes())).to_string();
    assert!(said.contains("lie.ply") && said.contains("promises 4000000000 entries"), "{said}");
    let negative = (header.to_owned() + body).replace("3 1 3 2", "3 -1 3 2");
    let mesh = read(&file("neg.ply", negative.as_bytes()), &budget).expect("read");
    assert!(matches!(mesh.check(), Err(MeshError::Corner { triangle: 3, .. })));
    let small = "1M".parse().expect("an amount");
    let large = file("large.obj", &vec![b'\n'; 100_000]);
    assert!(matches!(read(&large, &small), Err(MeshFileError::TooLarge { .. })));
}
