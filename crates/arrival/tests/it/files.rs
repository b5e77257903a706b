//! Atlas files: complete round trips, and rejection of everything else.

use crate::common::{COARSE, atlas_but};
use hwall_arrival::reachability::BinaryFileError;
use hwall_arrival::{ArrivalError, Atlas};
use hwall_testkit::{Verdict, attack};

fn small() -> Atlas {
    atlas_but(|c| c.spacing_m = 0.3)
}

#[test]
fn files_hold_all() {
    let atlas = &*COARSE;
    let bytes = atlas.to_bytes().unwrap();
    let again = Atlas::from_bytes(&bytes).expect("read");
    assert_eq!(&again, atlas);
    assert_eq!(again.to_bytes().unwrap(), bytes);
    let path = std::env::temp_dir().join(format!("hwall-atlas-{}.bin", std::process::id()));
    atlas.save(&path).expect("written");
    assert_eq!(&Atlas::load(&path).expect("read"), atlas);
    std::fs::remove_file(&path).expect("removed");
    assert!(matches!(
        Atlas::load(&path),
        Err(ArrivalError::File {
            kind: std::io::ErrorKind::NotFound,
            ..
        })
    ));
}

#[test]
fn bad_files_are_named() {
    let bytes = small().to_bytes().unwrap();
    let error = |bytes: &[u8]| match Atlas::from_bytes(bytes).expect_err("bad") {
        ArrivalError::Atlas(error) => error,
        other => panic!("{other}"),
    };
    // The tests of reachability maps, which are stored in the same format, cut and change every byte.
    let short = error(&bytes[..bytes.len() - 1]);
    assert!(matches!(short, BinaryFileError::WrongLength { .. }));
    let mut damaged = bytes.clone();
    damaged[30] ^= 0x40;
    assert!(matches!(error(&damaged), BinaryFileError::Damaged { .. }));
    assert_eq!(error(b"HWALLMAP"), BinaryFileError::Foreign, "a map");
}

/// Changes in the body with a corrected checksum: whatever is accepted is a valid atlas.
#[test]
fn forged_files_do_no_harm() {
    let bytes = small().to_bytes().unwrap();
    let (head, body) = (&bytes[..10], bytes[18..bytes.len() - 4].to_vec());
    let report = attack("atlas", &[body], 3000, 11, |body| {
        let length = (body.len() as u64).to_le_bytes();
        let mut forged = [head, &length, body].concat();
        let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&forged);
        forged.extend(checksum.to_le_bytes());
        let Ok(atlas) = Atlas::from_bytes(&forged) else {
            return Verdict::Refused;
        };
        for node in atlas.nodes() {
            let mut in_limits = atlas.arm().unwrap().limits().iter().zip(node.q.0);
            assert!(in_limits.all(|(limit, q)| limit.contains(q)));
            assert!(node.arrival_s.is_finite() && node.overhang_m.is_finite());
        }
        Verdict::Accepted
    });
    assert_eq!(report.findings, 0, "{report:?}");
    // Most of the body is configurations, which must present the board at their nodes.
    assert!(report.refused > 2000, "{report:?}");
}
