//! Readers of binary files: maps, atlases, meshes, pictures. Checksums are recomputed after a mutation, because they protect
//! only against accidents.

use super::{Inputs, judged, promise};
use crc::{CRC_32_ISO_HDLC, Crc};
use glam::DVec3;
use hwall_arrival::reachability::{Interval, WallFacet, WallMaps, WallMapsConfig};
use hwall_arrival::{Atlas, AtlasConfig, BoardExtent};
use hwall_kinematics::{JointPositions, SrsArm};
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_reachability::{ExactConfig, ReachabilityMap, Steps, WallGrid};
use hwall_testkit::Verdict;
use hwall_texton::{
    HeightField, HeightSource, MaterialPicture, PngSource, Relief, StlFormat, TriangleMesh,
};
use std::path::{Path, PathBuf};

/// Bytes before the body of a map or an atlas, and of the checksum after it.
const HEADER: usize = 18;
const CHECKSUM: usize = 4;
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

pub(super) fn meshes() -> Inputs {
    let path = scratch("a.stl")?;
    let mesh = TriangleMesh::new(
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    )?;
    let file = |format| {
        mesh.write_stl(&path, format)?;
        Ok(std::fs::read(&path)?)
    };
    [StlFormat::Binary, StlFormat::Ascii]
        .map(file)
        .into_iter()
        .collect()
}

pub(super) fn heights() -> Inputs {
    let path = scratch("a.exr")?;
    let heights = (0..64).map(|i| 0.01 * i as f32).collect();
    HeightField::new(8, 0.1, heights)?.write_exr(&path)?;
    Ok(vec![std::fs::read(&path)?])
}

pub(super) fn pictures() -> Inputs {
    let mut picture = Vec::new();
    let mut encoder = png::Encoder::new(&mut picture, 64, 64);
    // Flipped bits must change pixels, not only the compression.
    encoder.set_compression(png::Compression::NoCompression);
    let grey: Vec<u8> = (0..64 * 64).map(|i| (i * i % 251) as u8).collect();
    encoder.write_header()?.write_image_data(&grey)?;
    Ok(vec![picture])
}

/// A file in a folder of this process, for readers that need a path.
pub(super) fn scratch(name: &str) -> anyhow::Result<PathBuf> {
    let folder = std::env::temp_dir().join(format!("hwall_attack_{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    Ok(folder.join(name))
}

/// Reads bytes from a file.
fn in_file(name: &str, bytes: &[u8], read: impl FnOnce(&Path) -> Verdict) -> Verdict {
    match scratch(name) {
        Ok(path) if std::fs::write(&path, bytes).is_ok() => read(&path),
        _ => Verdict::Broken("no place for the file".to_owned()),
    }
}

/// Corrects length and checksum.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut sealed = bytes.to_vec();
    let end = bytes.len().saturating_sub(CHECKSUM);
    if end < HEADER {
        return sealed;
    }
    let length = (end - HEADER) as u64;
    sealed[10..HEADER].copy_from_slice(&length.to_le_bytes());
    let sum = CRC.checksum(&sealed[..end]);
    sealed[end..].copy_from_slice(&sum.to_le_bytes());
    sealed
}

/// Corrects the checksums of the chunks of a PNG file.
fn sealed_png(bytes: &[u8]) -> Vec<u8> {
    let mut sealed = bytes.to_vec();
    let mut chunk = 8;
    while let Some(&[a, b, c, d]) = sealed.get(chunk..chunk + 4) {
        let end = chunk + 8 + u32::from_be_bytes([a, b, c, d]) as usize;
        let Some(body) = sealed.get(chunk + 4..end) else {
            break;
        };
        let sum = CRC.checksum(body).to_be_bytes();
        let Some(place) = sealed.get_mut(end..end + CHECKSUM) else {
            break;
        };
        place.copy_from_slice(&sum);
        chunk = end + CHECKSUM;
    }
    sealed
}

pub(super) fn maps() -> Inputs {
    let walls = [0.0, 0.7].map(|heading_rad| {
        Ok(WallGrid {
            heading_rad,
            distances: Steps::new(0.5, 0.2, 2)?,
            heights: Steps::new(0.2, 0.3, 2)?,
            span_m: None,
        })
    });
    let walls = walls.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    let config = ExactConfig {
        accuracy_m: 1e-3,
        ..ExactConfig::default()
    };
    let map = ReachabilityMap::build(&SrsArm::iiwa7(), &config, walls)?;
    Ok(vec![map.to_bytes()])
}

pub(super) fn read_map(bytes: &[u8]) -> Verdict {
    judged(ReachabilityMap::from_bytes(&sealed(bytes)), |map| {
        let lengths = map.lengths();
        let counted = lengths.reachable_m >= 0.0 && lengths.unknown_m >= 0.0;
        promise(counted, "a length that is none")?;
        for x in [0.3, 0.5, 0.7] {
            let point_m = DVec3::new(x, 0.1, 0.4);
            let _ = map.look_up(point_m, DVec3::NEG_X);
            let _ = map.look_up(point_m, DVec3::X);
            let _ = map.is_reachable(point_m, DVec3::X);
        }
        let again = ReachabilityMap::from_bytes(&map.to_bytes());
        promise(again.is_ok(), "a map that cannot read its own file")
    })
}

pub(super) fn atlases() -> Inputs {
    let arm = SrsArm::iiwa7();
    let heights = Interval::new(0.3, 0.7);
    let corner = |y: f64, z: f64| DVec3::new(0.62, y, z);
    let facet = WallFacet {
        point_m: corner(-0.1, 0.5),
        normal: DVec3::X,
        heights,
        outline_m: vec![
            corner(-0.3, 0.3),
            corner(0.1, 0.3),
            corner(0.1, 0.7),
            corner(-0.3, 0.7),
        ],
    };
    let maps = WallMaps::build(&arm, &[facet], WallMapsConfig::default())?;
    let board = BoardExtent {
        half_width_m: 0.1,
        half_height_m: 0.1,
    };
    let limits = MotionLimits::of_arm(&arm, &MotionConfig::default())?;
    let waiting = JointPositions::from_deg([38.8, 69.3, 53.3, 109.8, -25.8, 87.3, 21.4]);
    let config = AtlasConfig {
        spacing_m: 0.2,
        ..AtlasConfig::default()
    };
    let atlas = Atlas::build(&arm, &maps, board, &limits, &waiting, &config)?;
    Ok(vec![atlas.to_bytes()?])
}

pub(super) fn read_atlas(bytes: &[u8]) -> Verdict {
    judged(Atlas::from_bytes(&sealed(bytes)), |atlas| {
        for y in [-0.2, 0.0] {
            if let Some(entry) = atlas.look_up(DVec3::new(0.62, y, 0.5), DVec3::X) {
                let arrival_s = entry.arrival_s;
                let possible = arrival_s >= 0.0 && arrival_s.is_finite();
                promise(possible, "a time that is none")?;
            }
        }
        let again = atlas.to_bytes().and_then(|bytes| Atlas::from_bytes(&bytes));
        promise(again.is_ok(), "an atlas that cannot read its own file")
    })
}

pub(super) fn read_stl(bytes: &[u8]) -> Verdict {
    in_file("b.stl", bytes, |path| {
        judged(TriangleMesh::read_stl(path), |mesh| {
            let finite = mesh.points_mm().iter().flatten().all(|x| x.is_finite());
            promise(finite, "a point that is not finite")?;
            let points = mesh.points_mm().len() as u32;
            let within = mesh.triangles().iter().flatten().all(|i| *i < points);
            promise(within, "a corner that is none")?;
            let _ = mesh.check();
            Ok(())
        })
    })
}

pub(super) fn read_exr(bytes: &[u8]) -> Verdict {
    in_file("b.exr", bytes, |path| {
        let read = HeightField::read_exr(path, &HeightSource::default());
        judged(read, |field| {
            let finite = field.heights_mm().iter().all(|z| z.is_finite());
            promise(finite, "a height that is not finite")
        })
    })
}

pub(super) fn read_png(bytes: &[u8]) -> Verdict {
    let source = PngSource {
        width_mm: Some(20.0),
        relief_mm: None,
    };
    in_file("b.png", &sealed_png(bytes), |path| {
        let picture = MaterialPicture::read_png(path, &source);
        judged(picture.and_then(|picture| Relief::of(&picture)), |relief| {
            let finite = relief.height_mm.is_finite() && relief.slope > 0.0;
            promise(finite, "a relief that is not finite")
        })
    })
}
