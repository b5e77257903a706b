//! Setup shared by several tests.

use glam::DVec3;
use hwall_haptics::safety::{PersonPart, PersonPoint, SupervisorInput};
use hwall_haptics::{ArmCommand, ArmState, Board, Slide};
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

/// Fingertip and head of a person at a place.
pub(crate) fn person_at(position_m: DVec3, stamp_s: f64) -> [PersonPoint; 2] {
    [PersonPart::Fingertip, PersonPart::Head].map(|part| PersonPoint {
        part,
        position_m,
        stamp_s,
    })
}

/// What the supervisor sees of an arm that nobody presses.
pub(crate) fn unpressed<'a>(
    now_s: f64,
    state: &'a ArmState,
    person: &'a [PersonPoint],
    command: ArmCommand,
) -> SupervisorInput<'a> {
    SupervisorInput {
        now_s,
        state,
        person,
        target: None,
        force: Some(Wrench::default()),
        command,
    }
}

/// The sense, +1 or -1, in which a joint moves the face outwards from home.
pub(crate) fn outwards(arm: &dyn ArmKinematics, joint: usize) -> f64 {
    let mut ahead = home();
    ahead[joint] += 1e-6;
    let [face, moved] = [home(), ahead].map(|q| arm.forward(&q));
    let way = moved.position_m() - face.position_m();
    way.dot(face.rotation().z_axis).signum()
}

/// A slide without turn.
pub(crate) fn slide(velocity_m_per_s: DVec3) -> Slide {
    Slide {
        velocity_m_per_s,
        ..Slide::default()
    }
}

/// Mean velocities between two configurations, a period apart.
pub(crate) fn rates(from: &JointPositions, to: &JointPositions) -> JointVelocities {
    JointVelocities(std::array::from_fn(|i| (to[i] - from[i]) / DT_S))
}
