//! `meniscus compare`: how far a picture is from a reference.

use crate::{options, outputs, terminal};
use meniscus::{
    io::{
        Budget,
        images::{self, read_picture},
        particles::read_array,
    },
    study::measures::{self, DARK, Linear, Means},
};
use serde_json::json;
use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

#[derive(clap::Args)]
pub struct Args {
    /// What is right: .exr, .hdr (linear) or .png (sRGB)
    pub reference: PathBuf,
    /// What is measured, of the same size
    pub picture: PathBuf,
    /// Where the liquid is: a .npy array (finite and not 0: `depth.npy` of a truth or a dump) or a .png (brighter than half)
    #[arg(long, value_name = "FILE")]
    pub mask: Option<PathBuf>,
    /// Folder for maps of each measure, as .png
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Most memory that reading one file may take, with K, M, G or T
    #[arg(long, value_name = "SIZE", default_value_t = Budget::default())]
    pub max_memory: Budget,
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let mut inputs = vec![("the reference", args.reference.as_path()), ("the picture", args.picture.as_path())];
    inputs.extend(args.mask.as_deref().map(|p| ("the mask (--mask)", p)));
    let outputs: Vec<_> = args.json.as_deref().map(|p| ("the figures (--json)", p)).into_iter().collect();
    outputs::check(&outputs, None, &inputs)?;
    let read = |path: &Path| read_picture(path, &args.max_memory).map(|(size, pixels)| Linear { size, pixels });
    let (reference, picture) = (read(&args.reference)?, read(&args.picture)?);
    let mask = args.mask.as_deref().map(|path| read_mask(path, reference.size, &args.max_memory)).transpose()?;
    let maps = measures::compare(&reference, &picture)?;
    let whole = maps.means(None)?;
    let liquid = mask.as_deref().map(|m| maps.means(Some(m))).transpose()?;
    if let Some(folder) = &args.output {
        outputs::folder(folder)?;
        for (name, map) in measures::on_scale(&maps) {
            let path = folder.join(format!("{name}.png"));
            outputs::write(&path, &images::encode_srgb_png(&path, reference.size, &measures::magma(&map))?)?;
        }
    }
    if let Some(path) = &args.json {
        let record = json!({
            "meniscus": env!("CARGO_PKG_VERSION"),
            "command": options::command(),
            "size": reference.size,
            "picture": whole,
            "liquid": liquid,
            "meaning": {
                "flip": "mean FLIP of what a screen shows, 67 pixels a degree; flip_hdr: HDR-FLIP, null for a black reference",
                "relative_mse": format!("mean over pixels and channels of (a - b)^2 / (b^2 + {DARK}), linear light, b the reference"),
                "ssim": "mean over sRGB channels and over pixels whose window of 11 pixels is within the picture",
            },
        });
        outputs::write(path, format!("{record:#}\n").as_bytes())?;
    }
    terminal::line(format!(
        "{:<8} {:>9} {:>10} {:>12} {:>9} {:>10}",
        "", "FLIP", "HDR-FLIP", "relative MSE", "SSIM", "pixels"
    ))?;
    terminal::line(row("picture", &whole))?;
    if let Some(liquid) = &liquid {
        terminal::line(row("liquid", liquid))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn row(name: &str, m: &Means) -> String {
    let hdr = m.flip_hdr.map_or("-".into(), |v| format!("{v:.5}"));
    format!("{name:<8} {:>9.5} {hdr:>10} {:>12.4e} {:>9.5} {:>10}", m.flip, m.relative_mse, m.ssim, m.pixels)
}

/// A mask of a picture's size.
fn read_mask(path: &Path, [width, height]: [u32; 2], budget: &Budget) -> Result<Vec<bool>, Box<dyn Error>> {
    let is_array = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"));
    let (size, mask) = if is_array {
        let bytes = fs::read(path).map_err(|e| format!("{}: cannot be read ({e}); check the path", path.display()))?;
        let (shape, values) = read_array(path, &bytes, budget)?;
        let [h, w] = shape[..] else {
            return Err(format!("{}: a mask is height x width, and this is {shape:?}", path.display()).into());
        };
        ([w, h], values.iter().map(|v| v.is_finite() && *v != 0.0).collect::<Vec<_>>())
    } else {
        let (size, pixels) = read_picture(path, budget)?;
        // Half of full brightness is 0.2140 in linear light.
        (size.map(u64::from), pixels.iter().map(|p| p.iter().sum::<f32>() > 3.0 * 0.214).collect())
    };
    if size != [u64::from(width), u64::from(height)] {
        let [w, h] = size;
        return Err(format!(
            "{}: the mask is {w}x{h}, the reference {width}x{height}: make both at one size",
            path.display()
        )
        .into());
    }
    Ok(mask)
}
