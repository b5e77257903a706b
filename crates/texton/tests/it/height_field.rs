//! Height fields: heights of the true surface, pictures that read back, pictures that do not.

use crate::common::bumps::sized;
use crate::common::pictures::picture;
use crate::common::refusals::{pixel, refused};
use crate::common::scratch::scratch;
use glam::{DVec2, dvec2};
use hwall_texton::{HeightField, HeightSource, Patch, RoughnessMap, TextonError, Texture};
use std::path::Path;

fn patch() -> Patch {
    Patch::new(Texture::released(), sized([20.0, 10.0])).unwrap()
}

/// Heights in a unit on a grid of 0.01 mm.
fn hundredths(unit_mm: f64) -> HeightSource {
    HeightSource {
        pitch_mm: Some(0.01),
        unit_mm: Some(unit_mm),
        channel: None,
    }
}

fn foreign(path: &Path, size: (usize, usize), channels: &[(&str, Vec<f32>)]) {
    std::fs::write(path, picture(size, channels)).unwrap();
}

#[test]
fn heights_are_those_of_the_surface() {
    let patch = patch();
    let field = patch.height_field(0.05).unwrap();
    assert_eq!(field.size(), [400, 200]);
    let mut volume = 0.0;
    for (k, height) in field.heights_mm().iter().enumerate() {
        let at = DVec2::from([k % 400, k / 400].map(|i| (i as f64 + 0.5) * 0.05));
        let truth = patch.height_at_mm(at).unwrap();
        assert!((f64::from(*height) - truth).abs() < 1e-7);
        assert!((field.height_at_mm(at).unwrap() - truth).abs() < 1e-6);
        volume += truth * 0.05 * 0.05;
    }
    let bumps = patch.volume_mm3() - 200.0;
    assert!((volume / bumps - 1.0).abs() < 1e-3);
    // On the top of a bump and on the plate between them.
    assert!((patch.height_at_mm(dvec2(9.3, 3.3)).unwrap() - 0.7).abs() < 1e-12);
    assert_eq!(patch.height_at_mm(dvec2(6.2, 2.2)), Some(0.0));
    for outside in [dvec2(-0.1, 1.0), dvec2(20.1, 1.0), dvec2(f64::NAN, 1.0)] {
        assert_eq!(patch.height_at_mm(outside), None);
        assert_eq!(field.height_at_mm(outside), None);
    }
    assert!(patch.height_field(0.0).is_err());
    assert!(patch.height_field(1e-6).is_err());
    assert!(patch.height_field(100.0).is_err());
}

#[test]
fn pictures_read_back_to_the_bit() {
    let path = scratch("read-back.exr");
    let field = patch().height_field(0.1).unwrap();
    field.write_exr(&path).unwrap();
    let first = std::fs::read(&path).unwrap();
    let source = HeightSource::default();
    assert_eq!(HeightField::read_exr(&path, &source).unwrap(), field);
    field.write_exr(&path).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), first);
    // Given units take precedence.
    let micrometres = HeightSource {
        unit_mm: Some(1e-3),
        pitch_mm: Some(0.2),
        ..HeightSource::default()
    };
    let read = HeightField::read_exr(&path, &micrometres).unwrap();
    assert_eq!(read.pitch_mm(), 0.2);
    let [large, small] =
        [&field, &read].map(|f| f.heights_mm().iter().copied().fold(0.0, f32::max));
    assert!((large / small - 1000.0).abs() < 1e-3);
}

#[test]
fn normals_are_unit_and_point_away() {
    let path = scratch("normals.exr");
    let field = patch().height_field(0.05).unwrap();
    field.write_normal_exr(&path).unwrap();
    let blue = HeightSource {
        channel: Some("B".to_owned()),
        ..HeightSource::default()
    };
    let up = HeightField::read_exr(&path, &blue).unwrap();
    assert!(up.heights_mm().iter().all(|b| *b > 0.0 && *b <= 1.0));
    // On a slope of the ellipsoid, away from its foot: against the exact normal.
    let (i, j) = (205, 65);
    let [x, y] = [i, j].map(|k| (f64::from(k) + 0.5) * 0.05);
    let (dx, dy) = ((x - 9.3) / 3.0, (y - 3.3) / 1.0);
    let z = (1.0 - dx * dx - dy * dy).sqrt();
    let exact = glam::dvec3(dx / 3.0, dy, z / 0.7).normalize();
    let ours = glam::DVec3::from_array(field.normal(i as usize, j as usize));
    assert!((ours.length() - 1.0).abs() < 1e-12);
    assert!(exact.distance(ours) < 1e-3, "{exact} {ours}");
}

#[test]
fn measured_pictures_are_read_with_what_is_given() {
    let path = scratch("scan.exr");
    let depths = vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    foreign(&path, (3, 2), &[("depth", depths)]);
    let unknown = HeightField::read_exr(&path, &HeightSource::default());
    let name = "pixel pitch";
    assert_eq!(unknown, Err(TextonError::Attribute { name }));
    let field = HeightField::read_exr(&path, &hundredths(1e-3)).unwrap();
    // The lowest row first.
    let heights_mm: [f32; 6] = [0.004, 0.005, 0.006, 0.001, 0.002, 0.003];
    assert_eq!(field.heights_mm(), heights_mm);
    let mesh = field.mesh(1.0, 1_000).unwrap().check();
    assert!(mesh.is_solid(), "{mesh:?}");
    assert_eq!(mesh.euler, 2);
}

#[test]
fn wrong_pictures_are_refused() {
    let path = scratch("wrong.exr");
    let read = || HeightField::read_exr(&path, &hundredths(1.0));
    assert!(matches!(read(), Err(TextonError::File { .. })));
    foreign(&path, (2, 1), &[("R", vec![0.0; 2]), ("G", vec![0.0; 2])]);
    assert!(matches!(read(), Err(TextonError::Channel { .. })));
    foreign(&path, (2, 2), &[("Y", vec![0.0, 1.0, 2.0, f32::NAN])]);
    assert_eq!(pixel(read()), [1, 1]);
    let field = patch().height_field(0.05).unwrap();
    field.write_exr(&path).unwrap();
    let whole = std::fs::read(&path).unwrap();
    for length in [0, 100, whole.len() / 2, whole.len() - 1] {
        std::fs::write(&path, &whole[..length]).unwrap();
        assert!(matches!(read(), Err(TextonError::File { .. })), "{length}");
    }
    for (columns, values) in [(2, 3), (0, 0), (0, 3), (2, 0)] {
        let odd = HeightField::new(columns, 0.1, vec![0.0; values]);
        assert!(matches!(odd, Err(TextonError::MapSize { .. })));
    }
    // The lowest row comes first and is the last from the top.
    let heights = vec![0.0, f32::INFINITY, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(pixel(HeightField::new(2, 0.1, heights)), [1, 2]);
}

#[test]
fn a_height_field_becomes_a_solid() {
    let patch = patch();
    let field = patch.height_field(0.1).unwrap();
    let check = field.mesh(1.0, 1_000_000).unwrap().check();
    assert!(check.is_solid(), "{check:?}");
    let thin = HeightField::new(1, 0.1, vec![0.0; 3]).unwrap();
    assert!(thin.mesh(1.0, 1_000).is_err());
    let few = field.mesh(1.0, 1_000);
    assert!(matches!(few, Err(TextonError::TooManyTriangles { .. })));
}

/// Regression: only pixels were bounded, not channels and layers, so 632 bytes requested 1.17 GB.
#[test]
fn a_small_file_cannot_ask_for_much_memory() {
    let path = scratch("bomb.exr");
    let names: Vec<String> = (0..8).map(|i| format!("c{i}")).collect();
    let channels: Vec<(&str, Vec<f32>)> =
        names.iter().map(|n| (n.as_str(), vec![0.0; 4])).collect();
    foreign(&path, (2, 2), &channels);
    let mut bytes = std::fs::read(&path).unwrap();
    // Both windows of the header: 6000 x 6000 pixels of 8 channels are 1.15 GB.
    for name in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
        for corner in [8, 12] {
            bytes[at + corner..at + corner + 4].copy_from_slice(&5999_i32.to_le_bytes());
        }
    }
    std::fs::write(&path, &bytes).unwrap();
    let source = HeightSource {
        channel: Some("c0".to_owned()),
        ..hundredths(1.0)
    };
    let heights = refused(HeightField::read_exr(&path, &source));
    let roughness = refused(RoughnessMap::from_exr(std::io::Cursor::new(bytes)));
    assert_eq!(
        [heights, roughness],
        ["samples of all layers and channels"; 2]
    );
}
