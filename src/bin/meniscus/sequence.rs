//! `meniscus sequence`: the frames of a simulation to numbered pictures, of which a finished one is not made again, and films.
//!
//! Three threads: one reads and prepares the next frame, this one has the device draw, one encodes and writes. Each holds one
//! frame, whatever their number.

mod ahead;
mod between;
mod film;
pub mod frames;
mod kept;
mod memory;
mod plan;
mod table;
mod writer;

use crate::{
    compositing::{self, Pixels},
    empty, on,
    options::Options,
    outputs,
    part::Part,
    scene::{self, Scene},
    terminal, validated,
};
use ahead::Ready;
use film::Kind;
use frames::Selection;
use meniscus::{
    host::{Gpu, Instance, Session},
    inspect,
};
use plan::{Exposure, First, Outline, Plan, Shot};
use std::{
    error::Error,
    path::PathBuf,
    process::ExitCode,
    sync::mpsc::{Receiver, SyncSender},
    time::Instant,
};
use table::Row;
use writer::{Message, Writer};

#[derive(clap::Args)]
pub struct Args {
    /// Particle files, one a frame: names, or patterns such as 'frames/*.vtk' in quotation marks; the scene file's `particles`
    /// if none is given. Their order is that of the number in which their names differ; time steps of a .pvd are numbered from 0 in
    /// order of time
    pub inputs: Vec<PathBuf>,
    /// Numbered pictures, .png (sRGB, 8 bits) or .exr (linear, float), `#` for each digit: out/####.png. The numbers are the
    /// inputs'. Or a film: .mp4, .mkv or .webm (by ffmpeg, which has to be installed), .gif, or .png without `#` (animated). May be
    /// given more than once: a film is made anew each time, but of pictures beside it only those that are not there
    #[arg(short, long, required = true, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    #[command(flatten)]
    pub options: Options,
    #[command(flatten)]
    pub compositing: compositing::Compositing,
    /// Only these numbers, such as 10-250 or 10-250:2
    #[arg(long, value_name = "A-B[:STEP]", allow_hyphen_values = true)]
    pub frames: Option<Selection>,
    /// Only the K-th of N parts of these pictures, such as 0/10 to 9/10: parts can be made by several programs at once. Films are left
    /// to a run without this, which makes what is not there; rows of --stats go to a file of the part's own, and that run joins them
    #[arg(long, value_name = "K/N")]
    pub part: Option<Part>,
    /// The eye goes so many degrees around the target over the sequence: 360 is once around, and the end meets the start
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, conflicts_with = "camera")]
    pub turn: Option<f64>,
    /// Pictures a second, of films and of the time that a scene file's keys count in
    #[arg(long, value_name = "RATE", default_value_t = 25.0, value_parser = rate)]
    pub fps: f64,
    /// Simulated seconds from one frame to the next, or `own`: by the times that a .pvd gives its time steps, in seconds. Pictures are
    /// then taken at --fps, between frames too, along paths that the particles' velocities give, and are numbered from 0; without, there
    /// is one of each frame
    #[arg(long, value_name = "SECONDS|own")]
    pub step: Option<between::Step>,
    /// With --step: simulated seconds in a second of the film; 1 if not given, less is slow motion
    #[arg(long, value_name = "N", requires = "step", value_parser = above_zero)]
    pub speed: Option<f64>,
    /// With --step: motion blur, the mean in linear light of so many moments; 1 if not given, which is none
    #[arg(long, value_name = "N", requires = "step", value_parser = clap::value_parser!(u32).range(1..=256))]
    pub subframes: Option<u32>,
    /// With --subframes: the part of a picture's time in which the shutter is open; 0.5 if not given
    #[arg(long, value_name = "SHARE", requires = "subframes", value_parser = above_zero)]
    pub shutter: Option<f64>,
    /// Against particles that flicker between splash and body: the classes of so many frames before a picture's count. One becomes splash
    /// below --splash-threshold, and body again from --keep-class-below on. Particles have to keep their order; where their number
    /// changes it begins anew. Not with --prepare gpu; without it each frame stands for itself, as `render` has it
    #[arg(long, value_name = "FRAMES", value_parser = clap::value_parser!(u32).range(1..=100))]
    pub memory: Option<u32>,
    /// With --memory: the share of a filled body's density from which on splash is body again; a tenth more than --splash-threshold if
    /// not given
    #[arg(long, value_name = "SHARE", requires = "memory", value_parser = above_zero)]
    pub keep_class_below: Option<f64>,
    /// Leave out frames that cannot be read or prepared instead of ending at the first (a film shows the one before them); the
    /// exit code is 1 all the same
    #[arg(long)]
    pub keep_going: bool,
    /// Write a row of counts and times for each picture (.csv); rows of pictures that were there already stay
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Run with core and synchronization validation; any message is an error
    #[arg(long)]
    pub validate: bool,
}

/// Frames that `--keep-going` left out.
#[derive(Debug, thiserror::Error)]
#[error("{failed} of {all} pictures could not be made; the messages above say why")]
struct LeftOut {
    failed: usize,
    all: usize,
}

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let outline = Outline::new(args)?;
    // What a device cannot draw is refused before it is prepared; that there is none is said where one is needed.
    let instance = Instance::new(args.validate);
    let found = instance.as_ref().ok().and_then(|instance| instance.pick(args.options.device.as_deref()).ok());
    let mut plan = outline.plan(found.as_ref())?;
    let first = plan.first.take();
    for (last, next) in plan.frames.gaps().into_iter().take(5) {
        terminal::complain(format!("note: no frames between {last} and {next}"));
    }
    if let Some(note) = between::note(args.step, &plan.frames) {
        terminal::complain(note);
    }
    let all = plan.shots.len();
    let to_do = plan.shots.iter().filter(|s| !s.kept).count();
    if to_do == 0 {
        if all == 0 {
            terminal::progress("nothing to do: there are more parts than pictures");
        } else if plan.films.is_empty() && !plan.stats.as_deref().is_some_and(table::has_parts) {
            terminal::progress(format!("nothing to do: all {all} pictures are there, {}", plan.names()));
        } else {
            make(args, &plan, None, None)?;
            terminal::progress(format!("all {all} pictures are there: {}", plan.names()));
        }
        return Ok(ExitCode::SUCCESS);
    }
    let picture = &plan.shots[0].exposures[0].picture;
    // As fine as the picture that shows least of it needs it.
    let views = plan.shots.iter().flat_map(|s| &s.exposures).map(|e| &e.picture);
    let narrowest = views.min_by(|a, b| a.camera.fov_y.total_cmp(&b.camera.fov_y)).unwrap_or(picture);
    let environment = narrowest.environment()?;
    let instance = instance?;
    let device = instance.pick(args.options.device.as_deref())?;
    terminal::progress(format!("device: {} ({})", device.name, device.driver));
    let there = if to_do < all { format!(", {} of which are there already", all - to_do) } else { String::new() };
    terminal::progress(format!("pictures: {all}{there}"));
    let on_device = on(&device);
    let begin = Instant::now();
    let failed = (|| {
        let gpu = Gpu::new(&instance, device)?;
        let mut session = Session::new(&gpu, picture.rendered_size()?, &environment)?;
        let done = make(args, &plan, Some(&mut session), first);
        session.end();
        done
    })()
    .map_err(on_device)?;
    let code = validated(&instance);
    let made = to_do - failed;
    let rate = made as f64 / begin.elapsed().as_secs_f64();
    terminal::progress(format!("wrote {made} pictures, {rate:.2} a second: {}", plan.names()));
    if failed > 0 {
        return Err(LeftOut { failed, all }.into());
    }
    Ok(code)
}

/// Makes what is not there; says how many pictures could not be made.
fn make(
    args: &Args,
    plan: &Plan,
    session: Option<&mut Session>,
    first: Option<First>,
) -> Result<usize, Box<dyn Error>> {
    scene::one_bar();
    let bar = writer::bar(plan.shots.iter().filter(|s| !s.kept).count());
    let writer = Writer::new(args, plan, &bar).map_err(|e| -> Box<dyn Error> { e })?;
    let device = session.as_deref().map(|session| &session.gpu.info);
    let (drawn, written) = std::thread::scope(|scope| {
        let ready = ahead::start(scope, plan, first, device);
        let (to_writer, messages) = std::sync::mpsc::sync_channel(1);
        let writing = scope.spawn(move || writer.run(&messages));
        let drawn = draw_all(args, plan, session, &ready, &to_writer, &bar);
        // Both threads end when nobody hears them or speaks to them any more.
        drop((ready, to_writer));
        (drawn, writing.join())
    });
    bar.finish_and_clear();
    match written {
        // What could not be written is why nothing more was drawn.
        Ok(written) => written.map_err(|e| -> Box<dyn Error> { e })?,
        Err(panic) => std::panic::resume_unwind(panic),
    }
    drawn
}

fn draw_all(
    args: &Args,
    plan: &Plan,
    mut session: Option<&mut Session>,
    ready: &Receiver<Result<Ready, String>>,
    writer: &SyncSender<Message>,
    bar: &indicatif::ProgressBar,
) -> Result<usize, Box<dyn Error>> {
    let mut failed = 0;
    for (index, shot) in plan.shots.iter().enumerate() {
        let message = match session.as_deref_mut().filter(|_| !shot.kept) {
            None => Message::Kept { shot: index },
            Some(session) => match expose(args, shot, session, ready)? {
                Ok((pixels, row)) => Message::Drawn { shot: index, pixels: Box::new(pixels), row },
                Err(why) if args.keep_going => {
                    failed += 1;
                    bar.suspend(|| terminal::complain(format!("meniscus: picture {}: {why}", shot.number)));
                    Message::Failed
                }
                // What was drawn before is written; a film of less than all is not.
                Err(why) => return Err(why.into()),
            },
        };
        if writer.send(message).is_err() {
            return Ok(failed); // it has an error of its own
        }
    }
    // The same holds here.
    let _ = writer.send(Message::Complete);
    Ok(failed)
}

/// A picture of the size rendered at, and its row; or why its frame could not be read or prepared.
type Exposed = Result<(Pixels, Row), String>;

fn expose(
    args: &Args,
    shot: &Shot,
    session: &mut Session,
    ready: &Receiver<Result<Ready, String>>,
) -> Result<Exposed, Box<dyn Error>> {
    let mut row = Row::new(shot);
    let mut sum: Option<Pixels> = None;
    for exposure in &shot.exposures {
        let begin = Instant::now();
        let next = ready.recv().map_err(|_| "no frame came from the thread that reads them; report this")?;
        row.waited_ms += ms_since(begin);
        let pixels = match next {
            Ok(ready) => draw(args, exposure, &ready, session, &mut row)?,
            Err(why) => return Ok(Err(why)),
        };
        match &mut sum {
            None => sum = Some(pixels),
            Some(sum) => sum.add(&pixels),
        }
    }
    let mut pixels = sum.ok_or("a picture without an exposure; report this")?;
    if let count @ 2.. = shot.exposures.len() {
        pixels.divide(count);
    }
    Ok(Ok((pixels, row)))
}

/// Draws one moment.
fn draw(
    args: &Args,
    exposure: &Exposure,
    ready: &Ready,
    session: &mut Session,
    row: &mut Row,
) -> Result<Pixels, Box<dyn Error>> {
    let (picture, scene): (_, &Scene) = (&exposure.picture, &ready.scene);
    let begin = Instant::now();
    let (camera, eye, _) = picture.camera(scene)?;
    let settings = picture.frame_settings(&scene.particles)?;
    let upload = scene.give(picture.preparer(), &settings, session)?;
    session.renderer.inspect(compositing::inspection(picture));
    let input = scene.input(&camera, &settings, eye, upload.as_ref()).background(picture.background.into());
    let times = session.frame(&input)?;
    row.note = empty::explain(session, &scene.particles, &camera, &settings, picture.rendered_size()?)?;
    row.frame_ms += ms_since(begin);
    if args.stats.is_some() {
        row.gpu_ms = times.map(|t| row.gpu_ms.unwrap_or(0.0) + t.span_ms);
        let report = if picture.preparer().on_device() { inspect::report(&session.counters()?) } else { scene.report };
        row.count(scene, &report, ready);
    }
    Ok(Pixels::read(session, picture, scene.particles.radius)?)
}

fn above_zero(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|v| (1e-9..=1e9).contains(v));
    number.ok_or_else(|| format!("\"{}\" is no such number: use 1e-9 to 1e9", terminal::plain(text)))
}

fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|r| (0.1..=100.0).contains(r));
    rate.ok_or_else(|| format!("\"{}\" is not a number of pictures a second: use 0.1 to 100", terminal::plain(text)))
}

fn ms_since(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1e3
}

/// Refuses what cannot be written, before anything is read: folders of pictures are made.
fn check(args: &Args, pictures: &[PathBuf], inputs: &[outputs::Named]) -> Result<(), Box<dyn Error>> {
    let mut named: Vec<outputs::Named> = Vec::new();
    named.extend(args.stats.as_deref().map(|p| ("the statistics (--stats)", p)));
    named.extend(args.output.iter().filter(|p| Kind::of(p).is_some()).map(|p| ("a film (--output)", p.as_path())));
    outputs::check(&named, None, inputs)?;
    named.extend(inputs);
    Ok(outputs::check_pictures(pictures, &named)?)
}

/// How many pictures there are to make; an error if there are films alone, whose parts are nothing.
pub fn count(args: &Args) -> Result<usize, Box<dyn Error>> {
    let outline = Outline::new(args)?;
    if args.output.iter().all(|p| Kind::of(p).is_some()) {
        return Err(plan::NO_PICTURES.into());
    }
    Ok(outline.count())
}
