//! Can the arm hold its flange at these poses, in how many ways, and if not, why?
//!
//! `cargo run -p hwall-kinematics --example hold_poses`

use hwall_kinematics::glam::{DQuat, DVec3};
use hwall_kinematics::{JointPositions, KinematicsError, NearestConfig, Pose, SrsArm};
use std::f64::consts::FRAC_PI_2;

fn main() -> Result<(), KinematicsError> {
    let arm = SrsArm::iiwa7();
    let now = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
    let forwards = DQuat::from_rotation_y(FRAC_PI_2);
    let backwards = DQuat::from_rotation_y(-FRAC_PI_2);
    for (what, rotation, position_m) in [
        ("ahead", forwards, DVec3::new(0.6, 0.0, 0.5)),
        ("higher up", forwards, DVec3::new(0.5, 0.0, 0.9)),
        ("far away", forwards, DVec3::new(1.2, 0.0, 0.5)),
        ("facing itself", backwards, DVec3::new(0.25, 0.0, 0.4)),
    ] {
        let base_from_flange = Pose::from_quat(rotation, position_m)?;
        let free = match arm.feasible_arm_angles(&base_from_flange) {
            Ok(free) => free,
            Err(reason) => {
                println!("{what}: out of reach, {reason}");
                continue;
            }
        };
        // The elbow can rotate about the line from shoulder to wrist, on each of up to eight branches.
        println!("{what}: within reach");
        for branch in free.branches() {
            let width_rad: f64 = free.arcs(branch).map(|arc| arc.width_rad()).sum();
            let [shoulder, elbow, wrist] = [
                branch.shoulder_negative,
                !branch.elbow_positive,
                branch.wrist_negative,
            ]
            .map(|negative| if negative { '-' } else { '+' });
            let width_deg = width_rad.to_degrees();
            println!(
                "  signs of q2, q4, q6 {shoulder}{elbow}{wrist}: {width_deg:3.0} deg of arm angle"
            );
        }
        let next = arm.nearest_solution(&base_from_flange, &now, &NearestConfig::default())?;
        let error = arm.forward(&next.q).distance(&base_from_flange);
        let (move_rad, error_m) = (next.largest_move_rad, error.position_m);
        println!("  nearest to now: {move_rad:.2} rad away, held within {error_m:.0e} m");
    }
    Ok(())
}
