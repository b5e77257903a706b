//! An arm without a closed form: joints from a table, the common interface, inverse kinematics by search.
//!
//! `cargo run -p hwall-kinematics --example any_chain`
//!
//! With the feature `urdf`, `Chain::from_urdf_file` makes the chain from a file.

use hwall_kinematics::glam::DVec3;
use hwall_kinematics::{
    ArmKinematics, Chain, ChainArm, ChainJoint, JointLimit, JointPositions, KinematicsError,
    NearestConfig, Pose, SrsArm,
};

/// Six revolute joints, each with its position in the previous link (m), its axis, and half its range (degrees).
const JOINTS: [([f64; 3], [f64; 3], f64); 6] = [
    ([0.0, 0.0, 0.30], [0.0, 0.0, 1.0], 170.0),
    ([0.0, 0.0, 0.05], [0.0, 1.0, 0.0], 120.0),
    ([0.0, 0.0, 0.40], [0.0, 1.0, 0.0], 150.0),
    ([0.0, 0.0, 0.10], [0.0, 0.0, 1.0], 170.0),
    ([0.0, 0.0, 0.30], [0.0, 1.0, 0.0], 120.0),
    ([0.0, 0.0, 0.08], [0.0, 0.0, 1.0], 175.0),
];

fn six_joints() -> Result<ChainArm, KinematicsError> {
    let mut joints = Vec::new();
    for (i, (origin_m, axis, half_range_deg)) in JOINTS.into_iter().enumerate() {
        let origin = Pose::from_translation(DVec3::from_array(origin_m))?;
        let limit = JointLimit::symmetric_deg(half_range_deg);
        joints.push(ChainJoint {
            max_velocity: Some(2.0),
            ..ChainJoint::revolute(format!("joint {i}"), origin, DVec3::from_array(axis), limit)
        });
    }
    ChainArm::new(Chain::new(
        joints,
        Pose::from_translation(DVec3::Z * 0.05)?,
    )?)
}

fn main() -> Result<(), KinematicsError> {
    let (iiwa, own) = (SrsArm::iiwa7(), six_joints()?);
    let arms: [(&str, &dyn ArmKinematics); 2] = [("iiwa 7", &iiwa), ("six joints", &own)];
    for (name, arm) in arms {
        let start = JointPositions::from_deg([10.0, 40.0, 0.0, -60.0, 30.0, -20.0, 0.0]);
        let here = arm.forward(&start);
        let there = here.at(here.position_m() + DVec3::new(-0.05, 0.10, -0.05));
        let mut scratch = arm.scratch(); // so that a control step does not allocate
        match arm.nearest(&there, &start, &NearestConfig::default(), &mut scratch) {
            Ok(next) => {
                let error = arm.forward(&next.q).distance(&there);
                println!(
                    "{name}: {} joints, moves {:.3} rad, {:.0e} m and {:.0e} rad off",
                    arm.joint_count(),
                    next.largest_move_rad,
                    error.position_m,
                    error.angle_rad
                );
            }
            Err(reason) => println!("{name}: {reason}"),
        }
    }
    Ok(())
}
