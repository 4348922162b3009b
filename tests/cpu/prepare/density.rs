//! Densities against closed forms, classes of known shapes, and the estimated radius.

use glam::Vec3;
use meniscus::particles::Class;
use meniscus::prepare::density::{lattice, rest_density, spline};
use meniscus::prepare::ellipsoids::lattice_variance;
use meniscus::prepare::{
    DensityField, Options, PrepareError, classes_over, classify, densities, estimate_radius, prepare,
};

use super::{Random, block, input, run};

#[test]
fn spline_and_lattice_have_their_closed_values() {
    assert_eq!([0.0, 0.5, 1.0, 2.0].map(spline), [1.0, 0.25, 0.0, 0.0]);
    let slope = (spline(0.5 + 1e-6) - spline(0.5 - 1e-6)) / 2e-6;
    assert!((slope + 1.5).abs() < 1e-5, "both pieces meet smoothly: {slope}");
    // Shells of the cubic lattice within 4 radii: 1, 6, 12, 8.
    let shells = [(0.0, 1.0), (2.0, 6.0), (8f64.sqrt(), 12.0), (12f64.sqrt(), 8.0)];
    let sum: f64 = shells.map(|(d, count)| count * spline(d / 4.0)).iter().sum();
    assert!((rest_density(4.0) - sum).abs() < 1e-12);
    assert_eq!(lattice(4.0).count(), 27);
    // The continuum's value: reach² / 3 · ∫ q⁴(1 - q³) / ∫ q²(1 - q³) = 0.15 reach².
    let continuum = 0.15 * 20.0 * 20.0;
    assert!((lattice_variance(20.0) / continuum - 1.0).abs() < 0.01);
}

#[test]
fn density_is_one_inside_and_nothing_outside() {
    let cube = block([-4; 3], [4; 3]);
    let field = DensityField::new(&cube, 1.0, &Options::default()).unwrap();
    for point in [Vec3::ZERO, Vec3::new(2.0, -2.0, 4.0)] {
        assert!((field.relative_density(point) - 1.0).abs() < 1e-6);
    }
    for k in 0..20 {
        let between = field.relative_density(Vec3::new(0.1, 0.1, 0.05) * k as f32);
        assert!((between - 1.0).abs() < 0.1, "between particles: {between}");
    }
    // One radius above the outermost centres lies the surface; there the mean is one half.
    let plane = (0..100).map(|k| Vec3::new(0.2 * (k / 10) as f32, 0.2 * (k % 10) as f32, 9.0));
    let surface: f32 = plane.map(|point| field.relative_density(point)).sum::<f32>() / 100.0;
    assert!((surface - 0.5).abs() < 0.01, "surface: {surface}");
    for point in [Vec3::Z * 12.0, Vec3::splat(1e30), Vec3::NAN, Vec3::INFINITY] {
        assert_eq!(field.relative_density(point), 0.0);
    }
    let far = cube.iter().map(|p| p + Vec3::new(-1e6, 1e6, 0.0)).collect::<Vec<_>>();
    let field = DensityField::new(&far, 1.0, &Options::default()).unwrap();
    assert!((field.relative_density(Vec3::new(-1e6, 1e6, 0.0)) - 1.0).abs() < 1e-6);
}

#[test]
fn droplets_splash_and_surfaces_edges_and_sheets_do_not() {
    let count = |cloud: &[Vec3]| run(cloud, 1.0).1;
    for droplets in [vec![Vec3::ZERO], vec![Vec3::ZERO, Vec3::X * 2.0], block([0; 3], [0, 0, 2])] {
        assert_eq!(count(&droplets).body, 0, "{droplets:?}");
    }
    assert_eq!(count(&block([0; 3], [7; 3])).splash, 0, "a cube with its faces, edges, corners");
    assert_eq!(count(&block([0; 3], [9, 9, 1])).splash, 0, "a sheet two particles thin");
    let sheet = block([0; 3], [9, 9, 0]);
    assert_eq!(count(&sheet).splash, 0, "a sheet one particle thin");
}

#[test]
fn two_thresholds_keep_the_last_class_between_them() {
    // A row: its inner particles have ρ/ρ0 = 0.478, its two ends 0.398.
    let row = block([0; 3], [5, 0, 0]);
    let options = Options { splash_threshold: 0.45, ..Options::default() };
    let (splash, body) = (vec![Class::Splash; 6], vec![Class::Body; 6]);
    let mut fresh = body.clone();
    (fresh[0], fresh[5]) = (Class::Splash, Class::Splash);
    let now = |last| classify(&row, 1.0, &options, last).unwrap();
    assert_eq!(now(None), fresh);
    assert_eq!(now(Some((&splash, 0.5))), splash, "below the upper threshold nothing rejoins");
    assert_eq!(now(Some((&body, 0.5))), fresh);
    assert_eq!(now(Some((&splash, 0.46))), fresh, "above it, it does");
    let (_, report) = run(&row, 1.0);
    assert_eq!(report.splash, 6, "the default threshold");
    let error = classify(&row, 1.0, &options, Some((&body[1..], 0.5)));
    assert!(matches!(error, Err(PrepareError::Length { found: 5, particles: 6, .. })));
    let error = prepare(&input(&row, 1.0).keep_class_below(Some(f32::NAN)), &options);
    assert!(matches!(error, Err(PrepareError::Option { name: "upper splash threshold", .. })));
}

/// Frame by frame, of a cloud that trembles about the threshold, or all at once.
#[test]
fn classes_over_frames_are_those_from_frame_to_frame() {
    let mut random = Random(17);
    let options = Options { splash_threshold: 0.55, ..Options::default() };
    let still = block([0; 3], [9, 3, 0]);
    let frame = |random: &mut Random| still.iter().map(|p| *p + 0.4 * random.vec()).collect::<Vec<_>>();
    let frames: Vec<_> = (0..6).map(|_| frame(&mut random)).collect();
    let dense: Vec<_> = frames.iter().map(|f| densities(f, 1.0, &options).unwrap()).collect();
    let mut last = classify(&frames[0], 1.0, &options, None).unwrap();
    let mut held = 0;
    for i in 0..6 {
        if i > 0 {
            last = classify(&frames[i], 1.0, &options, Some((&last, 0.75))).unwrap();
        }
        let all: Vec<_> = dense[..=i].iter().map(Vec::as_slice).collect();
        assert_eq!(classes_over(&all, &options, 0.75).unwrap(), last, "frame {i}");
        held += last.iter().zip(classify(&frames[i], 1.0, &options, None).unwrap()).filter(|(a, b)| **a != *b).count();
    }
    assert!(held > 5, "only {held} were held");
    let short = classes_over(&[&dense[0], &dense[1][1..]], &options, 0.75);
    assert!(matches!(short, Err(PrepareError::Length { found: 39, particles: 40, .. })), "{short:?}");
    assert!(classes_over(&[], &options, 0.75).unwrap().is_empty());
}

#[test]
fn the_radius_is_half_the_spacing_less_a_known_bias() {
    let mut random = Random(6);
    let cube = block([-4; 3], [4; 3]);
    assert!((estimate_radius(&cube).unwrap() - 1.0 / 0.9).abs() < 1e-6);
    assert_eq!(estimate_radius(&[]), None);
    assert_eq!(estimate_radius(&[Vec3::ONE; 5]), None);
    assert_eq!(estimate_radius(&[Vec3::ZERO, -Vec3::ZERO, Vec3::NAN]), None);
    let twice = [&cube[..], &cube[..]].concat();
    assert_eq!(estimate_radius(&twice), estimate_radius(&cube), "duplicates count once");
    for half in [Vec3::splat(9.0), Vec3::new(9.0, 0.0, 9.0), Vec3::Y, Vec3::splat(1e-6)] {
        let mut cloud = random.cloud(400, Vec3::ZERO, half);
        cloud.push(Vec3::splat(1e9));
        let nearest = |p: &Vec3| {
            let others = cloud.iter().filter(|q| *q != p).map(|q| p.as_dvec3().distance(q.as_dvec3()));
            others.fold(f64::INFINITY, f64::min)
        };
        let mut brute: Vec<f64> = cloud.iter().map(nearest).collect();
        brute.sort_by(f64::total_cmp);
        let expected = (brute[brute.len() / 2] / 2.0 / 0.9) as f32;
        let found = estimate_radius(&random.shuffled(&cloud)).unwrap();
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} for {expected}");
    }
}
