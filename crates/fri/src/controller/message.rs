//! The controller's messages about the arm and the session.

use super::config::ControllerConfig;
use crate::codec::{
    CartesianPose, ClientCommandMode, ConnectionInfo, ConnectionQuality, ControlMode, DriveState,
    Header, InterpolatorData, JOINTS, MonitorData, MonitorMessage, OperationMode, OverlayType,
    Redundancy, RobotInfo, SafetyState, SessionState, TimeStamp,
};
use hwall_haptics::ArmState;
use hwall_kinematics::ArmKinematics;

/// The contents of a message.
pub(super) struct Measured<'a> {
    pub(super) header: Header,
    /// Time on the clock of the controller, s.
    pub(super) t_s: f64,
    pub(super) config: &'a ControllerConfig,
    pub(super) state: SessionState,
    pub(super) quality: ConnectionQuality,
    pub(super) arm: &'a ArmState,
    pub(super) model: &'a dyn ArmKinematics,
    pub(super) torque_n_m: [f64; JOINTS],
    pub(super) commanded_position_rad: [f64; JOINTS],
    pub(super) commanded_torque_n_m: [f64; JOINTS],
    pub(super) interpolator_rad: [f64; JOINTS],
}

/// A message with every field that clients expect: if one is missing, they report zero or stop.
pub(super) fn monitor_message(measured: &Measured) -> MonitorMessage {
    let config = measured.config;
    let has_pose = config.version.has_cartesian_pose();
    let is_active = measured.state == SessionState::CommandingActive;
    MonitorMessage {
        header: measured.header,
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
            position_rad: Some(measured.arm.q.0),
            torque_n_m: Some(measured.torque_n_m),
            commanded_position_rad: Some(measured.commanded_position_rad),
            commanded_torque_n_m: Some(measured.commanded_torque_n_m),
            external_torque_n_m: Some(
                measured
                    .arm
                    .external_torque
                    .map_or([0.0; JOINTS], |torques| torques.0),
            ),
            external_force: None,
            pose: has_pose.then(|| {
                let pose = measured.model.forward(&measured.arm.q);
                CartesianPose::new(pose.position_m(), pose.to_quat())
            }),
            redundancy: has_pose.then_some(Redundancy {
                strategy: 0,
                value_rad: measured.arm.q[2],
            }),
            time: Some(time_stamp(measured.t_s, config.start_unix_s)),
        }),
        connection: ConnectionInfo {
            state: measured.state,
            quality: measured.quality,
            send_period_ms: Some(config.send_period_ms),
            receive_multiplier: Some(config.receive_multiplier),
        },
        interpolator: (measured.state >= SessionState::CommandingWait).then_some(
            InterpolatorData {
                position_rad: Some(measured.interpolator_rad),
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

fn time_stamp(t_s: f64, start_unix_s: u32) -> TimeStamp {
    let time = TimeStamp::from_ns((t_s * 1e9).round() as u64);
    TimeStamp {
        seconds: start_unix_s.wrapping_add(time.seconds),
        ..time
    }
}
