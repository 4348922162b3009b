//! `meniscus info`.

use meniscus::{host::Instance, io::particles::FORMATS};
use std::{error::Error, process::ExitCode};

pub fn run() -> Result<ExitCode, Box<dyn Error>> {
    println!("meniscus {}", env!("CARGO_PKG_VERSION"));
    println!("\nParticle files (read)");
    for (extension, what) in FORMATS {
        println!("  .{extension:<5} {what}");
    }
    println!(
        "\nImages\n  .hdr .exr .png  environment maps, equirectangular (read)\n  .png .exr       pictures: sRGB in 8 bits, linear float (written)"
    );
    println!("  .npy .npz .json dumps and statistics (written)");
    let instance = Instance::new(false)?;
    let devices = instance.devices()?;
    println!("\nDevices, best first");
    for d in &devices {
        println!("  {}\n    {}, {}, Vulkan {}", d.name, d.kind, d.driver, d.api);
        println!(
            "    largest image {} px, largest point {} px (large points: {})",
            d.image_size,
            d.point_size,
            yes(d.large_points)
        );
        println!("    pass timings: {}", yes(d.timestamps));
        println!("    usable: {}", d.refusal.as_deref().unwrap_or("yes"));
    }
    // The same error as `render` would give, where there is nothing to render on.
    instance.pick(None)?;
    Ok(ExitCode::SUCCESS)
}

fn yes(b: bool) -> &'static str {
    if b { "yes" } else { "no" }
}
