//! A small room for all tests.
#![allow(unreachable_pub)]

use glam::DVec3;
use hwall_arrival::kinematics::{JointPositions, Pose, SrsArm};
use hwall_arrival::motion::{MotionConfig, MotionLimits};
use hwall_arrival::reachability::{Interval, WallFacet, WallMaps, WallMapsConfig};
use hwall_arrival::{Atlas, AtlasConfig, BoardExtent};
use std::sync::LazyLock;

pub const BOARD: BoardExtent = BoardExtent {
    half_width_m: 0.1,
    half_height_m: 0.1,
};

/// The board's face 2 cm before the flange.
pub fn arm() -> SrsArm {
    SrsArm::iiwa7().with_tool(Pose::from_translation(DVec3::Z * 0.02).expect("finite"))
}

pub fn limits() -> MotionLimits {
    MotionLimits::of_arm(&arm(), &MotionConfig::default()).expect("valid")
}

/// Pulls the board back from the front wall by about 13 cm.
pub fn waiting() -> JointPositions {
    JointPositions::from_deg([38.8, 69.3, 53.3, 109.8, -25.8, 87.3, 21.4])
}

/// A wall from `from` to `to` on the floor plan, with the person on the side a quarter turn to the right of its direction.
pub fn wall(from: DVec3, to: DVec3, heights: Interval) -> WallFacet {
    let normal = (to - from).cross(DVec3::Z).normalize();
    let corner = |p: DVec3, z: f64| DVec3::new(p.x, p.y, z);
    WallFacet {
        point_m: corner(0.5 * (from + to), 0.5 * (heights.lo_m + heights.hi_m)),
        normal,
        heights,
        outline_m: vec![
            corner(from, heights.lo_m),
            corner(to, heights.lo_m),
            corner(to, heights.hi_m),
            corner(from, heights.hi_m),
        ],
    }
}

/// A wall in front, and one that extends back from its left edge, as in the built-in room.
pub fn room() -> Vec<WallFacet> {
    let heights = Interval::new(0.1, 1.1);
    let corner = DVec3::new(0.62, 0.2, 0.0);
    vec![
        wall(DVec3::new(0.62, -0.6, 0.0), corner, heights),
        wall(corner, DVec3::new(0.14, 0.84, 0.0), heights),
    ]
}

pub fn maps_of(arm: &SrsArm, facets: &[WallFacet]) -> WallMaps {
    WallMaps::build(arm, facets, WallMapsConfig::default()).expect("valid")
}

/// Nodes 10 cm apart.
pub fn coarse() -> AtlasConfig {
    AtlasConfig {
        spacing_m: 0.1,
        ..AtlasConfig::default()
    }
}

pub fn atlas_with(config: &AtlasConfig) -> Atlas {
    let arm = arm();
    Atlas::build(
        &arm,
        &maps_of(&arm, &room()),
        BOARD,
        &limits(),
        &waiting(),
        config,
    )
    .expect("built")
}

/// The atlas of nodes 10 cm apart, built once for all tests.
pub static COARSE: LazyLock<Atlas> = LazyLock::new(|| atlas_with(&coarse()));
