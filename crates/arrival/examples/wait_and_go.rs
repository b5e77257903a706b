//! Where should the arm wait in a room, and in which configuration does it present a place?
//!
//! `cargo run --release -p hwall-arrival --example wait_and_go`

use hwall_arrival::glam::DVec3;
use hwall_arrival::kinematics::{Pose, SrsArm};
use hwall_arrival::motion::{MotionConfig, MotionLimits};
use hwall_arrival::reachability::{Interval, WallFacet, WallMaps, WallMapsConfig};
use hwall_arrival::{
    Atlas, AtlasConfig, BoardExtent, TouchRange, WaitingConfig, waiting_posture_of_maps,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arm = SrsArm::iiwa7().with_tool(Pose::from_translation(DVec3::Z * 0.02)?);
    let limits = MotionLimits::of_arm(&arm, &MotionConfig::default())?;
    let board = BoardExtent::default();
    // One wall in front of the arm, as from a scene file.
    let corner = |y: f64, z: f64| DVec3::new(0.62, y, z);
    let wall = WallFacet {
        point_m: corner(0.0, 0.5),
        normal: DVec3::X,
        heights: Interval::new(0.0, 1.2),
        outline_m: vec![
            corner(-0.6, 0.0),
            corner(0.6, 0.0),
            corner(0.6, 1.2),
            corner(-0.6, 1.2),
        ],
    };
    let maps = WallMaps::build(&arm, &[wall], WallMapsConfig::default())?;

    let (touches, config) = (TouchRange::default(), WaitingConfig::default());
    let found = waiting_posture_of_maps(&arm, &maps, &touches, board, &limits, &config)?;
    let degrees = found.q.0.map(|q| q.to_degrees().round());
    println!(
        "wait at {degrees:?} degrees, {:.0} mm behind the wall",
        1e3 * found.standoff_m
    );
    println!(
        "on average the board is there after {:.2} s",
        found.mean_arrival_s
    );

    let atlas_config = AtlasConfig::default();
    let atlas = Atlas::build(&arm, &maps, board, &limits, &found.q, &atlas_config)?;
    for (y, z) in [(0.0, 0.6), (0.3, 0.4), (-0.3, 0.8), (0.6, 1.2)] {
        match atlas.look_up(corner(y, z), DVec3::X) {
            Some(entry) => println!(
                "({y:4.1}, {z:3.1}): {:.2} s, clear way: {}, joints {:.2?} rad",
                entry.arrival_s, entry.clear, entry.q.0
            ),
            None => println!("({y:4.1}, {z:3.1}): out of reach"),
        }
    }
    Ok(())
}
