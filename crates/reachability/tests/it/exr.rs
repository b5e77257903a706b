//! Maps as pictures, read back by the exr crate itself.

use crate::common::{grid, steps};
use exr::prelude::{ReadChannels, ReadLayers, read};
use hwall_kinematics::SrsArm;
use hwall_reachability::{
    ExactConfig, Interval, LineIndex, PictureConfig, ReachabilityError, ReachabilityMap,
};
use hwall_testkit::refused;
use std::io::Cursor;

fn map() -> ReachabilityMap {
    let distances = steps(0.6, -0.3, 3);
    let walls = vec![
        grid(0.0, distances, steps(-0.1, 0.2, 6)),
        grid(0.5, distances, steps(1.0, -0.25, 4)),
    ];
    ReachabilityMap::build(&SrsArm::iiwa7(), &ExactConfig::default(), walls).expect("built")
}

#[test]
fn a_layer_a_plane_with_its_place_and_shares() {
    let map = map();
    let config = PictureConfig {
        pixel_m: 0.02,
        span_m: Some(Interval::new(-0.9, 0.9)),
    };
    let bytes = map.to_exr(&config).expect("written");
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .expect("read");
    assert_eq!(image.layer_data.len(), 6);
    for (number, layer) in image.layer_data.iter().enumerate() {
        let (wall, plane) = (number / 3, number % 3);
        let [name, comment] = [&layer.attributes.layer_name, &layer.attributes.comments]
            .map(|text| text.as_ref().expect("given").to_string());
        assert_eq!(name, format!("wall{}.plane{plane:02}", wall + 1));
        let value = |key: &str| -> f64 {
            let line = comment
                .lines()
                .find_map(|l| l.strip_prefix(&format!("{key} = ")));
            line.expect("a line").parse().expect("a number")
        };
        let index = |height| LineIndex {
            wall,
            plane,
            height,
        };
        let place = map.line(index(0)).expect("of the map");
        assert_eq!(value("distance_m"), place.plane.distance_m());
        assert_eq!(value("heading_rad"), place.plane.heading_rad());
        let rows = if wall == 0 { 6 } else { 4 };
        assert_eq!((layer.size.x(), layer.size.y()), (90, rows));
        let channel = |name: &str| -> Vec<f32> {
            let mut channels = layer.channel_data.list.iter();
            let found = channels.find(|c| c.name.to_string() == name);
            let samples = &found.expect("a channel").sample_data;
            samples.values_as_f32().collect()
        };
        let (reachable, unproven) = (channel("reachable"), channel("unproven"));
        for row in 0..rows {
            // The highest row on top, for ascending and descending heights.
            let height = if wall == 0 { rows - 1 - row } else { row };
            let index = index(height);
            let shares = &reachable[row * 90..(row + 1) * 90];
            let sum: f64 = shares.iter().map(|s| f64::from(*s) * 0.02).sum();
            let length: f64 = map.intervals(index).iter().map(|i| i.span.length_m()).sum();
            assert!((sum - length).abs() < 1e-6, "{index:?}: {sum} {length}");
            for (column, share) in shares.iter().enumerate() {
                let s = -0.9 + 0.02 * (column as f64 + 0.5);
                let inside = map.intervals(index).iter().any(|i| i.span.contains(s));
                let whole = *share < 1e-6 || *share > 1.0 - 1e-6;
                assert!(!whole || inside == (*share > 0.5), "{index:?} {s} {share}");
            }
        }
        assert!(unproven.iter().all(|share| (0.0..=1e-3).contains(share)));
    }
}

#[test]
fn the_same_map_gives_the_same_bytes() {
    let config = PictureConfig::default();
    let bytes = map().to_exr(&config).expect("written");
    assert_eq!(map().to_exr(&config).expect("written"), bytes);
    let path = std::env::temp_dir().join(format!("hwall-map-{}.exr", std::process::id()));
    map().write_exr(&path, &config).expect("written");
    assert_eq!(std::fs::read(&path).expect("read"), bytes);
    std::fs::remove_file(&path).expect("removed");
    let nowhere = path.join("x.exr");
    assert!(matches!(
        map().write_exr(&nowhere, &config),
        Err(ReachabilityError::File { .. })
    ));
}

#[test]
fn pictures_that_make_no_sense_are_refused() {
    let map = map();
    let to_exr = |config: PictureConfig| map.to_exr(&config);
    refused!(PictureConfig::default(), to_exr, {
        pixel_m = 0.0, -0.1, f64::NAN, f64::INFINITY;
        span_m = Some(Interval::new(0.5, 0.5)), Some(Interval::new(0.5, 0.1)) => "length of the picture";
        span_m = Some(Interval::new(0.0, f64::INFINITY)) => "length of the picture";
        span_m = Some(Interval::new(f64::NAN, 1.0)) => "start of the picture";
    });
    let fine = PictureConfig {
        pixel_m: 1e-12,
        ..PictureConfig::default()
    };
    let fine = map.to_exr(&fine);
    assert!(matches!(fine, Err(ReachabilityError::TooMany { .. })));
}
