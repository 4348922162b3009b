//! Where the default ellipsoids put the liquid's surface: on jittered lattices, whose surface lies one radius above the
//! outermost centres, and of particles that move.

use glam::{DMat3, DVec3, Vec3};
use meniscus::particles::Particles;
use meniscus::prepare::{Options, prepare};

use super::{Random, block, input, run};

/// A lattice (r = 1) of which each particle lies up to a quarter of a radius off along each axis.
fn jittered(lattice: Vec<Vec3>) -> Vec<Vec3> {
    let mut random = Random(11);
    lattice.into_iter().map(|p| p + 0.25 * random.vec()).collect()
}

/// The highest z of a vertical line at (x, y) in any ellipsoid.
fn height(particles: &Particles, x: f64, y: f64) -> Option<f64> {
    let mut highest = None;
    for e in &particles.ellipsoids {
        let (center, axes) = (e.center.as_dvec3(), e.axes.as_dmat3());
        let (dx, dy) = (x - center.x, y - center.y);
        // None is longer.
        if dx * dx + dy * dy > 4.001 {
            continue;
        }
        let shape: DMat3 = (axes * axes.transpose()).inverse();
        let beside = shape * DVec3::new(dx, dy, 0.0);
        let (a, b, c) = (shape.z_axis.z, beside.z, beside.x * dx + beside.y * dy - 1.0);
        if b * b - a * c >= 0.0 {
            let z = center.z + ((b * b - a * c).sqrt() - b) / a;
            highest = Some(highest.map_or(z, |h: f64| h.max(z)));
        }
    }
    highest
}

/// Looks down on the square within `half` at 61 x 61 places: the mean error of the surface's height, and the share of gaps,
/// where the first surface lies more than two radii too deep. `surface` gives the height, or none where it is not looked at.
fn errors(particles: &Particles, half: f64, surface: impl Fn(f64, f64) -> Option<f64>) -> (f64, f64) {
    let at = |i: i32| half * f64::from(i - 30) / 30.0;
    let (mut sum, mut seen, mut gaps) = (0.0, 0, 0);
    for (x, y) in (0..61).flat_map(|i| (0..61).map(move |j| (at(i), at(j)))) {
        let Some(expected) = surface(x, y) else { continue };
        match height(particles, x, y).map(|z| z - expected) {
            Some(error) if error > -2.0 => (sum, seen) = (sum + error, seen + 1),
            _ => gaps += 1,
        }
    }
    assert!(seen > 150, "{seen} places are seen");
    (sum / f64::from(seen), f64::from(gaps) / f64::from(seen + gaps))
}

fn assert_surface(name: &str, cloud: Vec<Vec3>, bound: f64, half: f64, surface: impl Fn(f64, f64) -> Option<f64>) {
    let (error, gaps) = errors(&run(&jittered(cloud), 1.0).0, half, surface);
    println!("{name}: {error:+.3} r, {:.2} % gaps", 100.0 * gaps);
    assert!(error.abs() <= bound, "{name}: the surface is {error} r too high");
    assert!(gaps <= 0.01, "{name}: {gaps} are gaps");
}

#[test]
fn flat_surfaces_stay_where_they_are() {
    for layers in [1, 2, 3, 8] {
        let slab = block([-8, -8, 1 - layers], [8, 8, 0]);
        assert_surface(&format!("{layers} layers"), slab, 0.2, 8.0, |_, _| Some(1.0));
    }
    // Up to where edges and corners of the liquid are round, a third of a radius before they end.
    assert_surface("an edge", block([-8, -8, -8], [2, 8, 0]), 0.2, 4.7, |_, _| Some(1.0));
    assert_surface("a corner", block([-8, -8, -8], [2, 2, 0]), 0.2, 4.7, |_, _| Some(1.0));
}

#[test]
fn balls_keep_their_size() {
    for (radius, offset) in [(7.0, 0.0), (4.0, 1.0)] {
        let whole = block([-4; 3], [4; 3]).into_iter().map(|p| p + offset);
        let ball: Vec<Vec3> = whole.filter(|p| p.length() <= radius - 0.5).collect();
        // That of as many particles of (2 r)^3 each.
        let own = (ball.len() as f64 * 6.0 / std::f64::consts::PI).cbrt();
        assert!((own - f64::from(radius)).abs() < 0.5, "{own}");
        assert_surface(&format!("a ball of {own:.2} r"), ball, 0.2, own, |x, y| {
            // Away from the limb, where heights say little.
            (x * x + y * y < 0.64 * own * own).then(|| (own * own - x * x - y * y).sqrt())
        });
    }
}

#[test]
fn a_block_of_27_keeps_its_size() {
    assert_surface("27 particles", block([-1; 3], [1; 3]), 0.2, 2.4, |_, _| Some(3.0));
}

/// One particle wide, its radius that of as much volume: half a row's height is seen.
#[test]
fn a_jet_of_27_has_no_gaps() {
    let jet = jittered(block([-13, 0, 0], [13, 0, 0]));
    let (particles, _) = prepare(&input(&jet, 1.0), &Options::default().splash_threshold(0.0)).unwrap();
    let squared = 4.0 / std::f64::consts::PI;
    let (error, gaps) = errors(&particles, 24.0, |_, y| (y.abs() < 0.81).then(|| (squared - y * y).sqrt()));
    assert!(error.abs() <= 0.3 && gaps <= 0.01, "{error} r, {gaps} gaps");
}

#[test]
fn a_surface_is_smoother_than_of_balls() {
    let slab = jittered(block([-8, -8, -7], [8, 8, 0]));
    let rough = |particles: &Particles| {
        let heights: Vec<f64> = (0..61 * 61)
            .filter_map(|i| height(particles, 0.2 * f64::from(i / 61 - 30), 0.2 * f64::from(i % 61 - 30)))
            .collect();
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        (heights.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / heights.len() as f64).sqrt()
    };
    let fitted = run(&slab, 1.0).0;
    let mut balls = fitted.clone();
    balls.ellipsoids.clear();
    balls.ellipsoids.extend(
        slab.iter().map(|&center| meniscus::particles::Ellipsoid {
            center,
            axes: glam::Mat3::from_diagonal(Vec3::splat(1.35)),
        }),
    );
    let (fitted, balls) = (rough(&fitted), rough(&balls));
    assert!(fitted < 0.85 * balls, "{fitted} r, of balls {balls} r");
}

/// A particle leaves a block, through every number of neighbours down to none and into the splash: from step to step no
/// particle's ellipsoid changes by much more than it moves.
#[test]
fn nothing_pops() {
    let rest = jittered(block([-3, -3, -4], [3, 3, 0]));
    let step = 0.01;
    let mut last: Option<Vec<(DVec3, DMat3)>> = None;
    let (mut splashes, mut most) = (0, 0f64);
    for k in 0..700 {
        let leaving = Vec3::new(0.3, 0.4, 1.0 + step * k as f32);
        let cloud: Vec<Vec3> = rest.iter().copied().chain([leaving]).collect();
        let classes = meniscus::prepare::classify(&cloud, 1.0, &Options::default(), None).unwrap();
        splashes += usize::from(*classes.last().unwrap() == meniscus::particles::Class::Splash);
        // One at a time, so that what is compared is the same particle.
        let (particles, _) = run(&cloud, 1.0);
        let place = |at: Vec3| {
            let nearest = |e: &&meniscus::particles::Ellipsoid| e.center.distance_squared(at);
            let e = particles.ellipsoids.iter().min_by(|a, b| nearest(a).total_cmp(&nearest(b))).unwrap();
            let axes = e.axes.as_dmat3();
            (e.center.as_dvec3(), axes * axes.transpose())
        };
        let now: Vec<_> = cloud.iter().map(|&p| place(p)).collect();
        if let Some(last) = last {
            for ((c0, s0), (c1, s1)) in last.iter().zip(&now) {
                let change = (*s1 - *s0).to_cols_array().iter().fold(c0.distance(*c1), |a, b| a.max(b.abs()));
                most = most.max(change);
            }
        }
        last = Some(now);
    }
    println!("largest change in {step} r: {most}");
    assert!((50..650).contains(&splashes), "{splashes} steps as a splash");
    // A class that changed a ball of radius 1.24 to one of 1.5 would be a change of 0.71 in one step.
    assert!(most < 12.0 * f64::from(step), "an ellipsoid changes by {most} r in one step of {step} r");
}
