//! Which textures there can be.

use hwall_texton::{Layout, Texton, TextonError, Texture};

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
