//! Roughness maps from OpenEXR pictures.

use crate::common::pictures::picture;
use crate::common::refusals::refused;
use hwall_texton::{RoughnessMap, TextonError};

#[test]
fn a_roughness_map_from_openexr() {
    let write = |channels: &[(&str, Vec<f32>)]| picture((3, 2), channels);
    let read = |bytes: &[u8]| RoughnessMap::from_exr(std::io::Cursor::new(bytes));
    let values = vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let other = vec![9.0; 6];
    let map = RoughnessMap::new(3, 2, values.clone()).unwrap();
    let named = write(&[("roughness", values.clone()), ("B", other.clone())]);
    assert_eq!(read(&named).unwrap(), map);
    assert_eq!(map.size(), [3, 2]);
    let red = write(&[
        ("R", values.clone()),
        ("G", other.clone()),
        ("B", other.clone()),
    ]);
    assert_eq!(read(&red).unwrap(), map);
    assert_eq!(read(&write(&[("height", values.clone())])).unwrap(), map);
    let none = write(&[("G", values.clone()), ("B", other)]);
    assert_eq!(
        read(&none),
        Err(TextonError::Channel {
            wanted: "roughness or Y or R".to_owned(),
            found: "B, G".to_owned()
        })
    );
    for bad in [
        &[][..],
        b"no image at all",
        &named[..named.len() - 8],
        &named[..20],
    ] {
        assert!(
            matches!(read(bad), Err(TextonError::File { .. })),
            "{} bytes",
            bad.len()
        );
    }
    let mut nan = values;
    nan[4] = f32::NAN;
    assert!(matches!(
        read(&write(&[("Y", nan)])),
        Err(TextonError::Pixel {
            column: 1,
            row: 1,
            ..
        })
    ));
    // The header alone asks for more than is allowed: the last columns and rows of both windows.
    let mut large = named.clone();
    let window = [0_i32, 0, 2, 1].map(i32::to_le_bytes).concat();
    let places: Vec<usize> = (0..large.len() - 16)
        .filter(|&i| large[i..i + 16] == window[..])
        .collect();
    assert_eq!(places.len(), 2);
    for at in places {
        let last = [99_999_i32; 2].map(i32::to_le_bytes).concat();
        large[at + 8..at + 16].copy_from_slice(&last);
    }
    let result = read(&large);
    assert_eq!(refused(result), "samples of all layers and channels");
}
