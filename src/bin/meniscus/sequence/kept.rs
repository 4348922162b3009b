//! How a sequence knows which pictures are there already: each says in its own file what it is of. There is no list beside them
//! that could say something else, and several programs may each make a part.

use super::{frames::Frames, plan::Exposure};
use meniscus::io::{Budget, images};
use std::{fs, path::Path, time::UNIX_EPOCH};

/// What a picture is of: everything that decides it but the device. Files count by name, length and time of writing.
pub fn label(exposures: &[Exposure], frames: &Frames, memory: usize) -> String {
    let mut hash = blake3::Hasher::new();
    let mut add = |bytes: &[u8]| {
        hash.update(&(bytes.len() as u64).to_le_bytes());
        hash.update(bytes);
    };
    let of = |frame: usize| frames.all()[frame].files().iter().map(|file| identity(file)).collect::<String>();
    add(env!("CARGO_PKG_VERSION").as_bytes());
    for exposure in exposures {
        let mut picture = exposure.picture.clone();
        let environment = picture.environment.file.take();
        add(picture.record().to_string().as_bytes());
        add(environment.as_deref().map(identity).unwrap_or_default().as_bytes());
        let moment = &exposure.moment;
        add(of(moment.frame).as_bytes());
        if moment.toward > 0.0 {
            add(of(moment.frame + 1).as_bytes());
            add(&moment.toward.to_le_bytes());
            add(&moment.interval.to_le_bytes());
        }
        if let Some(upper) = exposure.picture.keep_class_below {
            add(&upper.to_le_bytes());
            for frame in moment.before().saturating_sub(memory)..moment.before() {
                add(of(frame).as_bytes());
            }
        }
    }
    hash.finalize().to_hex().to_string()
}

/// Of a file. One that is not there has an error message of its own when it is read.
fn identity(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let metadata = fs::metadata(path);
    let written = metadata.as_ref().ok().and_then(|m| m.modified().ok()?.duration_since(UNIX_EPOCH).ok());
    format!("{name} {} {}", metadata.map_or(0, |m| m.len()), written.unwrap_or_default().as_nanos())
}

/// Whether a picture is there, is of this, and can be read to its end.
pub fn finished(path: &Path, label: &str, size: [u32; 2]) -> bool {
    images::label(path).is_some_and(|l| l == label)
        && images::read_picture(path, &Budget::default()).is_ok_and(|(found, _)| found == size)
}
