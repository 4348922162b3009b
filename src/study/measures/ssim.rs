//! Structural similarity (Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, *Image Quality Assessment: From Error Visibility to
//! Structural Similarity*, 2004): of each sRGB channel, 0 to 1, in Gaussian windows 11 pixels wide with a standard deviation
//! of 1.5, the mean of the three. Crates that are to be had compare 8 bits, in square windows side by side.

use rayon::prelude::*;

/// Pixels from a window's middle to its edge.
const REACH: usize = 5;
const SIGMA: f64 = 1.5;
/// (K L)² for K = 0.01 and 0.03, L = 1.
const STABLE: [f64; 2] = [0.01 * 0.01, 0.03 * 0.03];

/// Whether the window around a pixel lies within the picture.
pub fn has_window(size: [u32; 2], pixel: usize) -> bool {
    let [w, h] = size.map(|n| n as usize);
    let inside = |at: usize, n: usize| at >= REACH && at + REACH < n;
    inside(pixel % w, w) && inside(pixel / w, h)
}

/// For each pixel; beyond an edge the picture is mirrored, the edge's pixels included.
pub fn map(size: [u32; 2], a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<f32> {
    let [w, h] = size.map(|n| n as usize);
    let mut sum = vec![0.0; w * h];
    for channel in 0..3 {
        let of = |all: &[[f32; 3]]| all.iter().map(|p| f64::from(p[channel])).collect::<Vec<_>>();
        let (a, b) = (of(a), of(b));
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<_>>();
        let [ma, mb, maa, mbb, mab] =
            [&a, &b, &product(&a, &a), &product(&b, &b), &product(&a, &b)].map(|v| blur(v, w, h));
        for (i, sum) in sum.iter_mut().enumerate() {
            let (va, vb, vab) = (maa[i] - ma[i] * ma[i], mbb[i] - mb[i] * mb[i], mab[i] - ma[i] * mb[i]);
            let means = (2.0 * ma[i] * mb[i] + STABLE[0]) / (ma[i] * ma[i] + mb[i] * mb[i] + STABLE[0]);
            *sum += means * (2.0 * vab + STABLE[1]) / (va + vb + STABLE[1]);
        }
    }
    sum.into_iter().map(|s| (s / 3.0) as f32).collect()
}

/// Means in Gaussian windows, along rows and then along columns.
fn blur(values: &[f64], w: usize, h: usize) -> Vec<f64> {
    let bell: Vec<f64> = (0..=2 * REACH).map(|k| (-0.5 * ((k as f64 - REACH as f64) / SIGMA).powi(2)).exp()).collect();
    let total: f64 = bell.iter().sum();
    let mirrored = |at: i64, n: usize| {
        let at = at.rem_euclid(2 * n as i64) as usize;
        if at < n { at } else { 2 * n - 1 - at }
    };
    let mean = |at: usize, n: usize, value: &dyn Fn(usize) -> f64| {
        let place = |k: usize| mirrored((at + k) as i64 - REACH as i64, n);
        bell.iter().enumerate().map(|(k, weight)| weight * value(place(k))).sum::<f64>() / total
    };
    let each = |f: &(dyn Fn(usize) -> f64 + Sync)| (0..w * h).into_par_iter().map(f).collect::<Vec<_>>();
    let rows = each(&|i| mean(i % w, w, &|x| values[i / w * w + x]));
    each(&|i| mean(i / w, h, &|y| rows[y * w + i % w]))
}
