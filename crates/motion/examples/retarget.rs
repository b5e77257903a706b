//! How long does the arm need, what does it do meanwhile, and what if the goal changes half way?
//!
//! `cargo run -p hwall-motion --example retarget`

use hwall_motion::kinematics::{JointPositions, SrsArm};
use hwall_motion::{JointTiming, MotionConfig, MotionError, MotionLimits, ReferenceMotion};

fn main() -> Result<(), MotionError> {
    let arm = SrsArm::iiwa7();
    let limits = MotionLimits::of_arm(&arm, &MotionConfig::default())?;
    let from = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
    let door = JointPositions::from_deg([40.0, 45.0, 10.0, -70.0, 20.0, -40.0, 60.0]);
    let wall = JointPositions::from_deg([-25.0, 35.0, 0.0, -85.0, -10.0, -35.0, 110.0]);
    println!(
        "least times: to the door {:.3} s, from there to the wall {:.3} s",
        limits.travel_time_s(&from, &door),
        limits.travel_time_s(&door, &wall)
    );

    for timing in [JointTiming::Together, JointTiming::Soonest] {
        println!("\n{timing:?}: to the door, after 0.2 s to the wall instead");
        println!("   t s   joint 1 deg   deg/s   deg/s²   left s");
        let mut motion = ReferenceMotion::new(&arm, &limits, &from)?.with_timing(timing);
        motion.set_goal(&door)?;
        let mut t_s = 0.0;
        while motion.left_s() > 0.0 {
            if t_s > 0.199 && motion.goal() == Some(&door) {
                motion.set_goal(&wall)?;
            }
            let state = motion.step(0.04)?;
            t_s += 0.04;
            println!(
                "  {t_s:.2}   {:11.2}   {:5.0}   {:6.0}   {:.3}",
                state.q[0].to_degrees(),
                state.qd[0].to_degrees(),
                state.qdd_rad_per_s2[0].to_degrees(),
                motion.left_s()
            );
        }
        assert_eq!(motion.state().q, wall);
    }

    // Somebody steps in: half the speed, then a stop.
    let mut motion = ReferenceMotion::new(&arm, &limits, &from)?;
    motion.set_goal(&door)?;
    motion.step(0.15)?;
    motion.set_speed_share(0.5)?;
    println!(
        "\nhalf the speed after 0.15 s: {:.3} s left",
        motion.left_s()
    );
    motion.step(0.1)?;
    motion.brake();
    println!("a stop 0.1 s later: {:.3} s left", motion.left_s());
    Ok(())
}
