//! The client against the controller in simulated time: no sockets.

use crate::common::bench::{config, servo, torque_arm};
use hwall_fri::codec::ClientCommandMode;
use hwall_fri::controller::{Controller, InProcess, SimulatedPlant};
use hwall_fri::{FriClient, FriClientConfig, FriError, LimitViolation};
use hwall_haptics::{Arm, ArmCommand, ArmState};
use hwall_kinematics::glam::DVec3;
use hwall_kinematics::{JointPositions, JointTorques, SrsArm, Wrench};
use hwall_sim::{ServoArm, TorqueArm};
use std::sync::Arc;
use std::time::Duration;

const TIMEOUT: Duration = Duration::from_secs(10);

/// A client with active commanding.
fn commanding<P: SimulatedPlant>(plant: P, mode: ClientCommandMode) -> FriClient<InProcess<P>> {
    let model = Arc::clone(plant.model());
    let controller = Controller::new(plant, config(mode)).expect("a controller");
    let way = InProcess::new(controller);
    let mut client = FriClient::over(&model, FriClientConfig::default(), way).expect("a client");
    client.wait_for_commanding(TIMEOUT).expect("commanding");
    client
}

fn cycle<P: SimulatedPlant>(
    client: &mut FriClient<InProcess<P>>,
    command: ArmCommand,
) -> Result<ArmState, FriError> {
    client.command(command)?;
    client.wait_for_message(TIMEOUT)?;
    client.state()
}

/// Joint 1 moves at 0.5 rad/s for half a second; 28 N m s/rad of damping keep it 0.07 rad behind on 200 N m/rad.
fn hanging_behind(client: &mut FriClient<InProcess<TorqueArm>>) -> (JointPositions, ArmState) {
    let mut state = client.state().expect("a state");
    let mut q = state.q;
    for _ in 0..500 {
        q[0] += 0.5e-3;
        state = cycle(client, ArmCommand::Position(q)).expect("within the limits");
    }
    assert!(q[0] - state.q[0] > 0.03, "{} {}", q[0], state.q[0]);
    (q, state)
}

#[test]
fn from_positions_to_torques_and_back_there_is_no_leap() {
    let mut client = commanding(torque_arm(), ClientCommandMode::Torque);
    let (q, _) = hanging_behind(&mut client);
    let mut last = client.state().expect("a state").q;
    let check = |last: &mut JointPositions, state: &ArmState| {
        assert!(state.q.max_abs_difference(last) < 2e-3, "{state:?}");
        *last = state.q;
    };
    for _ in 0..300 {
        let none = ArmCommand::Torque(JointTorques([0.0; 7]));
        check(&mut last, &cycle(&mut client, none).expect("taken"));
    }
    // Without torques and springs, damping brings it to rest in place.
    assert!((last[0] - q[0]).abs() > 0.02, "{} {}", last[0], q[0]);
    for _ in 0..2000 {
        let back = ArmCommand::Position(q);
        check(&mut last, &cycle(&mut client, back).expect("taken"));
    }
    // 1 N m of dry friction on 200 N m/rad, and a quarter more.
    assert!((last[0] - q[0]).abs() < 0.01, "{} {}", last[0], q[0]);
    assert_eq!(client.transport().controller().ended(), None);
    assert_eq!(client.statistics().refused, 0);
}

/// Regression: positions slightly away from the place where the arm had braked were sent within one cycle, at 1.5 rad/s.
#[test]
fn an_arm_that_goes_on_beside_where_it_was_braked_does_not_jerk() {
    let mut client = commanding(servo(), ClientCommandMode::Position);
    let mut q = client.state().expect("a state").q;
    let told = |client: &FriClient<InProcess<ServoArm>>| {
        let data = client.message().and_then(|message| message.data);
        data.and_then(|data| data.commanded_position_rad)
            .expect("positions")[2]
    };
    for _ in 0..1500 {
        cycle(&mut client, ArmCommand::Position(q)).expect("taken");
    }
    for _ in 0..100 {
        cycle(&mut client, ArmCommand::Hold).expect("taken");
    }
    q[2] += 1.5e-3;
    let mut last_rad = told(&client);
    for _ in 0..1500 {
        cycle(&mut client, ArmCommand::Position(q)).expect("taken");
        let now_rad = told(&client);
        assert!((now_rad - last_rad).abs() < 1e-5, "{last_rad} to {now_rad}");
        last_rad = now_rad;
    }
    assert!((last_rad - q[2]).abs() < 1e-6);
}

#[test]
fn a_leap_after_torques_is_refused() {
    let mut client = commanding(torque_arm(), ClientCommandMode::Torque);
    let none = ArmCommand::Torque(JointTorques([0.0; 7]));
    let state = cycle(&mut client, none).expect("taken");
    let mut far = state.q;
    far[0] += 0.5;
    let refused = cycle(&mut client, ArmCommand::Position(far));
    let too_fast = |e| matches!(e, FriError::Limit(LimitViolation::Speed { joint: 0, .. }));
    assert!(refused.is_err_and(too_fast));
    // A position outside the range is refused at any distance.
    let mut outside = state.q;
    outside[3] = -3.0;
    assert!(cycle(&mut client, ArmCommand::Position(outside)).is_err());
    client.wait_for_message(TIMEOUT).expect("a message");
    assert!(cycle(&mut client, ArmCommand::Position(state.q)).is_ok());
    assert_eq!(client.transport().controller().ended(), None);
}

#[test]
fn a_wrench_moves_the_tool_and_torques_have_a_limit() {
    let mut client = commanding(torque_arm(), ClientCommandMode::Wrench);
    let before = client.state().expect("a state").q;
    for _ in 0..500 {
        let push = Wrench {
            force_n: DVec3::Z * 60.0,
            ..Wrench::default()
        };
        client.command_wrench(&push).expect("a wrench");
        client.wait_for_message(TIMEOUT).expect("a message");
    }
    let q = client.state().expect("a state").q;
    let [from_m, to_m] = [before, q].map(|q| SrsArm::iiwa7().forward(&q).position_m());
    assert!(from_m.distance(to_m) > 0.005, "{from_m} {to_m}");
    let refused = client.command(ArmCommand::Position(q));
    assert!(matches!(refused, Err(FriError::OtherMode { .. })));

    let mut client = commanding(torque_arm(), ClientCommandMode::Torque);
    let mut torque = JointTorques([0.0; 7]);
    torque.0[6] = 50.0;
    let refused = client.command(ArmCommand::Torque(torque));
    let limit = |e| matches!(e, FriError::Limit(LimitViolation::Torque { joint: 6, .. }));
    assert!(refused.is_err_and(limit));
    assert_eq!(client.statistics().refused, 1);
}

#[test]
fn a_cycle_allocates_nothing() {
    let mut client = commanding(torque_arm(), ClientCommandMode::Torque);
    let q = client.state().expect("a state").q;
    for command in [
        ArmCommand::Torque(JointTorques([0.5; 7])),
        ArmCommand::Position(q),
        ArmCommand::Hold,
    ] {
        let counted = allocation_counter::measure(|| {
            assert!(cycle(&mut client, command).is_ok());
        });
        assert_eq!(counted.count_total, 0, "{command:?}");
    }
}
