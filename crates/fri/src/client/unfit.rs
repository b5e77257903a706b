//! Controller states in which the arm accepts no commands.

use crate::codec::message::MonitorMessage;
use crate::codec::states::{
    ClientCommandMode, ControlMode, DriveState, OverlayType, SafetyState, SessionState,
};

/// A value with which the arm accepts no commands, and what to do about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unfit {
    /// A safety stop.
    #[error("the safety state is {0}: find what stopped the arm and acknowledge the stop")]
    Safety(SafetyState),
    /// A drive that is not active.
    #[error(
        "the drive of joint {joint} is {state}: all must be ACTIVE; switch them on (in T1 and T2 with the enabling switch)"
    )]
    Drive {
        /// The first such joint, from 0.
        joint: usize,
        /// State of its drive.
        state: DriveState,
    },
    /// A client command mode that this client does not support.
    #[error(
        "the client command mode is {0}: choose POSITION, TORQUE or WRENCH in the application on the controller"
    )]
    Command(ClientCommandMode),
    /// An overlay for other commands.
    #[error("the overlay is {0}: choose a joint overlay in the application on the controller")]
    Overlay(OverlayType),
    /// By their time stamps, messages come faster than the stated period: velocities would be wrong.
    #[error(
        "messages come more often than every {said_ms} ms, as the controller states: state the true period"
    )]
    Period {
        /// The stated period, ms.
        said_ms: u32,
    },
    /// A control mode that does not match the client command mode.
    #[error("the control mode is {mode}: choose {needed} in the application on the controller")]
    Control {
        /// The mode.
        mode: ControlMode,
        /// The mode that matches the client command mode.
        needed: &'static str,
    },
}

/// The first value that prevents commands, once commanding is about to begin.
///
/// Absent or unknown values prevent nothing: controllers of other versions, and simulators, omit fields. Neither does any operation mode, because a
/// real arm is first driven in T1, nor `NO_OVERLAY`, which is also the zero of an unset field.
pub(super) fn unfit(message: &MonitorMessage) -> Option<Unfit> {
    if message.connection.state < SessionState::CommandingWait {
        return None;
    }
    let robot = message.robot.unwrap_or_default();
    let interpolator = message.interpolator.unwrap_or_default();
    let safety = robot.safety.filter(|s| *s != SafetyState::NormalOperation);
    let drive = robot.drives.into_iter().flatten().enumerate();
    let mut drive = drive.filter(|(_, state)| *state != DriveState::Active);
    let command = interpolator.command_mode;
    let overlay = interpolator
        .overlay
        .filter(|o| *o == OverlayType::Cartesian);
    safety
        .map(Unfit::Safety)
        .or_else(|| {
            drive
                .next()
                .map(|(joint, state)| Unfit::Drive { joint, state })
        })
        .or_else(|| unfit_command(command?))
        .or_else(|| overlay.map(Unfit::Overlay))
        .or_else(|| unfit_control(robot.control?, command))
}

const fn unfit_command(mode: ClientCommandMode) -> Option<Unfit> {
    match mode {
        ClientCommandMode::None | ClientCommandMode::CartesianPose => Some(Unfit::Command(mode)),
        _ => None,
    }
}

fn unfit_control(mode: ControlMode, command: Option<ClientCommandMode>) -> Option<Unfit> {
    use ControlMode::{CartesianImpedance, JointImpedance, NoControl, Position};
    const POSITIONS: &str = "position or joint impedance control";
    let (fits, needed) = match command {
        Some(ClientCommandMode::Torque) => (mode == JointImpedance, "joint impedance control"),
        Some(ClientCommandMode::Wrench) => {
            (mode == CartesianImpedance, "Cartesian impedance control")
        }
        Some(_) => (matches!(mode, Position | JointImpedance), POSITIONS),
        None => (mode != NoControl, POSITIONS),
    };
    (!fits).then_some(Unfit::Control { mode, needed })
}

#[cfg(test)]
mod tests {
    use super::{Unfit, unfit};
    use crate::codec::{
        ClientCommandMode, ConnectionInfo, ConnectionQuality, ControlMode, DriveState, Header,
        InterpolatorData, MonitorMessage, OperationMode, RobotInfo, SafetyState, SessionState,
    };

    fn message(robot: Option<RobotInfo>, interpolator: Option<InterpolatorData>) -> MonitorMessage {
        MonitorMessage {
            header: Header::default(),
            robot,
            data: None,
            connection: ConnectionInfo {
                state: SessionState::CommandingWait,
                quality: ConnectionQuality::Good,
                send_period_ms: Some(5),
                receive_multiplier: None,
            },
            interpolator,
        }
    }

    #[test]
    fn values_of_the_robot() {
        let robot = |change: &dyn Fn(&mut RobotInfo)| {
            let mut robot = RobotInfo::default();
            change(&mut robot);
            unfit(&message(Some(robot), None))
        };
        for &safety in SafetyState::ALL {
            let stops = safety != SafetyState::NormalOperation;
            let found = robot(&|r| r.safety = Some(safety));
            assert_eq!(found, stops.then_some(Unfit::Safety(safety)));
        }
        for &state in DriveState::ALL {
            let mut drives = [DriveState::Active; 7];
            drives[4] = state;
            let rests = state != DriveState::Active;
            let found = robot(&|r| r.drives = Some(drives));
            assert_eq!(found, rests.then_some(Unfit::Drive { joint: 4, state }));
        }
        for &operation in OperationMode::ALL {
            assert_eq!(robot(&|r| r.operation = Some(operation)), None);
        }
        let mut monitoring = message(None, None);
        monitoring.robot = Some(RobotInfo {
            drives: Some([DriveState::Off; 7]),
            ..RobotInfo::default()
        });
        monitoring.connection.state = SessionState::MonitoringReady;
        assert_eq!(unfit(&monitoring), None);
    }

    #[test]
    fn control_modes_that_go_with_commands() {
        use ClientCommandMode as Command;
        use ControlMode::{CartesianImpedance, JointImpedance, NoControl, Position};
        for (command, fits) in [
            (None, &[Position, JointImpedance, CartesianImpedance][..]),
            (Some(Command::Position), &[Position, JointImpedance]),
            (Some(Command::Torque), &[JointImpedance]),
            (Some(Command::Wrench), &[CartesianImpedance]),
        ] {
            for &mode in &[Position, CartesianImpedance, JointImpedance, NoControl] {
                let robot = RobotInfo {
                    control: Some(mode),
                    ..RobotInfo::default()
                };
                let interpolator = InterpolatorData {
                    command_mode: command,
                    ..InterpolatorData::default()
                };
                let found = unfit(&message(Some(robot), Some(interpolator)));
                let is_named = |u: Unfit| u.to_string().contains(&mode.to_string());
                let fits = fits.contains(&mode);
                assert!(found.is_none_or(is_named), "{found:?}");
                assert_eq!(found.is_none(), fits, "{command:?} {mode}");
            }
        }
    }
}
