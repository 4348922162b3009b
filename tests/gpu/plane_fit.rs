//! Plane fitting against its twin, which is fed the depths and normals that the GPU itself read.

use crate::support::{Case, Choose, Driver, Random, Shot, camera, each_driver, imai16, lattice, random_cloud, sphere};
use glam::{Mat3, Vec3};
use meniscus::smooth::plane_fit::twin::{Outcome, is_close, moved, plane_fit, rounding};
use meniscus::smooth::plane_fit::{PlaneFit, Weighting};
use meniscus::{Camera, Ellipsoid, Particles, Settings};

/// Guards in the order of their counters.
const GUARDS: [(Outcome, &str); 3] = [
    (Outcome::ZeroNormal, "plane_fit_zero_normal_sum"),
    (Outcome::Grazing, "plane_fit_grazing"),
    (Outcome::Unbounded, "plane_fit_update_too_long"),
];

/// What a comparison found.
#[derive(Default)]
struct Seen {
    fitted: usize,
    /// How often the twin fired each guard, and how many pixels lay so close to a threshold that rounding decides.
    guards: [u32; 3],
    close: u32,
    /// Largest error against its tolerance; sum of errors in particle radii.
    worst: f64,
    sum: f64,
}

/// Settings for these tests: cheap optics, which come after what is tested, and both sides.
fn settings(window: u32, iterations: u32, sigma: f32, weighting: Weighting) -> Settings {
    let mut settings = imai16().refractions(2).reflections(0);
    let fit = PlaneFit::default().window(window).iterations(iterations).sigma(sigma).weighting(weighting);
    settings.method.smooth = fit.into();
    settings
}

/// Compares one iteration on both layers, from image `from` of one shot to image `to` of another (or the same one).
fn compare(label: &str, settings: &PlaneFit, from: (&Shot, &'static str), to: (&Shot, &'static str)) -> Seen {
    let shot = to.0;
    let mut seen = Seen::default();
    for layer in 0..2 {
        let input = from.0.floats(from.1, layer).expect("input");
        let output = to.0.floats(to.1, layer).expect("output");
        let normal = shot.words("body normal (ray-cast)", layer).expect("normals");
        let fit = plane_fit(&shot.frame, &input, normal, settings);
        for (i, plane) in fit.plane.iter().enumerate() {
            let at =
                || format!("{label}, layer {layer}, pixel {}, {}", i as u32 % shot.size[0], i as u32 / shot.size[0]);
            let Some(plane) = plane else {
                assert_eq!(output[i].to_bits(), input[i].to_bits(), "{}: no surface to fit", at());
                continue;
            };
            let kept = output[i].to_bits() == input[i].to_bits();
            let outcome = fit.outcome[i];
            for (count, (guard, _)) in seen.guards.iter_mut().zip(GUARDS) {
                *count += u32::from(outcome == guard);
            }
            let undecided = is_close(settings, &shot.frame, input[i], plane);
            seen.close += u32::from(undecided);
            let moves = matches!(outcome, Outcome::Fitted | Outcome::Unbounded);
            if kept && (undecided || !moves) {
                continue;
            }
            // A pixel that rounding decides is where it was, or on its plane.
            assert!(undecided || moves, "{}: {outcome:?}, but {} became {}", at(), input[i], output[i]);
            let want = moved(&shot.frame, settings, input[i], plane);
            let (error, tolerance) = ((f64::from(output[i]) - want).abs(), rounding(settings, input[i], plane));
            assert!(error <= tolerance, "{}: {} for {plane:?}, from {}", at(), output[i], input[i]);
            seen.fitted += 1;
            seen.worst = seen.worst.max(error / tolerance);
            seen.sum += error;
        }
    }
    seen
}

/// Guard counters of all iterations so far.
fn counters(shot: &Shot) -> [u32; 3] {
    GUARDS.map(|(_, slot)| shot.counter(slot))
}

/// The counters of `iterations` are those that the twin fired, but for pixels that rounding decides.
fn assert_counted(label: &str, counted: [u32; 3], seen: &[Seen]) {
    let close: u32 = seen.iter().map(|s| s.close).sum();
    for (k, (guard, _)) in GUARDS.into_iter().enumerate() {
        let fired: u32 = seen.iter().map(|s| s.guards[k]).sum();
        let counted = counted[k];
        assert!(
            counted.abs_diff(fired) <= close,
            "{label}: {guard:?} counted {counted} times, twin {fired}; {close} in doubt"
        );
    }
    let fitted: usize = seen.iter().map(|s| s.fitted).sum();
    let mean = seen.iter().map(|s| s.sum).sum::<f64>() / fitted as f64;
    let worst = seen.iter().map(|s| s.worst).fold(0.0, f64::max);
    println!(
        "{label}: {fitted} fitted, {worst:.2} of tolerance, {mean:.1e} r on average; {counted:?}, {close} in doubt"
    );
    assert!(close as usize * 100 <= fitted, "{label}: {close} of {fitted} in doubt");
    assert!(mean < 1e-5, "{label}: {mean} r on average");
}

/// Two iterations of one frame: both images are still there, so each step can be checked on its own input.
fn check_two(driver: &Driver, name: &str, case: &Case) -> Shot {
    let s = &case.settings.fit();
    let label = format!("{}, {name}, window {}, sigma {} r, {:?}", driver.name, s.window, s.sigma, s.weighting);
    let shot = driver.shoot(case);
    let seen = [
        compare(&format!("{label}, first"), s, (&shot, "body depth (ray-cast)"), (&shot, "body depth (smoothed, odd)")),
        compare(
            &format!("{label}, second"),
            s,
            (&shot, "body depth (smoothed, odd)"),
            (&shot, "body depth (smoothed, even)"),
        ),
    ];
    assert_counted(&label, counters(&shot), &seen);
    let fitted = seen.iter().map(|s| s.fitted).sum::<usize>();
    assert!(fitted > 10_000, "{label}: only {fitted} fitted");
    shot
}

const KINDS: [(u32, f32, Weighting); 6] = [
    (3, 5.3, Weighting::ViewDependent),
    (9, 0.5, Weighting::ViewDependent),
    (9, 5.3, Weighting::Euclidean),
    (17, 20.0, Weighting::Euclidean),
    (19, 5.3, Weighting::ViewDependent),
    (25, 1.0, Weighting::ViewDependent),
];

/// Clouds that reach over every border of an image whose size no tile divides.
#[test]
fn random_clouds() {
    let size = [173, 131];
    each_driver(|driver| {
        for (seed, (window, sigma, weighting)) in KINDS.into_iter().enumerate() {
            let case = Case {
                particles: random_cloud(seed as u64, 0.05, Vec3::splat(-0.8), Vec3::splat(0.8), 10, 500),
                camera: camera(Vec3::new(0.2, 0.3, 1.6), Vec3::ZERO, size),
                settings: settings(window, 2, sigma, weighting),
                size,
                eye_inside: false,
            };
            let shot = check_two(driver, "cloud", &case);
            let front = shot.floats("body depth (ray-cast)", 0).unwrap();
            assert!(front.contains(&0.0), "there are gaps");
            let [w, h] = size.map(|s| s as usize);
            let borders: [Vec<f32>; 4] = [
                front[..w].to_vec(),
                front[w * (h - 1)..].to_vec(),
                front.iter().step_by(w).copied().collect(),
                front.iter().skip(w - 1).step_by(w).copied().collect(),
            ];
            assert!(borders.iter().all(|b| b.iter().filter(|d| **d > 0.0).count() > 5), "borders are crossed");
        }
    });
}

/// A body at rest spacing, seen aslant: long faces at grazing angles, corners, and many equal weights.
#[test]
fn a_lattice_body() {
    let size = [240, 180];
    each_driver(|driver| {
        for (window, sigma, weighting) in [(9, 5.3, Weighting::ViewDependent), (17, 2.0, Weighting::Euclidean)] {
            let case = Case {
                particles: Particles {
                    radius: 0.04,
                    ellipsoids: lattice(Vec3::ZERO, 0.04, [14, 5, 14]),
                    splash_count: 0,
                },
                camera: camera(Vec3::new(0.7, 0.45, 1.1), Vec3::ZERO, size),
                settings: settings(window, 2, sigma, weighting),
                size,
                eye_inside: false,
            };
            check_two(driver, "lattice", &case);
        }
    });
}

/// The eye within a particle: its own front is nearer than the near plane, which no filter may average in.
#[test]
fn the_eye_in_a_particle() {
    each_driver(|driver| {
        let case = eye_in_a_particle();
        let shot = check_two(driver, "eye inside", &case);
        let front = shot.floats("body depth (smoothed, even)", 0).unwrap();
        let negative = front.iter().filter(|d| **d < 0.0).count();
        assert!(negative > 50 && negative < 10_000, "{}: {negative} pixels start inside", driver.name);
    });
}

/// Flakes seen all but edge-on: planes along the view rays, and planes that cross a pixel's ray far away.
#[test]
fn flakes_at_grazing_angles() {
    let size = [173, 131];
    each_driver(|driver| {
        let mut random = Random(5);
        let mut particles = Particles { radius: 0.05, ellipsoids: Vec::new(), splash_count: 0 };
        for _ in 0..150 {
            let center = random.point(Vec3::new(-0.3, -0.3, -1.3), Vec3::new(0.3, 0.3, -0.7));
            let across = center.cross(random.point(Vec3::splat(-1.0), Vec3::ONE)).normalize();
            let normal = (across - random.between(0.0, 0.03) * center.normalize()).normalize();
            let long = normal.any_orthonormal_vector();
            let axes = Mat3::from_cols(0.3 * long, 0.3 * normal.cross(long), 0.0006 * normal);
            particles.ellipsoids.push(Ellipsoid { center, axes });
        }
        // The last has a near plane among the flakes, before which no plane may put a pixel; its sigma bounds nothing.
        let kinds = [
            (0.05, Weighting::ViewDependent, 0.01),
            (0.2, Weighting::Euclidean, 0.01),
            (9.0, Weighting::Euclidean, 0.9),
        ];
        for (sigma, weighting, near) in kinds {
            let mut camera = camera(Vec3::ZERO, Vec3::NEG_Z, size);
            camera.near = near;
            let case = Case {
                particles: particles.clone(),
                camera,
                settings: settings(9, 2, sigma, weighting),
                size,
                eye_inside: false,
            };
            let shot = check_two(driver, "flakes", &case);
            let [_, grazing, unbounded] = counters(&shot);
            assert!(grazing > 20 && unbounded > 20, "{}: {grazing} grazing, {unbounded} unbounded", driver.name);
        }
    });
}

/// Two large spheres left and right of the view axis. In the two middle columns the rays touch them where their normals
/// are +x and -x, at one depth; all other depths are many sigma away. So these two normals sum to zero.
#[test]
fn normals_that_cancel() {
    let size = [8, 9];
    each_driver(|driver| {
        let mut camera = camera(Vec3::ZERO, Vec3::NEG_Z, size);
        camera.projection = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 1.5, 8.0 / 9.0, 0.01).projection;
        // Half a pixel off the axis is x = 1 at this depth.
        let depth = 2.0 * camera.projection.x_axis.x * 0.5 * size[0] as f32;
        let ellipsoids = [-1.0, 1.0].map(|side| sphere(Vec3::new(side * 11.0, 0.0, -depth), 10.0)).to_vec();
        let case = Case {
            particles: Particles { radius: 1.0, ellipsoids, splash_count: 0 },
            camera,
            settings: settings(3, 1, 0.3, Weighting::ViewDependent),
            size,
            eye_inside: false,
        };
        let shot = driver.shoot(&case);
        let seen = compare(
            &driver.name,
            &case.settings.fit(),
            (&shot, "body depth (ray-cast)"),
            (&shot, "body depth (smoothed, odd)"),
        );
        assert_counted(&driver.name, counters(&shot), &[seen]);
        assert_eq!(counters(&shot)[0], 2, "{}: the middle pixels of the front", driver.name);
        let [raw, fitted] = ["body depth (ray-cast)", "body depth (smoothed, odd)"]
            .map(|id| shot.words(id, 0).unwrap()[4 * 8 + 3..][..2].to_vec());
        assert_eq!(raw, fitted);
    });
}

/// A simulated frame, one to five iterations: each step on its own input, and as the images alternate, the next to last
/// result of n iterations is the last of n - 1.
#[test]
#[cfg(feature = "io")]
fn a_dam_break_iterated() {
    each_driver(|driver| {
        let mut case = dam_break([240, 180]);
        let kind = |n| settings(9, n, 5.3, Weighting::ViewDependent);
        let mut before: Option<Shot> = None;
        for n in 1..=5u32 {
            case.settings = kind(n);
            let label = format!("{}, dam break, iteration {n}", driver.name);
            let shot = driver.shoot(&case);
            let (from, to) = match n {
                1 => ("body depth (ray-cast)", "body depth (smoothed, odd)"),
                n if n % 2 == 0 => ("body depth (smoothed, odd)", "body depth (smoothed, even)"),
                _ => ("body depth (smoothed, even)", "body depth (smoothed, odd)"),
            };
            let seen = compare(&label, &case.settings.fit(), (&shot, from), (&shot, to));
            let mut counted = counters(&shot);
            if let Some(before) = &before {
                (0..3).for_each(|k| counted[k] -= counters(before)[k]);
                for layer in 0..2 {
                    let (a, b) = (shot.words(from, layer), before.words(from, layer));
                    assert!(a == b, "{label}: its input is not what {} iterations end in", n - 1);
                }
            }
            assert_counted(&label, counted, &[seen]);
            before = Some(shot);
        }
    });
}

#[test]
#[cfg(feature = "io")]
fn a_dam_break_with_other_windows() {
    each_driver(|driver| {
        for (window, sigma, weighting) in [(19, 5.3, Weighting::Euclidean), (25, 10.0, Weighting::ViewDependent)] {
            let mut case = dam_break([173, 131]);
            case.settings = settings(window, 2, sigma, weighting);
            check_two(driver, "dam break", &case);
        }
    });
}

/// A cloud around the eye, and one particle that the near plane cuts beside it.
pub fn eye_in_a_particle() -> Case {
    let size = [120, 90];
    let mut particles = random_cloud(3, 0.05, Vec3::splat(-0.4), Vec3::splat(0.4), 0, 600);
    let eye = Vec3::new(0.1, 0.05, 0.2);
    particles.ellipsoids.push(sphere(eye + Vec3::new(0.042, 0.0, 0.01), 0.05));
    Case {
        particles,
        camera: camera(eye, eye - Vec3::Z, size),
        settings: settings(9, 2, 5.3, Weighting::ViewDependent),
        size,
        eye_inside: true,
    }
}

/// The repository's frame, prepared as a user would, filling most of the image.
#[cfg(feature = "io")]
pub fn dam_break(size: [u32; 2]) -> Case {
    use meniscus::prepare::{Input, Options, prepare};
    static PARTICLES: std::sync::LazyLock<Particles> = std::sync::LazyLock::new(|| {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/dam_break.bgeo");
        let file = meniscus::io::particles::read(&path).expect("assets/dam_break.bgeo");
        let positions: Vec<_> = file.positions.iter().map(|p| p.as_vec3()).collect();
        let input = Input::new(&positions, 0.025);
        prepare(&input, &Options::default()).expect("it is sound").0
    });
    let (low, high) = PARTICLES.bounds().expect("it has particles");
    let (center, extent) = (0.5 * (low + high), (high - low).length());
    Case {
        particles: PARTICLES.clone(),
        camera: camera(center + extent * Vec3::new(0.35, 0.3, 0.75), center, size),
        settings: settings(9, 2, 5.3, Weighting::ViewDependent),
        size,
        eye_inside: false,
    }
}
