//! Roughness maps from OpenEXR pictures.

use crate::common::pictures::picture;
use crate::common::refusals::pixel;
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
    let green = ("G", other.clone());
    let red = write(&[("R", values.clone()), green, ("B", other.clone())]);
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
        let bytes = bad.len();
        let read = read(bad);
        assert!(matches!(read, Err(TextonError::File { .. })), "{bytes}");
    }
    let mut nan = values;
    nan[4] = f32::NAN;
    assert_eq!(pixel(read(&write(&[("Y", nan)]))), [1, 1]);
}
