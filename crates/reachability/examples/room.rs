//! Where can the board be presented on the walls of a room, and what is the nearest alternative?
//!
//! `cargo run -p hwall-reachability --example room`

use glam::DVec3;
use hwall_kinematics::{Pose, SrsArm};
use hwall_reachability::{
    Interval, Presented, ReachabilityError, WallFacet, WallMaps, WallMapsConfig,
};

fn main() -> Result<(), ReachabilityError> {
    // The board's face is 0.1 m in front of the flange.
    let arm = SrsArm::iiwa7().with_tool(Pose::from_translation(DVec3::Z * 0.1)?);
    // A wall in front of the arm and one on its left, as from a scene file.
    let wall = |point_m: DVec3, normal: DVec3| {
        let along = DVec3::Z.cross(normal) * 1.5;
        WallFacet {
            point_m,
            normal,
            heights: Interval::new(0.0, 1.4),
            outline_m: vec![point_m - along, point_m + along],
        }
    };
    let walls = [
        wall(DVec3::new(0.7, 0.0, 0.0), DVec3::X),
        wall(DVec3::new(0.0, 0.6, 0.0), DVec3::Y),
    ];
    let maps = WallMaps::build(&arm, &walls, WallMapsConfig::default())?;
    for (point_m, normal) in [
        (DVec3::new(0.7, 0.1, 0.5), DVec3::X),
        (DVec3::new(0.7, 1.2, 0.5), DVec3::X),
        (DVec3::new(-0.2, 0.6, 1.2), DVec3::Y),
        (DVec3::new(0.0, 3.0, 0.5), DVec3::Y),
    ] {
        match maps.present(point_m, normal) {
            Presented::Reachable => println!("{point_m:.2} m: there"),
            Presented::Nearest(place_m) => {
                let off_m = place_m.distance(point_m);
                println!("{point_m:.2} m: at {place_m:.3} m instead, {off_m:.3} m away");
            }
            Presented::Unknown => println!("{point_m:.2} m: on none of these walls"),
        }
    }
    Ok(())
}
