//! What the device prepared, read back for dumps and statistics.

use glam::{DMat3, DVec3, Mat3, Vec3, Vec4};
use meniscus::{
    Class, Ellipsoid, Particles, Point,
    host::{HostError, Session},
    inspect,
    prepare::{Report, ellipsoids::eigen_symmetric},
    shader as s,
    space::Space,
};

/// What the last frame made of the positions.
pub struct Prepared {
    /// As drawn, splashes first.
    pub particles: Particles,
    pub report: Report,
    /// Which of the positions each of them was.
    pub index: Vec<u32>,
}

/// Reads it back; `radius` is the particles'.
pub fn read(session: &mut Session, radius: f32, splash_threshold: f32) -> Result<Prepared, HostError> {
    let words = |session: &mut Session, id| Ok::<_, HostError>(session.words(id, 0)?.unwrap_or_default());
    let mut array = |id| {
        let triple = |w: &[u32]| Vec3::from_slice(&[w[0], w[1], w[2]].map(f32::from_bits));
        Ok::<_, HostError>(words(session, id)?.chunks_exact(3).map(triple).collect::<Vec<_>>())
    };
    let (centers, diagonals, mixed) =
        (array("particle centres")?, array("particle shapes (diagonal)")?, array("particle shapes (mixed)")?);
    if let Some(points) = points(session, radius, splash_threshold)? {
        return from_points(session, radius, points);
    }
    let order = order(session, centers.len())?;
    let sphere = Mat3::from_diagonal(Vec3::splat(radius * s::SPLASH_RADIUS));
    let space = words(session, "extent")?;
    let space = if space.is_empty() { Space::new(radius, Vec3::ZERO) } else { Space::prepared(radius, &space) };
    let (mut splash, mut body) = (Vec::new(), Vec::new());
    for (((center, d), m), index) in centers.into_iter().zip(diagonals).zip(mixed).zip(order) {
        let center = space.world(center);
        if d.x < 0.0 {
            splash.push((Ellipsoid { center, axes: sphere }, index));
        } else if d.x > 0.0 {
            let (e, n) = (d.as_dvec3(), m.as_dvec3());
            let shape =
                DMat3::from_cols(DVec3::new(e.x, n.x, n.y), DVec3::new(n.x, e.y, n.z), DVec3::new(n.y, n.z, e.z));
            // The principal axes of S = A A^T are one A of many.
            let (squares, frame) = eigen_symmetric(shape);
            let axes = (frame * DMat3::from_diagonal(squares.max(DVec3::ZERO).map(f64::sqrt))).as_mat3() * radius;
            body.push((Ellipsoid { center, axes }, index));
        }
    }
    let splash_count = splash.len();
    let (ellipsoids, index) = splash.into_iter().chain(body).unzip();
    let report = inspect::report(&session.counters()?);
    Ok(Prepared { particles: Particles { radius, ellipsoids, splash_count }, report, index })
}

/// What the device made a density field of, in its order; `None` where it did not. What is not finite has no density. Signs say which are
/// balls, the threshold which are splashes.
pub fn points(session: &mut Session, radius: f32, splash_threshold: f32) -> Result<Option<Vec<Point>>, HostError> {
    let Some(words) = session.words("particle points", 0)? else { return Ok(None) };
    let point = |w: &[u32]| {
        let p = Vec4::from_slice(&[w[0], w[1], w[2], w[3]].map(f32::from_bits));
        // A power of two rounds nothing.
        let unit = 2f32.powi(-radius.log2().floor() as i32);
        let class = if p.w < splash_threshold { Class::Splash } else { Class::Body };
        Point { position: p.truncate() / unit, density: p.w.abs(), class }
    };
    Ok(Some(words.chunks_exact(4).map(point).collect()))
}

/// Balls in place of ellipsoids, which nobody draws.
fn from_points(session: &mut Session, radius: f32, points: Vec<Point>) -> Result<Prepared, HostError> {
    let order = order(session, points.len())?;
    let there = points.iter().zip(order).filter(|(p, _)| p.density > 0.0);
    let (splash, body): (Vec<_>, Vec<_>) = there.partition(|(p, _)| p.class == Class::Splash);
    let ball = |(p, index): (&Point, u32)| {
        let radius = if p.class == Class::Splash { radius * s::SPLASH_RADIUS } else { radius };
        (Ellipsoid { center: p.position, axes: Mat3::from_diagonal(Vec3::splat(radius)) }, index)
    };
    let splash_count = splash.len();
    let (ellipsoids, index) = splash.into_iter().chain(body).map(ball).unzip();
    let report = inspect::report(&session.counters()?);
    Ok(Prepared { particles: Particles { radius, ellipsoids, splash_count }, report, index })
}

/// Which position each of so many particles of the device's arrays was.
fn order(session: &mut Session, particles: usize) -> Result<Vec<u32>, HostError> {
    let all = session.words("sort order", 0)?.unwrap_or_default();
    let passes = session.words("extent", 0)?.map_or(0, |e| e[s::EXTENT_PASSES as usize] as usize);
    let sorted = all.len() == 2 * particles && passes > 0;
    // The relation table leaves particles in the order of the input.
    Ok(if sorted { all[(passes & 1) * particles..][..particles].to_vec() } else { (0..particles as u32).collect() })
}

/// What the device lists of so many particles' neighbours, and how many words of it are each one's.
fn lists(session: &mut Session, particles: usize) -> Result<(Vec<u32>, usize), HostError> {
    let words = session.words("neighbours (debug)", 0)?.unwrap_or_default();
    let each = words.len() / particles.max(1);
    Ok((words, each.max(1)))
}

/// The most neighbours that a particle has, whether or not there was room to list them.
pub fn most_neighbours(session: &mut Session, particles: usize) -> Result<u32, HostError> {
    let (words, each) = lists(session, particles)?;
    Ok(words.chunks_exact(each).map(|list| list[1]).max().unwrap_or(0))
}

/// Neighbours of every position, in the order of the input: where each one's begin (one entry more than there are
/// positions), and their indices, ascending.
pub fn neighbours(session: &mut Session, particles: usize) -> Result<(Vec<u64>, Vec<u32>), HostError> {
    let (words, each) = lists(session, particles)?;
    let mut lists = vec![Vec::new(); words.len() / each];
    for list in words.chunks_exact(each) {
        let (index, number) = (list[0] as usize, list[1] as usize);
        lists[index] = list[2..][..number].to_vec();
        lists[index].sort_unstable();
    }
    let mut offsets = vec![0];
    offsets.extend(lists.iter().scan(0, |sum, l| {
        *sum += l.len() as u64;
        Some(*sum)
    }));
    Ok((offsets, lists.concat()))
}
