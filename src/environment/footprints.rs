//! An environment map as shaders read it (`glsl/include/environment.glsl`): each texel holds its whole bilinear footprint, so
//! that a look-up is one fetch.
//!
//! A footprint is the texels (x, y), (x + 1, y), (x, y + 1) and (x + 1, y + 1), in a word each; columns wrap around, and the last row
//! is its own next one. A word is red, green and blue as mantissas of 9 bits, from its lowest bit on, under one exponent of 5 bits, as
//! in RGB9E5; but the largest exponent is what the map's largest value needs, so that no light is too bright to be held, and
//! the faintest that is, is 2^40 times fainter. Rounding is to the nearest: by a thousandth of the largest of the three, or two.

use super::Equirect;

/// Of one footprint.
pub(crate) const BYTES: u64 = 16;

/// What a mantissa ends before.
const MANTISSA: f64 = 512.0;
/// What an exponent ends at.
const MOST: i32 = 31;
/// Exponents of the map's largest value: what shaders multiply by is no denormal, and no light is infinite.
const LEAST_TOP: i32 = -126;
const MOST_TOP: i32 = 119;

/// Writes a map's footprints, row by row. Gives what the mantissas of the largest exponent are multiples of: a power of two.
pub(crate) fn write(map: &Equirect, out: &mut [u8]) -> f32 {
    let top = exponent(map.largest()).clamp(LEAST_TOP, MOST_TOP);
    let width = map.width as usize;
    let mut rows = map.texels.chunks_exact(4 * width).map(|row| pack_row(row, top));
    let mut upper = rows.next().unwrap_or_default();
    let mut out = out.chunks_exact_mut(BYTES as usize * width);
    for out in &mut out {
        let lower = rows.next().unwrap_or_else(|| upper.clone());
        let next = (1..width).chain([0]);
        for ((x, next), out) in next.enumerate().zip(out.as_chunks_mut::<{ BYTES as usize }>().0) {
            *out = bytemuck::cast([upper[x], upper[next], lower[x], lower[next]]);
        }
        upper = lower;
    }
    power_of_two(top) as f32
}

fn pack_row(row: &[f32], top: i32) -> Vec<u32> {
    row.as_chunks::<4>().0.iter().map(|[r, g, b, _]| pack([*r, *g, *b], top)).collect()
}

/// One texel's word, in a map with this largest exponent.
fn pack(rgb: [f32; 3], top: i32) -> u32 {
    let least = top - MOST;
    let exponent = exponent(rgb[0].max(rgb[1]).max(rgb[2])).clamp(least, top);
    let per_step = power_of_two(-exponent);
    let [r, g, b] = rgb.map(|v| (f64::from(v) * per_step).round().min(MANTISSA - 1.0) as u32);
    r | g << 9 | b << 18 | ((exponent - least) as u32) << 27
}

/// The smallest n for which a value is below 512 steps of 2^n once it is rounded to whole ones.
fn exponent(value: f32) -> i32 {
    // What is denormal in 32 bits is not in 64; 0 counts as fainter than any.
    let n = ((f64::from(value).to_bits() >> 52) as i32 - 1023 - 8).max(-200);
    n + i32::from((f64::from(value) * power_of_two(-n)).round() >= MANTISSA)
}

/// 2^n for what is a normal number in 64 bits.
fn power_of_two(n: i32) -> f64 {
    f64::from_bits(((1023 + n) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The four texels of a footprint, by hand: value by value, with their scale.
    fn unpacked(map: &Equirect) -> Vec<[[f64; 3]; 4]> {
        let [width, height] = map.size();
        let mut out = vec![0; (BYTES * u64::from(width) * u64::from(height)) as usize];
        let scale = f64::from(write(map, &mut out));
        let word = |w: u32| {
            let step = scale * 2f64.powi((w >> 27) as i32 - 31);
            [w & 511, w >> 9 & 511, w >> 18 & 511].map(|m| f64::from(m) * step)
        };
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&out);
        words.as_chunks::<4>().0.iter().map(|four| four.map(word)).collect()
    }

    #[test]
    fn a_footprint_wraps_around_and_ends_at_the_poles() {
        let rgb: Vec<[f32; 3]> = (0..6).map(|i| [i as f32, 0.0, 8.0]).collect();
        let found = unpacked(&Equirect::new(3, 2, &rgb).expect("a map"));
        let red: Vec<[f64; 4]> = found.iter().map(|f| f.map(|texel| texel[0])).collect();
        let first = [[0.0, 1.0, 3.0, 4.0], [1.0, 2.0, 4.0, 5.0], [2.0, 0.0, 5.0, 3.0]];
        assert_eq!(red[..3], first);
        assert_eq!(red[3..], [[3.0, 4.0, 3.0, 4.0], [4.0, 5.0, 4.0, 5.0], [5.0, 3.0, 5.0, 3.0]]);
        assert!(found.iter().flatten().all(|texel| texel[2] == 8.0));
    }

    #[test]
    fn light_of_any_strength_keeps_nine_bits() {
        for largest in [1.0, 511.4, 511.6, 3e-20, 2.5e6, f32::MAX] {
            let faint = [1.0, 0.7, 1e-3, 1e-6, 1e-9].map(|part| largest * part);
            let rgb: Vec<[f32; 3]> = faint.iter().map(|v| [*v, 0.3 * v, 0.01 * v]).collect();
            let found = unpacked(&Equirect::new(5, 1, &rgb).expect("a map"));
            for (want, got) in rgb.iter().zip(&found) {
                for k in 0..3 {
                    let off = (got[0][k] - f64::from(want[k])).abs();
                    // Half a step of 1/256; in f32's last octave, whose end is no number, a whole one.
                    let most =
                        f64::from(want[0]) / if largest == f32::MAX && want[0] == largest { 256.0 } else { 511.0 };
                    assert!(off <= most && got[0][k] <= f64::from(f32::MAX), "{largest}: {got:?} for {want:?}");
                }
            }
        }
        // What would be rounded to 512 steps has 256 of twice the size.
        let map = Equirect::new(1, 1, &[[511.6, 255.6, 0.0]]).expect("a map");
        assert_eq!(unpacked(&map)[0][0], [512.0, 256.0, 0.0]);
        // What is more than 2^40 times fainter than the brightest is dark, and a dark map is dark.
        let map = Equirect::new(2, 1, &[[1e30, 0.0, 0.0], [1e10; 3]]).expect("a map");
        assert_eq!(unpacked(&map)[1][0], [0.0; 3]);
        assert_eq!(unpacked(&Equirect::new(1, 1, &[[0.0; 3]]).expect("a map"))[0], [[0.0; 3]; 4]);
    }
}
