//! A small room for all tests.
#![allow(unreachable_pub)]

use glam::DVec3;
use hwall_arrival::kinematics::{ArmKinematics, JointPositions, Pose, SrsArm};
use hwall_arrival::motion::{MotionConfig, MotionLimits};
use hwall_arrival::reachability::{Interval, WallFacet, WallMaps, WallMapsConfig};
use hwall_arrival::{Atlas, AtlasConfig, AtlasNode, AtlasWall, BoardExtent, NodePlace, TouchRange};
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
pub fn wall(from: [f64; 2], to: [f64; 2], [low_m, high_m]: [f64; 2]) -> WallFacet {
    let [from, to] = [from, to].map(|[x, y]| DVec3::new(x, y, 0.0));
    let corners = [(from, low_m), (to, low_m), (to, high_m), (from, high_m)];
    WallFacet {
        point_m: 0.5 * (from + to) + DVec3::Z * (0.5 * (low_m + high_m)),
        normal: (to - from).cross(DVec3::Z).normalize(),
        heights: Interval::new(low_m, high_m),
        outline_m: corners.map(|(p, z)| p + DVec3::Z * z).to_vec(),
    }
}

/// A wall in front, and one that extends back from its left edge, as in the built-in room.
pub fn room() -> Vec<WallFacet> {
    let (corner, heights) = ([0.62, 0.2], [0.1, 1.1]);
    vec![
        wall([0.62, -0.6], corner, heights),
        wall(corner, [0.14, 0.84], heights),
    ]
}

/// Places 20 cm apart.
pub fn range() -> TouchRange {
    TouchRange {
        spacing_m: 0.2,
        ..TouchRange::default()
    }
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
    let maps = maps_of(&arm, &room());
    Atlas::build(&arm, &maps, BOARD, &limits(), &waiting(), config).expect("built")
}

/// An atlas with some of the coarse settings changed.
pub fn atlas_but(change: impl FnOnce(&mut AtlasConfig)) -> Atlas {
    let mut config = coarse();
    change(&mut config);
    atlas_with(&config)
}

/// All nodes with their places.
pub fn nodes(atlas: &Atlas) -> Vec<(&AtlasWall, NodePlace, &AtlasNode)> {
    let of_wall = |wall| {
        let wall: &AtlasWall = wall;
        let held = move |place| Some((wall, place, wall.node(place)?));
        wall.places().filter_map(held)
    };
    atlas.walls().iter().flat_map(of_wall).collect()
}

/// Every node holds the board at its place, within the limits, and knows its least time.
pub fn check_nodes(atlas: &Atlas, arm: &dyn ArmKinematics, accuracy: f64) {
    for (wall, place, node) in nodes(atlas) {
        let rotation = wall.plane().board_rotation(node.roll_rad);
        let wanted = Pose::new(rotation, wall.point_m(place)).expect("finite");
        let off = arm.forward(&node.q).distance(&wanted);
        assert!(
            off.position_m < accuracy && off.angle_rad < accuracy,
            "{place:?}: {off:?}"
        );
        for (limit, q) in arm.limits().iter().zip(node.q.0) {
            assert!(limit.contains(q), "{place:?}: {q}");
        }
        let least_s = atlas.limits().travel_time_s(atlas.waiting(), &node.q);
        assert_eq!(node.arrival_s.to_bits(), least_s.to_bits());
        assert_eq!(node.clear, node.excess_m == 0.0);
        assert!(node.excess_m >= 0.0 && node.overhang_m >= 0.0);
    }
}

/// The atlas of nodes 10 cm apart, built once for all tests.
pub static COARSE: LazyLock<Atlas> = LazyLock::new(|| atlas_with(&coarse()));
