//! At what share of the picture's resolution passes work: surfaces may be drawn and smoothed at half its width and height,
//! for optics that upsample them (Cords08 §5).

use crate::shader::Frame;

/// A share of the picture's resolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Scale {
    Full,
    Half,
}

impl Scale {
    pub const ALL: [Scale; 2] = [Scale::Full, Scale::Half];

    /// Width and height in pixels. A last column or row that is only half in the picture counts whole.
    pub fn size(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            Scale::Full => [width, height],
            Scale::Half => [width.div_ceil(2), height.div_ceil(2)],
        }
    }

    /// The frame's block as passes at this scale read it, of that of the picture: a pixel of the half view is two by two of
    /// the picture's. Powers of two round nothing.
    pub fn block(self, picture: &Frame) -> Frame {
        match self {
            Scale::Full => *picture,
            Scale::Half => Frame {
                pixel_scale: 0.5 * picture.pixel_scale,
                pixel_origin: 0.5 * picture.pixel_origin,
                size: (0.5 * picture.size).ceil(),
                ..*picture
            },
        }
    }

    /// Where a slot's buffer has this block: no device asks for more alignment of a uniform or storage buffer's offset.
    pub fn offset(self) -> u64 {
        BLOCK_STRIDE * self as u64
    }
}

/// Bytes from one block of a slot's buffer to the next.
const BLOCK_STRIDE: u64 = (size_of::<Frame>() as u64).next_multiple_of(256);

/// Bytes of the blocks of all scales.
pub(crate) const BLOCKS: u64 = BLOCK_STRIDE * Scale::ALL.len() as u64;

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use glam::{Vec2, Vec3};

    /// Pixel centres of the half view lie in the middle of four of the picture's.
    #[test]
    fn half_a_view_sees_the_same() {
        let picture = Frame {
            pixel_scale: Vec2::new(310.0, -290.0),
            pixel_origin: Vec2::new(160.0, 121.5),
            size: Vec2::new(321.0, 240.0),
            absorption: Vec3::ONE,
            ..Frame::zeroed()
        };
        let half = Scale::Half.block(&picture);
        assert_eq!(half.size, Vec2::new(161.0, 120.0));
        assert_eq!(Scale::Half.size([321, 240]), [161, 120]);
        let ray = |f: &Frame, pixel: Vec2| (pixel - f.pixel_origin) / f.pixel_scale;
        assert_eq!(ray(&half, Vec2::new(10.5, 7.5)), ray(&picture, Vec2::new(21.0, 15.0)));
        assert_eq!(half.absorption, picture.absorption);
        assert_eq!((Scale::Full.block(&picture), Scale::Full.size([321, 240])), (picture, [321, 240]));
    }
}
