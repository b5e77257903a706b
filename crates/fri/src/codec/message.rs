//! The messages as plain data.

use super::states::{
    ClientCommandMode, ConnectionQuality, ControlMode, DriveState, OperationMode, OverlayType,
    SafetyState, SessionState,
};
use glam::{DQuat, DVec3};

/// Number of joints, and of the values in every array.
pub const JOINTS: usize = 7;

/// Sequence numbers of this message and of the one that it answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Header {
    /// Counts the messages of the sender; wraps after `u32::MAX`.
    pub sequence: u32,
    /// Sequence number of the newest message that the sender has received.
    pub reflected_sequence: u32,
}

/// Message from the controller, once per send period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MonitorMessage {
    /// Which message this is.
    pub header: Header,
    /// Operating state of the arm.
    pub robot: Option<RobotInfo>,
    /// Measurements.
    pub data: Option<MonitorData>,
    /// State of the connection.
    pub connection: ConnectionInfo,
    /// Motion commanded by the application itself; present while the client commands or is about to.
    pub interpolator: Option<InterpolatorData>,
}

/// Operating state of the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RobotInfo {
    /// Number of joints; 7.
    pub joint_count: Option<u32>,
    /// State of the safety controller.
    pub safety: Option<SafetyState>,
    /// State of each joint's drive.
    pub drives: Option<[DriveState; JOINTS]>,
    /// Operation mode.
    pub operation: Option<OperationMode>,
    /// Control mode of the arm's controller.
    pub control: Option<ControlMode>,
}

/// Measurements.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MonitorData {
    /// Measured joint angles, rad.
    pub position_rad: Option<[f64; JOINTS]>,
    /// Measured joint torques, N m.
    pub torque_n_m: Option<[f64; JOINTS]>,
    /// Last commanded joint angles, rad; 1.x only, otherwise not written.
    pub commanded_position_rad: Option<[f64; JOINTS]>,
    /// Last commanded joint torques, N m.
    pub commanded_torque_n_m: Option<[f64; JOINTS]>,
    /// External joint torques, N m: those that the arm itself does not explain.
    pub external_torque_n_m: Option<[f64; JOINTS]>,
    /// External force and moment at the tool, N and N m; 2.7 only, otherwise not written.
    pub external_force: Option<[f64; 6]>,
    /// Measured pose of the tool; 2.x only, otherwise not written.
    pub pose: Option<CartesianPose>,
    /// Measured redundancy; 2.x only, otherwise not written.
    pub redundancy: Option<Redundancy>,
    /// Time of the measurement.
    pub time: Option<TimeStamp>,
}

/// Time on the clock of the controller, Unix time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TimeStamp {
    /// Whole seconds.
    pub seconds: u32,
    /// Nanoseconds within the second; below 10⁹.
    pub nanoseconds: u32,
}

impl TimeStamp {
    /// Total nanoseconds.
    #[must_use]
    pub const fn to_ns(self) -> u64 {
        self.seconds as u64 * 1_000_000_000 + self.nanoseconds as u64
    }

    /// From total nanoseconds; seconds wrap after 32 bits.
    #[must_use]
    pub const fn from_ns(ns: u64) -> Self {
        Self {
            seconds: (ns / 1_000_000_000) as u32,
            nanoseconds: (ns % 1_000_000_000) as u32,
        }
    }
}

/// A pose of the tool in the frame of the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CartesianPose {
    /// `x y z` in **mm**, then the quaternion `w x y z`, as on the wire.
    pub elements: [f64; 7],
}

impl CartesianPose {
    /// From metres and a unit quaternion.
    #[must_use]
    pub fn new(position_m: DVec3, rotation: DQuat) -> Self {
        let (p, q) = (position_m * 1e3, rotation);
        Self {
            elements: [p.x, p.y, p.z, q.w, q.x, q.y, q.z],
        }
    }

    /// Position, m.
    #[must_use]
    pub fn position_m(&self) -> DVec3 {
        let [x, y, z, ..] = self.elements;
        DVec3::new(x, y, z) * 1e-3
    }

    /// The rotation as sent: a unit quaternion up to rounding.
    #[must_use]
    pub const fn rotation(&self) -> DQuat {
        let [_, _, _, w, x, y, z] = self.elements;
        DQuat::from_xyzw(x, y, z, w)
    }
}

/// Redundancy of the seventh joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Redundancy {
    /// Strategy: 0 is E1, the angle of the third joint; 4 none.
    pub strategy: i32,
    /// Its value, rad.
    pub value_rad: f64,
}

/// State of the connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionInfo {
    /// State of the session.
    pub state: SessionState,
    /// Quality of the connection.
    pub quality: ConnectionQuality,
    /// Time between messages of the controller, ms.
    pub send_period_ms: Option<u32>,
    /// Number of messages per expected answer.
    pub receive_multiplier: Option<u32>,
}

/// Motion commanded by the application itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InterpolatorData {
    /// Joint angles, rad.
    pub position_rad: Option<[f64; JOINTS]>,
    /// Pose of the tool; 2.x only, otherwise not written.
    pub pose: Option<CartesianPose>,
    /// Redundancy; 2.x only, otherwise not written.
    pub redundancy: Option<Redundancy>,
    /// The client command mode.
    pub command_mode: Option<ClientCommandMode>,
    /// How commands overlay the motion.
    pub overlay: Option<OverlayType>,
    /// Tracking performance of the arm, 0 to 1; 0 unless commanding is active.
    pub tracking: Option<f64>,
}

/// Answer from the client.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CommandMessage {
    /// Which message this is and which it answers.
    pub header: Header,
    /// The command.
    pub data: Option<CommandData>,
}

/// The command. Non-finite values are passed on unchanged: the receiver must check them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CommandData {
    /// Joint angles, rad; in every mode except Cartesian pose.
    pub position_rad: Option<[f64; JOINTS]>,
    /// Force and moment, N and N m.
    pub wrench: Option<[f64; 6]>,
    /// Joint torques in addition to those of the arm's own controller, N m.
    pub torque_n_m: Option<[f64; JOINTS]>,
    /// Pose of the tool; 2.x only, otherwise not written.
    pub pose: Option<CartesianPose>,
    /// Redundancy of the pose; 2.x only, otherwise not written.
    pub redundancy: Option<Redundancy>,
}
