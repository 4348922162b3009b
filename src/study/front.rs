//! What no other choice beats in both time and error.

/// Indices of the points (time, error) that no other is at least as good as in both and better in one: the Pareto front, by
/// rising time. Of equal points the first counts.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|i| points[*i].0.is_finite() && points[*i].1.is_finite()).collect();
    // Stable: of equal ones the first stays first.
    order.sort_by(|a, b| points[*a].0.total_cmp(&points[*b].0).then(points[*a].1.total_cmp(&points[*b].1)));
    let mut least = f64::INFINITY;
    order.retain(|i| {
        let better = points[*i].1 < least;
        least = least.min(points[*i].1);
        better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::front;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points =
            [(3.0, 0.3), (1.0, 0.9), (2.0, 0.3), (2.0, 0.5), (4.0, 0.1), (1.0, 0.9), (f64::NAN, 0.0), (5.0, 0.2)];
        assert_eq!(front(&points), [1, 2, 4]);
        // By definition: nothing on it is beaten, and everything else is, or stands there already.
        let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
        for (i, p) in points.iter().enumerate().filter(|(_, p)| !p.0.is_nan()) {
            let beaten = points.iter().any(|q| beats(*q, *p)) || points[..i].contains(p);
            assert_eq!(beaten, !front(&points).contains(&i), "{p:?}");
        }
        assert_eq!(front(&[]), [0usize; 0]);
    }
}
