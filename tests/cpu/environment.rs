//! Environment maps: read as they are, averaged down where asked, refused before they take memory.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageFormat, RgbImage};
use meniscus::io::Budget;
use meniscus::io::images::{
    ImageError, encode_picture, environment_from_bytes, read_environment, read_environment_within, read_picture,
    reduction,
};
use meniscus::twin::optics::decode_srgb;
use meniscus::{Equirect, EquirectBuilder};

fn encode(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("encoded");
    bytes.into_inner()
}

fn load(name: &str, bytes: &[u8]) -> Equirect {
    environment_from_bytes(Path::new(name), bytes, None, &Budget::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(name: &str, bytes: &[u8]) -> String {
    let error = environment_from_bytes(Path::new(name), bytes, None, &Budget::default()).expect_err(name);
    assert!(!matches!(error, ImageError::Panicked { .. }), "{error:?}");
    let message = error.to_string();
    assert!(message.starts_with(name) && message.chars().count() < 400 && !message.contains('\n'), "{message}");
    message
}

/// As the image crate reads the whole of it at once.
fn whole(bytes: &[u8], srgb: bool) -> Equirect {
    let image = image::load_from_memory(bytes).expect("an image").into_rgb32f();
    let curve = |v: f32| if srgb { decode_srgb(v) } else { v };
    let rgb: Vec<[f32; 3]> = image.pixels().map(|p| p.0.map(curve)).collect();
    Equirect::new(image.width(), image.height(), &rgb).expect("light")
}

/// Equal but for `rounding`, relative; without printing thousands of texels.
fn assert_equal(left: &Equirect, right: &Equirect, rounding: f32, what: &str) {
    assert_eq!(left.size(), right.size(), "{what}");
    for (i, (a, b)) in left.texels().iter().zip(right.texels()).enumerate() {
        assert!((a - b).abs() <= rounding * b.abs(), "{what}: {a} for {b} at {i}");
    }
}

fn noise(n: usize) -> Vec<u8> {
    (0..n as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect()
}

#[test]
fn maps_are_read_as_they_are() {
    use image::{GrayImage, ImageBuffer, Luma, LumaA, Rgb, Rgb32FImage, Rgba, Rgba32FImage};
    let (w, h) = (32, 16);
    let bytes = noise(w * h * 4);
    let wide: Vec<u16> =
        bytes.iter().zip(bytes.iter().rev()).map(|(a, b)| u16::from(*a) << 8 | u16::from(*b)).collect();
    let floats: Vec<f32> = bytes.iter().map(|b| f32::from(*b) * 3.7).collect();
    let n = w * h;
    let (w, h) = (w as u32, h as u32);
    let pngs = [
        DynamicImage::from(RgbImage::from_raw(w, h, bytes[..3 * n].to_vec()).unwrap()),
        DynamicImage::from(ImageBuffer::<Rgba<u8>, _>::from_raw(w, h, bytes.clone()).unwrap()),
        DynamicImage::from(GrayImage::from_raw(w, h, bytes[..n].to_vec()).unwrap()),
        DynamicImage::from(ImageBuffer::<LumaA<u8>, _>::from_raw(w, h, bytes[..2 * n].to_vec()).unwrap()),
        DynamicImage::from(ImageBuffer::<Rgb<u16>, _>::from_raw(w, h, wide[..3 * n].to_vec()).unwrap()),
        DynamicImage::from(ImageBuffer::<Luma<u16>, _>::from_raw(w, h, wide[..n].to_vec()).unwrap()),
        DynamicImage::from(ImageBuffer::<Rgba<u16>, _>::from_raw(w, h, wide).unwrap()),
    ];
    for image in &pngs {
        let file = encode(image, ImageFormat::Png);
        // The image crate takes grey through a colour space and back.
        let rounding = if image.color().has_color() { 0.0 } else { 1e-6 };
        assert_equal(&load("a.png", &file), &whole(&file, true), rounding, &format!("{:?}", image.color()));
        refused("a.png", &file[..file.len() / 2]);
    }
    let rgb = DynamicImage::from(Rgb32FImage::from_raw(w, h, floats[..3 * n].to_vec()).unwrap());
    let rgba = DynamicImage::from(Rgba32FImage::from_raw(w, h, floats).unwrap());
    for (image, format, name) in [
        (&rgb, ImageFormat::Hdr, "a.hdr"),
        (&rgb, ImageFormat::OpenExr, "a.exr"),
        (&rgba, ImageFormat::OpenExr, "a.exr"),
    ] {
        let file = encode(image, format);
        assert_equal(&load(name, &file), &whole(&file, false), 0.0, name);
        refused(name, &file[..file.len() - 40]);
    }
}

#[test]
fn every_kind_of_exr_is_read() {
    use exr::prelude::*;
    let light = |p: Vec2<usize>| (f16::from_f32(p.x() as f32 * 0.25), f16::from_f32(p.y() as f32), f16::from_f32(1.5));
    use Compression::{B44, PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
    for compression in [Uncompressed, RLE, ZIP1, ZIP16, PIZ, PXR24, B44] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(10, 7))] {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let layer = Layer::new((64, 32), LayerAttributes::named("map"), encoding, SpecificChannels::rgb(light));
            let mut file = Cursor::new(Vec::new());
            Image::from_layer(layer).write().to_buffered(&mut file).expect("encoded");
            let file = file.into_inner();
            assert_equal(&load("a.exr", &file), &whole(&file, false), 0.0, &format!("{compression} {blocks:?}"));
        }
    }
}

#[test]
fn means_are_those_of_the_area() {
    // A whole divisor: plain means of blocks.
    let rgb: Vec<[f32; 3]> = noise(16 * 8).iter().map(|b| [f32::from(*b), 1.0, 0.0]).collect();
    let reduce = |w: u32, h: u32, factor: u32, rgb: &[[f32; 3]]| {
        let mut map = EquirectBuilder::new(w, h, factor).expect("a size");
        for (y, row) in rgb.chunks(w as usize).enumerate() {
            // Every other column first.
            map.add(0, 2, y as u32, row.iter().step_by(2).copied()).expect("light");
            map.add(1, 2, y as u32, row.iter().skip(1).step_by(2).copied()).expect("light");
        }
        map.finish()
    };
    let half = reduce(16, 8, 2, &rgb);
    assert_eq!(half.size(), [8, 4]);
    for (i, texel) in half.texels().chunks(4).enumerate() {
        let (x, y) = (i % 8 * 2, i / 8 * 2);
        let mean =
            [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(a, b)| rgb[(y + b) * 16 + x + a][0]).iter().sum::<f32>() / 4.0;
        assert!((texel[0] - mean).abs() < 1e-4 && (texel[1] - 1.0).abs() < 1e-6 && texel[3] == 1.0, "{i}: {texel:?}");
    }
    // None: 16 x 8 by 3 is 6 x 3, each texel of which covers 2 2/3 columns and rows. The mean of all stays what it is.
    let third = reduce(16, 8, 3, &rgb);
    assert_eq!(third.size(), [6, 3]);
    let mean = |values: &mut dyn Iterator<Item = f32>| values.sum::<f32>() / 18.0;
    let all = rgb.iter().map(|c| c[0]).sum::<f32>() / 128.0;
    assert!((mean(&mut third.texels().chunks(4).map(|t| t[0])) - all).abs() < 1e-3);
    assert!(third.texels().chunks(4).all(|t| (t[1] - 1.0).abs() < 1e-5));
    let first = (0..8).flat_map(|y| (0..16).map(move |x| (x, y))).map(|(x, y)| {
        let part = |i: i32| (8.0 / 3.0 - i as f32).clamp(0.0, 1.0);
        part(x) * part(y) * rgb[(y * 16 + x) as usize][0]
    });
    assert!((third.texels()[0] - first.sum::<f32>() * 9.0 / 64.0).abs() < 1e-3);
    // By one: the same bits, a negative zero's sign too.
    let exact = reduce(2, 1, 1, &[[-0.0, f32::MAX, 1e-40], [0.1, 0.2, 0.3]]);
    assert_eq!(exact.texels()[0].to_bits(), (-0.0_f32).to_bits());
    assert_eq!(exact.texels()[1..3], [f32::MAX, 1e-40]);
    assert_eq!(reduce(2, 2, 2, &[[f32::MAX; 3]; 4]).texels()[..3], [f32::MAX; 3]);
    assert!(EquirectBuilder::new(2, 1, 1).unwrap().add(0, 1, 0, [[0.0; 3]; 3]).is_err());
    assert!(EquirectBuilder::new(2, 1, 1).unwrap().add(0, 1, 1, [[0.0; 3]]).is_err());
}

#[test]
fn a_map_is_held_at_what_the_picture_shows_and_the_budget_holds() {
    let budget = Budget::default();
    assert_eq!(reduction([4096, 2048], None, &budget), 1);
    assert_eq!(reduction([4096, 2048], Some(2048), &budget), 2);
    assert_eq!(reduction([4096, 2048], Some(2049), &budget), 1);
    // 48 bytes a texel in half of 2 GiB.
    let factor = reduction([16384, 8192], Some(16384), &budget);
    let [w, h] = [16384_u64, 8192].map(|n| n.div_ceil(factor.into()));
    assert!(factor == 3 && w * h * 48 <= 1 << 30, "{factor}");
    assert_eq!(reduction([u32::MAX, u32::MAX], None, &Budget::new(0)), u32::MAX);
    let image = DynamicImage::from(RgbImage::from_pixel(64, 32, image::Rgb([255, 0, 0])));
    let file = encode(&image, ImageFormat::Png);
    let map = environment_from_bytes(Path::new("a.png"), &file, Some(16), &budget).expect("a map");
    assert_eq!(map.size(), [16, 8]);
    assert_eq!(map.texels()[..4], [1.0, 0.0, 0.0, 1.0]);
}

#[test]
fn maps_that_lie_are_refused_at_once() {
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/exr_huge_allocation.exr");
    let error = read_environment(&kept).expect_err("43 GB").to_string();
    assert!(error.starts_with(&kept.display().to_string()), "{error}");
    // 512 million texels in some bytes.
    let mut png = encode(&DynamicImage::from(RgbImage::new(2, 1)), ImageFormat::Png);
    png[16..24].copy_from_slice(&[0, 0, 0x80, 0, 0, 0, 0x40, 0]);
    let mut crc = flate2::Crc::new();
    crc.update(&png[12..29]);
    png[29..33].copy_from_slice(&crc.sum().to_be_bytes());
    assert!(refused("a.png", &png).contains("32768x16384"));
    assert!(refused("a.hdr", b"#?RADIANCE\n\n-Y 1073741824 +X 2147483648\n").contains("a.hdr: "));
    refused("a.hdr", b"#?RADIANCE\n\n-Y 8192 +X 16384\n\x02\x02\x40\x00");
    refused("a.hdr", &[b"#?RADIANCE\n".to_vec(), vec![b'a'; 1 << 20]].concat());
    assert!(refused("a.png", b"").contains("environment maps are whole .hdr, .exr or .png files"));
    assert!(
        refused("a.png", &encode(&DynamicImage::from(RgbImage::new(8, 8)), ImageFormat::Png)).contains("twice as wide")
    );
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        let image = image::Rgb32FImage::from_fn(4, 2, |x, y| image::Rgb([if (x, y) == (1, 1) { bad } else { 1.0 }; 3]));
        let message = refused("a.exr", &encode(&DynamicImage::from(image), ImageFormat::OpenExr));
        assert!(message.contains("at pixel 5"), "{message}");
    }
}

#[test]
fn failed_reads_say_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("a\x1b.png");
    let text = read_environment(&missing).expect_err("missing").to_string();
    assert!(text.contains("a\\u{1b}.png: cannot be read") && text.contains("; check the path"), "{text}");
    let text = read_environment(folder.path()).expect_err("a folder").to_string();
    assert!(text.contains("; name one image in it"), "{text}");
}

#[test]
#[cfg(unix)]
fn maps_come_through_pipes_too() {
    let mut bytes = Cursor::new(Vec::new());
    DynamicImage::ImageRgb32F(image::Rgb32FImage::from_pixel(64, 32, image::Rgb([0.5; 3])))
        .write_to(&mut bytes, ImageFormat::OpenExr)
        .expect("encoded");
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("a.exr");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let writer = {
        let pipe = pipe.clone();
        std::thread::spawn(move || std::fs::write(pipe, bytes.into_inner()))
    };
    assert_eq!(read_environment(&pipe).expect("a map").size(), [64, 32]);
    writer.join().expect("joined").expect("written");
    let endless = folder.path().join("b.exr");
    std::os::unix::fs::symlink("/dev/zero", &endless).expect("a link");
    let error = read_environment_within(&endless, None, &Budget::new(8 << 20)).expect_err("no end");
    assert!(matches!(error, ImageError::TooLarge { .. }), "{error}");
}

/// Packed in parallel, and still the same file from run to run.
#[test]
fn a_picture_is_written_to_the_same_bytes() {
    let [width, height] = [300, 200];
    let value = |i: u32| (f32::from_bits(0x3f80_0000 | (i.wrapping_mul(2_654_435_761) >> 9)) - 1.0) * 4.0;
    let picture: Vec<[f32; 3]> = (0..width * height).map(|i| [value(i), value(i + 7), -value(i + 9)]).collect();
    let encode = || encode_picture(Path::new("a.exr"), [width, height], &picture).expect("encoded");
    let first = encode();
    assert!((0..20).all(|_| encode() == first));
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.exr");
    std::fs::write(&path, &first).expect("written");
    let read = read_picture(&path, &Budget::default()).expect("read");
    assert!(read == ([width, height], picture));
}
