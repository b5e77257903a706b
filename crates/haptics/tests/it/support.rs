//! Setup shared by several tests.

use glam::DVec3;
use hwall_haptics::{ArmCommand, ArmState, Board};
use hwall_kinematics::{
    ArmKinematics, JointPositions, JointTorques, JointVelocities, SrsArm, Wrench,
};

/// Period of the control loop, s.
pub(crate) const DT_S: f64 = 1e-3;

/// The iiwa with the face of the board as its tool.
pub(crate) fn iiwa() -> SrsArm {
    SrsArm::iiwa7().with_tool(Board::default().flange_from_board_face().unwrap())
}

pub(crate) fn home() -> JointPositions {
    JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0])
}

/// The board upright, with space to yield to a push.
pub(crate) fn before_door() -> JointPositions {
    JointPositions::from_deg([0.0, 45.0, 0.0, -70.0, 0.0, -25.0, 90.0])
}

/// A sound state of an arm at rest without contact.
pub(crate) fn at_rest(t_s: f64, q: JointPositions) -> ArmState {
    ArmState {
        t_s,
        q,
        qd: JointVelocities::default(),
        external_torque: Some(JointTorques::default()),
    }
}

pub(crate) fn force(force_n: DVec3) -> Wrench {
    Wrench {
        force_n,
        moment_n_m: DVec3::ZERO,
    }
}

/// Torques of a hand that presses the face, N.
pub(crate) fn pressed(arm: &dyn ArmKinematics, q: &JointPositions, press_n: f64) -> JointTorques {
    let outward = arm.forward(q).rotation().z_axis;
    arm.torques_from_wrench(q, &force(outward * -press_n))
}

/// The commanded positions; any other command is a failure.
#[track_caller]
pub(crate) fn positions(command: ArmCommand) -> JointPositions {
    match command {
        ArmCommand::Position(q) => q,
        other => panic!("{other:?}"),
    }
}

/// Mean velocities between two configurations, a period apart.
pub(crate) fn rates(from: &JointPositions, to: &JointPositions) -> JointVelocities {
    JointVelocities(std::array::from_fn(|i| (to[i] - from[i]) / DT_S))
}
