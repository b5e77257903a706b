//! The messages as plain data.

use super::states::{
    ClientCommandMode, ConnectionQuality, ControlMode, DriveState, OperationMode, OverlayType,
    SafetyState, SessionState,
};
use glam::{DQuat, DVec3};

/// Joints of the arm: every array has as many values.
pub const JOINTS: usize = 7;

/// Which message this is and which one it answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Header {
    /// Counts the messages of the sender; begins anew after `u32::MAX`.
    pub sequence: u32,
    /// Sequence number of the newest message that the sender has received.
    pub reflected_sequence: u32,
}

/// From the controller, once in every send period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MonitorMessage {
    /// Which message this is.
    pub header: Header,
    /// How the arm is operated.
    pub robot: Option<RobotInfo>,
    /// What was measured.
    pub data: Option<MonitorData>,
    /// Where the session stands.
    pub connection: ConnectionInfo,
    /// What the application's own motion commands; there while the client commands or is about to.
    pub interpolator: Option<InterpolatorData>,
}

/// How the arm is operated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RobotInfo {
    /// Number of joints; 7.
    pub joint_count: Option<u32>,
    /// What the safety controller does.
    pub safety: Option<SafetyState>,
    /// Of each joint.
    pub drives: Option<[DriveState; JOINTS]>,
    /// How the arm is operated.
    pub operation: Option<OperationMode>,
    /// What the arm's controller does.
    pub control: Option<ControlMode>,
}

/// What was measured.
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
    /// Joint torques that the arm itself does not explain, N m.
    pub external_torque_n_m: Option<[f64; JOINTS]>,
    /// External force and moment at the tool, N and N m; 2.7 only, otherwise not written.
    pub external_force: Option<[f64; 6]>,
    /// Measured pose of the tool; 2.x only, otherwise not written.
    pub pose: Option<CartesianPose>,
    /// Measured redundancy; 2.x only, otherwise not written.
    pub redundancy: Option<Redundancy>,
    /// When this was measured.
    pub time: Option<TimeStamp>,
}

/// Time on the clock of the controller, Unix time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TimeStamp {
    /// Whole seconds.
    pub seconds: u32,
    /// The rest, ns; below 10⁹.
    pub nanoseconds: u32,
}

impl TimeStamp {
    /// Nanoseconds in all.
    #[must_use]
    pub const fn to_ns(self) -> u64 {
        self.seconds as u64 * 1_000_000_000 + self.nanoseconds as u64
    }

    /// From nanoseconds in all; seconds begin anew after 32 bits.
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
    /// `x y z` in **mm**, then the quaternion `w x y z`, as they stand on the wire.
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

    /// Rotation as sent: a unit quaternion up to rounding.
    #[must_use]
    pub const fn rotation(&self) -> DQuat {
        let [_, _, _, w, x, y, z] = self.elements;
        DQuat::from_xyzw(x, y, z, w)
    }
}

/// How the arm uses its seventh joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Redundancy {
    /// Strategy: 0 is E1, the angle of the third joint; 4 none.
    pub strategy: i32,
    /// Its value, rad.
    pub value_rad: f64,
}

/// Where the session stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionInfo {
    /// Where the session stands.
    pub state: SessionState,
    /// How well answers come.
    pub quality: ConnectionQuality,
    /// Time between messages of the controller, ms.
    pub send_period_ms: Option<u32>,
    /// Every how many messages an answer is expected.
    pub receive_multiplier: Option<u32>,
}

/// What the application's own motion commands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InterpolatorData {
    /// Joint angles, rad.
    pub position_rad: Option<[f64; JOINTS]>,
    /// Pose of the tool; 2.x only, otherwise not written.
    pub pose: Option<CartesianPose>,
    /// Redundancy; 2.x only, otherwise not written.
    pub redundancy: Option<Redundancy>,
    /// What the client commands.
    pub command_mode: Option<ClientCommandMode>,
    /// How commands are laid over the motion.
    pub overlay: Option<OverlayType>,
    /// How well the arm follows, 0 to 1; 0 unless commanding is active.
    pub tracking: Option<f64>,
}

/// From the client, an answer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CommandMessage {
    /// Which message this is and which it answers.
    pub header: Header,
    /// What is commanded.
    pub data: Option<CommandData>,
}

/// What is commanded. Values that are no finite numbers are passed on as they are: who uses them must look.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CommandData {
    /// Joint angles, rad; in every mode but that of poses.
    pub position_rad: Option<[f64; JOINTS]>,
    /// Force and moment, N and N m.
    pub wrench: Option<[f64; 6]>,
    /// Joint torques beside those of the arm's own controller, N m.
    pub torque_n_m: Option<[f64; JOINTS]>,
    /// Pose of the tool; 2.x only, otherwise not written.
    pub pose: Option<CartesianPose>,
    /// Redundancy beside the pose; 2.x only, otherwise not written.
    pub redundancy: Option<Redundancy>,
}
