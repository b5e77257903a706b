//! Messages with every field.

#![allow(dead_code, unreachable_pub)] // benches use a part

use hwall_fri::codec::{
    CartesianPose, ClientCommandMode, CommandData, CommandMessage, ConnectionInfo,
    ConnectionQuality, ControlMode, DriveState, Header, InterpolatorData, MonitorData,
    MonitorMessage, OperationMode, OverlayType, Redundancy, RobotInfo, SafetyState, SessionState,
    TimeStamp,
};

fn values(from: f64) -> [f64; 7] {
    std::array::from_fn(|i| from + 0.125 * i as f64)
}

fn pose() -> CartesianPose {
    CartesianPose {
        elements: [500.0, -20.0, 700.0, 1.0, 0.0, 0.0, 0.0],
    }
}

fn redundancy() -> Redundancy {
    Redundancy {
        strategy: 0,
        value_rad: 0.3,
    }
}

/// Every field of every version.
pub fn full_monitor() -> MonitorMessage {
    MonitorMessage {
        header: Header {
            sequence: 70_000,
            reflected_sequence: 69_999,
        },
        robot: Some(RobotInfo {
            joint_count: Some(7),
            safety: Some(SafetyState::NormalOperation),
            drives: Some([DriveState::Active; 7]),
            operation: Some(OperationMode::Automatic),
            control: Some(ControlMode::JointImpedance),
        }),
        data: Some(MonitorData {
            position_rad: Some(values(0.1)),
            torque_n_m: Some(values(-3.0)),
            commanded_position_rad: Some(values(0.2)),
            commanded_torque_n_m: Some(values(-2.0)),
            external_torque_n_m: Some(values(1.0)),
            external_force: Some([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
            pose: Some(pose()),
            redundancy: Some(redundancy()),
            time: Some(TimeStamp {
                seconds: 1_700_000_000,
                nanoseconds: 999_000_000,
            }),
        }),
        connection: ConnectionInfo {
            state: SessionState::CommandingActive,
            quality: ConnectionQuality::Excellent,
            send_period_ms: Some(5),
            receive_multiplier: Some(2),
        },
        interpolator: Some(InterpolatorData {
            position_rad: Some(values(0.3)),
            pose: Some(pose()),
            redundancy: Some(redundancy()),
            command_mode: Some(ClientCommandMode::Torque),
            overlay: Some(OverlayType::Joint),
            tracking: Some(0.75),
        }),
    }
}

/// Every field of every version.
pub fn full_command() -> CommandMessage {
    CommandMessage {
        header: Header {
            sequence: 4_000_000_000,
            reflected_sequence: 70_000,
        },
        data: Some(CommandData {
            position_rad: Some(values(0.4)),
            wrench: Some([6.0, 5.0, 4.0, 3.0, 2.0, 1.0]),
            torque_n_m: Some(values(2.5)),
            pose: Some(pose()),
            redundancy: Some(redundancy()),
        }),
    }
}

pub mod bench;
