//! A case's curves: one for each method, and its bound.

use super::Run;
use meniscus::study::stress::Case;
use plotters::prelude::*;
use std::error::Error;

const SIZE: (u32, u32) = (720, 420);

/// One measure of a case over its steps, as SVG; nothing where no method has such a figure, or all are nothing.
pub fn draw(case: &Case, measure: usize, runs: &[&Run]) -> Result<Option<String>, Box<dyn Error>> {
    let bound = case.measures[measure].bound;
    let line = |run: &Run| -> Vec<(f64, f64)> {
        run.steps.iter().filter_map(|s| Some((s.x, s.found[measure].filter(|f| f.is_finite())?))).collect()
    };
    let lines: Vec<_> = runs.iter().map(|r| (r.method, line(r))).filter(|(_, l)| !l.is_empty()).collect();
    let xs: Vec<f64> = runs.iter().flat_map(|r| r.steps.iter().map(|s| s.x)).collect();
    let (low, high) = xs.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    let top = lines.iter().flat_map(|(_, l)| l.iter().map(|p| p.1)).fold(0.0, f64::max);
    if lines.is_empty() || top == 0.0 {
        return Ok(None);
    }
    // Steps that multiply are shown as their exponents of ten.
    let by_powers = low > 0.0 && high / low > 1000.0;
    let place = |x: f64| if by_powers { x.log10() } else { x };
    let room = ((place(high) - place(low)) * 0.03).max(1e-3);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(format!("{}: {}", case.name, case.measures[measure].name), ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(
                place(low) - room..place(high) + room,
                0.0..1.08 * if bound.is_finite() { top.max(bound) } else { top },
            )?;
        let what = if by_powers { format!("log10 of {}", case.x) } else { case.x.to_owned() };
        chart.configure_mesh().x_desc(what).light_line_style(WHITE).label_style(("sans-serif", 13)).draw()?;
        let ends = [(place(low) - room, bound), (place(high) + room, bound)];
        if bound.is_finite() {
            chart
                .draw_series(DashedLineSeries::new(ends, 6, 4, BLACK.stroke_width(1)))?
                .label("bound")
                .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], BLACK));
        }
        for (i, (method, points)) in lines.iter().enumerate() {
            let color = Palette99::pick(i).to_rgba();
            let points: Vec<_> = points.iter().map(|(x, y)| (place(*x), *y)).collect();
            chart
                .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))?
                .label(*method)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
            chart.draw_series(points.iter().map(|p| Circle::new(*p, 3, color.filled())))?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .label_font(("sans-serif", 13))
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        area.present()?;
    }
    Ok(Some(svg))
}
