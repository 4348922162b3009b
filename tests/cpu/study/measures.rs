use meniscus::study::measures::{Linear, MeasureError, compare, magma, on_scale};

const SIZE: [u32; 2] = [64, 48];

/// Waves of three colours; a part of the picture is brighter than a screen can show.
fn picture(shift: f64, gain: f64) -> Linear {
    let [w, h] = SIZE.map(|n| n as usize);
    let value = |x: f64, y: f64, k: f64| {
        let wave = (0.31 * x + 0.17 * y * (k + 1.0) + shift + k).sin() * (0.09 * x * y / (k + 7.0)).cos();
        let bright = (10.0..20.0).contains(&y) && (20.0..36.0).contains(&x);
        ((0.5 + 0.45 * wave) * gain) as f32 * if bright { 4.0 } else { 1.0 }
    };
    let pixel = |i: usize| [0.0, 1.0, 2.0].map(|k| value((i % w) as f64, (i / w) as f64, k));
    Linear { size: SIZE, pixels: (0..w * h).map(pixel).collect() }
}

/// What flip-evaluator 1.7 (NVIDIA's own), numpy and scipy's Gaussian filter say of these two pictures, over all of them and in a
/// disc of 949 pixels.
#[test]
fn measures_are_those_of_other_implementations() {
    let maps = compare(&picture(0.0, 0.6), &picture(0.35, 0.55)).expect("of one size");
    let disc: Vec<bool> = (0..64 * 48).map(|i| (i % 64 - 30i32).pow(2) + (i / 64 - 24i32).pow(2) < 300).collect();
    let (all, within) = (maps.means(None).expect("pixels"), maps.means(Some(&disc)).expect("pixels"));
    let near = |a: f64, b: f64| (a - b).abs() < 2e-5;
    assert!(near(all.flip, 0.273289) && near(within.flip, 0.284284), "{all:?} {within:?}");
    assert!(near(all.flip_hdr.unwrap(), 0.306165) && near(within.flip_hdr.unwrap(), 0.321505), "{all:?} {within:?}");
    assert!(near(all.relative_mse, 0.038380) && near(within.relative_mse, 0.042919), "{all:?} {within:?}");
    assert!(near(all.ssim, 0.932776) && near(within.ssim, 0.935547), "{all:?} {within:?}");
    assert!(near(f64::from(maps.ssim[0]), 0.902236), "{}", maps.ssim[0]);
    assert_eq!((all.pixels, within.pixels), (64 * 48, 949));
}

#[test]
fn a_picture_is_not_far_from_itself() {
    let same = compare(&picture(0.1, 0.5), &picture(0.1, 0.5)).expect("of one size").means(None).expect("pixels");
    assert_eq!((same.flip, same.flip_hdr, same.relative_mse), (0.0, Some(0.0), 0.0));
    assert!((same.ssim - 1.0).abs() < 1e-6);
    let black = picture(0.0, 0.0);
    let maps = compare(&black, &black).expect("of one size");
    assert_eq!(maps.means(None).expect("pixels").flip_hdr, None);
    // On a scale from dark to bright all of it is dark, and nothing is no number.
    assert!(on_scale(&maps).iter().flat_map(|(_, map)| magma(map)).all(|c| c == magma(&[0.0])[0]));
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let (a, small) = (picture(0.0, 1.0), Linear { size: [2, 1], pixels: vec![[0.5; 3]; 2] });
    assert!(matches!(compare(&a, &small), Err(MeasureError::Size { .. })));
    let maps = compare(&a, &a).expect("of one size");
    assert!(matches!(maps.means(Some(&[true; 9])), Err(MeasureError::Mask { mask: 9, .. })));
    assert!(matches!(maps.means(Some(&[false; 64 * 48])), Err(MeasureError::EmptyMask)));
    let mut broken = a.clone();
    broken.pixels[7][1] = f32::NAN;
    assert!(matches!(compare(&a, &broken), Err(MeasureError::Flip(_))));
    // Smaller than a window.
    let means = compare(&small, &small).expect("of one size").means(None).expect("pixels");
    assert!((means.ssim - 1.0).abs() < 1e-6, "{means:?}");
}
