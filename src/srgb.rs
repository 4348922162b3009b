//! Linear light and its sRGB codes, as pictures are written and read, and as the last shader encodes them.

/// sRGB code of linear light, 0..1 (IEC 61966-2-1).
pub fn encode_srgb(v: f32) -> f32 {
    let v = v.clamp(0.0, 1.0);
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// Linear light of an sRGB code.
pub fn decode_srgb(v: f32) -> f32 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// sRGB in 8 bits, rounded to nearest.
pub fn srgb_byte(v: f32) -> u8 {
    (encode_srgb(v) * 255.0 + 0.5) as u8
}
