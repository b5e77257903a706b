//! Every watchdog of the supervisor, one by one.

use crate::supervised::Bench;
use crate::support::{DT_S, force, home};
use glam::DVec3;
use hwall_haptics::ArmCommand;
use hwall_haptics::safety::{
    Channel, PersonPart, PersonPoint, SafeReason, SafeRequest, SafeState, SupervisorConfig,
};
use hwall_kinematics::{JointPositions, JointTorques, JointVelocities};

/// The parts of the person in the order of [`Bench::person`].
const PARTS: [Channel; 4] = [
    Channel::Fingertip,
    Channel::Palm,
    Channel::Head,
    Channel::Bystander,
];

/// A fault takes effect at once, reaches its last state in the stated time, and is forgotten after the recovery time.
fn faulty(channel: Channel, kind: &str, retreats: bool, spoil: impl Fn(&mut Bench, &mut f64)) {
    let row = format!("{channel:?} {kind}");
    let mut bench = Bench::new();
    assert_eq!(bench.run(50).state, SafeState::Normal, "{row}");
    let first = bench.step_with(&spoil);
    let SafeState::Holding { reason } = first.state else {
        panic!("{row}: {first:?}");
    };
    let named = (reason.channel(), reason.name());
    assert_eq!(named, (Some(channel), kind), "{reason:?}");
    assert_eq!(first.command, ArmCommand::Hold);
    assert_eq!(first.request, SafeRequest::Hold);
    // One bad sample: back after the recovery time.
    let mut once = Bench::after(50);
    once.step_with(&spoil);
    assert_eq!(once.step().state.name(), "holding");
    assert_eq!(once.run(270).state, SafeState::Normal, "{row}");
    // Bad for ever.
    let longest_s = bench.supervisor.config().longest_to_last_state_s();
    let after_hold = bench.run_with(310, &spoil);
    let wanted = if retreats { "retreating" } else { "stopped" };
    assert_eq!(after_hold.state.name(), wanted, "{row}: {after_hold:?}");
    let last = bench.run_with((longest_s / DT_S) as usize, &spoil);
    assert_eq!(last.state.name(), "stopped", "{row}");
    assert_eq!(last.command, ArmCommand::Hold);
    assert!(!last.latched);
    assert_eq!(bench.run(600).state, SafeState::Normal, "{row}");
}

#[test]
fn nan_on_every_channel() {
    use Channel::*;
    const NAN: f64 = f64::NAN;
    const INFINITY: f64 = f64::INFINITY;
    type Spoil = fn(&mut Bench, &mut f64);
    let spoils: [(Channel, bool, Spoil); 13] = [
        (Time, false, |_, now| *now = NAN),
        (Position, false, |b, _| b.state.t_s = INFINITY),
        (Position, false, |b, _| b.state.q[3] = NAN),
        (Velocity, false, |b, _| b.state.qd[0] = INFINITY),
        (Torque, true, |b, _| {
            b.state.external_torque = Some(JointTorques([NAN; 7]));
        }),
        (Fingertip, true, |b, _| b.person[0].position_m.x = NAN),
        (Palm, true, |b, _| b.person[1].position_m.y = INFINITY),
        (Head, true, |b, _| b.person[2].stamp_s = NAN),
        (Bystander, true, |b, _| b.person[3].position_m.z = NAN),
        (Target, true, |b, _| b.target = Some(DVec3::NAN)),
        (Force, true, |b, _| b.force = Some(force(DVec3::NAN))),
        (Command, false, |b, _| {
            b.command = ArmCommand::Position(JointPositions([NAN; 7]));
        }),
        (Command, false, |b, _| {
            b.command = ArmCommand::Torque(JointTorques([INFINITY; 7]));
        }),
    ];
    for (channel, retreats, spoil) in spoils {
        faulty(channel, "non_finite", retreats, spoil);
    }
}

#[test]
fn stale_inputs() {
    faulty(Channel::Position, "stale", false, |b, _| b.state.t_s -= 0.2);
    faulty(Channel::Position, "stale", false, |b, _| b.state.t_s += 0.2);
    for (part, channel) in PARTS.into_iter().enumerate() {
        faulty(channel, "stale", true, |b, _| b.person[part].stamp_s -= 0.3);
    }
}

/// An input that was present once and no longer comes ages.
#[test]
fn missing_inputs() {
    let missing = |channel: Channel, steps: usize, spoil: &dyn Fn(&mut Bench)| {
        let mut bench = Bench::after(10);
        let before = bench.run_with(steps - 20, |b, _| spoil(b));
        assert_eq!(before.state, SafeState::Normal);
        let after = bench.run_with(40, |b, _| spoil(b));
        let reason = after.state.reason().unwrap();
        assert_eq!((reason.channel(), reason.name()), (Some(channel), "stale"));
        assert_eq!(after.state.name(), "holding");
    };
    for (part, channel) in PARTS.into_iter().enumerate() {
        missing(channel, 60, &|b| {
            b.person.remove(part);
        });
    }
    missing(Channel::Torque, 100, &|b| b.state.external_torque = None);
    missing(Channel::Force, 100, &|b| b.force = None);
    // Not once it has been deregistered.
    let mut bench = Bench::after(10);
    for part in PersonPart::ALL {
        bench.supervisor.forget(part);
    }
    let step = bench.run_with(2000, |b, _| b.person.clear());
    assert_eq!(step.state, SafeState::Normal);
}

/// Jumps alternate, so that they last.
#[test]
fn jumping_inputs() {
    let odd = |b: &Bench| b.ticks % 2 == 1;
    let by = move |b: &Bench, size: f64| if odd(b) { size } else { 0.0 };
    faulty(Channel::Time, "jump", false, move |b, now| {
        *now += if odd(b) { 5.0 } else { -5.0 }
    });
    faulty(Channel::Position, "jump", false, move |b, _| {
        b.state.q[1] += by(b, 0.1)
    });
    faulty(Channel::Velocity, "jump", false, move |b, _| {
        b.state.qd[6] += by(b, 1.6)
    });
    for (part, channel) in PARTS.into_iter().enumerate() {
        let axis = [0, 2, 1, 1][part];
        faulty(channel, "jump", true, move |b, _| {
            b.person[part].position_m[axis] += by(b, 0.5)
        });
    }
    faulty(Channel::Command, "jump", false, |b, _| {
        let mut far = home();
        far[0] += 0.8;
        b.command = ArmCommand::Position(far);
    });
}

#[test]
fn a_clock_that_stands_or_runs_backwards() {
    let mut bench = Bench::after(10);
    let stands = bench.run_with(30, |_, now| *now = 10.02);
    assert_eq!(stands.state.name(), "holding");
    let reason = stands.state.reason().unwrap();
    assert_eq!(reason.channel(), Some(Channel::Time));
    let last = bench.run_with(2500, |_, now| *now = 10.02);
    assert_eq!(last.state.name(), "stopped");
    let mut bench = Bench::after(10);
    let back = bench.step_with(|_, now| *now -= 0.1);
    assert_eq!(back.state.reason().unwrap().name(), "jump");
}

#[test]
fn frozen_inputs() {
    let frozen = |channel: Channel, within: usize, spoil: &dyn Fn(&mut Bench)| {
        let mut bench = Bench::after(20);
        let mut seen = None;
        for i in 0..within {
            // The command moves slowly, and the arm with it.
            let mut q = home();
            q[0] += 2e-4 * i as f64;
            bench.command = ArmCommand::Position(q);
            bench.state.q = q;
            bench.state.qd[0] = 0.2;
            bench.state.external_torque = Some(JointTorques([0.1 + 1e-6 * i as f64; 7]));
            let step = bench.step_with(|b, _| spoil(b));
            if let SafeState::Holding { reason } = step.state {
                seen = Some(reason);
                break;
            }
            assert_eq!(step.state, SafeState::Normal, "{channel:?} {i}");
        }
        let reason = seen.unwrap_or_else(|| panic!("{channel:?}: not seen"));
        assert_eq!((reason.channel(), reason.name()), (Some(channel), "frozen"));
    };
    frozen(Channel::Position, 120, &|b| b.state.q = home());
    frozen(Channel::Velocity, 230, &|b| {
        b.state.qd = JointVelocities([0.02; 7])
    });
    frozen(Channel::Torque, 230, &|b| {
        b.state.external_torque = Some(JointTorques([0.3; 7]))
    });
    for (part, y_m) in [0.0, 0.1, 0.3].into_iter().enumerate() {
        frozen(PARTS[part], 1050, &|b| {
            b.person[part].position_m = DVec3::new(2.0, y_m, 1.0)
        });
    }
    // An arm at rest is not frozen, nor is a noiseless sensor that reads zero.
    let mut bench = Bench::new();
    assert_eq!(bench.run(3000).state, SafeState::Normal);
}

#[test]
fn an_arm_whose_person_was_never_whole_does_not_even_withdraw() {
    let mut bench = Bench::new();
    // The fingertip is seen once and lost; the head never comes.
    bench.person.truncate(1);
    for k in 0..3000 {
        let step = bench.step_with(|bench, _| {
            if k > 0 {
                bench.person.clear();
            }
        });
        assert_eq!(step.command, ArmCommand::Hold, "{k}: {}", step.state);
    }
}

#[test]
fn an_arm_that_measures_no_torques_moves_only_if_that_is_said() {
    for (requires_torque, name) in [(true, "holding"), (false, "normal")] {
        let mut bench = Bench::with(SupervisorConfig {
            requires_torque,
            ..SupervisorConfig::default()
        });
        let step = bench.run_with(50, |bench, _| bench.state.external_torque = None);
        assert_eq!(step.state.name(), name);
        let channel = Channel::Torque;
        let reason = requires_torque.then_some(SafeReason::Unseen(channel));
        assert_eq!(step.state.reason(), reason);
        assert_eq!(bench.run(5).state, SafeState::Normal);
    }
}

#[test]
fn a_part_that_is_required_is_missed_when_it_is_lost() {
    for part in [PersonPart::Elbow, PersonPart::OtherHand] {
        for is_required in [true, false] {
            let mut config = SupervisorConfig::default();
            config.required.extend(is_required.then_some(part));
            let mut bench = Bench::with(config);
            let palm = bench.person[1];
            bench.person.push(PersonPoint { part, ..palm });
            assert_eq!(bench.run(20).state, SafeState::Normal);
            bench.person.pop();
            let name = if is_required { "holding" } else { "normal" };
            assert_eq!(bench.run(100).state.name(), name, "{part:?}");
        }
    }
}

/// Whom frames no longer show stays where last seen: the person, or a bystander. Whoever has left is forgotten alone, and a bystander who is back is no
/// longer missed.
#[test]
fn the_person_and_bystanders_come_and_go_apart() {
    let mut bench = Bench::new();
    let known = |bench: &Bench| bench.supervisor.person().capsules().count();
    let all = (bench.run(10).state, known(&bench));
    // Head, torso and one arm of the person; head and torso of the bystander.
    assert_eq!(all, (SafeState::Normal, 5));
    for part in [2, 3] {
        let one = bench.run_with(100, |b, _| {
            b.person.remove(part);
        });
        assert_eq!((one.state.name(), known(&bench)), ("holding", 5));
        assert_eq!(bench.run(400).state, SafeState::Normal);
    }
    bench.supervisor.forget_person();
    assert_eq!(known(&bench), 2);
    let gone = bench.run_with(10, |b, _| {
        b.person.drain(..3);
    });
    let reason = SafeReason::Unseen(Channel::Head);
    assert_eq!(gone.state, SafeState::Holding { reason });
    assert_eq!(bench.run(400).state, SafeState::Normal);
    assert_eq!(known(&bench), 5);
    bench.supervisor.forget(PersonPart::Bystander1);
    let left = bench.run_with(400, |b, _| b.person.truncate(3));
    assert_eq!((left.state, known(&bench)), (SafeState::Normal, 3));
}
