//! Depth and normal layers of both classes against the ray-casting twin and closed forms.

use crate::{
    cull::{around_the_near_plane, both, drawn_as_quads, point_size},
    support::{Case, Choose, Driver, Random, SKY, Shot, camera, each_driver, imai16, random_cloud, sphere},
};
use glam::{DVec3, Mat3, Vec3};
use meniscus::{
    Camera, Ellipsoid, Particles,
    shader::{CLASS_BODY, CLASS_SPLASH, Particle, SIDE_BACK, SIDE_FRONT},
    space::Space,
    twin::{self, normal::decode_normal, quadric::pixel_ray},
};

/// Depth and normal target of each class.
pub const TARGETS: [(&str, &str); 2] =
    [("splash depth", "splash normal"), ("body depth (ray-cast)", "body normal (ray-cast)")];

/// The particles of one class as the GPU reads them.
pub fn packed(particles: &Particles, class: u32) -> Vec<Particle> {
    let (splash, body) = particles.ellipsoids.split_at(particles.splash_count);
    let class = if class == CLASS_SPLASH { splash } else { body };
    let space = Space::of(particles);
    class.iter().map(|e| space.pack(e)).collect()
}

/// A frame with default settings.
pub fn case(particles: Particles, camera: Camera, size: [u32; 2]) -> Case {
    Case { particles, camera, settings: imai16(), size, eye_inside: false }
}

/// A frame of a dam break (24,389 particles), seen from above one end at an angle.
#[cfg(feature = "io")]
pub fn dam_break() -> &'static Case {
    static CASE: std::sync::LazyLock<Case> = std::sync::LazyLock::new(|| {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/dam_break.bgeo");
        let file = meniscus::io::particles::read(path.as_ref()).expect("the frame reads");
        let positions: Vec<Vec3> = file.positions.iter().map(|p| p.as_vec3()).collect();
        use meniscus::prepare::{Input, Options, prepare};
        let input = Input::new(&positions, 0.025);
        let particles = prepare(&input, &Options::default()).expect("it prepares").0;
        let (low, high) = particles.bounds().expect("it is not empty");
        let (middle, size) = (0.5 * (low + high), [320, 240]);
        let eye = middle + 0.75 * (high - low).length() * Vec3::new(0.55, 0.45, 0.7).normalize();
        case(particles, camera(eye, middle, size), size)
    });
    &CASE
}

/// Within this many pixels of a silhouette float32 cannot tell inside from outside: x/d and (pixel - b) / a are of
/// order one, three roundings of 6e-8 each, times some 300 pixels per unit, and as much again from S in float32.
const SILHOUETTE: f64 = 2e-3;

/// Depth errors in radii that 999 of 1000 pixels, and all away from silhouettes, keep.
#[derive(Clone, Copy)]
pub struct Tolerance {
    depth: f64,
    depth_most: f64,
    degrees: f64,
}

/// What float32 allows particles of `pixels` radius: 1e-4 pixels sideways on a slope of one, and a floor for the depth's
/// own rounding (6e-8 of some 20 to 200 radii). Towards a silhouette the slope grows as the inverse root of the distance
/// to it: to tenfold. Normals: those in 32 bits round to 0.004 degrees.
pub fn tolerance(pixels: f64) -> Tolerance {
    let depth = 2e-5 + 1e-4 / pixels;
    Tolerance { depth, depth_most: 10.0 * depth, degrees: 0.05 }
}

/// Compares all layers with the twin's. The twin draws every particle: what the cull pass drops must not be missed.
fn check(driver: &Driver, case: &Case, what: &str, tolerance: Tolerance) -> Shot {
    // What is not looked at here need not be computed: smoothing, reflections.
    let settings = case.settings.refractions(2).reflections(0).iterations(0);
    let shot = driver.shoot(&Case { settings, ..case.clone() });
    for (class, (depth_id, normal_id)) in [CLASS_SPLASH, CLASS_BODY].into_iter().zip(TARGETS) {
        let particles = packed(&case.particles, class);
        if particles.is_empty() {
            continue;
        }
        for side in [SIDE_FRONT, SIDE_BACK] {
            let label = format!("{}: {what}: class {class} side {side}", driver.name);
            let depth = shot.floats(depth_id, side).expect("drawn");
            if class == CLASS_SPLASH && side == SIDE_BACK {
                let layer = twin::splat::splat(&shot.frame, &particles, &vec![3; particles.len()], SIDE_FRONT);
                check_balls(&layer, &depth, shot.words(normal_id, SIDE_FRONT).expect("drawn"), tolerance, &label);
                continue;
            }
            let layer = twin::splat::splat(&shot.frame, &particles, &vec![3; particles.len()], side);
            let normal = shot.words(normal_id, side).expect("drawn");
            check_layer(&layer, &depth, Some(normal), &shot, tolerance, &label);
        }
    }
    shot
}

/// Where rays leave the splashes in front, the same ones, against the twin's; and the normals there, which a pixel has
/// whose near plane lies inside one.
fn check_balls(layer: &[twin::splat::Surface], far: &[f32], normals: &[u32], tolerance: Tolerance, label: &str) {
    let (mut compared, mut around) = (0usize, 0usize);
    for (pixel, (want, got)) in layer.iter().zip(far).enumerate() {
        // Closer to an outline or to another splash than rounding, it may be that one's.
        if want.silhouette <= SILHOUETTE || want.depth != 0.0 && want.margin <= tolerance.depth_most {
            continue;
        }
        let error = (f64::from(*got) - want.far).abs();
        assert!(error <= tolerance.depth_most, "{label}: pixel {pixel} is {got}, should be {}", want.far);
        compared += usize::from(want.depth != 0.0);
        if want.depth < 0.0 {
            let angle = decode_normal(normals[pixel]).as_dvec3().angle_between(want.far_normal).to_degrees();
            assert!(angle <= 5.0 * tolerance.degrees, "{label}: pixel {pixel}: normal off by {angle}°");
            around += 1;
        }
    }
    println!("{label}: {compared} compared, the near plane in {around}");
}

/// Depths of a layer against the twin's, and normals, where it has any.
pub fn check_layer(
    layer: &[twin::splat::Surface],
    depth: &[f32],
    normals: Option<&[u32]>,
    shot: &Shot,
    tolerance: Tolerance,
    label: &str,
) {
    let near = f64::from(shot.frame.near);
    let (mut covered, mut outlines, mut far, mut tilted) = (0usize, 0usize, 0usize, 0usize);
    let (mut sum, mut most, mut turn) = (0.0f64, 0.0f64, 0.0f64);
    for (pixel, (want, got)) in layer.iter().zip(depth).enumerate() {
        let got = f64::from(*got);
        let at = [pixel as u32 % shot.size[0], pixel as u32 / shot.size[0]];
        let sure = want.silhouette > SILHOUETTE;
        covered += usize::from(want.depth != 0.0);
        if (want.depth != 0.0) != (got != 0.0) {
            assert!(
                !sure,
                "{label}: {at:?} is {got}, should be {}, {} px from an outline",
                want.depth, want.silhouette
            );
            outlines += 1;
            continue;
        }
        if want.depth == 0.0 {
            continue;
        }
        if want.depth.signum() != got.signum() {
            let off = (want.depth.abs() - near).abs();
            assert!(off < 1e-3 || !sure, "{label}: {at:?} is {got}, should be {}", want.depth);
            outlines += 1;
            continue;
        }
        let error = (got - want.depth).abs();
        far += usize::from(error > tolerance.depth);
        // Where the near plane lies inside a particle there is no surface, and no normal to compare.
        let angle = match normals {
            Some(n) if want.depth > 0.0 => decode_normal(n[pixel]).as_dvec3().angle_between(want.normal).to_degrees(),
            _ => 0.0,
        };
        tilted += usize::from(angle > tolerance.degrees);
        if sure {
            (sum, most) = (sum + error, most.max(error));
            assert!(error <= tolerance.depth_most, "{label}: {at:?} is {got}, should be {}: {error} r", want.depth);
            // Two surfaces closer than rounding: either may win.
            if want.margin > tolerance.depth_most {
                turn = turn.max(angle);
                assert!(angle <= 5.0 * tolerance.degrees, "{label}: {at:?}: normal off by {angle}°");
            }
        }
    }
    let mean = sum / covered.max(1) as f64;
    println!(
        "{label}: {covered} covered, outlines {outlines}, depth > tolerance {far}, normal > {}° {tilted}; mean {mean:.1e} r, most {most:.1e} r, {turn:.3}°",
        tolerance.degrees
    );
    let few = covered / 1000 + 1;
    assert!(outlines <= few && far <= few && tilted <= few, "{label}: {outlines} {far} {tilted} of {covered}");
    assert!(mean <= 0.2 * tolerance.depth, "{label}: mean error {mean} r");
}

#[test]
fn random_clouds_match_the_twin() {
    // 217 pixels per unit of x/d: radii of about 1, 5, 15 and 40 pixels.
    let size = [240, 180];
    each_driver(|driver| {
        for (seed, pixels, splash, body) in
            [(1, 1.0, 200, 4000), (2, 5.0, 60, 800), (3, 15.0, 20, 60), (4, 40.0, 4, 12)]
        {
            let radius = pixels * 2.2 / 217.0;
            let particles = random_cloud(seed, radius, Vec3::splat(-0.7), Vec3::splat(0.7), splash, body);
            let case = case(particles, camera(Vec3::new(0.4, 0.7, 2.1), Vec3::ZERO, size), size);
            let shot = check(driver, &case, &format!("radius {pixels} px"), tolerance(f64::from(pixels)));
            assert!(!drawn_as_quads(&shot, CLASS_BODY), "points are large enough here");
        }
    });
}

#[test]
#[cfg(feature = "io")]
fn a_real_frame_matches_the_twin() {
    let case = dam_break();
    each_driver(|driver| {
        // Radii of one to three pixels, and coordinates up to 4, whose float32 steps are 1e-5 of this radius.
        check(driver, case, "dam break", tolerance(0.8));
    });
}

#[test]
fn spheres_near_the_corners_match_the_twin() {
    // 110 degrees high: a sphere in the corner is drawn out to more than twice its width.
    let size = [200, 160];
    let mut camera = camera(Vec3::ZERO, Vec3::NEG_Z, size);
    camera.projection = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 1.92, 1.25, 0.05).projection;
    let corners = [-1.0, 1.0].into_iter().flat_map(|x| [-1.0, 1.0].map(|y| Vec3::new(1.6 * x, 1.25 * y, -1.0)));
    let particles = both(0.15, &corners.map(|c| sphere(c, 0.15)).collect::<Vec<_>>());
    each_driver(|driver| {
        check(driver, &case(particles.clone(), camera, size), "corners", tolerance(8.0));
    });
}

#[test]
fn flattened_and_sheared_ellipsoids_match_the_twin() {
    let size = [240, 180];
    each_driver(|driver| {
        // Every driver: S in float32 leaves the thinnest axis an error of (longest / thinnest)² ulps, 2e-4 at 60, and
        // the normal turns by as much again where that axis curves most.
        for (ratio, slack, tilt) in [(4.0, 1.0, 1.0), (20.0, 1.0, 4.0), (60.0, 2.5, 40.0)] {
            let mut random = Random(ratio as u64);
            let mut flat = |i: usize| {
                let axes = if i.is_multiple_of(2) {
                    Vec3::new(1.2, 1.2, 1.2 / ratio)
                } else {
                    Vec3::new(1.2, 1.2 / ratio, 0.4)
                };
                let center = random.point(Vec3::splat(-0.7), Vec3::splat(0.7));
                Ellipsoid { center, axes: random.rotation() * Mat3::from_diagonal(0.1 * axes) }
            };
            let ellipsoids: Vec<_> = (0..60).map(&mut flat).collect();
            let particles = Particles { radius: 0.1, ellipsoids, splash_count: 0 };
            let Tolerance { depth, depth_most, degrees } = tolerance(10.0);
            let tolerance = Tolerance { depth: slack * depth, depth_most: slack * depth_most, degrees: tilt * degrees };
            let case = case(particles, camera(Vec3::new(0.3, 0.5, 2.2), Vec3::ZERO, size), size);
            check(driver, &case, &format!("ratio {ratio}"), tolerance);
        }
    });
}

#[test]
fn particles_larger_than_points_become_quads() {
    // Points end at 255 pixels on lavapipe and 1023 on SwiftShader; one particle here covers 289, then 1060.
    let mut random = Random(5);
    let mut small = || sphere(random.point(Vec3::new(-0.6, -0.1, -0.7), Vec3::new(0.6, 0.1, -0.5)), 0.02);
    let ellipsoids = (0..31).map(|i| if i == 0 { sphere(Vec3::NEG_Z, 0.55) } else { small() }).collect();
    let particles = Particles { radius: 0.55, ellipsoids, splash_count: 1 };
    each_driver(|driver| {
        for (width, covered) in [(300u16, 289.0), (1100, 1060.0)] {
            let (size, aspect) = ([u32::from(width), 40], f32::from(width) / 40.0);
            let mut camera = camera(Vec3::ZERO, Vec3::NEG_Z, size);
            let high = 2.0 * (0.6877 / aspect).atan();
            camera.projection = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, high, aspect, 0.01).projection;
            let case = case(particles.clone(), camera, size);
            let shot = check(driver, &case, &format!("{width} wide"), tolerance(100.0));
            assert_eq!(drawn_as_quads(&shot, CLASS_SPLASH), covered > point_size(driver), "{}", driver.name);
            assert!(!drawn_as_quads(&shot, CLASS_BODY), "{}", driver.name);
        }
    });
}

#[test]
fn centres_outside_the_view_still_cover_pixels() {
    // Tangent of half the view: 0.414 high, 0.552 wide. The centres lie outside, by less than a radius.
    let size = [160, 120];
    let edges = [(0.62, 0.1), (-0.62, -0.2), (0.1, 0.48), (-0.2, -0.48), (0.6, 0.46), (-0.6, 0.46)];
    let balls: Vec<_> = edges.iter().map(|(x, y)| sphere(Vec3::new(*x, *y, -1.0), 0.1)).collect();
    let particles = both(0.1, &balls);
    each_driver(|driver| {
        let case = case(particles.clone(), camera(Vec3::ZERO, Vec3::NEG_Z, size), size);
        let shot = check(driver, &case, "centres outside", tolerance(14.0));
        let covered = shot.floats("splash depth", 0).unwrap().iter().filter(|d| **d > 0.0).count();
        assert!(covered > 400, "{}: {covered}", driver.name);
    });
}

#[test]
fn particles_at_the_near_plane_match_the_twin() {
    let crossing = around_the_near_plane();
    let mut around = crossing.clone();
    around.particles.ellipsoids.push(Ellipsoid { center: Vec3::new(0.05, 0.0, 0.1), ..sphere(Vec3::ZERO, 1.0) });
    each_driver(|driver| {
        let shot = check(driver, &crossing, "near plane", tolerance(30.0));
        let near = shot.frame.near;
        let front = shot.floats("body depth (ray-cast)", 0).unwrap();
        let inside = front.iter().filter(|d| **d == -near).count();
        assert!(inside > 200 && front.iter().filter(|d| **d > 0.0).count() > 1000, "{}: {inside}", driver.name);
        let shot = check(driver, &around, "around the camera", tolerance(30.0));
        assert!(shot.floats("body depth (ray-cast)", 0).unwrap().iter().all(|d| *d == -near), "{}", driver.name);
    });
}

#[test]
fn one_ball_has_its_closed_form() {
    let (size, r, center) = ([160, 120], 0.25, Vec3::new(0.4, -0.25, -1.5));
    let camera = camera(Vec3::ZERO, Vec3::NEG_Z, size);
    each_driver(|driver| {
        for class in [CLASS_SPLASH, CLASS_BODY] {
            let splash_count = usize::from(class == CLASS_SPLASH);
            let particles = Particles { radius: r, ellipsoids: vec![sphere(center, r)], splash_count };
            let shot = driver.shoot(&case(particles, camera, size));
            let (c, r) = (center.as_dvec3(), f64::from(r));
            let (depth_id, normal_id) = TARGETS[class as usize];
            let mut covered = 0;
            for (side, sign) in [(SIDE_FRONT, -1.0), (SIDE_BACK, 1.0)] {
                let depth = shot.depths(depth_id, side).unwrap();
                let normals = shot.words(normal_id, side);
                for (i, depth) in depth.iter().enumerate() {
                    let v: DVec3 = pixel_ray(&shot.frame, i as u32 % size[0], i as u32 / size[0]);
                    // Rays within asin(r / |c|) of the centre's meet the ball; 1e-6 rad are 2e-4 pixels.
                    let rim = (r / c.length()).asin() - v.angle_between(c);
                    if rim.abs() < 1e-6 {
                        continue;
                    }
                    assert_eq!(*depth > 0.0, rim > 0.0, "{} {i}", driver.name);
                    if rim > 0.0 {
                        covered += 1;
                        let (vv, vc) = (v.length_squared(), v.dot(c));
                        let want = (vc + sign * (vc * vc - vv * (c.length_squared() - r * r)).sqrt()) / vv;
                        // d rounds at 1e-7; the root at the rim turns 1e-7 rad into sqrt(2e-7 / 1e-6) of its value.
                        let error = (f64::from(*depth) - want).abs();
                        assert!(error < 1e-5 * r + 1e-7 * r / (rim / 0.16).sqrt(), "{} {i}: {error}", driver.name);
                        let Some(normals) = normals else {
                            assert_eq!((class, side), (CLASS_SPLASH, SIDE_BACK));
                            continue;
                        };
                        let angle = decode_normal(normals[i]).as_dvec3().angle_between((v * want - c) / r).to_degrees();
                        assert!(angle < 0.01 + 1e-4 / (rim / 0.16).sqrt(), "{} {i}: {angle}°", driver.name);
                    }
                }
            }
            assert!(covered > 1500, "{}: {covered}", driver.name);
        }
    });
}

#[test]
fn a_frame_does_without_what_it_does_not_need() {
    let size = [64, 48];
    let cloud = |splash, body| random_cloud(1, 0.1, Vec3::splat(-0.3), Vec3::splat(0.3), splash, body);
    let camera = camera(Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO, size);
    // Behind the camera: particles, yet nothing to see.
    let behind = Particles { radius: 0.1, ellipsoids: vec![sphere(Vec3::new(0.0, 0.0, 3.0), 0.1)], splash_count: 1 };
    each_driver(|driver| {
        let mut one = case(cloud(3, 20), camera, size);
        one.settings = one.settings.refractions(1);
        let shot = driver.shoot(&one);
        for (depth, normal) in TARGETS {
            assert!(shot.words(depth, 0).is_some() && shot.words(depth, 1).is_none(), "{}", driver.name);
            assert!(shot.words(normal, 0).is_some() && shot.words(normal, 1).is_none(), "{}", driver.name);
        }
        let shot = driver.shoot(&case(cloud(0, 20), camera, size));
        assert!(shot.words("splash depth", 0).is_none() && shot.words("splash normal", 0).is_none());
        let shot = driver.shoot(&case(cloud(3, 0), camera, size));
        assert!(shot.words("body depth (ray-cast)", 0).is_none() && shot.words("body depth bounds", 0).is_none());

        let empty = driver.shoot(&case(cloud(0, 0), camera, size));
        assert!(empty.words("visible particles", 0).is_none() && empty.words("splash depth", 0).is_none());
        let unseen = driver.shoot(&case(behind.clone(), camera, size));
        assert!(unseen.words("splash depth", 0).unwrap().iter().all(|d| *d == 0), "{}", driver.name);
        assert_eq!(empty.picture, unseen.picture, "{}", driver.name);
        // The camera looks along -z, level: what it sees straight ahead is the map's horizon there. Texels are rounded to nine bits of
        // the largest channel, so by 1/512 of it at most.
        let sky = &*SKY;
        let [width, height] = sky.size();
        for (i, seen) in empty.picture.iter().enumerate() {
            let v = pixel_ray(&empty.frame, i as u32 % size[0], i as u32 / size[0]).normalize();
            let x = ((v.z.atan2(v.x) / std::f64::consts::TAU + 0.5).rem_euclid(1.0) * f64::from(width)) as u32;
            let y = (v.y.acos() / std::f64::consts::PI * f64::from(height)) as u32;
            // Between the nine texels around the one it falls in, as interpolation keeps within them.
            let around =
                (0..9).map(|k| ((x + width + k % 3 - 1) % width, (y + k / 3).saturating_sub(1).min(height - 1)));
            let texels: Vec<_> = around.map(|(x, y)| &sky.texels()[4 * (y * width + x) as usize..][..3]).collect();
            for (c, seen) in seen.iter().enumerate() {
                let (low, high) = texels.iter().fold((f32::MAX, 0f32), |(l, h), t| (l.min(t[c]), h.max(t[c])));
                let room = texels.iter().flat_map(|t| t.iter()).fold(0f32, |most, v| most.max(*v)) / 512.0 + 1e-4;
                assert!((low - room..=high + room).contains(seen), "{} pixel {i}: {seen} {low} {high}", driver.name);
            }
        }
    });
}

/// A centre exactly in the eye's own plane has no ray of its own; the ball around the eye is seen from within all the same.
#[test]
fn a_centre_in_the_eye_plane_does_not_vanish() {
    let size = [64, 48];
    let ball =
        meniscus::Particles { radius: 1.0, ellipsoids: vec![crate::support::sphere(Vec3::ZERO, 1.0)], splash_count: 1 };
    let eye = Vec3::new(0.5, 0.0, 0.0);
    let case =
        Case { particles: ball, camera: camera(eye, eye - Vec3::Z, size), settings: imai16(), size, eye_inside: false };
    each_driver(|driver| {
        let back = driver.shoot(&case).depths("splash depth", 1).expect("a splash");
        assert!(back.iter().all(|d| *d > 0.0 && *d < 1.5), "{}", driver.name);
    });
}
