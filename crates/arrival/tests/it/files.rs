//! Atlases as files: all comes back, and nothing else is taken for an atlas.

use crate::common::{atlas_with, coarse};
use hwall_arrival::{ArrivalError, Atlas, AtlasConfig};
use hwall_testkit::Sampler;

fn small() -> Atlas {
    atlas_with(&AtlasConfig {
        spacing_m: 0.3,
        ..coarse()
    })
}

#[test]
fn files_hold_all() {
    let atlas = atlas_with(&coarse());
    let bytes = atlas.to_bytes().unwrap();
    let again = Atlas::from_bytes(&bytes).expect("read");
    assert_eq!(again, atlas);
    assert_eq!(again.to_bytes().unwrap(), bytes);
    let path = std::env::temp_dir().join(format!("hwall-atlas-{}.bin", std::process::id()));
    atlas.save(&path).expect("written");
    assert_eq!(Atlas::load(&path).expect("read"), atlas);
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
    for length in 0..bytes.len() {
        let error = Atlas::from_bytes(&bytes[..length]).expect_err("truncated");
        let expected = if length < 8 {
            matches!(error, ArrivalError::ForeignFile)
        } else {
            matches!(error, ArrivalError::WrongFileLength { .. })
        };
        assert!(expected, "{length}: {error}");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert!(matches!(
        Atlas::from_bytes(&longer),
        Err(ArrivalError::WrongFileLength { .. })
    ));
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x40;
        let error = Atlas::from_bytes(&damaged).expect_err("damaged");
        let expected = match at {
            0..8 => matches!(error, ArrivalError::ForeignFile),
            8..10 => matches!(error, ArrivalError::NewerFile { .. }),
            10..18 => matches!(error, ArrivalError::WrongFileLength { .. }),
            _ => matches!(error, ArrivalError::DamagedFile { .. }),
        };
        assert!(expected, "{at}: {error}");
    }
    for foreign in [&b""[..], b"solid", &[0; 64], b"HWALLMAP"] {
        assert_eq!(
            Atlas::from_bytes(foreign).expect_err("foreign"),
            ArrivalError::ForeignFile
        );
    }
}

/// Changes in the body with a checksum that is right again: what comes through is an atlas, whatever was changed.
#[test]
fn forged_files_do_no_harm() {
    let bytes = small().to_bytes().unwrap();
    let body = 18..bytes.len() - 4;
    let mut sampler = Sampler::new(11);
    let (mut read, mut refused) = (0, 0);
    for _ in 0..3000 {
        let mut forged = bytes.clone();
        for _ in 0..=sampler.index(4) {
            let at = body.start + sampler.index(body.len());
            match sampler.index(4) {
                0 => forged[at] ^= 1 << sampler.index(8),
                1 => forged[at] = sampler.index(256) as u8,
                2 => forged[at] = 0xff,
                // NaN where a number happens to begin.
                _ => {
                    let end = (at + 8).min(body.end);
                    forged[at..end].fill(0xff);
                }
            }
        }
        let end = forged.len() - 4;
        let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&forged[..end]);
        forged[end..].copy_from_slice(&checksum.to_le_bytes());
        match Atlas::from_bytes(&forged) {
            Ok(atlas) => {
                read += 1;
                for node in atlas.nodes() {
                    let in_limits = atlas.arm().unwrap().limits().iter().zip(node.q.0);
                    assert!(in_limits.into_iter().all(|(limit, q)| limit.contains(q)));
                    assert!(node.arrival_s.is_finite() && node.overhang_m.is_finite());
                }
            }
            Err(error) => {
                refused += 1;
                assert!(!error.to_string().is_empty());
            }
        }
    }
    // Most of the body is configurations, which must hold the board where they say.
    assert!(refused > 2000, "{read} read, {refused} refused");
}
