//! The client against the controller over loopback, in real time. Nothing here depends on the speed of the machine: cycles may be missed, but each is
//! answered or counted.

use crate::common::bench::{self, servo, start};
use crate::common::full_monitor;
use hwall_fri::codec::{ClientCommandMode, Codec, DATAGRAM_BYTES, SessionState};
use hwall_fri::controller::{
    Controller, ControllerConfig, ControllerStatistics, EndReason, EventKind, LinkConfig,
    QualityConfig, UdpController,
};
use hwall_fri::{
    ClientStatistics, FriClient, FriClientConfig, FriError, FriVersion, LimitViolation,
};
use hwall_haptics::{Arm, ArmCommand};
use hwall_kinematics::{ArmKinematics, JointPositions, JointTorques, SrsArm};
use hwall_testkit::refused;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

const TIMEOUT: Duration = Duration::from_secs(20);

/// A quality that holds on a busy machine.
const PATIENT: QualityConfig = QualityConfig {
    window: 100,
    least: 20,
    fair: 0.01,
    good: 0.02,
    excellent: 0.95,
};

fn config() -> ControllerConfig {
    ControllerConfig {
        // A pause of the machine must not fail a test.
        command_expiry_s: 5.0,
        quality: PATIENT,
        ..bench::config(ClientCommandMode::Position)
    }
}

fn any_port() -> SocketAddr {
    SocketAddr::from((Ipv4Addr::LOCALHOST, 0))
}

fn client(version: FriVersion) -> FriClient {
    let model: Arc<dyn ArmKinematics> = Arc::new(SrsArm::iiwa7());
    let config = FriClientConfig {
        listen: any_port(),
        version,
        silence_s: 10.0,
        ..FriClientConfig::default()
    };
    FriClient::bind(&model, config).expect("a client")
}

/// The result after both have ended.
struct Outcome {
    controller: ControllerStatistics,
    client: ClientStatistics,
    ended: Option<EndReason>,
    states: Vec<SessionState>,
}

/// Ends the controller's thread even if a test fails.
struct EndsAtLast<'a>(&'a AtomicBool);

impl Drop for EndsAtLast<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Runs a controller in its own thread while the client runs.
fn with_controller(config: ControllerConfig, body: impl FnOnce(&mut FriClient)) -> Outcome {
    let mut client = client(config.version);
    let address = client.local_address().expect("an address");
    let controller = Controller::new(servo(), config).expect("a controller");
    let link = LinkConfig::default();
    let mut udp = UdpController::bind(controller, any_port(), address, link).expect("a socket");
    let done = AtomicBool::new(false);
    let mut states = Vec::new();
    let controller = thread::scope(|scope| {
        let loop_thread = scope.spawn(|| {
            let result = udp.run(|controller| {
                while let Some(event) = controller.next_event() {
                    if let EventKind::State { to, .. } = event.kind {
                        states.push(to);
                    }
                }
                !done.load(Ordering::Relaxed)
            });
            result.expect("a controller that runs");
            *udp.controller().statistics()
        });
        {
            let _end = EndsAtLast(&done);
            body(&mut client);
        }
        loop_thread.join().expect("the controller's thread")
    });
    Outcome {
        controller,
        client: *client.statistics(),
        ended: udp.controller().ended(),
        states,
    }
}

/// Every message is answered or counted on the client's side, every expected answer on the controller's.
fn check_counts(outcome: &Outcome) {
    let (client, controller) = (&outcome.client, &outcome.controller);
    let counts = format!("{client:?} {controller:?}");
    let awaited = controller.in_time + controller.missed;
    assert_eq!(controller.expected, awaited, "{counts}");
    let dropped = client.malformed + client.foreign + client.stale;
    assert_eq!(dropped, 0, "{counts}");
    assert_eq!(controller.malformed + controller.repeated, 0, "{counts}");
    // Messages in transit at the end, and the idle messages of the beginning and the end.
    let received = client.answered + client.unanswered + client.skipped;
    let came = controller.in_time + controller.late;
    for (some, all) in [(received, client.received), (came, client.answered)] {
        assert!(some <= all && all - some <= 60, "{counts}");
    }
}

#[test]
fn two_seconds_at_a_kilohertz_in_every_version() {
    for version in FriVersion::ALL {
        let config = ControllerConfig {
            version,
            ..config()
        };
        let outcome = with_controller(config, |client| {
            let first_s = client.wait_for_commanding(TIMEOUT).expect("commanding");
            let q0 = client.state().expect("a state").q;
            assert!(q0.max_abs_difference(&start()) < 1e-9);
            let mut t_s = first_s;
            let mut fastest: f64 = 0.0;
            while t_s - first_s < 2.0 {
                let mut q = q0;
                q.0[3] += 0.1 * (1.0 - (3.0 * (t_s - first_s)).cos());
                client
                    .command(ArmCommand::Position(q))
                    .expect("within the limits");
                t_s = client.wait_for_message(TIMEOUT).expect("a message");
                let state = client.state().expect("a state");
                assert_eq!(state.t_s, t_s);
                fastest = fastest.max(state.qd[3].abs());
                assert!(state.external_torque.is_some());
            }
            assert!((fastest - 0.3).abs() < 0.1, "{fastest} rad/s");
        });
        assert_eq!(outcome.ended, Some(EndReason::Closed), "{version}");
        check_counts(&outcome);
        assert!(outcome.client.answered > 500, "{:?}", outcome.client);
    }
}

/// Refused commands leave the last one in force; the controller still gets its answers.
#[test]
fn commands_outside_the_limits_are_refused_here() {
    let outcome = with_controller(config(), |client| {
        client.wait_for_commanding(TIMEOUT).expect("commanding");
        let q0 = client.state().expect("a state").q;
        let mut command = |q: JointPositions| {
            let result = client.command(ArmCommand::Position(q));
            client.wait_for_message(TIMEOUT).expect("a message");
            result
        };
        let mut nan = q0;
        nan.0[2] = f64::NAN;
        assert!(matches!(command(nan), Err(FriError::Argument(_))));
        let mut leap = q0;
        leap.0[1] += 0.2;
        let speed = |e| matches!(e, FriError::Limit(LimitViolation::Speed { joint: 1, .. }));
        assert!(command(leap).is_err_and(speed));
        let beyond = JointPositions([0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let place = |e| {
            matches!(
                e,
                FriError::Limit(LimitViolation::Position { joint: 1, .. })
            )
        };
        assert!(command(beyond).is_err_and(place));
        assert!(command(q0).is_ok());
        let torque = client.command(ArmCommand::Torque(JointTorques([0.0; 7])));
        let (asked, mode) = ("torque", ClientCommandMode::Position);
        assert_eq!(torque, Err(FriError::OtherMode { asked, mode }));
        for _ in 0..100 {
            client.wait_for_message(TIMEOUT).expect("a message");
            client.command(ArmCommand::Hold).expect("held");
        }
        assert_eq!(client.session_state(), Some(SessionState::CommandingActive));
    });
    check_counts(&outcome);
    assert_eq!(outcome.client.refused, 4);
    // The controller saw none of them.
    assert_eq!(outcome.ended, Some(EndReason::Closed));
}

#[test]
fn loss_ends_commanding_and_the_client_says_so() {
    let config = ControllerConfig {
        quality: QualityConfig {
            window: 200,
            least: 50,
            fair: 0.05,
            good: 0.3,
            excellent: 0.95,
        },
        ..config()
    };
    let outcome = with_controller(config, |client| {
        client.wait_for_commanding(TIMEOUT).expect("commanding");
        // The program stalls: no answers until the controller ends commanding.
        let ended = loop {
            client.wait_for_message(TIMEOUT).expect("a message");
            if client.session_state() != Some(SessionState::CommandingActive) {
                break client.command(ArmCommand::Hold);
            }
        };
        let is_said = |e| matches!(e, FriError::CommandingEnded { .. });
        assert!(ended.is_err_and(is_said));
        // Answers continue, so commanding can begin again.
        client.begin_again();
        client.wait_for_commanding(TIMEOUT).expect("commanding");
        client.command(ArmCommand::Hold).expect("held");
    });
    assert!(outcome.client.unanswered > 100, "{:?}", outcome.client);
    let is_active = |state: &&SessionState| **state == SessionState::CommandingActive;
    let began = outcome.states.iter().filter(is_active).count();
    assert_eq!(began, 2, "{:?}", outcome.states);
}

/// Regression: the client waited without naming the version.
#[test]
fn a_controller_of_another_version_is_named() {
    let mut client = client(FriVersion::V1_15);
    let address = client.local_address().expect("an address");
    let controller = UdpSocket::bind(any_port()).expect("a socket");
    let send = |version| {
        let mut datagram = [0; DATAGRAM_BYTES];
        let length = Codec::new(version).encode_monitor(&full_monitor(), &mut datagram);
        let datagram = &datagram[..length.expect("it fits")];
        controller.send_to(datagram, address).expect("sent");
    };
    send(FriVersion::V2_7);
    let waited = client.wait_for_commanding(Duration::from_millis(50));
    let said = waited.unwrap_err().to_string();
    assert!(said.ends_with("but datagrams of FRI 2.7"), "{said}");
    // A message that it understands anyway is accepted and reported.
    send(FriVersion::V2_5);
    client.wait_for_message(TIMEOUT).expect("a message");
    let silent = client.wait_for_message(Duration::from_millis(20));
    let said = silent.unwrap_err().to_string();
    assert!(said.ends_with("but datagrams of FRI 2.5"), "{said}");
}

#[test]
fn strangers_and_noise_are_counted_and_silence_is_an_error() {
    let mut client = client(FriVersion::V1_15);
    let address = client.local_address().expect("an address");
    let silent = client.wait_for_message(Duration::from_millis(20));
    assert!(matches!(silent, Err(FriError::Silent { .. })), "{silent:?}");
    assert_eq!(client.state().err(), Some(FriError::NoMessage));
    assert_eq!(client.mirror(), Err(FriError::NoMessage));
    assert_eq!(client.command(ArmCommand::Hold), Err(FriError::NoMessage));
    let stranger = UdpSocket::bind(any_port()).expect("a socket");
    for length in [0, 1, 20, 600, 1500] {
        let noise = vec![0xa5; length];
        stranger.send_to(&noise, address).expect("sent");
    }
    let silent = client.wait_for_message(Duration::from_millis(50));
    assert!(silent.is_err());
    assert_eq!(client.statistics().malformed, 5);

    // Once a controller is connected, other senders are ignored.
    let controller = Controller::new(servo(), config()).expect("one");
    let mut udp = UdpController::bind(controller, any_port(), address, LinkConfig::default())
        .expect("a socket");
    let mut left = 200;
    thread::scope(|scope| {
        scope.spawn(|| {
            udp.run(|_| {
                left -= 1;
                left > 0
            })
        });
        client.wait_for_message(TIMEOUT).expect("a message");
        stranger.send_to(&[1, 2, 3], address).expect("sent");
        for _ in 0..50 {
            client.wait_for_message(TIMEOUT).expect("a message");
        }
    });
    assert_eq!(client.statistics().foreign, 1);
    assert_eq!(client.statistics().malformed, 5);
}

#[test]
fn settings_are_checked() {
    let model: Arc<dyn ArmKinematics> = Arc::new(SrsArm::iiwa7());
    let local = FriClientConfig {
        listen: any_port(),
        ..FriClientConfig::default()
    };
    refused!(local, |config| FriClient::bind(&model, config), {
        silence_s = 0.0;
        velocity_hz = f64::NAN;
        max_torque_n_m = [-1.0; 7];
        braking_rad_per_s2 = [0.0; 7];
    });
    let first = FriClient::bind(&model, local).expect("a client");
    let taken = FriClientConfig {
        listen: first.local_address().expect("one"),
        ..local
    };
    let refused = FriClient::bind(&model, taken).err();
    assert!(matches!(refused, Some(FriError::Io { .. })), "{refused:?}");
}

/// The final messages, which report the end of the session, also arrive over a slow network.
#[test]
fn goodbyes_come_over_a_delayed_link() {
    let socket = UdpSocket::bind(any_port()).expect("a socket");
    socket.set_read_timeout(Some(TIMEOUT)).expect("a time-out");
    let address = socket.local_addr().expect("an address");
    let controller = Controller::new(servo(), config()).expect("one");
    let link = LinkConfig {
        delay_s: 0.3,
        ..LinkConfig::default()
    };
    let mut udp = UdpController::bind(controller, any_port(), address, link).expect("a socket");
    let mut left = 60;
    let runs = udp.run(|_| {
        left -= 1;
        left > 0
    });
    runs.expect("a controller that runs");
    let sent = udp.controller().statistics().sent;
    assert_eq!(sent, 63);
    let codec = Codec::new(FriVersion::V1_15);
    let mut datagram = [0; 1500];
    let mut last = None;
    for _ in 0..sent {
        let length = socket.recv(&mut datagram).expect("every message came");
        let message = codec.decode_monitor(&datagram[..length]);
        last = Some(message.expect("a message").connection.state);
    }
    assert_eq!(last, Some(SessionState::Idle));
}
