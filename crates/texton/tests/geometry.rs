//! Widths, spacings and encounters against numbers that were computed independently.

use hwall_texton::{Layout, ScanAngle, Texton, TextonError, Texture};

/// Geometry, angle in degrees, w, d (0: none), mean encounter, entry, neighbour, middle, leaves; all mm.
type Row = (f64, f64, f64, f64, f64, [i64; 2], f64, f64);

#[test]
fn the_released_texture_is_that_of_the_reference() {
    let rows: [Row; 2] = [
        (0.0, 6.0, 6.2, 6.820000000000001, 3.2, [1, 0], 6.2, 3.0),
        (
            45.0,
            4.47213595499958,
            3.1112698372208096,
            3.0499967213097143,
            1.8364001492461879,
            [0, 1],
            2.8001428534987287,
            1.341640786499874,
        ),
    ];
    let texture = Texture::released();
    for (deg, w, d, mean, enters, neighbour, middle, leaves) in rows {
        let scan = ScanAngle::from_deg(deg).unwrap();
        let met = texture.encounter(scan).unwrap();
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{deg}: {a} {b}");
        near(texture.texton().width_mm(scan), w);
        near(texture.spacing_mm(scan).unwrap(), d);
        near(texture.mean_encounter_mm(scan), mean);
        near(met.enters_mm, enters);
        near(met.middle_mm, middle);
        near(met.leaves_mm, leaves);
        assert_eq!(met.neighbour, neighbour);
    }
}

#[test]
fn bumps_may_touch_but_not_overlap() {
    let touching = Texture::hemiellipsoids([3.0, 1.0], 0.7, [6.0, 2.0]).unwrap();
    assert_eq!(touching.gap_mm(), 0.0);
    let overlap = Texture::hemiellipsoids([3.0, 1.0], 0.7, [6.0, 1.9]);
    assert!(matches!(
        overlap,
        Err(TextonError::Overlap {
            columns: 0,
            rows: 1,
            ..
        })
    ));
    let bump = Texton::hemiellipsoid([3.0, 1.0], 0.7).unwrap();
    let staggered = |short_mm| {
        Texture::new(
            bump,
            Layout::Staggered {
                long_mm: 6.2,
                short_mm,
            },
        )
    };
    assert!(staggered(1.75).is_ok());
    assert!(staggered(1.6).is_err());
}
