//! One page with everything in it: charts, tables, pictures, error maps, and how it was measured.

use super::{Args, Charted, points::Point, store::Store, times};
use crate::{options, outputs::OutputError, report};
use base64::{Engine, engine::general_purpose::STANDARD};
use std::{fmt::Write as _, fs, path::Path};

/// Text as HTML shows it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn inlined(path: &Path) -> Result<String, OutputError> {
    let bytes = fs::read(path).map_err(|source| OutputError::Write { path: path.into(), source })?;
    Ok(format!("data:image/png;base64,{}", STANDARD.encode(bytes)))
}

pub fn page(
    all: &[Charted],
    charts: &[String],
    store: &Store,
    device: &str,
    args: &Args,
) -> Result<String, OutputError> {
    let mut text = String::new();
    let mut add = |part: &str| text.push_str(part);
    add(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>meniscus: speed against accuracy</title><style>\n",
    );
    add(include_str!("page.css"));
    add("</style></head><body>\n<h1>Speed against accuracy</h1>\n");
    add(&protocol(all, device, args));
    for (one, chart) in all.iter().zip(charts) {
        add(&format!("<h2>{}</h2>\n", escaped(&one.name)));
        // Without the prolog that stands before a file of its own.
        add(chart.find("<svg").map_or("", |at| &chart[at..]));
        add(&width(one));
        add(&table(one));
        add(&comparison(one, store)?);
        add(&error_maps(one, store)?);
        add(&passes(one));
    }
    add("<script>\n");
    add(include_str!("page.js"));
    add("</script></body></html>\n");
    Ok(text)
}

fn protocol(all: &[Charted], device: &str, args: &Args) -> String {
    let samples = all.first().map_or(0, |one| one.truth_samples);
    format!(
        "<p>Device: {}. meniscus {} ({}). Times are GPU timestamps, summed over a frame's passes: {} rounds in which each way to draw \
         has its turn, one frame that does not count and {} that do; median, 5th and 95th percentile. Errors are FLIP against a \
         path-traced truth ({samples} samples a pixel) over the pixels where it has liquid.</p>\n<p class=\"note\">{}</p>\n",
        escaped(device),
        env!("CARGO_PKG_VERSION"),
        report::COMMIT,
        args.rounds,
        args.frames,
        escaped(&options::command().join(" "))
    )
}

fn width(one: &Charted) -> String {
    let each: Vec<_> = one.width.iter().map(|(other, error)| format!("{error:.3} ({other})")).collect();
    let wide = if each.is_empty() { "not measured".into() } else { each.join(", ") };
    format!(
        "<p>The truth: mesh {}, noise (relative MSE) {:.1e}. Its width, the FLIP of other surfaces of the same particles: \
         {wide}. What is within it is called that, not better.</p>\n",
        escaped(&one.mesh),
        one.noise
    )
}

fn table(one: &Charted) -> String {
    let mut text = "<table><tr><th>way</th><th>ms</th><th>5 %</th><th>95 %</th><th>FLIP</th><th>HDR-FLIP</th><th>relative MSE</th>\
                    <th>SSIM</th><th>FLIP, picture</th><th>silhouette</th><th>depth, r</th><th>|depth|, r</th><th>normal, degrees</th>\
                    <th>light model</th><th>search missed, %</th><th>off, degrees</th><th>MB</th><th></th></tr>\n"
        .to_owned();
    for (i, (_, p)) in one.points.iter().enumerate() {
        let [median, low, high] = times(p);
        let front = one.front.contains(&i);
        let inside = one.widest().is_some_and(|w| p.liquid.flip <= w);
        let notes = [(front, "front"), (inside, "within the truth's width")];
        let notes: Vec<_> = notes.iter().filter(|n| n.0).map(|n| n.1).collect();
        let digits = [3, 2, 2, 1, 4, 1, 3];
        let figures =
            p.surface_figures().into_iter().chain(p.light_figures().into_iter().take(1)).chain(p.search_figures());
        let figures = figures.zip(digits).map(|(v, n)| v.map_or("-".into(), |v| format!("{v:.n$}")));
        let figures: String = figures.map(|v| format!("<td>{v}</td>")).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "<tr class=\"{}\"><td>{}</td><td>{median:.2}</td><td>{low:.2}</td><td>{high:.2}</td><td>{:.4}</td><td>{}</td><td>{:.3e}</td>\
             <td>{:.4}</td><td>{:.4}</td>{figures}<td>{:.1}</td><td class=\"inside\">{}</td></tr>",
            if front { "front" } else { "" },
            escaped(&p.name()),
            p.liquid.flip,
            p.liquid.flip_hdr.map_or("-".into(), |v| format!("{v:.4}")),
            p.liquid.relative_mse,
            p.liquid.ssim,
            p.picture.flip,
            p.memory as f64 * 1e-6,
            notes.join(", ")
        );
    }
    text + "</table>\n<p class=\"note\">Of the method's own first surface against the truth's: IoU of the silhouettes; medians of the depth's \
            error in particle radii (positive: behind), of its absolute value, and of the angle between normals. Light model: FLIP of \
            the method's optics alone, traced exactly on the truth's surface. Search: how many of the walks end more than a degree \
            from where an exact search in the method's own maps or field ends, and by how much in the median.</p>\n"
}

/// The pair of points of two methods that are nearest by `apart`; of one method's own where there is no other.
fn nearest(points: &[(String, Point)], apart: impl Fn(&Point, &Point) -> f64) -> Option<(usize, usize)> {
    let several = points.iter().any(|(_, p)| p.method != points[0].1.method);
    let pairs = (0..points.len()).flat_map(|i| (i + 1..points.len()).map(move |j| (i, j)));
    let fit = pairs.filter(|(i, j)| !several || points[*i].1.method != points[*j].1.method);
    fit.min_by(|a, b| {
        let of = |(i, j): &(usize, usize)| apart(&points[*i].1, &points[*j].1);
        of(a).total_cmp(&of(b))
    })
}

fn comparison(one: &Charted, store: &Store) -> Result<String, OutputError> {
    let option = |key: &str, name: &str| format!("<option value=\"{key}\">{}</option>", escaped(name));
    let mut choices = option(&one.truth_key, "the truth");
    one.points.iter().for_each(|(key, p)| choices += &option(key, &p.name()));
    let first = one.points.first().map_or(&one.truth_key, |p| &p.0);
    let selected = choices.replacen(&format!("value=\"{first}\""), &format!("value=\"{first}\" selected"), 1);
    let button = |left: &str, right: &str, name: String| {
        format!("<button data-left=\"{left}\" data-right=\"{right}\">{}</button>", escaped(&name))
    };
    let mut buttons = button(&one.truth_key, first, "truth".into());
    let pairs = [
        ("equal time", nearest(&one.points, |a, b| (times(a)[0].max(1e-9) / times(b)[0].max(1e-9)).ln().abs())),
        ("equal error", nearest(&one.points, |a, b| (a.liquid.flip - b.liquid.flip).abs())),
    ];
    for (what, pair) in pairs {
        let Some((i, j)) = pair else { continue };
        let ((left, a), (right, b)) = (&one.points[i], &one.points[j]);
        let figures = |p: &Point| format!("{} ({:.1} ms, {:.3})", p.name(), times(p)[0], p.liquid.flip);
        buttons += &button(left, right, format!("{what}: {} | {}", figures(a), figures(b)));
    }
    let mut text = format!(
        "<h3>Pictures</h3><div class=\"comparison\"><div class=\"choose\"><select>{choices}</select> | <select>{selected}</select>\
         {buttons}</div><div class=\"slider\"><img class=\"under\" alt=\"left\"><img class=\"over\" alt=\"right\"><div class=\"bar\">\
         </div></div></div>\n<div hidden>"
    );
    for key in one.points.iter().map(|(key, _)| key).chain([&one.truth_key]) {
        text += &format!("<img data-key=\"{key}\" alt=\"\" src=\"{}\">\n", inlined(&store.picture(key))?);
    }
    Ok(text + "</div>\n")
}

fn error_maps(one: &Charted, store: &Store) -> Result<String, OutputError> {
    let mut text = "<h3>Error maps (FLIP: dark is none, bright is 1)</h3><div class=\"maps\">".to_owned();
    for (key, p) in &one.points {
        let caption = format!("{}: {:.4}", escaped(&p.name()), p.liquid.flip);
        let map = inlined(&store.error_map(key))?;
        text += &format!("<figure><img alt=\"\" src=\"{map}\"><figcaption>{caption}</figcaption></figure>\n");
    }
    Ok(text + "</div>\n")
}

fn passes(one: &Charted) -> String {
    let mut text = "<h3>Passes, median milliseconds</h3>\n".to_owned();
    for (_, p) in &one.points {
        text += &format!("<details><summary>{}: {:.2}</summary><table>", escaped(&p.name()), times(p)[0]);
        for (name, all) in p.passes() {
            text += &format!("<tr><td>{}</td><td>{:.3}</td></tr>", escaped(&name), report::quantile(&all, 0.5));
        }
        text += "</table></details>\n";
    }
    text
}
