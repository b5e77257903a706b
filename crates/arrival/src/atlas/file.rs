//! Atlas files: versioned, checksummed, identical bytes on every machine.
//!
//! Stored as a [`BinaryFormat`], like maps. Times are not stored: they follow from the limits.

use super::build::{Atlas, MOST_NODES, check_waiting};
use super::config::{AtlasConfig, check_rolls};
use super::wall::{AtlasNode, AtlasWall, StoredNode};
use crate::board::BoardExtent;
use crate::error::ArrivalError;
use hwall_kinematics::{JointPositions, MOST_JOINTS, SrsArm, SrsParameters};
use hwall_motion::MotionLimits;
use hwall_reachability::{BinaryFormat, Steps, WallPlane};
use serde::{Deserialize, Serialize};
use std::path::Path;

const FORMAT: BinaryFormat = BinaryFormat {
    magic: *b"HWALLATL",
    format: 1,
};

/// Tolerance with which a stored configuration must present the board at its node, m and rad.
const HELD: f64 = 1e-6;

#[derive(Serialize, Deserialize)]
struct Body {
    arm: SrsParameters,
    velocity_rad_per_s: [f64; MOST_JOINTS],
    acceleration_rad_per_s2: [f64; MOST_JOINTS],
    jerk_rad_per_s3: [f64; MOST_JOINTS],
    board: BoardExtent,
    waiting: [f64; MOST_JOINTS],
    rolls_rad: Vec<f64>,
    off_m: f64,
    tilt_rad: f64,
    seam_rad: f64,
    walls: Vec<StoredWall>,
}

#[derive(Serialize, Deserialize)]
struct StoredWall {
    heading_rad: f64,
    distance_m: f64,
    along: Steps,
    heights: Steps,
    nodes: Vec<Option<StoredNode>>,
}

impl Atlas {
    /// The atlas as bytes.
    ///
    /// # Errors
    /// [`ArrivalError::NotStored`] for an arm without a closed form.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ArrivalError> {
        let arm = self.arm.as_ref().ok_or(ArrivalError::NotStored)?;
        let stored_node = |node: &AtlasNode| {
            let is_roll = |roll: &f64| roll.to_bits() == node.roll_rad.to_bits();
            StoredNode {
                q: node.q.0,
                roll: self.rolls_rad.iter().position(is_roll).unwrap_or(0) as u8,
                excess_m: node.excess_m,
                overhang_m: node.overhang_m,
            }
        };
        let stored_wall = |wall: &AtlasWall| StoredWall {
            heading_rad: wall.plane.heading_rad(),
            distance_m: wall.plane.distance_m(),
            along: wall.along,
            heights: wall.heights,
            nodes: wall
                .nodes
                .iter()
                .map(|node| node.as_ref().map(stored_node))
                .collect(),
        };
        let body = Body {
            arm: *arm.parameters(),
            velocity_rad_per_s: self.limits.velocity_rad_per_s,
            acceleration_rad_per_s2: self.limits.acceleration_rad_per_s2,
            jerk_rad_per_s3: self.limits.jerk_rad_per_s3,
            board: self.board,
            waiting: self.waiting.0,
            rolls_rad: self.rolls_rad.clone(),
            off_m: self.off_m,
            tilt_rad: self.tilt_rad,
            seam_rad: self.seam_rad,
            walls: self.walls.iter().map(stored_wall).collect(),
        };
        Ok(FORMAT.to_bytes(&body))
    }

    /// An atlas from bytes that [`to_bytes`](Self::to_bytes) made.
    ///
    /// # Errors
    /// Foreign, newer, truncated, damaged or malformed bytes: each has its own variant of `BinaryFileError`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ArrivalError> {
        FORMAT.from_bytes::<Body>(bytes)?.into_atlas()
    }

    /// Writes the atlas to a file.
    ///
    /// # Errors
    /// The file cannot be written, and as [`to_bytes`](Self::to_bytes).
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), ArrivalError> {
        let path = path.as_ref();
        hwall_files::write(path, self.to_bytes()?).map_err(|error| ArrivalError::file(path, &error))
    }

    /// Reads an atlas from a file.
    ///
    /// # Errors
    /// The file cannot be read, or as [`from_bytes`](Self::from_bytes).
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ArrivalError> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|error| ArrivalError::file(path, &error))?;
        Self::from_bytes(&bytes)
    }
}

impl Body {
    fn into_atlas(self) -> Result<Atlas, ArrivalError> {
        let malformed = ArrivalError::malformed;
        let arm = SrsArm::new(self.arm).map_err(|_| malformed("arm"))?;
        let limits = MotionLimits {
            velocity_rad_per_s: self.velocity_rad_per_s,
            acceleration_rad_per_s2: self.acceleration_rad_per_s2,
            jerk_rad_per_s3: self.jerk_rad_per_s3,
        };
        limits.validate()?;
        self.board.validate()?;
        let waiting = JointPositions(self.waiting);
        check_waiting(&arm, &waiting)?;
        check_rolls(&self.rolls_rad)?;
        AtlasConfig {
            off_m: self.off_m,
            tilt_rad: self.tilt_rad,
            seam_rad: self.seam_rad,
            ..AtlasConfig::default()
        }
        .validate()?;
        let count: u128 = self.walls.iter().map(|w| w.nodes.len() as u128).sum();
        if count > MOST_NODES {
            return Err(ArrivalError::TooMany {
                what: "nodes",
                count,
                limit: MOST_NODES,
            });
        }
        let mut atlas = Atlas {
            arm: Some(arm.clone()),
            limits,
            board: self.board,
            waiting,
            rolls_rad: self.rolls_rad,
            walls: Vec::with_capacity(self.walls.len()),
            off_m: self.off_m,
            least_cosine: self.tilt_rad.cos(),
            tilt_rad: self.tilt_rad,
            seam_rad: self.seam_rad,
        };
        for wall in self.walls {
            let wall = wall.checked(&arm, &atlas)?;
            atlas.walls.push(wall);
        }
        if atlas.walls.is_empty() {
            return Err(malformed("no walls"));
        }
        Ok(atlas)
    }
}

impl StoredWall {
    /// The wall, if every stored configuration presents its node.
    fn checked(self, arm: &SrsArm, atlas: &Atlas) -> Result<AtlasWall, ArrivalError> {
        let malformed = ArrivalError::malformed;
        let places = self.along.count() as u128 * self.heights.count() as u128;
        if places != self.nodes.len() as u128 {
            return Err(malformed("count of nodes"));
        }
        let mut wall = AtlasWall {
            plane: WallPlane::new(self.heading_rad, self.distance_m)?,
            along: self.along,
            heights: self.heights,
            nodes: vec![None; self.nodes.len()],
            seam_rad: atlas.seam_rad,
        };
        for (index, place) in wall.places().enumerate() {
            let Some(stored) = self.nodes[index] else {
                continue;
            };
            let roll = atlas.rolls_rad.get(usize::from(stored.roll));
            let roll_rad = *roll.ok_or(malformed("roll of a node"))?;
            let q = JointPositions(stored.q);
            check_waiting(arm, &q).map_err(|_| malformed("configuration of a node"))?;
            let point_m = wall.point_m(place);
            let pose = arm.forward(&q);
            let turned = wall.plane.board_rotation(roll_rad) - pose.rotation();
            let off = pose.position_m().distance(point_m);
            // NaN, which results from huge places, fails the comparison.
            let within = |error: f64| error.abs() <= HELD;
            if !(within(off) && turned.to_cols_array().into_iter().all(within)) {
                return Err(malformed("a node that its configuration does not hold"));
            }
            for (what, length_m) in [
                ("excess of a node", stored.excess_m),
                ("overhang of a node", stored.overhang_m),
            ] {
                if !(length_m >= 0.0 && length_m.is_finite()) {
                    return Err(malformed(what));
                }
            }
            wall.nodes[index] = Some(AtlasNode {
                q,
                roll_rad,
                arrival_s: atlas.limits.travel_time_s(&atlas.waiting, &q),
                clear: stored.excess_m == 0.0,
                excess_m: stored.excess_m,
                overhang_m: stored.overhang_m,
            });
        }
        Ok(wall)
    }
}
