//! Forged maps: changed content with a corrected checksum.

use crate::common::{exact_config, grid, steps};
use glam::DVec3;
use hwall_kinematics::SrsArm;
use hwall_reachability::{Capsule, Carried, KeepOutBox, Plate, ReachabilityMap};

const HALF_WIDTH_M: f64 = 0.123_456_789;
const HALF_HEIGHT_M: f64 = 0.098_765_432;
const THICKNESS_M: f64 = 0.012_345_678;
const RADIUS_M: f64 = 0.054_321_098;

fn map() -> Vec<u8> {
    let config = exact_config(|c| c.accuracy_m = 1e-3);
    let walls = vec![grid(0.0, steps(0.5, 0.2, 2), steps(0.2, 0.3, 2))];
    let map = ReachabilityMap::build(&SrsArm::iiwa7(), &config, walls).unwrap();
    let solid = KeepOutBox::from_corners("table", DVec3::splat(-0.3), DVec3::new(0.3, 0.3, 0.0));
    let carried = Carried {
        plate: Some(Plate {
            half_width_m: HALF_WIDTH_M,
            half_height_m: HALF_HEIGHT_M,
            thickness_m: THICKNESS_M,
        }),
        last_link: Some(Capsule {
            ends_m: [DVec3::ZERO, DVec3::NEG_Z * 0.1],
            radius_m: RADIUS_M,
        }),
    };
    let kept = map.with_keep_out(vec![solid.unwrap()], carried);
    kept.unwrap().to_bytes()
}

/// The map with one number replaced, and the matching checksum.
fn forged(bytes: &[u8], from: f64, to: f64) -> Vec<u8> {
    let mut forged = bytes.to_vec();
    let from = from.to_le_bytes();
    let at = bytes.windows(8).position(|w| w == from).expect("stored");
    forged[at..at + 8].copy_from_slice(&to.to_le_bytes());
    let end = forged.len() - 4;
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&forged[..end]);
    forged[end..].copy_from_slice(&sum.to_le_bytes());
    forged
}

#[test]
fn loads_that_cannot_be_are_refused() {
    let bytes = map();
    assert!(ReachabilityMap::from_bytes(&forged(&bytes, RADIUS_M, 0.05)).is_ok());
    for (of, to) in [
        (HALF_WIDTH_M, -0.1),
        (HALF_WIDTH_M, 0.0),
        (HALF_HEIGHT_M, f64::NAN),
        (THICKNESS_M, -1e-9),
        (RADIUS_M, f64::INFINITY),
        (RADIUS_M, -0.01),
    ] {
        let read = ReachabilityMap::from_bytes(&forged(&bytes, of, to));
        assert!(read.is_err(), "{of} -> {to}");
    }
}
