//! How do people differ in reaching, and what do the arm's torque sensors measure when they press its board?
//!
//! `cargo run -p hwall-sim --example simulated_touch`

use hwall_sim::haptics::Arm;
use hwall_sim::kinematics::{JointPositions, SrsArm, WrenchConfig};
use hwall_sim::{HandContact, PersonConfig, Population, ServoArm, ServoConfig, TouchPlan};
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
    let people = Population::new(PersonConfig::varied(), 1)?;
    println!("person  looks ahead, s  reach, s  largest force, N");
    for number in 0..5 {
        let mut arm = ServoArm::new(Arc::new(SrsArm::iiwa7()), start, ServoConfig::default())?;
        let board = arm.pose();
        let plan = TouchPlan {
            target_m: board.position_m(),
            normal: board.rotation().z_axis,
        };
        let sequence = people.person(number).plan(&[plan])?;
        let touch = sequence.touches()[0];

        let (finger, mut largest_n) = (HandContact::default(), 0.0_f64);
        while arm.t_s() < sequence.duration_s() {
            let t_s = arm.t_s();
            // The true fingertip presses the board; a tracker would see `sequence.tracked(t_s)`.
            let tip_m = sequence.true_index_tip(t_s);
            let velocity = sequence.true_index_velocity_m_per_s(t_s);
            let wrench = finger.wrench(&arm.pose(), tip_m, velocity)?;
            arm.apply_wrench(wrench.unwrap_or_default())?;
            arm.advance(1e-3)?;
            let state = arm.state()?;
            if let Some(torque) = state.external_torque {
                let config = WrenchConfig::default();
                let felt = arm
                    .model()
                    .wrench_from_torques(&state.q, &torque, &config)?;
                largest_n = largest_n.max(-felt.wrench.normal_force_n(plan.normal));
            }
        }
        println!(
            "{number:6}  {:14.2}  {:8.2}  {largest_n:.1}",
            touch.start_s - touch.look_s,
            touch.contact_s - touch.start_s
        );
    }
    Ok(())
}
