//! Particle preparation: order, classes and ellipsoids given by the caller, errors, progress.
//! Its stages are tested in the modules beside.

#[path = "prepare/density.rs"]
mod density;
#[path = "prepare/ellipsoids.rs"]
mod ellipsoids;
#[path = "prepare/neighbours.rs"]
mod neighbours;
#[path = "prepare/surfaces.rs"]
mod surfaces;

use glam::{Mat3, Vec3};
use meniscus::particles::{Class, Ellipsoid, Particles};
use meniscus::prepare::{Input, Options, PrepareError, Report, Search};
use meniscus::prepare::{prepare, prepare_with_progress};
use meniscus::shader::SPLASH_RADIUS;

const SEARCHES: [Search; 2] = [Search::Runs, Search::Relation];

/// A small linear congruential generator (Knuth's MMIX constants).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u32 {
        let Self(state) = self;
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*state >> 33) as u32
    }

    /// Uniform in -1..1.
    fn unit(&mut self) -> f32 {
        self.next() as f32 / (1u32 << 30) as f32 - 1.0
    }

    fn vec(&mut self) -> Vec3 {
        Vec3::from_array([0; 3].map(|_| self.unit()))
    }

    fn cloud(&mut self, n: usize, center: Vec3, half: Vec3) -> Vec<Vec3> {
        (0..n).map(|_| center + half * self.vec()).collect()
    }

    fn shuffled<T: Clone>(&mut self, items: &[T]) -> Vec<T> {
        let mut items = items.to_vec();
        for i in (1..items.len()).rev() {
            items.swap(i, self.next() as usize % (i + 1));
        }
        items
    }
}

/// A block of the lattice of spacing 2 (r = 1), `low..=high` cells along each axis.
fn block(low: [i32; 3], high: [i32; 3]) -> Vec<Vec3> {
    let mut points = Vec::new();
    for x in low[0]..=high[0] {
        for y in low[1]..=high[1] {
            points.extend((low[2]..=high[2]).map(|z| 2.0 * Vec3::new(x as f32, y as f32, z as f32)));
        }
    }
    points
}

fn input(positions: &[Vec3], radius: f32) -> Input<'_> {
    Input::new(positions, radius)
}

fn run(positions: &[Vec3], radius: f32) -> (Particles, Report) {
    prepare(&input(positions, radius), &Options::default()).unwrap()
}

fn bits(particles: &Particles) -> (usize, Vec<[u32; 12]>) {
    let bits = |e: &Ellipsoid| {
        let columns = [e.center, e.axes.x_axis, e.axes.y_axis, e.axes.z_axis];
        std::array::from_fn(|i| columns[i / 3][i % 3].to_bits())
    };
    (particles.splash_count, particles.ellipsoids.iter().map(bits).collect())
}

/// A report of what is set, and else of nothing.
fn report_of(set: impl Fn(&mut Report)) -> Report {
    let mut report = Report::default();
    set(&mut report);
    report
}

#[test]
fn shuffled_input_gives_the_same_bits() {
    let mut random = Random(4);
    let mut cloud = block([-6, 0, -6], [6, 5, 6]);
    cloud.iter_mut().for_each(|p| *p += 0.3 * random.vec());
    cloud.extend(random.cloud(300, Vec3::Y * 14.0, Vec3::new(12.0, 6.0, 12.0)));
    cloud.extend_from_within(..40);
    cloud.extend(block([-9, 10, -9], [-6, 13, -6])); // equal coordinates within a cell
    let reference = bits(&run(&cloud, 1.0).0);
    assert!(reference.0 > 50 && reference.0 < 400, "both classes occur: {}", reference.0);
    for search in SEARCHES {
        let options = Options { search, ..Options::default() };
        let shuffled = random.shuffled(&cloud);
        assert_ne!(shuffled, cloud);
        let (particles, _) = prepare(&input(&shuffled, 1.0), &options).unwrap();
        assert!(bits(&particles) == reference, "{search:?}");
    }
    // Duplicates that differ in class or ellipsoid are told apart.
    let given: Vec<(Vec3, Class, Mat3)> = (0..200)
        .map(|i| {
            let class = if i % 3 == 0 { Class::Splash } else { Class::Body };
            (cloud[i % 20], class, Mat3::from_diagonal(Vec3::new(1.0, 1.0 + i as f32, 2.0)))
        })
        .collect();
    let prepared = |given: &[(Vec3, Class, Mat3)]| {
        let positions: Vec<_> = given.iter().map(|g| g.0).collect();
        let classes: Vec<_> = given.iter().map(|g| g.1).collect();
        let axes: Vec<_> = given.iter().map(|g| g.2).collect();
        let input = Input::new(&positions, 1.0).classes(Some(&classes)).ellipsoids(Some(&axes));
        bits(&prepare(&input, &Options::default()).unwrap().0)
    };
    assert!(prepared(&given) == prepared(&random.shuffled(&given)));
}

#[test]
fn given_classes_and_ellipsoids_are_used() {
    let positions = [Vec3::X * 40.0, Vec3::ZERO, Vec3::Y * 40.0];
    let classes = [Class::Body, Class::Splash, Class::Body];
    let skewed = Mat3::from_cols(Vec3::X, Vec3::new(0.5, -2.0, 0.0), Vec3::Z * 1e-3);
    let axes = [skewed, Mat3::ZERO, skewed * 2.0];
    let given = Input::new(&positions, 1.0).classes(Some(&classes));
    let (particles, report) = prepare(&given, &Options::default()).unwrap();
    assert_eq!(
        report,
        report_of(|r| {
            r.splash = 1;
            r.body = 2;
        })
    );
    assert_eq!(particles.ellipsoids[0].center, Vec3::ZERO);

    let given = given.ellipsoids(Some(&axes));
    let (particles, report) = prepare(&given, &Options::default()).unwrap();
    assert_eq!(report.splash_axes_ignored, 0, "zeros stand for none");
    let ball = Mat3::from_diagonal(Vec3::splat(SPLASH_RADIUS));
    let expected = [(positions[1], ball), (positions[2], axes[2]), (positions[0], axes[0])];
    for (center, axes) in expected {
        assert!(particles.ellipsoids.contains(&Ellipsoid { center, axes }));
    }
    assert_eq!(particles.radius, 1.0);

    for bad in [Mat3::ZERO, Mat3::NAN, Mat3::from_cols(Vec3::X, Vec3::X, Vec3::Z)] {
        // The second is a splash and ignored; the third comes first in canonical order.
        for (axes, index) in [([skewed, bad, bad], 2), ([bad, bad, bad], 0)] {
            let given = given.ellipsoids(Some(&axes));
            let error = prepare(&given, &Options::default()).err();
            assert_eq!(error, Some(PrepareError::Ellipsoid { index }));
        }
    }
}

#[test]
fn other_axes_of_splashes_are_counted_and_ignored() {
    let turn = Mat3::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 0.7);
    for radius in [1.0, 1e-12, 1e12] {
        let ball = Mat3::from_diagonal(Vec3::splat(SPLASH_RADIUS * radius));
        let stretched = ball * Mat3::from_diagonal(Vec3::new(1.0, 1.001, 1.0));
        // The ball that is drawn, rounded, turned and mirrored; others; and what is no ellipsoid.
        let as_drawn = [ball, ball * 1.00001, ball * turn, ball * Mat3::from_diagonal(Vec3::new(1.0, -1.0, 1.0))];
        let others = [ball * 1.01, stretched, turn * stretched];
        let none = [Mat3::ZERO, Mat3::NAN];
        let axes = [&as_drawn[..], &others, &none].concat();
        let positions: Vec<_> = (0..axes.len()).map(|i| 9.0 * radius * Vec3::X * i as f32).collect();
        for class in [Class::Splash, Class::Body] {
            let classes = vec![class; axes.len()];
            // The body's have to be ellipsoids.
            let n = if class == Class::Body { axes.len() - none.len() } else { axes.len() };
            let given = Input::new(&positions[..n], radius).classes(Some(&classes[..n])).ellipsoids(Some(&axes[..n]));
            let (particles, report) = prepare(&given, &Options::default()).unwrap();
            let splash = class == Class::Splash;
            assert_eq!(report.splash_axes_ignored, if splash { others.len() } else { 0 }, "{radius} {class:?}");
            assert_eq!(particles.ellipsoids.iter().all(|e| e.axes == ball), splash);
        }
    }
}

#[test]
fn errors_name_what_is_wrong() {
    let points = [Vec3::ZERO, Vec3::X, Vec3::new(0.0, f32::NAN, 0.0)];
    let fails = |input: &Input, options: &Options| prepare(input, options).err().unwrap();
    let defaults = Options::default();
    for radius in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(matches!(fails(&input(&points[..2], radius), &defaults), PrepareError::Radius(_)));
    }
    let error = fails(&input(&points, 1.0), &defaults);
    assert!(matches!(error, PrepareError::Position { index: 2, .. }));
    assert!(error.to_string().starts_with("particle 2 at [0, NaN, 0]"), "{error}");
    let short = input(&points[..2], 1.0).classes(Some(&[Class::Body]));
    let expected = PrepareError::Length { what: "classes", found: 1, particles: 2 };
    assert_eq!(fails(&short, &defaults), expected);
    let short = input(&points[..2], 1.0).ellipsoids(Some(&[]));
    assert!(matches!(fails(&short, &defaults), PrepareError::Length { what: "ellipsoids", .. }));
    for (name, options) in [
        ("support", Options { support: Some(1.9), ..defaults }),
        ("support", Options { support: Some(f32::NAN), ..defaults }),
        ("splash_threshold", Options { splash_threshold: f32::NAN, ..defaults }),
        ("smoothing", Options { smoothing: 1.1, ..defaults }),
        ("max_ratio", Options { max_ratio: 0.5, ..defaults }),
        ("max_semi_axis", Options { max_semi_axis: 0.0, ..defaults }),
    ] {
        let error = fails(&input(&points[..2], 1.0), &options);
        assert!(matches!(error, PrepareError::Option { name: n, .. } if n == name), "{error}");
    }
}

#[test]
fn progress_ends_at_the_number_of_particles() {
    let cloud = Random(5).cloud(9000, Vec3::ZERO, Vec3::splat(40.0));
    let seen = std::sync::Mutex::new(Vec::new());
    let note = |done| seen.lock().unwrap().push(done);
    prepare_with_progress(&input(&cloud, 1.0), &Options::default(), &note).unwrap();
    let mut seen = seen.into_inner().unwrap();
    assert_eq!(seen.last(), Some(&9000));
    seen.sort_unstable();
    assert_eq!(seen, [4096, 8192, 9000]);
}
