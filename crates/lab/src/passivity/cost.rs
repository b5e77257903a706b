//! What a cycle of port and supervisor costs.

use hwall_haptics::glam::DVec3;
use hwall_haptics::passivity::{PassivePort, PassivityMethod, PortConfig, PortInput, Sampling};
use hwall_haptics::safety::{
    PersonPart, PersonPoint, Supervisor, SupervisorConfig, SupervisorInput,
};
use hwall_haptics::{ArmCommand, ArmState, Board, HapticsError};
use hwall_kinematics::{JointPositions, JointTorques, JointVelocities, SrsArm, Wrench};
use hwall_testkit::{Timing, time_each};

/// Cycles that are timed.
const CYCLES: usize = 50_000;

/// Name and time of each.
///
/// # Errors
/// None with the constants used.
pub fn rows() -> Result<Vec<(String, Timing)>, HapticsError> {
    let mut rows = Vec::new();
    for method in PassivityMethod::ALL {
        let sampling = Sampling {
            period_s: 1e-3,
            delay_s: 5e-3,
        };
        let mut port = PassivePort::new(PortConfig {
            method,
            ..PortConfig::impedance(sampling, 2.0)
        })?;
        let timing = time_each(CYCLES, |i| {
            let position_m = 0.01 * (i as f64 * 0.02).sin();
            port.step(&PortInput {
                position_m,
                hand_force_n: 0.0,
                wanted: -2000.0 * position_m.max(0.0),
                stored_j: None,
            })
        });
        rows.push((format!("port, {}", method.name()), timing));
    }
    rows.push(("supervisor, position level".to_owned(), supervisor(false)?));
    rows.push(("supervisor, torque level".to_owned(), supervisor(true)?));
    Ok(rows)
}

/// A cycle near a person who touches the board, everything watched.
fn supervisor(torque_level: bool) -> Result<Timing, HapticsError> {
    let config = SupervisorConfig::default();
    let mut supervisor = Supervisor::new(&SrsArm::iiwa7(), &Board::default(), config)?;
    let home = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
    Ok(time_each(CYCLES, |i| {
        let now_s = 1e-3 * i as f64;
        let mut q = home;
        q[0] += 0.1 * now_s.sin();
        let state = ArmState {
            t_s: now_s,
            q,
            qd: JointVelocities([0.1 * now_s.cos(), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            external_torque: Some(JointTorques([0.1 * now_s.sin(); 7])),
        };
        let point = |part, y| PersonPoint {
            part,
            position_m: DVec3::new(0.9, y, 0.6 + 1e-4 * now_s.sin()),
            stamp_s: now_s,
        };
        let person = [
            point(PersonPart::Fingertip, 0.0),
            point(PersonPart::Palm, 0.1),
            point(PersonPart::Head, 0.4),
        ];
        supervisor.step(&SupervisorInput {
            now_s,
            state: &state,
            person: &person,
            target: Some((DVec3::X, now_s)),
            force: Some(Wrench {
                force_n: DVec3::new(-10.0, 0.0, 0.0),
                moment_n_m: DVec3::ZERO,
            }),
            command: match torque_level {
                true => ArmCommand::Torque(JointTorques([1.0; 7])),
                false => ArmCommand::Position(q),
            },
        })
    }))
}
