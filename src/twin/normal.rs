//! Twin of `glsl/include/normal.glsl`: unit vectors in 32 bits, by the octahedral map.

use glam::{Vec2, Vec3};

fn wrap(v: Vec2) -> Vec2 {
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    Vec2::new((1.0 - v.y.abs()) * sign(v.x), (1.0 - v.x.abs()) * sign(v.y))
}

/// Two signed 16-bit fractions; `n` need not have unit length.
pub fn encode_normal(n: Vec3) -> u32 {
    let mut p = n.truncate() / (n.x.abs() + n.y.abs() + n.z.abs());
    if n.z < 0.0 {
        p = wrap(p);
    }
    let code = |v: f32| (v.clamp(-1.0, 1.0) * 32767.0 + 0.5).floor() as i32 as u32;
    (code(p.x) & 0xffff) | (code(p.y) << 16)
}

/// Unit vector of a code.
pub fn decode_normal(code: u32) -> Vec3 {
    let p = Vec2::new(f32::from(code as u16 as i16), f32::from((code >> 16) as u16 as i16)) / 32767.0;
    let z = 1.0 - p.x.abs() - p.y.abs();
    let xy = if z < 0.0 { wrap(p) } else { p };
    xy.extend(z).normalize()
}
