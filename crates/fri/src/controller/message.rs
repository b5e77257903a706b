//! The controller's messages about the arm and the session.

use super::machine::Controller;
use super::plant::SimulatedPlant;
use crate::codec::{
    CartesianPose, ClientCommandMode, ConnectionInfo, ControlMode, DriveState, Header,
    InterpolatorData, JOINTS, MonitorData, MonitorMessage, OperationMode, OverlayType, Redundancy,
    RobotInfo, SafetyState, SessionState, TimeStamp,
};
use hwall_haptics::ArmState;

impl<P: SimulatedPlant> Controller<P> {
    /// A message at a time on the clock of the controller, with every field that clients expect: if one is missing, they report zero or stop.
    pub(super) fn message(&self, arm: &ArmState, t_s: f64) -> MonitorMessage {
        let config = &self.config;
        let has_pose = config.version.has_cartesian_pose();
        let is_active = self.state == SessionState::CommandingActive;
        let external_torque = arm.external_torque.unwrap_or_default();
        MonitorMessage {
            header: Header {
                sequence: self.sequence,
                reflected_sequence: self.client_sequence,
            },
            robot: Some(RobotInfo {
                joint_count: Some(JOINTS as u32),
                safety: Some(SafetyState::NormalOperation),
                drives: Some([DriveState::Active; JOINTS]),
                operation: Some(OperationMode::Automatic),
                control: Some(match config.mode {
                    ClientCommandMode::Torque => ControlMode::JointImpedance,
                    ClientCommandMode::Wrench => ControlMode::CartesianImpedance,
                    _ => ControlMode::Position,
                }),
            }),
            data: Some(MonitorData {
                position_rad: Some(arm.q.0),
                torque_n_m: Some(self.plant.measured_torque().0),
                commanded_position_rad: Some(self.commanded_rad),
                commanded_torque_n_m: Some(self.commanded_torque_n_m),
                external_torque_n_m: Some(external_torque.0),
                external_force: None,
                pose: has_pose.then(|| {
                    let pose = self.plant.model().forward(&arm.q);
                    CartesianPose::new(pose.position_m(), pose.to_quat())
                }),
                redundancy: has_pose.then_some(Redundancy {
                    strategy: 0,
                    value_rad: arm.q[2],
                }),
                time: Some(time_stamp(t_s, config.start_unix_s)),
            }),
            connection: ConnectionInfo {
                state: self.state,
                quality: self.quality,
                send_period_ms: Some(config.send_period_ms),
                receive_multiplier: Some(config.receive_multiplier),
            },
            interpolator: (self.state >= SessionState::CommandingWait).then_some(
                InterpolatorData {
                    position_rad: Some(self.interpolator.0),
                    pose: None,
                    redundancy: None,
                    command_mode: Some(config.mode),
                    // A wrench also overlays a motion of joints.
                    overlay: Some(OverlayType::Joint),
                    tracking: Some(f64::from(u8::from(is_active))),
                },
            ),
        }
    }
}

fn time_stamp(t_s: f64, start_unix_s: u32) -> TimeStamp {
    let time = TimeStamp::from_ns((t_s * 1e9).round() as u64);
    TimeStamp {
        seconds: start_unix_s.wrapping_add(time.seconds),
        ..time
    }
}
