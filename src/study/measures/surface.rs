//! How far a method's own surface is from the truth's: where pixels show liquid, how deep it begins there, which way it faces.

use crate::study::first::First;
use glam::Vec3;

/// What a pixel's centre meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Front {
    /// Along the view axis, in world units.
    pub depth: f32,
    /// World normal, out of the liquid; of length 1.
    pub normal: Option<Vec3>,
}

/// Errors of a surface. Depths and normals are compared where both have liquid; what is said of them is the median, because at an
/// edge one of the two may well see what is far behind.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SurfaceError {
    /// Pixels where both have liquid over pixels where one of them has: 1 for the same silhouette.
    pub iou: f64,
    /// In particle radii; positive where the method's surface lies behind the truth's.
    pub depth: Option<f64>,
    /// Its absolute value's, in particle radii.
    pub depth_absolute: Option<f64>,
    /// Angle between the normals in degrees.
    pub normal: Option<f64>,
}

/// Compares what pixel centres meet, row by row; `radius` is a particle's in world units. Nothing if neither has liquid.
pub fn compare(truth: &[First], seen: &[Option<Front>], radius: f32) -> Option<SurfaceError> {
    let pairs = || truth.iter().zip(seen);
    let either = pairs().filter(|(t, s)| t.hits > 0 || s.is_some()).count();
    let both: Vec<(&First, &Front)> =
        pairs().filter_map(|(t, s)| Some((t, s.as_ref()?))).filter(|p| p.0.hits > 0).collect();
    let depths = |f: &dyn Fn(f64) -> f64| {
        let all = both.iter().map(|(t, s)| f(f64::from(s.depth - t.depth) / f64::from(radius)));
        median(all.collect())
    };
    let angle = |(t, s): &(&First, &Front)| Some(t.normal.dot(s.normal?).clamp(-1.0, 1.0).acos().to_degrees().into());
    (either > 0).then(|| SurfaceError {
        iou: both.len() as f64 / either as f64,
        depth: depths(&|d| d),
        depth_absolute: depths(&f64::abs),
        normal: median(both.iter().filter_map(angle).collect()),
    })
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_told_apart() {
        let first =
            |depth: f32, hits| First { depth, normal: Vec3::Z, final_direction: Vec3::X, path_length: 0.0, hits };
        let tilted = Vec3::new(0.5, 0.0, 0.75f32.sqrt());
        let front = |depth| Some(Front { depth, normal: Some(tilted) });
        // Both, both, both, the truth alone, the method alone, neither.
        let truth =
            [first(2.0, 2), first(3.0, 2), first(4.0, 1), first(5.0, 3), first(f32::NAN, 0), first(f32::NAN, 0)];
        let seen = [front(2.25), front(2.5), front(4.25), None, front(1.0), None];
        let error = compare(&truth, &seen, 0.25).expect("liquid");
        assert_eq!((error.iou, error.depth, error.depth_absolute), (0.6, Some(1.0), Some(1.0)));
        assert!((error.normal.expect("normals") - 30.0).abs() < 1e-3, "{error:?}");
        let apart = compare(&truth[..1], &[None], 0.25).expect("liquid");
        assert_eq!((apart.iou, apart.depth, apart.normal), (0.0, None, None));
        assert_eq!(compare(&truth[5..], &[None], 0.25), None);
    }
}
