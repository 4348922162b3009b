//! Random numbers that depend on the pixel and the sample alone, never on which thread draws them.

/// SplitMix64 (Steele et al. 2014), seeded by hashing.
#[derive(Clone, Debug)]
pub struct Random(u64);

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Random {
    /// The numbers of one sample of one pixel.
    pub fn of(pixel: u64, sample: u64) -> Random {
        Random(mix(mix(pixel.wrapping_add(0x9e37_79b9_7f4a_7c15)).wrapping_add(sample)))
    }

    /// The next number, at least 0 and below 1.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }
}
