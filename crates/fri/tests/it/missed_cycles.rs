//! The controller and commands after missed cycles: a delay, never a jump.

use crate::common::bench::{Bench, config, servo, start};
use hwall_fri::codec::{
    ClientCommandMode, Codec, CommandData, CommandMessage, DATAGRAM_BYTES, Datagram, Header,
    SessionState,
};
use hwall_fri::controller::{Controller, ControllerConfig, EndReason, Link, LinkConfig};
use hwall_fri::{FriVersion, LimitViolation};
use hwall_kinematics::SrsArm;

/// A client whose sine follows the time requests the path of all its missed cycles at once.
#[test]
fn an_arm_that_missed_commands_is_late_and_does_not_leap() {
    let config = config(ClientCommandMode::Position);
    let most_rad = 1.05 * 1e-3 * SrsArm::iiwa7().max_velocity_rad_per_s()[0] + 1.001e-5;
    let mut bench = Bench::new(servo(), config, LinkConfig::default());
    let from_rad = start()[0];
    let (mut last_rad, mut farthest_rad) = (from_rad, 0.0);
    let mut go = |bench: &mut Bench<_>, seconds: f64| {
        let mut began_s = None;
        bench.run(seconds, |_, message, data| {
            let stamp = message.data.expect("data").time.expect("a time stamp");
            let now_s = stamp.to_ns() as f64 * 1e-9;
            let t_s = now_s - *began_s.get_or_insert(now_s);
            data.position_rad.as_mut().expect("positions")[0] = farthest_rad + 0.5 * t_s;
            let told = message.data.and_then(|d| d.commanded_position_rad);
            let told_rad = told.expect("positions")[0];
            assert!((told_rad - last_rad).abs() < most_rad, "{now_s} s");
            last_rad = told_rad;
        });
        farthest_rad = last_rad;
    };
    go(&mut bench, 1.0);
    assert_eq!(bench.controller.state(), SessionState::CommandingActive);
    // Thirty cycles without an answer; the sine of the client went on.
    let silence = LinkConfig {
        loss: 1.0,
        ..LinkConfig::default()
    };
    bench.back = Link::new(silence).expect("a link");
    bench.run(0.03, |_, _, _| {});
    bench.back = Link::new(LinkConfig::default()).expect("a link");
    bench.run(0.1, |_, message, data| {
        data.position_rad.as_mut().expect("positions")[0] = farthest_rad + 0.015;
        let told = message.data.and_then(|d| d.commanded_position_rad);
        let told_rad = told.expect("positions")[0];
        let step_rad = told_rad - last_rad;
        assert!(step_rad.abs() < most_rad, "{step_rad}");
        last_rad = told_rad;
    });
    assert!((last_rad - farthest_rad - 0.015).abs() < 1e-9, "it arrives");
    assert_eq!(bench.controller.ended(), None);
}

/// With a multiplier a client may answer a message before its last command's message. The number of cycles between them must not wrap to billions,
/// which would allow any step.
#[test]
fn an_answer_to_an_older_message_allows_no_longer_step() {
    let config = ControllerConfig {
        receive_multiplier: 5,
        ..config(ClientCommandMode::Position)
    };
    let mut controller = Controller::new(servo(), config).expect("a controller");
    let codec = Codec::new(FriVersion::V1_15);
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    let mut answer = |controller: &mut Controller<_>, reflected: u32, offset_rad: f64| {
        let mut q_rad = start().0;
        q_rad[0] += offset_rad;
        let command = CommandMessage {
            header: Header {
                sequence: 0,
                reflected_sequence: reflected,
            },
            data: Some(CommandData {
                position_rad: Some(q_rad),
                ..CommandData::default()
            }),
        };
        let length = codec.encode_command(&command, &mut buffer).expect("bytes");
        controller.receive(&buffer[..length]);
    };
    let mut datagram: Datagram = [0; DATAGRAM_BYTES];
    let mut sequence = 0;
    while controller.state() != SessionState::CommandingActive {
        let length = controller.cycle(&mut datagram).expect("a cycle");
        let message = codec.decode_monitor(&datagram[..length]).expect("bytes");
        sequence = message.header.sequence;
        if controller.state() != SessionState::CommandingActive {
            answer(&mut controller, sequence, 0.0);
        }
    }
    // The last command's message is the one before this one.
    answer(&mut controller, sequence - 3, 0.05);
    controller.cycle(&mut datagram).expect("a cycle");
    let Some(EndReason::Limit(limit)) = controller.ended() else {
        panic!("{:?}", controller.ended());
    };
    assert!(matches!(limit, LimitViolation::Speed { joint: 0, .. }));
}
