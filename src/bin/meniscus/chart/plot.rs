//! The chart itself: time across, error upwards, the front that nothing beats, and how wide the truth is.

use super::{Charted, lettered::Lettered, times};
use plotters::{coord::Shift, prelude::*};
use std::error::Error;

/// Width and height in pixels.
const SIZE: (u32, u32) = (1100, 700);
const FONT: &str = "sans-serif";
/// Colours that people who see fewer of them tell apart (Okabe and Ito 2008).
const COLORS: [RGBColor; 10] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
    RGBColor(200, 0, 40),
    RGBColor(130, 80, 30),
    RGBColor(110, 60, 170),
];

/// Why a chart could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("{scene}: its chart cannot be drawn ({detail}); measure it with other methods")]
pub struct PlotError {
    scene: String,
    detail: String,
}

fn failed<'a>(one: &'a Charted) -> impl Fn(Box<dyn Error>) -> PlotError + 'a {
    |e| PlotError { scene: one.name.clone(), detail: e.to_string() }
}

/// As SVG.
pub fn svg(one: &Charted) -> Result<String, PlotError> {
    let mut text = String::new();
    draw(SVGBackend::with_string(&mut text, SIZE).into_drawing_area(), one).map_err(failed(one))?;
    Ok(text)
}

/// As pixels: width and height, and sRGB row by row.
pub fn pixels(one: &Charted) -> Result<([u32; 2], Vec<[u8; 3]>), PlotError> {
    let mut bytes = vec![0; 3 * SIZE.0 as usize * SIZE.1 as usize];
    let canvas = Lettered(BitMapBackend::with_buffer(&mut bytes, SIZE));
    draw(canvas.into_drawing_area(), one).map_err(failed(one))?;
    Ok(([SIZE.0, SIZE.1], bytes.as_chunks::<3>().0.to_vec()))
}

/// Methods in the order in which they come.
fn methods(one: &Charted) -> Vec<&str> {
    let mut all: Vec<&str> = Vec::new();
    for (_, p) in &one.points {
        if !all.contains(&p.method.as_str()) {
            all.push(&p.method);
        }
    }
    all
}

fn draw<B: DrawingBackend>(canvas: DrawingArea<B, Shift>, one: &Charted) -> Result<(), Box<dyn Error>>
where
    B::ErrorType: 'static,
{
    canvas.fill(&WHITE)?;
    let at: Vec<[f64; 2]> = one.points.iter().map(|(_, p)| [times(p)[0], p.liquid.flip]).collect();
    let bound = |axis: usize, pick: fn(f64, f64) -> f64| at.iter().map(|p| p[axis]).reduce(pick).unwrap_or(1.0);
    let (fastest, slowest) = (bound(0, f64::min).max(1e-4), bound(0, f64::max).max(1e-4));
    let worst = bound(1, f64::max).max(one.widest().unwrap_or(0.0)).max(1e-3);
    // Beyond the slowest there is room for the list of methods.
    let left = 0.8 * fastest;
    let right = 1.6 * slowest * (slowest / left).powf(0.2);
    let title = format!("{}: {} particles, {}x{}", one.name, one.particles, one.size[0], one.size[1]);
    let mut chart = ChartBuilder::on(&canvas)
        .caption(title, (FONT, 20))
        .margin(16)
        .x_label_area_size(48)
        .y_label_area_size(90)
        .build_cartesian_2d((left..right).log_scale().with_key_points(ticks(left, right)), 0.0..1.15 * worst)?;
    chart
        .configure_mesh()
        .x_desc("milliseconds a frame, median of GPU timestamps")
        .y_desc("FLIP against the truth, over the liquid")
        .light_line_style(WHITE)
        .x_label_formatter(&|v| short(*v))
        .label_style((FONT, 14))
        .axis_desc_style((FONT, 16))
        .draw()?;
    if let Some(widest) = one.widest() {
        let band = Rectangle::new([(left, 0.0), (right, widest)], RGBColor(225, 232, 240).filled());
        chart
            .draw_series([band])?
            .label("truth's width")
            .legend(|(x, y)| Rectangle::new([(x, y - 5), (x + 16, y + 5)], RGBColor(225, 232, 240).filled()));
        for (other, error) in &one.width {
            chart.draw_series([PathElement::new([(left, *error), (right, *error)], RGBColor(150, 165, 180))])?;
            let name = format!("same particles, {other}");
            chart.draw_series([Text::new(
                name,
                (left * 1.01, *error),
                (FONT, 13).into_font().color(&RGBColor(90, 105, 120)),
            )])?;
        }
    }
    let steps = one.front.iter().map(|i| at[*i]).scan(None, |above, [x, y]| {
        let corner = above.replace(y).map(|above| (x, above));
        Some([corner, Some((x, y))].into_iter().flatten().collect::<Vec<_>>())
    });
    let mut steps: Vec<_> = steps.flatten().collect();
    steps.extend(steps.last().map(|last| (right, last.1)));
    chart
        .draw_series([PathElement::new(steps, BLACK.stroke_width(2))])?
        .label("nothing beats it")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], BLACK.stroke_width(2)));
    for (k, method) in methods(one).into_iter().enumerate() {
        let color = COLORS[k % COLORS.len()];
        let own = one.points.iter().zip(&at).filter(|((_, p), _)| p.method == method);
        let spread = own.clone().map(|((_, p), [_, error])| {
            let [_, low, high] = times(p);
            PathElement::new([(low.max(left), *error), (high.min(right), *error)], color)
        });
        chart.draw_series(spread)?;
        let dots = own.map(|((_, p), [ms, error])| {
            Circle::new((*ms, *error), if p.varied.is_empty() { 7 } else { 4 }, color.filled())
        });
        chart.draw_series(dots)?.label(method).legend(move |(x, y)| Circle::new((x + 8, y), 5, color.filled()));
    }
    // In turns above and below, so that neighbours' names do not cover each other.
    for (i, down) in one.front.iter().zip([-20, 8].into_iter().cycle()) {
        let [ms, error] = at[*i];
        let name = EmptyElement::at((ms, error)) + Text::new(one.points[*i].1.name(), (8, down), (FONT, 13));
        chart.draw_series([name])?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font((FONT, 16))
        .draw()?;
    canvas.present()?;
    Ok(())
}

/// Milliseconds to write along the axis: 1, 2 and 5 times powers of ten.
fn ticks(left: f64, right: f64) -> Vec<f64> {
    let decades = left.log10().floor() as i32..=right.log10().ceil() as i32;
    let all = decades.flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(d)));
    all.filter(|t| (left..=right).contains(t)).collect()
}

/// A number with as many digits as a label has room for.
fn short(value: f64) -> String {
    if value >= 10.0 { format!("{value:.0}") } else { format!("{}", (value * 100.0).round() / 100.0) }
}
