//! The engine in wgpu draws what the one in Rust on Vulkan draws, but for a bar of its own, and wgpu under validation has
//! nothing to say.

use crate::drivers;
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

const SIZE: [usize; 2] = [640, 480];
/// Of the bar that is drawn over the liquid, in pixels; and its colour.
const BAR: usize = 8;
const YELLOW: [u8; 3] = [255, 255, 0];
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn run(arguments: &[&str], file: &Path, driver: &str) -> String {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let mut command = Command::new(cargo);
    // Drivers are looked for from the repository.
    command.current_dir(root()).args(["run", "--quiet", "--locked"]).args(arguments).arg("--").arg(file).arg(driver);
    if arguments.contains(&"engine") {
        command.arg("--validate");
        // The newer layer, where setup.sh has found it: it alone looks from one command buffer to the next.
        let layers = root().join("target/layers");
        if std::env::var_os("VK_LAYER_PATH").is_none() && layers.join("VkLayer_khronos_validation.json").exists() {
            command.env("VK_LAYER_PATH", layers);
        }
    }
    let output = command.output().expect("cargo");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{command:?}: {said}{}", String::from_utf8_lossy(&output.stderr));
    said
}

#[test]
fn an_engine_on_wgpu_draws_the_same_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [ppm, png] = ["vulkan.ppm", "wgpu.png"].map(|name| folder.path().join(name));
    for driver in drivers::all() {
        println!("driver: {driver}");
        run(&["--no-default-features", "--example", "embed"], &ppm, &driver);
        let wanted = fs::read(&ppm).expect("a picture");
        let wanted: Vec<[u8; 3]> = wanted[wanted.len() - SIZE[0] * SIZE[1] * 3..].as_chunks().0.to_vec();
        let said = run(&["-p", "meniscus-wgpu", "--example", "engine"], &png, &driver);
        assert!(said.contains(&driver) && said.contains("validation: 0 messages"), "{said}");
        let drawn = pixels(&png);

        let (picture, bar) = drawn.split_at(SIZE[0] * (SIZE[1] - BAR));
        let differ = picture.iter().zip(&wanted).filter(|(a, b)| a != b).count();
        assert!(differ == 0, "{driver}: {differ} pixels differ");
        let colors = picture.iter().collect::<std::collections::HashSet<_>>().len();
        assert!(colors > 1000, "{colors} colours");
        assert!(bar.iter().all(|pixel| *pixel == YELLOW), "the bar is {:?}", bar[0]);
    }
}

fn pixels(file: &Path) -> Vec<[u8; 3]> {
    let file = std::io::BufReader::new(fs::File::open(file).expect("a picture"));
    let mut reader = png::Decoder::new(file).read_info().expect("PNG");
    let mut bytes = vec![0; SIZE[0] * SIZE[1] * 4];
    let info = reader.next_frame(&mut bytes).expect("pixels");
    assert_eq!([info.width as usize, info.height as usize, info.buffer_size()], [SIZE[0], SIZE[1], bytes.len()]);
    bytes.as_chunks::<4>().0.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect()
}
