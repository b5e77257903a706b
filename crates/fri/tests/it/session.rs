//! The controller in simulated time: states, modes, quality, guards.

use crate::common::bench::{Bench, config, servo, start, torque_arm};
use hwall_fri::codec::{
    ClientCommandMode, Codec, ConnectionQuality, DATAGRAM_BYTES, Datagram, SessionState,
};
use hwall_fri::controller::{
    Controller, ControllerConfig, EndReason, EventKind, Link, LinkConfig, SimulatedPlant,
};
use hwall_fri::{ControllerError, FriError, FriVersion, LimitViolation};
use hwall_kinematics::Wrench;
use hwall_kinematics::glam::DVec3;
use hwall_testkit::{Sampler, refused};
use std::f64::consts::TAU;

const READY: [SessionState; 4] = [
    SessionState::MonitoringWait,
    SessionState::MonitoringReady,
    SessionState::CommandingWait,
    SessionState::CommandingActive,
];

fn in_mode<P: SimulatedPlant>(plant: P, mode: ClientCommandMode) -> Bench<P> {
    Bench::new(plant, config(mode), LinkConfig::default())
}

/// With active commanding.
fn active<P: SimulatedPlant>(plant: P, mode: ClientCommandMode) -> Bench<P> {
    let mut bench = in_mode(plant, mode);
    bench.run(1.0, |_, _, _| {});
    assert_eq!(bench.states(), READY);
    bench
}

/// A network that loses this share of all datagrams, and delays the others by this delay plus at most this jitter.
const fn network(loss: f64, delay_s: f64, jitter_s: f64, seed: u64) -> LinkConfig {
    LinkConfig {
        loss,
        delay_s,
        jitter_s,
        seed,
    }
}

fn lossy(loss: f64) -> Link {
    Link::new(network(loss, 0.0, 0.0, 1)).expect("a link")
}

/// The limit beyond which commanding ended.
fn limit<P: SimulatedPlant>(bench: &Bench<P>) -> LimitViolation {
    match bench.controller.ended() {
        Some(EndReason::Limit(limit)) => limit,
        other => panic!("{other:?}"),
    }
}

fn sine(t_s: f64, amplitude: f64) -> f64 {
    amplitude * (TAU * 0.5 * t_s).sin()
}

#[test]
fn a_joint_follows_a_sine_in_every_version() {
    for version in FriVersion::ALL {
        for (send_period_ms, receive_multiplier) in [(1, 1), (1, 5), (5, 1), (2, 3), (10, 2)] {
            let config = ControllerConfig {
                version,
                send_period_ms,
                receive_multiplier,
                ..config(ClientCommandMode::Position)
            };
            let mut bench = Bench::new(servo(), config, LinkConfig::default());
            let mut worst_rad: f64 = 0.0;
            bench.run(8.0, |t_s, message, data| {
                let q = data.position_rad.as_mut().expect("positions");
                q[3] += sine(t_s, 0.2);
                let measured = message.data.and_then(|d| d.position_rad);
                let measured = measured.expect("positions");
                if t_s > 0.5 {
                    // 0.63 rad/s at most, delayed by the servo's 5 ms and some periods.
                    worst_rad = worst_rad.max((q[3] - measured[3]).abs());
                }
            });
            let name = format!("{version}, {send_period_ms} ms, every {receive_multiplier}");
            assert_eq!(bench.states(), READY, "{name}");
            let period_s = 1e-3 * f64::from(send_period_ms * receive_multiplier);
            let most_rad = 0.7 * (0.007 + 3.0 * period_s);
            assert!(worst_rad < most_rad, "{name}: {worst_rad} rad");
            let counted = bench.controller.statistics();
            let wrong = counted.missed + counted.late + counted.repeated + counted.malformed;
            assert_eq!(wrong, 0, "{name}: {counted:?}");
            let enough = counted.accepted * 2 > counted.in_time;
            assert!(enough, "{name}: {counted:?}");
            assert_eq!(bench.controller.quality(), ConnectionQuality::Excellent);
        }
    }
}

#[test]
fn torques_lie_over_the_springs_of_the_joints() {
    let mut config = config(ClientCommandMode::Torque);
    config.impedance.joint_stiffness_n_m_per_rad = [150.0; 7];
    let mut bench = Bench::new(torque_arm(), config, LinkConfig::default());
    bench.run(1.0, |_, _, _| {});
    assert_eq!(bench.states(), READY);
    let held = bench.controller.plant().q();
    assert!(held.max_abs_difference(&start()) < 0.01, "{held:?}");
    bench.run(3.0, |_, _, data| {
        data.torque_n_m = Some([0.0, 0.0, 15.0, 0.0, 0.0, 0.0, 0.0])
    });
    // 15 N m on 150 N m/rad, less the dry friction of the joint.
    let moved_rad = bench.controller.plant().q()[2] - held[2];
    assert!((moved_rad - 0.1).abs() < 0.02, "{moved_rad} rad");
    assert!(bench.controller.plant().qd()[2].abs() < 1e-3, "at rest");
    assert_eq!(bench.controller.ended(), None);
}

#[test]
fn a_wrench_lies_over_the_springs_of_the_tool() {
    let mut bench = active(torque_arm(), ClientCommandMode::Wrench);
    let before = bench.controller.plant().pose();
    bench.run(3.0, |_, _, data| {
        data.wrench = Some([0.0, 0.0, 60.0, 0.0, 0.0, 0.0])
    });
    let moved_m = bench.controller.plant().pose().position_m() - before.position_m();
    // Along the z of the tool, 60 N on 2000 N/m, less friction and the share of the posture's springs.
    let along_m = before.inverse_transform_vector(moved_m);
    assert!((along_m.z - 0.03).abs() < 0.01, "{along_m} m");
    assert!(along_m.truncate().length() < 0.01, "{along_m} m");
    // The moment about the tool's z comes first of the three.
    bench.run(2.0, |_, _, data| {
        data.wrench = Some([0.0, 0.0, 0.0, 8.0, 0.0, 0.0])
    });
    let after = bench.controller.plant().pose();
    let turned = hwall_geometry::rotation_vector(before.rotation().transpose() * after.rotation());
    let aside = turned.truncate().length();
    assert!(turned.z > 0.01 && aside < 0.02, "{turned}");
}

#[test]
fn modes_that_an_arm_cannot_do_are_refused() {
    use ClientCommandMode as Mode;
    for mode in [Mode::Torque, Mode::Wrench] {
        let refused = Controller::new(servo(), config(mode)).err();
        let expected = ControllerError::Fri(FriError::NeedsTorques(mode));
        assert_eq!(refused, Some(expected));
    }
    for mode in [Mode::None, Mode::CartesianPose] {
        let refused = Controller::new(torque_arm(), config(mode)).err();
        let expected = ControllerError::Fri(FriError::UnsupportedMode(mode));
        assert_eq!(refused, Some(expected));
    }
    let made = |config| Controller::new(servo(), config);
    refused!(ControllerConfig::default(), made, {
        send_period_ms = 0, 11;
        receive_multiplier = 0;
        command_expiry_s = f64::NAN;
        wait_s = -1.0;
    });
}

/// Loss and delay lower the quality; commanding ends with the reason.
#[test]
fn quality_falls_with_loss_and_delay() {
    let run = |link: LinkConfig| {
        let mut bench = active(servo(), ClientCommandMode::Position);
        bench.out = Link::new(link).expect("a link");
        bench.run(1.0, |_, _, _| {});
        bench
    };
    let light = run(network(0.08, 0.0, 0.0, 3));
    assert_eq!(light.controller.state(), SessionState::CommandingActive);
    assert_eq!(light.controller.quality(), ConnectionQuality::Good);
    let missed = light.controller.statistics().missed;
    assert!(missed > 40 && missed < 140, "{missed}");
    for link in [
        network(0.4, 0.0, 0.0, 4),
        network(0.0, 0.0015, 0.0, 1),
        network(0.0, 0.0002, 0.003, 5),
    ] {
        let heavy = run(link);
        let state = heavy.controller.state();
        assert!(state <= SessionState::MonitoringReady, "{link:?}");
        let fell = EventKind::Ended(EndReason::Quality(ConnectionQuality::Fair));
        let said = heavy.events.iter().any(|e| e.kind == fell);
        assert!(said, "{link:?}: {:?}", heavy.events);
    }
    // With longer periods the same delay is harmless.
    let slow = ControllerConfig {
        send_period_ms: 5,
        ..config(ClientCommandMode::Position)
    };
    let mut bench = Bench::new(servo(), slow, network(0.0, 0.0015, 0.0, 1));
    bench.run(3.0, |_, _, _| {});
    assert_eq!(bench.controller.state(), SessionState::CommandingActive);
}

/// The client falls silent: the arm holds when the command has expired, quality falls, and the session restarts with the client.
#[test]
fn a_silent_client_leaves_a_standing_arm() {
    let mut bench = in_mode(servo(), ClientCommandMode::Position);
    bench.run(2.0, |t_s, _, data| {
        data.position_rad.as_mut().expect("positions")[0] += sine(t_s, 0.3)
    });
    assert_eq!(bench.controller.state(), SessionState::CommandingActive);
    bench.out = lossy(1.0);
    bench.run(0.6, |_, _, _| {});
    let at = |kind: fn(&EventKind) -> bool| {
        let of_kind = bench.events.iter().rfind(|e| kind(&e.kind));
        of_kind.map(|e| e.t_s)
    };
    let expired_s = at(|k| *k == EventKind::Expired);
    let ended_s = at(|k| matches!(k, EventKind::Ended(_)));
    assert_eq!(bench.controller.state(), SessionState::MonitoringWait);
    // After 50 ms of silence the command expires, and a fifth of the last 250 answers is missing.
    let in_time = |t_s: f64| (t_s - 2.05).abs() < 0.005;
    assert!(expired_s.is_none_or(in_time), "{expired_s:?}");
    assert!(ended_s.is_some_and(in_time), "{ended_s:?}");
    let qd = bench.controller.plant().qd();
    assert!(qd.0.iter().all(|v| v.abs() < 1e-9), "at rest");
    bench.out = lossy(0.0);
    bench.run(1.0, |_, _, _| {});
    assert_eq!(bench.controller.state(), SessionState::CommandingActive);
    assert_eq!(bench.controller.statistics().activations, 2);
}

#[test]
fn a_command_expires() {
    let mut config = config(ClientCommandMode::Position);
    // The quality settings are tolerant here, so that expiry shows.
    config.quality.window = 1000;
    config.quality.good = 0.5;
    config.quality.fair = 0.2;
    let mut bench = Bench::new(servo(), config, LinkConfig::default());
    bench.run(2.0, |t_s, _, data| {
        data.position_rad.as_mut().expect("positions")[0] += 0.2 * t_s
    });
    bench.out = lossy(1.0);
    let began_s = bench.controller.t_s();
    bench.run(0.2, |_, _, _| {});
    let expired = bench.events.iter().find(|e| e.kind == EventKind::Expired);
    let after_s = expired.expect("it expired").t_s - began_s;
    assert!((after_s - 0.05).abs() < 0.003, "{after_s} s");
    assert_eq!(bench.controller.state(), SessionState::CommandingActive);
    assert_eq!(bench.controller.plant().qd().0[0], 0.0);
    // A client that continues as if nothing had happened is stopped; one that begins at the arm's position continues.
    bench.out = lossy(0.0);
    bench.run(0.1, |_, message, data| {
        data.position_rad = message.data.expect("data").position_rad
    });
    assert_eq!(bench.controller.state(), SessionState::CommandingActive);
}

/// Commands outside the limits end commanding; NaN is refused and does not.
#[test]
fn guards() {
    let after = |overlay: &mut dyn FnMut(&mut [f64; 7])| {
        let mut bench = active(servo(), ClientCommandMode::Position);
        bench.run(0.04, |_, _, data| {
            overlay(data.position_rad.as_mut().expect("positions"))
        });
        bench
    };
    let leap = after(&mut |q| q[2] += 0.1);
    let speed = limit(&leap);
    assert!(matches!(speed, LimitViolation::Speed { joint: 2, .. }));
    assert_eq!(leap.controller.state(), SessionState::MonitoringReady);
    let moved_rad = leap.controller.plant().q().max_abs_difference(&start());
    assert!(moved_rad < 1e-9, "{moved_rad}");

    let beyond = after(&mut |q| q[3] = -2.2);
    let place = limit(&beyond);
    assert!(matches!(place, LimitViolation::Position { joint: 3, .. }));

    let mut nan = after(&mut |q| q[1] = f64::NAN);
    assert_eq!(nan.controller.ended(), None);
    let counted = nan.controller.statistics().non_finite;
    assert!(counted >= 38, "{counted}");
    assert!(nan.controller.refusal().is_some());
    nan.run(0.02, |_, _, data| {
        data.position_rad = Some([f64::INFINITY; 7])
    });
    let expired = nan.events.iter().any(|e| e.kind == EventKind::Expired);
    assert!(expired, "refused commands expire");
    assert_eq!(nan.controller.plant().q(), start());

    // After a limit the application requests commands again only after `acknowledge`.
    let mut leap = leap;
    leap.run(1.0, |_, _, _| {});
    assert_eq!(leap.controller.state(), SessionState::MonitoringReady);
    leap.controller.acknowledge();
    leap.run(1.0, |_, _, _| {});
    assert_eq!(leap.controller.state(), SessionState::CommandingActive);
    assert_eq!(leap.controller.ended(), None);
}

#[test]
fn a_hard_push_ends_commanding() {
    let mut bench = active(torque_arm(), ClientCommandMode::Position);
    let push = Wrench {
        force_n: DVec3::new(0.0, 0.0, -150.0),
        ..Wrench::default()
    };
    let plant = bench.controller.plant_mut();
    plant.apply_wrench(push).expect("finite");
    bench.run(0.3, |_, _, _| {});
    let ended = bench.controller.ended().expect("it ended");
    assert!(matches!(ended, EndReason::ExternalTorque { .. }));
    assert!(bench.controller.state() <= SessionState::MonitoringReady);
}

#[test]
fn too_much_torque_ends_commanding() {
    let mut bench = active(torque_arm(), ClientCommandMode::Torque);
    bench.run(0.02, |_, _, data| {
        data.torque_n_m = Some([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 41.0])
    });
    let torque = LimitViolation::Torque {
        joint: 6,
        value_n_m: 41.0,
        max_n_m: 40.0,
    };
    assert_eq!(limit(&bench), torque);
}

/// Commands in the first quarter of a second have no effect, nor do commands that lack what the mode needs.
#[test]
fn commanding_begins_late_and_only_with_a_mirror() {
    let mut bench = in_mode(torque_arm(), ClientCommandMode::Torque);
    bench.run(2.0, |_, _, _| {});
    let when = |state| {
        let entered = |e: &&hwall_fri::controller::ControllerEvent| matches!(e.kind, EventKind::State { to, .. } if to == state);
        bench.events.iter().find(entered).map(|e| e.t_s)
    };
    let (wait_s, active_s) = (
        when(SessionState::CommandingWait),
        when(SessionState::CommandingActive),
    );
    let apart_s = active_s.expect("active") - wait_s.expect("waited");
    assert!((0.25..0.26).contains(&apart_s), "{apart_s} s");

    // In this mode positions without torques are not a command.
    let mut incomplete = in_mode(torque_arm(), ClientCommandMode::Torque);
    let codec = Codec::new(FriVersion::V1_15);
    incomplete.client.codec = codec;
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    for _ in 0..1500 {
        let length = incomplete.controller.cycle(&mut buffer).expect("a cycle");
        let answer = (incomplete.client).answer(&buffer[..length], &mut |_, _, _| {});
        if let Some(answer) = answer {
            let mut command = codec.decode_command(&answer).expect("a command");
            command.data.as_mut().expect("data").torque_n_m = None;
            let length = codec.encode_command(&command, &mut buffer).expect("bytes");
            incomplete.controller.receive(&buffer[..length]);
        }
    }
    assert_eq!(incomplete.controller.state(), SessionState::CommandingWait);
    assert!(incomplete.controller.statistics().incomplete > 500);
}

/// Random and repeated datagrams are counted and have no effect.
#[test]
fn malformed_and_repeated_datagrams_are_counted() {
    let mut sampler = Sampler::new(5);
    let mut bench = active(servo(), ClientCommandMode::Position);
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    for _ in 0..200 {
        let length = bench.controller.cycle(&mut buffer).expect("a cycle");
        let answer = bench.client.answer(&buffer[..length], &mut |_, _, _| {});
        let answer = answer.expect("an answer");
        bench.controller.receive(&answer);
        bench.controller.receive(&answer);
        let noise: Vec<u8> = (0..sampler.index(60))
            .map(|_| sampler.index(256) as u8)
            .collect();
        bench.controller.receive(&noise);
        bench.controller.receive(&buffer[..length]);
    }
    let statistics = bench.controller.statistics();
    assert_eq!(statistics.repeated, 200);
    assert!(statistics.malformed >= 390, "{statistics:?}");
    assert_eq!(bench.controller.state(), SessionState::CommandingActive);
    assert_eq!(bench.controller.plant().q(), start());
}

#[test]
fn the_same_datagrams_give_the_same_answers() {
    let link = network(0.1, 0.0, 0.0004, 9);
    let run = || {
        let mut bench = Bench::new(servo(), config(ClientCommandMode::Position), link);
        bench.run(3.0, |t_s, _, data| {
            data.position_rad.as_mut().expect("positions")[5] += sine(t_s, 0.1)
        });
        let mut buffer: Datagram = [0; DATAGRAM_BYTES];
        let length = bench.controller.cycle(&mut buffer).expect("a cycle");
        (buffer[..length].to_vec(), *bench.controller.statistics())
    };
    assert_eq!(run(), run());
}

fn allocations<P: SimulatedPlant>(plant: P, mode: ClientCommandMode) -> u64 {
    let mut bench = active(plant, mode);
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    let mut allocated = 0;
    for _ in 0..50 {
        let mut length = 0;
        let counted = allocation_counter::measure(|| {
            length = bench.controller.cycle(&mut buffer).expect("a cycle");
        });
        let answer = bench.client.answer(&buffer[..length], &mut |_, _, _| {});
        let answer = answer.expect("an answer");
        let received = allocation_counter::measure(|| bench.controller.receive(&answer));
        allocated += counted.count_total + received.count_total;
    }
    assert!(bench.controller.plant_mut().state().is_ok());
    allocated
}

#[test]
fn a_cycle_does_not_allocate() {
    assert_eq!(allocations(servo(), ClientCommandMode::Position), 0);
    assert_eq!(allocations(torque_arm(), ClientCommandMode::Torque), 0);
    assert_eq!(allocations(torque_arm(), ClientCommandMode::Wrench), 0);
}
