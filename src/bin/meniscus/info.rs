//! `meniscus info`.

use crate::terminal::line;
use meniscus::{host::Instance, io::particles::FORMATS};
use std::{error::Error, process::ExitCode};

pub fn run() -> Result<ExitCode, Box<dyn Error>> {
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
