//! Pictures of materials as PNG files.

use crate::common::scratch::scratch;
use hwall_texton::{MaterialPicture, PictureKind, PngSource, Relief, TextonError};
use png::{BitDepth, ColorType, Encoder};
use std::f64::consts::TAU;
use std::io::ErrorKind;
use std::path::Path;

const SIDE: usize = 128;

fn write(path: &Path, colour: ColorType, depth: BitDepth, data: &[u8]) {
    let file = std::fs::File::create(path).unwrap();
    let mut encoder = Encoder::new(file, SIDE as u32, SIDE as u32);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
}

/// A wave of 12 pixels, 0 to 1.
fn wave(k: usize) -> f64 {
    0.5 + 0.4 * (TAU * (k % SIDE) as f64 / 12.0).sin()
}

fn source(relief_mm: Option<f64>) -> PngSource {
    PngSource {
        width_mm: Some(12.8),
        relief_mm,
    }
}

#[test]
fn a_height_map_has_its_relief_at_any_depth() {
    let path = scratch("heights.png");
    let wide = |k| ((wave(k) * 65_535.0) as u16).to_be_bytes();
    let sixteen: Vec<u8> = (0..SIDE * SIDE).flat_map(wide).collect();
    let eight: Vec<u8> = (0..SIDE * SIDE).map(|k| (wave(k) * 255.0) as u8).collect();
    let colour: Vec<u8> = eight.iter().flat_map(|v| [*v, *v, *v, 9]).collect();
    for (kind, depth, data) in [
        (ColorType::Grayscale, BitDepth::Sixteen, &sixteen),
        (ColorType::Grayscale, BitDepth::Eight, &eight),
        (ColorType::Rgba, BitDepth::Eight, &colour),
    ] {
        write(&path, kind, depth, data);
        let picture = MaterialPicture::read_png(&path, &source(Some(0.2))).unwrap();
        assert_eq!(picture.kind(), PictureKind::Height);
        let relief = Relief::of(&picture).unwrap();
        let height = relief.height_mm / (0.4 * 0.2 / 2_f64.sqrt());
        assert!((0.93..1.07).contains(&height), "{height}");
        let period = relief.period_mm() / 1.2;
        assert!((0.9..1.2).contains(&period), "{relief:?}");
    }
}

#[test]
fn a_colour_picture_counts_in_linear_light() {
    let path = scratch("colour.png");
    let srgb = |light: f64| (255.0 * (1.055 * light.powf(1.0 / 2.4) - 0.055)).round() as u8;
    let data: Vec<u8> = (0..SIDE * SIDE).flat_map(|k| [srgb(wave(k)); 3]).collect();
    write(&path, ColorType::Rgb, BitDepth::Eight, &data);
    let read = MaterialPicture::read_png(&path, &source(None)).unwrap();
    assert_eq!(read.kind(), PictureKind::Albedo);
    let light = (0..SIDE * SIDE).map(|k| wave(k) as f32).collect();
    let linear = MaterialPicture::new(PictureKind::Albedo, SIDE, 0.1, light, 0.0).unwrap();
    let [read, linear] = [&read, &linear].map(|picture| Relief::of(picture).unwrap().slope);
    assert!((read / linear - 1.0).abs() < 0.01, "{read} {linear}");
    // Steps of one in a plain picture are noise; those of four bits are larger.
    let colours = (0..SIDE * SIDE).flat_map(|k| [127 + u8::from(k % 97 == 0); 3]);
    let nibbles = (0..SIDE * SIDE / 2).map(|k| 0x77 + u8::from(k % 97 == 0));
    let (colours, nibbles): (Vec<u8>, Vec<u8>) = (colours.collect(), nibbles.collect());
    for (colour, depth, data) in [
        (ColorType::Rgb, BitDepth::Eight, colours),
        (ColorType::Grayscale, BitDepth::Four, nibbles),
    ] {
        write(&path, colour, depth, &data);
        for relief_mm in [None, Some(0.2)] {
            let plain = MaterialPicture::read_png(&path, &source(relief_mm)).unwrap();
            let relief = Relief::of(&plain);
            assert!(matches!(relief, Err(TextonError::Uniform { .. })));
        }
    }
}

/// The kind of failure of reading a file.
fn kind_of(path: &Path) -> ErrorKind {
    match MaterialPicture::read_png(path, &source(None)) {
        Err(TextonError::File { kind, .. }) => kind,
        other => panic!("{other:?}"),
    }
}

#[test]
fn files_without_a_scale_or_a_picture_are_refused() {
    let path = scratch("refused.png");
    let grey = [7; SIDE * SIDE];
    write(&path, ColorType::Grayscale, BitDepth::Eight, &grey);
    let without = MaterialPicture::read_png(&path, &PngSource::default());
    assert!(matches!(without, Err(TextonError::Attribute { .. })));
    for width_mm in [0.0, f64::NAN] {
        let source = PngSource {
            width_mm: Some(width_mm),
            relief_mm: None,
        };
        let picture = MaterialPicture::read_png(&path, &source);
        assert!(matches!(picture, Err(TextonError::Argument(_))));
    }
    let flat = MaterialPicture::read_png(&path, &source(Some(0.0)));
    assert!(matches!(flat, Err(TextonError::Argument(_))));
    let bytes = std::fs::read(&path).unwrap();
    for cut in [0, 40] {
        std::fs::write(&path, &bytes[..cut]).unwrap();
        let kind = kind_of(&path);
        let is_named = matches!(kind, ErrorKind::UnexpectedEof | ErrorKind::InvalidData);
        assert!(is_named, "{kind}");
    }
    // A header that claims far more than the file can hold.
    let mut huge = bytes;
    huge[16..20].copy_from_slice(&60_000_u32.to_be_bytes());
    huge[20..24].copy_from_slice(&60_000_u32.to_be_bytes());
    std::fs::write(&path, &huge).unwrap();
    assert!(MaterialPicture::read_png(&path, &source(None)).is_err());
    assert_eq!(kind_of(&scratch("missing.png")), ErrorKind::NotFound);
}
