//! Pictures and scene files that are written from the window: numbered, and none in the place of another.

use crate::{outputs, picture::Picture, scene_file};
use meniscus::io::images;
use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
};

/// The number after the highest that is used in a folder.
pub fn next(folder: &Path) -> Result<u32, Box<dyn Error>> {
    let entries = fs::read_dir(if folder == Path::new("") { Path::new(".") } else { folder });
    let entries = entries.map_err(|e| format!("{}: {e}. Name another folder with --output", folder.display()))?;
    let number = |name: &str| name.strip_prefix("view-")?.get(..4)?.parse::<u32>().ok();
    let used = entries.filter_map(|e| number(&e.ok()?.file_name().to_string_lossy()));
    Ok(used.max().unwrap_or(0) + 1)
}

/// Writes a scene file, and the picture beside it; returns their names.
pub fn write(stem: &Path, picture: Picture, pixels: Option<&[[f32; 3]]>) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let mut names = Vec::new();
    if let Some(pixels) = pixels {
        let path = stem.with_extension("png");
        outputs::write(&path, &images::encode_picture(&path, picture.size, pixels)?)?;
        names.push(path);
    }
    let path = stem.with_extension("toml");
    outputs::write(&path, scene_file::text(&picture, &path)?.as_bytes())?;
    names.push(path);
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_on_and_replace_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(next(folder.path()).expect("a number"), 1);
        for name in ["view-0007-left.png", "view-0003.toml", "view-x.png", "other.png"] {
            fs::write(folder.path().join(name), "").expect("written");
        }
        assert_eq!(next(folder.path()).expect("a number"), 8);
        let pixels = [[0.5f32; 3]; 2];
        let picture = Picture { size: [2, 1], ..Picture::default() };
        let names = write(&folder.path().join("view-0008"), picture, Some(&pixels)).expect("written");
        assert!(names.len() == 2 && names.iter().all(|n| n.exists()), "{names:?}");
        assert_eq!(scene_file::read(&names[1]).expect("a scene").size, [2, 1]);
        assert!(next(&folder.path().join("none")).is_err());
    }
}
