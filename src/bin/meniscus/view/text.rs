//! Text and bars on opaque sheets: drawn here, copied over the picture. A font of fixed width from the crate that charts are
//! labelled with already; a toolkit with its own renderer would be some twenty crates more for the same lines.

use ash::vk;
use embedded_graphics::{
    mono_font::{MonoFont, MonoTextStyleBuilder, iso_8859_1},
    pixelcolor::{Rgb888, RgbColor},
    prelude::{DrawTarget, OriginDimensions, Pixel, Point, Size},
    primitives::Rectangle,
    text::{Baseline, Text},
};
use std::convert::Infallible;

/// A colour as it is written to an sRGB image.
pub type Color = Rgb888;

pub const GROUND: Color = Color::new(20, 24, 30);
pub const PLAIN: Color = Color::new(214, 220, 228);
pub const QUIET: Color = Color::new(130, 142, 158);
pub const TITLE: Color = Color::new(120, 190, 255);
pub const CHOSEN: Color = Color::new(46, 74, 110);
pub const BAD: Color = Color::new(255, 140, 120);

/// An image to be copied to the window.
pub struct Sheet {
    pub size: [u32; 2],
    /// Four bytes a pixel, in the order of the window's format.
    pub bytes: Vec<u8>,
    blue_first: bool,
}

impl Sheet {
    pub fn new(size: [u32; 2], format: vk::Format) -> Sheet {
        let blue_first = format == vk::Format::B8G8R8A8_SRGB;
        let mut sheet = Sheet { size, bytes: vec![255; 4 * size[0] as usize * size[1] as usize], blue_first };
        sheet.bar([0, 0], size, GROUND);
        sheet
    }

    /// Fills a rectangle at a corner.
    pub fn bar(&mut self, at: [u32; 2], size: [u32; 2], color: Color) {
        let area = Rectangle::new(Point::new(at[0] as i32, at[1] as i32), Size::new(size[0], size[1]));
        let Ok(()) = self.fill_solid(&area, color);
    }

    /// Writes one line; what does not fit is cut off.
    pub fn line(&mut self, at: [u32; 2], text: &str, color: Color, font: &MonoFont) {
        let style = MonoTextStyleBuilder::new().font(font).text_color(color).build();
        let line = Text::with_baseline(text, Point::new(at[0] as i32, at[1] as i32), style, Baseline::Top);
        let Ok(_) = embedded_graphics::Drawable::draw(&line, self);
    }
}

/// A font that can be read on a screen of so many pixels a point.
pub fn font(scale: f64) -> &'static MonoFont<'static> {
    if scale > 1.4 { &iso_8859_1::FONT_10X20 } else { &iso_8859_1::FONT_7X13 }
}

impl OriginDimensions for Sheet {
    fn size(&self) -> Size {
        Size::new(self.size[0], self.size[1])
    }
}

impl DrawTarget for Sheet {
    type Color = Color;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Color>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        let [width, height] = self.size.map(|s| s as i32);
        for Pixel(p, c) in pixels {
            if (0..width).contains(&p.x) && (0..height).contains(&p.y) {
                let at = 4 * (p.y as usize * width as usize + p.x as usize);
                let [r, g, b] = [c.r(), c.g(), c.b()];
                let texel = if self.blue_first { [b, g, r] } else { [r, g, b] };
                self.bytes[at..at + 3].copy_from_slice(&texel);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_where_they_should_be_in_the_order_of_the_format() {
        for (format, first) in [(vk::Format::B8G8R8A8_SRGB, BAD.b()), (vk::Format::R8G8B8A8_SRGB, BAD.r())] {
            let mut sheet = Sheet::new([20, 16], format);
            let ground = sheet.bytes.clone();
            sheet.line([2, 1], "II and more than fits", BAD, font(1.0));
            let lit: Vec<usize> =
                (0..20 * 16).filter(|i| sheet.bytes[4 * i..4 * i + 4] != ground[4 * i..4 * i + 4]).collect();
            assert!(lit.len() > 20 && lit.iter().all(|i| i % 20 >= 2 && (1..15).contains(&(i / 20))), "{lit:?}");
            assert!(lit.iter().all(|i| sheet.bytes[4 * i] == first && sheet.bytes[4 * i + 3] == 255));
        }
    }
}
