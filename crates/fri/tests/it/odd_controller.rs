//! A client in front of a misbehaving controller.

use hwall_fri::codec::{
    ClientCommandMode, Codec, ConnectionInfo, ConnectionQuality, ControlMode, DATAGRAM_BYTES,
    Datagram, DriveState, Header, InterpolatorData, MonitorData, MonitorMessage, OverlayType,
    RobotInfo, SafetyState, SessionState, TimeStamp,
};
use hwall_fri::{FriClient, FriClientConfig, FriError, FriVersion, LimitViolation, Unfit};
use hwall_haptics::{Arm, ArmCommand};
use hwall_kinematics::{ArmKinematics, JointPositions, SrsArm};
use std::net::{Ipv4Addr, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

const SOON: Duration = Duration::from_millis(50);
const PATIENT: Duration = Duration::from_secs(20);

struct Setup {
    client: FriClient,
    socket: UdpSocket,
}

impl Setup {
    fn new(silence_s: f64) -> Self {
        Self::of(FriClientConfig {
            silence_s,
            ..FriClientConfig::default()
        })
    }

    /// On a free port.
    fn of(mut config: FriClientConfig) -> Self {
        let model: Arc<dyn ArmKinematics> = Arc::new(SrsArm::iiwa7());
        config.listen.set_port(0);
        let client = FriClient::bind(&model, config).expect("a client");
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a socket");
        Self { client, socket }
    }

    fn send(&self, message: &MonitorMessage) {
        let mut datagram: Datagram = [0; DATAGRAM_BYTES];
        let codec = Codec::new(FriVersion::V1_15);
        let length = codec.encode_monitor(message, &mut datagram).expect("bytes");
        let to = self.client.local_address().expect("an address");
        self.socket.send_to(&datagram[..length], to).expect("sent");
    }

    /// Sends a message that the client takes; its time, s.
    fn hear(&mut self, message: &MonitorMessage) -> f64 {
        self.send(message);
        self.client.wait_for_message(PATIENT).expect("a message")
    }

    /// Angles of the next answer, rad.
    fn answer_rad(&self) -> [f64; 7] {
        let mut datagram: Datagram = [0; DATAGRAM_BYTES];
        let socket = &self.socket;
        socket.set_read_timeout(Some(PATIENT)).expect("a time-out");
        let length = socket.recv(&mut datagram).expect("an answer");
        let codec = Codec::new(FriVersion::V1_15);
        let answer = codec.decode_command(&datagram[..length]).expect("bytes");
        let data = answer.data.expect("data");
        data.position_rad.expect("angles")
    }

    /// Sends a message; whether the client takes the command, and the angles of its answer, rad.
    fn exchange(
        &mut self,
        message: &MonitorMessage,
        command: ArmCommand,
    ) -> (Result<(), FriError>, [f64; 7]) {
        self.hear(message);
        (self.client.command(command), self.answer_rad())
    }
}

/// All joints at 0.1 rad but one.
fn to(joint: usize, rad: f64) -> ArmCommand {
    let mut goal = JointPositions([0.1; 7]);
    goal.0[joint] = rad;
    ArmCommand::Position(goal)
}

fn message(sequence: u32) -> MonitorMessage {
    MonitorMessage {
        header: Header {
            sequence,
            reflected_sequence: 0,
        },
        robot: None,
        data: Some(MonitorData {
            position_rad: Some([0.1; 7]),
            ..MonitorData::default()
        }),
        connection: ConnectionInfo {
            state: SessionState::CommandingWait,
            quality: ConnectionQuality::Good,
            send_period_ms: Some(1),
            receive_multiplier: Some(1),
        },
        interpolator: Some(InterpolatorData {
            position_rad: Some([0.1; 7]),
            command_mode: Some(ClientCommandMode::Position),
            ..InterpolatorData::default()
        }),
    }
}

fn data(message: &mut MonitorMessage) -> &mut MonitorData {
    message.data.as_mut().expect("data")
}

fn interpolator(message: &mut MonitorMessage) -> &mut InterpolatorData {
    message.interpolator.as_mut().expect("an interpolator")
}

fn robot(message: &mut MonitorMessage) -> &mut RobotInfo {
    message.robot.as_mut().expect("a robot")
}

/// NaN would be mirrored, and a step from NaN passes every limit.
#[test]
fn nan_of_the_controller_is_no_message() {
    let mut setup = Setup::new(20.0);
    let spoilt: [fn(&mut MonitorMessage); 4] = [
        |m| data(m).position_rad = Some([f64::NAN; 7]),
        |m| data(m).commanded_position_rad = Some([f64::INFINITY; 7]),
        |m| data(m).external_torque_n_m = Some([f64::NAN; 7]),
        |m| interpolator(m).position_rad = Some([f64::NAN; 7]),
    ];
    for (n, spoil) in (1..).zip(spoilt) {
        let mut wrong = message(n);
        spoil(&mut wrong);
        setup.send(&wrong);
        let waited = setup.client.wait_for_message(SOON);
        assert!(matches!(waited, Err(FriError::Silent { .. })), "{waited:?}");
        assert_eq!(setup.client.statistics().malformed, u64::from(n));
    }
    setup.hear(&message(9));
    assert!(setup.client.mirror().is_ok());
}

/// Without time stamps, times are sums of stated periods, including absurd ones.
#[test]
fn times_do_not_overflow() {
    let mut setup = Setup::new(20.0);
    for n in 0..20 {
        let mut odd = message(900 * n);
        odd.connection.send_period_ms = Some(u32::MAX);
        let t_s = setup.hear(&odd);
        assert!(t_s <= 0.1 * 900.0 * 20.0, "{t_s}");
        assert!(setup.client.state().is_ok_and(|s| s.t_s.is_finite()));
    }
}

/// Its sequence restarts at zero, not slightly below the newest number.
#[test]
fn a_controller_that_begins_anew_after_a_silence_is_heard() {
    let mut setup = Setup::new(0.05);
    setup.hear(&message(500));
    let silent = setup.client.wait_for_message(Duration::from_millis(100));
    assert!(silent.is_err());
    setup.hear(&message(0));
    assert_eq!(setup.client.statistics().sessions, 2);
    assert_eq!(setup.client.statistics().stale, 0);
}

#[test]
fn messages_that_are_lost_or_overtaken_are_counted() {
    let mut setup = Setup::new(20.0);
    for n in [1, 5, 3, 6] {
        setup.send(&message(n));
        let came = setup
            .client
            .wait_for_message(if n == 3 { SOON } else { PATIENT });
        assert_eq!(came.is_ok(), n != 3, "{came:?}");
    }
    let counted = setup.client.statistics();
    assert_eq!((counted.lost, counted.stale), (3, 1));
}

/// A message with active commanding, from an arm without a fault.
fn active(sequence: u32) -> MonitorMessage {
    let mut message = message(sequence);
    message.connection.state = SessionState::CommandingActive;
    message.robot = Some(RobotInfo {
        joint_count: Some(7),
        safety: Some(SafetyState::NormalOperation),
        drives: Some([DriveState::Active; 7]),
        operation: None,
        control: Some(ControlMode::Position),
    });
    message
}

/// A change of a message, and the client's name for it.
type Wrong = (fn(&mut MonitorMessage), &'static str);

const WRONG: [Wrong; 7] = [
    (
        |m| robot(m).safety = Some(SafetyState::StopLevel1),
        "SAFETY_STOP_LEVEL_1",
    ),
    (|m| robot(m).drives = Some([DriveState::Off; 7]), "OFF"),
    (
        |m| robot(m).control = Some(ControlMode::NoControl),
        "NO_CONTROL",
    ),
    (
        |m| robot(m).control = Some(ControlMode::CartesianImpedance),
        "CART_IMP_CONTROL_MODE",
    ),
    (
        |m| interpolator(m).command_mode = Some(ClientCommandMode::None),
        "NO_COMMAND_MODE",
    ),
    (
        |m| interpolator(m).command_mode = Some(ClientCommandMode::CartesianPose),
        "CARTESIAN_POSE",
    ),
    (
        |m| interpolator(m).overlay = Some(OverlayType::Cartesian),
        "CARTESIAN",
    ),
];

#[test]
fn before_commanding_begins_a_wrong_value_is_waited_for_and_named() {
    for (spoil, name) in WRONG {
        let mut setup = Setup::new(20.0);
        let mut wrong = active(0);
        spoil(&mut wrong);
        setup.send(&wrong);
        let waited = setup.client.wait_for_commanding(SOON).expect_err(name);
        assert!(matches!(waited, FriError::Unfit(_)), "{waited}");
        assert!(waited.to_string().contains(name), "{waited}");
        // The answer keeps the session alive and the arm in place.
        assert!((setup.answer_rad()[0] - 0.1).abs() < 1e-12, "{name}");
        setup.send(&active(1));
        let waited = setup.client.wait_for_commanding(PATIENT);
        assert!(waited.is_ok(), "{name}: {waited:?}");
    }
}

/// The arm brakes from 0.5 rad/s, and continues when the value is suitable again.
#[test]
fn a_wrong_value_while_commanding_is_a_fault_that_ends_by_itself() {
    for (spoil, name) in WRONG {
        let mut setup = Setup::new(20.0);
        let (mut goal_rad, mut last_rad) = (0.1, 0.1);
        for n in 0..300 {
            let mut message = active(n);
            let is_wrong = (100..200).contains(&n);
            if is_wrong {
                spoil(&mut message);
            }
            match n {
                1..100 => goal_rad += 5e-4,
                200 => goal_rad = last_rad,
                _ => {}
            }
            let (taken, answer_rad) = setup.exchange(&message, to(0, goal_rad));
            match taken {
                Ok(()) => assert!(!is_wrong, "{name} {n}"),
                Err(error) => {
                    assert!(is_wrong && error.is_transient(), "{n}: {error}");
                    assert!(error.to_string().contains(name), "{error}");
                }
            }
            let step_rad = (answer_rad[0] - last_rad).abs();
            let most_rad = if n < 170 { 5.1e-4 } else { 1e-12 };
            assert!(step_rad < most_rad, "{name} {n}");
            last_rad = answer_rad[0];
        }
        assert_eq!(setup.client.statistics().refused, 100, "{name}");
    }
}

/// Omitted fields, or numbers from another version, prevent nothing.
#[test]
fn what_a_controller_does_not_say_refuses_nothing() {
    let silent: [fn(&mut MonitorMessage); 5] = [
        |m| m.robot = None,
        |m| m.robot = Some(RobotInfo::default()),
        |m| interpolator(m).command_mode = None,
        |m| interpolator(m).overlay = Some(OverlayType::None),
        |m| m.interpolator = None,
    ];
    for (n, omit) in silent.into_iter().enumerate() {
        let mut setup = Setup::new(20.0);
        let mut message = active(0);
        omit(&mut message);
        setup.send(&message);
        let waited = setup.client.wait_for_commanding(PATIENT);
        assert!(waited.is_ok(), "{n}: {waited:?}");
        let near = JointPositions([0.1001; 7]);
        let taken = setup.client.command(ArmCommand::Position(near));
        assert!(taken.is_ok(), "{n}: {taken:?}");
    }
}

/// As at the end of a loop, which holds without a message to answer.
#[test]
fn a_second_command_for_one_message_moves_nothing() {
    let mut setup = Setup::new(20.0);
    let mut sent_rad = 0.1;
    for n in 0..10 {
        setup.hear(&active(n));
        let goal = JointPositions([0.1 + 5e-4 * f64::from(n); 7]);
        let command = match n {
            0..=4 => ArmCommand::Position(goal),
            _ => ArmCommand::Hold,
        };
        for _ in 0..5 {
            setup.client.command(command).expect("taken");
            setup.client.command(ArmCommand::Hold).expect("taken");
        }
        let answer_rad = setup.answer_rad()[0];
        assert!((answer_rad - sent_rad).abs() < 5.1e-4, "message {n}");
        sent_rad = answer_rad;
    }
    assert_eq!(setup.client.statistics().answered, 10);
}

/// A controller whose arm hangs 5 mrad below its interpolator's position; one message every 10 ms.
fn loaded(sequence: u32) -> MonitorMessage {
    let mut message = active(sequence);
    message.connection.send_period_ms = Some(10);
    interpolator(&mut message).position_rad = Some([0.105; 7]);
    message
}

/// The servo error is not a command: sent at once, it would move the arm abruptly by 5 mrad.
#[test]
fn whoever_begins_at_the_measured_angles_begins_at_the_interpolator() {
    let mut setup = Setup::new(20.0);
    let mut last_rad = 0.105;
    for n in 0..120 {
        setup.hear(&loaded(n));
        let held = setup.client.interpolator();
        assert_eq!(held, Some(JointPositions([0.105; 7])));
        let measured = setup.client.state().expect("a state").q;
        let command = match n {
            // Waiting first, as a session may, changes nothing.
            0..=3 => ArmCommand::Hold,
            _ => ArmCommand::Position(measured),
        };
        setup.client.command(command).expect("taken");
        let answer_rad = setup.answer_rad()[0];
        assert!((answer_rad - last_rad).abs() < 1e-4, "{n}: {answer_rad}");
        last_rad = answer_rad;
    }
    assert!((last_rad - 0.1).abs() < 1e-12, "{last_rad}");
    assert_eq!(setup.client.statistics().refused, 0);
}

/// The request continues during the gap; the arm stood still, and continues along the same path, delayed, within its joint accelerations.
#[test]
fn after_missed_cycles_the_arm_is_late_and_does_not_leap() {
    let mut setup = Setup::new(20.0);
    let most_rad = 1e-3 * SrsArm::iiwa7().max_velocity_rad_per_s()[0];
    let mut last_rad = 0.1;
    let mut command = |sequence: u32, command: ArmCommand| {
        let (taken, [answer_rad, ..]) = setup.exchange(&active(sequence), command);
        taken.expect("no leap is asked for");
        let step_rad = answer_rad - last_rad;
        assert!(step_rad.abs() <= most_rad + 1e-12, "{step_rad}");
        last_rad = answer_rad;
        answer_rad
    };
    let goal_rad = |ms: u32| 0.1 + 8e-4 * f64::from(ms);
    for ms in 0..20 {
        command(ms, to(0, goal_rad(ms)));
    }
    // At 0.8 rad/s, 40 cycles are missed.
    let late_rad = command(60, to(0, goal_rad(60)));
    assert!(late_rad < goal_rad(25), "{late_rad}");
    let (mut before_rad, mut step_rad) = (late_rad, 8e-4);
    for ms in 61..140 {
        let rad = command(ms, to(0, goal_rad(ms)));
        let change_rad = (rad - before_rad - step_rad).abs();
        assert!(change_rad <= 8.65e-6 + 1e-12, "{ms}: {change_rad}");
        (before_rad, step_rad) = (rad, rad - before_rad);
        assert!(rad < goal_rad(ms - 20), "{ms}: still behind");
    }
    let mut arrived_rad = before_rad;
    for ms in 140..200 {
        arrived_rad = command(ms, to(0, goal_rad(140)));
    }
    assert!((arrived_rad - goal_rad(140)).abs() < 1e-12);
    // Braking after missed cycles is no jump either.
    command(240, ArmCommand::Hold);
}

/// The controller stood still meanwhile: braking from the previous speed would move a resting arm by up to 0.27 rad, and continuing at that speed
/// would be a jump.
#[test]
fn an_arm_that_stood_during_a_long_gap_begins_from_rest() {
    for (told, then_holds) in [(false, true), (false, false), (true, true), (true, false)] {
        let mut setup = Setup::new(20.0);
        let mut command = |sequence: u32, reflected: u32, command: ArmCommand| {
            let mut active = active(sequence);
            active.header.reflected_sequence = reflected;
            let (taken, answer_rad) = setup.exchange(&active, command);
            (taken, answer_rad[1])
        };
        let (mut rad, mut arrived) = (0.1, 0);
        for ms in 0..600_u32 {
            rad += 1e-6 * 4.0 * f64::from(ms.min(400));
            let (taken, sent_rad) = command(ms, arrived, to(1, rad));
            assert_eq!(taken, Ok(()), "{ms}");
            assert!((sent_rad - rad).abs() < 1e-9);
            arrived = if told { ms } else { 0 };
        }
        // 100 ms without a command, or without one that arrives; then the motion continues at 1.6 rad/s, or the arm has to hold.
        let moves_on = |ms: u32| to(1, rad + 1.6e-3 * f64::from(ms - 599));
        if told {
            for ms in 600..700 {
                let _ = command(ms, arrived, moves_on(ms));
            }
        }
        for ms in 700..900 {
            let wanted = match then_holds {
                true => ArmCommand::Hold,
                false => moves_on(ms),
            };
            let (taken, sent_rad) = command(ms, if told { arrived.max(ms) } else { 0 }, wanted);
            if then_holds || ms == 700 {
                let off_rad = sent_rad - rad;
                assert!(off_rad.abs() < 1e-9, "{told} {ms}: {off_rad} rad");
            }
            if !then_holds && ms == 700 {
                assert!(taken.is_err(), "{taken:?}");
            }
        }
    }
}

/// Another client has left the arm far from the interpolator's position.
#[test]
fn a_client_that_begins_while_commands_are_taken_begins_where_the_arm_is() {
    for said in [true, false] {
        let mut setup = Setup::new(20.0);
        let mut active = active(0);
        data(&mut active).position_rad = Some([0.899; 7]);
        data(&mut active).commanded_position_rad = said.then_some([0.9; 7]);
        let answered = setup.exchange(&active, ArmCommand::Hold);
        assert_eq!(answered, (Ok(()), [if said { 0.9 } else { 0.899 }; 7]));
    }
}

/// Regression: its arm was commanded as if it moved, and was then not at its commanded position.
#[test]
fn a_controller_that_was_restarted_takes_no_commands_until_commanding_begins() {
    let mut setup = Setup::new(0.05);
    let mut command = |message: &MonitorMessage| setup.exchange(message, ArmCommand::Hold);
    assert_eq!(command(&active(500)), (Ok(()), [0.1; 7]));
    std::thread::sleep(Duration::from_millis(100));
    // Its arm is elsewhere.
    let mut anew = message(0);
    anew.connection.state = SessionState::MonitoringReady;
    data(&mut anew).position_rad = Some([0.7; 7]);
    interpolator(&mut anew).position_rad = Some([0.7; 7]);
    let (taken, _) = command(&anew);
    assert!(matches!(taken, Err(FriError::CommandingEnded { .. })));
    anew.header.sequence = 1;
    anew.connection.state = SessionState::CommandingActive;
    assert_eq!(command(&anew), (Ok(()), [0.7; 7]));
}

/// All velocities would be half of the true ones, and every motion twice as fast.
#[test]
fn a_period_that_is_stated_too_long_is_refused() {
    let mut setup = Setup::new(20.0);
    let mut refused = 0;
    for n in 0..1000_u32 {
        let mut active = active(n);
        // The first half states 10 ms; the second half states the true period.
        active.connection.send_period_ms = Some(if n < 500 { 10 } else { 5 });
        let ns = 5_000_000 * u64::from(n);
        data(&mut active).time = Some(TimeStamp::from_ns(ns));
        setup.hear(&active);
        let unfit = setup.client.unfit();
        assert!(unfit.is_none() || unfit == Some(Unfit::Period { said_ms: 10 }) || n >= 500);
        refused += u32::from(unfit.is_some());
    }
    assert!(refused > 200, "{refused}");
}

/// A joint at 2 rad/s that is commanded to stop at once would overshoot by 0.2 rad: it brakes instead, and is led back.
#[test]
fn a_stop_harder_than_the_joints_can_brake_is_refused_and_the_arm_brakes() {
    let mut setup = Setup::new(20.0);
    let braking = FriClientConfig::default().braking_rad_per_s2[6];
    let mut command = |sequence: u32, goal_rad: f64| {
        let (taken, answer_rad) = setup.exchange(&active(sequence), to(6, goal_rad));
        (taken, answer_rad[6])
    };
    let (mut last_rad, mut step_rad) = (0.1, 0.0);
    for ms in 0..200 {
        let goal_rad = last_rad + 1e-5 * f64::from(ms);
        let (taken, rad) = command(ms, goal_rad);
        assert_eq!(taken, Ok(()), "{ms}");
        (last_rad, step_rad) = (rad, rad - last_rad);
    }
    let stands_rad = last_rad;
    for ms in 200..400 {
        let (taken, rad) = command(ms, stands_rad);
        if ms == 200 {
            assert!(matches!(
                taken,
                Err(FriError::Limit(LimitViolation::Change { joint: 6, .. }))
            ));
        }
        let change_rad = (rad - last_rad - step_rad).abs();
        assert!(change_rad <= 1.000_001e-6 * braking, "{ms}: {change_rad}");
        (last_rad, step_rad) = (rad, rad - last_rad);
    }
    // The program does not follow the arm: the arm stands where it came to rest.
    assert!(step_rad.abs() < 1e-9 && last_rad > stands_rad + 0.1);
}

#[test]
fn nobody_but_this_machine_is_listened_to_unless_told_so() {
    assert!(FriClientConfig::default().listen.ip().is_loopback());
}

/// Otherwise the first sender would control the program.
#[cfg(target_os = "linux")] // Where all of 127.0.0.0/8 is this machine.
#[test]
fn only_the_named_controller_is_listened_to() {
    let named = Ipv4Addr::new(127, 0, 0, 2);
    let mut setup = Setup::of(FriClientConfig {
        controller: Some(named.into()),
        ..FriClientConfig::default()
    });
    setup.send(&message(0));
    let waited = setup.client.wait_for_message(SOON);
    assert!(matches!(waited, Err(FriError::Silent { .. })), "{waited:?}");
    assert_eq!(setup.client.statistics().foreign, 1);
    assert_eq!(setup.client.controller(), None);
    setup.socket = UdpSocket::bind((named, 0)).expect("a socket");
    setup.hear(&message(0));
    let heard = setup.client.controller().expect("the named one");
    assert_eq!(heard.ip(), named);
    let told = setup.client.statistics().to_string();
    assert!(told.contains("1 from others"), "{told}");
}
