//! Films of a sequence: through an installed `ffmpeg`, or as animated GIF or PNG.
//!
//! A film is made anew each time; pictures that are kept beside it are not.

use crate::outputs::{Growing, OutputError};
use gif::Repeat;
use std::{
    fs::File,
    io::{BufWriter, ErrorKind, Read, Write},
    path::{Path, PathBuf},
    process::{Child, ChildStdin, Command, Stdio},
    thread::JoinHandle,
};

/// Why a film cannot be made, or was not.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    #[error(
        "{}: films of this kind are made by ffmpeg, which is not installed. Install the package `ffmpeg` (apt-get install ffmpeg), \
         or name a .gif or .png", .0.display()
    )]
    NoFfmpeg(PathBuf),
    #[error("{}: ffmpeg cannot be started: {source}. Check that it is installed whole", path.display())]
    Start { path: PathBuf, source: std::io::Error },
    #[error("{}: ffmpeg failed: {said}. Check that it has the encoder {encoder} (`ffmpeg -encoders`)", path.display())]
    Ffmpeg { path: PathBuf, said: String, encoder: &'static str },
    #[error("{}: {width}x{height} pixels are more than a GIF may have: use a smaller --size", path.display())]
    Gif { path: PathBuf, width: u32, height: u32 },
    #[error("{}: {detail}", path.display())]
    Encode { path: PathBuf, detail: String },
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// What makes films of one extension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Format and encoder, as ffmpeg calls them, and what the encoder is told.
    Ffmpeg(&'static str, &'static str, &'static [&'static str]),
    Gif,
    Png,
}

impl Kind {
    /// What a file of this name is, if it is a film: pictures have numbers.
    pub fn of(path: &Path) -> Option<Kind> {
        let numbered = path.file_name()?.to_string_lossy().contains('#');
        Some(match path.extension()?.to_string_lossy().to_lowercase().as_str() {
            "mp4" => Kind::Ffmpeg("mp4", "libx264", &["-crf", "16"]),
            "mkv" => Kind::Ffmpeg("matroska", "libx264", &["-crf", "16"]),
            "webm" => Kind::Ffmpeg("webm", "libvpx-vp9", &["-crf", "24", "-b:v", "0"]),
            "gif" => Kind::Gif,
            "png" if !numbered => Kind::Png,
            _ => return None,
        })
    }
}

/// Frames of a film.
#[derive(Clone, Copy)]
pub struct Format {
    pub size: [u32; 2],
    pub rate: f64,
    /// How many there will be.
    pub frames: usize,
}

/// A film in the making.
pub struct Film<'a> {
    path: &'a Path,
    file: Growing<'a>,
    maker: Maker,
    format: Format,
    /// Frames that it has.
    frames: usize,
}

enum Maker {
    Ffmpeg { child: Child, frames: Option<ChildStdin>, said: Option<JoinHandle<String>>, encoder: &'static str },
    Gif(Box<gif::Encoder<BufWriter<File>>>),
    Png(Option<Box<png::Writer<BufWriter<File>>>>),
}

impl<'a> Film<'a> {
    pub fn new(path: &'a Path, kind: Kind, format: Format) -> Result<Film<'a>, FilmError> {
        let (growing, file) = Growing::new(path)?;
        let [width, height] = format.size;
        let maker = match kind {
            Kind::Ffmpeg(container, encoder, told) => ffmpeg(path, file, format, container, encoder, told)?,
            Kind::Gif => {
                let (w, h) = (u16::try_from(width), u16::try_from(height));
                let (Ok(w), Ok(h)) = (w, h) else { return Err(FilmError::Gif { path: path.into(), width, height }) };
                let mut encoder = gif::Encoder::new(BufWriter::new(file), w, h, &[]).map_err(encode(path))?;
                encoder.set_repeat(Repeat::Infinite).map_err(encode(path))?;
                Maker::Gif(Box::new(encoder))
            }
            Kind::Png => {
                let writer = animated(file, format).map_err(encode(path))?;
                Maker::Png(Some(Box::new(writer)))
            }
        };
        Ok(Film { path, file: growing, maker, format, frames: 0 })
    }

    /// Adds a picture of sRGB bytes.
    pub fn add(&mut self, rgb: &[[u8; 3]]) -> Result<(), FilmError> {
        let bytes = rgb.as_flattened();
        match &mut self.maker {
            Maker::Ffmpeg { frames, .. } => {
                if frames.as_mut().is_some_and(|f| f.write_all(bytes).is_err()) {
                    // It has left, and says why.
                    return Err(self.failed());
                }
            }
            Maker::Gif(encoder) => {
                let [w, h] = self.format.size.map(|edge| edge as u16);
                let mut frame = gif::Frame::from_rgb_speed(w, h, bytes, 10);
                // Hundredths of a second, as many in all as the rate has.
                let until = |frames: usize| (100.0 * frames as f64 / self.format.rate).round() as u64;
                frame.delay = (until(self.frames + 1) - until(self.frames)).min(u64::from(u16::MAX)) as u16;
                encoder.write_frame(&frame).map_err(encode(self.path))?;
            }
            Maker::Png(writer) => {
                let writer = writer.as_mut().expect("it is not finished");
                writer.write_image_data(bytes).map_err(encode(self.path))?;
            }
        }
        self.frames += 1;
        Ok(())
    }

    /// It is whole: takes its name.
    pub fn finish(mut self) -> Result<(), FilmError> {
        match &mut self.maker {
            Maker::Ffmpeg { child, frames, .. } => {
                drop(frames.take());
                if !child.wait().is_ok_and(|status| status.success()) {
                    return Err(self.failed());
                }
            }
            Maker::Gif(encoder) => encoder.get_mut().flush().map_err(|e| self.file.failed(e))?,
            Maker::Png(writer) => {
                writer.take().expect("it is not finished").finish().map_err(encode(self.path))?;
            }
        }
        Ok(self.file.finish()?)
    }

    /// What ffmpeg said when it left.
    fn failed(&mut self) -> FilmError {
        let Maker::Ffmpeg { child, frames, said, encoder } = &mut self.maker else {
            return FilmError::Encode { path: self.path.into(), detail: "it is none of ffmpeg's".into() };
        };
        drop(frames.take());
        let status = child.wait().map_or_else(|e| e.to_string(), |s| s.to_string());
        let said = said.take().and_then(|s| s.join().ok()).unwrap_or_default();
        let said = said.lines().rev().find(|l| !l.trim().is_empty()).map_or(status, |l| l.trim().to_owned());
        FilmError::Ffmpeg { path: self.path.into(), said, encoder }
    }
}

/// It ends with the film, finished or not.
impl Drop for Maker {
    fn drop(&mut self) {
        if let Maker::Ffmpeg { child, frames, .. } = self {
            drop(frames.take());
            // One that has ended cannot be; there is nothing more to be done about another.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn encode<E: std::fmt::Display>(path: &Path) -> impl Fn(E) -> FilmError {
    |e| FilmError::Encode { path: path.into(), detail: e.to_string() }
}

fn ffmpeg(
    path: &Path,
    file: File,
    format: Format,
    container: &str,
    encoder: &'static str,
    told: &[&str],
) -> Result<Maker, FilmError> {
    let [width, height] = format.size;
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
    command.args(["-s", &format!("{width}x{height}"), "-r", &format.rate.to_string(), "-i", "pipe:0"]);
    // Colours are halved both ways: an odd edge gets one pixel more.
    command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709", "-pix_fmt", "yuv420p"]);
    command.args(["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1"]);
    // No random numbers: the same pictures are the same film.
    command.args(["-fflags", "+bitexact", "-flags:v", "+bitexact"]);
    command.args(["-c:v", encoder]).args(told).args(["-f", container]);
    // Not by its name: where that is removed because of a signal, nothing comes in its place.
    command.arg("/dev/fd/1").stdout(file).stdin(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|source| match source.kind() {
        ErrorKind::NotFound => FilmError::NoFfmpeg(path.into()),
        _ => FilmError::Start { path: path.into(), source },
    })?;
    let frames = child.stdin.take();
    let said = child.stderr.take().map(|mut stderr| {
        std::thread::spawn(move || {
            let mut said = Vec::new();
            // What it said until then is worth having.
            let _ = stderr.read_to_end(&mut said);
            String::from_utf8_lossy(&said).into_owned()
        })
    });
    Ok(Maker::Ffmpeg { child, frames, said, encoder })
}

fn animated(file: File, format: Format) -> Result<png::Writer<BufWriter<File>>, png::EncodingError> {
    let mut encoder = png::Encoder::new(BufWriter::new(file), format.size[0], format.size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    encoder.set_animated(format.frames as u32, 0)?;
    let (numerator, denominator) = match format.rate {
        whole if whole.fract() == 0.0 => (1, whole as u16),
        rate => (600, (600.0 * rate).round() as u16),
    };
    encoder.set_frame_delay(numerator, denominator)?;
    encoder.write_header()
}

#[cfg(test)]
mod tests {
    use super::Kind;
    use std::path::Path;

    #[test]
    fn films_are_told_from_pictures() {
        let kind = |name: &str| Kind::of(Path::new(name));
        assert!(matches!(kind("a/f.MP4"), Some(Kind::Ffmpeg("mp4", ..))));
        assert_eq!(kind("f.gif"), Some(Kind::Gif));
        assert_eq!(kind("out/f.png"), Some(Kind::Png));
        assert_eq!(kind("f.webp"), None);
        assert_eq!(kind("out/##.png"), None);
        assert_eq!(kind("mp4"), None);
    }
}
