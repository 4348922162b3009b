//! `meniscus info`.

mod contents;

use crate::{options::parse_time, terminal::line};
use meniscus::{
    host::Instance,
    io::{Budget, particles::FORMATS},
};
use std::{error::Error, path::PathBuf, process::ExitCode};

#[derive(clap::Args)]
pub struct Args {
    /// Particle files to describe; needs no Vulkan
    files: Vec<PathBuf>,
    /// Describe them as a JSON list
    #[arg(long, requires = "files")]
    json: bool,
    /// Of .pvd files the time step at this time, or the last before it
    #[arg(long, value_name = "TIME", requires = "files", allow_negative_numbers = true, value_parser = parse_time)]
    time: Option<f64>,
    /// Memory that reading a file may take
    #[arg(long, value_name = "BYTES", default_value_t, requires = "files")]
    max_memory: Budget,
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    if !args.files.is_empty() {
        return contents::run(args);
    }
    line(format!("meniscus {}", env!("CARGO_PKG_VERSION")))?;
    line("")?;
    line("Particle files (read)")?;
    for (extension, what) in FORMATS {
        line(format!("  .{extension:<5} {what}"))?;
    }
    line("")?;
    line("Images")?;
    line("  .hdr .exr .png  environment maps, equirectangular (read)")?;
    line("  .png .exr       pictures: sRGB in 8 bits, linear float (written)")?;
    line("  .npy .npz .json dumps and statistics (written)")?;
    let instance = Instance::new(false)?;
    let devices = instance.devices()?;
    line("")?;
    line("Devices, best first")?;
    for d in &devices {
        line(format!("  {}", d.name))?;
        line(format!("    {}, {}, Vulkan {}", d.kind, d.driver, d.api))?;
        line(format!(
            "    {:.1} GB of memory, largest image {} px, largest point {} px (large points: {})",
            d.memory as f64 * 1e-9,
            d.image_size,
            d.point_size,
            yes(d.large_points)
        ))?;
        line(format!("    pass timings: {}", yes(d.timestamps)))?;
        line(format!("    usable: {}", d.refusal.as_deref().unwrap_or("yes")))?;
    }
    // The same error as `render` would give, where there is nothing to render on.
    instance.pick(None)?;
    Ok(ExitCode::SUCCESS)
}

fn yes(b: bool) -> &'static str {
    if b { "yes" } else { "no" }
}
