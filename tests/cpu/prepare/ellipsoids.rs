//! Ellipsoids of known and of awkward neighbourhoods, and the eigen-solver. Where they put the surface: `surfaces.rs`.

use glam::{DMat3, DVec3, Mat3, Vec3};
use meniscus::particles::Ellipsoid;
use meniscus::prepare::ellipsoids::eigen_symmetric;
use meniscus::prepare::{Fit, Options, prepare};
use meniscus::shader::SPLASH_RADIUS;

use super::{Random, block, input, report_of};

#[test]
fn eigen_solver_reconstructs() {
    let mut random = Random(2);
    let mut symmetric = |scale: DVec3| {
        let turn = glam::DQuat::from_xyzw(
            random.unit().into(),
            random.unit().into(),
            random.unit().into(),
            random.unit().into(),
        );
        let frame = DMat3::from_quat(turn.normalize());
        frame * DMat3::from_diagonal(scale) * frame.transpose()
    };
    let mut matrices = vec![DMat3::ZERO, DMat3::IDENTITY, DMat3::from_diagonal(DVec3::new(1.0, 3.0, 2.0))];
    for scale in [[1.0, 2.0, 3.0], [5.0, 5.0, 1.0], [1.0, 0.0, 0.0], [-2.0, 1e-9, 1e9], [1e-40, 2e-40, 0.0]] {
        matrices.extend((0..200).map(|_| symmetric(scale.into())));
    }
    for m in matrices {
        // Rotation leaves a rounding asymmetry; the solver reads one half.
        let m = (m + m.transpose()) * 0.5;
        let (values, frame) = eigen_symmetric(m);
        let back = frame * DMat3::from_diagonal(values) * frame.transpose();
        let size = m.to_cols_array().iter().fold(0f64, |a, b| a.max(b.abs()));
        assert!(back.abs_diff_eq(m, 1e-14 * size), "{m} became {back}");
        assert!(values.x >= values.y && values.y >= values.z);
        assert!((frame.transpose() * frame).abs_diff_eq(DMat3::IDENTITY, 1e-14));
        assert!((frame.determinant() - 1.0).abs() < 1e-14, "right-handed");
        for axis in [frame.x_axis, frame.y_axis] {
            assert!(axis.max_element() >= -axis.min_element(), "the larger end is positive");
        }
    }
}

fn yu_turk() -> Options {
    Options::default().ellipsoids(Fit::YuTurk)
}

/// With no splash, no smoothing: YuTurk13's ellipsoid of the particle at `at` keeps its centre.
fn body_at(positions: &[Vec3], at: Vec3) -> Ellipsoid {
    let options = yu_turk().splash_threshold(0.0).smoothing(0.0);
    let (particles, _) = prepare(&input(positions, 1.0), &options).unwrap();
    *particles.ellipsoids.iter().find(|e| e.center == at).unwrap()
}

#[test]
fn inside_a_lattice_the_ellipsoid_is_the_sphere() {
    for offset in [Vec3::ZERO, Vec3::new(1e6, -1e6, 1e6)] {
        let cube: Vec<_> = block([-5; 3], [5; 3]).iter().map(|p| p + offset).collect();
        let Ellipsoid { axes, .. } = body_at(&cube, offset);
        let square = axes * axes.transpose();
        assert!(square.abs_diff_eq(Mat3::IDENTITY, 1e-5), "{square}");
        let smoothed = prepare(&input(&cube, 1.0), &yu_turk()).unwrap().0.ellipsoids;
        let stays = |e: &Ellipsoid| e.center.abs_diff_eq(offset, 1e-6);
        assert!(smoothed.iter().any(stays), "the centre stays");
    }
}

#[test]
fn on_a_flat_surface_the_ellipsoid_is_flattened_along_the_normal() {
    let slab = block([-6, -9, -6], [6, 0, 6]);
    let Ellipsoid { axes, .. } = body_at(&slab, Vec3::ZERO);
    let lengths = axes.to_cols_array_2d().map(|axis| Vec3::from(axis).length());
    let normal = axes.z_axis.normalize();
    assert!(normal.y.abs() > 0.9999, "the shortest axis is the normal: {normal}");
    assert!((lengths[0] - lengths[1]).abs() < 1e-3 && lengths[0] > 0.95, "{lengths:?}");
    assert!((0.25..0.5).contains(&lengths[2]), "{lengths:?}");
    // The smoothed centre moves straight down, by about a spacing.
    let (particles, _) = prepare(&input(&slab, 1.0), &yu_turk()).unwrap();
    let axis = |e: &&Ellipsoid| e.center.x.abs() < 1e-4 && e.center.z.abs() < 1e-4;
    let column = particles.ellipsoids.iter().filter(axis).map(|e| e.center.y);
    let top = column.clone().fold(f32::NEG_INFINITY, f32::max);
    assert_eq!(column.count(), 10);
    assert!((-2.5..-1.5).contains(&top), "{top}");
}

#[test]
fn smoothing_moves_to_the_weighted_mean() {
    // 28 particles at distance 2 or 4 from the origin, all on one side, λ = ½.
    let mut cloud = vec![Vec3::ZERO];
    for k in 0..28 {
        let angle = k as f32 * 0.2;
        let ring = Vec3::new(angle.cos(), angle.sin(), 0.0) + Vec3::Z * 1.5;
        cloud.push(ring * if k % 2 == 0 { 1.0 } else { 2.0 });
    }
    let options = yu_turk().splash_threshold(0.0).smoothing(0.5);
    let (particles, _) = prepare(&input(&cloud, 1.0), &options).unwrap();
    let weight = |p: &DVec3| 1.0 - (p.length() / 8.0).powi(3);
    let points = cloud.iter().map(|p| p.as_dvec3());
    let sum: f64 = points.clone().map(|p| weight(&p)).sum();
    let mean: DVec3 = points.map(|p| p * weight(&p)).sum::<DVec3>() / sum;
    let expected = (0.5 * mean).as_vec3();
    let hit = |e: &&Ellipsoid| e.center.abs_diff_eq(expected, 1e-6);
    assert_eq!(particles.ellipsoids.iter().filter(hit).count(), 1, "one at {expected}");
}

#[test]
fn awkward_clouds_give_no_nan_hole_or_needle() {
    let mut random = Random(3);
    let mut clouds: Vec<(String, Vec<Vec3>)> = Vec::new();
    for n in 0..4 {
        clouds.push((format!("{n} alone"), (0..n).map(|i| Vec3::X * 1.5 * i as f32).collect()));
    }
    for (name, half) in [("collinear", Vec3::X), ("coplanar", Vec3::new(1.0, 1.0, 0.0))] {
        clouds.push((name.into(), random.cloud(200, Vec3::ZERO, half * 12.0)));
        let dense = random.cloud(200, Vec3::splat(1e6), half * 1e-3);
        clouds.push((format!("{name}, dense"), dense));
    }
    clouds.push(("coincident".into(), vec![Vec3::new(0.1, 0.2, 0.3); 100]));
    let pair = [vec![Vec3::ZERO; 50], vec![Vec3::X * 7.9; 50]].concat();
    clouds.push(("two heaps".into(), pair));
    let lone = [vec![Vec3::ZERO; 50], vec![Vec3::X * 7.9]].concat();
    clouds.push(("a heap and one".into(), lone));
    // Of each fit the longest and shortest semi-axis of the body, and the largest ratio.
    let fits = [(Fit::InPlace, 2.0001, 1.1999, 1.6668), (Fit::YuTurk, 1.2001, 0.0124, 4.001)];
    for (ellipsoids, longest, shortest, ratio) in fits {
        for radius in [1.0, 1e-12, 1e12] {
            for threshold in [0.0, 0.48, f32::INFINITY] {
                for support in [None, Some(2.0 * radius), Some(6.5 * radius)] {
                    let options = Options { splash_threshold: threshold, support, ellipsoids, ..Options::default() };
                    for (name, cloud) in &clouds {
                        let cloud: Vec<_> = cloud.iter().map(|p| p * radius).collect();
                        let name = format!("{name}, {ellipsoids:?}, {support:?}");
                        let (particles, report) = prepare(&input(&cloud, radius), &options).unwrap();
                        assert_eq!(particles.ellipsoids.len(), cloud.len(), "{name}: no hole");
                        assert_eq!(report.splash + report.body, cloud.len());
                        assert_eq!(particles.splash_count, report.splash);
                        for (k, e) in particles.ellipsoids.iter().enumerate() {
                            assert!(e.center.is_finite() && e.axes.is_finite(), "{name}: {e:?}");
                            let lengths = e.axes.to_cols_array_2d().map(|a| Vec3::from(a).length() / radius);
                            let (long, short) = (lengths[0].max(lengths[1]), lengths[2]);
                            let fits = long < longest && short > shortest && long < ratio * short;
                            let ball = e.axes == Mat3::from_diagonal(Vec3::splat(SPLASH_RADIUS * radius));
                            assert!(if k < report.splash { ball } else { fits }, "{name}: {e:?}");
                            assert!(e.axes.determinant() / radius.powi(3) > 0.0 || radius != 1.0);
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn guards_are_counted() {
    let body = yu_turk().splash_threshold(0.0);
    let count = |cloud: &[Vec3]| prepare(&input(cloud, 1.0), &body).unwrap().1;
    // 26 particles have 25 neighbours each: one too few.
    assert_eq!(count(&vec![Vec3::ONE; 26]).few_neighbours, 26);
    assert_eq!(
        count(&vec![Vec3::ONE; 27]),
        report_of(|r| {
            r.body = 27;
            r.degenerate = 27;
        })
    );
    // A long row: the middle is cut, the ends see half of it and are not; all are thickened.
    let line: Vec<_> = (0..200).map(|i| Vec3::X * 0.2 * i as f32).collect();
    let report = count(&line);
    assert!(report.clamped_ratio == 200 && report.degenerate == 0, "{report:?}");
    assert!((100..200).contains(&report.clamped_long), "{report:?}");
}

#[test]
fn in_place_cuts_are_counted() {
    let count = |cloud: &[Vec3], options: &Options| prepare(&input(cloud, 1.0), options).unwrap().1;
    let body = Options::default().splash_threshold(0.0);
    // What lies on one spot spreads alike along all axes; a row is thin and long, a block's inside is neither.
    assert_eq!(
        count(&[Vec3::ONE; 40], &body),
        report_of(|r| {
            r.body = 40;
        })
    );
    let row = block([0; 3], [0, 0, 19]);
    assert_eq!(
        count(&row, &body),
        report_of(|r| {
            r.body = 20;
            r.clamped_ratio = 20;
            r.clamped_long = 20;
        })
    );
    let sheet = block([0; 3], [0, 9, 9]);
    assert_eq!(
        count(&sheet, &body),
        report_of(|r| {
            r.body = 100;
            r.clamped_ratio = 100;
            r.clamped_long = 100;
        })
    );
    let inside = count(&block([0; 3], [9; 3]), &body);
    assert!(inside.clamped_ratio <= 1000 - 512 && inside.degenerate + inside.few_neighbours == 0, "{inside:?}");
}
