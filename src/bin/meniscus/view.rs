//! `meniscus view`: a window. Whatever `render` is asked for is asked for here, too, with the same options; what is seen is what
//! it would write.

mod adjust;
mod error;
mod events;
mod frames;
mod keys;
mod navigate;
mod pane;
mod panel;
mod player;
mod swapchain;
mod text;
mod viewer;
mod written;

use crate::{choices, on, options::Options, scene::Prepare, terminal, validated};
use error::ViewError;
use events::{Events, Opener};
use frames::Frames;
use meniscus::host::{DeviceInfo, Gpu, Instance};
use player::{Clock, Player};
use std::{error::Error, path::PathBuf, process::ExitCode, time::Duration};
use swapchain::Surface;
use viewer::{Start, Viewer};
use winit::{
    dpi::PhysicalSize,
    event_loop::EventLoop,
    platform::pump_events::{EventLoopExtPumpEvents, PumpStatus},
    window::{Window, WindowAttributes},
};

#[derive(clap::Args)]
pub struct Args {
    /// Particle files, to be played in this order (`meniscus info` lists formats); without any, an embedded dam break
    pub files: Vec<PathBuf>,
    #[command(flatten)]
    pub options: Options,
    /// Split the window: this method at the right
    #[arg(long, value_name = "PRESET", value_parser = choices::presets())]
    pub beside: Option<String>,
    /// Files a second
    #[arg(long, value_name = "N", default_value_t = 24.0, value_parser = parse_rate)]
    pub fps: f64,
    /// Folder for pictures and scene files (F2, F3)
    #[arg(short, long, value_name = "DIR", default_value = ".")]
    pub output: PathBuf,
    /// Run with core and synchronization validation; any message is an error
    #[arg(long)]
    pub validate: bool,
}

fn parse_rate(s: &str) -> Result<f64, String> {
    let rate = s.parse().ok().filter(|rate| (0.5..=240.0).contains(rate));
    rate.ok_or_else(|| format!("\"{}\" is not 0.5 to 240", terminal::plain(s)))
}

/// How long the window is left alone after it took no image.
const PATIENCE: Duration = Duration::from_millis(20);

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let mut picture = args.options.over(args.options.base()?, None)?;
    picture.prepare.get_or_insert(Prepare::Cpu);
    picture.validate()?;
    written::next(&args.output)?;
    let environment = picture.environment()?;
    let mut files: Vec<_> = args.files.iter().cloned().map(Some).collect();
    if files.is_empty() {
        files.push(picture.particles.clone());
    }
    let start = Start {
        beside: args.beside.as_deref().and_then(choices::preset).map(|p| p.method()),
        clock: Clock::new(files.len(), args.fps),
        folder: args.output.clone(),
        picture: picture.clone(),
    };

    let mut event_loop = EventLoop::new().map_err(|e| ViewError::NoDisplay(error::without_place(&e.to_string())))?;
    let wake = event_loop.create_proxy();
    let player = Player::new(files, picture.clone(), move || _ = wake.send_event(()));
    let window = open(&mut event_loop, picture.size)?;
    let instance = Instance::with(args.validate, &swapchain::extensions(&window)?)?;
    let surface = Surface::new(&instance, &window)?;
    let device = surface.pick(&instance, args.options.device.as_deref())?;
    terminal::progress(format!("device: {} ({})", device.name, device.driver));
    let shown = show(&mut event_loop, &instance, device.clone(), &window, &surface, (start, environment, player));
    drop(surface);
    shown.map_err(on(&device))?;
    Ok(validated(&instance))
}

/// A window of this size, if the display gives it.
fn open(event_loop: &mut EventLoop<()>, [width, height]: [u32; 2]) -> Result<Window, ViewError> {
    let attributes =
        WindowAttributes::default().with_title("meniscus").with_inner_size(PhysicalSize::new(width, height));
    let mut opener = Opener { attributes, made: None };
    for _ in 0..100 {
        event_loop.pump_app_events(Some(PATIENCE), &mut opener);
        match opener.made.take() {
            Some(made) => return made.map_err(|e| ViewError::NoDisplay(error::without_place(&e))),
            None => continue,
        }
    }
    Err(ViewError::NoDisplay("the display gives none".into()))
}

/// Shows everything until it is closed.
fn show(
    event_loop: &mut EventLoop<()>,
    instance: &Instance,
    device: DeviceInfo,
    window: &Window,
    surface: &Surface,
    (start, environment, player): (Start, meniscus::Equirect, Player),
) -> Result<(), Box<dyn Error>> {
    let gpu = Gpu::presenting(instance, device)?;
    let frames = Frames::new(&gpu, surface)?;
    let mut viewer = Viewer::new(&gpu, frames, start, environment, player)?;
    viewer.scale = window.scale_factor();
    let mut events = Events::new(viewer, window);
    let mut wait = Some(Duration::ZERO);
    while !events.viewer.over {
        if let PumpStatus::Exit(_) = event_loop.pump_app_events(wait, &mut events) {
            break;
        }
        if let Some(e) = events.failed.take() {
            return Err(e.into());
        }
        events.tick();
        let mut taken = true;
        let viewer = &mut events.viewer;
        if (viewer.dirty || viewer.rewritten) && !viewer.over {
            taken = viewer.draw(events.size)?;
        }
        let waits = !taken || viewer.awaits_times();
        wait = if taken && (viewer.dirty || viewer.rewritten || events.moves()) {
            Some(PATIENCE / 5)
        } else {
            // A file that is ready wakes it, and whatever is done to the window.
            waits.then_some(PATIENCE)
        };
    }
    Ok(())
}
