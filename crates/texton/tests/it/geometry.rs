//! Valid textures and their geometry.

use crate::common::bumps::{hemiellipsoids, radii, staggered};
use hwall_texton::{ScanAngle, TextonError, Texture};
use std::f64::consts::FRAC_PI_2;

#[test]
fn bumps_may_touch_but_not_overlap() {
    let touching = hemiellipsoids(radii(3.0, 1.0), 0.7, [6.0, 2.0]).unwrap();
    assert_eq!(touching.gap_mm(), 0.0);
    let overlap = hemiellipsoids(radii(3.0, 1.0), 0.7, [6.0, 1.9]);
    assert!(matches!(
        overlap,
        Err(TextonError::Overlap {
            columns: 0,
            rows: 1,
            ..
        })
    ));
    assert!(staggered(6.2, 1.75).is_ok());
    assert!(staggered(6.2, 1.6).is_err());
}

#[test]
fn scans_all_but_along_an_axis_meet_what_those_along_it_meet() {
    for texture in [Texture::released(), staggered(6.5, 2.2).unwrap()] {
        let met = |rad: f64| texture.encounter(ScanAngle::from_rad(rad).unwrap());
        let same = |rad: f64, axis: ScanAngle| {
            let (near, exact) = (met(rad).unwrap(), texture.encounter(axis).unwrap());
            assert_eq!(near.neighbour, exact.neighbour, "{rad}");
            assert!((near.enters_mm - exact.enters_mm).abs() < 1e-9, "{rad}");
            assert!((near.middle_mm - exact.middle_mm).abs() < 1e-9, "{rad}");
        };
        for rad in [5e-324, 1e-300, 1e-20, 1e-12] {
            same(rad, ScanAngle::ALONG);
            same(std::f64::consts::PI - rad, ScanAngle::ALONG);
        }
        for below in [1e-17, 2e-16, 1e-12] {
            same(FRAC_PI_2 - below, ScanAngle::ACROSS);
        }
    }
}

#[test]
fn round_bumps_feel_alike_in_every_direction() {
    let texture = hemiellipsoids(radii(1.2, 1.2), 0.7, [3.0, 3.0]).unwrap();
    for deg in 0..=90 {
        let scan = ScanAngle::from_deg(f64::from(deg)).unwrap();
        let across = ScanAngle::from_deg(f64::from(90 - deg)).unwrap();
        let texton = texture.texton();
        assert!((texton.width_mm(scan) - 2.4).abs() < 1e-12);
        assert!((texton.breadth_mm(scan) - 2.4).abs() < 1e-12);
        assert!((texture.mean_encounter_mm(scan) - 9.0 / 2.4).abs() < 1e-12);
        // d is the distance to the next row if its bumps are met.
        let sin = scan.sin();
        let spacing = match deg {
            0 => Some(3.0),
            _ if scan.rad() >= texture.least_spaced_rad() => Some(3.0 / sin),
            _ => None,
        };
        assert_eq!(texture.spacing_mm(scan), spacing, "{deg}");
        // A square grid of round bumps is its own mirror image across the diagonal.
        let [met, mirrored] = [scan, across].map(|s| texture.encounter(s).unwrap());
        assert!((met.leaves_mm - 1.2).abs() < 1e-12);
        assert!((met.enters_mm - mirrored.enters_mm).abs() < 1e-9, "{deg}");
        assert!((met.middle_mm - mirrored.middle_mm).abs() < 1e-9, "{deg}");
        // Across a row the bump met may be either of a symmetric pair; the path over it is within its width.
        let half_mm = met.middle_mm - met.enters_mm;
        assert!((0.0..=1.2 + 1e-12).contains(&half_mm), "{deg}");
    }
    let met = texture.encounter(ScanAngle::ALONG).unwrap();
    assert!((met.gap_mm() - 0.6).abs() < 1e-12);
    assert!((texture.gap_mm() - 0.6).abs() < 1e-12);
}

#[test]
fn staggered_rows_are_met_where_they_stand() {
    let texture = staggered(6.5, 2.2).unwrap();
    let least = texture.least_spaced_rad();
    assert!((least.to_degrees() - 19.39).abs() < 0.01);
    let row = |rad: f64| {
        let scan = ScanAngle::from_rad(rad).unwrap();
        let rows = texture.spacing_mm(scan)? * scan.sin() / 2.2;
        Some((rows * 1e6).round() / 1e6)
    };
    assert_eq!(row(least - 1e-6), None);
    assert_eq!(row(least + 1e-6), Some(1.0));
    let passed = f64::atan2(2.2, 0.25);
    assert!((passed.to_degrees() - 83.5).abs() < 0.05);
    assert_eq!(row(passed - 1e-6), Some(1.0));
    assert_eq!(row(passed + 1e-6), Some(2.0));
    assert_eq!(row(FRAC_PI_2), Some(2.0));
}
