//! What the device prepared, read back for dumps and statistics.

use glam::{DMat3, DVec3, Mat3, Vec3};
use meniscus::{
    Ellipsoid, Particles,
    host::{HostError, Session},
    prepare::{Report, ellipsoids::eigen_symmetric},
    shader as s,
    targets::Id,
};

/// Particles as the last frame drew them, splashes first, and its counts; `before` without any.
pub fn read(session: &mut Session, before: &Particles) -> Result<(Particles, Report), HostError> {
    let mut array = |id| {
        let words = session.words(id, 0)?.unwrap_or_default();
        Ok::<_, HostError>(
            words
                .chunks_exact(3)
                .map(|w| Vec3::from_slice(&[w[0], w[1], w[2]].map(f32::from_bits)))
                .collect::<Vec<_>>(),
        )
    };
    let (centers, diagonals, mixed) = (array(Id::Centers)?, array(Id::Diagonals)?, array(Id::Mixed)?);
    let radius = before.radius;
    let (mut ellipsoids, mut body) = (Vec::new(), Vec::new());
    for ((center, d), m) in centers.into_iter().zip(diagonals).zip(mixed).filter(|((_, d), _)| d.x != 0.0) {
        let (e, n) = (d.abs().as_dvec3(), m.as_dvec3());
        let shape = DMat3::from_cols(DVec3::new(e.x, n.x, n.y), DVec3::new(n.x, e.y, n.z), DVec3::new(n.y, n.z, e.z));
        // The principal axes of S = A A^T are one A of many.
        let (squares, frame) = eigen_symmetric(shape);
        let axes = (frame * DMat3::from_diagonal(squares.max(DVec3::ZERO).map(f64::sqrt))).as_mat3() * radius;
        let sphere = Mat3::from_diagonal(Vec3::splat(radius));
        if d.x < 0.0 {
            ellipsoids.push(Ellipsoid { center, axes: sphere })
        } else {
            body.push(Ellipsoid { center, axes })
        }
    }
    let splash_count = ellipsoids.len();
    ellipsoids.append(&mut body);
    let counters = session.words(Id::Counters, 0)?.unwrap_or_else(|| vec![0; s::COUNTERS as usize]);
    let count = |slot: u32| counters[slot as usize] as usize;
    let report = Report {
        splash: count(s::COUNT_SPLASH),
        body: count(s::COUNT_BODY),
        few_neighbours: count(s::COUNT_FEW_NEIGHBOURS),
        degenerate: count(s::COUNT_DEGENERATE),
        clamped_long: count(s::COUNT_CLAMPED_LONG),
        clamped_ratio: count(s::COUNT_CLAMPED_RATIO),
    };
    Ok((Particles { radius, ellipsoids, splash_count }, report))
}
