//! Letters for charts in pixels: plotters draws text only with outline fonts, which would have to come from somewhere, and these
//! bitmap fonts are part of a crate.

use embedded_graphics::{
    mono_font::{MonoFont, MonoTextStyle, iso_8859_1 as fonts},
    pixelcolor::BinaryColor,
    prelude::*,
    text::{Baseline, Text},
};
use plotters::backend::BitMapBackend;
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontTransform,
    text_anchor::{HPos, VPos},
};
use std::convert::Infallible;

/// A picture in memory with letters.
pub struct Lettered<'a>(pub BitMapBackend<'a>);

/// The font nearest to a size in pixels.
fn font(size: f64) -> &'static MonoFont<'static> {
    match size {
        s if s < 17.0 => &fonts::FONT_7X13,
        _ => &fonts::FONT_9X18,
    }
}

fn extent(text: &str, font: &MonoFont) -> (i32, i32) {
    let [width, height] = [font.character_size.width, font.character_size.height].map(|n| n as i32);
    (width * text.chars().count() as i32, height)
}

/// Pixels of letters, from the upper left corner of their line.
struct Pixels(Vec<(i32, i32)>);

impl OriginDimensions for Pixels {
    fn size(&self) -> Size {
        Size::new(u32::MAX / 2, u32::MAX / 2)
    }
}

impl DrawTarget for Pixels {
    type Color = BinaryColor;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<BinaryColor>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        self.0.extend(pixels.into_iter().filter(|p| p.1.is_on()).map(|p| (p.0.x, p.0.y)));
        Ok(())
    }
}

impl DrawingBackend for Lettered<'_> {
    type ErrorType = <BitMapBackend<'static> as DrawingBackend>::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        self.0.get_size()
    }

    fn ensure_prepared(&mut self) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.0.ensure_prepared()
    }

    fn present(&mut self) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.0.present()
    }

    fn draw_pixel(&mut self, at: BackendCoord, color: BackendColor) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.0.draw_pixel(at, color)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.0.draw_rect(from, to, style, fill)
    }

    fn draw_text<S: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &S,
        at: BackendCoord,
    ) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        let font = font(style.size());
        let mut letters = Pixels(Vec::new());
        let look = MonoTextStyle::new(font, BinaryColor::On);
        let drawn = Text::with_baseline(text, Point::zero(), look, Baseline::Top).draw(&mut letters);
        drawn.unwrap_or_else(|never: Infallible| match never {});
        let (width, height) = extent(text, font);
        let anchor = style.anchor();
        let left = match anchor.h_pos {
            HPos::Left => 0,
            HPos::Center => width / 2,
            HPos::Right => width,
        };
        let top = match anchor.v_pos {
            VPos::Top => 0,
            VPos::Center => height / 2,
            VPos::Bottom => height,
        };
        for (x, y) in letters.0 {
            let (x, y) = (x - left, y - top);
            let (x, y) = match style.transform() {
                FontTransform::None => (x, y),
                FontTransform::Rotate90 => (-y, x),
                FontTransform::Rotate180 => (-x, -y),
                FontTransform::Rotate270 => (y, -x),
            };
            self.0.draw_pixel((at.0 + x, at.1 + y), style.color())?;
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Self::ErrorType>> {
        let (width, height) = extent(text, font(style.size()));
        Ok((width as u32, height as u32))
    }
}
